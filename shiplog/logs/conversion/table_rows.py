"""The rows of one table as logs, one a voyage."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from shiplog.logs.conversion import columns
from shiplog.logs.conversion.excel import is_excel
from shiplog.logs.conversion.matlab import is_matlab
from shiplog.logs.conversion.original import Format, Original, why
from shiplog.logs.conversion.table_files import is_program_table, is_table, read_table
from shiplog.logs.mcap_file import foreign_files
from shiplog.machine.paths import refuse_namesake
from shiplog.ship_profile.profile import Profile


def refuse_others(path: Path) -> None:
    """Raises LogUnreadable for a file that is no table, and of no other format."""
    if is_program_table(path):
        return
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


def _profiled(path: Path, profile: Profile | None) -> bool:
    return profile is not None and not foreign_files.is_foreign(path)


def _named(path: Path, profile: Profile | None) -> bool:
    return profile is not None


MATLAB = Format("MATLAB files", is_matlab, _logs, sure=_named, voyage=True, table=True)
EXCEL = Format("Excel workbooks", is_excel, _logs, sure=_named, voyage=True, table=True)
FORMAT = Format("CSV or Parquet tables", lambda path: True, _logs, sure=_profiled, table=True)
