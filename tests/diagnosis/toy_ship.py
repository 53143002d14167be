"""A ship in four numbers under way in closed form, cut into segments."""

from dataclasses import dataclass

import closed
import jax
import jax.numpy as jnp
import numpy as np

from shiplog.diagnosis.linear import segments
from shiplog.diagnosis.linear.linear_segments import Path, Wide
from shiplog.diagnosis.linear.measurement_correction import Moved
from shiplog.diagnosis.linear.segments import Cut
from shiplog.models.causes import Cause, Setting
from shiplog.ship_profile import file as profiles

PROFILE = profiles.load("esso-osaka")  # rudder and propeller
SETTING = Setting(PROFILE, {"speed": 0.6, "length": 3.0}, np.zeros((1, 2)), 1.0)
DRAG, TURN, DAMP = 0.05, 0.06, 0.4


@jax.tree_util.register_static
@dataclass(frozen=True)
class Toy:
    """u̇ = -a u |u| + w X_wind, v̇ = -a v - u r, ṙ = b δ - c r; numbers of causes come after."""

    causes: tuple[Cause, ...] = ()
    substeps: int = 1
    smooth: float = 0.0

    @property
    def names(self):
        return ("a", "b", "c", "w")

    def acceleration(self, theta, state, actuator, true_wind):
        u, v, heading, r = (state[..., i] for i in (1, 3, 4, 5))
        ahead = jnp.cos(heading) * true_wind[..., 0] + jnp.sin(heading) * true_wind[..., 1]
        du = -theta[0] * u * jnp.sqrt(u * u + 1e-6) + theta[3] * ahead
        dr = theta[1] * actuator[..., 0] - theta[2] * r
        return jnp.stack((du, -theta[0] * v - u * r, dr), -1)


@jax.tree_util.register_static
@dataclass(frozen=True)
class Coasting:
    """ν̇ = -k ν: straight ahead, u = e^(-kt) and x = (1 - e^(-kt))/k."""

    names: tuple[str, ...] = ("k",)
    substeps: int = 1
    smooth: float = 0.0

    def acceleration(self, theta, state, actuator, true_wind):
        return -theta[0] * state[..., jnp.array([1, 3, 5])]


THETA = np.array([DRAG, TURN, DAMP, 0.02])
RECORD = closed.record(PROFILE)
GRID = segments.grid(RECORD)
ROWS = segments.begins(RECORD)
WIDE = Wide(
    np.array([0.02, 0.01, 0.02, 0.01, 0.003, 0.002]), np.array([1.0, 0.6, 1.0, 0.6, 0.3, 0.2]),
    np.array([0.06, 0.06, 0.02]),
)  # fmt: skip


def path() -> Path:
    rng = np.random.default_rng(0)
    start = RECORD.state[ROWS]
    return Path(start, 0.01 * rng.standard_normal((len(ROWS), 3, GRID.nodes)))


def nothing(cut: Cut) -> tuple[Moved, np.ndarray]:
    return Moved.none(cut), np.zeros((*cut.y.shape, 0))
