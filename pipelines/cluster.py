"""Trainings of begun runs on a Ray cluster; what comes back is kept in the run folders here."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from contextlib import closing

from pipelines.bars import Bars
from pipelines.train import training_of
from shiplog import runs
from shiplog.training import cluster
from shiplog.training.queue import Task

log = logging.getLogger(__name__)


def do(tasks: Sequence[Task], address: str) -> dict[str, str]:
    """Do all trainings (tasks of `train.tasks_of`) there. Returns those that failed, and why."""
    places = {task.name: (runs.open_folder(task.arguments[0]), task.arguments[1]) for task in tasks}
    trainings = {
        name: (training_of(run, seed), run.load_checkpoint(seed))
        for name, (run, seed) in places.items()
    }
    failures: dict[str, str] = {}
    with Bars(list(places)) as bars, closing(cluster.work(trainings, address)) as results:
        for one in results:
            run, seed = places[one.name]
            if one.progress is None:
                failures[one.name] = one.failure
                log.warning("%s: %s", one.name, one.failure)
            elif one.ended:
                run.save_seed(seed, one.progress)
                said = (one.name, one.progress.best, one.progress.epoch)
                log.info("%s: best validation L %.0f after %d epochs", *said)
            else:
                run.save_checkpoint(seed, one.progress)
            least = max(run.config.paper.least_epochs, 1)
            reached = one.progress.epoch if one.progress else 0
            bars.show(one.name, min(0.99, reached / least), one.ended)
    return failures
