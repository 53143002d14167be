"""An evaluation as a folder: its JSON, what it is about, and the tables of its pictures."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import polars as pl

from shiplog.exceptions import ShiplogError, listed
from shiplog.machine import files
from shiplog.nomenclature.channels import STATE
from shiplog.nomenclature.contract import CONTRACT
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.report.figures import picture_data, voyage_tables
from shiplog.report.figures.content import Content
from shiplog.report.figures.picture_data import MEASURED, PictureData
from shiplog.report.viewer.comparison_data import BAND
from shiplog.report.viewer.display import drawn_seeds
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.provenance import portable
from shiplog.voyages.store.store import Store

FOLDER, ANSWER = "evaluation", "evaluation.json"  # of a run
NOTHING = {key: [] for key in ("causes", "ranking", "limits", "wrong", "intervals")}


@dataclass(frozen=True)
class Source:
    """answers   run → the answer of `evaluate --json` for it
    subject   ship, length_m, voyages, window_s, runs, shiplog
    better    of every pair of runs, as `evaluate --json` has it
    """

    content: Content
    answers: Mapping[str, Mapping[str, Any]]
    subject: Mapping[str, Any]
    better: Sequence[Mapping[str, Any]] = ()


def of_evaluation(found: Evaluation, store: Store) -> Source:
    """What a page is made of, from an evaluation in memory."""
    first = found.runs[0]
    profile = first.profile
    hashes = store.hashes(found.voyages)
    voyages = voyage_tables.voyages_of(store, found.voyages, found.rows, profile)
    subject = {
        "ship": profile.ship.name,
        "length_m": float(profile.ship.length_m),
        "voyages": [
            {"name": name, "start": start, "seconds": seconds, "sha256": hashes.get(name)}
            for name, start, seconds in voyages.select("voyage", "start", "seconds").iter_rows()
        ],
        "window_s": first.config.window,
        "runs": [
            {"name": run.name, "model": run.label, "trained_on": list(run.trained_on),
             "path": portable([str(run.path)])[0]}
            for run in found.runs
        ],
        "store": portable([str(store.path)])[0],
        "shiplog": version("shiplog"),
    }  # fmt: skip
    answers = {run.name: found.answer(run) | {"worst": _worst(found, run)} for run in found.runs}
    better = [one.as_json() for one in found.better]
    return Source(Content(NOTHING, _pictures(found, voyages)), answers, subject, better)


def save(source: Source, folder: Path) -> None:
    """Into FOLDER of a run."""
    content = {"contract": CONTRACT, "subject": source.subject, "runs": source.answers}
    picture_data.save(source.content.data, folder / picture_data.FOLDER)
    files.write_json(folder / ANSWER, content)


def read(folder: Path) -> Source:
    """What `save` wrote. Raises ShiplogError."""
    path = folder / ANSWER
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if found["contract"] != CONTRACT:
            raise ValueError(f"it is of contract {found['contract']!r}, not {CONTRACT}")
        subject, answers = found["subject"], found["runs"]
    except FileNotFoundError:
        raise ShiplogError(
            f"{folder.parent} has no evaluation.",
            hint=f"make one: shiplog evaluate {folder.parent}.",
        ) from None
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ShiplogError(
            f"{path} cannot be read: {error}.", hint=f"shiplog evaluate {folder.parent} makes it."
        ) from error
    data = picture_data.load(folder / picture_data.FOLDER)
    return Source(Content(NOTHING, data), answers, subject)


def _worst(found: Evaluation, run: Run) -> list[dict]:
    """The five windows with the largest L: voyage, start_s, loss, coverage, reason."""
    rows = (
        found.errors.filter(pl.col("run") == run.name)
        .group_by("voyage", "window", maintain_order=True)
        .agg(pl.col("elapsed").first(), pl.col("loss").mean())
        .join(found.coverage, on=["voyage", "window"], how="left")
        .sort("loss", descending=True, maintain_order=True)
        .head(5)
    )
    return [
        {"voyage": r["voyage"], "start_s": float(r["elapsed"]), "loss": r["loss"],
         "coverage": r["coverage"], "reason": r["reason"] or ""}
        for r in rows.to_dicts()
    ]  # fmt: skip


def _pictures(found: Evaluation, voyages: pl.DataFrame) -> PictureData:
    run = found.runs[0]
    profile = run.profile
    names = [run.name for run in found.runs]
    seeds = drawn_seeds_of(found)
    bold = pl.col("seed") == pl.col("run").replace_strict(seeds, return_dtype=pl.Int64)
    drawn = found.rollouts.filter(bold)
    states = [c.name for c in STATE]
    losses = (
        found.errors.group_by("run", "voyage", "window", maintain_order=True)
        .agg(pl.col("elapsed").first(), pl.col("loss").mean())
        .with_columns(loss=pl.when(pl.col("loss").is_finite()).then("loss"))
    )
    tables: dict[str, Any] = {
        "voyages": voyages,
        "measured": found.rows.select("voyage", pl.col("elapsed").alias("time"), *states),
        "tracks": pl.concat(
            [_measured_windows(found, drawn, run), drawn.select(
                pl.col("run").alias("model"), "voyage", "window", "time", *states
            )]
        ),
        "errors": losses.select(
            pl.col("run").alias("model"), "voyage", "window", pl.col("elapsed").alias("time"),
            pl.lit(float(run.config.window - 1)).alias("seconds"), "loss",
        ),
        "conditions": voyage_tables.conditions(run, found.rows, profile),
        "band": _band(drawn.filter(pl.col("run") == run.name)),
    }  # fmt: skip
    return picture_data.typed(
        PictureData(
            title=f"{profile.ship.name}: {listed(found.voyages, most=3)}",
            length=profile.ship.length_m,
            breadth=profile.ship.breadth,
            outline=tuple(profile.ship.outline or ()),
            banks=tuple(tuple((x, y) for x, y in bank) for bank in profile.site.banks),
            models={name: name for name in names},
            **tables,
        )
    )


def drawn_seeds_of(found: Evaluation) -> dict[str, int]:
    """Of each run the seed whose mean error is the median of its seeds."""

    class _Simulated:
        simulated = found.rollouts.with_columns(pl.col("run").alias("model"))

    return drawn_seeds(_Simulated)  # type: ignore[arg-type]  # of the columns it reads


def _measured_windows(found: Evaluation, drawn: pl.DataFrame, run: Run) -> pl.DataFrame:
    """The measured states at the instants of each window of a run."""
    windows = drawn.filter(pl.col("run") == run.name).select("voyage", "window", "time")
    states = [c.name for c in STATE]
    rows = found.rows.select("voyage", pl.col("elapsed").cast(pl.Float64).alias("time"), *states)
    key = (10.0 * pl.col("time")).round().cast(pl.Int64)  # rows of a second each, on both sides
    return (
        windows.with_columns(key=key)
        .join(rows.with_columns(key=key).drop("time"), on=["voyage", "key"], how="inner")
        .sort("voyage", "window", "time")
        .select(pl.lit(MEASURED).alias("model"), "voyage", "window", "time", *states)
    )


def _band(rollouts: pl.DataFrame) -> pl.DataFrame:
    """As `PictureData.band`, in the mean over the windows."""
    low, high = BAND
    since = pl.col("time") - pl.col("time").min().over("voyage", "window")
    half = {
        name: 0.5 * (pl.col(f"{name}{high}") - pl.col(f"{name}{low}"))
        for name in ("x0", "y0", "heading")
    }
    return (
        rollouts.select(since.round(1).alias("elapsed"), **half)
        .drop_nulls()
        .group_by("elapsed")
        .agg(pl.all().mean())
        .sort("elapsed")
        .select(
            "elapsed", position=(pl.col("x0") ** 2 + pl.col("y0") ** 2).sqrt(), heading="heading"
        )
        .filter(pl.col("position").is_finite() & pl.col("heading").is_finite())
    )
