"""What of a ship does not change: sizes, places, and which actuator drives what."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

from shiplog.exceptions import ProfileError, listed, nearest
from shiplog.models import FORCES
from shiplog.models.mmg.estimate import Particulars, particulars, rudder_size
from shiplog.nomenclature import units
from shiplog.ship_profile.profile import Actuator, Profile

AIR = 1.225  # kg/m³
WIDE_ANGLE = math.radians(45.0)
UNITS = ("propellers", "rudders", "thrusters")
PARTS = ("hull", *FORCES)  # all forces that a ship may have
# What a command of 1 without a unit is taken as, and the unit to record it in instead.
OF_ONE = {"rudder": ("1 rad", "deg"), "azimuth": ("1 rad", "deg"), "propeller": ("1 rev/s", "rpm")}


@dataclass(frozen=True, slots=True)
class Propeller:
    """A screw on a fixed shaft: its column among the actuators [rev/s], place and diameter."""

    column: int
    name: str
    ahead: float  # m of midship
    starboard: float  # m
    diameter: float  # m


@dataclass(frozen=True, slots=True)
class Rudder:
    """A blade: its column [rad], place, size, and the screw whose slipstream it stands in."""

    column: int
    name: str
    ahead: float  # m of midship
    starboard: float  # m
    area: float  # m²
    span: float  # m
    wide: bool  # made to be turned beyond 45 deg: Schilling, VecTwin
    behind: int | None  # index into Geometry.propellers


@dataclass(frozen=True, slots=True)
class Thruster:
    """A unit that is known by its command alone: fixed, or turned by an azimuth's column."""

    column: int
    name: str
    ahead: float  # m of midship
    starboard: float  # m
    full: float  # command at full thrust, in the actuator's SI unit
    direction: float  # rad from ahead to starboard, where nothing turns it
    turned_by: int | None  # column of the azimuth angle [rad]


@dataclass(frozen=True, slots=True)
class Geometry:
    """Everything SI. A rollout is compiled once for all ships with the same actuators: `split`
    takes the sizes and places out, which are arguments of the compiled function."""

    length: float
    draught: float
    mass: float
    x_g: float  # m ahead of midship
    density: float
    frontal_area: float
    lateral_area: float
    actuators: int
    propellers: tuple[Propeller, ...]
    rudders: tuple[Rudder, ...]
    thrusters: tuple[Thruster, ...]
    wind: bool

    @property
    def parts(self) -> tuple[str, ...]:
        """The forces this ship has."""
        has = {
            "hull": True,
            "propeller": self.propellers,
            "rudder": self.rudders,
            "thruster": self.thrusters,
            "wind": self.wind,
        }
        return tuple(name for name in PARTS if has[name])


def split(one: Any) -> tuple[list[Any], Any]:
    """The sizes and places of a geometry or of one of its units, in order, and the same with zeros
    in their place, which is hashable."""
    found, left = [], {}
    for field in fields(one):
        value = getattr(one, field.name)
        if field.type == "float":
            found.append(value)
            left[field.name] = 0.0
        elif field.name in UNITS:
            each = [split(unit) for unit in value]
            found += [number for numbers, _ in each for number in numbers]
            left[field.name] = tuple(unit for _, unit in each)
    return found, replace(one, **left)


def joined(one: Any, numbers: Iterator[Any]) -> Any:
    """The inverse of `split`: a geometry with the next of these numbers, in the same order."""
    found = {}
    for field in fields(one):
        if field.type == "float":
            found[field.name] = next(numbers)
        elif field.name in UNITS:
            found[field.name] = tuple(joined(unit, numbers) for unit in getattr(one, field.name))
    return replace(one, **found)


def geometry_of(
    profile: Profile, without: Iterable[str] = ()
) -> tuple[Geometry, Particulars, tuple[str, ...]]:
    """A profile's geometry, its particulars, and a sentence for each that had to be estimated.

    without   those of FORCES that are switched off
    Raises ProfileError where a term lacks what it needs, naming it.
    """
    off = set(without)
    for name in off:
        if name not in FORCES:
            raise ProfileError(
                f"There is no force {name!r} to leave out{nearest(name, FORCES)}.",
                hint=f"--without can be {listed(FORCES)}.",
            )
    main, notes = particulars(profile)
    propellers, rudders, thrusters, sizes = _units(profile, main, off)
    return (
        Geometry(
            length=main.length,
            draught=main.draught,
            mass=main.mass,
            x_g=main.x_g,
            density=main.density,
            frontal_area=main.frontal_area,
            lateral_area=main.lateral_area,
            actuators=len(profile.actuators),
            propellers=propellers,
            rudders=rudders,
            thrusters=thrusters,
            wind=profile.has_wind and "wind" not in off,
        ),
        main,
        (*notes, *sizes),
    )


