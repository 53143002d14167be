"""The threshold of the alarm, from the rate of false alarms that the user allows.

Each voyage of the nominal campaign is watched with what the others say of the model (`left_out`),
as a new voyage is. Of n values that the statistic then has, the k greatest are y_i above the next
one, v, and such excesses are exponential (Pickands 1975; Davison & Smith 1990). Another value of
the same ship is above v with the probability (k + 1)/(n + 1), whatever its distribution (Wilks
1941). How far above, a handful of excesses does not say, and ships differ. So the scale β is
integrated out, with 1/β gamma distributed from ship to ship, of shape a and mean 1/β₀, which gives
a predictive distribution with a heavier tail than any one β has (Aitchison & Dunsmore 1975; Lomax
1954):

    P(value > c) = (k + 1)/(n + 1) · (1 + (c - v)/(a β₀ + Σ y_i))^-(a + k),   c > v

The fewer segments a campaign has, the further out is the c of a rare alarm. Over many campaigns the
share of values above it is the one that was asked for, not that of each campaign. As k grows, the
tail becomes the exponential one of the ship itself.

Values in a row depend on each other. So the greatest of a stretch is one value: of STRETCH segments
of log Z_n, of `alarm.LASTING` of χ²; of fewer where there would be less than FEWEST_PEAKS.

Rates that the campaign is too short to show, and that is most, are extrapolated, and said to be so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

DAY_S = 86_400.0
STRETCH = 20  # segments, of which one peak is taken: those of a part of a campaign
FEWEST_PEAKS = 4  # of a campaign


@dataclass(frozen=True)
class Excesses:
    """How values exceed the start of their tail.

    share   of the values that are taken for the tail
    middle  β₀ [nats], scale of the excesses of other ships; shape  a, of 1/β from ship to ship
    """

    share: float
    middle: float
    shape: float


# From effect-free sailing of five simulated ships. Scales of log Z_n: 0.6 to 1.9 nats, of log χ²:
# 0.05 to 0.09. A gamma distribution of shape a spreads by a factor exp(1/√a) to either side.
CHANGE, UNEXPLAINED = Excesses(0.5, 1.2, 6.0), Excesses(0.1, 0.065, 15.0)


@dataclass(frozen=True)
class Tail:
    """What is known of the next value: P(value > c) = share (1 + (c - start)/reach)^-power.

    start, reach  v and a β₀ + Σ y [nats]; power  a + k
    per           segments that one value stands for
    segments      that the campaign has
    """

    start: float
    share: float
    reach: float
    power: float
    per: float
    segments: int

    def exceeded(self, c: float) -> float:
        """P(value > c), c above the start of the tail."""
        return self.share * (1.0 + (c - self.start) / self.reach) ** -self.power

    def threshold(self, per_segment: float) -> float:
        """c that so many false alarms a segment cross; the start of the tail where they are so
        many that c would be below it."""
        share = min(per_segment * self.per / self.share, 1.0)
        return self.start + self.reach * (share ** (-1.0 / self.power) - 1.0)

    def extrapolated(self, per_segment: float) -> bool:
        """Whether the campaign was too short to show such a rate."""
        return per_segment * self.segments < 1.0


def tail_of(values: np.ndarray, per: float, segments: int, prior: Excesses) -> Tail:
    """From values [n] of a campaign of so many segments, each of which stands for `per` of them.
    Raises ValueError where there are fewer than two."""
    if len(values) < 2:
        raise ValueError(f"a tail of {len(values)} values; at least two are needed")
    ordered = np.sort(values)
    k = max(int(prior.share * len(ordered)), 1)
    start = float(ordered[-k - 1])
    reach = prior.shape * prior.middle + float((ordered[-k:] - start).sum())
    share = (k + 1.0) / (len(ordered) + 1.0)
    return Tail(start, share, reach, prior.shape + k, per, segments)


def peaks_of(voyages: Sequence[np.ndarray], stretch: int = STRETCH) -> tuple[np.ndarray, float]:
    """The greatest of each `stretch` values in a row [n], none across two voyages, a rest of
    more than half of it included; and of how many values it is on average."""
    stretch = max(min(stretch, sum(map(len, voyages)) // FEWEST_PEAKS), 1)
    blocks = [
        values[at : at + stretch]
        for values in voyages
        for at in range(0, max(len(values) - stretch // 2, 1), stretch)
        if len(values)
    ]
    per = float(np.mean([len(one) for one in blocks])) if blocks else 1.0
    return np.array([one.max() for one in blocks]), per


def per_segment(per_day: float, segment_s: float) -> float:
    """False alarms a segment, of those a day."""
    return per_day * segment_s / DAY_S
