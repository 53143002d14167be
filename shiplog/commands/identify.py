"""Voyages to an identified physical model: its run, what held-out voyages say of it, its band."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from threadpoolctl import threadpool_limits

from shiplog.commands.bars import reach, staged
from shiplog.exceptions import listed
from shiplog.machine import files
from shiplog.models.coefficients import Parameters
from shiplog.report.evaluation.identification import PAGE, Identification
from shiplog.report.evaluation.text_table import inert
from shiplog.report.result import Answer
from shiplog.simulation import baselines, prediction_interval, scoring
from shiplog.simulation.sensitivities import Simulator, losses, rollout
from shiplog.simulation.window_series import WindowSeries
from shiplog.training.physics import identifiability, physics_files
from shiplog.training.physics.cross_validation import CrossValidated, cross_validate
from shiplog.training.physics.held_out import (
    HeldOutErrors,
    refuse_nothing_held_out,
    unfitted_sentence,
)
from shiplog.training.physics.model_selection import choose_network, choose_ridge, physics
from shiplog.training.physics.output_error import Identified
from shiplog.training.physics.setup import Prepared, prepare
from shiplog.training.runs import load_model, plausible_model, run_folder, trust_file
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.provenance import provenance
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.settings.options import TrainOptions
from shiplog.training.settings.run_config import Config
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import ship_time, windows
from shiplog.voyages.windows.split import plan, refuse_shared_rows
from shiplog.voyages.windows.split_settings import Split
from shiplog.voyages.windows.windows import Windows

log = logging.getLogger(__name__)


# seconds of the sample logs' first two voyages
STAGES = {"fit": 15.0, "held-out voyages": 20.0, "held-out days": 1.0, "saving": 2.0}


@staged("identifying", STAGES)
@threadpool_limits.wrap(limits=1, user_api="blas")  # of matrices too small to share out
def identify_run(
    config: Config, store: Store, out: Path, parameters: Path | None = None
) -> tuple[Run, Identification]:
    """Identify a physical model, hold voyages out, save the run and say what was found.

    Raises ShiplogError.
    """
    began = time.time()
    hashes = store.hashes([*config.split.training, *config.split.validation])
    return _finish(*_begin(config, store, out, parameters), hashes, began)


@staged("identifying", STAGES)
@threadpool_limits.wrap(limits=1, user_api="blas")
def identify_again(old: RunFolder, out: Path) -> tuple[Run, Identification]:
    """A run once more, from its folder alone: settings, rows, windows and starting values.

    Raises ShiplogError.
    """
    began, rows = time.time(), (old.training(), old.validation())
    known = old.identified(old.config.seeds[0])
    ready = prepare(old.config, old.profile, *rows, old.windows(), None, known)
    run = run_folder.create(out, old.config, old.profile, None, old.windows(), *rows)
    return _finish(run, ready, old.logs_sha256(), began)


def _finish(
    run: RunFolder, ready: Prepared, hashes: Mapping[str, str | None], began: float
) -> tuple[Run, Identification]:
    """The run identified, if that is asked of it, and under its name."""
    chosen: dict = {}
    if not run.config.physics.fit:
        found = _keep(run, ready)
    else:
        found, choices = _identify(run, ready)
        chosen = {"chosen": choices}
    done = load_model.of_folder(run.finish(provenance(hashes, began) | chosen))
    questions = plausible_model.questions(done)
    rows, size = done.training(), done.config.window
    ship = ship_time.of(done.profile.ship.length_m, rows)
    names = (done.profile.actuator_names, done.profile.wind_names)
    result = Identification(
        done, found.errors, (*found.sentences, *questions), (*found.doubts, *questions),
        baseline_losses(windows.cut(rows, done.windows(), size, *names)),
        (ship.words(size), ship.advice(size)), trust_file.of_run(done),
    )  # fmt: skip
    files.write_text(done.path / PAGE, inert(result.page))
    return done, result


class Found(NamedTuple):
    """L before and after in a sentence; all sentences; those of them that ask for a look."""

    errors: str
    sentences: list[str]
    doubts: list[str]


def baseline_losses(cut: Windows) -> dict[str, float]:
    """Mean L of both baselines on the windows that one of them is fitted to."""
    fitted = baselines.least_squares(cut)
    return {
        name: float(scoring.score(model, cut).errors["loss"].to_numpy().mean())
        for name, model in (("hold", baselines.hold), ("least_squares", fitted))
    }


def _begin(
    config: Config, store: Store, out: Path, parameters: Path | None
) -> tuple[RunFolder, Prepared]:
    """The partial folder of a run, its equations, starting values and windows."""
    split = config.split
    used = [*split.training, *split.validation]
    profile = store.profile(used)
    profile.require_actuators()
    rows = store.seconds(used, profile)
    refuse_shared_rows(rows, split)
    learnt = rows.filter(pl.col("voyage").is_in(split.training))
    held = rows.filter(pl.col("voyage").is_in(split.validation))
    planned = plan(learnt, config.data, config.window)
    ready = prepare(config, profile, learnt, held, planned, parameters)
    refuse_nothing_held_out(config, ready, held)
    resolved = {"parameters": ready.start.source, "substeps": ready.model.substeps}
    settings = config.physics.model_copy(update=resolved)
    config = config.model_copy(update={"physics": settings})
    run = run_folder.create(out, config, profile, None, planned, learnt, held)
    log.info("%s of %s: %s", run.label, listed(split.training), ready.sentence(config.physics.fit))
    return run, ready


def _identify(run: RunFolder, ready: Prepared) -> tuple[Found, dict]:
    """Every seed identified and saved, with its band. Returns what there is to say, and what
    held-out voyages chose."""
    settings = run.config.physics
    chosen, found, notes = choose_ridge(ready, settings)
    kept = {ready.data.weight.tobytes(): found}

    def refit(part: WindowSeries) -> Identified:
        """The physics without some windows: asked for again by every strength of a network."""
        key = part.weight.tobytes()
        if key not in kept:
            kept[key] = physics(ready, part, chosen.value)
        return kept[key]

    held_out = _hold_out(ready, refit, settings.folds)
    notes += held_out.sentences(ready, found, settings.folds)
    names, spread = ready.start.names, ready.start.spread
    notes += identifiability.separated(
        found, names, spread, lambda name: ready.start.entry(name).meaning
    )
    doubts = identifiability.doubts(found, names, spread, (ready.start.low, ready.start.high))
    notes += doubts
    reach("saving")
    choices: dict = {"ridge": chosen.as_json()}
    validated = held_out.by_voyage
    for seed in run.config.seeds:
        if run.kind.residual:
            network, simulator, done, sentence, validated = choose_network(
                ready, settings, refit, held_out.by_voyage, seed
            )
            save(run, seed, ready.start, simulator, done)
            choices |= {f"network of seed {seed}": network.as_json()}
            notes.append(sentence)
            doubts.append(sentence)
        else:
            save(run, seed, ready.start, _simulator(ready.model, found), found)
    if held_out.by_voyage is not None:
        run.save_cross_validation(held_out.table())
    _band(run, ready, validated)
    return Found(held_out.line(ready, found, settings.folds), notes, doubts), choices


def _hold_out(
    ready: Prepared, refit: Callable[[WindowSeries], Identified], folds: int
) -> HeldOutErrors:
    def fit(part: WindowSeries) -> Simulator:
        return _simulator(ready.model, refit(part))

    before = losses(ready.model, ready.start.values, ready.data)
    reach("held-out voyages")
    by_voyage = cross_validate(fit, ready.data, ready.voyages, folds)
    reach("held-out days")
    by_day = None
    if len(set(ready.days)) > 1 and _apart(ready.days, ready.voyages):
        by_day = cross_validate(fit, ready.data, ready.days, folds)
    return HeldOutErrors(before, by_voyage, by_day)


def save(
    run: RunFolder,
    seed: int,
    start: Parameters,
    simulator: Simulator,
    found: Identified | None,
) -> None:
    """One seed's numbers, for machines and as a TOML that --parameters takes."""
    count = len(start.names)
    values = simulator.theta[:count]
    source = f"identified by shiplog in {run.name}" if found else start.source
    error = found.standard_error[:count] if found else np.zeros(count)
    free = found.free[:count] if found else np.zeros(count, dtype=bool)
    entries = [start.entry(name) for name in start.names]
    identified = pl.DataFrame(
        {
            "name": start.names,
            "symbol": [e.symbol for e in entries],
            "meaning": [e.meaning for e in entries],
            "unit": [e.unit for e in entries],
            "start": start.values,
            "spread": start.spread,
            "value": values,
            "standard_error": error,
            "free": free,
        }
    )
    toml = start.with_values(values, source).to_toml()
    fixed: Mapping[str, np.ndarray] = simulator.model.fixed  # type: ignore[attr-defined]
    physics_files.save(run.seed(seed), simulator, fixed, toml, identified)


