"""Blind cases: a sister ship, a campaign of it as it is, and one with something hidden in it.

All of a case follows from its seed. What is hidden is drawn apart from ship, laws, weather, helm
and noise: the same seed with another cause is the same campaign with it. Only the key, which lies
elsewhere, says which. The laws of water, air and shore are the seed's own: their numbers are
drawn, and some of their forms too. A bank may fade by a power of its distance, as the catalogue's.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.experiments.simulated_ship import laws
from pipelines.experiments.simulated_ship.devices import DEVICES
from pipelines.experiments.simulated_ship.gear import merged
from pipelines.experiments.simulated_ship.laws import Laws
from pipelines.experiments.simulated_ship.sensors import write_voyage
from pipelines.experiments.simulated_ship.ship import Effects, Ship, varied
from pipelines.experiments.simulated_ship.voyage import Voyage, sail
from pipelines.experiments.simulated_ship.weather import Wind

DURATIONS = {  # s, of the trial; the last, one to fit and one to hold out
    7000: (500.5, 1801.8, 500.5, 1801.8, 1201.2, 1201.2),  # the paper's
    3000: (500.5, 900.9, 700.7, 900.9),
    500: (250.0, 250.0),
}
NOMINAL = {7000: 7000, 3000: 3000, 500: 7000}  # s of a trial → of the nominal campaign
SHARES = {"none": 0.2, "one": 0.6, "two": 0.1, "outside": 0.1}
SMALLEST = 0.1  # of the realistic size
NOMINAL_DAY, TRIAL_DAY = (datetime(2025, *day, 1, 0, tzinfo=UTC) for day in ((6, 3), (11, 11)))

Parameters = dict[str, dict[str, Any]]  # name -> value and unit
Drawn = tuple[dict[str, Any], Parameters]  # fields of `Effects`, and what the key says of them
Draw = Callable[[np.random.Generator, float], Drawn]


# --- what can be hidden: each at its realistic size, times `size` ---------------------------------


def _reported(**parameters: tuple[Any, str]) -> Parameters:
    return {name: {"value": value, "unit": unit} for name, (value, unit) in parameters.items()}


def _either(rng: np.random.Generator) -> float:
    return float(rng.choice((-1.0, 1.0)))


def _within(rng: np.random.Generator, low: float, high: float) -> float:
    """A realistic size, its inverse uniform: small faults are commoner than large ones, and half of
    the draws do not lie below the catalogue's prior."""
    return 1.0 / rng.uniform(1.0 / high, 1.0 / low)


def _share(
    name: str, low: float, high: float, parameter: str, signs: tuple[float, ...] = (1.0,)
) -> Draw:
    """A share added to something; the key gives the new over the old, 1.3 for 30 % more."""

    def draw(rng: np.random.Generator, size: float) -> Drawn:
        share = float(rng.choice(signs)) * _within(rng, low, high) * size
        factor = 1.0 - share if name == "thrust_loss" else 1.0 + share
        return {name: share}, _reported(**{parameter: (factor, "1")})

    return draw


def _angle(name: str, low: float, high: float, parameter: str = "angle", unit: str = "deg") -> Draw:
    """An angle, or its rate, of either sign."""

    def draw(rng: np.random.Generator, size: float) -> Drawn:
        degrees = _either(rng) * _within(rng, low, high) * size
        return {name: math.radians(degrees)}, _reported(**{parameter: (degrees, unit)})

    return draw


def _time(name: str, low: float, high: float) -> Draw:
    def draw(rng: np.random.Generator, size: float) -> Drawn:
        seconds = _within(rng, low, high) * size
        return {name: seconds}, _reported(time=(seconds, "s"))

    return draw


def _current(rng: np.random.Generator, size: float) -> Drawn:
    speed, towards = _within(rng, 0.05, 0.18) * size, rng.uniform(0.0, 2.0 * np.pi)
    changes = {
        "current_north": speed * math.cos(towards),
        "current_east": speed * math.sin(towards),
    }
    return changes, _reported(speed=(speed, "m/s"), direction=(math.degrees(towards), "deg"))


def _wind_force(rng: np.random.Generator, size: float) -> Drawn:
    """More or less windage: surge and sway go together, the lever of yaw on its own."""
    sign = _either(rng)
    signs = (sign, sign, _either(rng))
    force = tuple(s * _within(rng, 0.25, 0.50) * size for s in signs)
    names = ("surge_factor", "sway_factor", "yaw_factor")
    reported = {name: (1.0 + share, "1") for name, share in zip(names, force, strict=True)}
    return {"wind_force": force}, _reported(**reported)


