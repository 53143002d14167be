"""Trials of one ship: what is named, what is not, and what must change with the data."""

import math
from dataclasses import replace

import numpy as np
import pytest
from whole_way import apart, hidden, judged, labels, truth, turned

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import evidence
from shiplog.diagnosis.hypotheses.evaluate import evaluate
from shiplog.diagnosis.linear import linearisation, measurement_correction, segments
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.trial.fitted import Estimate, Fit, Start
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict import result as decisions
from shiplog.voyages.rows import timescale  # fmt: skip

pytestmark = pytest.mark.nightly

# --- what is hidden, and what is not


def test_nothing_hidden_is_nothing_named(still):
    _, decision = still
    assert (decision.verdict, labels(decision)) == ("none", [])
    assert decision.side_force is None and decision.structure is None
    assert max(decision.ranking, key=decision.ranking.get) == "none"


def test_a_heading_offset_is_named_and_sized(compass):
    _, decision = compass
    assert (decision.verdict, labels(decision)) == ("named", ["heading_offset"])
    angle = decision.named[0].estimates["angle"]
    assert angle.value == pytest.approx(truth(hidden("heading_offset"))["angle"], rel=0.08, abs=0.1)
    assert angle.low < angle.value < angle.high


def test_a_cause_of_the_users_own_is_named(sea, trials):
    """A line to a point ten kilometres off: a constant pull along the earth's axes, 1.5 N."""
    towards = {"tether_north": 8000.0, "tether_east": -6000.0}
    _, decision = judged(sea.campaign, trials("none", tether=1.5, **towards))
    assert labels(decision) == ["far_tether"]
    found = decision.named[0].estimates
    assert found["north"].value == pytest.approx(1.2, abs=0.12)
    assert found["east"].value == pytest.approx(-0.9, abs=0.12)
    assert decision.named[0].cause.user


def test_a_line_is_named_with_its_point_and_its_pull(sea, trials):
    """The simulated line pulls as hard at every distance, from midship: no spring, which the search
    begins with."""
    place = {"tether_north": 6.0, "tether_east": -4.0}
    _, decision = judged(sea.campaign, trials("none", tether=1.5, **place))
    assert labels(decision) == ["line"]
    found = decision.named[0].estimates
    off = {"x0": (6.0, 2.0), "y0": (-4.0, 2.0), "pull": (1.5, 0.4), "position": (0.0, 0.2)}
    for name, (wanted, by) in off.items():
        assert found[name].low < wanted < found[name].high, name
        assert found[name].value == pytest.approx(wanted, abs=by), name


# --- without any key: what must change with the data, and what must not


def test_turning_the_pond_turns_the_current(sea):
    _, decision = judged(sea.campaign, turned(sea.done.trial.record))
    assert labels(decision) == ["current"]
    before, after = (d.named[0].estimates for d in (sea.done.decision, decision))
    assert apart(after["direction"].value, before["direction"].value + 90.0) < 2.0
    assert after["speed"].value == pytest.approx(before["speed"].value, rel=0.02)


def test_turning_the_pond_leaves_the_compass(sea, compass):
    trial, plain = compass
    _, decision = judged(sea.campaign, turned(trial.record))
    assert labels(decision) == ["heading_offset"]
    (after,), (before,) = decision.named, plain.named
    sure = np.sqrt(before.covariance[0, 0])
    # each fit ends within 0.2 standard deviations of its optimum, and the wind does not turn along
    assert after.numbers == pytest.approx(before.numbers, abs=0.6 * sure)


def test_taken_out_of_the_data_it_is_gone(sea, compass):
    trial, decision = compass
    named = decision.named[0]
    _, after = judged(sea.campaign, named.cause.read(trial.record, named.numbers))
    assert (after.verdict, labels(after)) == ("none", [])


def test_more_noise_makes_no_surer(sea):
    """White noise as large as the instruments' own, on top of it: the same name, less evidence."""
    observed = sea.done.trial.record
    sigma = np.array([0.02, 0.01, 0.02, 0.01, math.radians(0.1), math.radians(0.1)])
    rng = np.random.default_rng(0)
    noisy = replace(
        observed, state=observed.state + sigma * rng.standard_normal(observed.state.shape)
    )
    _, decision = judged(sea.campaign, noisy)
    assert labels(decision) == ["current"]
    assert decision.named[0].evidence < 1.02 * sea.done.decision.named[0].evidence
    assert decision.named[0].probability <= sea.done.decision.named[0].probability + 1e-6


