"""An MMG of the ship that stands in for a simulator whose coefficients nobody can change.

A cause that changes the ship (fouling, payload, a rudder's force) changes coefficients c. Where a
simulator has none that are known, the same change of an MMG g is added to it,

    ν̇ = f(x, u, ω) + g(x, u, ω; c') - g(x, u, ω; c)

c is fitted to the simulator's accelerations f at rows of the training voyages, ridge regression
towards the published or estimated ones c₀ with plausible spreads s:

    min_c Σ |(f - g(c)) / σ|² + Σ ((c - c₀)/s)²,   σ = MISFIT times the root mean square of f
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.models.coefficients import Parameters
from shiplog.models.mmg import MMG
from shiplog.simulation.kernel import rollouts

MISFIT = 0.05  # of the acceleration: an MMG describes a ship to some hundredths
ROWS = 1500  # of the training voyages, at most: fifty for each coefficient
PATIENCE_S = 60.0  # s for these rows: of a slow simulator there are fewer
ROUNDS = 25  # of Gauss-Newton, damped or not
# Root mean square of what the stand-in leaves of the acceleration, over its root mean square, from
# which on it is not of this ship: a change of it would not be a change of the simulator
POOR = 0.5


@dataclass(frozen=True)
class StandIn:
    """values [P] of its coefficients; misfit [3], what it leaves of surge, sway and yaw, as a share
    of their root mean square."""

    values: np.ndarray
    misfit: np.ndarray

    @property
    def poor(self) -> bool:
        return bool(np.median(self.misfit) > POOR)


def fit(model: MMG, start: Parameters, rows: np.ndarray, accelerations: np.ndarray) -> StandIn:
    """From rows (state, actuators, wind over ground) [n, 6 + A + 2] and the simulator's f there
    [n, 3]; damped where a step leads uphill (Levenberg 1944)."""
    known = np.isfinite(accelerations).all(1)
    rows, f = rows[known], accelerations[known]
    size = np.sqrt((f**2).mean(0)) + 1e-9
    sigma, P = MISFIT * size, len(start.values)

    def cost(c: np.ndarray, g: np.ndarray) -> float:
        found = (((f - g) / sigma) ** 2).sum() + (((c - start.values) / start.spread) ** 2).sum()
        return float(found) if np.isfinite(found) else np.inf

    c = start.values.copy()
    g, by = _slopes(model, c, rows)
    here, damping = cost(c, g), 1e-3
    for _ in range(ROUNDS):
        J = (by / sigma[:, None]).reshape(-1, P) * start.spread
        q = J.T @ ((f - g) / sigma).ravel() - (c - start.values) / start.spread
        N = J.T @ J + np.eye(P)
        step = np.linalg.solve(N + damping * np.diag(np.diag(N)), q) * start.spread
        tried = np.clip(c + step, start.low, start.high)
        g_tried, by_tried = _slopes(model, tried, rows)
        there = cost(tried, g_tried)
        if there < here:
            c, g, by, here, damping = tried, g_tried, by_tried, there, 0.1 * damping
        else:
            damping *= 10.0
    return StandIn(c, np.sqrt(((f - g) ** 2).mean(0)) / size)


def _slopes(model: MMG, c: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """g [n, 3] and ∂g/∂c [n, 3, P]."""
    found = rollouts.row_slopes(model, c, rows)
    if found is not None:
        return found[0], found[3]
    h = 1e-6 * np.maximum(np.abs(c), 1e-2)  # where no kernel is made: by differences

    def at(values: np.ndarray) -> np.ndarray:
        return np.asarray(model.acceleration(values, rows[:, :6], rows[:, 6:-2], rows[:, -2:]))

    apart = [(at(c + e) - at(c - e)) / (2.0 * e.max()) for e in np.diag(h)]
    return at(c), np.stack(apart, -1)
