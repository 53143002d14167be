"""Held-out voyages: each window once, by a fit that has not used its voyage."""

import numpy as np
import pytest
from boats import COUNT, START, TRUE, WIDE, Boat, Growing, driven, measured

from shiplog.simulation import sensitivities
from shiplog.simulation.sensitivities import Simulator
from shiplog.simulation.window_series import WindowSeries
from shiplog.training.physics.cross_validation import cross_validate, folds
from shiplog.training.physics.output_error import identify


def test_whole_groups_are_dealt_in_turn():
    groups = ["a", "a", "b", "c", "a", "d", "e", "f", "g", "f"]
    parts = folds(groups, 3)
    held = [{g for g, out in zip(groups, part, strict=True) if out} for part in parts]
    assert held == [{"a", "d", "g"}, {"b", "e"}, {"c", "f"}]
    assert np.sum(parts, axis=0).tolist() == [1] * len(groups)


@pytest.mark.parametrize(("names", "count"), [("ab", 2), ("abc", 3), ("abcde", 5), ("abcdefg", 5)])
def test_every_window_is_held_out_once(names, count):
    groups = [*names] * 3
    parts = folds(groups)
    assert len(parts) == count
    assert np.sum(parts, axis=0).tolist() == [1] * len(groups)
    for part in parts:
        inside = {g for g, out in zip(groups, part, strict=True) if out}
        outside = {g for g, out in zip(groups, part, strict=True) if not out}
        assert inside and outside and not inside & outside


def test_one_voyage_leaves_nothing_to_hold_out(exact):
    assert folds(["a"] * COUNT) == []
    assert cross_validate(lambda part: pytest.fail("fitted"), exact, ["a"] * COUNT) is None


def test_each_of_two_voyages_is_rolled_out_with_what_the_other_reported():
    """Boat a with one drag, boat b with another, windows in turns: each gets the other's."""
    groups = ["a", "b"] * (COUNT // 2)
    first, second = np.array([0.05, 0.02, 0.7]), np.array([0.15, 0.04, 0.7])
    plain = driven(1)
    is_a = np.array([g == "a" for g in groups])
    a, b = (measured(Boat(), theta, plain) for theta in (first, second))
    data = plain._replace(
        measured=np.where(is_a[:, None, None], a.measured, b.measured), weight=np.full(COUNT, 2.0)
    )
    observed = []

    def fit(part: WindowSeries) -> Simulator:
        observed.append(part.weight)
        done = identify(Boat(), START, WIDE, part)
        return Simulator(Boat(), done.values, np.diag([1e-4, 0.0, 0.0]))

    done = cross_validate(fit, data, groups)
    assert sorted(w.tolist() for w in observed) == [[0.0, 2.0] * 4, [2.0, 0.0] * 4]
    crossed = np.where(
        is_a[:, None, None],
        sensitivities.rollout(Boat(), second, data),
        sensitivities.rollout(Boat(), first, data),
    )
    assert done.states == pytest.approx(crossed, abs=1e-5)
    sure = np.where(
        is_a[:, None, None],
        sensitivities.spread(Boat(), second, np.diag([1e-4, 0, 0]), data),
        sensitivities.spread(Boat(), first, np.diag([1e-4, 0, 0]), data),
    )
    assert done.spread == pytest.approx(sure, abs=1e-5) and sure[:, 1:, 1].min() > 0.0
    error = 100.0 * (crossed - data.measured)[..., 1]
    wanted = np.trapezoid(error**2, axis=1)  # sway and yaw rate are the same for both
    assert done.loss == pytest.approx(wanted, rel=1e-3)
    assert wanted.min() > 10.0 and done.groups.tolist() == groups


def test_a_voyage_that_was_corrupted_spoils_every_fit_but_its_own(exact):
    groups = ["a", "a", "b", "b", "b", "c", "c", "c"]
    bad = exact.measured.copy()
    bad[5:, 1:, 1] += 50.0  # voyage c, but for where its rollouts begin

    def fit(part: WindowSeries) -> Simulator:
        done = identify(Boat(), START, WIDE, part)
        return Simulator(Boat(), done.values, done.covariance)

    done = cross_validate(fit, exact._replace(measured=bad), groups)
    truth = sensitivities.rollout(Boat(), TRUE, exact)
    assert done.states[5:] == pytest.approx(truth[5:], abs=1e-4)
    assert np.abs(done.states - truth)[:5, :, 1].max((1,)).min() > 1.0


@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of squares that overflow
def test_a_held_out_window_that_runs_away_has_an_infinite_loss(growing):
    wild = growing.measured.copy()
    wild[0, :, 1] = 1e6
    data = growing._replace(measured=wild)
    done = cross_validate(
        lambda part: Simulator(Growing(), np.array([0.02]), np.zeros((1, 1))),
        data,
        [*"abcdefgh"],
    )
    assert done.loss[0] == np.inf and done.loss[1:].max() < 1e-9