def test_half_the_data_has_the_same_name(sea):
    """One of the two voyages alone: less evidence, a wider interval."""
    whole = sea.done.decision.named[0]
    _, decision = judged(sea.campaign, sea.done.trial.record.pick(["trial_2"]))
    assert labels(decision) == ["current"]
    half = decision.named[0]
    assert half.evidence < whole.evidence
    assert np.linalg.det(half.covariance) > 1.2 * np.linalg.det(whole.covariance)


def test_with_a_late_clock_the_other_instruments_are_read_at_its_time(sea):
    """An antenna's columns come from what is measured: 1.4 s apart they are other ones, and the
    position and the velocity would seem to disagree."""
    trial = Trial.build(sea.campaign, sea.done.trial.record)
    trial.linearise({})
    numbers = {"clock_offset:gnss": np.array([1.4])}
    late = trial.linearise(numbers)
    ref = sea.campaign.reference
    cut, moved, observed = measurement_correction.read(
        ref.model, ref.setting, trial.record, trial.rows, numbers
    )
    whole = np.concatenate((ref.theta, ref.columns.numbers(numbers)))
    fresh = linearisation.linear(ref.model, whole, cut, trial.grid, late.path, moved, observed)
    columns = ref.columns.indices["antenna_offset"]
    assert late.linear.j[..., columns] == pytest.approx(fresh.j[..., columns], abs=1e-5)


def test_what_a_clock_would_change_is_of_the_motion_and_not_of_its_noise(sea):
    """The column is the velocity's derivative. Were it that of what was measured, noise would pass
    for what the data tell: of noise as the sensor has it, 0.01 m/s, two fifths of it at most."""
    observed, ref = sea.done.trial.record, sea.campaign.reference
    rows, column = sea.done.trial.rows, ref.columns.indices["clock_offset:velocity"][0]
    column -= ref.columns.base
    noise = np.zeros_like(observed.state)
    noise[:, 1] = 0.01 * np.random.default_rng(5).standard_normal(len(observed))
    quiet = measurement_correction.read(ref.model, ref.setting, observed, rows)[2][..., 1, column]
    noisy = replace(observed, state=observed.state + noise)
    disturbed = measurement_correction.read(ref.model, ref.setting, noisy, rows)[2][..., 1, column]
    assert (disturbed - quiet).std() < 0.4 * quiet.std()
    change = np.diff(segments.cut(observed, rows).y[..., 1], axis=1) / timescale.BIN
    between = 0.5 * (quiet[:, 1:] + quiet[:, :-1])
    assert np.corrcoef(between.ravel(), change.ravel())[0, 1] > 0.75


def test_what_a_lag_would_change_is_after_a_step_and_not_before(sea):
    """(y_T - y_0) / T of a step by h: -h exp(-t/T) / T from the step on. With a lead's difference
    in it, a step would be a spike, and a rudder recorded in steps would tell of no lag."""
    observed, ref = sea.done.trial.record, sea.campaign.reference
    (lag,) = (c for c in ref.model.causes if c.label == "rudder_lag")
    time = measurement_correction.READ_STEP * lag.sizes(ref.setting)[0]
    column = ref.columns.indices["rudder_lag"][0] - ref.columns.base
    step = np.zeros_like(observed.actuator)
    step[1000:, 0] = 0.2
    stepped = replace(observed, actuator=step)
    moved = measurement_correction.read(ref.model, ref.setting, stepped, np.array([900]))[1]
    moved = moved.dense()[0, :, 0, column]
    # straight from row to row: the step is half a row before
    t = (900 - 1000 + 0.5 + timescale.STEP_ROWS * np.arange(len(moved))) * observed.step
    assert np.abs(moved[t < -0.15]).max() == 0.0
    after = (t > 0.15) & (t < 5.0 * time)
    assert moved[after] == pytest.approx(-0.2 * np.exp(-t[after] / time) / time, rel=0.02)


# --- traps that make simpler methods invent causes


