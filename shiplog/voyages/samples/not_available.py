"""Marks that instruments and their formats write where they have no value.

A mark is believed only where it is certain: exactly that value, outside all other values of its
channel. A local position that passes through 655.35 m is a position.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from shiplog.nomenclature import units

EXACT = 2e-7  # relative: a float of 32 bits has 6e-8
APART = 0.03  # of the mark's size: nothing of the channel is nearer to it
NORTH_DEG = 15.0  # courses nearer to north than that may have gone through it
LEAST_RUN = 3  # times in a row: a ship that turns past north is there once
PULSE_US = (400.0, 2_600.0)  # what a servo takes at all; 1000 to 2000 is usual


@dataclass(frozen=True, slots=True)
class Mark:
    """One value that stands for none, in the unit in which its format counts."""

    value: float
    unit: str  # "" for the raw number, whatever its unit
    channels: tuple[str, ...]  # of a table's names; an actuator's is its kind; () for all
    of: str  # whose mark it is, for the finding


_SPEEDS = ("sog", "surge", "sway", "velocity_north", "velocity_east", "wind_speed")
_ANGLES = ("heading", "cog", "wind_angle")
_DRIVEN = ("rudder", "azimuth")
AIS = "of AIS"  # Rec. ITU-R M.1371-5, Annex 8, Table 48 (message 1)
N2K = "of NMEA 2000"  # IEC 61162-3: the largest number of a field, and the one below for an error
MAVLINK = "of MAVLink"  # common.xml: UINT16_MAX, INT16_MAX
PHONE = "of a telephone's receiver"  # Core Location: a negative speed, course or heading is none
WHOLE = "the end of its whole numbers"
MARKS = (
    Mark(360.0, "deg", ("cog",), AIS),
    Mark(102.3, "kn", ("sog",), AIS),
    Mark(511.0, "deg", ("heading",), AIS),
    Mark(91.0, "deg", ("latitude",), AIS),
    Mark(181.0, "deg", ("longitude",), AIS),
    Mark(-128.0, "deg/min", ("yaw_rate",), AIS),  # the indicator as it is sent,
    Mark(-((128 / 4.733) ** 2), "deg/min", ("yaw_rate",), AIS),  # and as it is decoded
    *(Mark(sign * turn, "deg/min", ("yaw_rate",), AIS)  # "turning", and no indicator
      for sign in (1.0, -1.0) for turn in (127.0, (127 / 4.733) ** 2, 720.0)),
    Mark(655.35, "m/s", _SPEEDS, f"{MAVLINK[3:]} or NMEA 2000"),
    Mark(655.34, "m/s", _SPEEDS, N2K),
    Mark(32.767, "m/s", ("surge", "sway"), N2K),
    Mark(655.35, "deg", _ANGLES, MAVLINK),
    *(Mark(angle, "rad", _ANGLES, N2K) for angle in (6.5535, 6.5534)),
    *(Mark(angle, "rad", _DRIVEN, N2K) for angle in (3.2767, 3.2766)),
    Mark((2**31 - 1) * 3.125e-8, "rad/s", ("yaw_rate",), N2K),
    Mark(16_383.75, "rpm", ("propeller", "thruster"), N2K),
    Mark(16_383.5, "rpm", ("propeller", "thruster"), N2K),
    Mark((2**31 - 1) * 1e-7, "deg", ("latitude", "longitude"), N2K),
    *(Mark(-1.0, "", (name,), PHONE) for name in ("sog", "cog", "heading", "wind_speed")),
    *(Mark(float(number), "", (), WHOLE)
      for number in (65_535, 32_767, -32_768, 2**31 - 1, -(2**31), 2**32 - 1)),
)  # fmt: skip
NO_PULSE = (0.0, 65_535.0)  # µs: disarmed; an RC channel that is not there (common.xml)


def marked(
    channel: str, raw: np.ndarray, factor: float, unit: str
) -> Iterator[tuple[Mark, np.ndarray]]:
    """Each mark that a channel [n] certainly has, and where [n] bool.

    channel  a table's name, or an actuator's kind
    raw      its values as they were sent, NaN where there is none
    factor   from these to SI, but for an offset
    """
    taken = np.zeros(len(raw), bool)
    known = raw[np.isfinite(raw)]
    if not len(known):
        return
    least, most = float(known.min()), float(known.max())
    for mark in MARKS:
        if mark.channels and channel not in mark.channels:
            continue
        if unit == "pwm" and not mark.unit:
            continue  # see `no_pulse`
        scale = abs(factor) / units.factor(mark.unit) if mark.unit else 1.0
        near = EXACT * abs(mark.value)
        if not least * scale - near <= mark.value <= most * scale + near:
            continue
        values = raw * scale
        at = (np.abs(values - mark.value) <= near) & ~taken
        if at.any() and _certain(channel, mark, values, at, np.isfinite(raw) & ~at & ~taken):
            taken |= at
            yield mark, at


def no_pulse(raw: np.ndarray, offset: float) -> np.ndarray:
    """Where [n] bool a servo has no pulse, of pulses [µs].

    Pulses that count from neutral are about 0, and 0 is one of them.
    """
    at = np.isin(raw, NO_PULSE)
    others = raw[np.isfinite(raw) & ~at]
    if len(others):
        inside = (others >= PULSE_US[0]) & (others <= PULSE_US[1])
        return at if inside.mean() > 0.5 else np.zeros(len(raw), bool)
    return at if offset >= PULSE_US[0] else np.zeros(len(raw), bool)


def _certain(
    channel: str, mark: Mark, values: np.ndarray, at: np.ndarray, other: np.ndarray
) -> bool:
    others = values[other]
    if channel == "cog" and mark.value == 360.0:
        return _no_north(values, at, other)
    if mark.unit == "deg/min" and (at.sum() < LEAST_RUN or not len(others)):
        return False  # a gyro may show such a rate, too
    if not len(others):
        return True
    if mark.value == -1.0:  # a speed astern in whole knots is a speed
        fine = channel != "sog" or bool((others % 1.0 != 0.0).any())
        return fine and bool(others.min() >= 0.0)
    outside = mark.value > others.max() or mark.value < others.min()
    return bool(outside) and bool(np.abs(others - mark.value).min() > APART * abs(mark.value))


def _no_north(course: np.ndarray, at: np.ndarray, other: np.ndarray) -> bool:
    """Whether courses of exactly 360 deg are none: some come amid courses that are far from north.

    An instrument that counts from 0 to 359.9 has no 360; one that counts to 360 has no 0, and is
    at 360 on its way through north.
    """
    known = np.flatnonzero(other)
    if not len(known):
        return False
    from_north = np.abs((course[known] + 180.0) % 360.0 - 180.0)
    edges = np.flatnonzero(np.diff(np.concatenate(([0], at.astype(np.int8), [0]))))
    has_zero = bool((course[known] == 0.0).any())
    for first, end in edges.reshape(-1, 2):
        if end - first < LEAST_RUN and not has_zero:
            continue
        place = int(np.searchsorted(known, first))
        beside = from_north[max(place - 1, 0) : place + 1]
        if (beside > NORTH_DEG).all():
            return True
    return False
