"""Windows of a coupled ship, made once for a file."""

from dataclasses import dataclass
from typing import ClassVar

import jax
import jax.numpy as jnp
import pytest
from coupled_ships import COUPLED, sailed


@jax.tree_util.register_static
@dataclass(frozen=True)
class Coupled:
    """A ship in four numbers, everything acting on everything: drag, turn, thrust and wind."""

    substeps: int = 1
    names: ClassVar = ("drag", "turn", "thrust", "wind")

    def acceleration(self, theta, state, actuator, true_wind):
        drag, turn, thrust, wind = theta
        u, v, heading, r = state[..., 1], state[..., 3], state[..., 4], state[..., 5]
        c, s = jnp.cos(heading), jnp.sin(heading)
        north, east = true_wind[..., 0], true_wind[..., 1]
        return jnp.stack(
            (
                v * r - drag * u * jnp.abs(u) + thrust * actuator[..., 0] ** 2,
                -drag * v - turn * u * r - wind * (c * east - s * north),
                turn * (actuator[..., 1] * u - r) + 0.1 * v,
            ),
            axis=-1,
        )


@pytest.fixture(scope="module")
def coupled():
    return Coupled(), COUPLED, sailed(5, 30, 0, (1.0, 0.2))
