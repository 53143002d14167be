"""How sure a run's coefficients will be after a manoeuvre that nobody has sailed yet.

The estimate to come is `train`'s: the rollout error of windows, with the run's own coefficients and
covariance C₀ as what is known before. Of the sensitivities J_t = ∂ν_t/∂θ of the windows (exact,
`simulation.sensitivities`), the weights W of the error and its variance σ²:

    H = Σ_w Σ_t J_tᵀ W² J_t Δt/σ²,   Λ = C₀⁻¹
    C = (H + Λ)⁻¹ (κ M + Λ) (H + Λ)⁻¹

M is the covariance of the gradient that process noise and sensors will make. With the state's own
Jacobians A_t of one row and the adjoint of each window,

    λ_t = A_tᵀ λ_{t+1} + Cᵀ W² J_t Δt/σ²
    M = Σ_w (λ_0ᵀ R λ_0 + Σ_t λ_{t+1}ᵀ Q Δt λ_{t+1} + Σ_t (W² J_t Δt/σ²)ᵀ R_ν (W² J_t Δt/σ²))

κ is such that the same of the run's own training windows is as sure as the run states
(White 1980; Ljung 1999, sec. 9.4). The search for a manoeuvre takes M = H: two thirds of the time
is saved, and the order of manoeuvres is the same to a few per cent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from shiplog.nomenclature.channels import VELOCITY_IN_STATE, VELOCITY_WEIGHTS
from shiplog.planning.noise import Noise
from shiplog.simulation.members import Rates, of_physics
from shiplog.simulation.scoring import trapezoid
from shiplog.simulation.sensitivities import linearised, normal
from shiplog.simulation.window_series import WindowSeries

LEAST_SCATTER, MOST_SCATTER = 0.05, 20.0  # κ: beyond, noise and model have nothing in common
NUDGE = np.array([0.0, 1e-4, 0.0, 1e-4, 1e-4, 1e-4])  # of speed, 1 rad and U/L, for A_t
VELOCITY = list(VELOCITY_IN_STATE)


@dataclass(frozen=True)
class Instrument:
    """What turns a simulated manoeuvre into information: equations, numbers, noise.

    model, theta  of the run; `free` [F] indices of the coefficients that are asked
    spread        [F] their plausible spreads: all matrices are in units of these
    known         Λ [F, F]
    variance      σ² of the rollout error, as a training of such windows leaves it
    window        rows of a window; `step` s between rows
    noise         process and sensors
    scale         speed [m/s] and length [m] of the ship, for small steps
    scatter       κ, by which the gradients of the training windows vary more than M says
    """

    model: Any
    theta: np.ndarray
    free: np.ndarray
    spread: np.ndarray
    known: np.ndarray
    variance: float
    window: int
    step: float
    noise: Noise
    scale: tuple[float, float]
    scatter: float = 1.0

    def calibrated(self, data: WindowSeries, stated: np.ndarray) -> Instrument:
        """κ with which the errors that this expects of the training windows, from the plausible
        spreads on, are in the geometric mean those that the run states [F]."""
        H, M = self.products(data)
        inverse = np.linalg.inv(H + np.eye(len(H)))

        def off(log_scatter: float) -> float:
            C = inverse @ (math.exp(log_scatter) * M + np.eye(len(H))) @ inverse
            return float(np.log(np.sqrt(np.diag(C)) / stated).mean())

        low, high = math.log(LEAST_SCATTER), math.log(MOST_SCATTER)
        if off(low) >= 0.0 or off(high) <= 0.0:
            return replace(self, scatter=LEAST_SCATTER if off(low) >= 0.0 else MOST_SCATTER)
        root: Any = brentq(off, low, high, xtol=1e-3)
        return replace(self, scatter=math.exp(root))

    def series(self, state: np.ndarray, actuator: np.ndarray, wind: np.ndarray) -> WindowSeries:
        """Windows end to end of one manoeuvre: state [K, 6], actuator [K, A], true wind [2]."""
        size = min(self.window, len(state))
        count = max(len(state) // size, 1)
        rows = np.arange(count)[:, None] * size + np.arange(size)
        return WindowSeries(
            state[rows], actuator[rows], np.broadcast_to(wind, (count, size, 2)).copy(),
            np.full((count, size - 1), self.step), np.ones(count),
        )  # fmt: skip

    def gram(self, data: WindowSeries) -> np.ndarray:
        """H [F, F]."""
        found = normal(self.model, self.theta, data, tuple(self.free.tolist())).gram
        return found * np.outer(self.spread, self.spread) / self.variance

    def errors(self, gram: np.ndarray) -> np.ndarray:
        """((H + Λ)⁻¹)_ii^½ [..., F] of H [..., F, F], in plausible spreads."""
        inverse = np.linalg.inv(gram + self.known)
        return np.sqrt(np.diagonal(inverse, axis1=-2, axis2=-1))

    def covariance(self, data: WindowSeries) -> np.ndarray:
        """C [F, F] after a manoeuvre, in plausible spreads."""
        H, M = self.products(data)
        inverse = np.linalg.inv(H + self.known)
        return inverse @ (self.scatter * M + self.known) @ inverse

    def products(self, data: WindowSeries) -> tuple[np.ndarray, np.ndarray]:
        """H and M [F, F]."""
        slopes = linearised(self.model, self.theta, data)[1][..., self.free] * self.spread
        J = slopes[:, :, VELOCITY]  # [W, I, 3, F]
        weight = np.array(VELOCITY_WEIGHTS) ** 2 / self.variance
        pulled = J * weight[:, None] * trapezoid(data.dt)[..., None, None]
        H = np.einsum("wtcf,wtcg->fg", J, pulled)
        A = self._jacobians(data)
        R, Q = self.noise.sensors, self.noise.process * self.step
        M = np.einsum("wtcf,c,wtcg->fg", pulled, R[VELOCITY], pulled)
        adjoint = np.zeros((len(J), 6, J.shape[-1]))
        for t in range(J.shape[1] - 1, 0, -1):
            adjoint[:, VELOCITY] += pulled[:, t]
            inside = adjoint[:, VELOCITY]
            M += np.einsum("wcf,c,wcg->fg", inside, Q, inside)
            adjoint = np.einsum("wij,wif->wjf", A[:, t - 1], adjoint)
        M += np.einsum("wcf,c,wcg->fg", adjoint, R, adjoint)
        return H, M

    def _jacobians(self, data: WindowSeries) -> np.ndarray:
        """A_t = ∂x_{t+1}/∂x_t [W, I - 1, 6, 6], by central differences of the rates."""
        rates = of_physics(self.model, self.theta)
        state = data.measured[:, :-1].reshape(-1, 6)
        actuator = data.actuator[:, :-1].reshape(len(state), -1)
        wind = data.wind[:, :-1].reshape(-1, 2)
        speed, length = self.scale
        size = NUDGE * np.array([1.0, speed, 1.0, speed, 1.0, speed / length])
        F = np.zeros((len(state), 6, 6))
        for j in (1, 3, 4, 5):
            more, less = (_rate(rates, _moved(state, j, s * size[j]), actuator, wind)
                          for s in (1.0, -1.0))  # fmt: skip
            F[:, :, j] = (more - less) / (2.0 * size[j])
        small = np.eye(6) + self.step / self.model.substeps * F
        A = np.linalg.matrix_power(small, self.model.substeps)
        return A.reshape(*data.measured[:, :-1].shape[:2], 6, 6)


def _moved(state: np.ndarray, column: int, by: float) -> np.ndarray:
    found = state.copy()
    found[:, column] += by
    return found


def _rate(rates: Rates, state: np.ndarray, actuator: np.ndarray, wind: np.ndarray) -> np.ndarray:
    """ẋ [n, 6]."""
    c, s = np.cos(state[:, 4]), np.sin(state[:, 4])
    found = np.empty_like(state)
    found[:, 0] = c * state[:, 1] - s * state[:, 3]
    found[:, 2] = s * state[:, 1] + c * state[:, 3]
    found[:, 4] = state[:, 5]
    found[:, VELOCITY] = rates(state, actuator, wind)
    return found


def worth(errors: Sequence[np.ndarray] | np.ndarray, before: np.ndarray) -> np.ndarray:
    """mean_i ln(own_i before/own_i after) [...]: the logarithm of the geometric mean by which the
    intervals of the coefficients become narrower."""
    return np.log(before / np.asarray(errors)).mean(-1)
