"""Ships in one or a few numbers, and windows under way."""

from dataclasses import dataclass
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from shiplog.simulation.window_series import WindowSeries


@jax.tree_util.register_static
@dataclass(frozen=True)
class Damped:
    """ν̇ = -θ ν + input, each velocity by itself."""

    substeps: int = 1
    names: ClassVar = ("surge", "sway", "yaw")

    def acceleration(self, theta, state, actuator, true_wind):
        return -theta * state[..., jnp.array([1, 3, 5])] + actuator


COUPLED = np.array([0.05, 0.3, 0.02, 0.01])


def sailed(count: int, size: int, seed: int, actuators: tuple[float, ...]) -> WindowSeries:
    """Smooth motion that no model made, with steps between 0.5 and 1.5 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(size) / size
    wave = np.sin(2.0 * (t + rng.random((count, 1, 6))[..., None, 0]))
    level = rng.normal(size=(count, 1, 6)) * (5.0, 0.06, 5.0, 0.03, 2.0, 0.02)
    state = level + (0.0, 0.25, 0.0, 0.0, 0.0, 0.0) + wave.transpose(0, 2, 1) * 0.01
    thrust = rng.normal(size=(count, 1, len(actuators))) * 0.2 + 1.0
    driven = (thrust + 0.2 * np.sin(6.0 * t)[None, :, None]) * actuators
    wind = rng.normal(size=(count, 1, 2)) * 2.0 + np.zeros((1, size, 1))
    dt = rng.uniform(0.5, 1.5, size=(count, size - 1))
    return WindowSeries(state, driven, wind, dt, np.ones(count))
