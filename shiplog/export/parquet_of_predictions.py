"""`--to parquet`: predictions of voyages, a row a second."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from shiplog.export import predictions
from shiplog.export.job import Job
from shiplog.export.trial import Difference
from shiplog.machine import files

CONSUMER = "pyarrow"


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    """With the record, the run and the units as the file's own metadata."""
    import pyarrow.parquet as parquet

    table = predictions.frame(job).to_arrow()
    kept = {"run": job.run.name, "units": "SI", "compared": " ".join(record)}
    with files.whole(path) as partial:
        parquet.write_table(table.replace_schema_metadata(kept), partial)


def losses(job: Job) -> tuple[str, ...]:
    return predictions.losses(job)


def compare(job: Job, path: Path) -> Difference:
    import pyarrow.parquet as parquet

    return predictions.apart(job, pl.DataFrame(pl.from_arrow(parquet.read_table(path))))


def version() -> str:
    import pyarrow

    return pyarrow.__version__
