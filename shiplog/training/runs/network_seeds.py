"""One seed of a begun run: its task, its windows, and the process that trains it."""

from __future__ import annotations

import time
from pathlib import Path

import polars as pl
import torch

from shiplog.training.network import network_files, network_gradient
from shiplog.training.network.jittering import jittered
from shiplog.training.network.job import Training
from shiplog.training.network.network_training import Progress
from shiplog.training.network.queue import Report, Task
from shiplog.training.runs import load_model, run_folder
from shiplog.training.runs.load_model import NetworkRun
from shiplog.training.runs.run_folder import RunFolder
from shiplog.training.settings import random_streams
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import plan
from shiplog.voyages.windows.windows import Windows


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


def training_of(run: NetworkRun, seed: int) -> Training:
    """One seed of a begun run, with its windows."""
    config = run.config
    scale, shape = run.scaling(), run.shape
    learnt = windows_of(run, run.training(), run.windows())
    learnt = jittered(learnt, random_streams.generator(seed, "jitter"))
    held = windows_of(run, run.validation(), plan(run.validation(), "ref", config.window))
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


def windows_of(run: RunFolder, rows: pl.DataFrame, planned: pl.DataFrame) -> Windows:
    """Windows of 1 Hz rows as a run cuts them."""
    names = (run.profile.actuator_names, run.profile.wind_names)
    return windows.cut(rows, planned, run.config.window, *names)
