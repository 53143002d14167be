"""Sizes of a cause in each voyage by partial pooling, equations (21) to (23)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

LEVEL_SPREAD = 2.0  # s, realistic sizes: a season's level may be twice as large as is realistic
SPREADS = np.geomspace(0.01, 3.0, 25)  # τ, realistic sizes: from hardly any to three of them
HALF_CAUCHY = 0.3  # A: voyages of one level differ by less than a third of a realistic size
DRAWS = 4000  # the ends of a 90 % interval are then known to a twentieth of it
SEED = 0


@dataclass(frozen=True)
class Voyages:
    """Likelihood (21) of a cause's size in each of V voyages, in units of its realistic size.

    y      [V, q]
    M      [V, q, V, q]
    days   [V] date of each voyage, days
    level  [V] which level μ_g each has, counted from 0
    """

    y: np.ndarray
    M: np.ndarray
    days: np.ndarray
    level: np.ndarray

    @property
    def span(self) -> float:
        """Days from the first voyage to the last."""
        return float(np.ptp(self.days))

    @property
    def middle(self) -> float:
        """The date at which t is zero."""
        return 0.5 * float(self.days.max() + self.days.min())


@dataclass(frozen=True)
class Pooled:
    """Draws of (22), and what each voyage says by itself, in units of the realistic size.

    sizes       [D, V, q]   x_v
    levels      [D, G, q]   μ_g, at the middle of the season
    slope       [D, q]      β, over the season; zero where it has none
    spread      [D]         τ
    alone       [D, V, q]   x_v where each has a size of its own, x_v ~ N(0, s² I): without pooling
    """

    sizes: np.ndarray
    levels: np.ndarray
    slope: np.ndarray
    spread: np.ndarray
    alone: np.ndarray


def pool(of: Voyages, wears: bool, freedom: float = math.inf) -> Pooled:
    """DRAWS of w and τ given the data; the same ones at each call.

    wears    whether there is a slope β
    freedom  degrees of it with which the size of the covariance is known: Student's t
    """
    V, q = of.y.shape
    G = int(of.level.max()) + 1
    rng = np.random.default_rng(SEED)
    slope = wears and of.span > 0.0 and V > 2
    B = _design(of, G, slope)
    M, y = of.M.reshape(V * q, V * q), of.y.reshape(V * q)
    information, pull = B.T @ M @ B, B.T @ y
    given = [
        _posterior(information, pull, _precision(tau, G * q, q if slope else 0, V * q))
        for tau in SPREADS
    ]
    # even in log τ, so that a density over τ counts τ times
    log_p = np.array([one[2] for one in given]) + np.log(SPREADS)
    log_p -= np.log1p((SPREADS / HALF_CAUCHY) ** 2)
    p = np.exp(log_p - log_p.max())
    which = rng.choice(len(SPREADS), DRAWS, p=p / p.sum())
    heavy = np.ones(DRAWS)
    if math.isfinite(freedom):
        heavy = np.sqrt(freedom / rng.chisquare(freedom, DRAWS))
    standard = rng.standard_normal((DRAWS, len(pull))) * heavy[:, None]
    w = np.empty_like(standard)
    for i in np.unique(which):
        mean, root, _ = given[i]
        w[which == i] = mean + standard[which == i] @ root.T
    after = G * q
    return Pooled(
        (w @ B.T).reshape(DRAWS, V, q), w[:, :after].reshape(DRAWS, G, q),
        w[:, after : after + q] if slope else np.zeros((DRAWS, q)), SPREADS[which],
        _alone(of, rng, heavy),
    )  # fmt: skip


def _design(of: Voyages, G: int, slope: bool) -> np.ndarray:
    """B [V q, p]: x = B (μ, β, u)."""
    V, q = of.y.shape
    level = np.kron(np.eye(G)[of.level], np.eye(q))
    parts = [level]
    if slope:
        t = (of.days - of.middle) / of.span
        parts.append(np.kron(t[:, None], np.eye(q)))
    return np.concatenate((*parts, np.eye(V * q)), axis=1)


def _precision(tau: float, levels: int, slopes: int, sizes: int) -> np.ndarray:
    return np.concatenate(
        (np.full(levels, LEVEL_SPREAD**-2.0), np.ones(slopes), np.full(sizes, tau**-2.0))
    )


def _posterior(
    information: np.ndarray, pull: np.ndarray, precision: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """A⁻¹ b, a root of A⁻¹, and (23)."""
    L = np.linalg.cholesky(information + np.diag(precision))
    root = np.linalg.inv(L).T  # A⁻¹ = L⁻ᵀ L⁻¹
    half = root.T @ pull
    volume = 0.5 * float(np.log(precision).sum()) - float(np.log(np.diagonal(L)).sum())
    return root @ half, root, 0.5 * float(half @ half) + volume


def _alone(of: Voyages, rng: np.random.Generator, heavy: np.ndarray) -> np.ndarray:
    """x | r with a size for each voyage and nothing that they have in common: x ~ N(0, s² I)."""
    V, q = of.y.shape
    information = of.M.reshape(V * q, V * q)
    mean, root, _ = _posterior(information, of.y.reshape(V * q), np.full(V * q, LEVEL_SPREAD**-2.0))
    drawn = mean + (rng.standard_normal((DRAWS, V * q)) * heavy[:, None]) @ root.T
    return drawn.reshape(DRAWS, V, q)
