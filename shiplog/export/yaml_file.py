"""`--to yaml`: the coefficients with unit, interval and meaning."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from shiplog.export import numbers_of_run
from shiplog.export.filled import inert
from shiplog.export.job import Job
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.trial import Difference
from shiplog.machine import files

CONSUMER = "PyYAML"


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    """YAML that is the same in versions 1.1 and 1.2: strings are quoted, numbers have a point."""
    lines = [f"# {inert(line)}" for line in (job.run.label, *record)]
    lines += [f"run: {_text(job.run.name)}", f"ship: {_text(job.run.profile.ship.name)}",
              "coefficients:"]  # fmt: skip
    for row in numbers_of_run.frame(job).to_dicts():
        lines.append(f"  {_text(row.pop('name'))}:")
        lines += [f"    {key}: {_value(value)}" for key, value in row.items() if value is not None]
    files.write_text(path, "\n".join(lines) + "\n")


def losses(job: Job) -> tuple[str, ...]:
    return numbers_of_run.losses(job)


def compare(job: Job, path: Path) -> Difference:
    """Raises NotLoaded without PyYAML."""
    try:
        import yaml
    except ImportError as error:
        raise NotLoaded("PyYAML is not installed (pip install 'shiplog[export]')") from error
    read: Any = yaml.safe_load(path.read_text("utf-8"))
    values = {name: one["value"] for name, one in read["coefficients"].items()}
    return numbers_of_run.apart(numbers_of_run.frame(job), values)


def version() -> str:
    try:
        import yaml
    except ImportError:
        return ""
    return yaml.__version__


def _text(words: str) -> str:
    return json.dumps(words, ensure_ascii=False)


def _value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        # of 1e-05 YAML 1.1 makes a string: it wants a point before the exponent
        text = repr(value)
        return text.replace("e", ".0e") if "e" in text and "." not in text else text
    return _text(str(value))
