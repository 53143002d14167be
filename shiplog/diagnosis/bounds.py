"""Numbers of causes between their bounds: a lag is not negative."""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear
from scipy.special import log_ndtr


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


def _log_within(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Log probability of a standard Gaussian between two numbers."""
    turned = low > 0.0  # the tail that loses no digits
    low, high = np.where(turned, -high, low), np.where(turned, -low, high)
    upper, lower = log_ndtr(high), log_ndtr(low)
    return upper + np.log1p(-np.exp(lower - upper))
