"""The threshold of the alarm, from the rate of false alarms that the user allows.

Each voyage of the nominal campaign is watched with what the others say of the model, as a new
voyage is. The greatest log Z_n of each STRETCH segments is a block maximum, and block maxima of a
statistic with an exponential tail are Gumbel distributed (Gumbel 1958),

    P(peak > c) = 1 - exp(-exp(-(c - μ)/β)),   so that for large c
    false alarms a segment  ≈  exp(-(c - μ)/β) / STRETCH

A campaign of an hour or two has some ten peaks: enough for μ, the mean of the peaks less γ β, and
too few for β. So β is shrunk towards what other ships showed, which counts as PSEUDO_PEAKS peaks:

    β = (PSEUDO_PEAKS β₀ + n s √6/π) / (PSEUDO_PEAKS + n),   s their standard deviation

A voyage that is left out still shared in the fit of coefficients and noise, so that a new voyage is
further from the model: μ is raised by OPTIMISM.

Rates that the campaign is too short to show, and that is most, are extrapolated, and said to be so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

DAY_S = 86_400.0
STRETCH = 20  # segments, of which one peak is taken: those of a part of a campaign
PSEUDO_PEAKS = 20.0
# nats; of log Z_n and of log χ²_s, from peaks of effect-free sailing of five simulated ships
SCALE, UNEXPLAINED_SCALE = 1.8, 0.12

OPTIMISM = 0.4  # nats of log Z_n: new voyages of these ships less those of their campaigns


@dataclass(frozen=True)
class Tail:
    """Location μ and scale β of the peaks, and how many segments they were seen in."""

    location: float
    scale: float
    segments: int

    def threshold(self, per_segment: float) -> float:
        """c that so many false alarms a segment cross: exact for a Gumbel peak."""
        share = min(per_segment * STRETCH, 0.95)  # of the stretches
        return self.location - self.scale * math.log(-math.log1p(-share))

    def extrapolated(self, per_segment: float) -> bool:
        """Whether the campaign was too short to show such a rate."""
        return per_segment * self.segments < 1.0


def tail_of(peaks: np.ndarray, segments: int, scale: float, optimism: float = 0.0) -> Tail:
    """From peaks [n] of as many stretches; `scale` β₀ of other ships, and by how much the peaks of
    a new voyage are larger."""
    count = len(peaks)
    own = float(peaks.std(ddof=1)) * math.sqrt(6.0) / math.pi if count > 1 else scale
    beta = (PSEUDO_PEAKS * scale + count * own) / (PSEUDO_PEAKS + count)
    location = float(peaks.mean()) + optimism - np.euler_gamma * beta
    return Tail(location, beta, segments)


def peaks_of(totals: Sequence[float]) -> np.ndarray:
    """The greatest of each STRETCH values in a row [n], a shorter rest of half of it included."""
    values = np.asarray(totals)
    cuts = range(0, max(len(values) - STRETCH // 2, 1), STRETCH)
    return np.array([values[at : at + STRETCH].max() for at in cuts if len(values)])


def per_segment(per_day: float, segment_s: float) -> float:
    """False alarms a segment, of those a day."""
    return per_day * segment_s / DAY_S
