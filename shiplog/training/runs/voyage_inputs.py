"""A run's model on the recorded inputs of a voyage, from its first measured state on."""

from __future__ import annotations

import numpy as np
import polars as pl

from shiplog.exceptions import WindowError
from shiplog.nomenclature.channels import STATE, WIND
from shiplog.simulation import rollout
from shiplog.simulation.extended_simulator import ExtendedSimulator
from shiplog.simulation.sailing import STILL, Sailed
from shiplog.simulation.sensitivities import Simulator
from shiplog.simulation.sensitivities import rollout as physical_rollout
from shiplog.simulation.window_series import series
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.run_checks import refuse_other_columns, refuse_other_profile
from shiplog.training.runs.sailing_run import Outside, Sailor, of_run
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.windows import Windows

LEAST = 2  # rows of a stretch
MOST_DRAWS = 50  # of an extended model's numbers: each is a rollout by itself


def sail(
    run: Run, store: Store, voyage: str, members: int, seed: int
) -> tuple[Sailed, Outside, tuple[str, ...]]:
    """All members over the longest unbroken stretch of the voyage. Raises ShiplogError.

    The states are what the instruments would have measured: they compare with the record.
    """
    profile = store.profile([voyage])
    refuse_other_columns(run, profile.columns, "the voyage")
    refuse_other_profile(run, profile, "the voyage")
    rows = store.seconds([voyage], profile)
    lengths = rows.group_by("segment").len().sort("len", "segment", descending=[True, False])
    if lengths.is_empty() or lengths["len"][0] < LEAST:
        raise WindowError(
            f"{voyage} has no two seconds that follow each other.",
            hint="ingest its log again: `shiplog ingest` reports what makes rows unusable.",
        )
    segment, size = lengths.row(0)
    chosen = rows.filter(pl.col("segment") == segment)
    plan = pl.DataFrame({"voyage": [voyage], "segment": [segment], "start": [0], "copy": [0]},
                        schema_overrides={"segment": rows.schema["segment"]})  # fmt: skip
    cut = windows.cut(chosen, plan, size, profile.actuator_names, profile.wind_names)
    sailor = of_run(run)
    states = _members(run, cut, members, seed)
    sailed = _as_sailed(states, cut, sailor)
    notes = [
        f"{size} s from second {float(chosen['elapsed'][0]):.0f} on."
        if len(lengths) == 1 else
        f"{size} s from second {float(chosen['elapsed'][0]):.0f} on: the longest of "
        f"{len(lengths)} unbroken stretches."
    ]  # fmt: skip
    outside = _outside(sailor, sailed, cut)
    return sailed, outside, tuple(notes)


def _members(run: Run, cut: Windows, members: int, seed: int) -> np.ndarray:
    """[N, I, 6]"""
    models = list(run.models().values())
    if members < 2:
        return rollout.simulate(models[0], cut)
    first = models[0]
    found = [rollout.simulate(one, cut) for one in models]
    covariance = getattr(first, "covariance", None)
    if covariance is not None and np.any(covariance):
        rng = np.random.default_rng(seed)
        values, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        for _ in range(min(members, MOST_DRAWS) - len(found)):
            theta = first.theta + root @ rng.standard_normal(len(first.theta))
            found.append(_of_theta(first, theta, cut))
    return np.concatenate(found)


def _of_theta(model: Simulator | ExtendedSimulator, theta: np.ndarray, cut: Windows) -> np.ndarray:
    if isinstance(model, ExtendedSimulator):
        return model.states(cut, theta)
    return physical_rollout(model.model, theta, series(cut))


def _as_sailed(states: np.ndarray, cut: Windows, sailor: Sailor) -> Sailed:
    count = len(states)
    bad = ~(np.abs(states[..., [1, 3, 5]]) < sailor.limits).all(-1)
    first = np.where(np.any(bad, axis=1), bad.argmax(1), states.shape[1])
    since = cut.since[0]
    diverged = np.where(np.any(bad, axis=1), since[np.minimum(first, len(since) - 1)], np.inf)
    kept = np.where((np.arange(states.shape[1]) < first[:, None])[..., None], states, np.nan)
    actuator = np.repeat(cut.actuator, count, axis=0)
    ended = np.where(np.any(bad, axis=1), np.inf, since[-1])
    return Sailed(since, kept, actuator, ended, diverged, STILL, sailor.profile.actuator_names)


def _outside(sailor: Sailor, sailed: Sailed, cut: Windows) -> Outside:
    """Of the recorded seconds: what the model is asked about."""
    names = [c.name for c in STATE]
    columns = {n: cut.state[0, :, i] for i, n in enumerate(names)}
    columns |= {n: cut.actuator[0, :, i] for i, n in enumerate(sailed.names)}
    columns |= {c.name: cut.wind[0, :, i] for i, c in enumerate(WIND) if cut.wind.shape[-1]}
    return sailor.outside_rows(pl.DataFrame(columns))
