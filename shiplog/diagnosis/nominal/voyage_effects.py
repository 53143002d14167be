"""How far the numbers that fit one part of a campaign are from those that fit the others.

A model whose equations are not the ship's has other best coefficients on every voyage. Each part of
a campaign therefore has numbers θ + b of its own, b ~ N(0, D), and D is estimated from the nominal
campaign (random effects: Laird & Ware 1982). What all parts agree on stays known; what they
disagree on is loosened. A diagonal D has one variance a group of numbers.

All arrays are in units of `Columns.unit`; G is a part's products [1 + C, 1 + C] of [e | J].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, get_lapack_funcs, solve_triangular

EM_ROUNDS = 15  # of three steps of expectation-maximisation each, at most
CONVERGED = 0.1  # of the logarithm of a variance: a round that moves none by more is the last
LEAP = 16.0  # steps at once, at most
BOUNDS = (-20.0, 10.0)  # of the logarithm of a variance: 5e-5 to 150 plausible sizes
FIRST_DEVIATION = 0.1  # at which it begins, in units of a number's plausible size
LEAST_DEVIATION = 0.001  # of one pseudo-part, so that a variance cannot become zero
UNSEEN_DEVIATION = 0.02  # of numbers that the nominal campaign says nothing of


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


def own_numbers(gram: np.ndarray, common: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """b [C] of one part, most probable given θ, and zero where it has none.

    gram       products [1 + C, 1 + C] of the part, or of more columns behind these
    common     θ [C]
    deviation  [C] of b
    """
    b, free = np.zeros(len(common)), np.flatnonzero(deviation > 0.0)
    own = gram[np.ix_(1 + free, 1 + free)] + np.diag(deviation[free] ** -2.0)
    left = gram[1 + free, 0] - gram[1 + free, 1 : 1 + len(common)] @ common
    b[free] = np.linalg.solve(own, left)
    return b


def learn(
    each: Sequence[np.ndarray],
    known: np.ndarray,
    pull: np.ndarray,
    groups: Sequence[np.ndarray],
    sized: Sequence[np.ndarray] = (),
) -> VoyageEffects:
    """D by expectation-maximisation (Dempster, Laird & Rubin 1977), each round three steps of it of
    which the first two say how far the third may leap (SQUAREM, Varadhan & Roland 2008).

    each     products of every part
    known    [C] information on θ before any data; `pull` [C] what it pulls towards
    groups   columns that share one variance; other columns have none
    sized    columns whose prior size (the same in every part) is learned too
    """
    free = np.sort(np.concatenate([np.zeros(0, int), *groups]))
    problem = _EffectsProblem(
        [_Part.of(gram, free) for gram in each], free, known, pull, list(groups), list(sized)
    )
    sizes = np.log(np.full(len(problem.groups) + len(problem.sized), FIRST_DEVIATION**2))
    for at, columns in enumerate(problem.sized, len(problem.groups)):
        sizes[at] = -math.log(known[columns[0]])
    for _ in range(EM_ROUNDS):
        one, _ = problem.step(sizes)
        two, _ = problem.step(one)
        first, second = one - sizes, two - one
        bend = float(np.linalg.norm(second - first))
        leap = float(np.clip(np.linalg.norm(first) / max(bend, 1e-12), 1.0, LEAP))
        before = sizes
        sizes, numbers = problem.step(sizes + 2.0 * leap * first + leap**2 * (second - first))
        if np.abs(sizes - before).max(initial=0.0) < CONVERGED:
            break
    variance, information = problem.spread(sizes)
    return VoyageEffects(np.sqrt(variance), information**-0.5, numbers)


@dataclass(frozen=True)
class _Part:
    """Products M [C, C] and g [C] of a part, and the rows of both that have a b [F]."""

    m: np.ndarray
    g: np.ndarray
    own: np.ndarray
    own_g: np.ndarray
    both: np.ndarray

    @classmethod
    def of(cls, gram: np.ndarray, free: np.ndarray) -> _Part:
        m, g = np.ascontiguousarray(gram[1:, 1:]), gram[1:, 0]
        return cls(m, g, m[free], g[free], m[np.ix_(free, free)])


@dataclass(frozen=True)
class _EffectsProblem:
    """Parts with what is known of θ, and which columns share one variance; `free` [F] are those
    of all groups."""

    parts: list[_Part]
    free: np.ndarray
    known: np.ndarray
    pull: np.ndarray
    groups: list[np.ndarray]
    sized: list[np.ndarray]

    def spread(self, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Variance [C] of b, and information [C] on θ, of the logarithms of all variances."""
        variance, known = np.zeros(len(self.known)), self.known.copy()
        for columns, size in zip(self.groups, sizes, strict=False):
            variance[columns] = math.exp(size)
        for columns, size in zip(self.sized, sizes[len(self.groups) :], strict=True):
            known[columns] = math.exp(-size)
        return variance, known

    def step(self, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One step of expectation-maximisation: logarithms of the variances, and θ + b [V, C]."""
        variance, known = self.spread(np.clip(sizes, *BOUNDS))
        free = self.free
        deviation = np.sqrt(variance[free])
        scale = np.outer(deviation, deviation)
        information, towards, inner = np.diag(known), self.pull.copy(), []
        for part in self.parts:
            spread = _inverse(np.eye(len(free)) + scale * part.both) * scale  # (D⁻¹ + M)⁻¹
            gain = spread @ part.own
            information += part.m - part.own.T @ gain
            towards += part.g - gain.T @ part.own_g
            inner.append((spread, gain))
        covariance = _inverse(information)
        mean = covariance @ towards
        second = np.zeros(len(variance))
        numbers = np.repeat(mean[None], len(self.parts), axis=0)
        for own_numbers, (spread, gain), part in zip(numbers, inner, self.parts, strict=True):
            found = spread @ part.own_g - gain @ mean
            own_numbers[free] += found
            second[free] += found**2 + np.diagonal(spread)
            second[free] += ((gain @ covariance) * gain).sum(1)
        squares = mean**2 + np.diagonal(covariance)
        count = len(self.parts)
        moved = [_mean(second[c].sum(), count * len(c)) for c in self.groups]
        moved += [_mean(squares[c].sum(), len(c)) for c in self.sized]
        return np.log(np.array(moved)), numbers


def _inverse(matrix: np.ndarray) -> np.ndarray:
    """Of a positive definite matrix. Raises np.linalg.LinAlgError where it is not."""
    if not len(matrix):
        return matrix
    root = cholesky(matrix, lower=True, check_finite=False)
    (potri,) = get_lapack_funcs(("potri",), (root,))
    lower, failed = potri(root, lower=True)
    if failed:
        raise np.linalg.LinAlgError("a matrix is singular")
    return np.tril(lower) + np.tril(lower, -1).T


def _mean(total: float, count: int) -> float:
    """Mean square, one pseudo-observation of LEAST_DEVIATION among the others."""
    return (total + LEAST_DEVIATION**2) / (count + 1.0)
