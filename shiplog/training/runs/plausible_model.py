"""What is implausible of an identified model: its thrust against its resistance and its weight."""

from __future__ import annotations

import numpy as np
import polars as pl

from shiplog.models.mmg.estimate import GRAVITY
from shiplog.ship_profile.profile import Profile
from shiplog.training.runs.load_model import Run
from shiplog.voyages.contradictions import plausible_measures
from shiplog.voyages.contradictions.plausibility import Asked, findings

DRIVES = ("propeller", "thruster")
STEADY = 0.05  # share of the working speed by which a steady ship changes over 2 s
WORKING = 0.5  # share of it, from which a ship is under way
LEAST_ROWS = 20  # s of steady motion ahead


def questions(run: Run) -> list[str]:
    """Sentences on what no ship has, of a physical model on its training voyages."""
    asked = plausible_measures.of_model(run.profile)
    rows = run.training()
    if not run.given and (forces := run.forces(rows)) is not None:
        asked += measured(forces, rows, run.profile)
    return [found.sentence for found in findings(asked)]


def measured(forces: pl.DataFrame, rows: pl.DataFrame, profile: Profile) -> list[Asked]:
    """The ratios of the table in `plausibility`.

    forces   part by part at every second of `rows`, as `force_breakdown.break_down` gives them
    """
    by = {name: frame["surge"].to_numpy() for (name,), frame in
          forces.group_by("part", maintain_order=True)}  # fmt: skip
    if not any(name in by for name in DRIVES):
        return []
    drive = sum((by[name] for name in DRIVES if name in by), np.zeros(rows.height))
    actuators = [a for a in profile.actuators if a.kind in DRIVES]
    name, mass = actuators[0].name, profile.ship.mass_kg
    asked = []
    if mass:
        most = float(np.nanmax(np.abs(drive), initial=0.0))
        asked.append(Asked("thrust of the model", most / (mass * GRAVITY), name, name))
    surge = rows["surge"].to_numpy()
    working = float(np.quantile(np.abs(surge), plausible_measures.QUANTILE))
    change = np.abs(np.gradient(surge)) * 2.0 if len(surge) > 1 else np.full(len(surge), np.inf)
    steady = (surge > WORKING * working) & (change < STEADY * working)
    steady &= np.stack([rows[a.name].to_numpy() != 0.0 for a in actuators]).any(0)
    if steady.sum() >= LEAST_ROWS and "hull" in by:
        resistance = -float(np.median(by["hull"][steady]))
        if resistance > 0.0:
            thrust = float(np.median((drive + by.get("rudder", 0.0))[steady]))
            asked.append(Asked("drive of the model", thrust / resistance, name, name))
    return asked
