"""An intermittent side force, of segments whose forces are drawn."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import straight
from straight import CAUSES, PROCESS_NOISE, SETTING

from shiplog.diagnosis import intermittent, likelihood, segments, unrecorded_thruster
from shiplog.diagnosis.unrecorded_thruster import SideForce

COUNT = 24
LEVER = 0.3  # lengths ahead of midship at which the force acts
ACROSS, TURNING = np.array([0.0, 0.01, 0.0]), np.array([0.0, 0.0, 0.004])  # of 1 N, of 1 N m


@pytest.fixture
def reference(monkeypatch):
    monkeypatch.setattr(unrecorded_thruster, "accelerations", lambda *_: (ACROSS, TURNING))
    model = SimpleNamespace(stand_in=None)
    return SimpleNamespace(model=model, setting=SETTING, coefficients={}, counts=1.0)


def passed(force: float):
    """A pass of segments, on a third of which so many newtons act at one place."""
    record = straight.sailed(COUNT)
    knots = segments.grid(record).knots
    unit = ACROSS + LEVER * SETTING.scale["length"] * TURNING
    on = np.random.default_rng(4).random((COUNT, knots)) < 0.3
    accelerations = force * unit[None, :, None] * on[:, None]
    return straight.passed(
        record, straight.columns_of(()), accelerations=accelerations.reshape(COUNT, -1), seed=5
    )


def test_forces_at_one_place_are_found_there(reference):
    linear = passed(40.0)
    none, weight = np.zeros(linear.j.shape[-1]), np.ones(COUNT)
    found = unrecorded_thruster.estimate_side_force(linear, none, reference, PROCESS_NOISE, weight)
    assert found.gain > 30.0
    assert found.lever / SETTING.scale["length"] == pytest.approx(LEVER, abs=0.05)
    quiet = unrecorded_thruster.estimate_side_force(
        passed(0.0), none, reference, PROCESS_NOISE, weight
    )
    assert quiet.gain < 3.0


def test_noise_that_is_raised_in_two_channels_is_no_force_at_one_place(reference):
    """Raised in sway and yaw, independently of each other, and nominal in surge."""
    record = straight.sailed(COUNT)
    knots = segments.grid(record).knots
    more = replace(
        PROCESS_NOISE, acceleration=PROCESS_NOISE.acceleration * np.array([1e-3, 2.0, 2.0])
    )
    drawn = np.random.default_rng(8).standard_normal((COUNT, 3 * knots))
    accelerations = drawn @ np.linalg.cholesky(more.kernel(knots)).T
    linear = straight.passed(record, straight.columns_of(()), accelerations=accelerations, seed=5)
    none, weight = np.zeros(linear.j.shape[-1]), np.ones(COUNT)
    assert (
        unrecorded_thruster.estimate_side_force(linear, none, reference, PROCESS_NOISE, weight).gain
        < 0.0
    )


def test_a_segment_that_says_nothing_is_as_if_it_were_not_there(reference):
    """One on which the model diverged: rows of zeros, nothing of it measured."""
    linear = passed(40.0)
    none = np.zeros(linear.j.shape[-1])
    lost = np.arange(COUNT) == 7
    used = linear.cut.used & ~lost[:, None, None]
    zeroed = [np.where(lost.reshape(-1, *[1] * (v.ndim - 1)), 0.0, v)
              for v in (linear.e, linear.z, linear.j)]  # fmt: skip
    away = replace(linear, cut=replace(linear.cut, used=used), lost=lost,
                   e=zeroed[0], z=zeroed[1], j=zeroed[2])  # fmt: skip
    found = unrecorded_thruster.estimate_side_force(
        away, none, reference, PROCESS_NOISE, np.where(lost, 0.0, 1.0)
    )
    without = unrecorded_thruster.estimate_side_force(
        linear.pick(~lost), none, reference, PROCESS_NOISE, np.ones(COUNT - 1)
    )
    assert (found.gain, found.lever) == pytest.approx((without.gain, without.lever))


def test_a_nominal_force_at_one_place_is_no_force_of_the_trial(reference):
    """Bursts at one place: a force at that place unless they are nominal there."""
    linear = passed(40.0)
    none, weight = np.zeros(linear.j.shape[-1]), np.ones(COUNT)
    found = unrecorded_thruster.estimate_side_force(linear, none, reference, PROCESS_NOISE, weight)
    nominal = found.force * found.unit
    again = unrecorded_thruster.estimate_side_force(
        linear, none, reference, PROCESS_NOISE, weight, nominal
    )
    assert (again.lever, again.force) == pytest.approx((found.lever, found.force))
    assert found.gain > 30.0 and again.gain < 1.0
    # together with a place of its own it is as much a force as before
    elsewhere = ACROSS - LEVER * SETTING.scale["length"] * TURNING
    other = unrecorded_thruster.estimate_side_force(
        linear, none, reference, PROCESS_NOISE, weight, elsewhere
    )
    assert other.gain > 20.0


# --- what is nominal of it

UNIT = np.array([0.0, 0.01, 0.004])


@pytest.fixture
def asked(monkeypatch):
    """Residuals of the nominal campaign when the force is tested, and the weights."""
    output = {}

    def estimate_side_force(linear, d, reference, process_noise, weight):
        left = likelihood.weighed(linear, process_noise).dd[:, 0, 0]
        output.update(left=left, weight=weight)
        assert not d.any()
        return SideForce(0.0, output.get("gain", 7.0), 0.3, 2.0, UNIT)

    monkeypatch.setattr(unrecorded_thruster, "estimate_side_force", estimate_side_force)
    return output


def test_a_nominal_force_at_one_place_is_tested_on_the_nominal_campaign(asked):
    record, columns = straight.sailed(12), straight.columns_of(CAUSES)
    made = straight.campaign(record, straight.passed(record, columns), columns)
    grid = segments.grid(record)
    assert intermittent.nominal_side_force(made, grid) == pytest.approx(2.0 * UNIT)
    assert asked["weight"].sum() == 12.0
    assert intermittent.nominal_side_force(replace(made, weight=np.zeros(12)), grid) is None
    asked["gain"] = -1.0  # it acts in each channel by itself
    assert intermittent.nominal_side_force(made, grid) is None


def test_what_is_nominal_of_a_cause_is_no_intermittent_force(asked):
    """Ten realistic sizes of a cause in all parts: nothing of it is left."""
    columns = straight.columns_of(CAUSES)
    record = straight.sailed(12)
    numbers = np.zeros(columns.linearised)
    numbers[columns.of["drag"]] = 5.0
    left = {}
    for own in (numbers, 0.0 * numbers):
        given = straight.passed(record, columns, own, sensitivity=3.0)
        made = straight.campaign(record, given, columns, deviation=0.02, size=0.1)
        intermittent.nominal_side_force(made, segments.grid(record))
        left[bool(own.any())] = asked["left"]
        before = likelihood.weighed(given, straight.PROCESS_NOISE).dd[:, 0, 0]
        assert not own.any() or before.min() > 3.0 * left[True].max()
    assert left[True] == pytest.approx(left[False], rel=0.1)
