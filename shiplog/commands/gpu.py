"""Trainings of begun runs on a GPU: all seeds of a run at once, and runs in turns."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from shiplog.commands.bars import Bars
from shiplog.exceptions import ShiplogError
from shiplog.training.network import network_files
from shiplog.training.network.gpu import Device
from shiplog.training.network.network_training import Progress, ended, share_done
from shiplog.training.network.queue import Task
from shiplog.training.network.seeds_together import SeedsTogether, advance
from shiplog.training.runs import load_model, run_folder
from shiplog.training.runs.network_seeds import training_of

log = logging.getLogger(__name__)

CHECKPOINT_EPOCHS = 1000  # a minute's work of a GPU at most, written in well under a second


def do(tasks: Sequence[Task], device: Device) -> dict[str, str]:
    """Do all trainings (of `network_seeds.tasks_of`) there. Returns those that failed, and why."""
    began = time.time()
    failures: dict[str, str] = {}
    runs: dict[SeedsTogether, _Run] = {}
    with Bars({task.name: task.cost for task in tasks}) as bars:
        for path, of_run in groupby(tasks, lambda task: task.arguments[0]):
            run = _Run(path, list(of_run))
            try:
                runs[run.begin(device)] = run
            except ShiplogError as error:
                failures |= dict.fromkeys(run.names.values(), str(error))
        for seeds, over in advance(list(runs)):
            run = runs[seeds]
            for seed in (*seeds.running, *over):
                share = share_done(seeds.progress[seed].epoch, seeds.settings)
                bars.show(run.names[seed], share, ended=seed in over)
            for seed in over:
                name, progress = run.names[seed], seeds.progress[seed]
                failure = run.end(seed, progress)
                if failure:
                    failures[name] = failure
                else:
                    took = time.time() - began
                    log.info("%s: %s, %.0f s", name, ended(progress.best, progress.epoch), took)
    for name, failure in failures.items():
        log.warning("%s: %s", name, failure)
    return failures


class _Run:
    """Tasks of one run, and where their results go."""

    def __init__(self, path: Path, tasks: Sequence[Task]) -> None:
        self._run = load_model.network(run_folder.open_folder(path))
        self.names = {task.arguments[1]: task.name for task in tasks}

    def begin(self, device: Device) -> SeedsTogether:
        """Each seed from where it stands. Raises RunError."""
        self._trainings = {seed: training_of(self._run, seed) for seed in self.names}
        stands = {s: network_files.load_checkpoint(self._run.seed(s)) for s in self.names}
        return SeedsTogether(
            list(self._trainings.values()), device,
            {seed: progress for seed, progress in stands.items() if progress is not None},
            self._keep, CHECKPOINT_EPOCHS,
        )  # fmt: skip

    def _keep(self, seed: int, progress: Progress) -> None:
        network_files.save_checkpoint(self._run.seed(seed), progress)

    def end(self, seed: int, progress: Progress) -> str:
        """Save a seed that has ended; why it failed, or nothing."""
        try:
            self._trainings[seed].refuse_diverged(progress)
            network_files.save(self._run.seed(seed), progress)
        except ShiplogError as error:
            return str(error)
        except OSError as error:  # a disk that is full
            return f"{error.filename}: {error.strerror}"
        return ""
