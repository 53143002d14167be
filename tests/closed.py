"""A ship whose path is known in closed form, and what bent instruments would show of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.recording import Record

SECONDS, STEP = 120.0, 0.1
TRUE_WIND = (-2.0, 1.1)  # m/s, where it comes from: north, east


def path(t: np.ndarray) -> np.ndarray:
    """States [n, 6] at times [n]: position and heading as sums of sines, velocities their
    derivatives."""
    x = 20.0 * np.sin(0.03 * t) + 2.0 * np.sin(0.11 * t)
    y = 15.0 * np.cos(0.025 * t) - 1.5 * np.sin(0.09 * t)
    north = 0.6 * np.cos(0.03 * t) + 0.22 * np.cos(0.11 * t)
    east = -0.375 * np.sin(0.025 * t) - 0.135 * np.cos(0.09 * t)
    heading = 0.4 + 1.2 * np.sin(0.05 * t) + 0.02 * t
    rate = 0.06 * np.cos(0.05 * t) + 0.02
    c, s = np.cos(heading), np.sin(heading)
    return np.stack((x, c * north + s * east, y, c * east - s * north, heading, rate), -1)


def apparent(state: np.ndarray) -> np.ndarray:
    """The wind it feels [n, 2], ahead and to starboard."""
    c, s = np.cos(state[:, 4]), np.sin(state[:, 4])
    north, east = TRUE_WIND
    return np.stack((c * north + s * east + state[:, 1], c * east - s * north + state[:, 3]), -1)


def controls(t: np.ndarray, count: int) -> np.ndarray:
    """[n, count] smooth orders, each of its own period."""
    return 0.3 * np.sin(t[:, None] * (0.21 + 0.04 * np.arange(count)))


def record(
    profile: Profile,
    *,
    heading: float = 0.0,
    by_compass: bool = False,
    bias: float = 0.0,
    scale: float = 1.0,
    moved: tuple[float, float] = (0.0, 0.0),
    late: Mapping[str, float] | None = None,
    wind_angle: float = 0.0,
    wind_scale: float = 1.0,
) -> Record:
    """What ingest makes of the path, measured by instruments that are wrong.

    heading, bias   what the compass and the gyro show too much [rad, rad/s]; scale: times
    by_compass      whether a body velocity is one over ground that the compass has turned
    moved           the antenna, from where the profile has it [m]; with it the velocity's sensor,
                    where the profile has both in one place
    late            channel → s that its clock is behind
    """
    t = STEP * np.arange(round(SECONDS / STEP) + 1)
    behind = {"position": 0.0, "velocity": 0.0, "yaw_rate": 0.0, "wind": 0.0} | dict(late or {})
    sensors = profile.sensors
    compass = path(t)[:, 4] + heading
    gyro = path(t - behind["yaw_rate"])[:, 5] * scale + bias
    # the antenna, in the instant that its message speaks of
    p = path(t - behind["position"])
    c, s = np.cos(p[:, 4]), np.sin(p[:, 4])
    a, b = np.add(sensors.position.lever_arm_m, moved)
    antenna = np.stack((p[:, 0] + a * c - b * s, p[:, 2] + a * s + b * c), -1)
    # its velocity, of a point that the turning ship swings round
    v = path(t - behind["velocity"])
    arm = sensors.velocity.lever_arm_m
    a, b = np.add(arm, moved) if arm == sensors.position.lever_arm_m else arm
    body = np.stack((v[:, 1] - v[:, 5] * b, v[:, 3] + v[:, 5] * a), -1)
    if by_compass or sensors.kind("velocity") != "body":
        # over ground, turned with what the compass shows
        turned = v[:, 4] - compass
        c, s = np.cos(turned), np.sin(turned)
        body = np.stack((c * body[:, 0] - s * body[:, 1], s * body[:, 0] + c * body[:, 1]), -1)

    # ingest: arms as the profile has them, angles and rates as they are displayed
    c, s = np.cos(compass), np.sin(compass)
    a, b = sensors.position.lever_arm_m
    x0, y0 = antenna[:, 0] - a * c + b * s, antenna[:, 1] - a * s - b * c
    a, b = sensors.velocity.lever_arm_m
    surge, sway = body[:, 0] + gyro * b, body[:, 1] - gyro * a

    felt = apparent(path(t - behind["wind"]))
    speed = np.hypot(*felt.T) * wind_scale
    angle = np.arctan2(felt[:, 1], felt[:, 0]) + wind_angle
    count = len(t)
    return Record(
        profile=profile, names=("one",), voyage=np.zeros(count, dtype=int), time=t,
        share=(np.arange(count) + 0.5) / count, starts=np.arange(count) == 0,
        measured=np.ones(count, dtype=bool),
        state=np.stack((x0, surge, y0, sway, compass, gyro), -1),
        actuator=controls(t, len(profile.actuators)),
        wind=np.stack((speed * np.cos(angle), speed * np.sin(angle)), -1),
    )  # fmt: skip
