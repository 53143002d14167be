"""Text and Parquet tables as people export them: any separator, decimal commas, units in a row."""

from __future__ import annotations

import codecs
import csv
import logging
import re
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl

from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion.sound_rows import sound_rows
from shiplog.logs.conversion.written_numbers import is_number, read_columns
from shiplog.logs.mcap_file.foreign_files import is_binary
from shiplog.ship_profile.profile import Column

log = logging.getLogger(__name__)

TEXT = (".csv", ".tsv", ".txt", ".dat", ".asc", ".tab")
# In this order: of "1,5;2,5" each comma comes as regularly as the semicolon does.
SEPARATORS = (";", "\t", "|", ",", " ")
SAMPLE_BYTES = 65_536  # bytes that tell the form of a text
LOOK = 200  # lines of them
LONGEST_ROW = 80  # letters of a row in a message
FEW = 10  # times fewer damaged letters than others: the text is UTF-8 all the same
_BETWEEN = r"[-/.:\u2010-\u2015\u2212]"
TIME = rf"\s*\d{{1,4}}{_BETWEEN}\d{{1,2}}{_BETWEEN}\d{{1,4}}"  # how a date or a time of day begins
REGULAR = 0.8  # share of lines that a separator cuts alike


@dataclass(frozen=True, slots=True)
class DelimitedTable:
    """A table, and what its file states in addition.

    units      of a row of units under the header
    lost       sentences on rows that are damaged and left out
    undecided  columns whose numbers can be read in two ways, with one of them
    """

    frame: pl.DataFrame
    units: dict[str, str] = field(default_factory=dict)
    lost: tuple[str, ...] = ()
    undecided: dict[str, str] = field(default_factory=dict)
    nameless: tuple[str, ...] = ()  # columns that no line of the file names


@dataclass(frozen=True, slots=True)
class Form:
    """How a text is cut: separator, the header's line, and whether units follow it."""

    separator: str
    header: int  # line number, from 0
    names: list[str]
    units: list[str]
    first: int  # line of the first row
    nameless: bool = False  # no line names the columns


def is_table(path: Path) -> bool:
    """Whether the name says that this is a table."""
    return path.suffix.lower() in (".parquet", *TEXT)


def read_table(path: Path, known: Mapping[str, Column] | None = None) -> DelimitedTable:
    """A text or Parquet table.

    known  columns that the profile speaks of: a line that holds them is the header

    Raises ChannelMissing for what is no table, cannot be read or holds no row.
    """
    if not path.is_file() or not (is_table(path) or not is_binary(path)):
        raise ChannelMissing(
            f"{path} is no table.", hint=f"give a file of type .parquet, {', '.join(TEXT)}."
        )
    known = known or {}
    stated = {name: column.decimal for name, column in known.items() if column.decimal}
    try:
        if path.suffix.lower() == ".parquet":
            table = plain(pl.read_parquet(path), stated)
        else:
            table = _read_text(path, known, stated)
    except (pl.exceptions.PolarsError, OSError, UnicodeError, csv.Error) as error:
        raise ChannelMissing(f"{path} cannot be read: {error}.", hint="check the file.") from error
    if table.frame.height == 0:
        raise ChannelMissing(
            f"{path.name} holds no row under its header.", hint="export the table again."
        )
    return table


def plain(frame: pl.DataFrame, stated: Mapping[str, str] | None = None) -> DelimitedTable:
    """A table of its own types: what stands in it as text has its numbers in plain digits.

    stated  column → its decimal sign, where that is known
    """
    stated = stated or {}
    texts = [name for name, dtype in frame.schema.items() if dtype == pl.String]
    if not texts:
        return DelimitedTable(frame)
    read = read_columns(frame.select(texts), stated, as_numbers=False)
    return DelimitedTable(frame.with_columns(read.frame), undecided=read.undecided)


