"""What a model is sailed from: first states and inputs as polars frames, orders that a ship has."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import polars as pl

from shiplog.exceptions import ModelError, listed
from shiplog.nomenclature.channels import STATE
from shiplog.simulation.schedules import Manoeuvre, Schedule

STATES = tuple(c.name for c in STATE)


def refuse_unknown(manoeuvre: Manoeuvre, names: tuple[str, ...]) -> None:
    """Raises ModelError for a schedule of actuators that the ship has not."""
    other = set(manoeuvre.orders) - set(names) if isinstance(manoeuvre, Schedule) else ()
    if other:
        raise ModelError(
            f"The schedule {manoeuvre.name} orders {listed(other)}, which the ship has not.",
            hint=f"its actuators are {listed(names)}.",
        )


def starts(start: pl.DataFrame | Mapping[str, float] | None, speed: float) -> np.ndarray:
    """States [N, 6] over ground; what is left out is zero, and the surge the run's usual one."""
    rows = pl.DataFrame({} if start is None else start) if not isinstance(start, pl.DataFrame) \
        else start  # fmt: skip
    other = set(rows.columns) - set(STATES) - {"member"}
    if other:
        raise ModelError(
            f"`start` has {listed(other)}, which is no part of a ship's state.",
            hint=f"its columns are {listed(STATES)}, SI.",
        )
    count = max(rows.height, 1)
    found = np.zeros((count, 6))
    found[:, 1] = speed
    for i, name in enumerate(STATES):
        if name in rows.columns:
            found[:, i] = rows[name].cast(pl.Float64).to_numpy()
    if not np.isfinite(found).all():
        raise ModelError("`start` has a state that is not finite.", hint="give numbers, SI.")
    return found


def tables(inputs: pl.DataFrame, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Times [K] and actuators [N, K, A] of rows (member), time, actuators."""
    lacking = [n for n in ("time", *names) if n not in inputs.columns]
    if lacking:
        raise ModelError(
            f"`inputs` lacks {listed(lacking)}.",
            hint=f"its columns are time [s] and {listed(names)}, SI; `member` where they differ.",
        )
    count = inputs["member"].n_unique() if "member" in inputs.columns else 1
    ordered = inputs.sort("member", "time") if count > 1 else inputs.sort("time")
    values = ordered.select("time", *names).cast(pl.Float64).to_numpy()
    if not len(values) or len(values) % count or not np.isfinite(values).all():
        raise ModelError(
            "`inputs` has no rows, members of other lengths, or values that are not finite.",
            hint="give every member the same times, and every row numbers, SI.",
        )
    values = values.reshape(count, -1, 1 + len(names))
    time = values[0, :, 0]
    if (values[..., 0] != time).any() or (np.diff(time) <= 0.0).any() or time[0] < 0.0:
        raise ModelError(
            "The times of `inputs` do not rise, or differ from member to member.",
            hint="give every member the same times, in seconds from zero on.",
        )
    return time, values[..., 1:]