def _units(
    profile: Profile, main: Particulars, off: set[str]
) -> tuple[tuple[Propeller, ...], tuple[Rudder, ...], tuple[Thruster, ...], tuple[str, ...]]:
    """What drives and steers, without the kinds that are `off`, and a sentence for each rudder
    whose size had to be estimated and for each command without a unit."""
    column = {actuator.name: i for i, actuator in enumerate(profile.actuators)}
    propellers = tuple(
        Propeller(
            column[a.name], a.name, *a.position_m, _needed(a, "diameter_m", "propeller")
        )
        for a in profile.actuators
        if a.kind == "propeller" and "propeller" not in off
    )  # fmt: skip
    blades = [a for a in profile.actuators if a.kind == "rudder" and "rudder" not in off]
    sizes = [rudder_size(a, len(blades), main) for a in blades]
    rudders = tuple(
        Rudder(
            column[a.name], a.name, *a.position_m, area, span,
            reach(a) > WIDE_ANGLE, _slipstream(a, propellers),
        )
        for a, (area, span, _) in zip(blades, sizes, strict=True)
    )  # fmt: skip
    thrusters = tuple(
        Thruster(
            column[a.name],
            a.name,
            *a.position_m,
            _full(a),
            math.radians(a.direction_deg),
            _turning(a, profile),
        )
        for a in profile.actuators
        if a.kind == "thruster" and "thruster" not in off
    )
    notes = [sentence for *_, sentence in sizes if sentence]
    notes += [
        _without_unit(a) for a in profile.actuators
        if a.kind in OF_ONE and a.kind not in off and a.si_unit == "1"
    ]  # fmt: skip
    return propellers, rudders, thrusters, tuple(notes)


def _needed(actuator: Actuator, key: str, part: str) -> float:
    value = getattr(actuator, key)
    if value is None:
        raise ProfileError(
            f"The profile gives no {key} for the {part} {actuator.name!r}, "
            "which its force is computed from.",
            hint=f"add {key} to that actuator, or leave the force out with --without {part}.",
        )
    return value


def _without_unit(actuator: Actuator) -> str:
    """What its physics make of a command that is a share."""
    unit, (one, other) = actuator.unit or "1", OF_ONE[actuator.kind]
    full = f"{1.0 / units.factor(unit):g}" + ("" if unit == "1" else f" {unit}")
    return (
        f"The command of the {actuator.kind} {actuator.name!r} has no unit of its own: {full} is "
        f"taken as {one}. If that is wrong, give a factor in `sign`, or record it in {other}."
    )


def _slipstream(rudder: Actuator, propellers: tuple[Propeller, ...]) -> int | None:
    """The screw that a rudder stands behind: nearest across, then along; None where none is."""
    ahead, starboard = rudder.position_m
    near = [
        (round(abs(p.starboard - starboard), 6), abs(p.ahead - ahead), i)
        for i, p in enumerate(propellers)
        if abs(p.starboard - starboard) <= p.diameter
    ]
    return min(near)[2] if near else None


def reach(actuator: Actuator) -> float:
    """The larger of its limits from zero, in SI; 0 where the profile gives none."""
    offset, factor = actuator.scale()[0]
    return max((abs((limit - offset) * factor) for limit in actuator.limits or ()), default=0.0)


def _full(thruster: Actuator) -> float:
    """The command at full thrust, in SI; 1 for a command that has no unit and no limits.

    Raises ProfileError for revolutions without limits: full thrust is then not known.
    """
    most = reach(thruster)
    if not most and thruster.si_unit != "1":
        raise ProfileError(
            f"The profile gives no limits for the thruster {thruster.name!r}, and its command is "
            f"in {thruster.unit}: the full thrust is not known.",
            hint="add limits to that actuator, or leave the force out with --without thruster.",
        )
    return most or 1.0


def _turning(thruster: Actuator, profile: Profile) -> int | None:
    """The column of the azimuth at the same place, if there is one."""
    for i, other in enumerate(profile.actuators):
        if other.kind == "azimuth" and other.position_m == thruster.position_m:
            return i
    return None
