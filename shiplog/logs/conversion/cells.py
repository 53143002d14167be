"""What stands in the cells of a table's column, as SI numbers; blank where it is none."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from shiplog.exceptions import ProfileError
from shiplog.logs.conversion import clock
from shiplog.nomenclature import units
from shiplog.ship_profile.profile import Column

log = logging.getLogger(__name__)

LOST_SHARE = 0.5  # of a column's values: more that are no numbers are a loss, and exit code 3
NO_VALUE = ("--", "---", "n/a", "na", "#n/a", "nan", "null", "none", "nil", "missing")  # any case
HEMISPHERES = {"latitude": "NS", "longitude": "EW"}
FARTHEST_DEG = {"latitude": 90.0, "longitude": 360.0}
# 4530.2012N, N 45.50335: one number and its letter
GLUED = r"^([NSEW])?\s*(\d+(?:\.\d*)?)\s*[°º]?\s*([NSEW])?$"
# 45°30.201'N, 45 30 12.1 S, E 13-35.05
PARTED = (
    r"^([NSEW])?\s*(\d{1,3})\s*[°º: -]\s*(\d{1,2}(?:\.\d*)?)\s*['′’:]?"
    r"\s*(?:(\d{1,2}(?:\.\d*)?)\s*(?:\"|″|”|'')?)?\s*([NSEW])?$"
)


@dataclass(frozen=True, slots=True)
class Cells:
    """A column's values in SI [Float64], null where there is none; and what of it was lost."""

    values: pl.Series
    lost: str = ""


def si(texts: pl.Series, column: Column, path: Path) -> Cells:
    """A column as SI numbers; words in it become blanks, and are reported.

    Raises ProfileError where no value of it is a number.
    """
    number, words = texts.cast(pl.Float64, strict=False), []
    if texts.dtype == pl.String:
        number = _numbers(texts, column)
        stripped = texts.str.strip_chars()
        words = texts.filter(number.is_null() & (stripped != "")).to_list()
        if number.null_count() == len(number) and words:
            raise ProfileError(
                f"{path.name}: the column {texts.name!r} holds no number, but {words[0]!r}.",
                hint="name another column for this channel in [table].",
            )
    lost = _said(texts, number, words, path) if words else ""
    factor = column.sign * units.factor(column.unit or "1")
    return Cells(((number - column.offset) * factor).rename(column.channel), lost)


def _said(texts: pl.Series, number: pl.Series, words: list[str], path: Path) -> str:
    """Report words among numbers. Where they are more than half, return it: it is a loss."""
    log.warning(
        "%s: %d values of %s are no numbers, such as %s; taken as not measured",
        path.name, len(words), texts.name, _short(words[0]),
    )  # fmt: skip
    meant = [word for word in words if word.strip().lower() not in NO_VALUE]
    filled = number.count() + len(words)
    if len(meant) <= LOST_SHARE * filled:
        return ""
    return (
        f"{len(meant)} of {filled} values of {texts.name!r} are no numbers, such as "
        f"{_short(meant[0])}"
    )


def _short(word: str) -> str:
    return repr(word if len(word) <= 40 else word[:40] + "...")


def drop_missing(values: pl.Series, missing: Sequence[float | str]) -> pl.Series:
    """A column without the values that stand for none."""
    stands = pl.Series([False]).new_from_index(0, len(values))
    if values.dtype == pl.Boolean:
        values = values.cast(pl.String)
    for mark in missing:
        if isinstance(mark, str):
            if values.dtype == pl.String:
                stands |= (values.str.strip_chars() == mark.strip()).fill_null(False)
        elif values.dtype.is_numeric():
            near = 1e-9 * max(1.0, abs(mark))
            stands |= ((values.cast(pl.Float64) - mark).abs() <= near).fill_null(False)
        elif values.dtype == pl.String:
            number = clock.number_of(values)
            stands |= ((number - mark).abs() <= 1e-9 * max(1.0, abs(mark))).fill_null(False)
    return values.set(stands, None)


def holds(values: pl.Series, marks: Sequence[float | str]) -> pl.Series:
    """Whether a row's value [bool] is one of some, as numbers or as words."""
    return values.is_not_null() & drop_missing(values, marks).is_null()


def _numbers(texts: pl.Series, column: Column) -> pl.Series:
    """Texts as numbers, of coordinates also with the letter of their hemisphere."""
    number = clock.number_of(texts)
    letters = HEMISPHERES.get(column.channel)
    if letters and column.unit == "deg":
        degrees = coordinates(texts, letters, FARTHEST_DEG[column.channel])
        return number.fill_null(degrees)
    return number


def coordinates(texts: pl.Series, letters: str, farthest: float) -> pl.Series:
    """Degrees [Float64] of coordinates with a letter, south and west negative; null for others.

    `4530.2012N` is 45 deg 30.2012 min, as NMEA writes it, where a value of the column has more than
    three digits before its dot: such a number of degrees there is not.
    """
    plain = texts.str.strip_chars().str.to_uppercase().str.replace(",", ".", literal=True)
    one = plain.str.extract_groups(GLUED).struct.unnest()
    value = one["2"].cast(pl.Float64, strict=False)
    if one["2"].str.contains(r"^\d{4}").any():
        whole = (value / 100.0).floor()
        minutes = value - 100.0 * whole
        value = (whole + minutes / 60.0).set(minutes >= 60.0, None)
    parts = plain.str.extract_groups(PARTED).struct.unnest()
    degree, minute, second = (parts[i].cast(pl.Float64, strict=False) for i in ("2", "3", "4"))
    beyond = ((minute >= 60.0) | (second >= 60.0)).fill_null(False)
    parted = (degree + minute / 60.0 + second.fill_null(0.0) / 3600.0).set(beyond, None)
    letter = one["1"].fill_null(one["3"]).fill_null(parts["1"]).fill_null(parts["5"])
    value = value.fill_null(parted)
    wrong = (~letter.is_in([*letters]) | (value > farthest)).fill_null(True)
    negative = (letter == letters[1]).fill_null(False)
    return pl.select(
        pl.when(wrong).then(None).when(negative).then(-value).otherwise(value)
    ).to_series().rename(texts.name)  # fmt: skip