def _read_text(path: Path, known: Collection[str], stated: Mapping[str, str]) -> DelimitedTable:
    text = _utf8(path.read_bytes())
    sample = text[:SAMPLE_BYTES]
    if len(text) > SAMPLE_BYTES:
        sample = sample[: sample.rfind(b"\n") + 1] or sample  # its last line is cut
    lines = sample.decode("utf-8", "replace").replace("\r\n", "\n").split("\n")
    form = _form(lines[:LOOK], known)
    if form is None:
        raise ChannelMissing(
            f"{path.name} is no table: no separator cuts its lines alike.",
            hint="separators are ; tab | , or spaces; the first line names the columns.",
        )
    header = text[_place(text, form.header) : _place(text, form.header + 1)]
    body, separator = text[_place(text, form.first) :], form.separator
    if separator == " ":
        body, separator = b"\n".join(b"\t".join(one.split()) for one in body.split(b"\n")), "\t"
    rows = sound_rows(body, separator, len(form.names), form.first, header)
    if rows is None:
        raise _unlike_header(path, form, body, separator)
    names = [*form.names, *[""] * (rows.width - len(form.names))]
    columns = [str(place) for place in range(len(names))]
    frame = pl.read_csv(  # a first row may be short: it is the header that says how many columns
        separator.join(columns).encode() + b"\n" + rows.body, separator=separator,
        infer_schema=False, truncate_ragged_lines=True,
    )  # fmt: skip
    frame = frame.select(columns[: len(form.names)])
    read = read_columns(frame.rename(dict(zip(frame.columns, form.names, strict=True))), stated)
    commas = " and decimal commas" if read.decimal_commas else ""
    if form.separator != "," or commas:
        cut = {"\t": "tabs", " ": "spaces"}.get(form.separator, repr(form.separator))
        log.info("%s: separated by %s%s", path.name, cut, commas)
    units = {n: u for n, u in zip(form.names, form.units, strict=False) if u}
    nameless = tuple(form.names) if form.nameless else ()
    return DelimitedTable(read.frame, units, rows.lost, read.undecided, nameless)


def _unlike_header(path: Path, form: Form, body: bytes, separator: str) -> ChannelMissing:
    """What to say where the names are not as many as the values."""
    first = next(line for line in body.split(b"\n") if line.strip()).decode("utf-8", "replace")
    values = len(_cut(first, separator))
    return ChannelMissing(
        f"{path.name}: line {form.header + 1} has {len(form.names)} names, and the rows have "
        f"{values} values: which name belongs to which value is not known. The first row is "
        f"{first[:LONGEST_ROW]!r}.",
        hint=f"name every column once, in its place, in line {form.header + 1}; put a name that "
        "holds a separator into quotation marks.",
    )


def _place(text: bytes, line: int) -> int:
    """Where a line begins, in bytes."""
    at = 0
    for _ in range(line):
        at = text.find(b"\n", at) + 1
        if not at:
            return len(text)
    return at


