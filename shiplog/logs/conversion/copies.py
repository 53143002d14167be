"""What is a log already, and was packed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from shiplog.logs.conversion.original import Format, Original
from shiplog.logs.conversion.ros2_bags import MCAP
from shiplog.logs.mcap_file.refusals import begins_as_log, refuse_log


def is_log(path: Path) -> bool:
    """Whether a file is an MCAP log, by its name or by its content."""
    if path.suffix.lower() == MCAP:
        return not path.is_dir()
    return path.is_file() and begins_as_log(path)


def _logs(original: Original) -> Iterator[Path]:
    refuse_log(original.path, original.given)
    yield original.copied()


FORMAT = Format("MCAP logs", is_log, _logs, sure=lambda path, profile: False)
