"""What the pictures of a diagnosis are drawn from: tables on disk, so that a page can be made again
without the model, the store or the logs.

SI and radians throughout; a picture converts when it labels an axis.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import polars as pl

from shiplog.exceptions import ShiplogError
from shiplog.machine import files

FOLDER = "pictures"  # in the folder of a result
FACTS = "facts.json"
BEFORE, AFTER, MEASURED = "before", "after", "measured"
TRAINING, TRIAL = "training", "trial"

STATES = {name: pl.Float64 for name in ("x0", "surge", "y0", "sway", "heading", "yaw_rate")}
SCHEMAS: Mapping[str, dict[str, Any]] = {
    "voyages": {
        "voyage": pl.String, "start": pl.String, "seconds": pl.Float64, "latitude": pl.Float64,
        "longitude": pl.Float64, "wind_speed": pl.Float64, "wind_from": pl.Float64,
    },
    "measured": {"voyage": pl.String, "time": pl.Float64, **STATES},
    "tracks": {
        "model": pl.String, "voyage": pl.String, "window": pl.Int64, "time": pl.Float64, **STATES,
    },
    "errors": {
        "model": pl.String, "voyage": pl.String, "window": pl.Int64, "time": pl.Float64,
        "seconds": pl.Float64, "loss": pl.Float64,
    },
    "residual": {
        "voyage": pl.String, "time": pl.Float64, "channel": pl.String, "force": pl.Float64,
        "sd": pl.Float64, "named": pl.Float64,
    },
    "conditions": {
        "campaign": pl.String, "speed": pl.Float64, "drift": pl.Float64, "yaw_rate": pl.Float64,
        "wind_speed": pl.Float64, "wind_from": pl.Float64,
    },
    "band": {"elapsed": pl.Float64, "position": pl.Float64, "heading": pl.Float64},
    "acting": {
        "cause": pl.String, "voyage": pl.String, "begin": pl.Float64, "end": pl.Float64,
        "probability": pl.Float64,
    },
}  # fmt: skip
LATER = ("acting",)  # tables that older results do not have


def empty(name: str) -> pl.DataFrame:
    """A table of SCHEMAS without rows."""
    return pl.DataFrame(schema=SCHEMAS[name])


@dataclass(frozen=True)
class PictureData:
    """A diagnosis, an evaluation or the health of voyages as tables.

    length, breadth   of the ship, m
    outline           (ahead, starboard) of midship, m; empty for a pointed box
    banks             lines of (x₀, y₀) points, m
    models            key of a model in the tables → its name, as a legend has it: of a diagnosis
                      BEFORE and AFTER, of an evaluation each run's own name
    named             causes whose force `residual.named` is
    current           (speed [m/s], towards [rad]) of a named current; None without one
    made_fast         (x₀, y₀) [m] of the point that a named line goes to, and of the low and the
                      high ends of its 90 % interval; empty without one, or where it has no place
    voyages           a row a voyage: start (ISO 8601, UTC), seconds, where x₀ = y₀ = 0 is
                      [deg; null where the log has no coordinates], mean true wind [m/s, rad, where
                      it comes from; null where it has no one direction]
    measured          about a row a second: the state at midship
    tracks            model (a key of `models`, or MEASURED), voyage, window, time: every window
    errors            L of each model and window (Eq. 8 of Wakita et al. 2024); null where the model
                      diverges and the window is in no figure
    residual          missing force at the nodes with its standard deviation, and the force of what
                      was named [N, N m]
    conditions        a row a second or fewer: campaign (TRAINING or TRIAL), speed [m/s], drift
                      angle β = atan2(-v, u), yaw rate [rad, rad/s], true wind
    band              half-width of the model's own 90 % band by time since the window's start [s]:
                      of the position [m] and of the heading [rad]; empty where it has none
    acting            of each named cause with an onset, by stretches of recorded time [s] from the
                      trial's start: the probability that it acts
    """

    title: str
    length: float
    breadth: float
    outline: tuple[tuple[float, float], ...] = ()
    banks: tuple[tuple[tuple[float, float], ...], ...] = ()
    models: Mapping[str, str] = field(default_factory=dict)
    named: tuple[str, ...] = ()
    current: tuple[float, float] | None = None
    made_fast: tuple[tuple[float, float], ...] = ()
    voyages: pl.DataFrame = field(default_factory=partial(empty, "voyages"))
    measured: pl.DataFrame = field(default_factory=partial(empty, "measured"))
    tracks: pl.DataFrame = field(default_factory=partial(empty, "tracks"))
    errors: pl.DataFrame = field(default_factory=partial(empty, "errors"))
    residual: pl.DataFrame = field(default_factory=partial(empty, "residual"))
    conditions: pl.DataFrame = field(default_factory=partial(empty, "conditions"))
    band: pl.DataFrame = field(default_factory=partial(empty, "band"))
    acting: pl.DataFrame = field(default_factory=partial(empty, "acting"))

    def of(self, voyage: str) -> PictureData:
        """The same with the rows of one voyage; conditions and band are of them all."""
        own = pl.col("voyage") == voyage
        names = ("voyages", "measured", "tracks", "errors", "residual")
        return replace(self, **{name: getattr(self, name).filter(own) for name in names})

    @property
    def names(self) -> list[str]:
        """The voyages, in the order in which they were given."""
        return self.voyages["voyage"].to_list()


def typed(data: PictureData) -> PictureData:
    """The same, every table with the columns and types of its schema."""
    tables = {
        name: getattr(data, name).select(pl.col(k).cast(v) for k, v in schema.items())
        for name, schema in SCHEMAS.items()
    }
    return replace(data, **tables)


def save(data: PictureData, folder: Path) -> None:
    """Tables as Parquet and the rest as JSON, into FOLDER."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in SCHEMAS:
        files.write_frame(folder / f"{name}.parquet", getattr(data, name))
    facts = {f.name: getattr(data, f.name) for f in fields(data) if f.name not in SCHEMAS}
    files.write_json(folder / FACTS, facts | {"models": dict(data.models)})


def load(folder: Path) -> PictureData:
    """What `save` wrote. Raises ShiplogError where something of it is missing or spoilt."""
    try:
        facts = json.loads((folder / FACTS).read_text(encoding="utf-8"))
        tables = {
            name: pl.read_parquet(folder / f"{name}.parquet") for name in SCHEMAS
            if name not in LATER or (folder / f"{name}.parquet").exists()
        }  # fmt: skip
        tables = {name: tables.get(name, empty(name)) for name in SCHEMAS}
        for name, schema in SCHEMAS.items():
            tables[name] = tables[name].select(pl.col(k).cast(v) for k, v in schema.items())
        return PictureData(
            title=str(facts["title"]), length=float(facts["length"]),
            breadth=float(facts["breadth"]), outline=_points(facts["outline"]),
            banks=tuple(_points(bank) for bank in facts["banks"]), models=dict(facts["models"]),
            named=tuple(facts["named"]),
            current=None if facts["current"] is None else _points([facts["current"]])[0],
            made_fast=_points(facts.get("made_fast", ())),  # older results have none
            **tables,
        )  # fmt: skip
    except (OSError, ValueError, KeyError, TypeError, pl.exceptions.PolarsError) as error:
        raise ShiplogError(
            f"The pictures' data in {folder} cannot be read: {error}.",
            hint="diagnose again into a new folder.",
        ) from error


def _points(rows: Sequence[Sequence[float]]) -> tuple[tuple[float, float], ...]:
    return tuple((float(x), float(y)) for x, y in rows)
