"""An intermittent side force, of segments whose forces are drawn."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import straight
from straight import CAUSES, PROCESS_NOISE, SETTING

from shiplog.diagnosis.hypotheses import evidence, intermittent, unrecorded_thruster
from shiplog.diagnosis.hypotheses.intermittent import device_probability
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.linear import segment_nodes, segments
from shiplog.diagnosis.noise import likelihood, on_off, raised_noise
from shiplog.diagnosis.noise.remainder import INTERMITTENT, RAISED, Remainder, noise_prior
from shiplog.diagnosis.nominal.nominal_reference import Reference
from shiplog.diagnosis.trial.fitted import Fit

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
    nodes = segments.grid(record).nodes
    unit = ACROSS + LEVER * SETTING.scale["length"] * TURNING
    on = np.random.default_rng(4).random((COUNT, nodes)) < 0.3
    accelerations = force * unit[None, :, None] * on[:, None]
    return straight.passed(
        record, straight.columns_of(()), accelerations=accelerations.reshape(COUNT, -1), seed=5
    )


def left_by(linear, weight):
    none = np.zeros(linear.j.shape[-1])
    return raised_noise.residual(linear, none, PROCESS_NOISE, weight, 1.0)


def estimated(linear, weight, reference, at_one_place=None):
    return unrecorded_thruster.estimate_side_force(left_by(linear, weight), reference, at_one_place)


def test_noise_is_raised_in_each_channel_by_as_much_as_was_drawn():
    """In addition to the nominal noise: three times that in sway, as much as that in surge."""
    count = 4 * COUNT  # so that the spread of a drawn factor is 4 %
    record, drawn_by = straight.sailed(count), np.array([1.0, 3.0, 1.5])
    nodes = segments.grid(record).nodes
    more = replace(PROCESS_NOISE, acceleration=PROCESS_NOISE.acceleration * drawn_by)
    drawn = np.random.default_rng(8).standard_normal((count, 3 * nodes))
    accelerations = drawn @ np.linalg.cholesky(more.kernel(nodes)).T
    linear = straight.passed(record, straight.columns_of(()), accelerations=accelerations, seed=5)
    left = left_by(linear, np.ones(count))
    value, remainder = raised_noise.raise_channels(left)
    assert remainder.kind == RAISED
    assert remainder.channels == pytest.approx(tuple(np.hypot(1.0, drawn_by)), rel=0.1)
    alike = max(left.likelihood(PROCESS_NOISE.times(f)) for f in np.linspace(0.5, 4.0, 50))
    assert value == pytest.approx(left.likelihood(remainder.apply_to(PROCESS_NOISE)))
    assert value > alike + 10.0


def test_nominal_noise_at_one_place_is_raised_with_the_others():
    left = left_by(passed(40.0), np.ones(COUNT))
    nominal = Remainder(INTERMITTENT, intermittent=(0.0, 0.01, 0.004), force_lasts=0.5)
    _, remainder = raised_noise.raise_channels(left, nominal)
    side = (remainder.channels[1] * remainder.channels[2]) ** 0.5
    assert remainder.intermittent == pytest.approx((0.0, 0.01 * side, 0.004 * side))
    assert remainder.force_lasts == pytest.approx(0.5 * remainder.noise_lasts)


def test_raised_noise_lasts_as_long_as_was_drawn():
    """Three times as large and five times as long as the nominal noise, which is nearly nothing."""
    count = 2 * COUNT
    record = straight.sailed(count)
    nodes = segments.grid(record).nodes
    small = replace(PROCESS_NOISE, acceleration=0.1 * PROCESS_NOISE.acceleration)
    more = replace(PROCESS_NOISE.times(3.0), time=5.0 * PROCESS_NOISE.time)
    drawn = np.random.default_rng(8).standard_normal((count, 3 * nodes))
    accelerations = drawn @ np.linalg.cholesky(more.kernel(nodes)).T
    linear = straight.passed(record, straight.columns_of(()), accelerations=accelerations, seed=5)
    none = np.zeros(linear.j.shape[-1])
    left = raised_noise.residual(linear, none, small, np.ones(count), 1.0)
    value, remainder = raised_noise.raise_channels(left)
    assert remainder.noise_lasts == pytest.approx(5.0, rel=0.25)
    as_long = replace(remainder, noise_lasts=1.0).apply_to(small)
    assert value > left.likelihood(as_long) + 10.0


def test_forces_at_one_place_are_found_there(reference):
    linear = passed(40.0)
    weight = np.ones(COUNT)
    found = estimated(linear, weight, reference)
    assert found.gain > 30.0
    assert found.lever / SETTING.scale["length"] == pytest.approx(LEVER, abs=0.05)
    quiet = estimated(passed(0.0), weight, reference)
    assert quiet.gain < 3.0


def test_a_force_lasts_as_long_as_was_drawn(reference):
    """Twice and half the usual time, of a force that is large next to the noise."""
    unit = ACROSS + LEVER * SETTING.scale["length"] * TURNING
    record = straight.sailed(4 * COUNT)
    nodes, usual = segments.grid(record).nodes, PROCESS_NOISE.intermittent_time
    for lasts in (0.5, 2.0):
        alone = replace(
            PROCESS_NOISE, acceleration=1e-6 * PROCESS_NOISE.acceleration,
            intermittent=20.0 * unit, intermittent_time=lasts * usual,
        )  # fmt: skip
        drawn = np.random.default_rng(3).standard_normal((4 * COUNT, 3 * nodes))
        pushed = drawn @ np.linalg.cholesky(alone.kernel(nodes)).T
        linear = straight.passed(record, straight.columns_of(()), accelerations=pushed, seed=5)
        found = estimated(linear, np.ones(4 * COUNT), reference)
        assert found.lasts == pytest.approx(lasts, rel=0.4)
        assert found.force == pytest.approx(20.0, rel=0.2)
        assert found.remainder.force_lasts == found.lasts
        in_noise = found.remainder.apply_to(PROCESS_NOISE)
        assert in_noise.intermittent_time == pytest.approx(found.lasts * usual)
        assert in_noise.time == PROCESS_NOISE.time


def test_noise_that_is_raised_in_two_channels_is_no_force_at_one_place(reference):
    """Raised in sway and yaw, independently of each other, and nominal in surge."""
    record = straight.sailed(COUNT)
    nodes = segments.grid(record).nodes
    more = replace(
        PROCESS_NOISE, acceleration=PROCESS_NOISE.acceleration * np.array([1e-3, 2.0, 2.0])
    )
    drawn = np.random.default_rng(8).standard_normal((COUNT, 3 * nodes))
    accelerations = drawn @ np.linalg.cholesky(more.kernel(nodes)).T
    linear = straight.passed(record, straight.columns_of(()), accelerations=accelerations, seed=5)
    assert estimated(linear, np.ones(COUNT), reference).gain < 0.0


def test_a_segment_that_says_nothing_is_as_if_it_were_not_there(reference):
    """One on which the model diverged: rows of zeros, nothing of it measured."""
    linear = passed(40.0)
    lost = np.arange(COUNT) == 7
    used = linear.cut.used & ~lost[:, None, None]
    zeroed = [np.where(lost.reshape(-1, *[1] * (v.ndim - 1)), 0.0, v)
              for v in (linear.e, linear.z, linear.j)]  # fmt: skip
    away = replace(linear, cut=replace(linear.cut, used=used), lost=lost,
                   e=zeroed[0], z=zeroed[1], j=zeroed[2])  # fmt: skip
    found = estimated(away, np.where(lost, 0.0, 1.0), reference)
    without = estimated(linear.pick(~lost), np.ones(COUNT - 1), reference)
    assert (found.gain, found.lever) == pytest.approx((without.gain, without.lever))


def test_a_nominal_force_at_one_place_is_no_force_of_the_trial(reference):
    """Bursts at one place: a force at that place unless they are nominal there."""
    linear = passed(40.0)
    weight = np.ones(COUNT)
    found = estimated(linear, weight, reference)
    again = estimated(linear, weight, reference, found.remainder)
    assert (again.lever, again.force) == pytest.approx((found.lever, found.force))
    assert found.gain > 30.0 and again.gain < 1.0
    # together with a place of its own it is as much a force as before
    elsewhere = ACROSS - LEVER * SETTING.scale["length"] * TURNING
    nominal = replace(found.remainder, intermittent=tuple(elsewhere))
    other = estimated(linear, weight, reference, nominal)
    assert other.gain > 20.0


# --- on or off


def campaign(columns):
    nominal = straight.sailed(COUNT, seed=3)
    made = straight.campaign(nominal, straight.passed(nominal, columns), columns)
    made.reference.model.stand_in = None  # what moves it is given
    return made


def pushed(force: float, seed: int = 4):
    """A trial that is pushed at one place, by a device with that force while it is on: for 12 s of
    every third segment, in either direction. The trial, and where it is on [S, J]."""
    record, columns = straight.sailed(COUNT), straight.columns_of(())
    grid = segments.grid(record)
    unit = ACROSS + LEVER * SETTING.scale["length"] * TURNING
    on = np.zeros((COUNT, grid.nodes), dtype=bool)
    on[1::3, 4:10] = True
    way = np.random.default_rng(seed).choice([-1.0, 1.0], COUNT)[:, None]
    accelerations = (unit[None, :, None] * (force * way * on)[:, None]).reshape(COUNT, -1)
    made = campaign(columns)
    given = straight.passed(record, columns, accelerations=accelerations, seed=5)
    return straight.trial(made, record, given), on


@pytest.fixture
def hull(monkeypatch):
    monkeypatch.setattr(unrecorded_thruster, "accelerations", lambda *_: (ACROSS, TURNING))
    monkeypatch.setattr(Reference, "coefficients", {})


def left_with(trial, remainder):
    found = evidence.fit(trial, trial.first, (), 1.0, remainder)
    return Fit(trial.first, found, remainder)


def test_a_device_is_on_where_it_pushes(hull):
    trial, on = pushed(150.0)
    found = intermittent.side_force(trial, left_with(trial, Remainder()))
    assert found.device == 1.0 and found.course is not None
    rows = segment_nodes.rows_of_nodes(trial.rows, trial.grid)
    starts, ends = rows[1::3, 4], rows[1::3, 9]
    assert found.course.on == tuple(zip(starts.tolist(), ends.tolist(), strict=True))
    assert found.lever / SETTING.scale["length"] == pytest.approx(LEVER, abs=0.02)
    # fitted with it, the process noise pushes while it is on, and there only
    fit = left_with(trial, found.remainder)
    force, deviation = intermittent.force_at_nodes(trial, fit, found)
    assert np.abs(force[~on]).max() < 1e-6 * np.abs(force[on]).min()
    assert np.abs(force[on]).mean() == pytest.approx(150.0, rel=0.1)
    assert np.isfinite(deviation).all()
    assert intermittent.add_pattern(trial, fit, found) is found
    # it is more probable, with the course's own probability, than one that may act at any time
    always = replace(found.remainder, course=None)
    assert fit.estimate.evidence > left_with(trial, always).estimate.evidence + 50.0


def test_the_times_of_a_device_are_those_of_its_pulses(hull):
    """From half of the time between two nodes before its first one to as long after its last."""
    trial, _ = pushed(150.0)
    found = intermittent.side_force(trial, left_with(trial, Remainder()))
    fit = left_with(trial, found.remainder)
    times = intermittent.active_intervals(trial, fit, found)
    begins, node_step = trial.record.time[trial.rows], trial.grid.node_step
    assert [one["start_s"] for one in times] == (begins[1::3] + 3.5 * node_step).tolist()
    assert [one["end_s"] for one in times] == (begins[1::3] + 9.5 * node_step).tolist()
    assert {one["voyage"] for one in times} == set(trial.record.names)
    ways = np.random.default_rng(4).choice([-1.0, 1.0], COUNT)[1::3]  # as they were drawn
    strongest = [one["force_N"] for one in times]
    assert strongest == pytest.approx(150.0 * ways, rel=0.25)
    assert all(0.0 < one["sd_N"] < 30.0 for one in times)
    # where the force may act at any time, of the course that its estimate has by then
    always = replace(found, course=None)
    without = left_with(trial, always.remainder)
    again = intermittent.active_intervals(trial, without, always)
    assert [one["start_s"] for one in again] == [one["start_s"] for one in times]


def test_the_course_of_a_hypothesis_stays_where_it_is_more_probable(hull, monkeypatch):
    """A course that is drawn anew from another estimate may be worse."""
    trial, _ = pushed(150.0)
    first = intermittent.side_force(trial, left_with(trial, Remainder()))
    worse = on_off.Course(first.course.on[:2], first.course.prior)
    monkeypatch.setattr(on_off, "course", lambda *_: worse)
    again = intermittent.side_force(trial, left_with(trial, first.remainder))
    assert again.course == first.course
    assert intermittent.side_force(trial, left_with(trial, Remainder())).course is None


def test_a_force_that_varies_has_no_course(hull):
    """Drawn as the likelihood takes it, at any time."""
    record, columns = straight.sailed(4 * COUNT), straight.columns_of(())
    made = campaign(columns)
    unit = ACROSS + LEVER * SETTING.scale["length"] * TURNING
    varies = replace(PROCESS_NOISE, acceleration=1e-6 * PROCESS_NOISE.acceleration,
                     intermittent=20.0 * unit)  # fmt: skip
    drawn = np.random.default_rng(3).standard_normal((4 * COUNT, 3 * segments.grid(record).nodes))
    accelerations = drawn @ np.linalg.cholesky(varies.kernel(segments.grid(record).nodes)).T
    given = straight.passed(record, columns, accelerations=accelerations, seed=5)
    trial = straight.trial(made, record, given)
    found = intermittent.side_force(trial, left_with(trial, Remainder()))
    assert found.gain > 30.0
    assert (found.device, found.course) == (0.0, None)


def test_what_is_on_or_off_is_of_the_shape_and_the_prior_of_a_remainder():
    force = Remainder(INTERMITTENT, intermittent=(0.0, 0.01, 0.004), force_lasts=1.5)
    device = replace(force, course=on_off.Course(((30, 60),), -12.0))
    assert device.shape != force.shape
    assert noise_prior(1.0, 0.2, device) == noise_prior(1.0, 0.2, force) - 12.0
    usual = replace(device, force_lasts=1.0), replace(force, force_lasts=1.0)
    assert noise_prior(1.0, 0.2, usual[0]) == noise_prior(1.0, 0.2, usual[1]) - 12.0
    rows = np.array([[20, 30, 40], [60, 70, 80]])
    runs = device.apply_to(PROCESS_NOISE, rows).runs
    assert runs.tolist() == on_off.runs(((30, 60),), rows).tolist()
    assert device.apply_to(PROCESS_NOISE).runs is None  # its size only
    assert force.apply_to(PROCESS_NOISE, rows).runs is None


# --- what is nominal of it

UNIT = np.array([0.0, 0.01, 0.004])


@pytest.fixture
def asked(monkeypatch):
    """Residuals of the nominal campaign when the force is tested, and the weights."""
    output = {}

    real = raised_noise.residual

    def residual(linear, d, nominal, weight, counts):
        left = likelihood.weighed(linear, nominal).dd[:, 0, 0]
        output.update(left=left, weight=weight)
        assert not d.any()
        return real(linear, d, nominal, weight, counts)

    def estimate_side_force(left, reference):
        return SideForce(0.0, output.get("gain", 7.0), 0.3, 2.0, UNIT)

    monkeypatch.setattr(raised_noise, "residual", residual)
    monkeypatch.setattr(unrecorded_thruster, "estimate_side_force", estimate_side_force)
    return output


def test_a_nominal_force_at_one_place_is_tested_on_the_nominal_campaign(asked):
    record, columns = straight.sailed(12), straight.columns_of(CAUSES)
    made = straight.campaign(record, straight.passed(record, columns), columns)
    grid = segments.grid(record)
    found = intermittent.nominal_side_force(made, grid)
    assert found is not None and found.intermittent == pytest.approx(tuple(2.0 * UNIT))
    assert asked["weight"].sum() == 12.0
    assert intermittent.nominal_side_force(replace(made, weight=np.zeros(12)), grid) is None
    asked["gain"] = -1.0  # it acts in each channel by itself
    assert intermittent.nominal_side_force(made, grid) is None


def test_what_is_nominal_of_a_cause_is_no_intermittent_force(asked):
    """Ten realistic sizes of a cause in all parts: nothing of it is left."""
    columns = straight.columns_of(CAUSES)
    record = straight.sailed(12)
    numbers = np.zeros(columns.linearised)
    numbers[columns.indices["drag"]] = 5.0
    left = {}
    for own in (numbers, 0.0 * numbers):
        given = straight.passed(record, columns, own, sensitivity=3.0)
        made = straight.campaign(record, given, columns, deviation=0.02, size=0.1)
        intermittent.nominal_side_force(made, segments.grid(record))
        left[bool(own.any())] = asked["left"]
        before = likelihood.weighed(given, straight.PROCESS_NOISE).dd[:, 0, 0]
        assert not own.any() or before.min() > 3.0 * left[True].max()
    assert left[True] == pytest.approx(left[False], rel=0.1)


# --- one device


def test_a_force_that_is_on_or_off_is_one_device():
    rng = np.random.default_rng(0)
    on = np.repeat(rng.uniform(size=(30, 4)) < 0.25, 4, axis=1)
    force = 5.0 * on + 0.3 * rng.standard_normal(on.shape)
    assert device_probability(force, np.full(on.shape, 0.3)) == 1.0
    assert device_probability(-force, np.full(on.shape, 0.3)) == 1.0


@pytest.mark.parametrize(
    ("between", "probability"), [(4, 1.0), (5, 0.5), (9, 0.5), (10, 0.0), (14, 0.0)]
)
def test_an_unclear_pattern_is_as_probably_one_device_as_not(between, probability):
    """Ten nodes at 5 N, some at 2 N, the others at none."""
    force = np.repeat([5.0, 2.0, 0.0], [10, between, 40 - between])[None]
    assert device_probability(force, np.full(force.shape, 0.3)) == probability


def test_a_force_that_merely_varies_is_none():
    """Gaussian, from one node to the next or from one segment to the next: 1.13 times as
    long between as above, and in a long trial hardly less."""
    rng = np.random.default_rng(1)
    varies = 5.0 * rng.standard_normal((600, 16))
    slow = np.repeat(5.0 * rng.standard_normal((4000, 1)), 16, axis=1)
    for force in (varies, slow):
        assert device_probability(force, np.full(force.shape, 0.3)) == 0.0
    unmeasured = np.full(varies.shape, 2.0)
    assert device_probability(0.2 * varies, unmeasured) == 0.0


def test_noise_at_one_place_lasts_longer_with_the_others_and_counts_once():
    """The prior of a correlation time is that of one number, whether part acts at one place."""
    plain = Remainder(RAISED, channels=(2.0, 3.0, 2.0), noise_lasts=3.0)
    partly = replace(plain, intermittent=(0.0, 0.01, 0.004), force_lasts=1.5)
    usual = replace(plain, noise_lasts=1.0)
    assert noise_prior(1.0, 0.2, partly) == noise_prior(1.0, 0.2, plain)
    cost = 0.5 * np.log(3.0) ** 2 + np.log(1.0 / 0.2)
    assert noise_prior(1.0, 0.2, usual) - noise_prior(1.0, 0.2, plain) == pytest.approx(cost)