def _shallow_water(rng: np.random.Generator, size: float) -> Drawn:
    """A shoal whose line runs some way through the part of the pond that it uses."""
    strength, length = _within(rng, 0.5, 1.2) * size, rng.uniform(4.0, 10.0)
    off, at, towards = rng.uniform((0.0, -np.pi, -np.pi), (15.0, np.pi, np.pi))
    north, east = off * math.cos(at), off * math.sin(at)
    changes = {
        "shallow_water": strength, "shoal_length": length, "shoal_north": north,
        "shoal_east": east, "shoal_towards": towards,
    }  # fmt: skip
    return changes, _reported(
        strength=(strength, "1"), length=(length, "m"), crest_north=(north, "m"),
        crest_east=(east, "m"), crest_towards=(math.degrees(towards), "deg"),
    )  # fmt: skip


def _bank(rng: np.random.Generator, size: float) -> Drawn:
    strength, length = _within(rng, 0.8, 1.6) * size, rng.uniform(7.0, 13.0)
    changes = {"bank": strength, "bank_length": length}
    return changes, _reported(strength=(strength, "1"), length=(length, "m"))


def _payload(rng: np.random.Generator, size: float) -> Drawn:
    mass, ahead = _within(rng, 20.0, 55.0) * size, rng.uniform(-1.0, 1.0)
    return {"payload": mass, "payload_ahead": ahead}, _reported(
        mass=(mass, "kg"), position=(ahead, "m")
    )


def _rudder_offset(rng: np.random.Generator, size: float) -> Drawn:
    """Port, starboard or both."""
    degrees = [_either(rng) * _within(rng, 3.0, 8.0) * size for _ in range(2)]
    which = rng.integers(3)  # 0: port alone, 1: starboard alone
    port, starboard = (0.0 if which == 1 - side else degrees[side] for side in range(2))
    changes = {
        "rudder_offset_port": math.radians(port),
        "rudder_offset_starboard": math.radians(starboard),
    }
    return changes, _reported(port=(port, "deg"), starboard=(starboard, "deg"))


def _side_thrust(rng: np.random.Generator, size: float) -> Drawn:
    return {"side_thrust": 4.0 * size}, _reported(force=(4.0 * size, "N"))  # pulses 1.5 to 4 N


def _thrust_drift(rng: np.random.Generator, size: float) -> Drawn:
    slope = -_within(rng, 0.12, 0.35) * size
    return {"thrust_drift": slope}, _reported(slope=(slope, "1"))


def _clock_offset(rng: np.random.Generator, size: float) -> Drawn:
    channel = str(rng.choice(("position", "velocity", "gnss", "yaw_rate", "wind")))
    late = _within(rng, 0.3, 1.5) * size
    return {"clock_offset": {channel: late}}, _reported(time=(late, "s"), channel=(channel, ""))


def _antenna_offset(rng: np.random.Generator, size: float) -> Drawn:
    ahead = _either(rng) * _within(rng, 0.3, 1.2) * size
    aside = _either(rng) * _within(rng, 0.05, 0.3) * size
    return {"antenna_offset": (ahead, aside)}, _reported(x=(ahead, "m"), y=(aside, "m"))


def _tether(rng: np.random.Generator, size: float) -> Drawn:
    pull, off, at = rng.uniform((0.6, 0.0, -np.pi), (2.0, 25.0, np.pi))
    north, east = off * math.cos(at), off * math.sin(at)
    changes = {"tether": pull * size, "tether_north": north, "tether_east": east}
    return changes, _reported(force=(pull * size, "N"), north=(north, "m"), east=(east, "m"))


def _propeller_side_force(rng: np.random.Generator, size: float) -> Drawn:
    share = _either(rng) * rng.uniform(0.05, 0.12) * size
    return {"propeller_side_force": share}, _reported(share_of_thrust=(share, "1"))


def _rudder_limit(rng: np.random.Generator, size: float) -> Drawn:
    """At full size 50 to 75 deg, at none the stops of the rudders themselves."""
    degrees = 105.0 - (105.0 - rng.uniform(50.0, 75.0)) * size
    return {"rudder_limit": math.radians(degrees)}, _reported(angle=(degrees, "deg"))


def _turbulence(rng: np.random.Generator, size: float) -> Drawn:
    factor = 1.0 + (rng.uniform(4.0, 9.0) - 1.0) * size
    return {"turbulence": factor}, _reported(factor=(factor, "1"))


