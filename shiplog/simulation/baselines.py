"""Two baselines that any model should beat: no model at all, and quadratic least squares."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from shiplog.channels import VELOCITY_IN_STATE
from shiplog.models.base import kinematics
from shiplog.voyages.windows import Windows


def hold(state: Tensor, actuator: Tensor, wind: Tensor) -> Tensor:
    """The ship keeps its velocities: ν̇ = 0."""
    return kinematics(state, torch.zeros_like(state[..., :3]))


@dataclass(frozen=True)
class LeastSquares:
    """ν̇ as a quadratic polynomial of (ν, u) with moduli, and the wind's dynamic pressure.

    The regression every towing tank starts from (Abkowitz, 1980; moduli after Fedyaevsky and
    Sobolev, 1964), fitted to differentiated velocities. A rollout that leaves the range of
    what it was fitted on goes no further, since a parabola knows nothing there.
    """

    scale: Tensor  # [terms] spread of each term over the training data
    low: Tensor  # [3] range of ν, a tenth wider than in the training data
    high: Tensor
    coefficients: Tensor  # [terms, 3]

    def __call__(self, state: Tensor, actuator: Tensor, wind: Tensor) -> Tensor:
        velocity = state[..., list(VELOCITY_IN_STATE)]
        inside = velocity.clamp(self.low, self.high)
        rate = terms(inside, actuator, wind) / self.scale @ self.coefficients
        outward = ((velocity > self.high) & (rate > 0)) | ((velocity < self.low) & (rate < 0))
        return kinematics(state, torch.where(outward, 0.0, rate))


def least_squares(training: Windows, ridge: float = 1e-6) -> LeastSquares:
    """Fit on training windows: differences of ν over two steps, a ridge against collinear terms."""
    every = terms(training.velocity, training.actuator, training.wind)
    step = training.dt[..., None]
    before, after = every[:, :-2] * step[:, :-1], every[:, 1:-1] * step[:, 1:]
    span = step[:, :-1] + step[:, 1:]
    mean = ((before + after) / span).flatten(0, 1)  # Euler's two steps, as a rollout takes them
    rate = ((training.velocity[:, 2:] - training.velocity[:, :-2]) / span).flatten(0, 1)
    scale = mean.std(0)
    scale = torch.where(scale > 1e-9, scale, torch.ones_like(scale))
    design = mean / scale
    normal = design.T @ design
    normal += ridge * len(design) * torch.eye(len(normal), dtype=normal.dtype)
    coefficients = torch.linalg.solve(normal, design.T @ rate)
    velocity = training.velocity.flatten(0, 1)
    low, high = velocity.amin(0), velocity.amax(0)
    margin = 0.1 * (high - low)
    return LeastSquares(scale, low - margin, high + margin, coefficients)


def terms(velocity: Tensor, actuator: Tensor, wind: Tensor) -> Tensor:
    """1, z_i, z_i z_j, z_i |z_j| (i ≤ j) of z = (ν, u), and U_A² (1, cos γ, sin γ, sin 2γ)."""
    z = torch.cat((velocity, actuator), -1)
    i, j = torch.triu_indices(z.shape[-1], z.shape[-1])
    parts = [torch.ones_like(z[..., :1]), z, z[..., i] * z[..., j], z[..., i] * z[..., j].abs()]
    if wind.shape[-1]:
        pressure, angle = wind[..., :1] ** 2, wind[..., 1:]
        parts += [
            pressure,
            pressure * torch.cos(angle),
            pressure * torch.sin(angle),
            pressure * torch.sin(2.0 * angle),
        ]
    return torch.cat(parts, -1)
