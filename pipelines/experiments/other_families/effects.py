"""What can be hidden in a trial, and how large it is where it is realistic.

Sizes are in units of the ship: U its harbour speed, L its length, L/U its time, m U²/L its force.
Each range names where it comes from; "equipment" means what yards and users report of it, without
one source. The middles of the ranges are not the priors of
`shiplog.models.causes`, and a test says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pipelines.experiments.other_families.gear import Fault
from pipelines.experiments.other_families.lines import Contact, Line, Tow
from pipelines.experiments.other_families.ship import Ship
from pipelines.experiments.other_families.water import DEEPEST, growth


@dataclass(frozen=True, slots=True)
class Effects:
    """All zero is nothing. Instruments: measured minus true, or measured over true less one."""

    current_north: float = 0.0  # m/s
    current_east: float = 0.0
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)  # shares added to surge, sway, yaw
    keel: float = 0.0  # h/T - 1 on top of a slope; 0 is deep water everywhere
    slope_half: float = 1.0  # m
    slope_north: float = 0.0  # m, the middle of the slope
    slope_east: float = 0.0
    slope_towards: float = 0.0  # rad, where it becomes shallow
    bank: float = 0.0  # of ½ρLT u²
    bank_reach: float = 1.0  # m
    fouling: float = 0.0  # share of the resistance
    cross_flow_drag: float = 0.0
    payload: float = 0.0  # kg
    payload_ahead: float = 0.0  # m
    thrust_loss: float = 0.0  # share lost by every unit
    unit: int = -1  # that has lost `unit_loss` alone
    unit_loss: float = 0.0
    thrust_drift: float = 0.0  # share added along the campaign
    rudder_force: float = 0.0
    rudder_offset: tuple[float, float] = (0.0, 0.0)  # rad, units to port, and all others
    rudder_lag: float = 0.0  # s
    rudder_delay: float = 0.0  # s
    side_thrust: float = 0.0  # N, the strongest pulse
    device_at: float = 0.0  # m ahead of midship
    # outside the catalogue
    tether: float = 0.0  # N
    tether_north: float = 0.0
    tether_east: float = 0.0
    tow_north: float = 0.0  # N, at the end of the campaign
    tow_east: float = 0.0
    aside: float = 0.0  # share of each screw's thrust that pushes to starboard
    rudder_limit: float = 0.0  # rad
    couple: float = 0.0  # share of one unit's revolutions that another one turns as well
    couple_from: int = 0
    couple_to: int = 0
    louder: float = 1.0  # process noise over that of an ordinary day
    # units that do not do as recorded, lines, tows and fenders: `devices` draws them
    gear: tuple[Fault, ...] = ()
    exchanged: tuple[int, int] | None = None  # two units, each recorded as the other one
    line: Line | None = None
    slow_tow: Tow | None = None
    contact: Contact | None = None
    feedback: tuple[int, float] | None = None  # unit, and its feedback minus what it does [rad]
    # instruments
    heading_offset: float = 0.0  # rad
    yaw_rate_bias: float = 0.0  # rad/s
    yaw_rate_scale: float = 0.0
    antenna_offset: tuple[float, float] = (0.0, 0.0)  # m
    wind_direction_offset: float = 0.0  # rad
    wind_speed_scale: float = 0.0
    clock_offset: Mapping[str, float] = field(default_factory=dict)  # s late, by channel


Parameters = dict[str, dict[str, Any]]
Drawn = tuple[dict[str, Any], Parameters]  # fields of `Effects`, and what the key says
Draw = Callable[[np.random.Generator, float, Ship], Drawn]


@dataclass(frozen=True, slots=True)
class Range:
    """Realistic sizes of one number, at size 1."""

    low: float
    high: float
    unit: str  # SI, 1, or one of the ship's: U, L, m, r (= U/L)
    source: str

    @property
    def middle(self) -> float:
        return 0.5 * (self.low + self.high)

    def draw(self, rng: np.random.Generator, size: float) -> float:
        return float(rng.uniform(self.low, self.high) * size)


RANGES: dict[str, Range] = {
    "current": Range(0.06, 0.34, "U", "typical: 0.1 to 0.5 m/s in tidal basins, at 1.5 m/s"),
    "wind_force": Range(0.20, 0.50, "1", "scatter of wind-tunnel coefficients (Blendermann 1994)"),
    "keel": Range(0.30, 0.80, "1", "typical clearance under the keel in harbours"),
    "bank": Range(0.04, 0.12, "1", "close banks (Ch'ng, Doctors & Renilson 1993)"),
    "fouling": Range(0.11, 0.86, "1", "slime to heavy calcareous fouling (Schultz 2007, table 7)"),
    "payload": Range(0.06, 0.20, "m", "equipment: fuel, ballast, crew and cargo of a day"),
    "cross_flow_drag": Range(0.16, 0.46, "1", "scatter of C_D of sections (Faltinsen 1990)"),
    "thrust_loss": Range(0.10, 0.38, "1", "Coanda, inflow, wear (Minsaas & Lehn 1978)"),
    "unit_loss": Range(0.25, 0.60, "1", "equipment: a damaged blade, weed, a slipping belt"),
    "thrust_drift": Range(0.15, 0.35, "1", "equipment: a battery that runs down, growth on blades"),
    "rudder_force": Range(0.10, 0.30, "1", "scatter of lift slopes (Molland & Turnock 2007)"),
    "rudder_offset": Range(2.0, 6.5, "deg", "equipment: misaligned feedback"),
    "rudder_lag": Range(0.12, 0.45, "L/U", "SOLAS II-1/29 allows 28 s from side to side"),
    "rudder_delay": Range(0.08, 0.26, "L/U", "equipment: hydraulic dead time, network"),
    "side_thrust": Range(0.15, 0.40, "F", "equipment: a small tunnel thruster"),
    "heading_offset": Range(1.0, 5.0, "deg", "equipment: gyros and GNSS compasses mounted by eye"),
    "yaw_rate_bias": Range(0.012, 0.05, "r", "equipment: MEMS gyros, 0.01 to 1 deg/s"),
    "yaw_rate_scale": Range(0.02, 0.085, "1", "equipment: MEMS gyros"),
    "clock_offset": Range(0.05, 0.18, "L/U", "equipment: NMEA latency of 0.2 to 2 s"),
    "antenna_ahead": Range(0.08, 0.32, "L", "equipment: another mast than the drawing's"),
    "antenna_aside": Range(0.03, 0.15, "L", "equipment"),
    "wind_direction_offset": Range(6.0, 20.0, "deg", "equipment: a vane set by eye"),
    "wind_speed_scale": Range(0.10, 0.28, "1", "flow about masts (Moat, Yelland & Molland 2006)"),
    "tether": Range(0.05, 0.14, "F", "a line to a buoy"),
    "tow": Range(0.08, 0.22, "F", "a tow that grows to this"),
    "aside": Range(0.06, 0.15, "1", "paddle-wheel effect (Brix 1993)"),
    "couple": Range(0.15, 0.35, "1", "equipment: two drives on one bus"),
    "rudder_limit": Range(9.0, 16.0, "deg", "equipment: a stop, or a jammed linkage"),
    "louder": Range(4.0, 9.0, "1", "a windy day over a calm one"),
}
QUICKEST, SLOWEST = 3.0, 25.0  # s: clocks and steering gear do not scale with the ship beyond


def _unit(ship: Ship, unit: str) -> float:
    gear = min(max(ship.time_unit, QUICKEST), SLOWEST)
    return {
        "U": ship.speed, "L": ship.length, "m": ship.body.mass, "F": ship.force_unit,
        "r": ship.speed / ship.length, "L/U": gear,
    }.get(unit, 1.0)  # fmt: skip


def _size(rng: np.random.Generator, size: float, ship: Ship, name: str) -> float:
    return RANGES[name].draw(rng, size) * _unit(ship, RANGES[name].unit)


def _reported(**parameters: tuple[Any, str]) -> Parameters:
    return {name: {"value": value, "unit": unit} for name, (value, unit) in parameters.items()}


def _either(rng: np.random.Generator) -> float:
    return float(rng.choice((-1.0, 1.0)))


def _bearing(rng: np.random.Generator) -> float:
    return float(rng.uniform(0.0, 2.0 * math.pi))


def _share(name: str, parameter: str, sign: float = 0.0) -> Draw:
    """A share added; the key says the new over the old. `sign` 0 is either way."""

    def draw(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
        share = (sign or _either(rng)) * _size(rng, size, ship, name)
        return {name: share}, _reported(**{parameter: (1.0 + share, "1")})

    return draw


def _angle(name: str) -> Draw:
    def draw(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
        degrees = _either(rng) * _size(rng, size, ship, name)
        return {name: math.radians(degrees)}, _reported(angle=(degrees, "deg"))

    return draw


def _time(name: str) -> Draw:
    def draw(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
        seconds = _size(rng, size, ship, name)
        return {name: seconds}, _reported(time=(seconds, "s"))

    return draw


def _current(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    speed, towards = _size(rng, size, ship, "current"), _bearing(rng)
    changes = {
        "current_north": speed * math.cos(towards), "current_east": speed * math.sin(towards)
    }  # fmt: skip
    return changes, _reported(speed=(speed, "m/s"), direction=(math.degrees(towards), "deg"))


def _wind_force(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    sign = _either(rng)
    shares = tuple(s * _size(rng, size, ship, "wind_force") for s in (sign, sign, _either(rng)))
    names = ("surge_factor", "sway_factor", "yaw_factor")
    return {"wind": shares}, _reported(
        **{name: (1.0 + share, "1") for name, share in zip(names, shares, strict=True)}
    )


def _shallow_water(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    """A slope through the basin. Size 0.5 leaves twice the water under the keel."""
    keel = min(RANGES["keel"].draw(rng, 1.0) / size, DEEPEST - 1.5)
    half, towards = rng.uniform(0.25, 0.7) * ship.radius, _bearing(rng)
    north, east = rng.uniform(-0.25, 0.25, 2) * ship.radius
    grown = np.empty(6)
    growth(keel, ship.body.breadth / ship.body.draught, grown)
    changes = {
        "keel": keel, "slope_half": half, "slope_north": north, "slope_east": east,
        "slope_towards": towards,
    }  # fmt: skip
    return changes, _reported(
        strength=(float(grown[1]) - 1.0, "1"), length=(half, "m"), keel_clearance=(keel, "T"),
        slope_towards=(math.degrees(towards), "deg"),
    )  # fmt: skip


def _bank(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    strength, reach = _size(rng, size, ship, "bank"), rng.uniform(0.8, 2.0) * ship.length
    return {"bank": strength, "bank_reach": reach}, _reported(
        strength=(strength, "1"), length=(reach, "m")
    )


def _payload(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    mass, ahead = _size(rng, size, ship, "payload"), rng.uniform(-0.33, 0.33) * ship.length
    return {"payload": mass, "payload_ahead": ahead}, _reported(
        mass=(mass, "kg"), position=(ahead, "m")
    )


def _thrust_loss(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    lost = _size(rng, size, ship, "thrust_loss")
    return {"thrust_loss": lost}, _reported(factor=(1.0 - lost, "1"))


def _unit_loss(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    unit, lost = int(rng.integers(len(ship.drives))), _size(rng, size, ship, "unit_loss")
    return {"unit": unit, "unit_loss": lost}, _reported(
        factor=(1.0 - lost, "1"), unit=(ship.drives[unit], "")
    )


def _thrust_drift(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    slope = -_size(rng, size, ship, "thrust_drift")
    return {"thrust_drift": slope}, _reported(slope=(slope, "1"))


def _rudder_offset(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    """One angle where all stand on the centreline; else port, starboard or both."""
    two = [_either(rng) * _size(rng, size, ship, "rudder_offset") for _ in range(2)]
    which = int(rng.integers(3))
    if not any(ship.actuators[i].position[1] for i in ship.steering):
        radians = math.radians(two[1])
        return {"rudder_offset": (radians, radians)}, _reported(angle=(two[1], "deg"))
    port, starboard = (0.0 if which == 1 - side else two[side] for side in range(2))
    return {"rudder_offset": (math.radians(port), math.radians(starboard))}, _reported(
        port=(port, "deg"), starboard=(starboard, "deg")
    )


def _side_thrust(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    force, at = _size(rng, size, ship, "side_thrust"), rng.uniform(0.25, 0.45) * ship.length
    at *= _either(rng)
    return {"side_thrust": force, "device_at": at}, _reported(
        force=(force, "N"), position=(at, "m")
    )


def _yaw_rate_bias(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    value = _either(rng) * _size(rng, size, ship, "yaw_rate_bias")
    return {"yaw_rate_bias": value}, _reported(value=(math.degrees(value), "deg/s"))


def _clock_offset(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    channels = ("position", "velocity", "gnss", "yaw_rate", *(("wind",) if ship.winds else ()))
    channel, late = str(rng.choice(channels)), _size(rng, size, ship, "clock_offset")
    return {"clock_offset": {channel: late}}, _reported(time=(late, "s"), channel=(channel, ""))


def _antenna_offset(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    ahead = _either(rng) * _size(rng, size, ship, "antenna_ahead")
    aside = _either(rng) * _size(rng, size, ship, "antenna_aside")
    return {"antenna_offset": (ahead, aside)}, _reported(x=(ahead, "m"), y=(aside, "m"))


def _tether(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    pull, off, at = _size(rng, size, ship, "tether"), rng.uniform(0.0, 0.5), _bearing(rng)
    north, east = (off * ship.radius * part for part in (math.cos(at), math.sin(at)))
    return {"tether": pull, "tether_north": north, "tether_east": east}, _reported(
        force=(pull, "N"), north=(north, "m"), east=(east, "m")
    )


def _tow(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    pull, at = _size(rng, size, ship, "tow"), _bearing(rng)
    return {"tow_north": pull * math.cos(at), "tow_east": pull * math.sin(at)}, _reported(
        force=(pull, "N"), direction=(math.degrees(at), "deg")
    )


def _aside(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    share = _either(rng) * _size(rng, size, ship, "aside")
    return {"aside": share}, _reported(share_of_thrust=(share, "1"))


def _couple(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    columns = [i for i, a in enumerate(ship.actuators) if a.drive is not None]
    one, other = (int(i) for i in rng.choice(columns, 2, replace=False))
    share = _either(rng) * _size(rng, size, ship, "couple")
    names = (ship.actuators[one].name, ship.actuators[other].name)
    return {"couple": share, "couple_from": one, "couple_to": other}, _reported(
        share=(share, "1"), of=(names[0], ""), on=(names[1], "")
    )


def _rudder_limit(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    """At full size 9 to 16 deg, at none the stops of the rudders themselves."""
    most = math.degrees(ship.actuators[ship.rudders[0]].high)
    degrees = most - (most - RANGES["rudder_limit"].draw(rng, 1.0)) * size
    return {"rudder_limit": math.radians(degrees)}, _reported(angle=(degrees, "deg"))


def _louder(rng: np.random.Generator, size: float, ship: Ship) -> Drawn:
    factor = 1.0 + (RANGES["louder"].draw(rng, 1.0) - 1.0) * size
    return {"louder": factor}, _reported(factor=(factor, "1"))


CATALOGUE: dict[str, Draw] = {  # the contract's names; "thrust_loss:unit" is told as thrust_loss
    "current": _current,
    "wind_force": _wind_force,
    "shallow_water": _shallow_water,
    "bank": _bank,
    "fouling": _share("fouling", "factor", 1.0),
    "payload": _payload,
    "cross_flow_drag": _share("cross_flow_drag", "factor"),
    "thrust_loss": _thrust_loss,
    "thrust_loss:unit": _unit_loss,
    "thrust_drift": _thrust_drift,
    "rudder_force": _share("rudder_force", "factor"),
    "rudder_offset": _rudder_offset,
    "rudder_lag": _time("rudder_lag"),
    "rudder_delay": _time("rudder_delay"),
    "side_thrust": _side_thrust,
    "heading_offset": _angle("heading_offset"),
    "yaw_rate_bias": _yaw_rate_bias,
    "yaw_rate_scale": _share("yaw_rate_scale", "value"),
    "clock_offset": _clock_offset,
    "antenna_offset": _antenna_offset,
    "wind_direction_offset": _angle("wind_direction_offset"),
    "wind_speed_scale": _share("wind_speed_scale", "value"),
}
OUTSIDE: dict[str, tuple[str, Draw]] = {  # no cause has these names; the family is the answer
    "tether": ("position", _tether),
    "propeller_side_force": ("controls", _aside),
    "rudder_limit": ("controls", _rudder_limit),
    "cross_coupling": ("controls", _couple),
    "turbulence": ("stochastic", _louder),
    "tow": ("time", _tow),
}


def offered(ship: Ship) -> tuple[str, ...]:
    """What can be hidden in this ship: it has the actuator, the sensor, or the force."""
    public = ship.own_motion is not None  # a package whose equations are not ours to change
    # a unit that turns as a whole, and pushes aside as well, is one whose angle is off: a cause
    turned = bool(ship.steering) and not ship.rudders
    has = {
        "wind_force": ship.winds, "wind_direction_offset": ship.winds,
        "wind_speed_scale": ship.winds, "shallow_water": not public, "bank": not public,
        "cross_flow_drag": ship.cross_flow and not public,
        "thrust_loss:unit": len(ship.drives) > 1, "rudder_force": bool(ship.rudders),
        "rudder_offset": bool(ship.steering), "rudder_lag": bool(ship.steering),
        "rudder_delay": bool(ship.steering), "propeller_side_force": not public and not turned,
        "rudder_limit": bool(ship.rudders), "cross_coupling": len(ship.drives) > 1,
    }  # fmt: skip
    return tuple(name for name in (*CATALOGUE, *OUTSIDE) if has.get(name, True))
