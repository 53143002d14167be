"""Units that logs and tables come in, and their factor to SI (rev/s for shafts)."""

from __future__ import annotations

from shiplog.exceptions import ProfileError, listed, nearest
from shiplog.nomenclature.channels import DEGREE

SECOND_NS = 1_000_000_000  # ns: logs count time in whole nanoseconds
TO_SI = {
    "1": 1.0, "%": 0.01, "permille": 0.001,
    "m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "ft": 0.3048,
    "m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001, "km/h": 1 / 3.6, "mph": 0.44704,
    "kn": 1852 / 3600, "knots": 1852 / 3600,
    "rad": 1.0, "deg": DEGREE,
    "rad/s": 1.0, "deg/s": DEGREE, "deg/min": DEGREE / 60,
    "rps": 1.0, "rev/s": 1.0, "rpm": 1 / 60,
    "pwm": 1 / 400,  # half a servo's travel, 400 µs, is full command
    "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86_400.0,
}  # fmt: skip

MEASURES = {  # what each unit measures
    "ratio": ("1", "%", "permille"),
    "length": ("m", "cm", "mm", "km", "ft"),
    "speed": ("m/s", "cm/s", "mm/s", "km/h", "mph", "kn", "knots"),
    "angle": ("rad", "deg"),
    "rate of turn": ("rad/s", "deg/s", "deg/min"),
    "shaft speed": ("rps", "rev/s", "rpm"),
    "servo pulse": ("pwm",),
    "time": ("s", "ms", "us", "ns", "min", "h", "d"),
}


# A number is Unix time in the one of these units in which it lies between 2000 and 2100: the ranges
# do not overlap.
UNIX_NS = {"s": SECOND_NS, "ms": 1_000_000, "us": 1_000, "ns": 1}
YEAR_2000_NS, YEAR_2100_NS = 946_684_800 * SECOND_NS, 4_102_444_800 * SECOND_NS


def unix_unit(count: float) -> str | None:
    """The unit of `UNIX_NS` in which a number is Unix time; None where it is in none."""
    return next(
        (unit for unit, ns in UNIX_NS.items() if YEAR_2000_NS <= count * ns < YEAR_2100_NS), None
    )


# Letters in which case decides: another unit, which no channel has.
CASED = {"kN": "kilonewtons, and a knot is 'kn'", "M": "nautical miles, and a metre is 'm'"}
_ANY_CASE = {unit.lower(): unit for unit in TO_SI}


def spelled(unit: str) -> str:
    """The unit as it is called here, of one in any letter case: `M/S`, `Deg`, `KN`. Any other text,
    and one of `CASED`, as it is."""
    return unit if unit in CASED else _ANY_CASE.get(unit.lower(), unit)


def measure(unit: str) -> str | None:
    """What `unit` measures; None for a unit not in the table."""
    return next((name for name, units in MEASURES.items() if unit in units), None)


def factor(unit: str) -> float:
    """What a value in `unit` is multiplied by. Raises ProfileError for a unit not in the table."""
    if unit not in TO_SI:
        meant = f": {CASED[unit]}" if unit in CASED else nearest(unit, TO_SI)
        raise ProfileError(
            f"The unit {unit!r} is not known{meant}.",
            hint=f"use one of: {listed(TO_SI, most=40)}.",
        )
    return TO_SI[unit]
