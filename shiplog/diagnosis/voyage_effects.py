"""How far the numbers that fit one part of a campaign are from those that fit the others.

A model whose equations are not the ship's has other best coefficients on every voyage. Each part of
a campaign therefore has numbers θ + b of its own, b ~ N(0, D), and D is learned from the nominal
campaign (random effects: Laird & Ware 1982). What all parts agree on stays known; what they
disagree on is loosened. A diagonal D has one variance a group of numbers.

All arrays are in units of `Columns.unit`; G is a part's products [1 + C, 1 + C] of [e | J].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular

ROUNDS = 15  # of expectation-maximisation; later ones change no variance by a tenth
FIRST = 0.1  # standard deviation at which it begins, in units of a number's plausible size
LEAST = 0.02  # that one pseudo-part contributes: no two voyages are alike to better than that


@dataclass(frozen=True)
class VoyageEffects:
    """deviation [C]: standard deviation of b. size [C]: of θ itself, where it was learned.
    numbers [V, C]: θ + b of every part; none where nothing was learned."""

    deviation: np.ndarray
    size: np.ndarray
    numbers: np.ndarray | None = None


def reduced(gram: np.ndarray, deviation: np.ndarray) -> tuple[np.ndarray, float]:
    """A part's products with its own b integrated out, and log|I + D^½ M D^½|.

    gram        [1 + C, 1 + C]
    deviation   [C]
    """
    free = np.flatnonzero(deviation > 0.0)
    if not len(free):
        return gram, 0.0
    own = deviation[free]
    inner = np.outer(own, own) * gram[np.ix_(1 + free, 1 + free)]
    inner[np.diag_indices(len(free))] += 1.0
    root = cholesky(inner, lower=True, check_finite=False)
    half = solve_triangular(root, own[:, None] * gram[1 + free], lower=True, check_finite=False)
    return gram - half.T @ half, 2.0 * float(np.log(np.diagonal(root)).sum())


def learn(
    each: Sequence[np.ndarray],
    known: np.ndarray,
    pull: np.ndarray,
    groups: Sequence[np.ndarray],
    sized: Sequence[np.ndarray] = (),
) -> VoyageEffects:
    """D by expectation-maximisation (Dempster, Laird & Rubin 1977).

    each     products of every part
    known    [C] information on θ before any data; `pull` [C] what it pulls towards
    groups   columns that share one variance; other columns have none
    sized    columns whose prior size (the same in every part) is learned too
    """
    count = len(known)
    variance, known = np.zeros(count), known.copy()
    for columns in groups:
        variance[columns] = FIRST**2
    free = np.flatnonzero(variance > 0.0)
    parts = [(g[1:, 1:], g[1:, 0]) for g in each]
    numbers = np.zeros((len(parts), count))
    for _ in range(ROUNDS):
        information, towards = np.diag(known), pull.copy()
        inner = []
        deviation = np.sqrt(variance[free])
        for m, g in parts:
            own = np.eye(len(free)) + np.outer(deviation, deviation) * m[np.ix_(free, free)]
            spread = np.linalg.inv(own) * np.outer(deviation, deviation)  # (D⁻¹ + M)⁻¹
            gain = spread @ m[free]
            information += m - m[:, free] @ gain
            towards += g - gain.T @ g[free]
            inner.append((spread, gain))
        covariance = np.linalg.inv(information)
        mean = covariance @ towards
        second = np.zeros(len(free))
        numbers = np.repeat(mean[None], len(parts), axis=0)
        for own_numbers, (spread, gain), (_, g) in zip(numbers, inner, parts, strict=True):
            found = spread @ g[free] - gain @ mean
            own_numbers[free] += found
            second += found**2 + np.diagonal(spread)
            second += np.einsum("ij,ij->i", gain @ covariance, gain)
        whole = np.zeros(count)
        whole[free] = second
        for columns in groups:
            seen = len(parts) * len(columns)
            variance[columns] = (whole[columns].sum() + LEAST**2) / (seen + 1.0)
        own = mean**2 + np.diagonal(covariance)
        for columns in sized:
            known[columns] = (len(columns) + 1.0) / (own[columns].sum() + LEAST**2)
    return VoyageEffects(np.sqrt(variance), known**-0.5, numbers)
