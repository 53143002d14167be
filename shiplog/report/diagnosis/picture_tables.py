"""A diagnosis as the tables of its pictures: `report.figures` draws them, on the page and alone."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import polars as pl

from shiplog.exceptions import listed
from shiplog.nomenclature.channels import STATE
from shiplog.report.diagnosis import diagnosis_pictures
from shiplog.report.diagnosis.diagnosis import Diagnosis
from shiplog.report.figures import picture_data, voyage_tables
from shiplog.report.figures.picture_data import (
    AFTER,
    BEFORE,
    MEASURED,
    SCHEMAS,
    PictureData,
)
from shiplog.report.figures.voyage_tables import Seconds
from shiplog.report.viewer.diagnosis_data import Exhibit
from shiplog.simulation.rollout import simulate
from shiplog.training.runs.load_model import Run
from shiplog.voyages.windows.windows import Windows

EXTENDED = "with the named causes"


def of_diagnosis(
    done: Diagnosis, exhibit: Exhibit | None, run: Run, seconds: Seconds
) -> PictureData:
    """The voyages and their conditions; of a diagnosis that came to a decision, also its windows
    and forces, which the `exhibit` has."""
    profile, rows = seconds.profile, seconds.rows
    states = (c.name for c in STATE)
    data = PictureData(
        title=f"{profile.ship.name}: {listed(seconds.names, most=3)}",
        length=profile.ship.length_m,
        breadth=profile.ship.breadth,
        outline=tuple(profile.ship.outline or ()),
        banks=tuple(tuple((x, y) for x, y in bank) for bank in profile.site.banks),
        models={BEFORE: run.name},
        current=_named_current(done),
        voyages=seconds.voyages,
        measured=rows.select("voyage", pl.col("elapsed").alias("time"), *states),
        conditions=voyage_tables.conditions(run, rows, profile),
    )
    if exhibit is None:
        return picture_data.typed(data)
    models = {BEFORE: run.name}
    if done.after is not None:
        models[AFTER] = f"{run.name}, {EXTENDED}"
    cut = None if done.held is None else done.held.cut
    fast = exhibit.made_fast
    found = {
        "made_fast": () if fast is None else (fast.point, fast.low, fast.high),
        "models": models, "named": exhibit.named, "errors": _errors(exhibit),
        "residual": exhibit.residual, "tracks": _tracks(exhibit, cut), "band": _band(run, cut),
        "acting": _acting(done),
    }  # fmt: skip
    return picture_data.typed(replace(data, **found))


def _named_current(done: Diagnosis) -> tuple[float, float] | None:
    """Speed [m/s], and towards where [rad]."""
    for cause in done.verdict.causes:
        if cause.name == "current" and {"speed", "direction"} <= set(cause.parameters):
            speed, towards = (cause.parameters[k].value for k in ("speed", "direction"))
            return float(speed), math.radians(float(towards))
    return None


def _errors(exhibit: Exhibit) -> pl.DataFrame:
    """A row a model and window."""
    index = ["voyage", "window", "time", "seconds"]
    return pl.concat(
        exhibit.errors.select(pl.lit(key).alias("model"), *index, pl.col(key).alias("loss"))
        for key in (BEFORE, AFTER)
    ).filter(pl.col("loss").is_not_null() | (pl.col("model") == BEFORE))


def _tracks(exhibit: Exhibit, cut: Windows | None) -> pl.DataFrame:
    """The simulated windows, and what was measured in each."""
    if cut is None:
        return exhibit.tracks
    numbered = diagnosis_pictures.numbered(cut)
    measured = diagnosis_pictures.tracks(MEASURED, cut.state, numbered, cut)
    return pl.concat([measured, exhibit.tracks])


def _acting(done: Diagnosis) -> pl.DataFrame:
    """A row a stretch of each named cause that has an onset."""
    rows = [
        (label, voyage, begin, end, p)
        for label, course in done.courses.items() if (onset := course.onset) is not None
        for voyage, begin, end, p in zip(
            onset.voyages, onset.edges[:-1].tolist(), onset.edges[1:].tolist(),
            onset.acting.tolist(), strict=True,
        )
    ]  # fmt: skip
    return pl.DataFrame(rows, SCHEMAS["acting"], orient="row")


def _band(run: Run, cut: Windows | None) -> pl.DataFrame:
    """Half-width over the windows in the mean, by time since their start; of a position
    √(h_x² + h_y²), which holds at least as many samples as each."""
    learnt = None if cut is None or not len(cut) else run.band()
    if cut is None or learnt is None or len(learnt.growth) != cut.state.shape[1]:
        return pl.DataFrame(schema=SCHEMAS["band"])
    models = run.models()
    simulated = [simulate(model, cut) for model in models.values()]
    half = np.nanmean(learnt.half_width(run.spread(models, simulated, cut)), axis=0)
    names = [c.name for c in STATE]
    x, y, psi = (half[:, names.index(k)] for k in ("x0", "y0", "heading"))
    elapsed = np.concatenate(([0.0], np.cumsum(cut.dt[0])))
    return pl.DataFrame({"elapsed": elapsed, "position": np.hypot(x, y), "heading": psi})
