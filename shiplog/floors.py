"""Two honest floors: what anyone gets without a network. A model that loses to one is not worth it."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from shiplog.channels import VELOCITY_IN_STATE
from shiplog.models.base import kinematics
from shiplog.models.feedforward import exogenous
from shiplog.windows import Windows


def hold(state: Tensor, actuator: Tensor, wind: Tensor) -> Tensor:
    """The ship keeps its velocities: ν̇ = 0."""
    return kinematics(state, torch.zeros_like(state[..., :3]))


@dataclass(frozen=True)
class LeastSquares:
    """ν̇ as a full quadratic polynomial of (ν, u, ω), fitted to differentiated velocities.

    Quadratic least squares on accelerations is the regression every towing tank starts from
    (Abkowitz, 1980, with terms of second order). Inputs are standardised, the wind as components;
    a rollout that leaves the range it was fitted on is held at the edge of it, since a parabola
    knows nothing there.
    """

    mean: Tensor  # [inputs]
    std: Tensor
    low: Tensor  # [3] range of ν, a tenth wider than seen
    high: Tensor
    coefficients: Tensor  # [terms, 3]

    def __call__(self, state: Tensor, actuator: Tensor, wind: Tensor) -> Tensor:
        velocity = state[..., list(VELOCITY_IN_STATE)].clamp(self.low, self.high)
        inputs = torch.cat((velocity, exogenous(actuator, wind, "components")), -1)
        return kinematics(state, _terms((inputs - self.mean) / self.std) @ self.coefficients)


def least_squares(training: Windows, ridge: float = 1e-6) -> LeastSquares:
    """Fit on training windows: central differences of ν, a ridge against collinear terms."""
    driven = exogenous(training.actuator, training.wind, "components")
    inputs = torch.cat((training.velocity, driven), -1)[:, 1:-1].flatten(0, 1)
    span = (training.dt[:, 1:] + training.dt[:, :-1])[..., None]
    rate = ((training.velocity[:, 2:] - training.velocity[:, :-2]) / span).flatten(0, 1)
    mean, std = inputs.mean(0), inputs.std(0).clamp(min=1e-9)
    std = torch.where(std <= 1e-9, torch.ones_like(std), std)
    terms = _terms((inputs - mean) / std)
    normal = terms.T @ terms + ridge * len(terms) * torch.eye(terms.shape[1], dtype=terms.dtype)
    coefficients = torch.linalg.solve(normal, terms.T @ rate)
    velocity = training.velocity.flatten(0, 1)
    low, high = velocity.amin(0), velocity.amax(0)
    margin = 0.1 * (high - low)
    return LeastSquares(mean, std, low - margin, high + margin, coefficients)


def _terms(z: Tensor) -> Tensor:
    """1, z_i and z_i z_j (i ≤ j) of [..., n]."""
    rows, columns = torch.triu_indices(z.shape[-1], z.shape[-1])
    return torch.cat((torch.ones_like(z[..., :1]), z, z[..., rows] * z[..., columns]), -1)
