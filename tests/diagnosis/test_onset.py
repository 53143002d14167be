"""Since when a cause acts: y and M against dense Gaussians, probabilities of changes, slopes."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
import straight
from dense_trial import DRAG, SHARE, gaussian
from scipy.stats import multivariate_normal
from straight import CAUSES

from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.onset import change_points, drift, onsets, stretch_information
from shiplog.diagnosis.onset.change_points import ALWAYS, EDGE, Places
from shiplog.diagnosis.onset.recorded_time import elapsed
from shiplog.diagnosis.trial.fitted import Estimate, Fit
from shiplog.diagnosis.verdict.result import Named
from shiplog.models.causes import Fouling

NOISE, SEGMENTS = 1.17, 8
APART = 0.5  # of voyages, in deviations of their parts


def switched(first: int, last: int, size: float = DRAG, label: str = "drag"):
    """A trial of 8 segments in two voyages, each of two parts, in which a cause acts from one
    segment to before another."""
    columns = straight.columns_of(CAUSES)
    nominal, record = straight.sailed(12), straight.sailed(SEGMENTS, seed=3)
    campaign = straight.campaign(
        nominal, straight.passed(nominal, columns, sensitivity=0.3), columns, share=SHARE
    )
    given = straight.passed(record, columns, seed=2, sensitivity=0.3)
    numbers = np.zeros(columns.linearised)
    numbers[columns.indices[label]] = size
    on = (np.arange(SEGMENTS) >= first) & (np.arange(SEGMENTS) < last)
    given = replace(given, e=given.e + on[:, None, None] * (given.j @ numbers))
    found = straight.trial(replace(campaign, apart=APART), record, given)
    parts = tuple(np.array([at, at + 1]) for at in range(0, SEGMENTS, 2))
    return replace(found, parts=parts, voyage=np.array([0, 0, 1, 1]))


def fit(trial, numbers, included):
    point = trial.linearise(numbers)
    made = Estimate("", 0.0, NOISE, {n: point.numbers.get(n, np.zeros(1)) for n in included})
    return Fit(point, made, Remainder())


@pytest.mark.parametrize("labels", [("drag",), ("two",), ("drag", "two")])
def test_every_stretch_counts_as_in_one_dense_gaussian(labels):
    trial = switched(3, 8)
    columns = trial.reference.columns
    stands = {label: np.full(len(columns.indices[label]), 0.4) for label in labels}
    of = fit(trial, stands | {"load": np.array([0.2])}, (*labels, "load"))
    told = stretch_information.of_causes(trial, of, labels, np.arange(SEGMENTS))
    if len(labels) == 1:
        alone = stretch_information.of_cause(trial, of, labels[0])
        assert np.array_equal(alone.y, told.y) and np.array_equal(alone.M, told.M)
    # dense: part's own deviations are in the covariance, voyages' are added here
    e, j, x, _, c, mean, nominal, _, _, _ = gaussian(trial, of.point, NOISE, labels)
    _, _, other, _, _, _, _, before, _, _ = gaussian(trial, of.point, NOISE, ("load",))
    rows, q = len(e) // SEGMENTS, x.shape[1]
    deviation = APART * trial.campaign.effects.deviation
    for voyage in (slice(0, 4 * rows), slice(4 * rows, 8 * rows)):
        c[voyage, voyage] += (j[voyage] * deviation**2) @ j[voyage].T
    whole = c / SHARE + j @ nominal @ j.T + other @ other.T
    at = np.concatenate([columns.indices[label] for label in labels])
    units, present = columns.unit[at], np.concatenate([stands[label] for label in labels])
    absent = e + x @ (present / units) - j @ mean - other @ before
    h = np.zeros((len(e), SEGMENTS, q))
    for s in range(SEGMENTS):
        h[s * rows : (s + 1) * rows, s] = x[s * rows : (s + 1) * rows]
    h = h.reshape(len(e), -1)
    assert told.y.ravel() == pytest.approx(h.T @ np.linalg.solve(whole, absent), rel=1e-6)
    information = told.M.reshape(SEGMENTS * q, -1)
    wanted = h.T @ np.linalg.solve(whole, h)
    assert information == pytest.approx(wanted, rel=1e-5, abs=1e-6 * abs(wanted).max())
    nothing = multivariate_normal(None, whole).logpdf(absent)
    for i, last in ((0, 8), (3, 8), (2, 5), (0, 1)):
        on = h.reshape(len(e), SEGMENTS, q)[:, i:last].sum(1)
        acts = multivariate_normal(None, whole + on @ on.T).logpdf(absent)
        found = change_points.log_bayes_factors(
            told.y, told.M, np.array([i]), np.array([last])
        )  # fmt: skip
        assert found[0] == pytest.approx(acts - nothing, abs=1e-5)


@pytest.mark.parametrize(("first", "last"), [(0, 8), (3, 8), (4, 8), (0, 5), (2, 6)])
def test_a_cause_is_dated_to_a_segment(first, last):
    trial = switched(first, last)
    of = fit(trial, {"drag": np.array([0.7])}, ("drag",))
    told = stretch_information.of_cause(trial, of, "drag")
    one = Named(CAUSES[1], 0.0, 1.0, np.array([0.7]), np.eye(1))
    found = onsets.onset(trial, told, one)
    begins, ends = 30.0 * first, 30.0 * last
    assert found.begin.elapsed_s == pytest.approx(begins, abs=15.0)
    assert found.begin.low <= begins + 0.1 and begins - 0.1 <= found.begin.high
    assert (found.from_start > 0.5) == (first == 0)
    assert (found.off is None) == (last == 8)
    assert found.acting == pytest.approx(
        [float(first <= s < last) for s in range(SEGMENTS)], abs=0.1
    )
    if found.off is not None:
        assert found.off.elapsed_s == pytest.approx(ends, abs=15.0)
    if (first, last) != (0, 8):
        size = found.while_on["size"]
        assert size.low - 0.1 < DRAG < size.high + 0.1
    if first == 4:  # in port, and of the later voyage
        assert (found.begin.voyage, found.begin.start_s) == ("v1", pytest.approx(0.0, abs=1e-3))


def test_a_force_that_depends_on_time_is_not_taken_for_the_cause():
    assert stretch_information.without_time(Remainder("time", noisy=True)).kind == "raised"
    assert stretch_information.without_time(Remainder("time")) == Remainder()
    kept = Remainder("motion", channels=(2.0, 1.0, 1.0))
    assert stretch_information.without_time(kept) is kept


def test_without_data_the_probabilities_are_the_prior():
    edge = 10.0 * EDGE
    places = Places(
        np.array([5.0, 15.0, 25.0]) - edge, np.array([15.0, 25.0, 35.0]) + edge,
        np.array([np.nan, 20.0, np.nan]), 10.0, 40.0,
    )  # fmt: skip
    found = change_points.changes(np.zeros((4, 1)), np.zeros((4, 1, 4, 1)), places)
    assert found.probability.sum() == pytest.approx(1.0)
    assert found.probability[0, 4] == pytest.approx(ALWAYS)
    # half of the beginnings in port, the rest by the time: 10 s each of 30
    prior = np.array([1.0, 1.0, 1.0]) / 6.0 + np.array([0.0, 0.5, 0.0])
    assert found.probability[1:, 4] == pytest.approx(0.25 * prior)
    assert found.probability[0, 1:4] == pytest.approx(0.125 * prior)
    pairs = np.array([found.probability[i, j] for i, j in ((1, 2), (1, 3), (2, 3))])
    assert pairs == pytest.approx(0.125 * np.array([4.0, 1.0, 4.0]) / 9.0)
    assert found.acting[0] == pytest.approx(found.from_start)


def test_quantiles_of_a_beginning_lie_between_the_stretches():
    places = Places(
        np.array([4.0, 14.0]), np.array([16.0, 26.0]), np.full(2, np.nan), 10.0, 30.0
    )  # fmt: skip
    probability = np.zeros((3, 4))
    probability[0, 3], probability[1, 3] = 0.2, 0.8
    found = change_points.Changes(probability, places)
    # by hand: 0.5 = 0.2 + 0.8 · 3/8 of 12 s; 0.05 is in the atom of the start
    assert found.begin() == pytest.approx((8.5, 0.0, 4.0 + 12.0 * 0.75 / 0.8), abs=1e-4)
    assert found.stop() == pytest.approx((30.0, 30.0, 30.0))


def test_a_change_in_port_is_at_the_seam_give_or_take_half_a_segment():
    """It is found between 4 s before the seam and 6 s after it."""
    places = Places(
        np.array([4.0, 16.0]), np.array([16.0, 26.0]), np.array([np.nan, 20.0]), 10.0, 30.0
    )  # fmt: skip
    probability = np.zeros((3, 4))
    probability[2, 3] = 1.0
    middle, low, high = change_points.Changes(probability, places).begin()
    assert middle == pytest.approx(20.0, abs=1e-4)
    assert (low, high) == pytest.approx((16.4, 25.4), abs=1e-4)  # a tenth of either half


def test_a_slope_is_that_of_the_dense_regression():
    """(x₀, x₁) ~ N(0, I) and r = h (x₀ + x₁ τ) + ε of unit noise, each stretch by itself."""
    rng = np.random.default_rng(1)
    h, tau = rng.uniform(0.5, 2.0, 9), np.linspace(-0.5, 0.5, 9)
    r = h * (0.3 + 1.4 * tau) + 0.1 * rng.standard_normal(9)
    M = np.zeros((9, 1, 9, 1))
    M[np.arange(9), 0, np.arange(9), 0] = h**2
    mean, covariance = drift.with_slope((h * r)[:, None], M, tau)
    X = np.stack((h, h * tau), -1)
    wanted = np.linalg.inv(X.T @ X + np.eye(2))
    assert covariance == pytest.approx(wanted)
    assert mean == pytest.approx(wanted @ X.T @ r)


def test_a_drift_has_a_slope_in_days():
    """Two voyages ten days apart; the second one has 0.3 more of the cause than the first."""
    trial = switched(4, 8, size=0.3)
    names = ("v0", "v1")
    began = datetime(2026, 5, 1, tzinfo=UTC)
    starts = {n: began + timedelta(days=10.0 * i) for i, n in enumerate(names)}
    told = stretch_information.of_cause(trial, fit(trial, {}, ("drag",)), "drag")
    sharp = replace(told, y=told.y * 100.0, M=told.M * 100.0)  # a hundred such trials
    found = drift.slope(trial, sharp, Fouling(), starts)
    assert found is not None and found.unit == "1/day" and found.parameter == "factor"
    assert found.days == pytest.approx(10.0, abs=0.01)
    x = change_points.numbers(sharp.y, sharp.M, 4, 8)[0] * sharp.unit
    assert found.low < found.value < found.high
    assert found.value == pytest.approx(float(x[0]) / 10.0, rel=0.25)
    undated = drift.slope(trial, sharp, Fouling(), {})
    assert undated is not None and undated.days == pytest.approx(240.0 / 86400.0)


def test_recorded_time_goes_on_over_voyages():
    record = straight.sailed(SEGMENTS, seed=3)
    rows = np.array([0, 240, 241, len(record) - 1])
    assert elapsed(record, rows) == pytest.approx([0.0, 120.0, 120.0, 240.0])
