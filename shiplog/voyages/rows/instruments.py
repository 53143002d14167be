"""What the instruments measured, from the state at midship and back: `ingest` undone and redone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shiplog.nomenclature import frames
from shiplog.nomenclature.frames import Axes
from shiplog.ship_profile.profile import Sensors


@dataclass(frozen=True)
class Sighted:
    """What the instruments measured: position of the antenna over ground, its velocity [n, 2] (in
    body axes or over ground, as the profile says), heading with its axes and yaw rate [n]."""

    position: np.ndarray
    velocity: np.ndarray
    heading: np.ndarray
    axes: Axes
    yaw_rate: np.ndarray

    def turned(self, angle: float) -> Sighted:
        """With a heading that is by so much greater [rad]."""
        return replace(self, heading=self.heading + angle, axes=self.axes.turned(angle))


def sighted(state: np.ndarray, axes: Axes, sensors: Sensors) -> Sighted:
    """Of the state at midship [n, 6]."""
    yaw_rate = state[:, 5]
    ahead, aside = sensors.position.lever_arm_m
    position = frames.position_at_midship(state[:, [0, 2]], axes, (-ahead, -aside))
    ahead, aside = sensors.velocity_arm_m
    velocity = frames.velocity_at_midship(state[:, [1, 3]], yaw_rate, (-ahead, -aside))
    if sensors.kind("velocity") != "body":
        velocity = frames.to_body(velocity, axes.back)
    return Sighted(position, velocity, state[:, 4], axes, yaw_rate)


def at_midship(
    readings: Sighted, sensors: Sensors, moved: tuple[float, float] = (0.0, 0.0)
) -> np.ndarray:
    """State at midship [n, 6]. `moved`: the antenna, from where the profile has it [m]."""
    arm = np.array(sensors.position.lever_arm_m)
    of_velocity = np.array(sensors.velocity_arm_m)
    shared = bool(np.array_equal(arm, of_velocity))
    position = frames.position_at_midship(readings.position, readings.axes, tuple(arm + moved))
    velocity = readings.velocity
    if sensors.kind("velocity") != "body":
        velocity = frames.to_body(velocity, readings.axes)
    velocity = frames.velocity_at_midship(
        velocity, readings.yaw_rate, tuple(of_velocity + moved) if shared else tuple(of_velocity)
    )
    return np.stack((
        position[:, 0], velocity[:, 0], position[:, 1], velocity[:, 1],
        readings.heading, readings.yaw_rate,
    )).T  # fmt: skip
