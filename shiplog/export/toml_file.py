"""`--to toml`: the coefficients as `train --parameters` takes them."""

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
    sections: dict[str, dict[str, float]] = {}
    causes = []
    columns = ("name", "value", "unit", "cause")
    for name, value, unit, cause in numbers_of_run.frame(job).select(columns).rows():
        if cause:  # `train --parameters` refuses sections that no force reads
            causes.append(f"{name} = {value!r} {unit}")
        else:
            part, key = name.split(".", 1)
            sections.setdefault(part, {})[key] = value
    text = tomli_w.dumps({"source": f"shiplog's run {inert(job.run.name)}", **sections})
    head = [job.run.label, *record, *(f"cause: {one}" for one in causes)]
    files.write_text(path, "".join(f"# {inert(line)}\n" for line in head) + text)


def losses(job: Job) -> tuple[str, ...]:
    found = numbers_of_run.losses(job)
    if job.run.extension is None:
        return found
    return (*found, "The numbers of its causes as values: they are comments.")


def compare(job: Job, path: Path) -> Difference:
    """As a training begins with them; the numbers of causes are no part of that."""
    run = job.run
    base = numbers_of_run.frame(job).filter(cause="")
    start = run.kind.equations.begin(run.profile, run.config.physics, path).start
    return numbers_of_run.apart(base, dict(zip(start.names, start.values.tolist(), strict=True)))


def version() -> str:
    return version_of("shiplog")
