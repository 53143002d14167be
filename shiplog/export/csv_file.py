"""`--to csv`: the coefficients, a row each; with voyages, what the run predicts of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from shiplog.export import numbers_of_run, predictions
from shiplog.export.job import Job
from shiplog.export.trial import Difference
from shiplog.machine import files

CONSUMER = "polars"


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    """A CSV has no place for a record: it is printed, and in the JSON."""
    frame = predictions.frame(job) if job.voyages else numbers_of_run.frame(job)
    with files.whole(path) as partial:
        frame.write_csv(partial)


def losses(job: Job) -> tuple[str, ...]:
    return predictions.losses(job) if job.voyages else numbers_of_run.losses(job)


def compare(job: Job, path: Path) -> Difference:
    read = pl.read_csv(path, infer_schema_length=None)
    if job.voyages:
        return predictions.apart(job, read)
    return numbers_of_run.apart(
        numbers_of_run.frame(job), dict(read.select("name", "value").rows())
    )


def version() -> str:
    return pl.__version__
