"""Ships in two or three numbers, whose rollouts have a closed form or exact data."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from shiplog.simulation import sensitivities
from shiplog.simulation.window_series import WindowSeries


@jax.tree_util.register_static
@dataclass(frozen=True)
class Boat:
    """u̇ = -drag u + thrust n; sway and yaw rate fade by themselves, and nothing hears `silent`."""

    names = ("drag", "thrust", "silent")
    substeps = 1

    def acceleration(self, theta, state, actuator, true_wind):
        drag, thrust = theta[0], theta[1]
        u, v, r = state[..., 1], state[..., 3], state[..., 5]
        return jnp.stack((-drag * u + thrust * actuator[..., 0], -0.1 * v, -0.1 * r), -1)


@jax.tree_util.register_static
@dataclass(frozen=True)
class Growing:
    """u̇ = growth u²: a little too much of it and the rollout leaves every number behind."""

    names = ("growth",)
    substeps = 1

    def acceleration(self, theta, state, actuator, true_wind):
        u = state[..., 1]
        return jnp.stack((theta[0] * u * u, -state[..., 3], -state[..., 5]), -1)


COUNT, SIZE = 8, 40
TRUE, START = np.array([0.05, 0.02, 0.3]), np.array([0.2, 0.05, 0.7])
WIDE = np.full(3, 10.0)  # a ridge that hardly holds


def driven(actuators: int, seed: int = 0, count: int = COUNT) -> WindowSeries:
    """Windows of 40 s with commands that change and a start in motion; nothing measured yet."""
    rng = np.random.default_rng(seed)
    state = np.zeros((count, SIZE, 6))
    state[:, 0, [1, 3, 5]] = rng.normal(size=(count, 3)) * (0.3, 0.1, 0.01)
    command = np.repeat(rng.normal(size=(count, SIZE // 8, actuators)), 8, axis=1) + 0.5
    calm = np.zeros((count, SIZE, 2))
    return WindowSeries(state, command, calm, np.ones((count, SIZE - 1)), np.ones(count))


def measured(model, theta, data: WindowSeries) -> WindowSeries:
    return data._replace(measured=sensitivities.rollout(model, np.array(theta), data))
