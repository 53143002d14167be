"""A made store of one ship with very many voyages of two hours, and a model of it before."""

from __future__ import annotations

import json
import shutil
from datetime import UTC, datetime, timedelta
from pathlib import Path

import polars as pl

from pipelines.experiments import simulated_ship
from pipelines.experiments.benchmarks.diagnosis_cost.builds import Build, command
from pipelines.experiments.simulated_ship import Effects, Wind

SAILED = 4  # different voyages; the others are copies of these on other days
NOMINAL, NOMINAL_S = 4, 1800.0
APART = timedelta(days=1)
READY = "ready.json"


def make(place: Path, count: int, hours: float, build: Build, scratch: Path) -> Path:
    """Folder with `store` and `run`: a store that is there grows. What costs is the number of
    rows, so that voyages may be alike."""
    ready = place / READY
    if not ready.is_file() or json.loads(ready.read_text(encoding="utf-8"))["hours"] != hours:
        shutil.rmtree(place, ignore_errors=True)
        logs = place / "logs"
        logs.mkdir(parents=True)
        begins = datetime(2026, 1, 1, tzinfo=UTC)
        for number in range(NOMINAL + SAILED):
            trial = number >= NOMINAL
            name = f"trial_{number - NOMINAL:04d}" if trial else f"nominal_{number + 1}"
            voyage = simulated_ship.sail(
                hours * 3600.0 if trial else NOMINAL_S, seed=100 + number,
                wind=Wind(3.0, float(number)),
                effects=Effects(current_north=0.08, current_east=-0.05) if trial else None,
            )  # fmt: skip
            simulated_ship.write_voyage(
                logs / f"{name}.mcap", voyage, seed=100 + number, start=begins + number * APART
            )
        stored = ["--store", str(place / "store")]
        command(build, ["ingest", str(logs), "--profile", "esso-vectwin", *stored], scratch)
        command(build, ["train", "--model", "mmg", "--voyages", "nominal_*", "--folds", "0",
                        *stored, "--out", str(place / "run")], scratch)  # fmt: skip
        shutil.rmtree(logs)
        ready.write_text(json.dumps({"hours": hours}), encoding="utf-8")
    for number in range(SAILED, count):
        copy(place / "store", f"trial_{number % SAILED:04d}", f"trial_{number:04d}", number * APART)
    return place


def copy(store: Path, old: str, new: str, later: timedelta) -> None:
    """A voyage under another name, on a later day."""
    source, to = store / f"voyage={old}", store / f"voyage={new}"
    if to.is_dir():
        return
    partial = store / f".copy-{new}"
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir()
    table = pl.read_parquet(source / "table.parquet", hive_partitioning=False)
    moved = (pl.col("time") + later).cast(table.schema["time"])
    table = table.with_columns(pl.lit(new).alias("voyage"), moved)
    table.write_parquet(partial / "table.parquet")
    facts = json.loads((source / "voyage.json").read_text(encoding="utf-8"))
    facts["report"]["name"] = new
    facts["start"] = str(datetime.fromisoformat(facts["start"]) + later)
    (partial / "voyage.json").write_text(json.dumps(facts), encoding="utf-8")
    partial.rename(to)
