"""Manoeuvres of measured ships: measured, and predicted by a model that has not seen them.

    python -m pipelines.experiments.manoeuvres_of_measured_ships kvlcc2 FOLDER --out measured
    python -m pipelines.experiments.manoeuvres_of_measured_ships esso FOLDER --out measured

Prints the tables of docs/evidence/manoeuvres.md. The data are not shipped: give their folders.

kvlcc2   identified from HSVA's thirteen zigzags at 1:45.7 alone; MARIN's two circles and four
         zigzags, measured at full scale and brought to that of the model by Froude's law
esso     turns of each day predicted by a model of all zigzags and random voyages, and of the other
         day's turns; and the yaw acceleration that the model lacks before and in them
"""

from __future__ import annotations

import argparse
import logging
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import polars as pl

from pipelines.experiments.esso_osaka import TWIN, trials_store
from pipelines.experiments.findings.kvlcc2 import HSVA, MARIN, WINDOW, at_model_scale
from shiplog.commands.convert import convert
from shiplog.commands.identify import identify_run
from shiplog.commands.manoeuvres import manoeuvres_of
from shiplog.commands.prepare import expand, ingest_logs
from shiplog.manoeuvres import recognition, stretches
from shiplog.report.evaluation.text_table import table
from shiplog.ship_profile import file as profiles
from shiplog.training.runs import load_model
from shiplog.training.settings.run_config import Config
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows.split_settings import Split

DAYS = ("14-Sep", "14-Oct")  # of the Esso Osaka's turns
MEMBERS = 200
PHASES = ((-30.0, 0.0), (0.0, 20.0), (40.0, 150.0))  # s from the order: approach, entry, circles
QUANTITIES = ("advance", "tactical_diameter", "first_overshoot", "second_overshoot")


def identified(store: Store, training: Sequence[str], path: Path, **settings) -> Path:
    if not path.exists():
        split = Split(training=tuple(training), validation=())
        config = {"model": "mmg", "split": split, **settings}
        identify_run(Config.model_validate(config), store, path)
    return path


def kvlcc2(folder: Path, out: Path) -> pl.DataFrame:
    store = Store(out / "kvlcc2")
    if not store.entries():
        logs = out / "kvlcc2-logs"
        logs.mkdir(parents=True, exist_ok=True)
        at_model_scale(pl.read_parquet(folder / MARIN)).write_parquet(logs / "marin.parquet")
        tables = [folder / HSVA, logs / "marin.parquet"]
        convert(tables, profiles.load("kvlcc2"), logs)
        ingest_logs(expand([logs]), "kvlcc2", store)
    names = [e.name for e in store.entries()]
    hsva = [n for n in names if n.startswith("HSVA")]
    run = identified(store, hsva, out / "kvlcc2-mmg", window=WINDOW)
    marin = [n for n in names if n.startswith("MARIN")]
    return manoeuvres_of([run], store, marin, members=MEMBERS).frame


def esso(folder: Path, out: Path) -> pl.DataFrame:
    store = trials_store(folder, out / "esso")
    names = [e.name for e in store.entries() if e.name != TWIN]
    found, lacking = [], []
    for day in DAYS:
        turns = [n for n in names if n.startswith("turn") and day in n]
        others = [n for n in names if n not in turns and not n.startswith("berthing")]
        run = identified(store, others, out / f"esso-mmg-without-{day}")
        found.append(manoeuvres_of([run], store, turns, members=MEMBERS).frame)
        lacking += [row for name in turns for row in missing_yaw(run, store, name)]
    print(yaw_table(pl.DataFrame(lacking)), end="\n\n")
    return pl.concat(found).filter(kind="turn")


