"""Two baselines that any model should beat: no model at all, and quadratic least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.models.base import kinematics
from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.voyages.windows.windows import Windows


def hold(state: np.ndarray, actuator: np.ndarray, wind: np.ndarray) -> np.ndarray:
    """The ship keeps its velocities: ν̇ = 0."""
    return kinematics(state, np.zeros_like(state[..., :3]))


@dataclass(frozen=True)
class LeastSquares:
    """ν̇ as a quadratic polynomial of (ν, u) with moduli, and the wind's dynamic pressure.

    The regression every towing tank starts from (Abkowitz, 1980; moduli after Fedyaevsky and
    Sobolev, 1964), fitted to differentiated velocities. A rollout that leaves the range of
    what it was fitted on goes no further, since a parabola knows nothing there.
    """

    scale: np.ndarray  # [terms] spread of each term over the training data
    low: np.ndarray  # [3] range of ν, a tenth wider than in the training data
    high: np.ndarray
    coefficients: np.ndarray  # [terms, 3]

    def __call__(self, state: np.ndarray, actuator: np.ndarray, wind: np.ndarray) -> np.ndarray:
        velocity = state[..., list(VELOCITY_IN_STATE)]
        inside = np.clip(velocity, self.low, self.high)
        rate = terms(inside, actuator, wind) / self.scale @ self.coefficients
        outward = ((velocity > self.high) & (rate > 0)) | ((velocity < self.low) & (rate < 0))
        return kinematics(state, np.where(outward, 0.0, rate))


def least_squares(training: Windows, ridge: float = 1e-6) -> LeastSquares:
    """Fit on training windows: differences of ν over two steps, a ridge against collinear terms."""
    every = terms(training.velocity, training.actuator, training.wind)
    step = training.dt[..., None]
    before, after = every[:, :-2] * step[:, :-1], every[:, 1:-1] * step[:, 1:]
    span = step[:, :-1] + step[:, 1:]
    mean = _rows((before + after) / span)  # Euler's two steps, as a rollout takes them
    rate = _rows((training.velocity[:, 2:] - training.velocity[:, :-2]) / span)
    scale = mean.std(0, ddof=1)
    scale = np.where(scale > 1e-9, scale, 1.0)
    design = mean / scale
    normal = design.T @ design
    normal += ridge * len(design) * np.eye(len(normal))
    coefficients = np.linalg.solve(normal, design.T @ rate)
    velocity = _rows(training.velocity)
    low, high = velocity.min(0), velocity.max(0)
    margin = 0.1 * (high - low)
    return LeastSquares(scale, low - margin, high + margin, coefficients)


def _rows(values: np.ndarray) -> np.ndarray:
    """[N · I, C] from [N, I, C]."""
    return values.reshape(-1, values.shape[-1])


def terms(velocity: np.ndarray, actuator: np.ndarray, wind: np.ndarray) -> np.ndarray:
    """1, z_i, z_i z_j, z_i |z_j| (i ≤ j) of z = (ν, u), and U_A² (1, cos γ, sin γ, sin 2γ)."""
    z = np.concatenate((velocity, actuator), -1)
    i, j = np.triu_indices(z.shape[-1])
    parts = [np.ones_like(z[..., :1]), z, z[..., i] * z[..., j], z[..., i] * np.abs(z[..., j])]
    if wind.shape[-1]:
        pressure, angle = wind[..., :1] ** 2, wind[..., 1:]
        parts += [
            pressure,
            pressure * np.cos(angle),
            pressure * np.sin(angle),
            pressure * np.sin(2.0 * angle),
        ]
    return np.concatenate(parts, -1)