_BOTH = (-1.0, 1.0)
CATALOGUE: dict[str, Draw] = {  # the contract's names; realistic sizes
    "current": _current,
    "wind_force": _wind_force,
    "shallow_water": _shallow_water,
    "bank": _bank,
    "fouling": _share("fouling", 0.25, 1.00, "factor"),
    "payload": _payload,
    "cross_flow_drag": _share("cross_flow_drag", 0.20, 0.45, "factor", _BOTH),
    "thrust_loss": _share("thrust_loss", 0.08, 0.30, "factor"),
    "thrust_drift": _thrust_drift,
    "rudder_force": _share("rudder_force", 0.10, 0.30, "factor", _BOTH),
    "rudder_offset": _rudder_offset,
    "rudder_lag": _time("rudder_lag", 1.2, 5.0),
    "rudder_delay": _time("rudder_delay", 0.6, 2.0),
    "side_thrust": _side_thrust,
    "heading_offset": _angle("heading_offset", 1.2, 6.0),
    "yaw_rate_bias": _angle("yaw_rate_bias", 0.1, 0.5, "value", "deg/s"),
    "yaw_rate_scale": _share("yaw_rate_scale", 0.03, 0.10, "value", _BOTH),
    "clock_offset": _clock_offset,
    "antenna_offset": _antenna_offset,
    "wind_direction_offset": _angle("wind_direction_offset", 8.0, 25.0),
    "wind_speed_scale": _share("wind_speed_scale", 0.15, 0.30, "value", _BOTH),
}
OUTSIDE: dict[str, tuple[str, Draw]] = {  # no cause has these names; the family is the answer
    "tether": ("position", _tether),
    "propeller_side_force": ("controls", _propeller_side_force),
    "rudder_limit": ("controls", _rudder_limit),
    "turbulence": ("stochastic", _turbulence),
}


# --- a case ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Cause:
    """One thing hidden, as the key names it."""

    name: str
    size: float  # 1 is realistic
    parameters: Mapping[str, Mapping[str, Any]]
    family: str | None = None  # of the structure left over, outside the catalogue only


@dataclass(frozen=True, slots=True)
class Leg:
    """One voyage of a campaign, and the log it becomes."""

    name: str
    seconds: float
    start: datetime
    wind: Wind
    seed: int
    campaign: tuple[float, float]  # which share of it


@dataclass(frozen=True, slots=True)
class Case:
    seed: int
    ship: Ship
    laws: Laws
    causes: tuple[Cause, ...]
    ordinary: Effects  # instrument and process noise of both campaigns
    effects: Effects  # the same, and what is hidden in the trial
    nominal: tuple[Leg, ...] = field(repr=False)
    trial: tuple[Leg, ...] = field(repr=False)

    @property
    def verdict(self) -> str:
        """What a diagnosis should say."""
        if not self.causes:
            return "none"
        return "unknown" if any(cause.family for cause in self.causes) else "named"


def _stream(seed: int, purpose: str) -> np.random.Generator:
    return np.random.default_rng([seed, *purpose.encode()])


def draw(
    seed: int, *, cause: str | None = None, size: float | None = None, seconds: int = 7000
) -> Case:
    """The case of this seed.

    cause    hide this instead: a name of `CATALOGUE` or `OUTSIDE`, two as "current+fouling",
             or "none"; ship, weather and noise stay those of the seed
    size     of all that is hidden; drawn log-uniformly from 0.1 to 1 unless given
    seconds  length of the trial, 7000, 3000 or 500; the nominal campaign is whole, but of as many
             seconds where it is 3000
    """
    if seconds not in DURATIONS:
        raise ValueError(f"seconds is {seconds}; a trial takes {' or '.join(map(str, DURATIONS))}.")
    names = _names(seed) if cause is None else [n for n in cause.split("+") if n != "none"]
    inside = CATALOGUE | DEVICES
    if unknown := [name for name in names if name not in inside and name not in OUTSIDE]:
        known = ", ".join(("none", *inside, *OUTSIDE))
        raise ValueError(f"No cause is called {unknown[0]!r}. There are: {known}.")
    if len(set(names)) < len(names):
        raise ValueError(f"{cause!r} hides the same thing twice.")

    rng = _stream(seed, "manners")
    ordinary = Effects(
        turbulence=1.0, coloured=rng.uniform(0.1, 0.8), clock_jitter=rng.uniform(0.0, 0.006)
    )
    effects, causes = ordinary, []
    for name in names:
        rng = _stream(seed, f"size of {name}")
        drawn = SMALLEST ** rng.uniform(0.0, 1.0)
        large = drawn if size is None else float(size)
        family, sized = (None, inside[name]) if name in inside else OUTSIDE[name]
        changes, parameters = sized(_stream(seed, name), large)
        changes = {k: merged(getattr(effects, k), value) for k, value in changes.items()}
        effects = replace(effects, **changes)
        causes.append(Cause(name.partition(":")[0], large, parameters, family))
    return Case(
        seed=seed, ship=replace(varied(seed), name=Ship().name),  # its name would tell the seed
        laws=laws.drawn(_stream(seed, "laws")),
        causes=tuple(causes), ordinary=ordinary, effects=effects,
        nominal=_legs(seed, "nominal", NOMINAL_DAY, DURATIONS[NOMINAL[seconds]]),
        trial=_legs(seed, "trial", TRIAL_DAY, DURATIONS[seconds]),
    )  # fmt: skip


