"""Parts of a campaign, and the products and squares of their segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis.noise.likelihood import Modes

ROBUST = 6.0  # medians of χ², from which on a segment counts less
PART = 20  # segments of one part of a campaign: 10 minutes of a three-metre ship
FEWEST_PARTS = 4  # parts that a campaign is cut into, where it has twice as many segments


def parts_of(voyage: np.ndarray, part: int = PART, fewest: int = FEWEST_PARTS) -> list[np.ndarray]:
    """Rows of contiguous segments that belong together: no part crosses two voyages.

    voyage   [S] of each segment, in order
    """
    while True:
        found: list[np.ndarray] = []
        for name in dict.fromkeys(voyage.tolist()):
            rows = np.flatnonzero(voyage == name)
            found += np.array_split(rows, max(round(len(rows) / part), 1))
        if len(found) >= fewest or part <= 2 or len(voyage) < 2 * fewest:
            return found
        part = part // 2


def picked(modes: Modes, rows: np.ndarray) -> Modes:
    """The segments `rows` of a pass; its volume is not theirs."""
    return replace(
        modes, dd=modes.dd[rows], md=modes.md[rows], felt=modes.felt[rows], axes=modes.axes[rows],
        accelerations=modes.accelerations[rows],
    )  # fmt: skip


def products(
    modes: Modes, parts: Sequence[np.ndarray], unit: np.ndarray,
    weight: np.ndarray | None = None, noise: float = 1.0,
) -> list[np.ndarray]:  # fmt: skip
    """[1 + C, 1 + C] of each part, in units [C]."""
    by = np.concatenate(([1.0], unit))
    scale = np.outer(by, by)
    weight = np.ones(len(modes.dd)) if weight is None else weight
    return [picked(modes, rows).total(weight[rows], noise) * scale for rows in parts]


def robust_weights(square: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Weight [S] of segments with these squares [S]: what is ROBUST medians off or more counts
    less, so that a few segments do not decide. Segments that are not `kept` [S] have none."""
    middle = float(np.median(square[kept])) if kept.any() else 1.0
    weight = np.minimum(1.0, ROBUST * middle / np.maximum(square, 1e-9))
    return np.where(kept, weight, 0.0)


def squares(modes: Modes, numbers: np.ndarray, noise: float = 1.0) -> np.ndarray:
    """χ² [S] of the segments with these numbers [C + W], SI: of the pass's own columns, then of
    those of accelerations at the nodes."""
    r = np.concatenate(([1.0], -numbers))
    left, more = r[: modes.dd.shape[-1]], r[modes.dd.shape[-1] :]
    accelerations = modes.accelerations @ more
    along = modes.md @ left
    square = np.einsum("i,sij,j->s", left, modes.dd, left, optimize=True)
    square += ((2.0 * along + modes.felt * accelerations) * accelerations).sum(-1)
    return square - ((along + modes.felt * accelerations) ** 2 / (modes.felt + noise**-2.0)).sum(-1)


def marginal(gram: np.ndarray, information: np.ndarray, pull: np.ndarray) -> float:
    """Log likelihood [nats] of [e | J] with its numbers integrated out, up to a constant
    (a Gaussian integral).

    gram          products [1 + C, 1 + C] of [e | J]
    information   [C, C] on the numbers before any data; pull [C] what it pulls towards
    """
    both = gram[1:, 1:] + information
    towards = gram[1:, 0] + pull
    square = gram[0, 0] + pull @ np.linalg.solve(information, pull)
    square -= towards @ np.linalg.solve(both, towards)
    return -0.5 * float(square + np.linalg.slogdet(both)[1] - np.linalg.slogdet(information)[1])
