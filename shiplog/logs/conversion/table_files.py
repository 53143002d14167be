"""Files that hold a table, whatever program wrote them: a line a kind, known by its content."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from shiplog.logs.conversion import delimited, excel, matlab
from shiplog.logs.conversion.delimited import DelimitedTable
from shiplog.ship_profile.profile import Column

Test = Callable[[Path], bool]
Read = Callable[[Path, Collection[str]], DelimitedTable]
KINDS: tuple[tuple[Test, Read], ...] = (
    (matlab.is_matlab, matlab.read_matlab),
    (excel.is_excel, excel.read_excel),
)


def is_table(path: Path) -> bool:
    """Whether a file is a table by its content, or else by its name."""
    return delimited.is_table(path) or is_program_table(path)


def is_program_table(path: Path) -> bool:
    """Whether a file is a table of one of the programs above, by its content."""
    return any(test(path) for test, _ in KINDS)


def read_table(path: Path, known: Mapping[str, Column] | None = None) -> DelimitedTable:
    """The table of a file.

    known  columns that the profile speaks of: of several tables in a file the one that has them

    Raises ChannelMissing for what is no table, cannot be read or holds no row; LibraryMissing.
    """
    read = next((read for test, read in KINDS if test(path)), None)
    return delimited.read_table(path, known) if read is None else read(path, known or {})
