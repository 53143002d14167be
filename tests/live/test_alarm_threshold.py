"""The threshold of the alarm, against campaigns drawn by numpy and counted."""

import math

import numpy as np
import pytest

from shiplog.live import calibration
from shiplog.live.alarm import LASTING, lasting_squares
from shiplog.live.alarm_threshold import (
    FEWEST_PEAKS,
    STRETCH,
    Excesses,
    Tail,
    peaks_of,
    per_segment,
    tail_of,
)

SHIPS = Excesses(0.5, 1.2, 6.0)


def share_above(draw, count: int, asked: float, campaigns: int, seed: int) -> tuple[float, float]:
    """Over so many ships, each with a campaign of `count` values: how often its next value is above
    its threshold, exactly by the ship's own distribution; by the predictive tail, and where the
    scale is taken for known as its estimate."""
    rng = np.random.default_rng(seed)
    found, plugged = 0.0, 0.0
    for _ in range(campaigns):
        values, above = draw(rng, 1.0 / rng.gamma(SHIPS.shape, 1.0 / (SHIPS.shape * SHIPS.middle)))
        tail = tail_of(values(count), 1.0, count, SHIPS)
        found += above(tail.threshold(asked))
        k = max(int(SHIPS.share * count), 1)
        own = np.sort(values.last)[-k - 1 :]
        scale = float((own[1:] - own[0]).mean())
        plugged += above(own[0] + scale * math.log(k / count / asked))
    return found / campaigns, plugged / campaigns


class Drawn:
    """Values of one ship, as numpy draws them."""

    def __init__(self, draw) -> None:
        self.draw, self.last = draw, np.zeros(0)

    def __call__(self, count: int) -> np.ndarray:
        self.last = self.draw(count)
        return self.last


def exponential(rng, scale):
    place = rng.normal(0.0, 3.0)

    def above(c):
        return min(math.exp(-(c - place) / scale), 1.0)

    return Drawn(lambda count: place + rng.exponential(scale, count)), above


def gumbel(rng, scale):
    place = rng.normal(0.0, 3.0)

    def above(c):
        return -math.expm1(-math.exp(-(c - place) / scale))

    return Drawn(lambda count: rng.gumbel(place, scale, count)), above


@pytest.mark.parametrize("count", [2, 5, 12])
@pytest.mark.parametrize("asked", [0.1, 0.01, 0.002])
def test_over_many_ships_the_share_is_the_one_that_was_asked_for(count, asked):
    """Exactly, with exponential excesses, of whatever few values; a scale that is taken for known
    is crossed much more often."""
    found, plugged = share_above(exponential, count, asked, 8000, seed=count)
    assert found == pytest.approx(asked, rel=0.12)
    if asked < 0.05:
        assert plugged > (1.5 if count > 5 else 2.5) * asked


@pytest.mark.parametrize("count", [5, 12])
def test_peaks_of_a_gumbel_distribution_are_above_it_as_seldom_as_asked(count):
    """Only their tail is exponential: less than asked, and within a factor of two of it."""
    for asked in (0.1, 0.01):
        found, _ = share_above(gumbel, count, asked, 4000, seed=count)
        assert 0.5 * asked < found < 1.3 * asked


def test_the_tail_of_many_values_is_their_own():
    values = np.random.default_rng(9).exponential(3.0, 100_000)
    tail = tail_of(values, 20.0, 2_000_000, Excesses(0.1, 1.0, 5.0))
    for a_segment in (1e-4, 1e-5):
        assert tail.threshold(a_segment) == pytest.approx(-3.0 * math.log(20 * a_segment), rel=0.03)
        assert tail.exceeded(tail.threshold(a_segment)) == pytest.approx(20 * a_segment)


def test_a_shorter_campaign_has_a_higher_threshold():
    """The same quantiles of the same distribution, of ever more values."""
    each = []
    for count in (4, 10, 40, 400):
        values = -1.2 * np.log1p(-(np.arange(count) + 0.5) / count)
        each.append(tail_of(values, 20.0, 20 * count, SHIPS).threshold(1e-5))
    assert each == sorted(each, reverse=True)
    assert each[0] > each[-1] + 1.0


def test_a_rate_beyond_the_tail_has_its_start_for_a_threshold():
    tail = Tail(start=2.0, share=0.5, reach=10.0, power=8.0, per=20.0, segments=100)
    assert tail.threshold(0.5) == 2.0
    assert tail.extrapolated(per_segment(1.0, 30.0))
    assert not tail.extrapolated(per_segment(100.0, 30.0))
    with pytest.raises(ValueError, match="at least two"):
        tail_of(np.ones(1), 1.0, 20, SHIPS)


def test_peaks_are_of_one_voyage_each():
    long, short = np.arange(STRETCH + STRETCH // 2 + 1.0), np.array([7.0])
    peaks, per = peaks_of([long, short, long, long])
    assert peaks.tolist() == [19.0, 30.0, 7.0, 19.0, 30.0, 19.0, 30.0]
    assert per == pytest.approx((3 * (20 + 11) + 1) / 7)
    few, per = peaks_of([np.arange(16.0)])
    assert len(few) == FEWEST_PEAKS and per == 4.0


def test_what_lasts_is_the_least_of_segments_in_a_row():
    logs = np.array([0.1, 5.0, 0.2, 0.3, 0.4, 0.5])
    assert lasting_squares(logs).tolist() == [0.1, 0.2, 0.2, 0.3]
    assert len(lasting_squares(logs[: LASTING - 1])) == 0


def test_voyages_of_a_few_segments_still_have_tails():
    rng = np.random.default_rng(2)
    known = {"change": rng.normal(size=16), "square": rng.chisquare(50, 16),
             "voyage": np.repeat(np.arange(8), 2)}  # fmt: skip
    median, (change, other) = calibration.tails_of(known)
    assert median == pytest.approx(np.median(known["square"]))
    assert change.segments == other.segments == 16
    assert other.threshold(1e-4) > other.threshold(1e-2) > 0.0
