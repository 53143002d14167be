"""A ship with one azimuth, and windows under way on which a hybrid is worked out."""

import numpy as np

from shiplog.models.mmg import MMG, estimated, geometry_of
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile
from shiplog.simulation import sensitivities
from shiplog.simulation.window_series import WindowSeries

SHIP = """
[ship]
name = "made up"
length_m = 4.0
breadth_m = 1.0
draught_m = 0.3
mass_kg = 700.0
x_g_m = 0.1
[sensors.position]
kind = "local"
topic = "/p"
fields = ["x", "y"]
[sensors.velocity]
kind = "body"
topic = "/p"
fields = ["u", "v"]
[sensors.heading]
topic = "/p"
field = "heading"
[sensors.wind]
topic = "/w"
fields = ["speed", "angle"]
[[actuators]]
name = "azimuth"
kind = "azimuth"
topic = "/a"
field = "azimuth"
unit = "deg"
position_m = [-1.5, 0.0]
[[actuators]]
name = "thruster"
kind = "thruster"
topic = "/a"
field = "thruster"
position_m = [-1.5, 0.0]
"""
COUNT, SIZE, WIDTH = 8, 30, 3


def driven(seed: int) -> WindowSeries:
    """Windows under way, thrust and azimuth changing every five seconds, in a steady wind."""
    rng = np.random.default_rng(seed)
    state = np.zeros((COUNT, SIZE, 6))
    first = (5.0, 0.1, 5.0, 0.05, 3.0, 0.01)
    state[:, 0] = rng.normal(size=(COUNT, 6)) * first + (0.0, 0.5, 0.0, 0.0, 0.0, 0.0)
    command = np.repeat(rng.uniform((-0.5, 0.3), (0.5, 0.9), (COUNT, SIZE // 5, 2)), 5, axis=1)
    wind = np.broadcast_to(rng.normal(size=(COUNT, 1, 2)) * 2.0, (COUNT, SIZE, 2)).copy()
    return WindowSeries(state, command, wind, np.ones((COUNT, SIZE - 1)), np.ones(COUNT))


def estimated_coefficients(ship: Profile) -> np.ndarray:
    """Estimated; but 10 N of thrust, which 700 kg follow slowly."""
    g, main, _ = geometry_of(ship)
    start = estimated(g, main)
    thrusts = [n.endswith(("ahead", "astern")) for n in start.names]
    return np.where(thrusts, 10.0, start.values)


PROFILE = profiles.parse(SHIP, "ship.toml")
PHYSICS = MMG(geometry_of(PROFILE)[0])
THETA = estimated_coefficients(PROFILE)


def sailed() -> WindowSeries:
    """What the physics do under these commands."""
    plain = driven(0)
    return plain._replace(measured=sensitivities.rollout(PHYSICS, THETA, plain))


def flat(data: WindowSeries) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return tuple(a.reshape(-1, a.shape[-1]) for a in (data.measured, data.actuator, data.wind))
