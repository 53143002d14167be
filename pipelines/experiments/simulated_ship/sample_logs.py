"""The logs that come with shiplog: six voyages as in the paper, and two of each later season."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from pipelines.experiments.simulated_ship import cases
from pipelines.experiments.simulated_ship.sensors import Blemishes, write_voyage
from pipelines.experiments.simulated_ship.ship import Effects
from pipelines.experiments.simulated_ship.voyage import Voyage, sail
from pipelines.experiments.simulated_ship.weather import Wind

SEED = 20260


@dataclass(frozen=True, slots=True)
class Plan:
    name: str
    seconds: float  # the paper's durations, for 1 to 6
    start: datetime
    wind: Wind
    blemishes: Blemishes | None = None


def _wind(speed: float, end: float, from_deg: float, turn_deg: float) -> Wind:
    return Wind(speed, math.radians(from_deg), speed_end=end, turn=math.radians(turn_deg))


def _day(year: int, month: int, day: int, hour: int, minute: int) -> datetime:
    return datetime(year, month, day, hour, minute, tzinfo=UTC)


# 1 and 2 train on light winds, 3 and 4 bring some of a fresh one, 6 tests in it, 5 lies between
PLANS = (
    Plan("voyage_1", 500.5, _day(2025, 10, 7, 1, 12), _wind(1.5, 1.7, 250.0, 40.0)),
    Plan("voyage_2", 1801.8, _day(2025, 10, 7, 2, 5), _wind(1.8, 2.3, 300.0, 70.0)),
    Plan("voyage_3", 500.5, _day(2025, 10, 9, 4, 30), _wind(3.0, 3.4, 200.0, -30.0)),
    Plan(
        "voyage_4", 1801.8, _day(2025, 10, 9, 5, 10), _wind(3.2, 4.2, 180.0, -60.0),
        Blemishes(dropouts=((612.0, 3.0),), spikes=((233.4, 1.8, -1.1), (1207.8, -2.4, 0.9))),
    ),
    Plan("voyage_5", 1201.2, _day(2025, 10, 15, 1, 40), _wind(3.4, 3.8, 330.0, 50.0)),
    Plan("voyage_6", 1201.2, _day(2025, 10, 21, 5, 20), _wind(4.4, 4.9, 310.0, -40.0)),
)  # fmt: skip
SEASONS = {
    2: (
        Plan("season2_1", 900.9, _day(2026, 4, 14, 2, 0), _wind(1.8, 2.2, 120.0, 60.0)),
        Plan("season2_2", 900.9, _day(2026, 4, 14, 3, 10), _wind(2.4, 2.0, 200.0, 40.0)),
    ),
    3: (
        Plan("season3_1", 900.9, _day(2026, 10, 6, 1, 30), _wind(2.0, 1.6, 60.0, -50.0)),
        Plan("season3_2", 900.9, _day(2026, 10, 6, 2, 20), _wind(1.7, 2.3, 280.0, 30.0)),
    ),
    4: (
        Plan("season4_1", 900.9, _day(2027, 4, 20, 2, 15), _wind(2.2, 1.9, 240.0, 40.0)),
        Plan("season4_2", 900.9, _day(2027, 4, 20, 3, 5), _wind(1.6, 2.1, 150.0, -60.0)),
    ),
}


def drawn(season: int) -> tuple[Effects, list[dict]]:
    """What a season hides, and the key to it in the contract's names and units."""
    rng = np.random.default_rng([SEED, season])
    if season == 2:
        speed, towards = rng.uniform(0.05, 0.14), rng.uniform(0.0, 360.0)
        late = rng.uniform(0.3, 0.9)
        effects = Effects(
            current_north=speed * math.cos(math.radians(towards)),
            current_east=speed * math.sin(math.radians(towards)),
            clock_offset={"gnss": late},
        )
        return effects, [
            {
                "name": "current",
                "parameters": {
                    "speed": {"value": round(speed, 6), "unit": "m/s"},
                    "direction": {"value": round(towards, 4), "unit": "deg"},
                },
            },
            {
                "name": "clock_offset",
                "parameters": {
                    "time": {"value": round(late, 4), "unit": "s"},
                    "channel": {"value": "gnss", "unit": ""},
                },
            },
        ]
    if season == 4:  # no cause has this name; the family is the answer
        changes, parameters = cases.OUTSIDE["tether"][1](rng, 1.0)
        return Effects(**changes), [
            {"name": "tether", "family": "position", "parameters": parameters}
        ]
    return Effects(), []


