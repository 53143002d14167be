"""Voyages to a trained run: split, windows, one process a seed."""

from __future__ import annotations

import datetime
import logging
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path

import polars as pl
import torch

from pipelines.prepare import seconds
from shiplog import engine, runs, seeds, table, train, windows
from shiplog.config import Config, Split
from shiplog.exceptions import RunError, StoreError, listed, nearest
from shiplog.findings import CONTRACT
from shiplog.models import MODELS
from shiplog.models.feedforward import scaling
from shiplog.runs import Run
from shiplog.store import Store
from shiplog.windows import AUGMENTATIONS, Windows

log = logging.getLogger(__name__)

PAPER_TRAINING = {"d-ref": 4}  # Table 4: voyages 1 to 4; every other dataset 1 and 2
SAMPLE_VOYAGES = tuple(f"voyage_{i}" for i in range(1, 7))
HELD_OUT_SHARE = 0.15  # of the seconds, for validation and for test each


def train_run(config: Config, store: Store, out: Path) -> Run:
    """Train every seed of a run; goes on where an interrupted one stopped. Raises ShiplogError."""
    split = config.split
    profile = store.profile([*split.training, *split.validation])
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
    with _one_thread(), ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
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
    return run.finish(provenance(store, split, began))


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
    training, validation = (engine.batch(w, scale, shape, torch.float32) for w in (learnt, held))
    model = run.empty_model().initialise(seeds.generator(seed, "weights"))
    if config.recipe == "paper":
        progress = train.paper(
            model,
            training,
            validation,
            config.paper,
            seed,
            resume=run.load_checkpoint(seed),
            checkpoint=lambda p: run.save_checkpoint(seed, p),
        )
    else:
        progress = train.fast(model, training, validation, config.fast, seed)
    run.save_seed(seed, progress)
    return progress.best, progress.epoch, time.time() - began


