"""What a run predicts of voyages: its rollouts of their windows, next to what was measured.

As `evaluate` and `compare` judge it: each window of the run's length begins at the measured state.
"""

from __future__ import annotations

import numpy as np
import polars as pl

from shiplog.exceptions import StoreError
from shiplog.export.job import Job
from shiplog.export.trial import Difference
from shiplog.nomenclature.channels import STATE
from shiplog.nomenclature.frames import wrap
from shiplog.simulation.rollout import simulate
from shiplog.training.runs.run_checks import (
    refuse_no_window,
    refuse_other_columns,
    refuse_other_profile,
)
from shiplog.training.runs.voyages_to_test import held_back
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import plan

MEASURED = "measured_"


def frame(job: Job) -> pl.DataFrame:
    """voyage, time (UTC), elapsed [s], window, the predicted state's channels, what was measured,
    the actuators and the wind: SI, a row a second. Raises ShiplogError."""
    found = job.__dict__.get("_predicted")
    if found is None:
        found = job.__dict__["_predicted"] = _frame(job)
    return found


def _frame(job: Job) -> pl.DataFrame:
    run, store = job.run, job.store
    if store is None:
        raise StoreError(
            "Predictions are of voyages, and no store is given.", hint="give --store and --voyages."
        )
    names = held_back([run], store, list(job.voyages))
    profile = store.profile(names)
    refuse_other_columns(run, profile.columns, "the chosen voyages")
    refuse_other_profile(run, profile, "the chosen voyages")
    rows = store.seconds(names, profile)
    size = run.config.window
    planned = plan(rows, "ref", size)
    refuse_no_window(run, names, planned)
    cut = windows.cut(rows, planned, size, profile.actuator_names, profile.wind_names)
    states = simulate(run.models()[run.config.seeds[0]], cut)
    count = len(cut)
    index = cut.plan.with_columns(window=pl.int_range(pl.len()).over("voyage"))
    elapsed = index["elapsed"].to_numpy()[:, None] + cut.since
    columns: dict[str, np.ndarray | pl.Series] = {
        "voyage": np.repeat(index["voyage"].to_numpy(), size),
        "window": np.repeat(index["window"].to_numpy(), size),
        "elapsed": elapsed.reshape(-1),
    }
    for prefix, values in (("", states), (MEASURED, cut.state)):
        for i, c in enumerate(STATE):
            one = values[..., i].reshape(count * size)
            columns[prefix + c.name] = wrap(one) if c.circular else one
    columns |= {n: cut.actuator[..., i].reshape(-1) for i, n in enumerate(profile.actuator_names)}
    columns |= {n: cut.wind[..., i].reshape(-1) for i, n in enumerate(profile.wind_names)}
    found = pl.DataFrame(columns)
    # each sample of a window is a row of its voyage: its stamp is that row's
    stamps = rows.select("voyage", "elapsed", "time")
    return found.join(stamps, on=("voyage", "elapsed"), how="left").select(
        "voyage", "time", "elapsed", "window",
        *(n for n in found.columns if n not in ("voyage", "elapsed", "window")),
    )  # fmt: skip


def losses(job: Job) -> tuple[str, ...]:
    frame(job)
    run = job.run
    found = ["Samples that fill no window of the run's length."]
    if len(run.config.seeds) > 1:
        found.append(f"Seed {run.config.seeds[0]} of {len(run.config.seeds)}: no ensemble.")
    if run.band() is not None:
        found.append("The 90 % band: `shiplog compare` has it.")
    return tuple(found)


def apart(job: Job, read: pl.DataFrame) -> Difference:
    """Of a table that was read again, row by row, by channel."""
    own, found = frame(job), {}
    if len(own) != len(read):
        return Difference({"rows": float(abs(len(own) - len(read)))}, 0.0)
    for c in STATE:
        one, other = own[c.name].to_numpy(), read[c.name].cast(pl.Float64).to_numpy()
        both = np.isfinite(one)
        gap = np.abs(one[both] - other[both])
        found[c.name] = float(np.max(gap, initial=0.0))
    return Difference(found, seconds(job))


def seconds(job: Job) -> float:
    """How far into its voyage the last prediction is."""
    return float(frame(job)["elapsed"].to_numpy().max(initial=0.0))
