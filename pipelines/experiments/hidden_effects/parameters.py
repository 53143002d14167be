"""How far the parameters of a named cause are from what was hidden, and whether its intervals
contain that. Names and units are the contract's, section 6."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Values = Mapping[str, Any]  # name → {"value", "unit"} and, as reported, "low" and "high"

ACTUATORS = (  # units that do not do as recorded
    "actuator_limit", "actuator_rate", "actuator_dead_band", "actuator_stuck",
    "actuator_coupling", "actuators_exchanged",
)  # fmt: skip
LINES = ("line", "tow", "contact")  # forces from outside, to a point, along a bearing, off a wall
NAMES = (  # the contract's, section 6
    "current", "wind_force", "shallow_water", "bank",
    "fouling", "payload", "cross_flow_drag", "thrust_loss", "thrust_drift",
    "rudder_force", "rudder_offset", "rudder_lag", "rudder_delay", "side_thrust",
    "heading_offset", "yaw_rate_bias", "yaw_rate_scale", "clock_offset", "antenna_offset",
    "wind_direction_offset", "wind_speed_scale", *ACTUATORS, *LINES,
)  # fmt: skip
# What older blocks hid as outside the catalogue, and a cause names since: either answer is right.
NAMED_SINCE = {
    "rudder_limit": "actuator_limit", "cross_coupling": "actuator_coupling", "tether": "line",
    "tow": "tow",
}  # fmt: skip
Z_90 = 1.6448536269514722  # of a Gaussian, 90 % lie within so many standard deviations
PRECISE = (  # median error within 3 %; of the others within 10 %
    "current", "heading_offset", "antenna_offset", "rudder_offset", "rudder_lag", "rudder_delay",
    "clock_offset",
)  # fmt: skip
# Listed, and in no goal: simulator and diagnosis have no number in common that could be compared.
# The shoal of a blind case is a ridge, a slope or a plateau on which each force grows by a share
# and a power drawn for that ship; here it is a map of bumps with fixed shares. Suction, fading,
# speed and lever of its bank are drawn, and fixed here. A thruster pulses there and one figure
# cannot say so. (The sample logs share shares and constants with the catalogue; none hides these.)
# A fender's force there falls off with the gap and is one number of a form that nobody here knows.
OTHER_FORM = ("shallow_water", "bank", "side_thrust", "contact")
FACTORS = (  # new over old: 1 is none, and the error is a share of what was added
    "wind_force", "fouling", "cross_flow_drag", "thrust_loss", "rudder_force", "yaw_rate_scale",
    "wind_speed_scale",
)  # fmt: skip
BEARINGS = ("heading_offset", "wind_direction_offset")
SURVIVE = (  # what a network that was trained on the affected voyages cannot absorb
    "current", "rudder_delay", "clock_offset", "yaw_rate_bias", "thrust_drift", "shallow_water",
    "rudder_lag", "yaw_rate_scale", "bank",
)  # fmt: skip
ABSORBED = (
    "thrust_loss", "wind_force", "payload", "fouling", "wind_speed_scale", "cross_flow_drag",
)  # fmt: skip
CLOCKS = {"gnss": ("position", "velocity")}  # one clock for both; any other channel has its own


@dataclass(frozen=True, slots=True)
class Comparison:
    """How a named cause's numbers compare with the key.

    error      0.02 is 2 %; None where there is nothing to compare
    covered    for each 90 % interval, whether it holds the truth
    standings  for each interval, (truth - value) in standard deviations of a Gaussian on the
               truth's side; infinite where the interval is of another channel
    """

    error: float | None
    covered: tuple[bool, ...]
    standings: tuple[float, ...] = ()


PLACES = {"x0": "north", "y0": "east"}


def compare(name: str, truth: Values, reported: Values) -> Comparison:
    """The error is that of the vector: |reported - true| over |true - none|. What a key says in
    words, such as which unit has lost thrust, is no number and is left out."""
    if name == "line":  # the program's axes are x0 and y0
        reported = {PLACES.get(parameter, parameter): v for parameter, v in reported.items()}
    unit = name in ("thrust_loss", *ACTUATORS)
    apart = unit and elsewhere(name, truth, (reported,))
    truth = {p: v for p, v in truth.items() if p == "channel" or _is_number(v["value"])}
    if not any(parameter in reported for parameter in truth):
        return Comparison(None, ())
    if name in OTHER_FORM:  # only what both of them have
        truth = {parameter: value for parameter, value in truth.items() if parameter in reported}
    none = 1.0 if name in FACTORS else 0.0
    away, size = VECTORS.get(name, _plain)(truth, reported, none)
    intervals = list(_intervals(name, truth, reported))
    if apart:
        return Comparison(1.0, (False,) * len(intervals), (math.inf,) * len(intervals))
    return Comparison(
        away / size if size > 0.0 else None,
        tuple(within for within, _ in intervals),
        tuple(standing for _, standing in intervals),
    )


def elsewhere(name: str, truth: Values, reported: Sequence[Values]) -> bool:
    """Whether a cause is named of another thruster, or of other clocks, than it is hidden in. What
    key or verdict does not say is not held against it."""
    if name == "thrust_loss":
        unit = _value(truth, "unit", None)  # of several thrusters the one that has lost thrust
        return unit is not None and any(_value(one, "actuator", unit) != unit for one in reported)
    if name in ACTUATORS:  # exchanged units may be named in either order
        units = _units(truth)
        return bool(units) and any(found and found != units for found in map(_units, reported))
    if name == "clock_offset" and _value(truth, "channel", None):
        found = {channel for one in reported for channel in _channels(one, truth)}
        return found != set(_channels(truth, truth))
    return False


def _units(parameters: Values) -> frozenset[str]:
    """The actuators that are at fault; of a coupling, the one that follows."""
    named = (_value(parameters, label, None) for label in ("actuator", "other"))
    return frozenset(str(name) for name in named if name is not None)


def _plain(truth: Values, reported: Values, none: float) -> tuple[float, float]:
    """A parameter that is not reported is one that is not there."""
    true = [(parameter, float(_value(truth, parameter, none))) for parameter in truth]
    away = math.hypot(*(float(_value(reported, p, none)) - v for p, v in true))
    return away, math.hypot(*(v - none for _, v in true))


def _current(truth: Values, reported: Values, none: float) -> tuple[float, float]:
    true, found = (
        _turned(_value(p, "speed", 0.0), _value(p, "direction", 0.0)) for p in (truth, reported)
    )
    return abs(found - true), abs(true)


def _turned(length: float, degrees: float) -> complex:
    return length * complex(math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))


def _bearing(truth: Values, reported: Values, none: float) -> tuple[float, float]:
    true = _value(truth, "angle", 0.0)
    return abs(_wrapped(_value(reported, "angle", 0.0) - true)), abs(_wrapped(true))


def _wrapped(degrees: float) -> float:
    return (degrees + 180.0) % 360.0 - 180.0


def _payload(truth: Values, reported: Values, none: float) -> tuple[float, float]:
    """kg and kg m over a lever of 1 m, the largest there is: next to 30 kg, 1 m would not count."""
    (mass, moment), (found, turning) = (
        (m, m * _value(p, "position", 0.0))
        for p in (truth, reported)
        for m in [_value(p, "mass", 0.0)]
    )
    return math.hypot(found - mass, turning - moment), math.hypot(mass, moment)


def _pull(truth: Values, reported: Values, none: float) -> tuple[float, float]:
    """A force and where it pulls at the start."""
    true, found = (
        _turned(_value(p, "force", 0.0), _value(p, "direction", 0.0)) for p in (truth, reported)
    )
    return abs(found - true), abs(true)


def _place(truth: Values, reported: Values, none: float) -> tuple[float, float]:
    """m, of the point that a line leads to, over how far it is with the line's own length."""
    true, found = (
        complex(_value(p, "north", 0.0), _value(p, "east", 0.0)) for p in (truth, reported)
    )
    return abs(found - true), abs(true) + float(_value(truth, "length", 0.0))