def _names(seed: int) -> list[str]:
    rng = _stream(seed, "cause")
    kind = rng.choice(list(SHARES), p=list(SHARES.values()))
    names = tuple(OUTSIDE if kind == "outside" else CATALOGUE)
    count = {"none": 0, "two": 2}.get(kind, 1)
    return [names[i] for i in rng.choice(len(names), count, replace=False)]


def _legs(seed: int, campaign: str, day: datetime, durations: tuple[float, ...]) -> tuple[Leg, ...]:
    """Weather of its own for each; two voyages a day."""
    ends = np.cumsum((0.0, *durations)) / sum(durations)
    legs = []
    for number, seconds in enumerate(durations):
        name = f"{campaign}_{number + 1}"
        rng = _stream(seed, name)
        speed = rng.uniform(1.2, 3.6)
        wind = Wind(
            speed, rng.uniform(-np.pi, np.pi),
            speed_end=speed * rng.uniform(0.75, 1.3), turn=rng.uniform(-1.2, 1.2),
        )  # fmt: skip
        start = day + timedelta(days=number // 2, hours=3 * (number % 2))
        share = (float(ends[number]), float(ends[number + 1]))
        legs.append(Leg(name, seconds, start, wind, int(rng.integers(2**62)), share))
    return tuple(legs)


def voyage(case: Case, leg: Leg) -> Voyage:
    effects = case.effects if leg in case.trial else case.ordinary
    return sail(
        leg.seconds, seed=leg.seed, wind=leg.wind, ship=case.ship, effects=effects,
        laws=case.laws, campaign=leg.campaign,
    )  # fmt: skip


def write(case: Case, folder: str | Path, key: str | Path) -> None:
    """The logs into `folder`, what is hidden in them into the file `key`, elsewhere."""
    folder, key = Path(folder).resolve(), Path(key).resolve()
    if folder == key or folder in key.parents:
        raise ValueError(f"The key {key} would lie with the logs in {folder}: put it elsewhere.")
    legs = (*case.nominal, *case.trial)
    strange = {p.name for p in folder.glob("*.mcap")} - {f"{leg.name}.mcap" for leg in legs}
    if strange:
        raise FileExistsError(
            f"{folder} holds logs of something else: {', '.join(sorted(strange))}."
        )
    folder.mkdir(parents=True, exist_ok=True)
    key.parent.mkdir(parents=True, exist_ok=True)
    key.unlink(missing_ok=True)  # an old key must not stand next to half-new logs
    pulses = {}
    for leg in legs:
        sailed = voyage(case, leg)
        path = folder / f"{leg.name}.mcap"
        write_voyage(path, sailed, seed=leg.seed, start=leg.start)
        if sailed.effects.side_thrust > 0.0:
            pulses[leg.name] = sailed.pulses
    key.write_text(json.dumps(_told(case, folder, pulses), indent=2) + "\n", encoding="utf-8")


def _told(case: Case, folder: Path, pulses: dict) -> dict[str, Any]:
    """The key: the contract's names, values with units, and which logs it is about."""
    causes = []
    for cause in case.causes:
        parameters = dict(cause.parameters)
        if cause.name == "side_thrust":
            parameters["times"] = {"value": pulses, "unit": "s from the start, s, N"}
        causes.append({"name": cause.name, "size": cause.size, "parameters": parameters})
    families = [cause.family for cause in case.causes if cause.family]
    logs = {
        leg.name: hashlib.sha256((folder / f"{leg.name}.mcap").read_bytes()).hexdigest()
        for leg in (*case.nominal, *case.trial)
    }
    return {
        "contract": 1,
        "seed": case.seed,
        "verdict": case.verdict,
        "causes": causes,
        "structure": {"family": families[0]} if families else None,
        "affected": [leg.name for leg in case.trial] if causes else [],
        "instruments": {
            "coloured": {"value": case.ordinary.coloured, "unit": "1"},
            "clock_jitter": {"value": case.ordinary.clock_jitter, "unit": "s"},
        },
        "laws": asdict(case.laws),
        "sha256": logs,
    }