def _apart(days: list[str], voyages: list[str]) -> bool:
    """Whether days are other groups than voyages: some day holds several."""
    return len(set(zip(days, voyages, strict=True))) > len(set(days))


def _keep(run: RunFolder, ready: Prepared) -> Found:
    """A run of the starting values as they are; no fit has used these errors."""
    nothing = np.zeros((len(ready.start.values),) * 2)
    simulator = Simulator(ready.model, ready.start.values, nothing)
    for seed in run.config.seeds:
        save(run, seed, ready.start, simulator, None)
    states = rollout(ready.model, ready.start.values, ready.data)
    error = states - ready.data.measured
    run.save_band(
        prediction_interval.calibrate(error, np.zeros_like(states), len(set(ready.voyages)))
    )
    loss = losses(ready.model, ready.start.values, ready.data)
    sentence = unfitted_sentence(loss)
    return Found(sentence, [sentence], [])


def _simulator(model: Any, found: Identified) -> Simulator:
    return Simulator(model, found.values, found.covariance)


def _band(run: RunFolder, ready: Prepared, validated: CrossValidated | None) -> None:
    """Learn the band on every voyage that was held out: in turn, and those for validation."""
    errors, spreads, groups = [], [], 0
    if validated is not None:
        errors.append(validated.states - ready.data.measured)
        spreads.append(validated.spread)
        groups += len(set(ready.voyages))
    if ready.unseen is not None:
        simulator = load_model.of_folder(run).simulator(run.config.seeds[0])
        errors.append(simulator.simulate(ready.unseen) - ready.unseen.state)
        spreads.append(simulator.spread(ready.unseen))
        groups += ready.unseen.plan["voyage"].n_unique()
    if errors:
        run.save_band(
            prediction_interval.calibrate(np.concatenate(errors), np.concatenate(spreads), groups)
        )


def identify_command(store: Store, out: Path, options: TrainOptions, split: Split) -> Answer:
    """`shiplog train` of a physical model."""
    options = options.without_idle_seeds()
    _, found = identify_run(options.config(split), store, out, options.parameters)
    return found.answer(store.path)
