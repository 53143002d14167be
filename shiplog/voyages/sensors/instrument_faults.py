"""Faults of instruments, taken out of a record: what it would be without each.

`ingest --correct` and the causes of the diagnosis use the same formulas.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shiplog.nomenclature import frames
from shiplog.nomenclature.frames import in_body_axes, in_earth_axes
from shiplog.voyages.rows.recording import Record


def without_heading_offset(record: Record, angle: float, turned: bool = False) -> Record:
    """A compass that shows `angle` [rad] too much; with `turned`, the recorder also turned the
    body velocity by it."""
    readings = record.sighted.turned(-angle)
    if turned:
        c, s = np.cos(angle), np.sin(angle)
        was = np.stack(in_earth_axes(readings.velocity[:, 0], readings.velocity[:, 1], c, s), -1)
        readings = replace(readings, velocity=was)
    return record.measured_as(readings)


def without_yaw_rate_bias(record: Record, bias: float) -> Record:
    """A rate gyro that shows `bias` [rad/s] too much."""
    readings = record.sighted
    return record.measured_as(replace(readings, yaw_rate=readings.yaw_rate - bias))


def without_yaw_rate_scale(record: Record, excess: float) -> Record:
    """A rate gyro that shows 1 + `excess` times the rate."""
    readings = record.sighted
    return record.measured_as(replace(readings, yaw_rate=readings.yaw_rate / (1.0 + excess)))


def without_velocity_scale(record: Record, excess: float) -> Record:
    """A log or receiver that shows 1 + `excess` times the velocity."""
    readings = record.sighted
    return record.measured_as(replace(readings, velocity=readings.velocity / (1.0 + excess)))


def without_clock_offset(record: Record, channel: str, late: float, turned: bool = False) -> Record:
    """A channel (position, velocity, gnss for both, yaw_rate or wind) whose samples are stamped
    `late` [s] after their time. With `turned`, body velocities V came late over ground, and the
    recorder turned them by the heading that it had then: R(ψ(t)) V(t) = Ẋ(t - τ)."""
    if channel == "wind":
        return replace(record, wind=record.later(record.wind, late))
    readings = record.sighted
    if channel in ("position", "gnss"):
        readings = replace(readings, position=record.later(readings.position, late))
    derived = record.profile.sensors.velocity is None and channel == "position"
    if channel in ("velocity", "gnss") and turned:
        over_ground = frames.to_body(readings.velocity, readings.axes.back)
        velocity = frames.to_body(record.later(over_ground, late), readings.axes)
        readings = replace(readings, velocity=velocity)
    elif channel in ("velocity", "gnss") or derived:
        readings = replace(readings, velocity=record.later(readings.velocity, late))
    if channel == "yaw_rate":
        readings = replace(readings, yaw_rate=record.later(readings.yaw_rate, late))
    return record.measured_as(readings)


def without_antenna_offset(record: Record, ahead: float, starboard: float) -> Record:
    """An antenna that is so far [m] from where the profile has it."""
    return record.measured_as(record.sighted, (ahead, starboard))


def without_wind_direction_offset(record: Record, angle: float) -> Record:
    """A vane whose zero is `angle` [rad] off the bow."""
    c, s = np.cos(angle), np.sin(angle)
    turned = np.stack(in_body_axes(record.wind[:, 0], record.wind[:, 1], c, s), -1)
    return replace(record, wind=turned)


def without_wind_speed_scale(record: Record, excess: float) -> Record:
    """An anemometer that shows 1 + `excess` times the apparent wind speed."""
    return replace(record, wind=record.wind / (1.0 + excess))
