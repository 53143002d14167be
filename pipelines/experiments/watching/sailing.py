"""Sailing of a simulated ship as records of the watch: hours without a change, and voyages in which
something begins half-way.

A voyage becomes messages as the simulator's instruments make them, and rows by `ingest`'s rules;
only the file between the two is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from pipelines.experiments.other_families import cases as abroad
from pipelines.experiments.other_families import instruments as abroad_instruments
from pipelines.experiments.other_families.effects import offered as abroad_offered
from pipelines.experiments.other_families.voyage import sail as sail_abroad
from pipelines.experiments.simulated_ship import cases as home
from pipelines.experiments.simulated_ship import sensors as home_instruments
from pipelines.experiments.simulated_ship.voyage import sail as sail_home
from shiplog.logs.conversion.write import Series
from shiplog.logs.reading.read import Contents, Health, Reading, Topic
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.ingest import alignment
from shiplog.voyages.rows import recording
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.samples import sampling

FIRST_DAY = datetime(2026, 6, 1, tzinfo=UTC)
LEG_S = 1800.0  # s of one weather, as a voyage of the campaigns lasts
LATER = 2**62  # ns: a time at which all messages have come


@dataclass(frozen=True)
class Ship:
    """One of the five. family: of equations, empty for the home ship's sisters."""

    name: str
    seed: int
    family: str = ""


FIVE = (
    Ship("home1", 9101), Ship("home2", 9102), Ship("home3", 9103),
    Ship("abkowitz", 9104, "abkowitz"), Ship("catamaran", 9105, "catamaran"),
)  # fmt: skip
# With these no number of the alarm was set: they show whether it serves other ships, too.
OTHERS = (
    Ship("home4", 9106), Ship("abkowitz2", 9107, "abkowitz"),
    Ship("catamaran2", 9108, "catamaran"), Ship("ferry", 9109, "azimuth_ferry"),
    Ship("dp", 9110, "linear_dp"),
)  # fmt: skip
SHIPS = FIVE + OTHERS


def offered(ship: Ship) -> list[str]:
    """Names of what can be hidden in its catalogue."""
    if not ship.family:
        return list(home.CATALOGUE)
    drawn = abroad.FAMILIES[ship.family](ship.seed)
    return [name for name in abroad_offered(drawn) if name in abroad.CATALOGUE]


def leg(ship: Ship, number: int, seconds: float = LEG_S) -> list[Series]:
    """Messages of a leg of effect-free sailing, the same each time."""
    return _sailed(ship, number, seconds, None, 0.0, 1.0)[0]


def half_way(
    ship: Ship, number: int, cause: str, size: float, seconds: float = LEG_S
) -> tuple[list[Series], float]:
    """Messages of a leg in the middle of which something begins, and when that is [s]."""
    return _sailed(ship, number, seconds, cause, 0.5 * seconds, size)


def _sailed(
    ship: Ship, number: int, seconds: float, cause: str | None, begins: float, size: float
) -> tuple[list[Series], float]:
    """Two voyages joined where the second takes the first one's place and motion."""
    module: Any = abroad if ship.family else home
    given = {"cause": cause or "none", "size": size if cause else None}
    case = module.draw(ship.seed, **given, **({"family": ship.family} if ship.family else {}))
    weather = module.draw(ship.seed * 1000 + number, cause="none",
                          **({"family": ship.family} if ship.family else {})).trial[0]  # fmt: skip
    start = FIRST_DAY + timedelta(hours=number)
    found: list[list[Series]] = []
    pieces = [(begins, False), (seconds - begins, True)] if cause else [(seconds, False)]
    place, at = None, 0.0
    for lasts, hidden in pieces:
        voyage = _voyage(ship, case, weather, lasts, place, hidden, number)
        measured: Any = abroad_instruments if ship.family else home_instruments
        more = {} if ship.family else {"blemishes": home_instruments.Blemishes()}
        found.append(measured.measure(
            voyage, seed=weather.seed + round(at), start=start + timedelta(seconds=at), **more
        ))  # fmt: skip
        last = {n: float(getattr(voyage, n)[-1]) for n in ("x0", "surge", "y0", "sway", "heading",
                                                             "yaw_rate")}  # fmt: skip
        order = ("x0", "y0", "heading", "surge", "sway", "yaw_rate") if ship.family else last
        place, at = tuple(last[n] for n in order), at + lasts
    return _joined(found), begins


def _voyage(ship: Ship, case: Any, weather: Any, lasts: float, place, hidden: bool, number: int):
    seed = weather.seed + (1 if hidden else 0)
    if ship.family:
        from pipelines.experiments.other_families.effects import Effects

        return sail_abroad(
            case.ship, lasts, seed=seed, wind=weather.wind, start=place,
            effects=case.effects if hidden else Effects(),
        )  # fmt: skip
    return sail_home(
        lasts, seed=seed, wind=weather.wind, ship=case.ship, laws=case.laws, start=place,
        effects=case.effects if hidden else case.ordinary,
    )  # fmt: skip


def _joined(parts: Sequence[Sequence[Series]]) -> list[Series]:
    if len(parts) == 1:
        return list(parts[0])
    first, second = parts
    joined = []
    for one, other in zip(first, second, strict=True):
        after = np.asarray(other.time) > one.time[-1]
        both = {n: np.concatenate((np.asarray(v), np.asarray(other.columns[n])[after]))
                for n, v in one.columns.items()}  # fmt: skip
        times = {k: np.concatenate((getattr(one, k), getattr(other, k)[after]))
                 for k in ("time", "log_time", "publish_time")}  # fmt: skip
        joined.append(replace(one, columns=both, **times))
    return joined


def reading_of(series: Sequence[Series], profile: Profile, datum: tuple[float, float] | None):
    """Messages as if they had been read from a log."""
    frames = {}
    for one in series:
        columns = {n: np.asarray(v) for n, v in one.columns.items() if np.ndim(v) == 1}
        times = {"log_time": one.log_time, "publish_time": one.publish_time, "stamp": one.time}
        frames[one.topic] = pl.DataFrame(times | columns).sort("log_time", maintain_order=True)
    topics = {t: Topic(t, "", "", "", None) for t in frames}
    metadata = {} if datum is None else {"voyage": {"datum": f"{datum[0]!r},{datum[1]!r}"}}
    contents = Contents(Path("sailed"), 0, topics, metadata, "", "")
    return Reading(contents, Health("salvage", 0, 0, 0, 0, (), {}), frames)


def table_of(series: Sequence[Series], profile: Profile) -> pl.DataFrame:
    """Rows at 10 Hz, as `ingest` makes them."""
    reading = reading_of(series, profile, home_instruments.DATUM)
    return alignment.aligned(sampling.sampled(reading, profile, {})).table


def record_of(series: Sequence[Series], profile: Profile) -> Record:
    return recording.read([table_of(series, profile)], ["watched"], profile)
