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
import torch

from pipelines.bars import Bars
from shiplog.exceptions import listed
from shiplog.logs.health_report import CONTRACT
from shiplog.models.feedforward import scaling
from shiplog.simulation import prediction_interval
from shiplog.simulation.rollout import simulate
from shiplog.training import (
    gpu,
    load_model,
    network_files,
    network_gradient,
    random_streams,
    run_folder,
)
from shiplog.training.jittering import jittered
from shiplog.training.job import Training
from shiplog.training.load_model import NetworkRun, Run
from shiplog.training.network_training import Progress, ended
from shiplog.training.options import TrainOptions
from shiplog.training.provenance import Answer, provenance
from shiplog.training.queue import Report, Task, work
from shiplog.training.run_checks import refuse_unended
from shiplog.training.run_config import Config
from shiplog.training.run_folder import RunFolder
from shiplog.voyages import windows
from shiplog.voyages.split import plan, refuse_shared_rows
from shiplog.voyages.split_settings import Split
from shiplog.voyages.store import Store
from shiplog.voyages.windows import Windows

log = logging.getLogger(__name__)


def train_run(config: Config, store: Store, out: Path, device: str = "cpu") -> Run:
    """Train every seed of a run; goes on where an interrupted one stopped. Raises ShiplogError."""
    if device == gpu.CPU:
        return _trained(begin(config, store, out))
    from pipelines.gpu import do as do_there  # which imports this module

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
    profile = store.profile([*split.training, *split.validation])
    profile.require_actuators()
    rows = store.seconds([*split.training, *split.validation], profile)
    learnt = rows.filter(pl.col("voyage").is_in(split.training))
    held = rows.filter(pl.col("voyage").is_in(split.validation))
    refuse_shared_rows(rows, split)

    names = (profile.actuator_names, profile.wind_names)
    size = config.window
    # it may be a part of a training voyage, which stands there under another name
    standard = store.seconds(config.standard, profile) if config.standard else learnt
    reference = windows.cut(standard, plan(standard, "ref", size), size, *names)
    chosen = plan(learnt, config.data, size)
    windows.cut(held, plan(held, "ref", size), size, *names)  # or say so before training
    run = run_folder.create(
        out, config, profile, scaling(reference, config.network.wind_input), chosen, learnt, held
    )
    log.info("training %s on %d windows of %s", run.label, chosen.height, listed(split.training))
    hashes = store.hashes([*split.training, *split.validation])
    return Begun(run, held, hashes, time.time())


def finish(begun: Begun, device: str = "cpu") -> Run:
    """The run with its name, all seeds being trained; the last of them on `device`."""
    run = load_model.network(begun.run)
    run.save_band(_band(run, begun.held))
    done = run.finish(provenance(begun.logs_sha256, begun.began, device))
    return load_model.of_folder(done)


def tasks_of(run: RunFolder) -> list[Task]:
    """The trainings of a run that are not finished; windows of an epoch are what they cost."""
    cost = float(run.windows().height)
    if run.config.recipe == "fast":
        cost = min(cost, run.config.fast.most_windows)
    return [
        Task(f"{run.name}, seed {seed}", train_seed, (run.path, seed), cost)
        for seed in run.config.seeds
        if not run.finished(seed)
    ]


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
    unseen = _cut(run, held, plan(held, "ref", run.config.window))
    simulated = [simulate(model, unseen) for model in run.models().values()]
    error = np.concatenate([states - unseen.state for states in simulated])
    spread = np.concatenate([prediction_interval.seeds_spread(simulated)] * len(simulated))
    return prediction_interval.calibrate(error, spread, unseen.plan["voyage"].n_unique())


def training_of(run: NetworkRun, seed: int) -> Training:
    """One seed of a begun run, with its windows."""
    config = run.config
    scale, shape = run.scaling(), run.shape
    learnt = _cut(run, run.training(), run.windows())
    learnt = jittered(learnt, random_streams.generator(seed, "jitter"))
    held = _cut(run, run.validation(), plan(run.validation(), "ref", config.window))
    training, validation = (
        network_gradient.batch(w, scale, shape, torch.float32) for w in (learnt, held)
    )
    model = run.empty_model().initialise(random_streams.generator(seed, "weights"))
    return Training(config, seed, model, training, validation)


def train_seed(path: Path, seed: int, report: Report | None = None) -> tuple[float, int, float]:
    """One seed of a begun run, in a process of its own. Returns best loss, epochs and seconds."""
    torch.set_num_threads(1)
    began = time.time()
    run = load_model.network(run_folder.open_folder(path))
    folder = run.seed(seed)

    def keep(progress: Progress) -> None:
        network_files.save_checkpoint(folder, progress)

    progress = training_of(run, seed).run(
        network_files.load_checkpoint(folder), keep, report=report
    )
    network_files.save(folder, progress)
    return progress.best, progress.epoch, time.time() - began


def _cut(run: RunFolder, rows: pl.DataFrame, planned: pl.DataFrame) -> Windows:
    names = (run.profile.actuator_names, run.profile.wind_names)
    return windows.cut(rows, planned, run.config.window, *names)


def network_command(store: Store, out: Path, options: TrainOptions, split: Split) -> Answer:
    """`shiplog train` of a network: every seed trained."""
    return answer(train_run(options.config(split), store, out, options.device), store.path)


def answer(run: Run, store_path: Path) -> Answer:
    """What there is to say of a trained run."""
    config = run.config
    best = {seed: float(run.history(seed)["validation"].min()) for seed in config.seeds}  # type: ignore[arg-type]
    line = ", ".join(f"{loss:.0f}" for loss in best.values())
    text = (
        f"{run.label} in {run.path}: best validation L {line} (seeds 0 to {config.seeds[-1]}).\n"
        f"Split by {config.split.chosen_by}. Next: shiplog evaluate {run.path} --store {store_path}"
    )
    content = {
        "contract": CONTRACT,
        "run": str(run.path),
        "label": run.label,
        "windows": run.windows().height,
        "validation_loss": list(best.values()),
        "split": config.split.model_dump(mode="json"),
    }
    return Answer(text, content)
