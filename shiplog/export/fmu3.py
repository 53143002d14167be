"""`--to fmu3`: as `fmu`, of FMI 3.0."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from shiplog.export import fmu
from shiplog.export.fmu import CONSUMER, compare, version
from shiplog.export.job import Job

__all__ = ["CONSUMER", "compare", "losses", "version", "write"]


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    fmu.write_unit(job.ship, path, record, "3")


def losses(job: Job) -> tuple[str, ...]:
    return fmu.losses_of(job, "3")