def _utf8(raw: bytes) -> bytes:
    """As UTF-8 without a mark, of UTF-8, UTF-16 or what Western Windows programs write; lines end
    with a line feed."""
    text = raw.removeprefix(codecs.BOM_UTF8)
    if raw[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        text = raw.decode("utf-16", "replace").encode()
    elif wide := _wide(raw):
        text = raw.decode(wide, "replace").encode()
    elif not text.isascii():
        text = _recoded(text)
    return text if b"\n" in text else text.replace(b"\r", b"\n")


def _recoded(text: bytes) -> bytes:
    try:
        text.decode()
        return text
    except UnicodeDecodeError:
        lenient = text.decode("utf-8", "replace")
        broken = lenient.count("\ufffd")
        if broken * FEW < sum(byte > 127 for byte in text[:SAMPLE_BYTES]):
            return lenient.encode()  # UTF-8 with a damaged byte in it
        return text.decode("cp1252", "replace").encode()


def _wide(raw: bytes) -> str | None:
    """The UTF-16 of a text without a mark: every second byte of Western letters is 0."""
    sample = raw[:SAMPLE_BYTES]
    for start, name in ((1, "utf-16-le"), (0, "utf-16-be")):
        if sample[start::2].count(0) > REGULAR * len(sample) / 2 and not sample[
            1 - start :: 2
        ].count(0):
            return name
    return None


def form_of(lines: list[list[str]], known: Collection[str]) -> Form | None:
    """Where the header of cells is, and which units follow it; None where no two of them stand in
    a line. Lines of one cell are remarks."""
    cut = [line[: max((i + 1 for i, cell in enumerate(line) if cell.strip()), default=0)]
           for line in lines]  # fmt: skip
    width = max(map(len, cut), default=0)
    filled = [sum(bool(cell.strip()) for cell in line) for line in cut]
    if width < 2 or max(filled) < 2:
        return None
    whole = [line + [""] * (width - len(line)) if count > 1 else line
             for line, count in zip(cut, filled, strict=True)]  # fmt: skip
    return _headed(whole, width, "\t", known)


@dataclass(frozen=True, slots=True)
class _Cut:
    """Lines cut by one separator: how many fields most have, and the first line of these."""

    separator: str
    lines: list[list[str]]
    count: int
    start: int

    @property
    def throughout(self) -> bool:
        """Whether all lines from the first have as many fields."""
        return all(len(fields) == self.count for fields in self.lines[self.start :] if any(fields))


def _form(lines: list[str], known: Collection[str]) -> Form | None:
    """The separator that cuts most lines into the same number of fields, and the header."""
    cuts = [cut for separator in SEPARATORS if (cut := _regular(lines, separator)) is not None]
    if not cuts:
        return None
    first, *others = cuts
    for other in others:  # a remark of every row may have the first one in it, and the header not
        if other.start < first.start and other.count >= first.count and other.throughout:
            first = other
    return _headed(first.lines, first.count, first.separator, known)


def _regular(lines: list[str], separator: str) -> _Cut | None:
    """The lines cut by a separator, if it cuts most of them alike."""
    cut = [_cut(line, separator) for line in lines]
    counts = Counter(len(fields) for fields in cut if any(fields))
    counts.pop(1, None)
    if not counts:
        return None
    (count, times), *others = counts.most_common(2)
    # What stands before the header is cut otherwise, and does not count; rows may end early.
    alike = {count, *(other for other, _ in others)}
    start = next(i for i, fields in enumerate(cut) if len(fields) in alike)
    times += sum(often for _, often in others)
    if times < REGULAR * sum(any(fields) for fields in cut[start:]):
        return None
    return _Cut(separator, cut, count, next(i for i, f in enumerate(cut) if len(f) == count))


def _headed(cut: list[list[str]], count: int, separator: str, known: Collection[str]) -> Form:
    whole = [i for i, fields in enumerate(cut) if len(fields) == count]
    header = max(range(len(cut)), key=lambda i: (len(set(cut[i]) & set(known)), -i))
    if len(cut[header]) < 2 or not set(cut[header]) & set(known):
        header = _header(cut, whole)
    if header is None:
        names = [f"column_{i + 1}" for i in range(count)]
        log.warning("no line names the columns: they are called column_1 to column_%d", count)
        return Form(separator, whole[0] - 1, names, [], whole[0], nameless=True)
    names = [re.sub(r"^#\s*", "", name.strip()) for name in cut[header]]
    after = cut[header + 1] if header + 1 < len(cut) else []
    later = cut[header + 2] if header + 2 < len(cut) else []
    numbers = [i for i, field_ in enumerate(later) if is_number(field_)]
    words = [i for i in numbers if i < len(after) and not is_number(after[i])]
    stated = bool(numbers) and len(words) == len(numbers) and not any(map(_value, after))
    unit_row = [re.sub(r"^[\[(]|[\])]$", "", u.strip()) for u in after] if stated else []
    return Form(separator, header, unlike(names), unit_row, header + 1 + stated)


def _header(cut: list[list[str]], whole: list[int]) -> int | None:
    """The line that names the columns: the first of its width, or the one before it where that one
    is a row already. None where no line does."""
    first, rows = whole[0], [cut[i] for i in whole[1:]]
    if not rows or not _is_row(cut[first], rows):
        return first
    before = next((i for i in range(first - 1, -1, -1) if any(cut[i])), None)
    if before is None or 2 * len(cut[before]) < len(cut[first]) or _is_row(cut[before], rows):
        return None
    return before


def _is_row(fields: list[str], rows: list[list[str]]) -> bool:
    """Whether a line is one of the rows: it has a number or a time where they have one."""
    alike = False
    for i, text in enumerate(fields):
        of_rows = [row[i] for row in rows if i < len(row) and row[i].strip()]
        if not of_rows or not text.strip():
            continue
        if 2 * sum(map(_value, of_rows)) <= len(of_rows):
            continue
        if not _value(text):
            return False
        alike = True
    return alike


def _cut(line: str, separator: str) -> list[str]:
    if separator == " ":
        return re.sub(r"^#\s*", "", line.strip()).split()
    return next(csv.reader([line], delimiter=separator), [])


def _value(text: str) -> bool:
    return is_number(text) or bool(re.match(TIME, text))


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
