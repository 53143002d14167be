"""What can be hidden of the known ship's actuators, and of lines, tows and contact: realistic sizes
at size 1. Names and keys as in `pipelines.experiments.other_families.devices`; numbers and forms
are this simulator's own.

Sizes: steering gear at half of its pumps and less (SOLAS II-1/29), servos of 3 m models whose gears
are worn, speed controllers in limp-home mode or whose zero is off (Blue Robotics: 9 % of full); a
line, a tow and a fender of 0.05 to 1 of m U²/L = 13 N, U the 0.4 m/s of these voyages.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from pipelines.experiments.simulated_ship.gear import Faulty

Drawn = tuple[dict[str, Any], dict[str, dict[str, Any]]]
Draw = Callable[[np.random.Generator, float], Drawn]

RUDDERS = ("rudder_port", "rudder_starboard")
LIMIT = {"rudder": ((40.0, 70.0), 105.0), "propeller": ((5.5, 8.0), 12.5)}  # deg, rev/s; at none
RATE = {"rudder": (2.5, 7.0), "propeller": (0.25, 0.7)}  # deg/s, rev/s²
WIDTH = {"rudder": (4.0, 10.0), "propeller": (0.8, 2.0)}  # deg of backlash; rev/s of dead zone
STAND = {"rudder": (8.0, 30.0), "propeller": (5.0, 8.0)}  # deg, rev/s
STAND_SHARES = ((0.15, 0.40), (0.25, 0.45))  # of the campaign: start, length
SHARE = (0.12, 0.30)  # of the other rudder's angle
CONSTANT, ELASTIC, AT = (0.9, 2.2), (1.6, 3.6), 12.0  # N; N at so many metres beyond its length
LENGTHS, OFF = (1.5, 8.0), 15.0  # m, of a line; of its point off the middle
TOW, TURN = (0.9, 2.4), (0.5, 2.5)  # N; rad along the campaign
FENDER, REACH = (7.0, 16.0), (0.7, 2.0)  # N, m


def _reported(**parameters: tuple[Any, str]) -> dict[str, dict[str, Any]]:
    return {name: {"value": value, "unit": unit} for name, (value, unit) in parameters.items()}


def _either(rng: np.random.Generator) -> float:
    return float(rng.choice((-1.0, 1.0)))


def _unit(rng: np.random.Generator, kind: str) -> str:
    return str(rng.choice(RUDDERS)) if kind == "rudder" else kind


def _faulty(unit: str, **faults: float) -> dict[str, Any]:
    return {"gear": (Faulty(unit, **faults),)}


def _inside(kind: str, value: float) -> float:
    return math.radians(value) if kind == "rudder" else value


def _limit(kind: str) -> Draw:
    def draw(rng: np.random.Generator, size: float) -> Drawn:
        unit, (ends, most) = _unit(rng, kind), LIMIT[kind]
        limit = most - (most - rng.uniform(*ends)) * size
        return _faulty(unit, limit=_inside(kind, limit)), _reported(
            limit=(limit, "deg" if kind == "rudder" else "rps"), actuator=(unit, "")
        )

    return draw


def _rate(kind: str) -> Draw:
    """A smaller size is a quicker unit."""

    def draw(rng: np.random.Generator, size: float) -> Drawn:
        unit, rate = _unit(rng, kind), rng.uniform(*RATE[kind]) / size
        return _faulty(unit, rate=_inside(kind, rate)), _reported(
            rate=(rate, "deg/s" if kind == "rudder" else "rps/s"), actuator=(unit, "")
        )

    return draw


def _dead_band(kind: str) -> Draw:
    def draw(rng: np.random.Generator, size: float) -> Drawn:
        unit, width = _unit(rng, kind), rng.uniform(*WIDTH[kind]) * size
        form, field = ("backlash", "play") if kind == "rudder" else ("dead zone", "dead")
        return _faulty(unit, **{field: _inside(kind, width)}), _reported(
            half_width=(width, "deg" if kind == "rudder" else "rps"), form=(form, ""),
            actuator=(unit, ""),
        )  # fmt: skip

    return draw


def _stuck(kind: str) -> Draw:
    def draw(rng: np.random.Generator, size: float) -> Drawn:
        unit, value = _unit(rng, kind), float(rng.uniform(*STAND[kind]))
        value *= -1.0 if unit == "rudder_port" else 1.0  # to where it has most of its travel
        since, long = (float(rng.uniform(*ends)) for ends in STAND_SHARES)
        until = since + long * size
        return _faulty(unit, stand=_inside(kind, value), since=since, until=until), _reported(
            value=(value, "deg" if kind == "rudder" else "rps"), start=(since, "1"),
            end=(until, "1"), actuator=(unit, ""),
        )  # fmt: skip

    return draw


def _coupling(rng: np.random.Generator, size: float) -> Drawn:
    unit = _unit(rng, "rudder")
    other = next(name for name in RUDDERS if name != unit)
    share = _either(rng) * rng.uniform(*SHARE) * size
    return _faulty(unit, share=share), _reported(
        share=(share, "1"), of=(other, ""), actuator=(unit, "")
    )


def _fast_at(rng: np.random.Generator) -> float:
    """m ahead of midship, where it is made fast: amidships, or near an end."""
    return 0.0 if rng.random() < 0.5 else float(_either(rng) * rng.uniform(0.9, 1.4))


def _line(elastic: bool) -> Draw:
    def draw(rng: np.random.Generator, size: float) -> Drawn:
        pull = rng.uniform(*(ELASTIC if elastic else CONSTANT)) * size
        length, off, at = rng.uniform(*LENGTHS), rng.uniform(0.0, OFF), rng.uniform(0.0, math.tau)
        north, east, ahead = off * math.cos(at), off * math.sin(at), _fast_at(rng)
        strength, unit = (pull / AT, "N/m") if elastic else (pull, "N")
        name = "stiffness" if elastic else "force"
        external = {
            name: strength, "length": length, "north": north, "east": east, "line_at": ahead
        }  # fmt: skip
        return {"external": external}, _reported(
            **{name: (strength, unit)}, north=(north, "m"), east=(east, "m"), length=(length, "m"),
            position=(ahead, "m"),
        )  # fmt: skip

    return draw


def _tow(rng: np.random.Generator, size: float) -> Drawn:
    force, towards = rng.uniform(*TOW) * size, rng.uniform(0.0, math.tau)
    turn, ahead = _either(rng) * rng.uniform(*TURN), _fast_at(rng)
    external = {"tow": force, "towards": towards, "turning": turn, "tow_at": ahead}
    return {"external": external}, _reported(
        force=(force, "N"), direction=(math.degrees(towards), "deg"),
        turn=(math.degrees(turn), "deg"), position=(ahead, "m"),
    )  # fmt: skip


def _contact(rng: np.random.Generator, size: float) -> Drawn:
    force, reach = rng.uniform(*FENDER) * size, float(rng.uniform(*REACH))
    return {"external": {"fender": force, "reach": reach}}, _reported(
        force=(force, "N"), reach=(reach, "m")
    )


DEVICES: dict[str, Draw] = {
    "actuator_limit:steering": _limit("rudder"),
    "line:elastic": _line(True),
    "actuator_rate:drive": _rate("propeller"),
    "actuator_dead_band:steering": _dead_band("rudder"),
    "actuator_stuck:drive": _stuck("propeller"),
    "tow:turning": _tow,
    "actuator_coupling": _coupling,
    "actuator_limit:drive": _limit("propeller"),
    "actuator_rate:steering": _rate("rudder"),
    "line:constant": _line(False),
    "actuator_dead_band:drive": _dead_band("propeller"),
    "actuator_stuck:steering": _stuck("rudder"),
    "contact": _contact,
}
