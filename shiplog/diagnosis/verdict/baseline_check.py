"""Whether a plain regression describes the ship far better than its physical model does."""

from __future__ import annotations

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.trial.trial_voyages import windows_of
from shiplog.ship_profile.profile import Profile
from shiplog.simulation import baselines
from shiplog.simulation.error_reduction import diverged, parts
from shiplog.simulation.rollout import simulate
from shiplog.training.runs.load_model import Run
from shiplog.voyages.store.store import Store

WORDS = ("surge", "sway", "yaw")


def lacking(run: Run, store: Store, profile: Profile) -> str:
    """Why the run's model cannot identify causes that change forces; empty where it can, that is
    where Σ L_plain/Σ L_model ≥ BASELINE.

    Quadratic least squares is fitted to all stored nominal voyages but one in turn, and rolled out
    on that one. The physical model was fitted to all of them, so the comparison favours it. Windows
    in which either diverges are left out.
    """
    if run.lacks or not run.judges_itself:
        return run.lacks
    cut = windows_of(run, store, store.there(run.trained_on), profile)
    voyages = [] if cut is None else cut.plan["voyage"].to_list()
    names = list(dict.fromkeys(voyages))
    if cut is None or len(names) < 2:
        return ""
    simulator = run.extended(run.config.seeds[0])
    own = parts(simulator.states(cut, simulator.theta) - cut.state, cut.dt)
    plain = np.empty_like(own)
    for name in names:
        out = np.array([v == name for v in voyages])
        fitted = baselines.least_squares(cut.pick(np.flatnonzero(~out)))
        left = cut.pick(np.flatnonzero(out))
        plain[out] = parts(simulate(fitted, left) - left.state, left.dt)
    counted = ~(diverged(own) | diverged(plain))
    if not counted.any():
        return ""
    own, plain = own[counted], plain[counted]
    share = plain.sum(1).mean() / max(own.sum(1).mean(), 1e-12)
    if share >= thresholds.BASELINE:
        return ""
    worst = int(np.argmax(own.mean(0) - plain.mean(0)))
    return (
        f"the model does not describe this ship's {WORDS[worst]} force: a plain regression has "
        f"{share:.0%} of its error"
    )