def missing_yaw(path: Path, store: Store, name: str) -> list[dict[str, str | float]]:
    """Of each turn of a voyage, the yaw acceleration measured less the model's at the measured
    motion, as means over PHASES, mrad/s², positive to starboard."""
    run = load_model.load(path)
    own = run.simulator(run.config.seeds[0])
    record = stretches.read(store, name, run.profile)
    modelled = np.asarray(
        own.model.acceleration(own.theta, record.state, record.actuator, record.true_wind)
    )[:, 2]
    rows = []
    for one in recognition.recognise(name, stretches.tracks(record)):
        if one.kind != "turn":
            continue
        row: dict[str, str | float] = {"side": "starboard" if one.side > 0.0 else "port"}
        for first, last in PHASES:
            ends = one.begin + first, min(one.begin + last, one.end)
            during = (record.time >= ends[0]) & (record.time < ends[1])
            gained = np.diff(np.interp(ends, record.time, record.state[:, 5]))[0]
            lacking = float(gained / (ends[1] - ends[0]) - modelled[during].mean())
            row[f"{first:.0f} to {last:.0f} s"] = 1e3 * lacking
        rows.append(row)
    return rows


def yaw_table(rows: pl.DataFrame) -> str:
    found = rows.group_by("side", maintain_order=True).agg(pl.len().alias("turns"), pl.all().mean())
    phases = found.columns[2:]
    cells = [
        (r["side"], r["turns"], *(f"{r[phase]:+.1f}" for phase in phases))
        for r in found.iter_rows(named=True)
    ]
    return table(("turn to", "turns", *phases), cells, ("turns", *phases))


def compared(frame: pl.DataFrame) -> pl.DataFrame:
    """Measured and simulated of what both have: the error, the interval's width, and whether the
    measured value is in it."""
    return frame.filter(
        pl.col("voyage").is_not_null() & pl.col("quantity").is_in(QUANTITIES)
        & pl.col("measured").is_not_null() & pl.col("simulated").is_not_null()
    ).with_columns(
        error=pl.col("simulated") - pl.col("measured"),
        share=pl.col("simulated") / pl.col("measured") - 1.0,
        width=(pl.col("simulated_high") - pl.col("simulated_low")) / pl.col("measured").abs(),
        inside=pl.col("measured").is_between("simulated_low", "simulated_high"),
    )  # fmt: skip


def text(frame: pl.DataFrame) -> str:
    rows = [
        (r["voyage"], r["manoeuvre"], r["quantity"].replace("_", " "), r["unit"],
         f"{r['measured']:.2f}", f"{r['simulated']:.2f}",
         f"{r['simulated_low']:.2f} to {r['simulated_high']:.2f}",
         f"{r['share']:+.0%}" if r["unit"] == "L" else f"{r['error']:+.1f} deg",
         "yes" if r["inside"] else "no")
        for r in frame.iter_rows(named=True)
    ]  # fmt: skip
    head = ("voyage", "manoeuvre", "quantity", "unit", "measured", "simulated", "90 %", "error",
            "inside")  # fmt: skip
    return table(head, rows, ("measured", "simulated", "90 %", "error"))


def summary(frame: pl.DataFrame) -> str:
    of = frame.group_by("quantity", maintain_order=True).agg(
        pl.len().alias("number"), pl.col("inside").mean(), pl.col("width").median(),
        pl.col("share").abs().median().alias("off"),
    )  # fmt: skip
    rows = [
        (r["quantity"].replace("_", " "), r["number"], f"{r['inside']:.0%}", f"{r['width']:.0%}",
         f"{r['off']:.0%}")
        for r in of.iter_rows(named=True)
    ]  # fmt: skip
    head = ("quantity", "manoeuvres", "inside the 90 % interval", "median width of it",
            "median error")  # fmt: skip
    return table(head, rows, head[2:])


def main() -> None:
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ship", choices=("kvlcc2", "esso"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    made = {"kvlcc2": kvlcc2, "esso": esso}[given.ship]
    found = compared(made(given.folder, given.out))
    print("\n\n".join((text(found), summary(found))))


if __name__ == "__main__":
    main()
