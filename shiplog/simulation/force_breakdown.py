"""Force components along a measured voyage."""

from __future__ import annotations

from typing import Any

import numpy as np
import polars as pl

from shiplog.machine.arrays import double
from shiplog.nomenclature.channels import STATE
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.sensitivities import Simulator
from shiplog.simulation.window_series import true_wind


def break_down(simulator: Simulator, seconds: pl.DataFrame, profile: Profile) -> pl.DataFrame:
    """Part by part at every measured second: voyage, time, part, surge [N], sway [N], yaw [N m].

    seconds   the 1 Hz table with `elapsed`; the forces are those at the measured motion
    """
    state = seconds.select([c.name for c in STATE]).to_numpy()
    actuator = seconds.select(profile.actuator_names).to_numpy()
    if profile.has_wind:
        blowing = true_wind(state, seconds.select(profile.wind_names).to_numpy())
    else:
        blowing = np.zeros((seconds.height, 2))
    with double(), np.errstate(all="ignore"):
        model: Any = simulator.model  # of a run: it has forces by part
        parts = model.forces(simulator.theta, state, actuator, blowing)
    found: dict[str, Any] = {name: np.asarray(force) for name, force in parts.items()}
    found["total"] = sum(found.values())
    index = seconds.select("voyage", pl.col("elapsed").alias("time"))
    tables = []
    for name, values in found.items():
        columns = {axis: values[:, i] for i, axis in enumerate(("surge", "sway", "yaw"))}
        tables.append(index.with_columns(pl.lit(name).alias("part")).hstack(pl.DataFrame(columns)))
    return pl.concat(tables)
