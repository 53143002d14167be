"""Blind cases: one ship, a nominal campaign, and a trial 30 days later with something hidden.

All of a case follows from its seed and its family. What is hidden is drawn apart from ship,
weather, helm and noise: the same seed with another cause is the same campaign with that cause.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from pipelines.experiments.other_families import (
    abkowitz,
    azimuth_ferry,
    catamaran,
    container,
    devices,
    linear_dp,
    naval_vessel,
    shipmmg_kvlcc2,
)
from pipelines.experiments.other_families.devices import DEVICES
from pipelines.experiments.other_families.disturbance import Wind
from pipelines.experiments.other_families.effects import CATALOGUE, OUTSIDE, Effects, offered
from pipelines.experiments.other_families.instruments import write_voyage
from pipelines.experiments.other_families.profiles import profile
from pipelines.experiments.other_families.ship import Ship, stream
from pipelines.experiments.other_families.voyage import Voyage, sail

FAMILIES: dict[str, Callable[[int], Ship]] = {
    "abkowitz": abkowitz.draw,
    "linear_dp": linear_dp.draw,
    "catamaran": catamaran.draw,
    "azimuth_ferry": azimuth_ferry.draw,
    "shipmmg": shipmmg_kvlcc2.draw,
}
DRAWN = tuple(FAMILIES)  # of these a seed draws one; those that came later have to be asked for
FAMILIES |= {"container": container.draw, "naval_vessel": naval_vessel.draw}
PARTS = (0.13, 0.22, 0.15, 0.26, 0.24)  # of a campaign, its voyages
SHORT_PARTS = (0.45, 0.55)  # of one shorter than SHORT: one voyage to fit and one to hold out
SHORT = 1500.0  # s
CAMPAIGN = 7000.0  # s, of a small ship
LENGTHS = 170.0  # L/U, at least, of a large one: 8500 s where L/U is 50 s
LEAST = 120.0  # s
SHARES = {"none": 0.2, "one": 0.6, "two": 0.1, "outside": 0.1}
SMALLEST = 0.1  # of the realistic size
NOMINAL_DAY = datetime(2026, 4, 14, 7, 0, tzinfo=UTC)
LATER = timedelta(days=30)
PROFILE = "ship.toml"


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
    causes: tuple[Cause, ...]
    effects: Effects  # hidden in the trial
    nominal: tuple[Leg, ...] = field(repr=False)
    trial: tuple[Leg, ...] = field(repr=False)

    @property
    def verdict(self) -> str:
        """What a diagnosis should say."""
        if not self.causes:
            return "none"
        return "unknown" if any(cause.family for cause in self.causes) else "named"


def draw(
    seed: int, *, family: str | None = None, cause: str | None = None, size: float | None = None,
    seconds: float | None = None, nominal_seconds: float | None = None,
) -> Case:  # fmt: skip
    """The case of this seed.

    family           of the ship; drawn by the seed unless given
    cause            hide this instead: a name that the ship offers, two as "current+fouling", or
                     "none"
    size             of all that is hidden; drawn log-uniformly from 0.1 to 1 unless given
    seconds          of the trial; 7000, or 170 L/U where that is more, unless given
    nominal_seconds  of the nominal campaign; the ship's own where the trial is shorter than
                     1500 s, otherwise as the trial

    Raises ValueError for a family or a cause that there is not, or that this ship does not have.
    """
    if family is None:
        family = str(stream(seed, "family").choice(DRAWN))
    if family not in FAMILIES:
        raise ValueError(f"No family is called {family!r}. There are: {', '.join(FAMILIES)}.")
    ship = FAMILIES[family](seed)
    names = _names(seed, ship) if cause is None else _given(cause, ship)
    effects, causes = Effects(), []
    for name in names:
        rng = stream(seed, f"size of {name}")
        drawn = SMALLEST ** rng.uniform(0.0, 1.0)
        large = drawn if size is None else float(size)
        inside = CATALOGUE | DEVICES
        structure, sized = (None, inside[name]) if name in inside else OUTSIDE[name]
        changes, parameters = sized(stream(seed, f"hidden {name}"), large, ship)
        if "gear" in changes:
            changes["gear"] = (*effects.gear, *changes["gear"])
        effects = replace(effects, **changes)
        causes.append(Cause(name.partition(":")[0], large, parameters, structure))
    default = max(CAMPAIGN, LENGTHS * ship.time_unit)
    trial = default if seconds is None else float(seconds)
    if trial < LEAST:
        raise ValueError(f"A trial of {trial:g} s is too short: at least {LEAST:g} s.")
    nominal = nominal_seconds or (default if trial < SHORT else trial)
    return Case(
        seed, ship, tuple(causes), effects, _legs(seed, "nominal", NOMINAL_DAY, nominal, ship),
        _legs(seed, "trial", NOMINAL_DAY + LATER, trial, ship),
    )  # fmt: skip


def _given(cause: str, ship: Ship) -> list[str]:
    names = [name for name in cause.split("+") if name != "none"]
    there = (*offered(ship), *devices.offered(ship))
    if unknown := [name for name in names if name not in there]:
        known = (*CATALOGUE, *OUTSIDE, *DEVICES)
        why = "A ship of this family cannot have" if unknown[0] in known else "No"
        raise ValueError(f"{why} cause {unknown[0]!r}. It offers: none, {', '.join(there)}.")
    if len({name.partition(":")[0] for name in names}) < len(names):
        raise ValueError(f"{cause!r} hides the same thing twice.")
    return names


def _names(seed: int, ship: Ship) -> list[str]:
    rng = stream(seed, "cause")
    kind = rng.choice(list(SHARES), p=list(SHARES.values()))
    pool = OUTSIDE if kind == "outside" else CATALOGUE
    names = [name for name in offered(ship) if name in pool]
    count = {"none": 0, "two": 2}.get(str(kind), 1)
    while True:
        chosen = [names[i] for i in rng.choice(len(names), count, replace=False)]
        if len({name.partition(":")[0] for name in chosen}) == count:
            return chosen


def _legs(seed: int, campaign: str, day: datetime, total: float, ship: Ship) -> tuple[Leg, ...]:
    """Weather of its own for each; two voyages a day."""
    parts = PARTS if total >= SHORT else SHORT_PARTS
    ends = np.cumsum((0.0, *parts)) / sum(parts)
    legs = []
    for number, part in enumerate(parts):
        name = f"{campaign}_{number + 1}"
        rng = stream(seed, name)
        wind = Wind(
            speed=rng.uniform(1.5, 3.0) + min(2.0, 0.02 * ship.length),
            direction=rng.uniform(-np.pi, np.pi), turn=rng.uniform(-1.0, 1.0),
            freshen=rng.uniform(-0.25, 0.3), gust=rng.uniform(0.1, 0.2),
            veer=rng.uniform(0.05, 0.15),
        )  # fmt: skip
        start = day + timedelta(days=number // 2, hours=4 * (number % 2))
        share = (float(ends[number]), float(ends[number + 1]))
        seconds = round(total * part / sum(parts), 1)
        legs.append(Leg(name, seconds, start, wind, int(rng.integers(2**62)), share))
    return tuple(legs)


def voyage(case: Case, leg: Leg) -> Voyage:
    effects = case.effects if leg in case.trial else Effects()
    return sail(
        case.ship, leg.seconds, seed=leg.seed, wind=leg.wind, effects=effects,
        campaign=leg.campaign,
    )  # fmt: skip


def write(case: Case, folder: str | Path, key: str | Path) -> None:
    """Logs and profile into `folder`, what is hidden in them into the file `key`, elsewhere.

    Raises ValueError where the key would lie with the logs, FileExistsError where the folder holds
    other logs.
    """
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
    (folder / PROFILE).write_text(profile(case.ship), encoding="utf-8")
    pulses = {}
    for leg in legs:
        sailed = voyage(case, leg)
        write_voyage(folder / f"{leg.name}.mcap", sailed, seed=leg.seed, start=leg.start)
        if sailed.pulses:
            pulses[leg.name] = sailed.pulses
    key.write_text(json.dumps(_told(case, folder, pulses), indent=2) + "\n", encoding="utf-8")


def _told(case: Case, folder: Path, pulses: dict[str, Any]) -> dict[str, Any]:
    """The key: the contract's names, values with units, and which logs it is about."""
    causes = []
    for cause in case.causes:
        parameters = dict(cause.parameters)
        if cause.name == "side_thrust":
            parameters["times"] = {"value": pulses, "unit": "s from the start, s, N"}
        causes.append({"name": cause.name, "size": cause.size, "parameters": parameters})
    structures = [cause.family for cause in case.causes if cause.family]
    logs = {
        leg.name: hashlib.sha256((folder / f"{leg.name}.mcap").read_bytes()).hexdigest()
        for leg in (*case.nominal, *case.trial)
    }
    noise = case.ship.noise
    return {
        "contract": 1,
        "seed": case.seed,
        "family": case.ship.family,
        "verdict": case.verdict,
        "causes": causes,
        "structure": {"family": structures[0]} if structures else None,
        "affected": [leg.name for leg in case.trial] if causes else [],
        "ship": {
            "length": {"value": case.ship.length, "unit": "m"},
            "speed": {"value": case.ship.speed, "unit": "m/s"},
            "process_noise": {"value": noise.kind, "unit": ""},
            "noise_period": {"value": noise.period, "unit": "s"},
        },
        "sha256": logs,
    }
