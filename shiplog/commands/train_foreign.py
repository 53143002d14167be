"""`shiplog train --model FILE.py`: a simulator of one's own as a run, fitted to nothing."""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.commands.bars import reach, staged
from shiplog.commands.identify import baseline_losses
from shiplog.exceptions import ProfileError
from shiplog.foreign import mapped
from shiplog.foreign import model as foreign_models
from shiplog.foreign import source as sources
from shiplog.foreign.source import Source
from shiplog.models import mmg
from shiplog.report.evaluation.foreign_training import ForeignTraining
from shiplog.report.result import Answer
from shiplog.simulation import prediction_interval, scoring
from shiplog.simulation.foreign_model import Failure
from shiplog.training.physics import stand_in
from shiplog.training.runs import foreign_run, load_model, run_folder
from shiplog.training.runs.foreign_run import Kept
from shiplog.training.runs.provenance import provenance
from shiplog.training.settings.run_config import Config, Foreign
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import choose_physical_split as choose
from shiplog.voyages.windows.split import plan, refuse_shared_rows, say
from shiplog.voyages.windows.split_settings import Split

log = logging.getLogger(__name__)

STAGES = {"opening": 2.0, "simulating": 3.0, "stand-in": 5.0}


def foreign_command(
    given: str, store_path: Path, out: Path, voyages: tuple[str, ...],
    validation: tuple[str, ...], window: int, mapping: Path | None = None,
    unchecked: bool = False,
) -> Answer:  # fmt: skip
    """Raises ShiplogError."""
    store, source = Store(store_path), sources.read(given)
    split = choose(store, voyages, validation, "ref", window)
    say(split)
    done = foreign_run_of(source, store, out, split, window, mapping, unchecked)
    return done.answer(store.path)


@staged("simulator", STAGES)
def foreign_run_of(
    source: Source,
    store: Store,
    out: Path,
    split: Split,
    window: int,
    mapping: Path | None = None,
    unchecked: bool = False,
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
    every = foreign_run.rows_of(learnt, profile)
    probe = foreign_run.probe_of(every)
    settings = Foreign(
        name=source.name, sha256=source.sha256, kind=source.kind,  # type: ignore[arg-type]
        function=source.function,
        mapping=mapped.of(source, profile, mapping, unchecked) if source.kind == "fmu" else {},
    )  # fmt: skip
    reach("opening")
    bridge = foreign_run.bridge(source, profile, settings, probe)
    facts = bridge.facts
    place = facts["place"] > foreign_models.SAME
    settings = settings.model_copy(
        update={
            "returns": facts["returns"], "step": facts["step"], "layout": facts["layout"],
            "derivatives": foreign_models.derivatives(facts), "place": place,
        }
    )  # fmt: skip
    config = Config(
        model="foreign", data="ref", window=window, seeds=(0,), split=split, foreign=settings
    )
    run = run_folder.create(out, config, profile, None, planned, learnt, held)
    steps = foreign_models.steps_of(every, place)
    none = np.zeros(0)
    kept = Kept(none, np.ones(3), steps, probe)
    foreign_run.save(run, kept)
    reach("simulating")
    opened = replace(load_model.of_folder(run, simulators=[_given(source)]))
    names = (profile.actuator_names, profile.wind_names)
    cut = windows.cut(learnt, planned, window, *names)
    simulator = opened.simulator(0)
    scores = scoring.score(simulator, cut)
    error = scores.simulated - cut.state
    sound = np.isfinite(error).all((1, 2))
    if sound.any():
        zero = np.zeros_like(error[sound])
        groups = cut.plan["voyage"].n_unique()
        run.save_band(prediction_interval.calibrate(error[sound], zero, groups))
    reach("stand-in")
    kept, why = _stood_in(opened, every, kept)
    foreign_run.save(run, kept)
    done = run.finish(provenance(store.hashes(used), began))
    voyage = learnt["voyage"].to_list()[0]
    noted = [Failure(voyage, second, words) for _, second, words in facts["troubles"]]
    return ForeignTraining(
        load_model.of_folder(done, simulators=[_given(source)]),
        facts, scores.errors["loss"].to_numpy(), baseline_losses(cut), kept, why,
        tuple(dict.fromkeys((*simulator.failures, *noted))),
    )  # fmt: skip


def _stood_in(run: load_model.Run, rows: np.ndarray, kept: Kept) -> tuple[Kept, str]:
    """With the MMG that stands in; else why there is none."""
    try:
        ship = mmg.begin(run.profile, run.config.physics)
    except ProfileError as error:
        return kept, error.message
    some = rows[:: max(1, len(rows) // stand_in.ROWS)]
    f = run.simulator(0).model.accelerations(some[:, :6], some[:, 6:-1])
    found = stand_in.fit(ship.model, ship.start, some[:, :-1], f)
    return kept._replace(values=found.values, misfit=found.misfit), ""


def _given(source: Source) -> str:
    if source.kind == "logged":
        return f"{sources.LOGGED}{source.function}"
    return f"{source.path}:{source.function}" if source.function else str(source.path)
