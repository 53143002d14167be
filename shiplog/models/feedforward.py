"""The paper's network: ν̇ = σ_acc · f_NN(s) + μ_acc, Eqs. 20-22 and Table 4."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn

from shiplog.models.base import kinematics
from shiplog.models.network_shape import Shape
from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.voyages.windows.windows import Windows


@dataclass(frozen=True, slots=True)
class Scaling:
    """Mean and standard deviation of (ν, u, ω) [inputs] and of ν̇ [3] over the reference set."""

    input_mean: Tensor
    input_std: Tensor
    output_mean: Tensor
    output_std: Tensor

    def to(self, dtype: torch.dtype) -> Scaling:
        return Scaling(*(getattr(self, name).to(dtype) for name in self.__slots__))


def exogenous(actuator: Tensor, wind: Tensor, wind_input: str) -> Tensor:
    """The network's inputs in addition to ν: [..., A + 0|2] from [..., A] and [..., 0|2]."""
    if wind.shape[-1] == 0:
        return actuator
    speed, angle = wind[..., :1], wind[..., 1:]
    if wind_input == "components":
        return torch.cat((actuator, speed * torch.cos(angle), speed * torch.sin(angle)), -1)
    return torch.cat((actuator, speed, torch.remainder(angle, 2.0 * math.pi)), -1)


def driven_by(windows: Windows, wind_input: str) -> Tensor:
    """The exogenous inputs of windows [N, I, A + 0|2]."""
    actuator, wind = torch.from_numpy(windows.actuator), torch.from_numpy(windows.wind)
    return exogenous(actuator, wind, wind_input)


def scaling(reference: Windows, wind_input: str) -> Scaling:
    """Of the reference dataset, whatever the augmentation (Sec. 4.2).

    ν̇ is differentiated from ν, since it is not measured: forward, as Euler integrates. A channel
    that never changes gets a standard deviation of 1, so that it is passed on as zero.
    """
    velocity, dt = torch.from_numpy(reference.velocity), torch.from_numpy(reference.dt)
    driven = driven_by(reference, wind_input)
    inputs = torch.cat((velocity, driven), -1).flatten(0, 1)
    rate = (velocity.diff(dim=1) / dt[..., None]).flatten(0, 1)
    return Scaling(inputs.mean(0), _spread(inputs), rate.mean(0), _spread(rate))


def _spread(values: Tensor) -> Tensor:
    std = values.std(0, unbiased=False)
    constant = std <= 1e-9 * values.abs().amax(0).clamp(min=1.0)
    return torch.where(constant, torch.ones_like(std), std)


class FeedForward(nn.Module):
    """A fully connected tanh network on standardised (ν, u, ω), giving standardised ν̇."""

    def __init__(self, shape: Shape, scaling: Scaling) -> None:
        super().__init__()
        self.shape, self.scaling = shape, scaling
        widths = [shape.inputs, *[shape.width] * shape.depth, 3]
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))

    @property
    def weights(self) -> list[Tensor]:
        """W₁, b₁, W₂, b₂, ...: each W is [out, in]."""
        return [p for layer in self.layers for p in (layer.weight, layer.bias)]  # type: ignore[attr-defined]

    def initialise(self, generator: torch.Generator) -> FeedForward:
        """PyTorch's default, U(-1/√fan_in, 1/√fan_in), from a stream of its own."""
        with torch.no_grad():
            for layer in self.layers:
                bound = 1.0 / math.sqrt(layer.in_features)  # type: ignore[arg-type]
                for parameter in (layer.weight, layer.bias):
                    parameter.uniform_(-bound, bound, generator=generator)  # type: ignore[operator]
        return self

    def acceleration(self, velocity: Tensor, driven: Tensor) -> Tensor:
        """ν̇ [..., 3] of ν [..., 3] and the exogenous inputs [..., A + 0|2]."""
        scale = self.scaling
        hidden = (torch.cat((velocity, driven), -1) - scale.input_mean) / scale.input_std
        if self.shape.input_tanh:
            hidden = torch.tanh(hidden)
        for layer in self.layers[:-1]:
            hidden = torch.tanh(layer(hidden))
        return self.layers[-1](hidden) * scale.output_std + scale.output_mean

    @torch.no_grad()
    def accelerations(
        self, velocity: np.ndarray, actuator: np.ndarray, wind: np.ndarray
    ) -> np.ndarray:
        """ν̇ [N, 3] of velocities [N, 3], actuators [N, A] and apparent wind [N, 0|2], float64."""
        driven = exogenous(
            torch.from_numpy(actuator), torch.from_numpy(wind), self.shape.wind_input
        )
        return self.acceleration(torch.from_numpy(velocity), driven).numpy()

    @torch.no_grad()
    def simulate(self, windows: Windows) -> np.ndarray:
        """States [N, I, 6] from the first measured ones, by explicit Euler (Eq. 9), in float64."""
        driven = driven_by(windows, self.shape.wind_input)
        states = [windows.state[:, 0]]
        with np.errstate(over="ignore", invalid="ignore"):  # a rollout may diverge
            for i in range(windows.dt.shape[1]):
                velocity = torch.from_numpy(states[-1][:, list(VELOCITY_IN_STATE)])
                acceleration = self.acceleration(velocity, driven[:, i]).numpy()
                rate = kinematics(states[-1], acceleration)
                states.append(states[-1] + windows.dt[:, i, None] * rate)
        return np.stack(states, axis=1)
