"""What can be hidden of actuators, lines, tows and contact, and how large it is where it is
realistic. Units of the ranges as in `effects`; "unit" there is a recorded value's own largest.

A name is the cause's, and after a colon which of its forms: `actuator_limit:drive`. The key has
the cause's name alone. All of them are of the trial only, and size 1 is realistic.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from pipelines.experiments.other_families.effects import Draw, Drawn, Parameters, Range
from pipelines.experiments.other_families.gear import Fault
from pipelines.experiments.other_families.lines import Contact, Line, Tow
from pipelines.experiments.other_families.ship import Actuator, Ship

RANGES: dict[str, Range] = {
    "limit_rudder": Range(8.0, 15.0, "deg", "equipment: a stop, a jammed linkage, a low tank"),
    "limit_azimuth": Range(55.0, 110.0, "deg", "equipment: a worn slip ring, a chafed hose"),
    "limit_drive": Range(0.35, 0.60, "full", "equipment: limp-home mode, governor's load limit"),
    "rate_steering": Range(0.6, 1.5, "L/U", "SOLAS II-1/29.4: auxiliary gear, 30 deg in 60 s"),
    "rate_drive": Range(0.9, 2.2, "L/U", "load programmes of engines (MAN 2011), soft starters"),
    "play_rudder": Range(2.5, 6.0, "deg", "equipment: worn keys and pins of a quadrant"),
    "play_azimuth": Range(5.0, 14.0, "deg", "equipment: a worn worm gear"),
    "dead_drive": Range(0.08, 0.20, "full", "Blue Robotics T200: 1464 to 1536 of 1100 to 1900 μs"),
    "stuck_drive": Range(0.25, 0.55, "full", "equipment: an order that is lost, the last one kept"),
    "stuck_rudder": Range(4.0, 14.0, "deg", "equipment: a valve that sticks"),
    "stuck_azimuth": Range(10.0, 40.0, "deg", "equipment: a failed swing motor"),
    "couple": Range(0.15, 0.35, "1", "equipment: two units on one bus"),
    "line_constant": Range(0.06, 0.16, "F", "a winch in constant tension (OCIMF 2018)"),
    "line_elastic": Range(0.12, 0.30, "F", "at half a basin's radius: a long synthetic line"),
    "tow": Range(0.08, 0.20, "F", "a barge or a net on a short hawser"),
    "contact": Range(0.6, 1.4, "F", "berthing: fenders chosen for 0.05 to 0.2 m/s (PIANC 2002)"),
}
SLACK = (0.5, 3.0)  # L, of a line
LINE_OFF = 0.5  # of the basin's radius, a line's point off the middle at most
REFERENCE = 0.5  # of the radius, where an elastic line pulls what its range says
TURN = (0.5, 2.5)  # rad, of a tow along the campaign
REACH = (0.3, 0.8)  # L, thickness of a fender with its pontoon
STUCK = ((0.15, 0.40), (0.25, 0.45))  # shares of the campaign: its start, how long
LEAST_RATE = 0.5  # of the unit's own rate: what is slower than recorded is at most this


def _reported(**parameters: tuple[Any, str]) -> Parameters:
    return {name: {"value": value, "unit": unit} for name, (value, unit) in parameters.items()}


def _size(rng: np.random.Generator, size: float, name: str) -> float:
    return RANGES[name].draw(rng, size)


def _either(rng: np.random.Generator) -> float:
    return float(rng.choice((-1.0, 1.0)))


def _one(rng: np.random.Generator, ship: Ship, drive: bool) -> tuple[int, Actuator]:
    units = drives(ship) if drive else ship.steering
    unit = int(units[rng.integers(len(units))])
    return unit, ship.actuators[unit]


def drives(ship: Ship) -> tuple[int, ...]:
    return tuple(i for i, a in enumerate(ship.actuators) if a.drive is not None)


def _shown(actuator: Actuator, value: float, per: str = "") -> tuple[float, str]:
    """A value of this unit as the key has it."""
    if actuator.steers:
        return math.degrees(value), f"deg{per}"
    return value, f"rps{per}"


def _most(actuator: Actuator) -> float:
    """rad or rev/s, of its ordinary use."""
    return max(abs(actuator.low), abs(actuator.high))


def _limit(drive: bool) -> Draw:
    """At full size that of the range, at none the unit's own largest."""

    def draw(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
        unit, one = _one(rng, ship, drive)
        most = _most(one)
        if drive:
            least = _size(rng, 1.0, "limit_drive") * most
        else:
            least = math.radians(_size(rng, 1.0, f"limit_{one.kind}"))
        limit = most - (most - least) * size
        return {"gear": (Fault(unit, limit=limit),)}, _reported(
            limit=_shown(one, limit), actuator=(one.name, "")
        )

    return draw


def _rate(drive: bool) -> Draw:
    """As long as a ship takes for its own length, from amidships or stop to hard over or full; an
    azimuth to abeam."""

    def draw(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
        unit, one = _one(rng, ship, drive)
        way = 0.5 * math.pi if one.kind == "azimuth" else _most(one)
        name = "rate_drive" if drive else "rate_steering"
        seconds = _size(rng, size, name) * ship.time_unit
        rate = min(way / seconds, LEAST_RATE * one.rate)
        return {"gear": (Fault(unit, rate=rate),)}, _reported(
            rate=_shown(one, rate, "/s"), actuator=(one.name, "")
        )

    return draw


def _dead_band(drive: bool) -> Draw:
    """Backlash of what steers, a dead zone of what drives; its half width."""

    def draw(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
        unit, one = _one(rng, ship, drive)
        if drive:
            width = _size(rng, size, "dead_drive") * _most(one)
        else:
            width = math.radians(_size(rng, size, f"play_{one.kind}"))
        fault = Fault(unit, dead=width) if drive else Fault(unit, play=width)
        form = "dead zone" if drive else "backlash"
        return {"gear": (fault,)}, _reported(
            half_width=_shown(one, width), form=(form, ""), actuator=(one.name, "")
        )

    return draw


def _stuck(drive: bool) -> Draw:
    """For a part of the campaign that several voyages share."""

    def draw(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
        unit, one = _one(rng, ship, drive)
        if drive:
            value = _size(rng, 1.0, "stuck_drive") * one.high
        else:
            value = _either(rng) * math.radians(_size(rng, 1.0, f"stuck_{one.kind}"))
        start, long = (float(rng.uniform(*ends)) for ends in STUCK)
        until = start + long * size
        fault = Fault(unit, stuck=value, stuck_from=start, stuck_until=until)
        return {"gear": (fault,)}, _reported(
            value=_shown(one, value), start=(start, "1"), end=(until, "1"), actuator=(one.name, "")
        )

    return draw


def pairs(ship: Ship) -> tuple[tuple[int, int], ...]:
    """Two units of one kind that push or turn alike."""
    return tuple(
        (i, j)
        for i, one in enumerate(ship.actuators)
        for j, other in enumerate(ship.actuators)
        if i < j and (one.kind, one.direction_deg) == (other.kind, other.direction_deg)
    )


def _coupling(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    """A unit does a share of another one's order on top of its own; not azimuths, whose sum means
    nothing."""
    alike = [p for p in pairs(ship) if ship.actuators[p[0]].kind != "azimuth"]
    two = alike[rng.integers(len(alike))]
    one, other = two if rng.random() < 0.5 else two[::-1]
    share = _either(rng) * _size(rng, size, "couple")
    names = (ship.actuators[one].name, ship.actuators[other].name)
    return {"couple": share, "couple_from": one, "couple_to": other}, _reported(
        share=(share, "1"), of=(names[0], ""), actuator=(names[1], "")
    )


def exchangeable(ship: Ship) -> tuple[tuple[int, int], ...]:
    """Pairs whose orders differ enough to be distinguished: drives at two sides, or azimuths."""
    return tuple(
        (i, j)
        for i, j in pairs(ship)
        if ship.actuators[i].kind == "azimuth"
        or (
            ship.actuators[i].drive is not None
            and ship.actuators[i].position[1] * ship.actuators[j].position[1] < 0.0
        )
    )


def _exchanged(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    """Each is recorded as the other one: two plugs of the logger. The crew steers as ever."""
    two = exchangeable(ship)
    pair = two[rng.integers(len(two))]
    names = (ship.actuators[i].name for i in pair)
    return {"exchanged": pair}, _reported(
        **{label: (name, "") for label, name in zip(("actuator", "other"), names, strict=True)}
    )


def _fast_at(rng: np.random.Generator, ship: Ship) -> float:
    """m ahead of midship: a towing hook amidships as often as a bitt at an end."""
    if rng.random() < 0.5:
        return 0.0
    return float(_either(rng) * rng.uniform(0.3, 0.47) * ship.length)


def _line(elastic: bool) -> Draw:
    def draw(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
        name = "line_elastic" if elastic else "line_constant"
        pull = _size(rng, size, name) * ship.force_unit
        slack = float(rng.uniform(*SLACK)) * ship.length
        off, at = rng.uniform(0.0, LINE_OFF) * ship.radius, rng.uniform(0.0, 2.0 * math.pi)
        north, east, ahead = off * math.cos(at), off * math.sin(at), _fast_at(rng, ship)
        stiffness = pull / (REFERENCE * ship.radius) if elastic else 0.0
        line = Line(north, east, slack, stiffness, 0.0 if elastic else pull, ahead)
        strength = {"stiffness": (stiffness, "N/m")} if elastic else {"force": (pull, "N")}
        return {"line": line}, _reported(
            **strength, north=(north, "m"), east=(east, "m"), length=(slack, "m"),
            position=(ahead, "m"),
        )  # fmt: skip

    return draw


def _tow(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    force = _size(rng, size, "tow") * ship.force_unit
    bearing, turn = rng.uniform(0.0, 2.0 * math.pi), _either(rng) * rng.uniform(*TURN)
    ahead = _fast_at(rng, ship)
    tow = Tow(force, float(bearing), float(turn), ahead)
    return {"slow_tow": tow}, _reported(
        force=(force, "N"), direction=(math.degrees(bearing), "deg"),
        turn=(math.degrees(turn), "deg"), position=(ahead, "m"),
    )  # fmt: skip


def _contact(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    force = _size(rng, size, "contact") * ship.force_unit
    reach = float(rng.uniform(*REACH)) * ship.length
    return {"contact": Contact(force, reach)}, _reported(force=(force, "N"), reach=(reach, "m"))


def _feedback(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    """Order and feedback are both logged, and differ by an angle that nothing moves by."""
    unit, one = _one(rng, ship, drive=False)
    off = _either(rng) * math.radians(rng.uniform(2.0, 6.5)) * size
    return {"feedback": (unit, off)}, _reported(angle=_shown(one, off), actuator=(one.name, ""))


ACTUATORS: dict[str, Draw] = {
    "actuator_limit:steering": _limit(False),
    "actuator_limit:drive": _limit(True),
    "actuator_rate:steering": _rate(False),
    "actuator_rate:drive": _rate(True),
    "actuator_dead_band:steering": _dead_band(False),
    "actuator_dead_band:drive": _dead_band(True),
    "actuator_stuck:steering": _stuck(False),
    "actuator_stuck:drive": _stuck(True),
    "actuator_coupling": _coupling,
    "actuators_exchanged": _exchanged,
}
LINES: dict[str, Draw] = {
    "line:elastic": _line(True),
    "line:constant": _line(False),
    "tow:turning": _tow,
    "contact": _contact,
}
ALONE: dict[str, Draw] = {"feedback": _feedback}  # in no block: a finding before any model
DEVICES: dict[str, Draw] = {**ACTUATORS, **LINES, **ALONE}


def _can(ship: Ship) -> Iterator[str]:
    steered = tuple(f"{name}:steering" for name in (
        "actuator_limit", "actuator_rate", "actuator_dead_band"
    ))  # fmt: skip
    if ship.steering:
        yield from (*steered, *ALONE)
    if len(ship.steering) > 1:  # with its only rudder stuck, a ship goes in circles
        yield "actuator_stuck:steering"
    yield from (name for name in ACTUATORS if name.endswith(":drive"))
    if any(ship.actuators[i].kind != "azimuth" for i, _ in pairs(ship)):
        yield "actuator_coupling"
    if exchangeable(ship):
        yield "actuators_exchanged"
    yield from LINES


def offered(ship: Ship) -> tuple[str, ...]:
    """What of `DEVICES` can be hidden in this ship, in their order."""
    there = set(_can(ship))
    return tuple(name for name in DEVICES if name in there)
