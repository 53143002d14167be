"""Voyages to a trained network: windows, one process a seed."""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from pathlib import Path

import numpy as np
import polars as pl
import torch

from pipelines.prepare import seconds
from pipelines.provenance import Answer, provenance
from pipelines.split import choose_split, plan, refuse_shared_rows, say
from shiplog import band, runs, seeds, train, windows
from shiplog.arguments import refuse_taken
from shiplog.config import Config
from shiplog.exceptions import RunError, listed
from shiplog.findings import CONTRACT
from shiplog.models.feedforward import scaling
from shiplog.runs import Run
from shiplog.simulate import simulate
from shiplog.store import Store
from shiplog.train import Progress
from shiplog.training import network_gradient
from shiplog.windows import Windows

log = logging.getLogger(__name__)


def train_run(config: Config, store: Store, out: Path) -> Run:
    """Train every seed of a run; goes on where an interrupted one stopped. Raises ShiplogError."""
    split = config.split
    profile = store.profile([*split.training, *split.validation])
    profile.require_actuators()
    rows = seconds(store, [*split.training, *split.validation], profile)
    learnt = rows.filter(pl.col("voyage").is_in(split.training))
    held = rows.filter(pl.col("voyage").is_in(split.validation))
    refuse_shared_rows(rows, split)

    names = (profile.actuator_names, profile.wind_names)
    size = config.window
    reference = windows.cut(learnt, plan(learnt, "ref", size), size, *names)
    chosen = plan(learnt, config.data, size)
    windows.cut(held, plan(held, "ref", size), size, *names)  # or say so before training
    run = runs.create(
        out, config, profile, scaling(reference, config.network.wind_input), chosen, learnt, held
    )
    log.info("training %s on %d windows of %s", run.label, chosen.height, listed(split.training))

    began = time.time()
    todo = [seed for seed in config.seeds if not run.finished(seed)]
    cores = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    workers = max(1, min(cores, len(todo)))
    with (
        _one_thread(),
        ProcessPoolExecutor(workers, get_context("spawn"), initializer=_end_with_parent) as pool,
    ):
        futures = {pool.submit(train_seed, run.path, seed): seed for seed in todo}
        try:
            for future in as_completed(futures):
                best, epochs, took = future.result()
                log.info(
                    "seed %d: best validation L %.0f after %d epochs, %.0f s",
                    futures[future],
                    best,
                    epochs,
                    took,
                )
        except BrokenProcessPool as error:
            raise RunError(
                "A training process was ended from outside, perhaps for want of memory.",
                hint="give the same command again: finished seeds and checkpoints are kept.",
            ) from error
        except BaseException:  # or the pool waits for seeds that may take hours
            for process in active_children():
                process.terminate()
            raise
    run.save_band(_band(run, held))
    return run.finish(provenance(store, split, began))


def _band(run: Run, held: pl.DataFrame) -> band.Band:
    """How far off its seeds were on the validation voyages, which they did not learn from."""
    unseen = _cut(run, held, plan(held, "ref", run.config.window))
    simulated = [simulate(model, unseen).numpy() for model in run.models().values()]
    error = np.concatenate([states - unseen.state.numpy() for states in simulated])
    spread = np.concatenate([band.seeds_spread(simulated)] * len(simulated))
    return band.calibrate(error, spread, len(run.config.split.validation))


def _end_with_parent() -> None:
    """In a training process: whatever ends the command ends this too, and Ctrl-C is the command's
    to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()

    def wait() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


@contextmanager
def _one_thread() -> Iterator[None]:
    """One core, one training: numerical libraries of child processes read this at import.

    Two threads on products this small wait for each other more than they work, and on a busy
    machine for each other alone.
    """
    names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    before = {name: os.environ.get(name) for name in names}
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def train_seed(path: Path, seed: int) -> tuple[float, int, float]:
    """One seed of a begun run, in a process of its own. Returns best loss, epochs and seconds."""
    torch.set_num_threads(1)
    began = time.time()
    run = runs.open_folder(path)
    config = run.config
    scale, shape = run.scaling(), run.shape
    learnt = _cut(run, run.training(), run.windows())
    learnt = windows.jittered(learnt, seeds.generator(seed, "jitter"))
    held = _cut(run, run.validation(), plan(run.validation(), "ref", config.window))
    training, validation = (
        network_gradient.batch(w, scale, shape, torch.float32) for w in (learnt, held)
    )
    model = run.empty_model().initialise(seeds.generator(seed, "weights"))

    def keep(progress: Progress) -> None:
        run.save_checkpoint(seed, progress)

    if config.recipe == "paper":
        progress = train.paper(
            model,
            training,
            validation,
            config.paper,
            seed,
            resume=run.load_checkpoint(seed),
            checkpoint=keep,
        )
    else:
        progress = train.fast(model, training, validation, config.fast, seed)
    run.save_seed(seed, progress)
    return progress.best, progress.epoch, time.time() - began


def _cut(run: Run, rows: pl.DataFrame, planned: pl.DataFrame) -> Windows:
    names = (run.profile.actuator_names, run.profile.wind_names)
    return windows.cut(rows, planned, run.config.window, *names)


def train_command(
    store_path: Path,
    out: Path,
    *,
    model: str,
    data: str,
    voyages: Sequence[str],
    validation: Sequence[str],
    seeds: int,
    recipe: str,
    window: int,
    width: int,
    wind_input: str | None,
    epochs: int | None,
) -> Answer:
    """`shiplog train`: choices checked, split chosen and said, every seed trained."""
    refuse_taken(out)
    store = Store(store_path)
    split = choose_split(store, voyages, validation, data, window)
    say(split)
    config = Config.model_validate(
        {
            "model": model,
            "data": data,
            "recipe": recipe,
            "window": window,
            "split": split,
            "seeds": tuple(range(seeds)),
            "network": {"width": width} | ({"wind_input": wind_input} if wind_input else {}),
            "paper": {"most_epochs": epochs} if epochs else {},
            "fast": {"iterations": epochs} if epochs else {},
        }
    )
    run = train_run(config, store, out)
    best = {seed: float(run.history(seed)["validation"].min()) for seed in config.seeds}  # type: ignore[arg-type]
    said = ", ".join(f"{loss:.0f}" for loss in best.values())
    text = (
        f"{run.label} in {run.path}: best validation L {said} (seeds 0 to {seeds - 1}).\n"
        f"Split by {split.chosen_by}. Next: shiplog evaluate {run.path} --store {store_path}"
    )
    content = {
        "contract": CONTRACT,
        "run": str(run.path),
        "label": run.label,
        "windows": run.windows().height,
        "validation_loss": list(best.values()),
        "split": split.model_dump(mode="json"),
    }
    return Answer(text, content)
