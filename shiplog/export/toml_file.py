"""`--to toml`: the coefficients as `train --parameters` takes them, and the numbers of causes."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.metadata import version as version_of
from pathlib import Path

import tomli_w

from shiplog.export import numbers_of_run
from shiplog.export.filled import inert
from shiplog.export.job import Job
from shiplog.export.trial import Difference
from shiplog.machine import files

CONSUMER = "shiplog train --parameters"


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    rows = numbers_of_run.frame(job)
    sections: dict[str, dict[str, float]] = {}
    for name, value, cause in rows.select("name", "value", "cause").rows():
        part, key = (f"cause.{cause}", name.removeprefix(f"{cause}.")) if cause else \
            name.split(".", 1)  # fmt: skip
        sections.setdefault(part, {})[key] = value
    text = tomli_w.dumps({"source": f"shiplog's run {inert(job.run.name)}", **sections})
    head = [job.run.label, "Numbers of the base are without unit, of a cause in its displayed unit."]
    files.write_text(path, "".join(f"# {inert(line)}\n" for line in (*head, *record)) + text)


def losses(job: Job) -> tuple[str, ...]:
    return numbers_of_run.losses(job)


def compare(job: Job, path: Path) -> Difference:
    """As a training begins with them; the numbers of causes are no part of that."""
    run = job.run
    base = numbers_of_run.frame(job).filter(cause="")
    start = run.kind.equations.begin(run.profile, run.config.physics, path).start
    return numbers_of_run.apart(base, dict(zip(start.names, start.values.tolist(), strict=True)))


def version() -> str:
    return version_of("shiplog")
