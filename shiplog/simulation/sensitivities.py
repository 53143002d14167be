"""Rollouts of physical models, and their exact derivatives.

The kernel of the model's kind runs them (`shiplog.simulation.kernel`): code made from the same
equations. Where none can be made, JAX runs them as they stand (`jax_rollouts`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.simulation import foreign_model
from shiplog.simulation.kernel import rollouts
from shiplog.simulation.scoring import window_loss
from shiplog.simulation.window_series import Normal, Physical, WindowSeries, pick, series
from shiplog.voyages.windows.windows import Windows

WINDOWS_AT_A_TIME = 128  # their sensitivities to 60 parameters are 45 MB


def rollout(
    model: Physical, theta: np.ndarray, data: WindowSeries, begin: np.ndarray | None = None
) -> np.ndarray:
    """Explicit Euler (Eq. 9) from the first measured state: states [N, I, 6].

    The paper's step is the sampling interval; a model with `substeps` cuts it, inputs held. A
    simulator of others goes on as it does by itself, `begin` [N] s into the voyages.
    """
    if foreign_model.simulator_of(model) is not None:
        return foreign_model.rollout(model, theta, data, begin)
    found = rollouts.rollout(model, theta, data)
    if found is None:
        from shiplog.simulation import jax_rollouts

        return jax_rollouts.rollout(model, theta, data)
    return found


def linearised(
    model: Physical,
    theta: np.ndarray,
    data: WindowSeries,
    out: tuple[np.ndarray, np.ndarray] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """States [N, I, 6] and their derivatives by θ [N, I, 6, P], exact for the Euler rollout.

    out   what an earlier call of these shapes gave, to be overwritten: new memory costs as much as
          what is put into it
    """
    found = rollouts.slopes(model, theta, data, out)
    if found is None:
        from shiplog.simulation import jax_rollouts

        return jax_rollouts.linearised(model, theta, data)
    return found


def normal(
    model: Physical, theta: np.ndarray, data: WindowSeries, free: tuple[int, ...] | None = None
) -> Normal:
    """Loss, gradient and Gauss-Newton matrix in flat memory.

    free   indices of the parameters wanted; then P is their number
    """
    found = rollouts.normal(model, theta, data, range(len(theta)) if free is None else free)
    if found is None:
        from shiplog.simulation import jax_rollouts

        return jax_rollouts.normal(model, theta, data, free)
    return found


def losses(model: Physical, theta: np.ndarray, data: WindowSeries) -> np.ndarray:
    """L of each window [N], infinite where the rollout diverges."""
    return window_loss(rollout(model, theta, data) - data.measured, data.dt)


def spread(
    model: Physical, theta: np.ndarray, covariance: np.ndarray, data: WindowSeries
) -> np.ndarray:
    """Standard deviation of the states [N, I, 6] that the parameters' uncertainty alone makes."""
    parts = []
    for at in range(0, len(data.measured), WINDOWS_AT_A_TIME):
        part = pick(data, slice(at, at + WINDOWS_AT_A_TIME))
        slopes = linearised(model, theta, part)[1]
        with np.errstate(over="ignore", invalid="ignore"):
            variance = np.einsum("nkip,pq,nkiq->nki", slopes, covariance, slopes, optimize=True)
        known = np.isfinite(variance)
        parts.append(np.sqrt(np.where(known, np.maximum(variance, 0.0), np.inf)))
    return np.concatenate(parts)


@dataclass(frozen=True)
class Simulator:
    """Equations, their numbers, and how sure those are: what a run of a physical model holds."""

    model: Physical
    theta: np.ndarray  # [P]
    covariance: np.ndarray  # [P, P]

    def simulate(self, windows: Windows) -> np.ndarray:
        """States [N, I, 6], as shiplog.simulation.rollout gives them."""
        return rollout(self.model, self.theta, series(windows))

    def spread(self, windows: Windows) -> np.ndarray:
        """[N, I, 6]"""
        return spread(self.model, self.theta, self.covariance, series(windows))