def plan(rows: pl.DataFrame, data: str, size: int) -> pl.DataFrame:
    """The planned windows of one of the paper's datasets; steps scale with the window."""
    augmentation = AUGMENTATIONS[data]
    step = max(1, augmentation.step * size // windows.SIZE)
    return windows.plan(rows.lazy(), size, step, augmentation.copies).collect()


def _cut(run: Run, rows: pl.DataFrame, planned: pl.DataFrame) -> Windows:
    names = (run.profile.actuator_names, run.profile.wind_names)
    return windows.cut(rows, planned, run.config.window, *names)


def choose_split(
    store: Store, voyages: Sequence[str], validation: Sequence[str], data: str, size: int
) -> Split:
    """Which voyages train, validate and test; what the user did not say is chosen, and said.

    Six voyages in order, or the sample logs, are split as in the paper; else whole voyages are
    dealt out in order of time, about 15 % of the seconds each to validation and test.
    """
    names = store.select(list(voyages) or None)
    if validation:
        held = store.select(list(validation))
        training = tuple(n for n in names if n not in held)
        if not training:
            raise StoreError(
                "Every training voyage is also a validation voyage.",
                hint="name other voyages with --voyages.",
            )
        return Split(training=training, validation=tuple(held), chosen_by="the user")
    if not voyages and set(SAMPLE_VOYAGES) <= set(names):
        names = list(SAMPLE_VOYAGES)
    if len(names) == 6 and (voyages or names == list(SAMPLE_VOYAGES)):
        count = PAPER_TRAINING.get(data, 2)
        return Split(
            training=tuple(names[:count]),
            validation=(names[4],),
            test=(names[5],),
            chosen_by="the paper's Table 4, voyages 1 to 6 in order",
        )
    return _deal(store, names, size)


def _deal(store: Store, names: list[str], size: int) -> Split:
    profile = store.profile(names)
    rows = seconds(store, names, profile)
    whole = plan(rows, "ref", size).group_by("voyage").len()
    counts = dict(whole.iter_rows())
    first = dict(rows.group_by("voyage").agg(pl.col("time").min()).iter_rows())
    usable = sorted((n for n in names if n in counts), key=lambda n: (first[n], n))
    twin = {}  # the same data under two names stays on one side
    for left, right, _ in table.shared_rows(rows).iter_rows():
        twin[right] = twin.get(left, left)
    groups: dict[str, list[str]] = {}
    for name in usable:
        groups.setdefault(twin.get(name, name), []).append(name)
    if len(groups) < 2:
        raise StoreError(
            f"{len(groups)} voyage(s) with a window of {size} s cannot be split into training and "
            f"validation.",
            hint="ingest at least two voyages, or choose a shorter --window.",
        )
    sides: dict[str, list[str]] = {"training": [], "validation": [], "test": []}
    taken = dict.fromkeys(sides, 0)
    want = {"validation": HELD_OUT_SHARE, "test": HELD_OUT_SHARE if len(groups) > 2 else 0.0}
    left = len(groups)
    for members in groups.values():
        weight = sum(counts[m] for m in members)
        total = sum(taken.values()) + weight
        lacking = [s for s in ("validation", "test") if want[s] and not taken[s]]
        behind = [s for s in ("validation", "test") if taken[s] < want[s] * total]
        side = "training"
        if taken["training"] and (behind or left <= len(lacking)):
            side = (lacking or behind)[0] if left <= len(lacking) else behind[0]
        sides[side] += members
        taken[side] += weight
        left -= 1
    return Split(
        **{side: tuple(members) for side, members in sides.items()},
        chosen_by="whole voyages dealt out in order of time",
    )


def refuse_shared_rows(rows: pl.DataFrame, split: Split) -> None:
    """The same seconds in training and validation make the validation worthless: refuse."""
    for left, right, count in table.shared_rows(rows).iter_rows():
        if (left in split.training) != (right in split.training):
            raise StoreError(
                f"{left} and {right} hold {count} identical seconds, one in training, the other "
                "in validation.",
                hint="leave one of them out.",
            )


def provenance(store: Store, split: Split, began: float) -> dict:
    """Versions, commit, log hashes, device and times."""
    hashes = {e.name: e.sha256 for e in store.entries()}
    used = [*split.training, *split.validation]
    return {
        "shiplog": version("shiplog"),
        "commit": _commit(),
        "python": platform.python_version(),
        "torch": torch.__version__,
        "polars": pl.__version__,
        "machine": platform.machine(),
        "device": "cpu",
        "logs_sha256": {name: hashes.get(name) for name in used},
        "began": _utc(began),
        "ended": _utc(time.time()),
        "command": sys.argv,
    }


def _utc(stamp: float) -> str:
    return datetime.datetime.fromtimestamp(stamp, datetime.UTC).isoformat(timespec="seconds")


def _commit() -> str | None:
    """The source's commit, where shiplog runs from its own checkout.

    Installed into an environment inside somebody's repository, git would name their commit.
    """
    checkout = Path(__file__).parents[1]
    if not (checkout / ".git").exists():
        return None
    try:
        done = subprocess.run(
            ["git", "-C", str(checkout), "rev-parse", "HEAD"],
            capture_output=True,
            text=True,
            timeout=5,
            check=False,
        )
    except OSError:
        return None
    return done.stdout.strip() or None


@dataclass(frozen=True)
class Answer:
    """What a command says: to a person and to a machine."""

    text: str
    content: dict


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
    for value, allowed, option in (
        (model, tuple(MODELS), "--model"),
        (data, tuple(AUGMENTATIONS), "--data"),
        (recipe, ("fast", "paper"), "--recipe"),
        (wind_input or "angle", ("angle", "components"), "--wind-input"),
    ):
        if value not in allowed:
            raise RunError(
                f"{option} {value!r} does not exist{nearest(value, allowed)}.",
                hint=f"{option} can be {listed(allowed)}.",
            )
    store = Store(store_path)
    split = choose_split(store, voyages, validation, data, window)
    log.info(
        "split by %s: training %s; validation %s; test %s",
        split.chosen_by,
        listed(split.training),
        listed(split.validation),
        listed(split.test),
    )
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
