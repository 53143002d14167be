"""Probabilities of a cause's beginning and end, equations (18) and (19)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

# Shares of a named cause's prior. Half act from the start to the end of the trial, as the
# hypothesis that was weighed has it; of the others half begin and stay, and half end.
ALWAYS, BEGINS, ENDS, BOTH = 0.5, 0.25, 0.125, 0.125

# Share of the changes that fall between two voyages, where there are several: loads, sensors and
# hulls are changed in port, and a change at sea may be anywhere.
IN_PORT = 0.5

NEGLIGIBLE = 1e-6  # probability of a change, that no quantile of TAIL feels
HALVINGS = 40  # of the trial: to a millionth of a second
TAIL = 0.05  # of the probability beyond either end of a 90 % interval
AT_A_TIME = 20_000  # pairs of stretches whose evidence is worked out together


# Share of a segment. A segment in which the cause acts for a part is taken for one with it or one
# without; from which part on depends on the manoeuvre, one half with a standard deviation of 0.15.
# A change is therefore looked for so far beyond the middles of the segments next to it.
EDGE = 0.1


@dataclass(frozen=True)
class Places:
    """Where a change between stretches may be, in s of recorded time from the trial's start.

    low, high  [B - 1]  a change that is found before stretch i + 1 happened between these, EDGE of
                        a segment beyond the middles of the segments next to it
    seam       [B - 1]  where a voyage ends and the next one begins; NaN within a voyage
    segment    length of a segment
    end        of the trial
    """

    low: np.ndarray
    high: np.ndarray
    seam: np.ndarray
    segment: float
    end: float

    @property
    def port(self) -> np.ndarray:
        """[B - 1] bool: between two voyages."""
        return np.isfinite(self.seam)

    @property
    def at_sea(self) -> np.ndarray:
        """[B - 1] share of p(one change) that is at sea, where it is: in proportion to the time."""
        if not len(self.low):
            return np.zeros(0)
        span = self.high - self.low - 2.0 * EDGE * self.segment
        share = 1.0 - IN_PORT if self.port.any() else 1.0
        return share * span / span.sum()

    @property
    def in_port(self) -> np.ndarray:
        """[B - 1] share of p(one change) that is in a port: IN_PORT, each alike."""
        port = self.port.astype(float)
        return IN_PORT * port / max(port.sum(), 1.0)

    @property
    def prior(self) -> np.ndarray:
        """p [B - 1] of one change."""
        return self.at_sea + self.in_port


@dataclass(frozen=True)
class Changes:
    """p(i, j) [B, B + 1]: the probability that the cause acts from stretch i to before j > i."""

    probability: np.ndarray
    places: Places

    @property
    def from_start(self) -> float:
        return float(self.probability[0].sum())

    @property
    def to_end(self) -> float:
        return float(self.probability[:, -1].sum())

    @property
    def acting(self) -> np.ndarray:
        """[B] probability that it acts in each stretch b: Σ p(i, j), i <= b < j."""
        begun = np.cumsum(self.probability, axis=0)
        open_ = np.cumsum(begun[:, ::-1], axis=1)[:, ::-1]
        return np.diagonal(open_, 1).copy()

    @property
    def likeliest(self) -> tuple[int, int]:
        """(i, j) of the greatest p."""
        at = np.unravel_index(int(self.probability.argmax()), self.probability.shape)
        return int(at[0]), int(at[1])

    def begin(self) -> tuple[float, float, float]:
        """Median and 90 % interval of the beginning, s; zero is the start."""
        each = self.probability.sum(1)
        return self._quantiles(each[1:], first=each[0])

    def stop(self) -> tuple[float, float, float]:
        """Median and 90 % interval of its end, s; the trial's end where it still acts then."""
        each = self.probability.sum(0)
        return self._quantiles(each[1:-1], first=0.0)

    def _quantiles(self, each: np.ndarray, first: float) -> tuple[float, float, float]:
        """Of a change with p = `each` [B - 1], `first` at the start, and the rest at the end. Each
        is even between `low` and `high`; of a port half of it before the seam and half after it:
        a segment that begins in port does not say how soon after that the cause began."""
        of = self.places
        knots = [(0.0, first)]  # position, and the probability that is added up to it
        for i in np.flatnonzero(each > NEGLIGIBLE):
            middle = of.seam[i] if of.port[i] else 0.5 * (of.low[i] + of.high[i])
            half = 0.5 * each[i]
            knots += [(of.low[i], 0.0), (middle, half), (of.high[i], half)]
        middle, low, high = (_quantile(knots, p, of.end) for p in (0.5, TAIL, 1.0 - TAIL))
        if len(each) and each.max() >= 0.5 and of.port[each.argmax()]:
            middle = float(of.seam[each.argmax()])  # in port, and not a moment next to it
        return middle, low, high


