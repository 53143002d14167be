"""On a Ray cluster: trainings of begun runs, and the 1 Hz rows of many voyages."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path

import polars as pl

from shiplog.commands.bars import Bars
from shiplog.training.network import cluster, network_files
from shiplog.training.network.network_training import ended, share_done
from shiplog.training.network.queue import Task
from shiplog.training.runs import load_model, run_folder
from shiplog.training.runs.network_seeds import training_of
from shiplog.voyages.rows import one_hertz

log = logging.getLogger(__name__)


def resample(
    paths: Sequence[Path], columns: Sequence[str], circular: Sequence[str], out: Path, address: str
) -> list[Path]:
    """10 Hz rows to 1 Hz rows, a task a voyage: a folder of Parquet in `out` for each of `paths`,
    numbered as they are. Returns these folders.

    paths   a Parquet file of 10 Hz rows for each voyage, such as the store's `table.parquet`; both
            they and `out` on a disk that all nodes share

    Raises ShiplogError without Ray or a cluster.
    """
    ray = cluster.connected(address)
    one = ray.remote(num_cpus=1, max_retries=-1)(_resample_one)
    try:
        tasks = [one.remote(path, tuple(columns), tuple(circular), out / f"{number:06d}")
                 for number, path in enumerate(paths)]  # fmt: skip
        return ray.get(tasks)
    finally:
        ray.shutdown()


def _resample_one(
    path: Path, columns: tuple[str, ...], circular: tuple[str, ...], out: Path
) -> Path:
    one_hertz.sink_averages([pl.scan_parquet(path)], columns, circular, out)
    return out


def do(tasks: Sequence[Task], address: str) -> dict[str, str]:
    """Do all trainings (of `network_seeds.tasks_of`) there. Returns those that failed, and why."""
    places = {
        task.name: (
            load_model.network(run_folder.open_folder(task.arguments[0])),
            task.arguments[1],
        )
        for task in tasks
    }
    trainings = {
        name: (training_of(run, seed), network_files.load_checkpoint(run.seed(seed)))
        for name, (run, seed) in places.items()
    }
    failures: dict[str, str] = {}
    costs = {task.name: task.cost for task in tasks}
    with Bars(costs) as bars, closing(cluster.work(trainings, address)) as results:
        for one in results:
            run, seed = places[one.name]
            if one.progress is None:
                failures[one.name] = one.failure
                log.warning("%s: %s", one.name, one.failure)
            elif one.ended:
                network_files.save(run.seed(seed), one.progress)
                log.info("%s: %s", one.name, ended(one.progress.best, one.progress.epoch))
            else:
                network_files.save_checkpoint(run.seed(seed), one.progress)
            reached = one.progress.epoch if one.progress else 0
            bars.show(one.name, share_done(reached, run.config.paper), one.ended)
    return failures