def voyages() -> list[tuple[Plan, Voyage]]:
    """All of them, in the order in which they were sailed."""
    planned = [(plan, Effects()) for plan in PLANS]
    for season, plans in SEASONS.items():
        planned += [(plan, drawn(season)[0]) for plan in plans]
    return [
        (plan, sail(plan.seconds, seed=SEED + number, wind=plan.wind, effects=effects))
        for number, (plan, effects) in enumerate(planned)
    ]


def write_sample_logs(folder: str | Path) -> None:
    """Sail and write all logs, the README and the key. The same bytes every time."""
    folder = Path(folder)
    answers = folder / "answers"
    answers.mkdir(parents=True, exist_ok=True)
    for number, (plan, voyage) in enumerate(voyages()):
        write_voyage(
            folder / f"{plan.name}.mcap", voyage,
            seed=SEED + number, start=plan.start, blemishes=plan.blemishes,
        )  # fmt: skip
    key = {plan.name: drawn(season)[1] for season, plans in SEASONS.items() for plan in plans}
    (answers / "key.json").write_text(json.dumps(key, indent=2) + "\n", encoding="utf-8")
    (folder / "README.md").write_text(_readme(), encoding="utf-8")


def _readme() -> str:
    rows = "\n".join(
        f"| {plan.name} | {plan.seconds} | {plan.start:%Y-%m-%d %H:%M} | "
        f"{plan.wind.speed} to {plan.wind.speed_end} |"
        for plan in (*PLANS, *(plan for plans in SEASONS.values() for plan in plans))
    )
    return _README.format(rows=rows, blemishes=_blemishes())


def _blemishes() -> str:
    lines = []
    for plan in PLANS:
        if plan.blemishes is None:
            continue
        for begin, length in plan.blemishes.dropouts:
            at = plan.start + timedelta(seconds=begin)
            lines.append(
                f"- {plan.name}: no GNSS for {length:g} s from {begin:g} s ({at:%H:%M:%S})."
            )
        for at, north, east in plan.blemishes.spikes:
            far = math.hypot(north, east)
            lines.append(f"- {plan.name}: one position {far:.1f} m off at {at:g} s.")
    return "\n".join(lines)


_README = """\
# Sample logs

Simulated, not measured: a 3 m model ship with one propeller and two VecTwin rudders on a pond
of about 100 m, steered by a random operator in gusty wind
(`pipelines/experiments/simulated_ship/`). Made again, byte for byte on one machine, by

    python -m pipelines.experiments.simulated_ship sample_logs

| log | seconds | start (UTC) | mean wind [m/s] |
|---|---|---|---|
{rows}

Voyages 1 to 6 have the durations of the paper's trajectories: 1 and 2 train, 3 and 4 are the
additional training data, 5 validates, 6 tests. As in the paper, 6 meets winds (around 5 m/s)
that 1 and 2 never did and 3 and 4 met a little of.

## Instruments

Profile `esso-vectwin`. Position and speed are those of the antenna, 0.3 m ahead of midship.

| topic | Hz | error (1 sigma) | resolution |
|---|---|---|---|
| `/gnss/fix` | 10 | 0.02 m, half of it slow | 2^-27 deg, 0.8 mm |
| `/gnss/velocity` | 10 | 0.01 m/s north and east | 2^-10 m/s, 2^-7 deg |
| `/gyro` | 10 | 0.1 deg, 0.1 deg/s | 2^-7 deg, 2^-7 deg/s |
| `/wind/apparent` | 4 | 0.1 m/s, 2 deg | 2^-6 m/s, 2^-3 deg |
| `/rudder/port`, `/rudder/starboard` | 10 | none | 2^-4 deg |
| `/propeller/main` | 5 | none | 2^-6 rps |

Every instrument samples at its own phase and drift, most with a jitter of 1 to 2 ms. `timestamp`
is when it measured; messages reach the recorder (`log_time`) 5 to 40 ms later.

## What is wrong in them

{blemishes}

Seasons 2, 3 and 4 are the same ship and the same instruments half a year later each. In some of
them something is hidden, and a model of voyages 1 to 6 will not follow them; one season may hide
more than one thing, or nothing, or what no catalogue has. `shiplog diagnose` is to say which.
shiplog never reads `answers/`; look there afterwards.
"""
