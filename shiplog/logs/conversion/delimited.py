"""Text and Parquet tables as people export them: any separator, decimal commas, units in a row."""

from __future__ import annotations

import csv
import io
import logging
import re
from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl

from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion.clock import number_of
from shiplog.logs.foreign_files import is_binary

log = logging.getLogger(__name__)

TEXT = (".csv", ".tsv", ".txt", ".dat", ".asc", ".tab")
# In this order: of "1,5;2,5" each comma comes as regularly as the semicolon does.
SEPARATORS = (";", "\t", "|", ",", " ")
SAMPLE_BYTES = 65_536  # bytes that tell the form of a text
LOOK = 200  # lines of them
GROUPED = r"^[+-]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?$"  # 1,002 or 12,345,678.9
REGULAR = 0.8  # share of lines that a separator cuts alike


@dataclass(frozen=True, slots=True)
class DelimitedTable:
    """A table, and what its file states in addition."""

    frame: pl.DataFrame
    units: dict[str, str] = field(default_factory=dict)  # of a row of units under the header


@dataclass(frozen=True, slots=True)
class Form:
    """How a text is cut: separator, the header's line, and whether units follow it."""

    separator: str
    header: int  # line number, from 0
    names: list[str]
    units: list[str]
    first: int  # line of the first row


def is_table(path: Path) -> bool:
    """Whether the name says that this is a table."""
    return path.suffix.lower() in (".parquet", *TEXT)


def read_table(path: Path, known: Collection[str] = ()) -> DelimitedTable:
    """A text or Parquet table.

    known  column names that the profile speaks of: a line that holds them is the header

    Raises ChannelMissing for what is no table, cannot be read or holds no row.
    """
    if not path.is_file() or not (is_table(path) or not is_binary(path)):
        raise ChannelMissing(
            f"{path} is no table.", hint=f"give a file of type .parquet, {', '.join(TEXT)}."
        )
    try:
        if path.suffix.lower() == ".parquet":
            table = DelimitedTable(pl.read_parquet(path))
        else:
            table = _read_text(path, known)
    except (pl.exceptions.PolarsError, OSError, UnicodeError, csv.Error) as error:
        raise ChannelMissing(f"{path} cannot be read: {error}.", hint="check the file.") from error
    if table.frame.height == 0:
        raise ChannelMissing(
            f"{path.name} holds no row under its header.", hint="export the table again."
        )
    return table


def _read_text(path: Path, known: Collection[str]) -> DelimitedTable:
    raw = path.read_bytes()
    text = _decoded(raw[:SAMPLE_BYTES], whole=len(raw) <= SAMPLE_BYTES)
    lines = text.splitlines()
    if len(raw) > SAMPLE_BYTES:
        lines = lines[:-1]  # the sample's last line is cut
    form = _form(lines[:LOOK], known)
    if form is None:
        raise ChannelMissing(
            f"{path.name} is no table: no separator cuts its lines alike.",
            hint="separators are ; tab | , or spaces; the first line names the columns.",
        )
    body = _decoded(raw, whole=True).splitlines()[form.first :]
    if form.separator == " ":
        rows, separator = "\n".join("\t".join(line.split()) for line in body), "\t"
    else:
        rows, separator = "\n".join(body), form.separator
    if not rows.strip():
        return DelimitedTable(pl.DataFrame({name: [] for name in form.names}))
    named = separator.join('"' + name.replace('"', '""') + '"' for name in form.names)
    frame = pl.read_csv(  # a first row may be short: it is the header that says how many columns
        io.BytesIO(f"{named}\n{rows}".encode()), separator=separator, infer_schema=False,
        truncate_ragged_lines=True,
    )  # fmt: skip
    if separator == ",":
        frame = frame.select(_ungrouped(column) for column in frame.get_columns())
    frame = frame.select(_typed(column) for column in frame.get_columns())
    commas = " and decimal commas" if _has_commas(form, lines) else ""
    if form.separator != "," or commas:
        cut = {"\t": "tabs", " ": "spaces"}.get(form.separator, repr(form.separator))
        log.info("%s: separated by %s%s", path.name, cut, commas)
    stated = {n: u for n, u in zip(form.names, form.units, strict=False) if u}
    return DelimitedTable(frame, stated)


