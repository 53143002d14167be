"""A run's model on a schedule, a standard manoeuvre, or the inputs of a voyage."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from shiplog.commands.bars import staged
from shiplog.manoeuvres import simulated
from shiplog.models.causes import user
from shiplog.report import simulation as simulations
from shiplog.report.simulation import Simulation
from shiplog.simulation.sailing import STILL, Water
from shiplog.simulation.schedules import Manoeuvre
from shiplog.training.runs import load_model, sailing_run, voyage_inputs
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.sailing_run import MEMBERS
from shiplog.voyages.store.store import Store

STAGES = {"sailing": 3.0}


@staged("simulating", STAGES)
def simulate_run(
    run: Run,
    manoeuvre: Manoeuvre,
    *,
    speed: float | None = None,
    water: Water = STILL,
    members: int = MEMBERS,
    seed: int = 0,
    seconds: float | None = None,
    out: Path | None = None,
) -> Simulation:
    """From a straight approach at that speed. Raises ShiplogError."""
    sailor = sailing_run.of_run(run)
    done = simulated.sail(
        sailor, manoeuvre, members, speed=speed, water=water, seed=seed, seconds=seconds
    )
    found = Simulation(
        run.name, manoeuvre.name, manoeuvre.kind, run.profile, done.sailed, done.outside,
        done.quantities, sailor.notes(manoeuvre, speed),
    )  # fmt: skip
    return _written(found, out)


@staged("simulating", STAGES)
def simulate_voyage(
    run: Run, store: Store, voyage: str, *, members: int = MEMBERS, seed: int = 0,
    out: Path | None = None,
) -> Simulation:  # fmt: skip
    """On a voyage's own inputs, from its first measured state. Raises ShiplogError."""
    sailed, outside, notes = voyage_inputs.sail(run, store, voyage, members, seed)
    found = Simulation(
        run.name, f"the inputs of {voyage}", "voyage", run.profile, sailed, outside, {}, notes
    )
    return _written(found, out)


def _written(found: Simulation, out: Path | None) -> Simulation:
    if out is None:
        return found
    simulations.write(found, out)
    return replace(found, saved=out)


def load(path: Path, cause_files: Sequence[Path], simulators: Sequence[str] = ()) -> Run:
    return load_model.load(path, user.load(cause_files), simulators)
