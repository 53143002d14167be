"""`shiplog train --model FILE.py`: a simulator of one's own as a run, fitted to nothing."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from shiplog.commands.bars import reach, staged
from shiplog.commands.identify import baseline_losses
from shiplog.exceptions import ProfileError
from shiplog.foreign import logged, mapped
from shiplog.foreign import model as foreign_models
from shiplog.foreign import source as sources
from shiplog.foreign.source import Source
from shiplog.models import mmg
from shiplog.report.evaluation.foreign_training import ForeignTraining
from shiplog.report.result import Answer
from shiplog.ship_profile.profile import Profile
from shiplog.simulation import prediction_interval, scoring
from shiplog.training.physics import stand_in
from shiplog.training.runs import foreign_run, load_model, run_folder
from shiplog.training.runs.foreign_run import Kept
from shiplog.training.runs.load_model import ForeignRun, Run
from shiplog.training.runs.provenance import provenance
from shiplog.training.settings.run_config import Config, Foreign
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import choose_physical_split as choose
from shiplog.voyages.windows.split import plan, refuse_shared_rows, say
from shiplog.voyages.windows.split_settings import Split

log = logging.getLogger(__name__)

STAGES = {"opening": 2.0, "simulating": 3.0, "stand-in": 5.0}


@dataclass(frozen=True)
class Given:
    """What a user gives of a simulator.

    name       FILE.py, FILE.py:NAME, FILE.fmu or logs:/TOPIC
    mapping    of an FMU; next to it where none is given
    logs       that hold the topic
    unchecked  whether a mapping may still say CHECK
    """

    name: str
    mapping: Path | None = None
    logs: tuple[Path, ...] = ()
    unchecked: bool = False


def foreign_command(
    given: Given, store_path: Path, out: Path, voyages: tuple[str, ...],
    validation: tuple[str, ...], window: int,
) -> Answer:  # fmt: skip
    """Raises ShiplogError."""
    store, source = Store(store_path), sources.read(given.name)
    split = choose(store, voyages, validation, "ref", window)
    say(split)
    return foreign_run_of(source, store, out, split, window, given).answer(store.path)


@staged("simulator", STAGES)
def foreign_run_of(
    source: Source, store: Store, out: Path, split: Split, window: int, given: Given
) -> ForeignTraining:
    """The run of a simulator, with what it gets wrong on the voyages that it is good for."""
    began, used = time.time(), [*split.training, *split.validation]
    profile = store.profile(used)
    profile.require_actuators()
    rows = store.seconds(used, profile)
    refuse_shared_rows(rows, split)
    learnt = rows.filter(pl.col("voyage").is_in(split.training))
    held = rows.filter(pl.col("voyage").is_in(split.validation))
    planned = plan(learnt, "ref", window)
    reach("opening")
    every = foreign_run.rows_of(learnt, profile)
    tried = Tried(source, profile, every, given)
    settings, facts, kept = tried.logged(store) if source.kind == "logged" else tried.asked()
    config = Config(
        model="foreign", data="ref", window=window, seeds=(0,), split=split, foreign=settings
    )
    run = run_folder.create(out, config, profile, None, planned, learnt, held)
    foreign_run.save(run, kept, tried.states)
    reach("simulating")
    opened = load_model.of_folder(run, simulators=[given.name])
    cut = windows.cut(learnt, planned, window, profile.actuator_names, profile.wind_names)
    scores = scoring.score(opened.simulator(0), cut)
    error = scores.simulated - cut.state
    sound = np.isfinite(error).all((1, 2))
    if sound.any():
        groups = cut.plan["voyage"].n_unique()
        zero = np.zeros_like(error[sound])
        run.save_band(prediction_interval.calibrate(error[sound], zero, groups))
    reach("stand-in")
    most = int(min(stand_in.ROWS, stand_in.PATIENCE_S / max(facts["seconds"], 1e-9)))
    kept, why = _stood_in(opened, every, kept, most)
    foreign_run.save(run, kept, tried.states)
    done = load_model.of_folder(
        run.finish(provenance(store.hashes(used), began)), simulators=[given.name]
    )
    assert isinstance(done, ForeignRun)
    return ForeignTraining(
        done, facts, scores.errors["loss"].to_numpy(), baseline_losses(cut), kept, why,
        done.failures,
    )  # fmt: skip


class Tried:
    """A simulator, tried at rows of the ship's.

    states   of one that was logged
    """

    def __init__(self, source: Source, profile: Profile, rows: np.ndarray, given: Given) -> None:
        self.source, self.profile, self.rows, self.given = source, profile, rows, given
        self.states: pl.DataFrame | None = None

    def asked(self) -> tuple[Foreign, dict[str, Any], Kept]:
        """Of a callable or an FMU. Raises SimulatorError."""
        source, given, mapping = self.source, self.given, {}
        if source.kind == "fmu":
            mapping = mapped.of(source, self.profile, given.mapping, given.unchecked)
        settings = Foreign(
            name=source.name, sha256=source.sha256, kind=source.kind,  # type: ignore[arg-type]
            function=source.function, mapping=mapping,
        )  # fmt: skip
        probe = foreign_run.probe_of(self.rows)
        facts = foreign_run.bridge(source, self.profile, settings, probe).facts
        place = facts["place"] > foreign_models.SAME
        found = {
            "returns": facts["returns"], "step": facts["step"], "layout": facts["layout"],
            "derivatives": foreign_models.derivatives(facts), "place": place,
        }  # fmt: skip
        steps = foreign_models.steps_of(self.rows, place)
        kept = Kept(np.zeros(0), np.ones(3), steps, probe)
        return settings.model_copy(update=found), facts, kept

    def logged(self, store: Store) -> tuple[Foreign, dict[str, Any], Kept]:
        """Of states in logs, of all voyages of the store whose logs were given. Raises
        SimulatorError."""
        names = store.select()
        rows = store.seconds(names, self.profile).select("voyage", "time", "elapsed")
        self.states = logged.states_of(
            self.given.logs, self.source.function, rows, store.hashes(names)
        )
        settings = Foreign(
            name=self.source.name, kind="logged", function=self.source.function,
            sha256=self.source.sha256, returns="states that were logged", layout="logged",
            derivatives="those of an MMG that was fitted to its accelerations",
        )  # fmt: skip
        width = self.rows.shape[1]
        kept = Kept(np.zeros(0), np.ones(3), np.zeros(width - 1), np.zeros((0, width)))
        return settings, foreign_models.NOTHING_ODD, kept


def _stood_in(run: Run, rows: np.ndarray, kept: Kept, most: int) -> tuple[Kept, str]:
    """From so many rows, with the MMG that stands in; else why there is none."""
    try:
        ship = mmg.begin(run.profile, run.config.physics)
    except ProfileError as error:
        return kept, error.message
    assert isinstance(run, ForeignRun)
    some, f = run.accelerations(rows, most)
    found = stand_in.fit(ship.model, ship.start, some, f)
    return kept._replace(values=found.values, misfit=found.misfit), ""
