"""Numbers of causes between their bounds: a lag is not negative.

A posterior x ~ N(m, Σ) without bounds, of a prior N(0, diag(s²)), is restricted to a region B. The
most probable x in B is reported, and B multiplies the evidence by P(B | data) / P(B).
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear
from scipy.special import log_ndtr, logsumexp

REACH = 12.0  # standard deviations that an integral covers: 72 nats, which no prior makes up for
NODES = 2000  # of that integral: about a hundredth of a standard deviation apart
NEARLY_KNOWN = 1e-12  # of a variance, below which rounding may have left it


def bounded_mode(
    mean: np.ndarray, covariance: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """argmin (x - m)ᵀ Σ⁻¹ (x - m) over low ≤ x ≤ high [Q]: a Gaussian's most probable numbers
    between bounds; one at its bound moves others. Numbers of a fit that diverged stay as they are.

    mean, covariance   m [Q], Σ [Q, Q]; all in one system of units
    """
    if ((mean >= low) & (mean <= high)).all():
        return mean
    if not (np.isfinite(mean).all() and np.isfinite(covariance).all()):
        return mean
    unit = np.sqrt(np.diagonal(covariance))
    try:
        root = np.linalg.inv(np.linalg.cholesky(covariance / np.outer(unit, unit)))
    except np.linalg.LinAlgError:  # no covariance any more: each by itself
        return np.clip(mean, low, high)
    found = lsq_linear(root, root @ (mean / unit), (low / unit, high / unit), method="bvls").x
    return np.clip(found * unit, low, high)


def log_share(
    mean: np.ndarray, deviation: np.ndarray, size: np.ndarray, low: np.ndarray, high: np.ndarray
) -> float:
    """Σᵢ log P(lowᵢ ≤ xᵢ ≤ highᵢ | data) - log P(lowᵢ ≤ xᵢ ≤ highᵢ), nats: what bounds add to the
    log evidence of numbers [Q], each by itself.

    mean, deviation  mᵢ and Σᵢᵢ^½ of the posterior without bounds
    size             sᵢ, standard deviation of the prior, about zero
    """
    after = _log_probability((low - mean) / deviation, (high - mean) / deviation)
    return float((after - _log_probability(low / size, high / size)).sum())


def mode_on_board(
    mean: np.ndarray, covariance: np.ndarray, farthest: float, at: int = 0
) -> np.ndarray:
    """argmin (x - m)ᵀ Σ⁻¹ (x - m) over |xᵢ₊₁| ≤ k |xᵢ| [Q]: the most probable numbers of which the
    one after i = `at` is at most k = `farthest` times that one, either way; those that are, stay.

    On an edge nᵀ x = 0, n = ±k eᵢ - eᵢ₊₁, the minimum is x = m - Σ n (nᵀ m) / (nᵀ Σ n), of cost
    (nᵀ m)² / (nᵀ Σ n); the cheaper edge has it.
    """
    if abs(mean[at + 1]) <= farthest * abs(mean[at]):
        return mean
    edges = []
    for way in (-farthest, farthest):
        n = np.zeros(len(mean))
        n[at : at + 2] = way, -1.0  # second = way · first
        Sigma_n = covariance @ n
        x = mean - Sigma_n * (n @ mean) / (n @ Sigma_n)
        edges.append((float((n @ mean) ** 2 / (n @ Sigma_n)), tuple(x)))
    return np.array(min(edges)[1])


def log_share_on_board(
    mean: np.ndarray, covariance: np.ndarray, size: np.ndarray, farthest: float
) -> float:
    """log P(|x₂| ≤ k |x₁| | data) - log P(|x₂| ≤ k |x₁|), nats: what this bound adds to the log
    evidence of two numbers, k = `farthest`.

    mean, covariance  m [2], Σ [2, 2] of the posterior without this bound
    size              s [2], standard deviations of the prior, about zero
    """
    return _log_probability_on_board(mean, covariance, farthest) - _log_probability_on_board(
        np.zeros(2), np.diag(size**2), farthest
    )


def _log_probability_on_board(mean: np.ndarray, covariance: np.ndarray, farthest: float) -> float:
    """log ∫ N(x₁; m₁, Σ₁₁) P(|x₂| ≤ k |x₁| | x₁) dx₁, by a sum over NODES points within REACH
    standard deviations; x₂ | x₁ ~ N(m₂ + β (x₁ - m₁), Σ₂₂ - β Σ₁₂), β = Σ₁₂/Σ₁₁."""
    deviation = float(np.sqrt(covariance[0, 0]))
    first = mean[0] + deviation * np.linspace(-REACH, REACH, NODES)
    slope = covariance[0, 1] / covariance[0, 0]
    left = covariance[1, 1] - slope * covariance[0, 1]
    rest = np.sqrt(max(left, NEARLY_KNOWN * covariance[1, 1]))
    middle, most = mean[1] + slope * (first - mean[0]), farthest * np.abs(first)
    with np.errstate(divide="ignore"):  # nothing is between a bound and itself
        inside = _log_probability((-most - middle) / rest, (most - middle) / rest)
    density = -0.5 * ((first - mean[0]) / deviation) ** 2
    return float(np.subtract(logsumexp(density + inside), logsumexp(density)))


def _log_probability(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """log(Φ(high) - Φ(low)) of the standard Gaussian distribution Φ."""
    turned = low > 0.0  # the tail that loses no digits
    low, high = np.where(turned, -high, low), np.where(turned, -low, high)
    upper, lower = log_ndtr(high), log_ndtr(low)
    return upper + np.log1p(-np.exp(lower - upper))
