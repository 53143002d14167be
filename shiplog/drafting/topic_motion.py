"""Units and signs of a log's topics, by the motion that its other topics show."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.drafting.motion import Motion, quaternion_heading
from shiplog.nomenclature import units

METRE = 111_320.0  # m, a degree of latitude
FULL_TURN_RAD = 6.3  # an angle that never passes it, of a ship that turns, may be in radians
TURNED = 0.2  # of an angle's values, the range from the 5 % to the 95 % quantile: rad or deg
NOTHING = np.zeros(0)


@dataclass(frozen=True)
class Fields:
    """What a topic holds of a sensor: when [n] s, and the raw numbers of its fields [n, k]."""

    name: str
    kind: str
    time: np.ndarray
    raw: np.ndarray


@dataclass
class Agreement:
    """Units and signs of the sensors that were looked at so far; each goes by those before it."""

    motion: Motion = field(
        default_factory=lambda: Motion(NOTHING, np.zeros((0, 2)), NOTHING, NOTHING)
    )

    def position(self, found: Fields, factor: float) -> None:
        """Where the ship was, of degrees or metres that are `factor` times the numbers."""
        place = found.raw * factor
        if found.kind == "geodetic" and len(place):
            place = np.where((place == 0.0).all(axis=1)[:, None], np.nan, place)
            middle = np.nanmedian(place, axis=0) if np.isfinite(place).any() else np.zeros(2)
            place = (place - middle) * METRE * [1.0, math.cos(math.radians(middle[0]))]
        self.motion = replace(self.motion, time=found.time, place=place)

    def heading(self, found: Fields, unit: str, factor: float) -> None:
        """Where the bow pointed."""
        if found.kind.startswith("quaternion"):
            angle = quaternion_heading(found.raw, found.kind)
        else:
            angle = found.raw[:, 0] * factor * units.factor(unit)
        self.motion = replace(self.motion, heading_time=found.time, heading=angle)

    def angle(self, time: np.ndarray, raw: np.ndarray) -> tuple[str, float, str]:
        """(unit, factor, how it was found) of a heading or a course; no unit where nothing says."""
        if (agreed := self.motion.angle(time, raw)) is not None:
            return *agreed, "fits the way"
        known = np.abs(raw[np.isfinite(raw)])
        if len(known) and float(known.max()) < FULL_TURN_RAD and float(known.max()) > 0.0:
            low, high = np.quantile(raw[np.isfinite(raw)], (0.05, 0.95))
            if high - low > TURNED:
                return "rad", 1.0, f"never beyond {FULL_TURN_RAD:g}"
        return "", 1.0, ""

    def speed(self, time: np.ndarray, raw: np.ndarray) -> str | None:
        """The unit of a speed that is the position's change."""
        return self.motion.speed(time, raw)

    def turning(self, time: np.ndarray, raw: np.ndarray) -> tuple[str, float] | None:
        """(unit, sign) of a rate of turn."""
        return self.motion.turning(time, raw)


@dataclass(frozen=True)
class Scales:
    """How the fields of a sensor are drafted: unit and factor of each, and what to check."""

    units: tuple[str, ...]
    signs: tuple[float, ...]
    check: str  # of the units
    turned: str = ""  # of the signs


def scales(
    found: Fields, known: Sequence[str | None], usual: Sequence[str], signs: Sequence[float],
    agreement: Agreement,
) -> Scales:  # fmt: skip
    """Units of a velocity, heading or yaw rate: those that the log states, else those in which it
    agrees with the motion, else the usual ones."""
    given = tuple(unit or other for unit, other in zip(known, usual, strict=True))
    chosen, factors, how = list(given), list(signs), []
    if found.name == "velocity" and found.raw.shape[1] == 2:
        size = found.raw[:, 0] if found.kind == "sog_cog" else np.hypot(*found.raw.T)
        if unit := agreement.speed(found.time, size):
            for at in (0,) if found.kind == "sog_cog" else (0, 1):
                chosen[at] = unit
            how.append("how fast the position changes")
    angles = {("velocity", "sog_cog"): 1, ("heading", "angle"): 0}
    if (at := angles.get((found.name, found.kind))) is not None:
        unit, factor, why = agreement.angle(found.time, found.raw[:, at])
        if unit:
            chosen[at], factors[at] = unit, factors[at] * factor
            how.append(why.removeprefix("fits "))
    turned = ""
    if found.name == "yaw_rate" and (agreed := agreement.turning(found.time, found.raw[:, 0])):
        chosen[0], sign = agreed
        how.append("how fast the heading turns")
        if sign * factors[0] < 0.0:
            factors[0] = math.copysign(factors[0], sign)
            turned = "CHECK: the heading turns that way"
    return _said(found, known, given, (chosen, factors, how), signs, turned)


def _said(
    found: Fields, known: Sequence[str | None], given: tuple[str, ...],
    agreed: tuple[list[str], list[float], list[str]], signs: Sequence[float], turned: str,
) -> Scales:  # fmt: skip
    """What is stated stays, and is to be checked where the motion says another unit."""
    chosen, factors, how = agreed
    off = [
        unit for unit, own, other in zip(chosen, known, given, strict=True)
        if own and units.factor(unit) != units.factor(other)
    ]  # fmt: skip
    final = tuple(own or unit for own, unit in zip(known, chosen, strict=True))
    kept = tuple(
        sign if own and abs(factor) != abs(sign) else factor
        for own, sign, factor in zip(known, signs, factors, strict=True)
    )
    if off:
        return Scales(final, kept, f"CHECK: {' and '.join(how)} fits {', '.join(off)}", turned)
    if all(known) or found.kind.startswith("quaternion"):
        return Scales(final, kept, "", turned)
    fits = f"; it fits {' and '.join(dict.fromkeys(how))}" if how else ""
    return Scales(final, kept, f"CHECK: the log does not say{fits}", turned)