def test_one_wild_segment_does_not_decide(sea):
    """A shove of 0.3 m/s for some seconds in one segment: it counts less, the others decide."""
    observed = sea.done.trial.record
    trial = sea.done.trial
    row = trial.rows[5]
    t = 0.1 * np.arange(300)
    state = observed.state.copy()
    state[row : row + 300, 3] += 0.3 * np.exp(-0.5 * ((t - 15.0) / 2.0) ** 2)
    shoved, decision = judged(sea.campaign, replace(observed, state=state))
    assert shoved.weight[5] < 0.5 * trial.weight[5]
    assert np.median(shoved.weight) == 1.0
    assert "current" in labels(decision)
    (current,) = (n for n in decision.named if n.cause.label == "current")
    assert current.estimates["speed"].value == pytest.approx(truth(sea.case)["speed"], rel=0.06)


def test_a_fit_that_runs_away_is_worth_nothing(still, monkeypatch):
    """Where a matrix of it is none any more, it has no evidence, and there is no traceback."""
    trial, decision = still

    def broken(*_):
        raise np.linalg.LinAlgError

    monkeypatch.setattr(evidence, "levels", broken)
    path = decision.nothing.point.path
    start = Start({"current": np.zeros(2)}, path)
    assert evaluate(trial, ("current",), Remainder(), start).estimate.evidence == -np.inf


def test_the_others_may_explain_far_less_without_a_cause(still, monkeypatch):
    """Linearised together with it they seem to explain more than where they converge."""
    trial, decision = still
    at, seemed, converged = [], 1000.0, 850.0

    def scanned(*_):
        high = at[-1] > 0.15
        found = {"heading_offset": np.array([0.1])}
        value = seemed if high else converged
        return Estimate("nothing", value, 1.0, found, np.eye(1) * 1e-4, density=value), []

    def stands(_, numbers, *more):
        at.append(numbers["heading_offset"][0])
        return replace(decision.nothing.point, numbers=numbers)

    monkeypatch.setattr(Trial, "linearise", stands)
    monkeypatch.setattr(evidence, "scan", scanned)
    monkeypatch.setattr(evidence, "fit", lambda *given: scanned(*given)[0])
    begin = {"heading_offset": np.array([0.16])}
    fit = evaluate(trial, ("heading_offset",), Remainder(), Start(begin, None))
    assert fit.estimate.evidence == converged


def test_where_the_others_run_away_without_a_cause_nothing_is_left(compass, monkeypatch):
    trial, decision = compass
    (one,) = decision.named
    other = replace(
        one, cause=next(c for c in trial.reference.model.causes if c.label == "current")
    )
    both = {one.cause.label: one.numbers, other.cause.label: one.numbers}
    fit = replace(decision.fit, estimate=replace(decision.fit.estimate, numbers=both))
    two = replace(decision, named=(one, other), fit=fit)
    gone = Estimate("heading_offset", -np.inf, 1.0, {one.cause.label: one.numbers})
    less = Fit(decision.fit.point, gone, fit.remainder)
    monkeypatch.setattr(decisions, "resume", lambda *_, **__: less)
    left = decisions.without_cause(trial, two, other)
    assert left.named == () and left.verdict == "none"
    assert left.fit is decision.nothing


def test_a_fit_that_runs_away_takes_a_shorter_step(still, monkeypatch):
    """Three halvings at most; then it has no evidence. A path of kilometres diverged, too."""
    trial, decision = still
    at, path = Trial.linearise, decision.nothing.point.path
    away = []

    def bounded(self, numbers, *given):
        point = at(self, {n: np.minimum(v, 0.2) for n, v in numbers.items()}, *given)
        if abs(numbers["heading_offset"][0]) > 0.2:
            away.append(float(numbers["heading_offset"][0]))
            return replace(point, linear=replace(point.linear, e=point.linear.e + 1e5))
        return point

    monkeypatch.setattr(Trial, "linearise", bounded)

    def fitted(offset, lowest=-np.inf):
        start = Start({"heading_offset": np.array([offset])}, path)
        return evaluate(trial, ("heading_offset",), Remainder(), start, lowest).estimate

    found = fitted(0.8)
    assert away == [0.8, 0.4] and abs(found.numbers["heading_offset"][0]) < 0.02
    assert -30.0 < found.evidence - decision.nothing.estimate.evidence < thresholds.SHOWS_NATS
    away.clear()
    found = fitted(8.0)
    assert away == [8.0, 4.0, 2.0, 1.0] and found.evidence == -np.inf
    # nothing that converges is so high: each step went too far
    low = decision.nothing.estimate.evidence + 900.0
    found = fitted(0.01, low)
    assert found.evidence == -np.inf
