"""Times in a form that a profile states in strptime's letters, and numbers that count days."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.exceptions import ProfileError
from shiplog.nomenclature.units import SECOND_NS

DAY_NS = 86_400 * SECOND_NS
MONTHS = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_LONG = ("january", "february", "march", "april", "may", "june", "july", "august", "september",
         "october", "november", "december")  # fmt: skip
_WEEKDAYS = ("monday", "tuesday", "wednesday", "thursday", "friday", "saturday", "sunday")
LETTERS = {  # a part of a form, and the texts that it takes: those of Python's own strptime
    "Y": r"\d{4}", "y": r"\d{2}", "m": r"1[0-2]|0[1-9]|[1-9]",
    "d": r"3[01]|[12]\d|0[1-9]|[1-9]",
    "j": r"36[0-6]|3[0-5]\d|[12]\d\d|0[1-9]\d|00[1-9]|[1-9]\d|0[1-9]|[1-9]",
    "b": "|".join(MONTHS), "B": "|".join(_LONG),
    "a": "|".join(day[:3] for day in _WEEKDAYS), "A": "|".join(_WEEKDAYS),
    "H": r"2[0-3]|[01]\d|\d", "I": r"1[0-2]|0[1-9]|[1-9]", "p": r"[ap]\.?m\.?",
    "M": r"[0-5]\d|\d", "S": r"6[01]|[0-5]\d|\d", "f": r"\d+",
    "z": r"[+-]\d\d(?::?\d\d(?::?\d\d)?)?|z", "Z": r"utc|gmt|z",
    "%": "%",
}  # fmt: skip
# Parts that polars has in addition: a form with one of them is read by it.
OTHERS = re.compile(r"%(?:[FTDReklsPnthCvr+]|\.\d?f|\d?f(?<!%f)|[#:]+z|[-_0][A-Za-z])")
WRITE = "write it with " + " ".join(f"%{letter}" for letter in LETTERS)
CENTURY = 69  # %y: 69 to 99 are of the last century, as POSIX has it
YEARS = (1678, 2261)  # that 64 bits of ns hold

# Numbers of days: the one of 1970-01-01, and between which numbers they are of 1990 to 2100. What a
# spreadsheet counts from 2041 on are modified Julian days since 2000.
DAY_NUMBERS = {
    "a spreadsheet's": (25_569.0, 32_874.0, 51_544.0),
    "modified Julian": (40_587.0, 51_544.0, 88_069.0),
    "MATLAB's": (719_529.0, 726_834.0, 767_011.0),
    "Julian": (2_440_587.5, 2_447_892.5, 2_488_070.0),
}
FASTEST_STEP_S = 0.9e-3  # numbers that step by less, row by row, are no seconds of a ship's log
DIGITS = 7  # a spreadsheet's cell shows no more of 1.71724E+12
LEAST_ROWS = 3  # that are alike


@dataclass(frozen=True, slots=True)
class Form:
    """A form, taken apart: its texts as a pattern, and the letter of each of its groups."""

    pattern: str
    letters: tuple[str, ...]

    @property
    def dated(self) -> bool:
        return "d" in self.letters or "j" in self.letters


def is_strptime(form: str) -> bool:
    """Whether a form has strptime's letters only."""
    return OTHERS.search(form) is None


def taken_apart(form: str, column: str) -> Form:
    """Raises ProfileError for a part that is not read, and for a form that leaves a time open."""
    pattern, letters, at = "", [], 0
    while at < len(form):
        if form[at] != "%":
            pattern += r"\s+" if form[at].isspace() else re.escape(form[at])
            at += 1
            continue
        letter = form[at + 1 : at + 2]
        if letter not in LETTERS:
            raise _refused(form, column, f"has %{letter}, which is not read")
        if letter == "%":
            pattern += "%"
        else:
            pattern += f"({LETTERS[letter]})"
            letters.append(letter)
        at += 2
    found = Form(rf"(?i)^\s*{pattern}\s*$", tuple(letters))
    dated = found.dated or {"m", "b", "B"} & {*letters}
    if dated and not {"Y", "y"} & {*letters}:
        raise _refused(form, column, "names no year")
    if found.dated and "j" not in letters and not {"m", "b", "B"} & {*letters}:
        raise _refused(form, column, "names no month")
    if ("I" in letters) != ("p" in letters):
        lacks = "%p, which says the half of the day of %I" if "I" in letters else "%I next to %p"
        raise _refused(form, column, f"lacks {lacks}")
    return found


def _refused(form: str, column: str, why: str) -> ProfileError:
    return ProfileError(
        f"The format {form!r} of the column {column!r} {why}.",
        hint=f"{WRITE}; of a time alone, without a date, %H:%M:%S.",
    )