def _first(truth: Values, reported: Values, none: float) -> tuple[float, float]:
    """Where a unit is stuck; from when to when is in other units."""
    true = float(_value(truth, "value", 0.0))
    return abs(float(_value(reported, "value", 0.0)) - true), abs(true)


def _clock(truth: Values, reported: Values, none: float) -> tuple[float, float]:
    """One number a channel: the right time on the wrong channel is wrong."""
    true, found = _late(truth, truth), _late(reported, truth)
    away = [found.get(c, 0.0) - true.get(c, 0.0) for c in true.keys() | found.keys()]
    return math.hypot(*away), math.hypot(*true.values())


def _late(parameters: Values, otherwise: Values) -> dict[str, float]:
    return dict.fromkeys(_channels(parameters, otherwise), float(_value(parameters, "time", 0.0)))


def _channels(parameters: Values, otherwise: Values) -> tuple[str, ...]:
    channel = _value(parameters, "channel", _value(otherwise, "channel", ""))
    return CLOCKS.get(channel, (channel,))


VECTORS: dict[str, Callable[[Values, Values, float], tuple[float, float]]] = {
    "current": _current, "payload": _payload, "clock_offset": _clock, "line": _place,
    "tow": _pull, "actuator_stuck": _first,
    **dict.fromkeys(BEARINGS, _bearing),
}  # fmt: skip


def _intervals(name: str, truth: Values, reported: Values) -> Iterator[tuple[bool, float]]:
    """For every parameter of the key that is reported with an interval: whether the truth lies
    within, and where it stands."""
    for parameter, one in truth.items():
        interval = reported.get(parameter)
        if not isinstance(interval, Mapping) or parameter == "channel":
            continue
        low, high, true = interval.get("low"), interval.get("high"), one["value"]
        if low is None or high is None:
            continue
        value = _value(reported, parameter, 0.5 * (low + high))
        # 359 to 361 deg contains 0, 360 and 1
        above = (true - low) % 360.0 if one["unit"] == "deg" else true - low
        within = 0.0 <= above <= high - low
        away = _wrapped(true - value) if one["unit"] == "deg" else true - value
        standing = _standing(away, value - low, high - value)
        if name == "clock_offset" and _channels(reported, truth) != _channels(truth, truth):
            within, standing = False, math.inf
        yield bool(within), standing


def _standing(away: float, below: float, above: float) -> float:
    """`away` in standard deviations: a 90 % interval is 1.645 of them on each side, and its two
    sides may differ."""
    width = above if away > 0.0 else below
    if width <= 0.0:
        return math.copysign(math.inf, away) if away else 0.0
    return Z_90 * away / width


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float)


def _value(parameters: Values, name: str, otherwise: Any) -> Any:
    """The value, wrapped or bare, of one that may be missing or null."""
    found = parameters.get(name)
    found = found.get("value") if isinstance(found, Mapping) else found
    return otherwise if found is None else found
