"""Rollouts: the simulation sees measured actuators and apparent wind at every step, and the
measured ship state at the first step only. What it gets wrong afterwards, `evaluate` scores."""

from __future__ import annotations

from typing import Protocol

import torch
from torch import Tensor

from shiplog.models.base import Dynamics
from shiplog.voyages.windows import Windows


@torch.no_grad()
def rollout(
    dynamics: Dynamics, start: Tensor, actuator: Tensor, wind: Tensor, dt: Tensor
) -> Tensor:
    """Integrate ẋ = f(x, u, ω) with the explicit Euler method, Eq. 9.

    start     [N, 6]       first state of each window, order channels.STATE
    actuator  [N, I, A]    held over each step, in the profile's order [rad or rev/s]
    wind      [N, I, 0|2]  apparent wind [m/s, rad]
    dt        [N, I - 1]   step lengths [s]
    returns   [N, I, 6]    simulated states; row 0 is `start`

    Heading is not wrapped: a turning ship keeps counting. Wrap when comparing or plotting.
    """
    states = [start]
    for i in range(dt.shape[1]):
        rate = dynamics(states[-1], actuator[:, i], wind[:, i])
        states.append(states[-1] + dt[:, i, None] * rate)
    return torch.stack(states, dim=1)


class Simulates(Protocol):
    """A model that knows how to roll itself out: compiled physics, in `sensitivity`."""

    def simulate(self, windows: Windows) -> Tensor: ...


def simulate(dynamics: Dynamics | Simulates, windows: Windows) -> Tensor:
    """Roll out every window from its first measured state: [N, I, 6]."""
    own = getattr(dynamics, "simulate", None)
    if own is not None:
        return own(windows)
    assert callable(dynamics)
    return rollout(dynamics, windows.state[:, 0], windows.actuator, windows.wind, windows.dt)
