"""The heading of a quaternion: of a ship that heels, and of a sensor that is not mounted level.

A unit quaternion q turns the sensor's axes into the earth's. With the mounting M (sensor to ship,
`frames.mounted`) the ship's bow and its vertical axis stand in the sensor's axes as

    a = Mᵀ (1, 0, 0),   c = Mᵀ (0, 0, 1)

and in the earth's as q a q* and q c q*: the heading is the direction of the first on the horizon,
the tilt the angle of the second from the vertical. Two fields z and w alone are of a level sensor,
x = y = 0. The tilt still shows in their length,

    z² + w² = cos²(tilt / 2)

and the heading 2 atan2(z, w) is then off by φθ/2 of roll φ and pitch θ, tilt²/4 at most.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from shiplog.exceptions import LogUnreadable, ProfileError
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.nomenclature import frames
from shiplog.nomenclature.channels import DEGREE
from shiplog.ship_profile.profile import Sensor
from shiplog.ship_profile.table_channels import QUATERNION

KINDS = ("quaternion_enu", "quaternion_ned")
# Of a quaternion's length: rounding to two digits makes it 1 to 0.01, the mean of a second's turns
# to 0.01 less. What nobody filled in has 0.
LENGTH = 0.05
MOST_HEEL_RAD = math.radians(60.0)  # of a median: no ship sails on its side
SHORTEST_AHEAD = math.sin(math.radians(10.0))  # on the horizon: a bow that points up has no heading
# Of two fields alone: up to this tilt, z² + w² = 0.98, the heading is off by 1.2 deg at most.
LEVEL_RAD = math.radians(16.0)
# Numbers behind a common name of z and w, and those of x and y: (x, y, z, w) from 0 and from 1,
# (w, x, y, z) likewise.
NUMBERED = {(2, 3): (0, 1), (3, 4): (1, 2), (3, 0): (1, 2), (4, 1): (2, 3)}


@dataclass(frozen=True, slots=True)
class Orientation:
    """Of n messages: heading [rad], NaN where there is none; tilt [rad] of the ship's vertical axis
    as the mounting is known; roll and pitch [rad] of the sensor; whether x and y were known."""

    heading: np.ndarray
    tilt: np.ndarray
    roll: np.ndarray
    pitch: np.ndarray
    whole: bool


def x_and_y(paths: tuple[str, ...]) -> tuple[str, str] | None:
    """What x and y are called where these are the fields of z and w: `q.x` and `q.y`, or `q[0]` and
    `q[1]`. None where these are all four, or have no such names."""
    if len(paths) != 2:
        return None
    z, w = paths
    if z[:-1] == w[:-1] and (z[-1:], w[-1:]) in (("z", "w"), ("Z", "W")):
        return (z[:-1] + "x", z[:-1] + "y") if z[-1] == "z" else (z[:-1] + "X", z[:-1] + "Y")
    of_z, of_w = (re.fullmatch(r"(.*?)(\d+)(\D?)", path) for path in paths)
    if of_z is None or of_w is None or (of_z[1], of_z[3]) != (of_w[1], of_w[3]):
        return None
    pair = NUMBERED.get((int(of_z[2]), int(of_w[2])))
    return (f"{of_z[1]}{pair[0]}{of_z[3]}", f"{of_z[1]}{pair[1]}{of_z[3]}") if pair else None


def whole(reading: Reading, sensor: Sensor) -> Sensor:
    """The sensor with all four fields, where the log has x and y as well as z and w.

    A factor on z alone mirrors the turn; on x it is the same one, and on y there is none.
    """
    others, frame = x_and_y(sensor.paths), reading.frames.get(sensor.topic)
    if others is None or frame is None or not set(others) <= set(frame.columns):
        return sensor
    if any(frame[path].null_count() == frame.height for path in others):
        return sensor
    sign = sensor.sign
    if isinstance(sign, tuple):
        size = abs(sign[0])
        sign = (math.copysign(size, sign[0] * sign[1]), size, *sign)
    offset = (0.0, 0.0, *sensor.offset) if isinstance(sensor.offset, tuple) else sensor.offset
    units = ("1", "1", *sensor.units) if sensor.units else ()
    given = {"fields": (*others, *sensor.paths), "sign": sign, "offset": offset, "units": units}
    return sensor.model_copy(update=given)


def read_orientation(value: np.ndarray, sensor: Sensor, kind: str) -> Orientation:
    """value [n, 4] (x, y, z, w), or [n, 2] (z, w)."""
    known = value.shape[1] == len(QUATERNION)
    if not known and sensor.mounting_deg:
        raise ProfileError(
            f"The heading has `mounting_deg`, and z and w alone of its quaternion, from "
            f"{sensor.topic}.",
            hint="name all four in [sensors.heading], as fields x, y, z, w; or mount the sensor "
            "level.",
        )
    quaternion = value if known else np.concatenate((np.zeros((len(value), 2)), value), axis=1)
    length = np.linalg.norm(quaternion, axis=1)
    shortest = 1.0 - LENGTH if known else math.cos(MOST_HEEL_RAD / 2.0) - LENGTH
    fits = (length > shortest) & (length < 1.0 + LENGTH)
    quaternion = quaternion / np.where(length > 0.0, length, 1.0)[:, None]
    turns = frames.mounted(tuple(angle * DEGREE for angle in sensor.mounting_deg or (0.0,) * 3))
    up = kind == "quaternion_enu"
    to_sensor = (
        turns.T * np.array([[1.0], [-1.0], [-1.0]]) if up else turns.T
    )  # its y to port, z up
    ahead = frames.turned(quaternion, to_sensor[:, 0])
    down = frames.turned(quaternion, to_sensor[:, 2])[:, 2] * (-1.0 if up else 1.0)
    fits &= np.hypot(ahead[:, 0], ahead[:, 1]) > SHORTEST_AHEAD
    tilt = np.arccos(down.clip(-1.0, 1.0)) if known else 2.0 * np.arccos(length.clip(0.0, 1.0))
    unfilled = length < 1.0 - LENGTH if known else length == 0.0
    tilt[unfilled | (length > 1.0 + LENGTH)] = np.nan
    x, y, z, w = quaternion.T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x**2 + y**2))
    pitch = np.arcsin((2.0 * (w * y - z * x)).clip(-1.0, 1.0)) * (-1.0 if up else 1.0)
    heading = np.where(fits, frames.quaternion_heading(ahead, up), np.nan)
    return Orientation(heading, tilt, roll, pitch, known)


def findings(found: Orientation, sensor: Sensor, log: str) -> list[Finding]:
    """What the mounting makes of a heading. Raises LogUnreadable where it leaves none of z and w
    alone, or of a bow that points up."""
    there = np.isfinite(found.tilt)
    if not there.any():
        return []
    tilt = float(np.median(found.tilt[there]))
    if tilt > MOST_HEEL_RAD:
        return [_turned_over(found, tilt, sensor, log)]
    if not found.whole and tilt > LEVEL_RAD:
        off = math.degrees(tilt**2 / 4.0)
        sentence = (
            f"heading is of z and w of {sensor.topic} alone, whose ship is tilted by "
            f"{math.degrees(tilt):.0f} deg in the median: it may be off by {off:.1f} deg. Name x "
            "and y, too: `fields` of x, y, z, w in [sensors.heading]."
        )
        return [Finding("implausible", "heading", sentence, value=round(off, 3), unit="deg")]
    return []


def _turned_over(found: Orientation, tilt: float, sensor: Sensor, log: str) -> Finding:
    roll, pitch = (_whole_degrees(angle[np.isfinite(angle)]) for angle in (found.roll, found.pitch))
    leans = f"its vertical axis is {math.degrees(tilt):.0f} deg from upright"
    if not found.whole:
        raise LogUnreadable(
            f"The sensor on {sensor.topic} is turned over ({leans}), and z and w alone of its "
            f"quaternion say no heading: {log}.",
            hint="name all four in [sensors.heading], as fields x, y, z, w.",
        )
    stated = "not as its mounting_deg says" if sensor.mounting_deg else "turned over"
    if not np.isfinite(found.heading).any():
        raise LogUnreadable(
            f"No heading in {log}: the sensor on {sensor.topic} is {stated}, its x axis points up "
            f"or down (roll {roll}, pitch {pitch} deg).",
            hint=f"say in [sensors.heading] how it is mounted, as mounting_deg = [{roll}, {pitch}, "
            "0]: roll, pitch and yaw.",
        )
    sentence = (
        f"heading: the sensor on {sensor.topic} is {stated}: {leans} in the median (roll {roll}, "
        f"pitch {pitch} deg). The heading is where its x axis points. Say in [sensors.heading] how "
        f"it is mounted: mounting_deg = [{roll}, {pitch}, 0] if x points ahead, or fields and kind "
        "of another sensor."
    )
    value = round(math.degrees(tilt), 3)
    return Finding("contradiction", "heading", sentence, value=value, unit="deg", reason="mounting")


def _whole_degrees(angle: np.ndarray) -> int:
    """The median of angles [rad] around their circular mean, in (-180, 180] deg."""
    middle = math.atan2(float(np.sin(angle).mean()), float(np.cos(angle).mean()))
    median = middle + float(np.median(frames.wrap(angle - middle)))
    return -((180 - round(math.degrees(median))) % 360 - 180)
