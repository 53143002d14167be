"""The gain of a cause: errors before and after on voyages that no fit has used."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from shiplog.nomenclature.channels import VELOCITY
from shiplog.simulation.scoring import loss_shares

BLOCK_WINDOWS = 2  # windows in a row that are drawn together: 200 s
BOOTSTRAP_DRAWS = 4000
ONE_BLOCK = 2.0  # ratio of errors up to which one block alone excludes nothing
RUNAWAY = 1e9  # L of a window whose rollout left the pond


@dataclass(frozen=True)
class Gain:
    """Mean L before and after over N held-out windows, and the reduction with its 90 % interval.

    channels   channel → reduction of its part of L
    typical    90 % interval of the reduction with every window counting alike: of a few windows
               with most of the error it says little, and of all others much

        1 - Σ_w a_w/Σ_w b_w,   b = L_before/(L_before + L_after),  a = L_after/(L_before + L_after)
    """

    before: float
    after: float
    low: float
    high: float
    windows: int
    channels: dict[str, float]
    typical: tuple[float, float] = (-math.inf, math.inf)

    @property
    def worse(self) -> tuple[float, float] | None:
        """The interval that is a loss from end to end, of all windows' error or of the typical
        window's; none where neither is."""
        lost = [one for one in ((self.low, self.high), self.typical) if one[1] < 0.0]
        return min(lost, key=lambda one: one[1], default=None)

    @property
    def reduction(self) -> float:
        return 1.0 - self.after / max(self.before, 1e-12)

    @property
    def real(self) -> bool:
        """Whether the interval excludes nothing."""
        return self.low > 0.0

    def as_json(self) -> dict:
        return {
            "before": self.before, "after": self.after, "reduction": self.reduction,
            "low": min(self.low, self.reduction), "high": max(self.high, self.reduction),
            "held_out_windows": self.windows, "channels": self.channels,
        }  # fmt: skip


def parts(error: np.ndarray, dt: np.ndarray) -> np.ndarray:
    """L of each window by channel [N, 3], of errors [N, I, 6]; at most RUNAWAY."""
    with np.errstate(over="ignore", invalid="ignore"):
        each = loss_shares(error, dt).sum(1)
    return np.where(np.isfinite(each), np.minimum(each, RUNAWAY), RUNAWAY)


def diverged(loss: np.ndarray) -> np.ndarray:
    """[N] bool: whether the rollout of each window diverged, of L by window and channel [N, 3]."""
    return loss.max(1, initial=0.0) >= RUNAWAY


def shares(before: np.ndarray, after: np.ndarray, voyages: Sequence[str]) -> tuple[float, float]:
    """90 % interval of the ratio of means of L after [N] to L before [N], bootstrapped over blocks
    of windows that never join two voyages (Künsch 1989).

    Of few blocks the bootstrap draws too narrow an interval: it is widened as Student's t is. One
    block says nothing of how blocks differ: its interval goes from 0 to `ONE_BLOCK`.
    """
    blocks: list[list[int]] = []
    for i, name in enumerate(voyages):
        fresh = not blocks or voyages[blocks[-1][0]] != name or len(blocks[-1]) == BLOCK_WINDOWS
        if fresh:
            blocks.append([])
        blocks[-1].append(i)
    of = np.array([[before[b].sum(), after[b].sum()] for b in blocks])
    rng = np.random.default_rng(0)
    drawn = of[rng.integers(len(of), size=(BOOTSTRAP_DRAWS, len(of)))].sum(1)
    low, high = np.quantile(drawn[:, 1] / np.maximum(drawn[:, 0], 1e-12), (0.05, 0.95))
    count, ratio = len(of), float(of[:, 1].sum() / max(of[:, 0].sum(), 1e-12))
    if count == 1:
        return 0.0, max(ratio, ONE_BLOCK)
    wider = float(stdtrit(count - 1, 0.95) / ndtri(0.95)) * (count / (count - 1)) ** 0.5
    return max(ratio + wider * (low - ratio), 0.0), ratio + wider * (high - ratio)


def gain(before: np.ndarray, after: np.ndarray, voyages: Sequence[str]) -> Gain:
    """Of L by window and channel [N, 3]: ratio of means, with the interval of `shares`."""
    low, high = shares(before.sum(1), after.sum(1), voyages)
    both = np.maximum(before.sum(1) + after.sum(1), 1e-12)
    less, more = shares(before.sum(1) / both, after.sum(1) / both, voyages)
    with np.errstate(divide="ignore", invalid="ignore"):
        each = 1.0 - after.sum(0) / np.maximum(before.sum(0), 1e-12)
    return Gain(
        float(before.sum(1).mean()), float(after.sum(1).mean()), 1.0 - high, 1.0 - low,
        len(voyages), {c.name: float(v) for c, v in zip(VELOCITY, each, strict=True)},
        (1.0 - more, 1.0 - less),
    )  # fmt: skip
