"""Reliability diagram, rank histograms and coverage, on Gaussians whose answers are known."""

import math
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from scipy.special import ndtri

from pipelines.experiments.hidden_effects import ranks, reliability
from pipelines.experiments.hidden_effects.parameters import compare

# --- reliability ----------------------------------------------------------------------------------


def test_bins_hold_what_was_reported_and_the_picture_shows_each():
    statements = [(0.95, True), (1.0, True), (0.91, False), (0.55, False), (0.0, False)]
    low, middle, high = reliability.bins(statements)
    assert (high.low, high.high, len(high.hits)) == (0.9, 1.0, 3)
    assert high.mean == pytest.approx(2.86 / 3) and high.share == pytest.approx(2 / 3)
    assert (low.mean, middle.share) == (0.0, 0.0)
    drawn = ElementTree.fromstring(reliability.svg({"home": statements, "abroad": statements[:1]}))
    circles = [e for e in drawn.iter() if e.tag.endswith("circle")]
    assert len(circles) == 4
    assert float(circles[2].attrib["cx"]) == pytest.approx(50 + 240 * 2.86 / 3, abs=0.06)
    assert float(circles[2].attrib["cy"]) == pytest.approx(50 + 240 / 3, abs=0.06)


def test_a_rounding_error_below_a_half_is_in_the_bin_of_a_half():
    (both,) = reliability.bins([(0.49999999999999994, True), (0.5, False)])
    assert (both.low, both.hits) == (0.5, (True, False))


# --- ranks and coverage ---------------------------------------------------------------------------


def lags(width: float) -> list[float]:
    """Truths at the 1000 quantiles of a Gaussian of 0.1 s, intervals `width` times as wide."""
    found = []
    for z in ndtri((np.arange(1000) + 0.5) / 1000):
        truth = {"time": {"value": 2.0 + 0.1 * z, "unit": "s"}}
        half = width * 1.6448536 * 0.1
        reported = {"time": {"value": 2.0, "unit": "s", "low": 2.0 - half, "high": 2.0 + half}}
        found += compare("rudder_lag", truth, reported).standings
    return found


def test_ranks_of_a_gaussian_are_uniform_and_its_coverage_is_the_level():
    found = lags(1.0)
    assert ranks.histogram(found).tolist() == [100] * 10
    assert ranks.uniform(ranks.histogram(found)) == 1.0
    for level in ranks.LEVELS:
        assert sum(ranks.within(found, level)) == pytest.approx(1000 * level, abs=1)


def test_narrow_intervals_make_a_valley():
    """Half as wide: below the first decile are Φ(-1.2816 / 2) = 26.1 %, and of 90 % 58.9 % hold."""
    found = lags(0.5)
    counts = ranks.histogram(found)
    assert counts[0] == counts[-1] == pytest.approx(261, abs=1)
    assert ranks.uniform(counts) < 1e-6
    assert sum(ranks.within(found, 0.9)) == pytest.approx(589, abs=2)


def test_two_sides_of_an_interval_are_two_gaussians():
    reported = {"value": 1.0, "low": 0.9, "high": 1.2, "unit": "1"}

    def standing(true):
        one = compare("fouling", {"factor": {"value": true, "unit": "1"}}, {"factor": reported})
        return one.standings[0], one.covered[0]

    assert standing(1.1) == (pytest.approx(0.5 * 1.64485, abs=1e-4), True)
    assert standing(0.85) == (pytest.approx(-1.5 * 1.64485, abs=1e-4), False)
    offset = {"angle": {"value": 359.0, "unit": "deg"}}
    turned = {"angle": {"value": 1.0, "low": -1.0, "high": 3.0, "unit": "deg"}}
    assert compare("heading_offset", offset, turned).standings == (pytest.approx(-1.6448536),)
    late = {"time": {"value": 0.5, "unit": "s"}, "channel": {"value": "wind", "unit": ""}}
    other = {"time": {"value": 0.5, "low": 0.4, "high": 0.6}, "channel": {"value": "gnss"}}
    one = compare("clock_offset", late, other)
    assert one.covered == (False,) and one.standings == (math.inf,)
    assert ranks.histogram(list(one.standings)).sum() == 0
    unit = {"factor": {"value": 0.8, "unit": "1"}, "unit": {"value": "port screw", "unit": ""}}
    assert compare("thrust_loss", unit, {"factor": {"value": 0.9}}).error == pytest.approx(0.5)
