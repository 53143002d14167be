"""Numbers of causes between their bounds: a lag is not negative."""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear
from scipy.special import log_ndtr, logsumexp

REACH = 12.0  # standard deviations that an integral covers: 72 nats, which no prior makes up for
NODES = 2000  # of that integral: about a hundredth of a standard deviation apart
NEARLY_KNOWN = 1e-12  # of a variance, below which rounding may have left it


def within(
    mean: np.ndarray, covariance: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """[Q] a Gaussian's most probable numbers between bounds; one at its bound moves others. Numbers
    of a fit that diverged stay as they are."""
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
    """What bounds add to the log evidence of numbers [Q]: the posterior probability that they are
    within, over the prior one. Each number by itself.

    mean, deviation  of the posterior without bounds
    size             standard deviation of the prior, about zero
    """
    after = _log_within((low - mean) / deviation, (high - mean) / deviation)
    return float((after - _log_within(low / size, high / size)).sum())


def on_board(mean: np.ndarray, covariance: np.ndarray, farthest: float, at: int = 0) -> np.ndarray:
    """[Q] a Gaussian's most probable numbers of which the one after `at` is at most `farthest`
    times that one, either way; those that are, stay. One that moves, moves others."""
    if abs(mean[at + 1]) <= farthest * abs(mean[at]):
        return mean
    found = []
    for way in (-farthest, farthest):
        normal = np.zeros(len(mean))
        normal[at : at + 2] = way, -1.0  # second = way · first
        pull = covariance @ normal
        moved = mean - pull * (normal @ mean) / (normal @ pull)
        found.append((float((normal @ mean) ** 2 / (normal @ pull)), tuple(moved)))
    return np.array(min(found)[1])


def log_on_board(
    mean: np.ndarray, covariance: np.ndarray, size: np.ndarray, farthest: float
) -> float:
    """What it adds to the log evidence of two numbers that the second is at most `farthest` times
    the first one: the posterior probability of that, over the prior one.

    mean, covariance  of the posterior without this bound
    size              [2] standard deviations of the prior, about zero
    """
    return _log_on_board(mean, covariance, farthest) - _log_on_board(
        np.zeros(2), np.diag(size**2), farthest
    )


def _log_on_board(mean: np.ndarray, covariance: np.ndarray, farthest: float) -> float:
    """Log probability that two numbers are so, the first one integrated out."""
    deviation = float(np.sqrt(covariance[0, 0]))
    first = mean[0] + deviation * np.linspace(-REACH, REACH, NODES)
    slope = covariance[0, 1] / covariance[0, 0]
    left = covariance[1, 1] - slope * covariance[0, 1]
    rest = np.sqrt(max(left, NEARLY_KNOWN * covariance[1, 1]))
    middle, most = mean[1] + slope * (first - mean[0]), farthest * np.abs(first)
    with np.errstate(divide="ignore"):  # nothing is between a bound and itself
        inside = _log_within((-most - middle) / rest, (most - middle) / rest)
    density = -0.5 * ((first - mean[0]) / deviation) ** 2
    return float(np.subtract(logsumexp(density + inside), logsumexp(density)))


def _log_within(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Log probability of a standard Gaussian between two numbers."""
    turned = low > 0.0  # the tail that loses no digits
    low, high = np.where(turned, -high, low), np.where(turned, -low, high)
    upper, lower = log_ndtr(high), log_ndtr(low)
    return upper + np.log1p(-np.exp(lower - upper))
