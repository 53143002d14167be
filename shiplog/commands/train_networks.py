"""Voyages to a trained network: windows, then a training for each seed."""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.commands.bars import Bars
from shiplog.exceptions import listed
from shiplog.models.feedforward import scaling
from shiplog.nomenclature.contract import CONTRACT
from shiplog.report.result import Answer
from shiplog.ship_profile.profile import Profile
from shiplog.simulation import prediction_interval
from shiplog.simulation.rollout import simulate
from shiplog.training.network import gpu
from shiplog.training.network.network_training import ended
from shiplog.training.network.queue import Task, work
from shiplog.training.runs import load_model, run_folder
from shiplog.training.runs.load_model import NetworkRun, Run
from shiplog.training.runs.network_seeds import tasks_of, windows_of
from shiplog.training.runs.provenance import provenance
from shiplog.training.runs.run_checks import refuse_unended
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.settings.options import TrainOptions
from shiplog.training.settings.run_config import Config
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import ship_time, windows
from shiplog.voyages.windows.split import plan, refuse_shared_rows
from shiplog.voyages.windows.split_settings import Split

log = logging.getLogger(__name__)


def train_run(config: Config, store: Store, out: Path, device: str = "cpu") -> Run:
    """Train every seed of a run; goes on where an interrupted one stopped. Raises ShiplogError."""
    if device == gpu.CPU:
        return _trained(begin(config, store, out))
    from shiplog.commands.gpu import do as do_there  # torch's CUDA, only where it is asked for

    there = gpu.find()
    begun = begin(config, store, out)
    tasks = tasks_of(begun.run)
    refuse_unended(do_there(tasks, there), len(tasks))
    return finish(begun, gpu.name(there))


def train_network_again(old: RunFolder, out: Path) -> Run:
    """A finished run once more, from its folder alone: the same settings, rows and windows.

    Raises ShiplogError.
    """
    scale, rows = load_model.network(old).scaling(), (old.training(), old.validation())
    run = run_folder.create(out, old.config, old.profile, scale, old.windows(), *rows)
    return _trained(Begun(run, rows[1], old.logs_sha256(), time.time()))


def _trained(begun: Begun) -> Run:
    tasks = tasks_of(begun.run)
    failures = do(tasks)
    refuse_unended(failures, len(tasks))
    return finish(begun)


@dataclass(frozen=True)
class Begun:
    """A run that is being trained: its partial folder, and what finishing it needs.

    held          the 1 Hz rows of the validation voyages
    logs_sha256   voyage → hash of its log
    """

    run: RunFolder
    held: pl.DataFrame
    logs_sha256: Mapping[str, str | None]
    began: float


def begin(config: Config, store: Store, out: Path) -> Begun:
    """The partial folder of a run, with all that its seeds need. Raises ShiplogError."""
    split = config.split
    named = [*split.training, *split.validation]
    profile = store.profile(named)
    rows = store.seconds(named, profile)
    # it may be a part of a training voyage, which stands there under another name
    standard = store.seconds(config.standard, profile) if config.standard else None
    return begin_with(config, profile, rows, out, hashes=store.hashes(named), standard=standard)


def begin_with(
    config: Config,
    profile: Profile,
    rows: pl.DataFrame,
    out: Path,
    *,
    planned: pl.DataFrame | None = None,
    hashes: Mapping[str, str | None],
    standard: pl.DataFrame | None = None,
) -> Begun:
    """The same from 1 Hz rows. Raises ShiplogError.

    rows      of the training and the validation voyages, as `one_hertz.resample` gives them
    planned   the windows of the training voyages, as `split.plan` gives them
    hashes    voyage → SHA-256 of its log
    standard  rows whose windows give mean and standard deviation; those of the training voyages
    """
    profile.require_actuators()
    split = config.split
    learnt = rows.filter(pl.col("voyage").is_in(split.training))
    held = rows.filter(pl.col("voyage").is_in(split.validation))
    refuse_shared_rows(rows, split)

    names = (profile.actuator_names, profile.wind_names)
    size = config.window
    standard = learnt if standard is None else standard
    reference = windows.cut(standard, plan(standard, "ref", size), size, *names)
    chosen = plan(learnt, config.data, size) if planned is None else planned
    windows.cut(held, plan(held, "ref", size), size, *names)  # or say so before training
    run = run_folder.create(
        out, config, profile, scaling(reference, config.network.wind_input), chosen, learnt, held
    )
    log.info("training %s on %d windows of %s", run.label, chosen.height, listed(split.training))
    return Begun(run, held, hashes, time.time())


def finish(begun: Begun, device: str = "cpu") -> Run:
    """The run with its name, all seeds being trained; the last of them on `device`."""
    run = load_model.network(begun.run)
    run.save_band(_band(run, begun.held))
    done = run.finish(provenance(begun.logs_sha256, begun.began, device))
    return load_model.of_folder(done)


def do(tasks: Sequence[Task], workers: int | None = None) -> dict[str, str]:
    """Do all trainings, with progress on stderr. Returns those that failed, and why."""
    failures: dict[str, str] = {}
    costs = {task.name: task.cost for task in tasks}
    with Bars(costs) as bars, closing(work(tasks, workers)) as events:
        for event in events:
            bars.show(event.task.name, event.share, event.ended)
            if not event.ended:
                continue
            if event.failure:
                failures[event.task.name] = event.failure
                log.warning("%s: %s", event.task.name, event.failure)
            else:
                best, epochs, took = event.result
                log.info("%s: %s, %.0f s", event.task.name, ended(best, epochs), took)
    return failures


def _band(run: NetworkRun, held: pl.DataFrame) -> prediction_interval.Band:
    """How far off its seeds were on the validation voyages, which they did not learn from."""
    unseen = windows_of(run, held, plan(held, "ref", run.config.window))
    simulated = [simulate(model, unseen) for model in run.models().values()]
    error = np.concatenate([states - unseen.state for states in simulated])
    spread = np.concatenate([prediction_interval.seeds_spread(simulated)] * len(simulated))
    return prediction_interval.calibrate(error, spread, unseen.plan["voyage"].n_unique())


def network_command(store: Store, out: Path, options: TrainOptions, split: Split) -> Answer:
    """`shiplog train` of a network: every seed trained."""
    return answer(train_run(options.config(split), store, out, options.device), store.path)


def answer(run: Run, store_path: Path) -> Answer:
    """What there is to say of a trained run."""
    config = run.config
    best = {seed: float(run.history(seed)["validation"].min()) for seed in config.seeds}  # type: ignore[arg-type]
    line = ", ".join(f"{loss:.0f}" for loss in best.values())
    advice = ship_time.of(run.profile.ship.length_m, run.training()).advice(config.window)
    lines = (
        f"{run.label} in {run.path}: best validation L {line} (seeds 0 to {config.seeds[-1]}).",
        *([advice] if advice else []),
        f"Split by {config.split.chosen_by}. "
        f"Next: shiplog evaluate {run.path} --store {store_path}",
    )
    content = {
        "contract": CONTRACT,
        "run": str(run.path),
        "label": run.label,
        "windows": run.windows().height,
        "validation_loss": list(best.values()),
        "split": config.split.model_dump(mode="json"),
    }
    return Answer(lines, content)
