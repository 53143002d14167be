"""The fields of the NMEA 2000 messages that say how a ship moves: place, length, resolution.

Numbers as canboat's documentation has them (canboat.github.io), in SI and radians. A field whose
bits are all ones, of a signed one all but the first, has no value; the two below mean an error and
out of range.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

RESERVED = 3  # the highest codes of a field: not available, out of range, reserved
RPM = 1.0 / 60.0  # rev/s


@dataclass(frozen=True, slots=True)
class Field:
    """Bytes `at` to `at + size`, in steps of `resolution`; of a part of a byte, `bits` from
    `shift` on."""

    at: int
    size: int
    resolution: float = 1.0
    signed: bool = False
    bits: int = 0
    shift: int = 0


def _u(at: int, size: int, resolution: float = 1.0) -> Field:
    return Field(at, size, resolution)


def _i(at: int, size: int, resolution: float = 1.0) -> Field:
    return Field(at, size, resolution, signed=True)


def _bits(at: int, bits: int, shift: int = 0) -> Field:
    return Field(at, 1, bits=bits, shift=shift)


ANGLE = 1e-4  # rad
MESSAGES: dict[int, dict[str, Field]] = {
    126992: {"source": _bits(1, 4), "date": _u(2, 2), "time": _u(4, 4, 1e-4)},  # d, s
    127245: {"instance": _u(0, 1), "order": _i(2, 2, ANGLE), "angle": _i(4, 2, ANGLE)},
    127250: {"heading": _u(1, 2, ANGLE), "deviation": _i(3, 2, ANGLE),
             "variation": _i(5, 2, ANGLE), "reference": _bits(7, 2)},
    127251: {"rate": _i(1, 4, 3.125e-8)},  # rad/s
    127258: {"variation": _i(4, 2, ANGLE)},
    127488: {"instance": _u(0, 1), "speed": _u(1, 2, 0.25 * RPM)},  # rev/s of the engine
    127493: {"instance": _u(0, 1), "gear": _bits(1, 2)},
    128259: {"speed": _u(1, 2, 0.01)},  # m/s through the water
    129025: {"latitude": _i(0, 4, 1e-7), "longitude": _i(4, 4, 1e-7)},  # deg
    129026: {"reference": _bits(1, 2), "cog": _u(2, 2, ANGLE), "sog": _u(4, 2, 0.01)},
    129029: {"date": _u(1, 2), "time": _u(3, 4, 1e-4), "latitude": _i(7, 8, 1e-16),
             "longitude": _i(15, 8, 1e-16), "altitude": _i(23, 8, 1e-6), "method": _bits(31, 4, 4)},
    129033: {"date": _u(0, 2), "time": _u(2, 4, 1e-4)},
    130306: {"speed": _u(1, 2, 0.01), "angle": _u(3, 2, ANGLE), "reference": _bits(5, 3)},
}  # fmt: skip
NAMES = {
    126992: "system time", 127245: "rudder", 127250: "heading", 127251: "rate of turn",
    127257: "attitude", 127258: "magnetic variation", 127488: "engine speed", 127489: "engine",
    127493: "gear", 127508: "battery", 128259: "speed through water", 128267: "depth",
    129025: "position", 129026: "course and speed over ground", 129029: "GNSS position",
    129033: "time and date", 130306: "wind",
}  # fmt: skip
FAST = frozenset({129029})
WIDTHS = {
    pgn: max(8, *(one.at + one.size for one in fields.values())) for pgn, fields in MESSAGES.items()
}
TRUE, MAGNETIC = 0, 1  # references of headings and courses
FORWARD, NEUTRAL, REVERSE = 0, 1, 2  # of 127493
TO_NORTH, TO_MAGNETIC_NORTH, APPARENT, OF_THE_BOAT, OF_THE_WATER = range(5)  # of 130306
NO_FIX, ESTIMATED, MANUAL, SIMULATED = 0, 6, 7, 8  # methods of 129029 that are no measurement


def read_field(pgn: int, name: str, payload: np.ndarray) -> np.ndarray:
    """Values [n] of payloads [n, k] in the field's unit; NaN where there is none."""
    one = MESSAGES[pgn][name]
    if one.bits:
        return (payload[:, one.at] >> one.shift & (1 << one.bits) - 1).astype(float)
    letter = "i" if one.signed else "u"
    raw = np.ascontiguousarray(payload[:, one.at : one.at + one.size])
    numbers = raw.view(f"<{letter}{one.size}").reshape(-1)
    most = (1 << (8 * one.size - int(one.signed))) - 1
    none = numbers > most - RESERVED
    if one.size == 1:
        none = numbers == most  # an instance: 252 and above are some in real logs
    return np.where(none, np.nan, numbers * one.resolution)
