"""Excel workbooks as tables: the sheet that holds most, below the line that names its columns.

Numbers are read as numbers: as text, fastexcel cuts them after nine decimals. A cell that looks
like a time of day is a number below one to a workbook, a duration of more than a day a date of
1900; both are told by their kind. Excel has no zones: a time is taken as UTC.
"""

from __future__ import annotations

import logging
import zipfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

import polars as pl

from shiplog.exceptions import ChannelMissing, listed
from shiplog.logs.conversion import delimited
from shiplog.logs.conversion.delimited import LOOK, DelimitedTable, Form
from shiplog.logs.conversion.recordings import library
from shiplog.logs.conversion.written_numbers import is_number

log = logging.getLogger(__name__)

EXTRA = "excel"
FIRST_DAY = 1905  # a year: what is before is a time of day, or how long something took
NUMBERS = 0.5  # of the cells of a column under its name, that make it one of numbers


def is_excel(path: Path) -> bool:
    """Whether a file is a workbook of Excel 2007 and later."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        if stream.read(4) != b"PK\x03\x04":
            return False
    try:
        with zipfile.ZipFile(path) as archive:
            return any(name.lower().startswith("xl/") for name in archive.namelist()[:1000])
    except (OSError, zipfile.BadZipFile):
        return False


def read_excel(path: Path, known: Collection[str] = ()) -> DelimitedTable:
    """The sheet whose header holds most of what is `known`, of these the largest.

    Raises ChannelMissing where no sheet is a table, or the file cannot be read; LibraryMissing
    where the extra is not installed.
    """
    fastexcel = library("fastexcel", EXTRA, path, "an Excel workbook")
    try:
        reader = fastexcel.read_excel(str(path))
        sheets = {name: _Sheet.of(reader, name, known) for name in reader.sheet_names}
    except fastexcel.FastExcelError as error:
        raise ChannelMissing(f"{path} cannot be read: {error}.", hint="check the file.") from error
    tables = {name: sheet for name, sheet in sheets.items() if sheet is not None}
    if not tables:
        raise ChannelMissing(
            f"{path.name} has no sheet with a line of names over rows of values; its sheets: "
            f"{listed(sheets)}.",
            hint="put the names of the columns into one line, and the rows below it.",
        )
    name, sheet = max(tables.items(), key=lambda item: item[1].rank(known))
    if len(tables) > 1:
        others = listed([one for one in tables if one != name])
        log.info("%s: read is the sheet %r; not read: %s", path.name, name, others)
    return sheet.table()


class _Sheet:
    """One sheet, and where its header stands."""

    def __init__(self, reader: Any, name: str, form: Form, head: list[list[str]], rows: int):
        self.reader, self.name, self.form, self.head, self.rows = reader, name, form, head, rows

    @classmethod
    def of(cls, reader: Any, name: str, known: Collection[str]) -> _Sheet | None:
        """None where it is no table."""
        sheet = reader.load_sheet(name, header_row=None, n_rows=LOOK, dtypes="string")
        lines = _strings(sheet)
        form = delimited.form_of(lines, known)
        if form is None:
            return None
        head = lines[form.first :]
        return cls(reader, name, form, head, int(sheet.total_height) - form.first)

    def rank(self, known: Collection[str]) -> tuple[int, int]:
        """How much of what is known it names, and how many cells it has."""
        return len(set(self.form.names) & set(known)), self.rows * len(self.form.names)

    def table(self) -> DelimitedTable:
        """Every column by the kind of its cells; numbers, and texts of numbers, as numbers."""
        names = self.form.names
        frame = self._rows()
        frame = frame.select(frame.columns[: len(names)])
        frame = frame.rename(dict(zip(frame.columns, names, strict=True)))
        frame = frame.with_columns(_plain(values) for values in frame)
        frame = frame.filter(pl.any_horizontal(pl.all().is_not_null()))
        units = {n: u for n, u in zip(names, self.form.units, strict=False) if u}
        nameless = tuple(names) if self.form.nameless else ()
        found = delimited.plain(frame)
        return DelimitedTable(found.frame, units, (), found.undecided, nameless)

    def _rows(self) -> pl.DataFrame:
        """What is below the header. A column in which kinds are mixed is text; one of numbers has
        none where there is something else."""
        numbers = {i: "float" for i in range(len(self.form.names)) if self._of_numbers(i)}
        texts = {i: "string" for i in range(len(self.form.names)) if i not in numbers}
        for dtypes in (numbers, numbers | texts):
            try:
                return self.reader.load_sheet(
                    self.name, header_row=None, skip_rows=self.form.first,
                    schema_sample_rows=None, dtypes=dtypes or None,
                ).to_polars()  # fmt: skip
            except Exception as error:  # its own exceptions have no common place in all versions
                if len(dtypes) == len(self.form.names):
                    raise
                log.debug("%s: %s", self.name, error)
        raise AssertionError("the last of two ways returns or raises")

    def _of_numbers(self, place: int) -> bool:
        """Whether most cells of the first rows are numbers in plain digits."""
        cells = [line[place] for line in self.head if place < len(line) and line[place].strip()]
        return bool(cells) and sum(map(_plain_number, cells)) > NUMBERS * len(cells)


def _strings(sheet: Any) -> list[list[str]]:
    return [["" if cell is None else str(cell) for cell in row] for row in sheet.to_polars().rows()]


def _plain_number(text: str) -> bool:
    return is_number(text) and "," not in text


def _plain(values: pl.Series) -> pl.Series:
    """Durations in seconds, dates of no day as times of day, truths as 0 and 1."""
    if isinstance(values.dtype, pl.Duration):
        return values.dt.total_microseconds() * 1e-6
    if values.dtype == pl.Boolean:
        return values.cast(pl.Float64)
    if isinstance(values.dtype, pl.Datetime):
        years = values.drop_nulls().dt.year()
        if len(years) and int(years.max()) < FIRST_DAY:  # type: ignore[arg-type]
            return values.dt.strftime("%H:%M:%S%.3f")
    return values
