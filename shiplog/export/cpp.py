"""`--to cpp`: one header for C99 and C++11, compiled again by this machine's compiler."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shiplog.export import c_source, compilers
from shiplog.export.filled import filled
from shiplog.export.job import Job
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.ship import Ship
from shiplog.export.trial import Difference, Trial, difference
from shiplog.machine import files

CONSUMER = "gcc"


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    files.write_text(path, c_source.header(job.ship, record))


def losses(job: Job) -> tuple[str, ...]:
    return job.ship.losses


def compare(job: Job, path: Path) -> Difference:
    return difference(job.trial, sail(job.ship, job.trial, path))


def sail(ship: Ship, trial: Trial, path: Path) -> np.ndarray:
    """[n, 6] by a program of it. Raises NotLoaded without a compiler."""
    compiler = compilers.own()
    if compiler is None:
        raise NotLoaded("no C compiler is on this machine")
    drive = filled("drive.c", {"NAME": ship.identifier, "FILE": path.name})
    (path.parent / "drive.c").write_text(drive, encoding="utf-8")
    run = [*compilers.OPTIONS, "-o", "drive", "drive.c", "-lm"]
    compilers.run([compiler, *run], path.parent)
    return driven(trial, path.parent)


def driven(trial: Trial, folder: Path) -> np.ndarray:
    """The trial by the program `drive` of a folder."""
    water = trial.water
    given = np.concatenate(
        (trial.start, water.wind, water.current, [len(trial.orders)], trial.orders.ravel())
    )
    said = compilers.run([str(folder / "drive")], folder, given.tobytes())
    return np.frombuffer(said).reshape(-1, 6)


def version() -> str:
    compiler = compilers.own()
    if compiler is None:
        return ""
    said = subprocess.run([compiler, "-dumpfullversion"], capture_output=True, check=False)
    return said.stdout.decode().strip()
