"""How far a given FMU goes its own way, which an FMU around it does not know.

An FMU may have states besides the ship's six (a motor's speed, a filter), and a step of its own.
Asked for an acceleration it begins anew, and these begin anew with it.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from shiplog.export.trial import SECONDS, Trial
from shiplog.foreign.rows import HEADING
from shiplog.simulation.sailing import Water
from shiplog.training.runs import sailing_run
from shiplog.training.runs.load_model import ForeignRun


def on_its_own(run: ForeignRun, trial: Trial) -> str:
    """The FMU without causes, reset once, against `simulate` of it on the trial's orders and wind:
    a sentence."""
    plain = replace(run, extension=None)
    sailor, calm = sailing_run.of_run(plain), Water(wind=trial.water.wind)
    sailed, _ = sailor.sail(trial.schedule, members=1, water=calm, seconds=SECONDS)
    state, acts = sailed.state[0], sailed.actuator[0]
    driven = np.concatenate((acts, np.tile(calm.wind, (len(acts), 1))), 1)
    model = plain.simulator(plain.config.seeds[0]).model
    own = model.roll(state[:1], driven[None], np.diff(sailed.time)[None], np.zeros(1))[0][0]
    there = np.isfinite(own).all(1) & np.isfinite(state).all(1)
    apart = np.abs(own - state)[there]
    found = [f"{math.degrees(float(apart[:, HEADING].max())):.2g} deg"]
    if {"x0", "y0"} <= set(run.config.foreign.mapping["state"]):
        found.insert(0, f"{float(np.hypot(apart[:, 0], apart[:, 2]).max()):.2g} m")
    return (
        f"How {run.config.foreign.name} goes on by itself, reset once at the start: it is "
        f"{' and '.join(found)} from `simulate` of it within "
        f"{float(sailed.time[there][-1]):.0f} s, both without causes."
    )