def parse(texts: pl.Series, form: Form) -> pl.Series:
    """Texts in one form as ns [Int64] since 1970, or since midnight where it has no date; null
    where a text is in another form, or is no day."""
    groups = texts.str.extract_groups(form.pattern).struct.unnest()
    part = {
        letter: groups.to_series(place).str.to_lowercase()
        for place, letter in enumerate(form.letters)
    }
    number = {
        letter: part[letter].cast(pl.Float64, strict=False).to_numpy()
        for letter in "YymdjHIMS" if letter in part
    }  # fmt: skip
    length = len(texts)
    total = np.zeros(length, np.int64)
    known = groups.to_series(0).is_not_null().to_numpy() if form.letters else np.zeros(length, bool)
    if form.dated:
        days, real = _days(part, number, known)
        total += days * DAY_NS
        known &= real
    for letter, seconds in (("H", 3600), ("M", 60), ("S", 1)):
        if letter in number:
            total += np.nan_to_num(number[letter]).astype(np.int64) * seconds * SECOND_NS
    if "I" in number:
        half = part["p"].str.starts_with("p").fill_null(False).to_numpy()
        hours = np.nan_to_num(number["I"]).astype(np.int64) % 12 + 12 * half
        total += hours * 3600 * SECOND_NS
    if "f" in part:
        digits = part["f"].str.slice(0, 9).str.pad_end(9, "0")
        total += digits.cast(pl.Int64, strict=False).fill_null(0).to_numpy()
    if "z" in part:
        total -= _zone(part["z"])
    made = pl.Series(texts.name, total)
    return made.set(pl.Series(~known), None)


def _days(
    part: dict[str, pl.Series], number: dict[str, np.ndarray], known: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Days since 1970 [n], and whether [n] they are days of a calendar."""
    if "Y" in number:
        year = number["Y"]
    else:
        year = np.where(number["y"] < CENTURY, 2000.0, 1900.0) + number["y"]
    year = np.where(known, np.nan_to_num(year), 1970.0).astype(np.int64)
    real = (year >= YEARS[0]) & (year <= YEARS[1])
    year = np.where(real, year, 1970)
    january = (year - 1970).astype("M8[Y]")
    if "j" in number:
        days = january.astype("M8[D]").astype(np.int64) + _whole(number["j"]) - 1
        return days, real
    if "m" in number:
        month = _whole(number["m"])
    else:
        names = part["b"] if "b" in part else part["B"].str.slice(0, 3)
        month = np.zeros(len(year), np.int64)
        for place, name in enumerate(MONTHS, 1):
            month[(names == name).fill_null(False).to_numpy()] = place
    begins = january.astype("M8[M]") + np.maximum(month - 1, 0)
    day = begins.astype("M8[D]") + np.maximum(_whole(number["d"]) - 1, 0)
    return day.astype(np.int64), real & (day.astype("M8[M]") == begins)


def _whole(values: np.ndarray) -> np.ndarray:
    return np.nan_to_num(values).astype(np.int64)


def _zone(texts: pl.Series) -> np.ndarray:
    """Offsets from UTC [ns]."""
    parts = texts.str.extract_groups(r"^([+-])(\d\d):?(\d\d)?:?(\d\d)?").struct.unnest()
    seconds = np.zeros(len(texts), np.int64)
    for name, each in (("2", 3600), ("3", 60), ("4", 1)):
        seconds += parts[name].cast(pl.Int64, strict=False).fill_null(0).to_numpy() * each
    west = (parts["1"] == "-").fill_null(False).to_numpy()
    return np.where(west, -seconds, seconds) * SECOND_NS


def counts_days(number: float) -> tuple[str, float] | None:
    """Whose number of days a number may be, and the one of 1970-01-01; None where it is none."""
    for name, (zero, first, last) in DAY_NUMBERS.items():
        if first <= number < last:
            return name, zero
    return None


def too_fast(values: pl.Series) -> float | None:
    """The step of numbers that are no seconds, since their rows would be too near to each other;
    None of others."""
    number = values.cast(pl.Float64).fill_nan(None).drop_nulls()
    steps = number.diff().drop_nulls()
    steps = steps.filter(steps > 0)
    if len(number) < LEAST_ROWS or len(steps) == 0:
        return None
    step = float(np.median(steps.to_numpy()))
    span = float(np.ptp(number.to_numpy()))
    return step if max(step, span / len(number)) < FASTEST_STEP_S else None


def of_days(values: pl.Series) -> pl.Series:
    """Numbers of days as ns [Int64]: since 1970 where their size says whose numbers they are, else
    since any start."""
    number = values.cast(pl.Float64).fill_nan(None)
    sizes = number.drop_nulls().to_numpy()
    counted = counts_days(float(np.median(sizes))) if len(sizes) else None
    since = number - (counted[1] if counted else 0.0)
    whole = since.floor()
    rest = ((since - whole) * DAY_NS).round().cast(pl.Int64, strict=False)
    return (whole.cast(pl.Int64, strict=False) * DAY_NS + rest).rename(values.name)


def is_cut(values: pl.Series) -> bool:
    """Whether numbers have lost the digits in which they differ, as 1.71724E+12."""
    number = values.cast(pl.Float64).fill_nan(None).drop_nulls().to_numpy()
    if (
        len(number) < LEAST_ROWS
        or not (np.abs(number) >= 1e9).all()
        or not np.isfinite(number).all()
    ):
        return False
    if 2 * (np.diff(number) == 0.0).sum() < len(number) - 1:
        return False  # counts in whole seconds, and not cut
    unit = 10.0 ** (np.floor(np.log10(np.abs(number).max())) - (DIGITS - 1))
    return bool((np.mod(np.round(number / unit, 6), 1.0) == 0.0).all())


def cut(name: str, values: pl.Series) -> ProfileError:
    """What to say of such numbers."""
    most = values.cast(pl.Float64).fill_nan(None).drop_nulls()[0]
    return ProfileError(
        f"The times of column {name!r}, such as {most:.6G}, were cut to {DIGITS} digits or fewer, "
        "as by a spreadsheet that shows a long number in a narrow cell: when each row was is lost.",
        hint="export the table again with all its digits, from the program that recorded it, or "
        "with that column formatted as a number without decimals.",
    )
