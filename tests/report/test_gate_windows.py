"""Limits on simulations: figures worked out by hand."""

import math

import pytest
from gate_answers import evaluation

from shiplog.report.gate import judging
from shiplog.report.gate.limits_file import parse
from shiplog.report.gate.outcome import Measured, of_number


def lines(text, found, names=("a", "b"), lacking=""):
    limits = parse(text, "limits.toml")
    return {f"{o.section}.{o.key}": o for o in judging.of_windows(limits, names, found, lacking)}


EVERY = """
[simulation]
loss = 5
loss_of_hold = 0.05
loss_of_least_squares = 0.3
end_position_m = 2
end_heading_deg = 4.9
rmse_surge_mps = 0.1
rmse_sway_mps = 0.19
rmse_yaw_rate_degps = 1.001
covered = 0.5
"""


def test_each_figure_against_its_limit():
    """L is 1 to 8 in the windows: 4.5 of 100 in the mean, and of 10."""
    found = lines(EVERY, evaluation(range(1, 9)))
    values = {key.removeprefix("simulation."): one.measured.value for key, one in found.items()}
    assert values == pytest.approx({
        "loss": 4.5, "loss_of_hold": 0.045, "loss_of_least_squares": 0.45, "end_position_m": 2.0,
        "end_heading_deg": 5.0, "rmse_surge_mps": 0.1, "rmse_sway_mps": 0.2,
        "rmse_yaw_rate_degps": 1.0, "covered": 0.5,
    })  # fmt: skip
    assert {key.removeprefix("simulation."): one.state for key, one in found.items()} == {
        "loss": "holds", "loss_of_hold": "holds", "loss_of_least_squares": "broken",
        "end_position_m": "holds", "end_heading_deg": "broken", "rmse_surge_mps": "holds",
        "rmse_sway_mps": "broken", "rmse_yaw_rate_degps": "holds", "covered": "holds",
    }  # fmt: skip
    loss = found["simulation.loss"].measured
    assert 1.0 < loss.low < 4.5 < loss.high < 8.0


def test_what_does_not_vary_has_no_width():
    one = lines("[simulation]\nend_position_m = 2", evaluation(1.0))["simulation.end_position_m"]
    assert (one.measured.low, one.measured.high) == pytest.approx((2.0, 2.0))
    assert one.line == "holds  end position after 100 s: 2 m (2 to 2), at most 2 m"


def test_the_mean_is_over_seeds_too():
    one = lines("[simulation]\nloss = 5", evaluation(range(1, 9), seeds=(0, 1, 2)))
    assert one["simulation.loss"].measured.value == pytest.approx(4.5)


def test_of_few_windows_there_is_no_interval():
    found = evaluation((1.0, 3.0), voyages=("a", "b"))
    one = lines("[simulation]\nloss = 1.5", found)["simulation.loss"]
    assert (one.measured.value, one.measured.low) == (2.0, None)
    assert one.line == "broken L: 2, at most 1.5"


def test_a_window_that_diverged_breaks_every_limit_on_l():
    """Left out of a mean, the rest would pass."""
    text = "[simulation]\nloss = 1e300\nloss_of_hold = 1e300\ncovered = 0.1"
    found = lines(text, evaluation((1, 1, math.inf, 1, 1, 1, 1, 1)))
    for key in ("loss", "loss_of_hold"):
        one = found[f"simulation.{key}"]
        assert one.state == "broken" and "diverged" in one.line and "1 window" in one.line
        assert one.as_json()["measured"] == math.inf
    assert found["simulation.covered"].state == "holds"


def test_each_voyage_that_a_name_or_a_pattern_fits():
    text = "[voyages.a]\nloss = 3\n[voyages.'*']\nloss = 7\ncovered = 0.6"
    found = lines(text, evaluation(range(1, 9)))
    assert {key: (one.measured.value, one.state) for key, one in found.items()} == {
        "voyages.a.loss": (2.5, "holds"), "voyages.a.covered": (0.5, "broken"),
        "voyages.b.loss": (6.5, "holds"), "voyages.b.covered": (0.5, "broken"),
    }  # fmt: skip
    assert found["voyages.b.loss"].line.startswith("holds  b, L: 6.5")


def test_a_part_of_a_voyage_is_no_pattern():
    assert judging.voyages_of("trip[0:20]", ["trip[0:20]", "trip0"]) == ["trip[0:20]"]
    assert judging.voyages_of("t?ip*", ["trip[0:20]", "other"]) == ["trip[0:20]"]


def test_the_baselines_of_a_voyage_are_those_of_its_windows():
    found = evaluation(range(1, 9))
    found.baseline_losses["hold"][4:] = 13.0
    text = "[voyages.a]\nloss_of_hold = 1\n[voyages.b]\nloss_of_hold = 1"
    values = [one.measured.value for one in lines(text, found).values()]
    assert values == pytest.approx([2.5 / 100.0, 6.5 / 13.0])


def test_the_share_inside_the_band():
    text = "[band]\nsurge = 0.8\nsway = 0.8\nyaw_rate = 0.8"
    found = lines(text, evaluation(1.0, inside={"surge": 0.81, "sway": 0.79}))
    assert [one.state for one in found.values()] == ["holds", "broken", "not assessed"]
    assert found["band.sway"].line == "broken share of sway inside its band: 0.79, at least 0.8"
    assert found["band.yaw_rate"].line == (
        "not assessed share of yaw rate inside its band, at least 0.8: mmg has no 90 % band: "
        "nothing was held out to learn it from"
    )


def test_without_a_window_nothing_is_assessed():
    text = "[simulation]\nloss = 1e9\ncovered = 0.001\n[voyages.a]\nloss = 1e9\n[band]\nsway = 0.1"
    found = lines(text, None, lacking="there is no window")
    assert {one.state for one in found.values()} == {"not assessed"} and len(found) == 4
    assert all(one.line.endswith(": there is no window") for one in found.values())


def test_a_voyage_without_a_window_is_not_assessed():
    found = lines("[voyages.short]\nloss = 9", evaluation(1.0), names=("a", "b", "short"))
    assert found["voyages.short.loss"].line == (
        "not assessed short, L, at most 9: short has no 100 s without a gap"
    )


@pytest.mark.parametrize(
    ("value", "state", "text"),
    [(4.0, "holds", "4 m"), (4.0001, "broken", "4.0001 m"), (3.99999, "holds", "3.99999 m"),
     (0.0, "holds", "0 m"), (12345.6, "broken", "12300 m")],
)  # fmt: skip
def test_a_figure_is_told_from_its_limit(value, state, text):
    one = of_number("simulation", "k", "n", "m", 4.0, Measured(value))
    assert (one.state, one.found) == (state, text)
