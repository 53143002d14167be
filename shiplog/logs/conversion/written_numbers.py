"""How numbers are written in a text table: decimal sign, groups of digits, minus signs.

Of `40,000` nobody can say by itself whether it is 40 or 40 000. The same file says it elsewhere: in
`0,512` the comma can only be a decimal one, in `1,234.5` only one that groups. So a column is read
as its own values say, else as the other columns of the file do, else it is asked for.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import polars as pl

SAMPLE = 1_000  # values of a column that mostly say how it is written
MOSTLY = 0.5  # share of a column's values that are numbers: it is then no column of words
CLEAR = 3  # times as many columns with the one sign as with the other: a slip is not the file's

_DASHES = "\u2010\u2011\u2012\u2013\u2212"  # hyphen, non-breaking, figure and en dash, minus
_GROUPS = " \u00a0\u2009\u202f'\u2019"  # spaces and apostrophes that group digits
_END = r"(?:[eE][+-]?\d+)?$"
MINUS = rf"^[{_DASHES}]\s?([\d.,])"
LONE_DASH = rf"^[-{_DASHES}\u2014\u2015]$"
SPACED = rf"^[+-]?\d{{1,3}}(?:[{_GROUPS}]\d{{3}})+(?:[.,]\d*)?{_END}"
NUMBER = rf"^[+-]?(?:\d[\d.,]*|[.,]\d+){_END}"


def _only_decimal(sign: str, other: str) -> str:
    """Numbers whose `sign` can only stand before decimals: 0,5  12,25  1234,567  1.234,5"""
    s, o = f"[{sign}]", f"[{other}]"
    return (
        rf"^[+-]?(?:\d*{s}\d{{1,2}}|\d*{s}\d{{4,}}|0\d*{s}\d*|\d*{s}|\d{{4,}}{s}\d*"
        rf"|\d{{1,3}}(?:{o}\d{{3}})+{s}\d*|\d*{s}\d+[eE][+-]?\d+)$"
    )


def _only_groups(sign: str, other: str) -> str:
    """Numbers whose `sign` can only group: 1,234,567  1,234.5"""
    s, o = f"[{sign}]", f"[{other}]"
    return rf"^[+-]?[1-9]\d{{0,2}}(?:(?:{s}\d{{3}}){{2,}}|(?:{s}\d{{3}})+{o}\d*){_END}"


def _either(sign: str) -> str:
    """Numbers whose `sign` can be both: 1,199"""
    return rf"^[+-]?[1-9]\d{{0,2}}[{sign}]\d{{3}}$"


ONLY_DECIMAL = {",": _only_decimal(",", "."), ".": _only_decimal(".", ",")}
ONLY_GROUPS = {",": _only_groups(",", "."), ".": _only_groups(".", ",")}
EITHER = {",": _either(","), ".": _either(".")}
OTHER = {",": ".", ".": ","}
UNGROUPED = r"^[+-]?[1-9]\d{3,}$"  # 1500: its column groups no thousands


@dataclass(frozen=True, slots=True)
class ReadColumns:
    """The columns of a text table, numbers where all of a column are numbers.

    undecided  columns whose numbers can be read in two ways, with one of them
    """

    frame: pl.DataFrame
    undecided: dict[str, str]
    decimal_commas: bool


def read_columns(
    texts: pl.DataFrame, stated: Mapping[str, str], as_numbers: bool = True
) -> ReadColumns:
    """The columns of a table of texts, as its whole file says how numbers are written.

    stated      the decimal sign of each column whose profile gives one
    as_numbers  make numbers of a column where all are; else what is written is only made plain
    """
    columns = [_Column(series, stated.get(series.name)) for series in texts.get_columns()]
    file = _of_file(columns)
    commas = any(column.open_sign == "," and column.own is None for column in columns)
    made, undecided = [], {}
    for column in columns:
        sign = column.stated or column.own or (file if column.open_sign else None)
        plain = column.plain_dots and not commas  # a dot is a decimal one where no comma is
        if sign is None and column.open_sign is not None and not plain:
            undecided[column.texts.name] = column.example
        made.append(column.read(sign, as_numbers))
    return ReadColumns(pl.DataFrame(made), undecided, file == ",")


def is_number(text: str) -> bool:
    """Whether a text is a number in any way of writing one."""
    plain = re.sub(rf"^[{_DASHES}]\s?", "-", text.strip())
    return bool(re.match(NUMBER, re.sub(rf"(?<=\d)[{_GROUPS}](?=\d{{3}})", "", plain)))


def _of_file(columns: list[_Column]) -> str | None:
    """The decimal sign that the columns of a file have; None where they do not agree on one."""
    signs = [column.stated or column.own for column in columns]
    commas, dots = signs.count(","), signs.count(".")
    if commas and commas >= CLEAR * dots:
        return ","
    return "." if dots and dots >= CLEAR * commas else None


class _Column:
    """One column of texts, and what its own values say of how they are written."""

    def __init__(self, texts: pl.Series, stated: str | None) -> None:
        self.stated = stated
        self.texts = texts.str.strip_chars()
        self.own: str | None = None  # the decimal sign that its own values have
        self.open_sign: str | None = None  # what may be a decimal sign, or group
        self.plain_dots = False  # dots in numbers none of which is grouped like a thousand
        self.example = ""
        self.number = _number(self.texts)
        if self.number is None:
            self.texts = _plain_signs(self.texts)
            self.number = _number(self.texts)
        if self.number is None or self.number.dtype.is_float():
            self._look()

    def _look(self) -> None:
        """What the values say: first some of them, all only where these do not decide."""
        if self.number is not None and self._has(ONLY_DECIMAL["."], SAMPLE):
            self.own = "."
            return
        there = [s for s in OTHER if self.texts.str.contains(s, literal=True).any()]
        if not there or (self.number is None and not self._mostly_numbers()):
            return
        says = {
            sign: (sign in there and self._has_first(ONLY_DECIMAL[sign]))
            or (OTHER[sign] in there and self._has_first(ONLY_GROUPS[OTHER[sign]]))
            for sign in OTHER
        }
        if says[","] != says["."]:
            self.own = "," if says[","] else "."
            return
        if says[","]:  # and dots, too
            self.open_sign, self.example = ",", self._first(NUMBER)
            return
        for sign in OTHER:
            if not self._has(EITHER[sign]):
                continue
            self.open_sign = sign
            self.example = self._first(EITHER[sign])
            if self._has(UNGROUPED):
                self.own = sign
            elif sign == ".":
                self.plain_dots = not self._has(r"^[+-]?\d{1,3}$")
            return

    def _has(self, pattern: str, most: int | None = None) -> bool:
        texts = self.texts if most is None else self.texts.head(most)
        return bool(texts.str.contains(pattern).any())

    def _has_first(self, pattern: str) -> bool:
        return self._has(pattern, SAMPLE) or self._has(pattern)

    def _first(self, pattern: str) -> str:
        return str(self.texts.filter(self.texts.str.contains(pattern))[0])

    def _mostly_numbers(self) -> bool:
        filled = self.texts.filter(self.texts != "").head(SAMPLE)
        return len(filled) > 0 and filled.str.contains(NUMBER).sum() >= MOSTLY * len(filled)

    def read(self, sign: str | None, as_numbers: bool) -> pl.Series:
        """The column with plain decimal dots, where `sign` says what is one."""
        texts = self.texts
        if sign == "," or (sign == "." and self.number is None):
            texts = _with_dots(texts, sign)
        if not as_numbers:
            return texts
        if texts is self.texts:
            return texts if self.number is None else self.number
        number = _number(texts)
        return texts if number is None else number


def _plain_signs(texts: pl.Series) -> pl.Series:
    """Texts with dashes before digits as minus signs, a lone dash as blank, and no spaces or
    apostrophes between groups of digits."""
    if not texts.str.contains(rf"[{_DASHES}\u2014\u2015{_GROUPS}]|^-$").any():
        return texts
    texts = texts.str.replace(MINUS, "-$1")
    spaced = texts.str.contains(SPACED)
    if spaced.any():
        joined = texts.str.replace_all(f"[{_GROUPS}]", "")
        texts = joined.zip_with(spaced.fill_null(False), texts)
    lone = texts.str.contains(LONE_DASH)
    return texts.set(lone.fill_null(False), None) if lone.any() else texts


def _with_dots(texts: pl.Series, sign: str) -> pl.Series:
    """Numbers with a decimal dot and without groups, of such with this decimal sign; other texts
    stay as they are."""
    s, o = f"[{sign}]", f"[{OTHER[sign]}]"
    form = rf"^[+-]?(?:\d{{1,3}}(?:{o}\d{{3}})+|\d*)(?:{s}\d*)?{_END}"
    fits = texts.str.contains(form)
    plain = texts.str.replace_all(OTHER[sign], "", literal=True)
    if sign == ",":
        plain = plain.str.replace(",", ".", literal=True)
    return plain.zip_with(fits.fill_null(False), texts)


def _number(texts: pl.Series) -> pl.Series | None:
    """Numbers where all are numbers; whole ones stay whole, since nanoseconds need every digit."""
    blank = int((texts.is_null() | (texts == "")).sum())
    whole = texts.cast(pl.Int64, strict=False)
    if whole.null_count() == blank:
        return whole if blank < len(whole) else whole.cast(pl.Float64)
    number = texts.cast(pl.Float64, strict=False)
    return number if number.null_count() == blank else None
