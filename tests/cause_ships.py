"""Ships, settings and motions on which causes are tried."""

import jax.numpy as jnp
import numpy as np
import pytest

from shiplog.models import mmg
from shiplog.models.causes import CATALOGUE, Setting
from shiplog.models.compiled_network import Network
from shiplog.models.extended import Extended
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile

TWIN = profiles.load("esso-vectwin")  # velocity over ground, by an antenna 0.3 m ahead
SINGLE = profiles.load("esso-osaka")  # velocity in body axes, at midship; one rudder
LOG = TWIN.sensors.velocity.model_copy(update={"kind": "body", "lever_arm_m": (0.8, -0.2)})
APART = TWIN.model_copy(  # a speed log of its own: where the antenna stands is no matter to it
    update={"sensors": TWIN.sensors.model_copy(update={"velocity": LOG})}
)
FERRY = profiles.load("milliampere")  # neither rudder nor wind sensor nor gyro
PLACES = np.random.default_rng(3).uniform(-20.0, 20.0, (12, 2))
BY = {cause.label: cause for cause in CATALOGUE}
EVERY = pytest.mark.parametrize("cause", CATALOGUE, ids=list(BY))
SHIPS = pytest.mark.parametrize(
    "profile", (TWIN, SINGLE, APART), ids=("over ground", "body axes", "log apart")
)


def setting(profile: Profile = TWIN, places: np.ndarray = PLACES) -> Setting:
    scale = {"speed": 0.6, "length": 3.0, "mass": 244.6, "moment": 3.0 * 244.6}
    return Setting(profile, scale, places, 8.0)


def extended(causes, profile: Profile = TWIN, without=(), base=None) -> tuple[Extended, np.ndarray]:
    """Around an MMG with estimated coefficients, or around another base that it stands in for."""
    ship, main, _ = mmg.geometry_of(profile, without)
    model = mmg.MMG(ship)
    values = mmg.estimated(ship, main).values
    constants = {}
    for cause in causes:
        constants |= cause.constants(setting(profile))
    whole = Extended(base or model, tuple(causes), model, values, constants)
    return whole, values if base is None else np.zeros(len(base.names))


def network() -> Network:
    """A network of the paper's form with random weights; wind as components."""
    rng = np.random.default_rng(0)
    inputs, width, bends = 8, 5, 4
    return Network(
        weights=(
            rng.standard_normal((width, inputs)), rng.standard_normal(width),
            rng.standard_normal((3, width)), rng.standard_normal(3),
        ),
        mean=rng.standard_normal(inputs), std=np.full(inputs, 2.0),
        out_mean=np.zeros(3), out_std=np.full(3, 0.05),
        frequency=rng.standard_normal((inputs, bends)), phase=rng.uniform(0.0, 6.0, bends),
        wind=True, components=True, input_tanh=False,
    )  # fmt: skip


def under_way(count: int = 40, actuators: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random states, actuators with a share of the campaign, and winds."""
    rng = np.random.default_rng(1)
    state = rng.uniform((-20, -0.3, -20, -0.3, -3, -0.2), (20, 0.9, 20, 0.3, 3, 0.2), (count, 6))
    low, high = [-1.0] * (actuators - 1) + [0.0, 0.0], [1.0] * (actuators - 1) + [12.0, 1.0]
    actuator = rng.uniform(low, high, (count, actuators + 1))
    return state, actuator, rng.uniform(-3.0, 3.0, (count, 2))


def acceleration(model: Extended, values, numbers, state, actuator, wind) -> np.ndarray:
    theta = jnp.asarray(np.concatenate((values, numbers)))
    return np.asarray(model.acceleration(theta, state, actuator, wind))


def sized(cause) -> np.ndarray:
    """Numbers of half their realistic size, of alternating sign where that has a meaning."""
    low, _ = cause.bounds(setting())
    sign = np.where((low < 0.0) & (np.arange(cause.count) % 2 == 1), -1.0, 1.0)
    return 0.5 * sign * cause.sizes(setting())


NORTH, EAST = 0.11, -0.07


def drifting(heading, rate) -> np.ndarray:
    """At rest in the moving water, turning: body velocities over ground."""
    c, s = np.cos(heading), np.sin(heading)
    u, v = c * NORTH + s * EAST, c * EAST - s * NORTH
    zero = np.zeros_like(heading)
    return np.stack((zero, u, zero, v, heading, rate), -1)


def forces(label: str, numbers, state, actuator, wind, without=()) -> np.ndarray:
    """X, Y, N of a ship that does not turn, from its accelerations: mass times acceleration."""
    cause = BY[label].on(setting())
    model, values = extended([cause], without=without)
    found = acceleration(model, values, numbers, state, actuator, wind)
    g, of = model.base.geometry, dict(zip(model.base.names, values, strict=True))
    unit = 0.5 * g.density * g.length**2 * g.draught
    m, x = g.mass, g.x_g
    m_x, m_y = of["body.m_x"] * unit, of["body.m_y"] * unit
    c = of["body.i_j"] * unit * g.length**2 + m * x * x
    return found @ np.array([[m + m_x, 0, 0], [0, m + m_y, x * m], [0, x * m, c]])


REST = np.zeros((1, 6))
CALM = np.zeros((1, 2))
