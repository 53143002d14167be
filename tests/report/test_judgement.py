"""What errors say of a model, of windows whose figures are worked out by hand."""

import math

import numpy as np
import polars as pl
import pytest

from shiplog.report.evaluation.judgement import FEWEST_WINDOWS, force_line, judge


def errors(losses, off=3.0, turned=10.0) -> pl.DataFrame:
    count = len(losses)
    return pl.DataFrame(
        {
            "seed": [1] * count,
            "voyage": ["a"] * count,
            "window": list(range(count)),
            "loss": [float(x) for x in losses],
            "end_position_m": [off] * count,
            "end_heading_deg": [turned] * count,
        }
    )


def test_a_model_is_judged_against_each_baseline():
    """Half of one baseline's L on every window, twice another's: ratios without a spread."""
    loss = np.linspace(10.0, 40.0, 8)
    found = judge("ref", errors(loss), {"hold": 2.0 * loss, "least_squares": 0.5 * loss}, 6.0, 100)
    hold, least = found.against
    assert (hold.share, hold.low, hold.high) == pytest.approx((0.5, 0.5, 0.5))
    assert (least.share, least.word) == (pytest.approx(2.0), "worse")
    assert found.sentence == (
        "ref, on 8 windows of 100 s: better than holding the velocity, with 0.5 of its L (0.5 to "
        "0.5); worse than quadratic least squares, with 2 of its L (2 to 2). After 100 s it is 0.5 "
        "ship lengths and 10 deg off (medians)."
    )


def test_seeds_are_averaged_window_by_window():
    both = pl.concat(
        [errors([1.0] * 8), errors([3.0] * 8).with_columns(seed=pl.lit(2, dtype=pl.Int64))]
    )
    found = judge("ref", both, {"hold": np.full(8, 4.0)}, 3.0, 100)
    assert found.windows == 8 and found.against[0].share == pytest.approx(0.5)


def test_what_differs_from_window_to_window_is_not_sure():
    """Ratios of 0.25 and 2 in turn, block by block of two windows."""
    loss = np.array([1.0, 1.0, 8.0, 8.0, 1.0, 1.0, 8.0, 8.0])
    found = judge("ref", errors(loss), {"hold": np.full(8, 4.0)}, 3.0, 100)
    (one,) = found.against
    assert one.low < 1.0 < one.high and one.word == "not significantly better or worse"


def test_windows_that_ran_away_are_counted_and_left_out():
    loss = np.array([10.0] * 7 + [math.inf])
    found = judge("ref", errors(loss), {"hold": np.full(8, 20.0)}, 3.0, 100)
    assert found.lost == 1 and found.against[0].share == pytest.approx(0.5)
    assert "Windows that diverged, in none of these figures: 1." in found.sentence
    every = judge("ref", errors([math.inf] * 3), {"hold": np.full(3, 20.0)}, 3.0, 100)
    assert every.sentence == "ref, on 3 windows of 100 s: every one of them diverged."
    baseline = np.array([math.inf] + [20.0] * 7)  # nor is a baseline's runaway a success
    found = judge("ref", errors([5.0] + [10.0] * 7), {"hold": baseline}, 3.0, 100)
    assert found.against[0].share == pytest.approx(0.5)


def test_one_window_is_one_window():
    one = judge("ref", errors([1.0]), {"hold": np.full(1, 2.0)}, 3.0, 100)
    assert one.sentence.startswith("ref, on 1 window of 100 s: 0.5 of the L of holding")
    lost = judge("ref", errors([math.inf]), {"hold": np.full(1, 2.0)}, 3.0, 100)
    assert lost.sentence == "ref, on 1 window of 100 s: it diverged."


@pytest.mark.parametrize("count", [1, FEWEST_WINDOWS - 1, FEWEST_WINDOWS])
def test_of_too_few_windows_there_is_no_interval(count):
    found = judge("ref", errors([1.0] * count), {"hold": np.full(count, 2.0)}, 3.0, 20)
    few = count < FEWEST_WINDOWS
    assert ("Too few windows for an interval." in found.sentence) == few
    assert (found.against[0].low is None) == few
    assert ("0.5 of the L of holding the velocity" in found.sentence) == few
    assert found.against[0].word == ("not significantly better or worse" if few else "better")


def test_a_poor_model_and_a_large_force_are_written_out():
    """134 deg was 1.3e+02 deg."""
    poor = judge("ref", errors([1500.0], 1230.0, 134.0), {"hold": np.full(1, 10.0)}, 3.0, 100)
    assert "100 s: 150 of the L of holding the velocity." in poor.sentence
    assert poor.sentence.endswith("After 100 s it is 410 ship lengths and 130 deg off (medians).")
    large = pl.DataFrame({"voyage": ["a"], "part": ["hull"], "surge": [12345.0], "sway": [0.0]})
    assert force_line(large, "a").endswith("hull 12000 N.")


def test_forces_of_a_voyage_in_a_line():
    """Of 3 N and 4 N in turn the root mean square is 3.5; ahead 3 N and aside 4 N are 5 N."""
    forces = pl.DataFrame(
        {
            "voyage": ["a"] * 6 + ["b"],
            "part": ["rudder", "rudder", "hull", "hull", "total", "total", "hull"],
            "surge": [3.0, 4.0, 3.0, 3.0, 9.0, 9.0, 99.0],
            "sway": [0.0, 0.0, 4.0, 4.0, 9.0, 9.0, 99.0],
        }
    )
    assert force_line(forces, "a") == "Forces along a, root mean square: hull 5 N, rudder 3.5 N."
