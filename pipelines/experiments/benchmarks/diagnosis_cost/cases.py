"""Stored trials that both builds can read: those of the goals' block, or folders of the user's."""

from __future__ import annotations

import json
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pipelines.experiments.benchmarks.diagnosis_cost.builds import Build, Failed, Worker

SEED = 20000  # first ship of the block `goals`
TRIAL_S = 7000  # length of the trials of the table
VOYAGES = ("trial_*",)
READY = "ready.json"


@dataclass(frozen=True)
class Case:
    """A trial.

    label    of the case
    ship     trials of one ship have the same nominal campaign, which is fitted once
    ours     folder with `store` and `run`, for this build
    theirs   the same as the older build reads it; None without one
    voyages  names and shell patterns
    """

    label: str
    ship: str
    ours: Path
    theirs: Path | None
    voyages: tuple[str, ...] = VOYAGES


def of_block(folder: Path, most: int, older: Build | None, scratch: Path) -> list[Case]:
    """The first trials of a folder of `hidden_effects --keep`; those of ships that lack are made
    there. Raises Failed."""
    from pipelines.experiments.hidden_effects import plan as plans
    from pipelines.experiments.hidden_effects import suites

    ships = -(-most // 5)  # of its six rows one is shorter
    try:
        plan = plans.load(folder)
    except Exception:
        plan = plans.save(folder, suites.plan("goals", SEED, ships))
    chosen = [planned for planned in plan.cases if planned.seconds == TRIAL_S][:most]
    found = []
    for planned in chosen:
        place = plans.case_folder(folder, planned)
        if not (place / "store").is_dir() or not (place / "base").is_dir():
            make(folder, planned)
        found.append(both(place / "store", place / "base", older, scratch / planned.label,
                          planned.label, str(planned.seed)))  # fmt: skip
    return found


def make(folder: Path, planned) -> None:
    """Logs, store and model of a case of the block; what is hidden in it is nobody's business here.
    Raises Failed."""
    from pipelines.experiments.hidden_effects import plan as plans
    from pipelines.experiments.hidden_effects import run

    place = plans.case_folder(folder, planned).resolve()
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    there = run.Prepared(place / "logs", place / "store", place / "base")
    key = plans.key_path(folder, planned).resolve()
    steps = run.prepare(planned, run.Settings(), place, there, key)
    if steps is None or run.failed(steps[-1]):
        raise Failed(f"the case {planned.label} could not be made: {steps and steps[-1]['stderr']}")
    shutil.rmtree(place / "logs", ignore_errors=True)


def both(
    store: Path, run: Path, older: Build | None, place: Path, label: str, ship: str,
    voyages: Sequence[str] = VOYAGES,
) -> Case:  # fmt: skip
    """A store and a run for both builds, from copies: what one of them keeps there changes nothing.
    The tables are the same bytes. Raises Failed."""
    ours = place / "ours"
    if not (ours / READY).is_file():
        shutil.rmtree(ours, ignore_errors=True)
        shutil.copytree(store, ours / "store")
        shutil.copytree(run, ours / "run", ignore=shutil.ignore_patterns("*.rrd", "evaluation"))
        (ours / READY).write_text("{}", encoding="utf-8")
    theirs = None
    if older is not None:
        theirs = place / (older.commit.rstrip("+") or "older")
        if not (theirs / READY).is_file():
            shutil.rmtree(theirs, ignore_errors=True)
            theirs.mkdir(parents=True)
            worker = Worker(older, place)
            try:
                left = worker.ask("readable", store=ours / "store", run=ours / "run", out=theirs)
            finally:
                worker.close()
            (theirs / READY).write_text(json.dumps(left), encoding="utf-8")
    return Case(label, ship, ours, theirs, tuple(voyages))
