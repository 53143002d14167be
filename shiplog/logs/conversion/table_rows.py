"""The rows of one table as logs, one a voyage."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from shiplog.logs.conversion import columns
from shiplog.logs.conversion.delimited import is_table, read_table
from shiplog.logs.conversion.original import Format, Original, why
from shiplog.logs.mcap_file import foreign_files
from shiplog.machine.paths import refuse_namesake


def refuse_others(path: Path) -> None:
    """Raises LogUnreadable for a file that is no table, and of no other format."""
    foreign_files.refuse(path)
    if not is_table(path):
        foreign_files.refuse_binary(path, path.name)


def _logs(original: Original) -> Iterator[Path]:
    path, given = original.path, original.given
    refuse_others(path)
    profile = columns.required(original.profile, given)
    voyages, lost = columns.voyages(read_table(path, profile.table), profile, path)
    if lost:
        original.lost[str(given)] = ", ".join(lost)
    begun: set[str] = set()
    for name, part, found in voyages:
        try:  # one bad voyage never ends the others
            refuse_namesake(name, begun, path)
            series = columns.series(part, profile)
            target = original.written(series, [*found, *columns.dropped(lost)], name)
        except BaseException as error:
            where = str(given) if name == path.stem else f"{given}: {name}"
            original.refused[where] = why(error, f"{path.name}: {name}")
            continue
        yield target


FORMAT = Format(
    "CSV or Parquet tables", lambda path: True, _logs,
    sure=lambda path, profile: profile is not None and not foreign_files.is_foreign(path),
)  # fmt: skip
