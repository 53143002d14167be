"""What a cause is worth, by hand."""

import numpy as np
import pytest

from shiplog.simulation.error_reduction import RUNAWAY, gain, parts
from shiplog.simulation.scoring import window_loss


def even(*losses: float) -> np.ndarray:
    """L by channel [N, 3]: half in surge, half in sway."""
    return np.outer(losses, [0.5, 0.5, 0.0])


def test_reduction_and_interval_of_two_voyages():
    """Voyage a halves, voyage b falls to a tenth. Drawn twice: aa 50 %, ab 70 %, bb 90 %."""
    found = gain(even(10, 10, 10, 10), even(5, 5, 1, 1), ["a", "a", "b", "b"])
    assert (found.before, found.after) == (10.0, 3.0)
    assert found.reduction == pytest.approx(0.7)
    assert (found.low, found.high) == (pytest.approx(0.5), pytest.approx(0.9))
    assert found.real and found.windows == 4
    assert found.channels["surge"] == pytest.approx(0.7)


def test_windows_in_a_row_are_drawn_together():
    """One block of two windows: whatever is drawn is the same, and the interval has no width."""
    found = gain(even(10, 10), even(1, 9), ["a", "a"])
    assert (found.low, found.high) == (pytest.approx(0.5), pytest.approx(0.5))


def test_a_block_never_joins_two_voyages():
    found = gain(even(10, 10), even(1, 9), ["a", "b"])
    assert (found.low, found.high) == (pytest.approx(0.1), pytest.approx(0.9))
    # three and one: blocks of 2, 1 and 1 windows, so that b is drawn alone
    found = gain(even(10, 10, 10, 10), even(10, 10, 10, 0), ["a", "a", "a", "b"])
    assert (found.low, found.high) == (pytest.approx(0.0), pytest.approx(2 / 3))


def test_the_mean_is_of_losses_and_not_of_ratios():
    found = gain(even(100, 1), even(50, 1), ["a", "b"])
    assert found.reduction == pytest.approx(50 / 101)


def test_nothing_gained_is_not_real():
    found = gain(even(10, 10), even(8, 12), ["a", "b"])
    assert found.reduction == pytest.approx(0.0)
    assert not found.real
    estimated = found.as_json()
    assert estimated["low"] <= estimated["reduction"] <= estimated["high"]
    assert estimated["held_out_windows"] == 2


def test_parts_add_up_to_the_evaluation_function():
    rng = np.random.default_rng(0)
    error = rng.standard_normal((3, 7, 6))
    dt = rng.uniform(0.5, 1.5, (3, 6))
    found = parts(error, dt)
    assert found.sum(1) == pytest.approx(window_loss(error, dt), rel=1e-12)
    only = error * [0, 0, 0, 0, 0, 1]  # yaw rate, in deg/s, times 10
    assert parts(only, dt)[:, :2] == pytest.approx(0.0)
    assert parts(only, dt)[:, 2] == pytest.approx(found[:, 2])


@pytest.mark.parametrize("lost", (np.inf, np.nan, 1e300, 1e6))
def test_a_rollout_that_ran_away_counts_as_runaway(lost):
    error = np.zeros((2, 5, 6))
    error[1, 3:, 1] = lost
    found = parts(error, np.ones((2, 4)))
    assert found[0].tolist() == [0.0, 0.0, 0.0]
    assert found[1].tolist() == [RUNAWAY, 0.0, 0.0]
    worth = gain(found, np.zeros((2, 3)), ["a", "b"])
    assert worth.reduction == 1.0 and np.isfinite(worth.before)