def _quantile(knots: Sequence[tuple[float, float]], p: float, end: float) -> float:
    """Where the probability up to it passes p: straight between knots, of which pieces may overlap;
    `end` where it never does."""
    low, high = 0.0, end
    if _below(knots, high) < p:
        return end
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _below(knots, middle) < p else (low, middle)
    return 0.0 if high < 1e-6 * end else high


def _below(knots: Sequence[tuple[float, float]], at: float) -> float:
    """Probability up to a time."""
    found = knots[0][1]
    for (begin, _), (stop, added) in itertools.pairwise(knots):
        if stop <= begin:
            found += added if at >= stop else 0.0
        elif added:
            found += added * min(max((at - begin) / (stop - begin), 0.0), 1.0)
    return found


def changes(y: np.ndarray, M: np.ndarray, places: Places) -> Changes:
    """p(i, j | r) of (19), y [B, q] and M [B, q, B, q] of (17)."""
    B = len(y)
    i, j = (of.ravel() for of in np.meshgrid(np.arange(B), np.arange(1, B + 1), indexing="ij"))
    kept = i < j
    i, j = i[kept], j[kept]
    value = log_bayes_factors(y, M, i, j) + _log_prior(places, i, j)
    weight = np.exp(value - value.max())
    probability = np.zeros((B, B + 1))
    probability[i, j] = weight / weight.sum()
    return Changes(probability, places)


def log_bayes_factors(y: np.ndarray, M: np.ndarray, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """log B(i, j) = ½ yᵀ (M + I)⁻¹ y - ½ log|M + I| (18) of pairs i < j."""
    B, q = y.shape
    Y = np.concatenate((np.zeros((1, q)), np.cumsum(y, axis=0)))
    S = np.zeros((B + 1, B + 1, q, q))  # S[i, j] = Σ_{b < i, c < j} M_bc
    S[1:, 1:] = np.cumsum(np.cumsum(np.moveaxis(M, 1, 2), axis=0), axis=1)
    found = np.empty(len(i))
    for at in range(0, len(i), AT_A_TIME):
        own = slice(at, at + AT_A_TIME)
        a, b = i[own], j[own]
        inside = S[b, b] - S[a, b] - S[b, a] + S[a, a] + np.eye(q)
        of = Y[b] - Y[a]
        solved = np.linalg.solve(inside, of[..., None])[..., 0]
        found[own] = 0.5 * (of * solved).sum(1) - 0.5 * np.linalg.slogdet(inside)[1]
    return found


def numbers(
    y: np.ndarray, M: np.ndarray, i: int, j: int
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """x | r ~ N((M + I)⁻¹ y, (M + I)⁻¹): the cause's numbers where it acts from i to before j."""
    q = y.shape[1]
    covariance = np.linalg.inv(M[i:j, :, i:j].sum((0, 2)) + np.eye(q))
    return covariance @ y[i:j].sum(0), covariance


def _log_prior(places: Places, i: np.ndarray, j: np.ndarray) -> np.ndarray:
    """log p(i, j) of pairs: ALWAYS, BEGINS, ENDS and BOTH, with `Places.prior` of each change."""
    last = len(places.low) + 1
    with np.errstate(divide="ignore"):
        one = np.log(places.prior)
        before = np.append(-np.inf, one)  # of a beginning before stretch i; none before the first
        after = np.append(one, -np.inf)[np.minimum(j, last) - 1]
        from_start, to_end = i == 0, j == last
        both = np.where(from_start | to_end, -np.inf, before[i] + after)
        whole = np.logaddexp.reduce(both) if (both > -np.inf).any() else 0.0
        return np.select(
            [from_start & to_end, to_end, from_start],
            [np.full(len(i), np.log(ALWAYS)), np.log(BEGINS) + before[i], np.log(ENDS) + after],
            np.log(BOTH) + both - whole,
        )
