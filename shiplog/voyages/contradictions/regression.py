"""Linear regression of changes over windows: outliers tamed, the interval from blocks of time.

    y = Σ_j θ_j x_j + ε,     θ real,  y and x_j complex or real [w]

Huber's weights (1964); prior variances of nuisances; the covariance from the scatter of the scores
between blocks of time (Liang and Zeger 1986), since neighbouring windows share their errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

OF_REAL, OF_COMPLEX = 1.4826, 0.8493  # standard deviation of a component over the median of |ε|
HUBER = 2.0  # standard deviations
TURNS = 6
LEAST_NOISE = 1e-4  # of the size of y: numbers without noise are no instrument
SPARE = 3  # windows and blocks beyond one a parameter
MOST = 600  # windows: of more, every second or third is taken
BLOCKS = 30  # at most: windows next to each other share a block
NINETY = 0.95  # quantile of either end of a 90 % interval


@dataclass(frozen=True)
class Regression:
    """theta [k], cov [k, k]; left: median |ε| over median |y|; quantile of Student's t."""

    theta: np.ndarray
    cov: np.ndarray
    left: float
    quantile: float
    blocks: int

    def interval(self, index: int) -> tuple[float, float, float]:
        """Value, low, high: 90 %."""
        value = float(self.theta[index])
        half = self.quantile * float(np.sqrt(max(self.cov[index, index], 0.0)))
        return value, value - half, value + half

    def polar(self) -> tuple[float, float, float, float]:
        """|z|, arg z and their half 90 % intervals (of ln |z| and of arg z) of z = θ₀ + iθ₁."""
        z = complex(self.theta[0], self.theta[1])
        size = max(abs(z), 1e-12)
        along = np.array([z.real, z.imag]) / size
        across = np.array([-z.imag, z.real]) / size
        cov = self.cov[:2, :2]
        radial, tangential = (float(np.sqrt(max(v @ cov @ v, 0.0))) for v in (along, across))
        return (
            size,
            float(np.angle(z)),
            self.quantile * radial / size,
            self.quantile * min(tangential / size, np.pi),
        )


def regress(
    y: np.ndarray,
    columns: Sequence[np.ndarray],
    block: np.ndarray,
    prior: Sequence[float],
) -> Regression | None:
    """y [w], columns k of [w], block [w], prior k: one standard deviation about 0, inf where
    nothing is known. None where there are too few windows."""
    if len(y) > MOST:
        every = -(-len(y) // MOST)
        y, columns, block = y[::every], [one[::every] for one in columns], block[::every]
    x = np.stack(columns, axis=1)
    count, k = x.shape
    names, block = _blocks(block)
    if count < k + SPARE or names < k + SPARE:
        return None
    precision = np.diag(np.array([0.0 if np.isinf(p) else p**-2.0 for p in prior]))
    size = float(np.sqrt(np.mean(np.abs(y) ** 2)))
    floor = max(LEAST_NOISE * size, 1e-12)
    sigma, weight = max(size, floor), np.ones(count)
    typical = OF_COMPLEX if np.iscomplexobj(x) else OF_REAL
    theta = np.zeros(k)
    for _ in range(TURNS):
        weighted = (x * weight[:, None]).conj().T / sigma**2
        normal, score = np.real(weighted @ x) + precision, np.real(weighted @ y)
        try:
            theta = np.linalg.solve(normal, score)
        except np.linalg.LinAlgError:
            return None
        away = np.abs(y - x @ theta)
        sigma = max(typical * float(np.median(away)), floor)
        weight = np.minimum(1.0, HUBER * sigma / np.maximum(away, 1e-15))
    e = y - x @ theta
    try:
        normal = np.real((x * weight[:, None]).conj().T @ x) / sigma**2 + precision
        inverse = np.linalg.inv(normal)
    except np.linalg.LinAlgError:
        return None
    scores = np.real(x.conj() * (weight * e)[:, None]) / sigma**2
    summed = np.stack([np.bincount(block, s, names) for s in scores.T], axis=1)
    meat = summed.T @ summed * names / max(names - k, 1) + precision
    cov = inverse @ meat @ inverse
    alone = np.diag(inverse)
    if not (alone > 0.0).all() or not (np.diag(cov) >= 0.0).all():  # two go together entirely
        return None
    larger = np.sqrt(np.maximum(1.0, alone / np.maximum(np.diag(cov), 1e-300)))
    cov = larger[:, None] * cov * larger[None, :]
    left = float(np.median(np.abs(e))) / max(float(np.median(np.abs(y))), 1e-12)
    return Regression(theta, cov, left, float(stdtrit(max(names - k, 2), NINETY)), names)


def _blocks(block: np.ndarray) -> tuple[int, np.ndarray]:
    """At most BLOCKS of them, neighbours together; [w] counted from 0."""
    _, at = np.unique(block, return_inverse=True)
    found = int(at.max()) + 1 if len(at) else 0
    together = max(-(-found // BLOCKS), 1)
    at = at // together
    return (int(at.max()) + 1 if len(at) else 0), at
