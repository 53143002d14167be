"""Rollouts: the simulation sees measured actuators and apparent wind at every step, and the
measured ship state at the first step only. What it gets wrong afterwards, `evaluate` scores."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from shiplog.models.base import Dynamics
from shiplog.voyages.windows.windows import Windows


def rollout(
    dynamics: Dynamics,
    start: np.ndarray,
    actuator: np.ndarray,
    wind: np.ndarray,
    dt: np.ndarray,
) -> np.ndarray:
    """Integrate ẋ = f(x, u, ω) with the explicit Euler method, Eq. 9.

    start     [N, 6]       first state of each window, order channels.STATE
    actuator  [N, I, A]    held over each step, in the profile's order [rad or rev/s]
    wind      [N, I, 0|2]  apparent wind [m/s, rad]
    dt        [N, I - 1]   step lengths [s]
    returns   [N, I, 6]    simulated states; row 0 is `start`

    Heading is not wrapped: a turning ship keeps counting. Wrap when comparing or plotting.
    """
    states = [start]
    with np.errstate(over="ignore", invalid="ignore"):  # a rollout may diverge
        for i in range(dt.shape[1]):
            rate = dynamics(states[-1], actuator[:, i], wind[:, i])
            states.append(states[-1] + dt[:, i, None] * rate)
    return np.stack(states, axis=1)


class Simulates(Protocol):
    """A model that rolls itself out: compiled physics, in `sensitivities`, or a network."""

    def simulate(self, windows: Windows) -> np.ndarray: ...


def simulate(dynamics: Dynamics | Simulates, windows: Windows) -> np.ndarray:
    """Roll out every window from its first measured state: [N, I, 6]."""
    own = getattr(dynamics, "simulate", None)
    if own is not None:
        return own(windows)
    assert callable(dynamics)
    return rollout(dynamics, windows.state[:, 0], windows.actuator, windows.wind, windows.dt)
