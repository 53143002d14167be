"""What a cause is worth, by hand."""

import numpy as np
import pytest

from shiplog.simulation.error_reduction import RUNAWAY, gain, parts
from shiplog.simulation.scoring import window_loss

WIDER = 6.313752 / 1.644854 * 2.0**0.5  # of two blocks


def even(*losses: float) -> np.ndarray:
    """L by channel [N, 3]: half in surge, half in sway."""
    return np.outer(losses, [0.5, 0.5, 0.0])


def test_reduction_and_interval_of_two_voyages():
    """Voyage a halves, voyage b falls to a tenth. Drawn twice: aa 50 %, ab 70 %, bb 90 %. Student's
    t of one degree is 6.314 where a Gaussian's is 1.645, and a variance of two is half: from 0.7
    the interval reaches 0.2 · 6.314 / 1.645 · √2, and no error is below zero."""
    found = gain(even(10, 10, 10, 10), even(5, 5, 1, 1), ["a", "a", "b", "b"])
    assert (found.before, found.after) == (10.0, 3.0)
    assert found.reduction == pytest.approx(0.7)
    assert (found.low, found.high) == (pytest.approx(0.7 - 0.2 * WIDER), pytest.approx(1.0))
    assert not found.real and found.windows == 4
    assert found.channels["surge"] == pytest.approx(0.7)


def test_windows_in_a_row_are_drawn_together():
    """One block of two windows: whatever is drawn is the same, so that it says nothing of how
    blocks differ. Nothing is excluded: neither no error at all nor twice the error."""
    found = gain(even(10, 10), even(1, 9), ["a", "a"])
    assert found.reduction == pytest.approx(0.5)
    assert (found.low, found.high) == (pytest.approx(-1.0), pytest.approx(1.0))
    assert gain(even(10), even(30), ["a"]).low == pytest.approx(-2.0)


def test_a_block_never_joins_two_voyages():
    found = gain(even(10, 10), even(1, 9), ["a", "b"])
    assert found.low == pytest.approx(0.5 - 0.4 * WIDER)
    # three and one: blocks of 2, 1 and 1 windows, so that b is drawn alone: 0, 1/4, .. 2/3 of it
    found = gain(even(10, 10, 10, 10), even(10, 10, 10, 0), ["a", "a", "a", "b"])
    three = 2.919986 / 1.644854 * 1.5**0.5
    assert found.low == pytest.approx(0.25 - 0.25 * three)
    assert found.high == pytest.approx(min(0.25 + (2 / 3 - 0.25) * three, 1.0))


def test_of_many_blocks_the_interval_is_that_of_their_mean():
    """A hundred blocks, even ones 8, odd ones 12 of 10: 1.645 · 0.2 / √99 about 0."""
    after = np.where(np.arange(100) % 2, 12.0, 8.0)
    found = gain(even(*[10.0] * 100), even(*after), [str(i) for i in range(100)])
    reach = 1.660391 * 0.2 / 99**0.5
    assert (found.low, found.high) == (
        pytest.approx(-reach, rel=0.1),
        pytest.approx(reach, rel=0.1),
    )


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


def test_one_window_with_most_of_the_error_does_not_speak_for_the_typical_one():
    """One window of 1000 falls to 100, thirty-nine of 1 rise to 3. Of all error 79 % is gone. With
    windows that count alike, a/b is (39 · 0.75 + 1/11)/(39 · 0.25 + 10/11) = 2.75."""
    names = ["a"] * 40
    before, after = even(1000, *[1] * 39), even(100, *[3] * 39)
    found = gain(before, after, names)
    assert found.reduction == pytest.approx(1.0 - 217.0 / 1039.0)
    less, more = found.typical
    assert -2.5 < less < 1.0 - (39 * 0.75 + 1 / 11) / (39 * 0.25 + 10 / 11) < more < 0.0
    assert found.worse == found.typical
    assert gain(after, before, names).typical[0] > 0.0
    assert gain(even(*[10] * 40), even(*[9] * 40), names).worse is None
