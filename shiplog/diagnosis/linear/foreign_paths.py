"""Segments of a foreign simulator: its path step by step, and the columns of its slopes.

The path and its columns are those of `kernel.paths`; f and its slopes are asked of the simulator
(`simulation.foreign_model`), the slopes every `smooth` seconds and straight in between.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from shiplog.models.base import kinematics
from shiplog.simulation import foreign_model
from shiplog.simulation.kernel import given_slopes


def states_along(
    model: Any, theta: np.ndarray, start: np.ndarray, acceleration: np.ndarray,
    driven: np.ndarray, step: float,
) -> np.ndarray:  # fmt: skip
    """xₖ₊₁ = xₖ + h ((3/2) fₖ - (1/2) fₖ₋₁), fₖ = ẋ(xₖ, uₖ; θ) + (0, a_u, 0, a_v, 0, a_r)ₖ, the
    first step by Euler: states [S, K, 6]."""
    found = foreign_model.along(model, theta, start, acceleration, driven, step)
    if found is not None:
        return found
    x, states, before = start, [start], None
    for k in range(driven.shape[1] - 1):
        rows = np.concatenate((x, driven[:, k]), 1)
        nu_dot = foreign_model.values(model, theta, rows) + acceleration[:, k]
        now = kinematics(x, nu_dot)
        x = x + step * (now if before is None else 1.5 * now - 0.5 * before)
        before = now
        states.append(x)
    return np.stack(states, 1)


def columns(
    model: Any, theta: np.ndarray, start: np.ndarray, acceleration: np.ndarray,
    driven: np.ndarray, hats: np.ndarray, step: float, bins: int,
    moved: tuple[np.ndarray, np.ndarray, int] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:  # fmt: skip
    """As `kernel.paths.columns`."""
    states = states_along(model, theta, start, acceleration, driven, step)
    slopes = _instant_slopes(model, theta, states, driven, step)
    pairs = 0.5 * (states[:, 1:] + states[:, :-1])
    y = pairs.reshape(len(states), bins, -1, 6).mean(2)
    if moved is None:
        slopes[2] = slopes[2][..., :0]
    z, j = given_slopes.columns(states, slopes, hats, step, bins, moved)
    return y, z, j if moved is not None else None


def _instant_slopes(
    model: Any, theta: np.ndarray, states: np.ndarray, driven: np.ndarray, step: float
) -> list[np.ndarray]:
    """∂f/∂x, ∂f/∂u, ∂f/∂θ at every instant [S, K, 3, …]."""
    count, instants, _ = states.shape
    stride = max(round(model.smooth / step), 1)
    at = np.unique(np.append(np.arange(0, instants, stride), instants - 1))
    rows = (values[:, at].reshape(count * len(at), -1) for values in (states, driven))
    _, *found = foreign_model.slopes(model, theta, *rows)
    right = np.clip(np.searchsorted(at, np.arange(instants)), 1, len(at) - 1)
    part = (np.arange(instants) - at[right - 1]) / (at[right] - at[right - 1])
    every = []
    for values in found:
        values = values.reshape(count, len(at), 3, -1)
        left = values[:, right - 1]
        every.append(left + part[:, None, None] * (values[:, right] - left))
    return every
