"""An intermittent side force, of segments whose pushes are drawn."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import straight
from straight import SETTING, UNREST

from shiplog import segments, unnamed

COUNT = 24
LEVER = 0.3  # lengths ahead of midship at which the force acts
ACROSS, TURNING = np.array([0.0, 0.01, 0.0]), np.array([0.0, 0.0, 0.004])  # of 1 N, of 1 N m


@pytest.fixture
def reference(monkeypatch):
    monkeypatch.setattr(unnamed, "accelerations", lambda *_: (ACROSS, TURNING))
    model = SimpleNamespace(stand_in=None)
    return SimpleNamespace(model=model, setting=SETTING, coefficients={}, counts=1.0)


def passed(force: float):
    """A pass of segments, a third of which are pushed by so many newtons at one place."""
    record = straight.sailed(COUNT)
    knots = segments.grid(record).knots
    unit = ACROSS + LEVER * SETTING.scale["length"] * TURNING
    on = np.random.default_rng(4).random((COUNT, knots)) < 0.3
    pushed = force * unit[None, :, None] * on[:, None]
    return straight.passed(
        record, straight.columns_of(()), pushed=pushed.reshape(COUNT, -1), seed=5
    )


def test_pushes_at_one_place_are_found_there(reference):
    linear = passed(40.0)
    none, weight = np.zeros(linear.j.shape[-1]), np.ones(COUNT)
    found = unnamed.pulses_of(linear, none, reference, UNREST, weight)
    assert found.gain > 30.0
    assert found.lever / SETTING.scale["length"] == pytest.approx(LEVER, abs=0.05)
    quiet = unnamed.pulses_of(passed(0.0), none, reference, UNREST, weight)
    assert quiet.gain < 3.0


def test_noise_that_is_raised_in_two_channels_is_no_force_at_one_place(reference):
    """Sway and yaw pushed more than usual, apart from each other, and surge as usual."""
    record = straight.sailed(COUNT)
    knots = segments.grid(record).knots
    more = replace(UNREST, push=UNREST.push * np.array([1e-3, 2.0, 2.0]))
    drawn = np.random.default_rng(8).standard_normal((COUNT, 3 * knots))
    pushed = drawn @ np.linalg.cholesky(more.kernel(knots)).T
    linear = straight.passed(record, straight.columns_of(()), pushed=pushed, seed=5)
    none, weight = np.zeros(linear.j.shape[-1]), np.ones(COUNT)
    assert unnamed.pulses_of(linear, none, reference, UNREST, weight).gain < 0.0


def test_a_segment_that_says_nothing_is_as_if_it_were_not_there(reference):
    """One on which the model ran away: rows of zeros, nothing of it seen."""
    linear = passed(40.0)
    none = np.zeros(linear.j.shape[-1])
    lost = np.arange(COUNT) == 7
    used = linear.cut.used & ~lost[:, None, None]
    zeroed = [np.where(lost.reshape(-1, *[1] * (v.ndim - 1)), 0.0, v)
              for v in (linear.e, linear.z, linear.j)]  # fmt: skip
    away = replace(linear, cut=replace(linear.cut, used=used), lost=lost,
                   e=zeroed[0], z=zeroed[1], j=zeroed[2])  # fmt: skip
    found = unnamed.pulses_of(away, none, reference, UNREST, np.where(lost, 0.0, 1.0))
    without = unnamed.pulses_of(linear.pick(~lost), none, reference, UNREST, np.ones(COUNT - 1))
    assert (found.gain, found.lever) == pytest.approx((without.gain, without.lever))