def _decoded(raw: bytes, whole: bool) -> str:
    """UTF-8 or UTF-16 with its mark; else what Western Windows programs write."""
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="strict" if whole else "ignore")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if not whole and error.start > len(raw) - 4:  # a letter cut by the end of the sample
            return raw[: error.start].decode("utf-8-sig")
        return raw.decode("cp1252", errors="replace")


def _form(lines: list[str], known: Collection[str]) -> Form | None:
    """The separator that cuts most lines into the same number of fields, and the header."""
    for separator in SEPARATORS:
        cut = [_cut(line, separator) for line in lines]
        counts = Counter(len(fields) for fields in cut if any(fields))
        counts.pop(1, None)
        if not counts:
            continue
        count, times = counts.most_common(1)[0]
        # What stands before the header is cut otherwise, and does not count.
        start = next(i for i, fields in enumerate(cut) if len(fields) == count)
        if times < REGULAR * sum(any(fields) for fields in cut[start:]):
            continue
        return _headed(cut, count, separator, known)
    return None


def _headed(cut: list[list[str]], count: int, separator: str, known: Collection[str]) -> Form:
    whole = [i for i, fields in enumerate(cut) if len(fields) == count]
    header = max(whole, key=lambda i: (len(set(cut[i]) & set(known)), -i))
    if not set(cut[header]) & set(known):
        header = whole[0]
    names = [re.sub(r"^#\s*", "", name.strip()) for name in cut[header]]
    if all(_number(name) for name in names if name):  # no header at all
        names = [f"column_{i + 1}" for i in range(count)]
        log.warning("no line names the columns: they are called column_1 to column_%d", count)
        return Form(separator, header - 1, names, [], header)
    after = cut[header + 1] if header + 1 < len(cut) else []
    later = cut[header + 2] if header + 2 < len(cut) else []
    numbers = [i for i, field_ in enumerate(later) if _number(field_)]
    words = [i for i in numbers if i < len(after) and not _number(after[i])]
    stated = bool(numbers) and len(words) == len(numbers)
    unit_row = [re.sub(r"^[\[(]|[\])]$", "", u.strip()) for u in after] if stated else []
    return Form(separator, header, unlike(names), unit_row, header + 1 + stated)


def _cut(line: str, separator: str) -> list[str]:
    if separator == " ":
        return re.sub(r"^#\s*", "", line.strip()).split()
    return next(csv.reader([line], delimiter=separator), [])


def _number(text: str) -> bool:
    return bool(re.fullmatch(r"\s*[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?\s*", text))


def unlike(names: list[str]) -> list[str]:
    """Each name once: a second `angle` becomes `angle_2`, an empty one its place."""
    uses: Counter[str] = Counter()
    different: list[str] = []
    for place, name in enumerate(names, 1):
        name = name or f"column_{place}"
        uses[name] += 1
        other = name if uses[name] == 1 else f"{name}_{uses[name]}"
        while other in different:  # a file that has both `a`, `a` and `a_2`
            other += "_2"
        different.append(other)
    return different


def _ungrouped(column: pl.Series) -> pl.Series:
    """Numbers without the commas that group their thousands: "1,002.5" is 1002.5.

    Only for a table that commas separate: elsewhere a comma is a decimal one.
    """
    texts = column.drop_nulls().str.strip_chars()
    with_comma = texts.filter(texts.str.contains(",", literal=True))
    if not len(with_comma) or not with_comma.str.contains(GROUPED).all():
        return column
    log.info("the commas in %r, such as %r, group thousands", column.name, with_comma[0])
    return column.str.replace_all(",", "", literal=True)


def _typed(column: pl.Series) -> pl.Series:
    """Numbers where all are numbers; whole ones stay whole, since nanoseconds need every digit."""
    blank = column.is_null() | (column.str.strip_chars() == "")
    whole = column.str.strip_chars().cast(pl.Int64, strict=False)
    if whole.null_count() == blank.sum():
        return whole if whole.null_count() < len(whole) else whole.cast(pl.Float64)
    number = number_of(column)
    return number if number.null_count() == blank.sum() else column


def _has_commas(form: Form, lines: list[str]) -> bool:
    rows = lines[form.first :]
    return form.separator != "," and any(
        re.fullmatch(r"\s*[+-]?\d*,\d+\s*", one)
        for row in rows
        for one in _cut(row, form.separator)
    )
