"""The times of a table, in whatever form they stand there, as nanoseconds since 1970."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import numpy as np
import polars as pl

from shiplog.exceptions import ProfileError
from shiplog.logs.conversion import written_times
from shiplog.logs.decoding import fields
from shiplog.nomenclature import units
from shiplog.nomenclature.units import SECOND_NS

DAY_NS = 86_400 * SECOND_NS
LATEST_NS = 3600 * SECOND_NS  # no row comes later than that
LONGEST_STEP_S = 60.0  # no ship's motion is recorded more slowly: the numbers are not seconds
# A date must come whole: "3/4/2024" is two days, and only the other rows can say which.
DATE_FORMATS = ("%Y-%m-%d", "%Y/%m/%d", "%d.%m.%Y", "%Y%m%d", "%d%m%y")
SLASHED = (
    "%d/%m/%Y", "%m/%d/%Y", "%d/%m/%y", "%m/%d/%y", "%y/%m/%d", "%d-%m-%Y", "%m-%d-%Y", "%d-%m-%y",
    "%m-%d-%y", "%y-%m-%d", "%d.%m.%y", "%d-%b-%Y", "%d %b %Y", "%b %d %Y", "%d/%b/%Y",
)  # fmt: skip
CLOCK_FORMATS = ("%H:%M:%S%.f", "%H:%M")
HALVES = ("%I:%M:%S%.f %p", "%I:%M %p")  # of a day, with am and pm
AM_PM = r"(?i)\s*([ap])\.?m\.?$"
FORM_ROWS = 1_000  # of a long column, which say the forms that are tried on all of it
HHMMSS = "%H%M%S"  # of a time of day that is written as one number: 93005 is 09:30:05
SAME_STEP = 1.5  # times the median: a row after the next minute's beginning is no later than that
WIDTHS = {"%Y": 4, "%j": 3}  # digits of a form's parts; all others have two


class DateOpen(ProfileError):
    """A date can be read with the day or with the month first."""

    def __init__(self, problem: str, hint: str, either: pl.Series) -> None:
        super().__init__(problem, hint=hint)
        self.either = either  # ns in one of the two ways: within a day they differ by a constant


def instants(values: pl.Series, unit: str | None = None, form: str | None = None) -> pl.Series:
    """Times [Int64, ns], null where there is none, or a word among numbers.

    values  datetimes, ISO or other texts, or numbers
    unit    of numbers; without one, Unix seconds, ms, µs or ns by their size, times of day where
            they count as hhmmss, else seconds
    form    how a text or a number is written, in strptime's letters, where it is not ISO

    Numbers that would be a thousand rows a second are no seconds: they are days where they are a
    spreadsheet's, MATLAB's or Julian ones of our time.

    A time without a zone is taken as UTC. A time of day without a date counts from 1970-01-01
    and goes on past midnight. Raises ProfileError where a text can be read in two ways or in none.
    """
    dtype = values.dtype
    if isinstance(dtype, pl.Datetime):
        return values.cast(pl.Datetime("ns", dtype.time_zone), strict=False).to_physical()
    if isinstance(dtype, pl.Duration):
        return values.cast(pl.Duration("ns")).to_physical()
    if dtype == pl.Date:
        return values.cast(pl.Datetime("ns"), strict=False).to_physical()
    if dtype == pl.Time:
        return past_midnight(values.to_physical())
    if dtype == pl.String:
        number = number_of(values)
        if form is None and _are_numbers(number, values):
            return _counted(number, unit)
        return _written(values, form)
    if dtype.is_numeric() and form is not None:
        return _written(*_digits(values, form))
    if not dtype.is_numeric():
        raise ProfileError(
            f"The column {values.name!r} holds {dtype}, which is no time.",
            hint='name another column as { channel = "time" } in [table].',
        )
    return _counted(values, unit)


def dates(values: pl.Series, form: str | None = None) -> pl.Series:
    """Midnights [Int64, ns] of a column of dates. Raises ProfileError."""
    if values.dtype == pl.Date or isinstance(values.dtype, pl.Datetime):
        return values.cast(pl.Date).cast(pl.Datetime("ns"), strict=False).to_physical()
    if values.dtype.is_numeric():
        values = values.fill_nan(None).cast(pl.Int64, strict=False).cast(pl.String).str.zfill(6)
    return _best(values, (form,) if form else (*DATE_FORMATS, *SLASHED), pl.Date)


def past_midnight(of_day: pl.Series) -> pl.Series:
    """Times of day [ns] that go on counting past midnight.

    Half a day back is a midnight: a step back by less is a late row, and stays one. Almost a day on
    is a late row from before midnight.
    """
    step = of_day.forward_fill().diff().fill_null(0)
    days = (step < -DAY_NS // 2).cast(pl.Int64) - (step > DAY_NS - LATEST_NS).cast(pl.Int64)
    return of_day + days.cum_sum() * DAY_NS


def number_of(texts: pl.Series) -> pl.Series:
    """Texts as numbers, decimal commas too; null where a text is none."""
    stripped = texts.str.strip_chars()
    number = stripped.cast(pl.Float64, strict=False)
    if number.null_count() == _blank(texts):
        return number
    comma = stripped.str.replace(r"^([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)$", "$1.$2")
    return comma.cast(pl.Float64, strict=False)


def _are_numbers(number: pl.Series, texts: pl.Series) -> bool:
    """Whether most texts are numbers: a line that was cut off, or a word, is not another form."""
    filled = len(texts) - _blank(texts)
    return filled == 0 or 2 * number.count() > filled


def typical(values: pl.Series) -> float:
    """Median size of numbers, 0 where there is none."""
    sizes = values.fill_nan(None).abs().drop_nulls().to_numpy()
    return float(np.median(sizes)) if len(sizes) else 0.0


def _blank(texts: pl.Series) -> int:
    return int((texts.is_null() | (texts.str.strip_chars() == "")).sum())


def of_day(values: pl.Series, unit: str | None = None, form: str | None = None) -> pl.Series:
    """Times as `instants` has them, next to a column of dates: their whole days do not count.

    Raises ProfileError also where numbers are no seconds of a day, or can be two times of it.
    """
    number = number_of(values) if values.dtype == pl.String else values
    words = number is not values and not _are_numbers(number, values)
    stated = unit is not None or form is not None or not number.dtype.is_numeric()
    if stated or words:
        return instants(values, unit, form)
    most = typical(number.cast(pl.Float64))
    if units.unix_unit(most) or counts_minutes(number):
        return instants(values, unit, form)
    digits = can_be_hhmmss(number)
    if digits and most * SECOND_NS >= DAY_NS:
        return _of_digits(number)
    if (digits and most >= 60) or most * SECOND_NS >= 2 * DAY_NS:
        can_be = "can be seconds of it or hhmmss" if digits else "are no seconds of it"
        raise ProfileError(
            f"The times of column {values.name!r}, such as {most:.10g}, are next to a date and "
            f"{can_be}.",
            hint=f'say which in [table]: "{values.name}" = {{ channel = "time", unit = "s" }}, or '
            f'"ms", or format = "{HHMMSS}".',
        )
    return instants(values, unit, form)


def _counted(values: pl.Series, unit: str | None) -> pl.Series:
    """Numbers to ns; whole ones exactly: a float of seconds holds this century to 0.2 µs."""
    if written_times.is_cut(values):
        raise written_times.cut(values.name, values)
    if unit is None and (step := written_times.too_fast(values)) is not None:
        unit = _of_small_steps(values, step)
    if unit == "d":
        return written_times.of_days(values)
    if unit is None:
        exact = values.cast(pl.Float64)
        most, step = typical(exact), typical(exact.diff())
        unit = units.unix_unit(most)
        if unit is None and (step > LONGEST_STEP_S or most * SECOND_NS > units.YEAR_2100_NS):
            raise ProfileError(
                f"The times of column {values.name!r}, such as {most:.15g}, step by {step:g}, and "
                "are no Unix time.",
                hint=f'say their unit in [table]: "{values.name}" = {{ channel = "time", '
                'unit = "us" }, or "ms", or "ns"; or their form, as format = "%Y%m%d%H%M%S".',
            )
        if unit is None and counts_minutes(values):
            return past_midnight(_of_digits(values))
        unit = unit or "s"
    return fields.instants(values, round(units.factor(unit) * SECOND_NS))


def _of_small_steps(values: pl.Series, step: float) -> str | None:
    """The unit of numbers that step by less than seconds do; None for Unix time of any unit."""
    most = typical(values.cast(pl.Float64))
    if written_times.counts_days(most):
        return "d"
    if units.unix_unit(most):
        return None
    raise ProfileError(
        f"The times of column {values.name!r}, such as {most:.10g}, step by {step:.3g}: as seconds "
        f"that would be {1.0 / step:.0f} rows a second.",
        hint=f'say their unit in [table]: "{values.name}" = {{ channel = "time", unit = "d" }} of '
        'days, "h" of hours, "min" of minutes; or "s", if it is as fast as that.',
    )


def can_be_hhmmss(values: pl.Series) -> bool:
    """Whether numbers have the digits of times of day: hours below 24, minutes and seconds below
    60."""
    number = values.cast(pl.Float64).fill_nan(None).drop_nulls()
    sound = (number >= 0) & (number < 240_000) & (number % 100 < 60) & (number % 10_000 < 6_000)
    return len(number) > 0 and bool(sound.all())


def counts_minutes(values: pl.Series) -> bool:
    """Whether numbers count as hhmmss: after 59 comes 100. Seconds from a start of their own have
    the same digits for 60 s at most, or where rows are missing, and step by as much anywhere."""
    if not can_be_hhmmss(values):
        return False
    number = values.cast(pl.Float64).fill_nan(None).drop_nulls()
    step = past_midnight(_of_digits(number)).diff().drop_nulls()
    begins = ((number // 100).diff().drop_nulls() != 0) & (step > 0)
    inside = step.filter(~begins & (step > 0))
    if len(inside) == 0 or not begins.any():
        return False
    on_time = step.filter(begins) <= SAME_STEP * typical(inside.cast(pl.Float64))
    return 2 * int(on_time.sum()) > len(on_time)


def _of_digits(values: pl.Series) -> pl.Series:
    """Times of day [Int64, ns] that are written as hhmmss."""
    number = values.cast(pl.Float64).fill_nan(None)
    whole = number.floor().cast(pl.Int64, strict=False)
    seconds = whole // 10_000 * 3600 + whole // 100 % 100 * 60 + whole % 100
    rest = ((number - number.floor()) * SECOND_NS).round().cast(pl.Int64, strict=False)
    return (seconds * SECOND_NS + rest).rename(values.name)


def _digits(values: pl.Series, form: str) -> tuple[pl.Series, str]:
    """Numbers as the texts that they were, with the zeros at their beginning, and their form."""
    width = sum(WIDTHS.get(part, 2) for part in re.findall(r"%[A-Za-z]", form))
    exact = values.cast(pl.Float64).fill_nan(None)
    text = exact.floor().cast(pl.Int64, strict=False).cast(pl.String).str.zfill(width)
    micros = ((exact - exact.floor()) * 1e6).round().clip(0, 999_999).cast(pl.Int64, strict=False)
    if (micros > 0).any():
        text = text + "." + micros.cast(pl.String).str.zfill(6)
        strptime = written_times.is_strptime(form)
        form = form if form.endswith("%.f") else form + (".%f" if strptime else "%.f")
    return text.rename(values.name), form


def _written(values: pl.Series, form: str | None) -> pl.Series:
    if form and written_times.is_strptime(form):
        apart = written_times.taken_apart(form, values.name)
        read = written_times.parse(values, apart)
        if read.null_count() == len(read) and len(values.drop_nulls()):
            raise _no_form(values)
        return read if apart.dated else past_midnight(read)
    if form:
        whole = any(part in form for part in ("%d", "%j", "%F", "%s", "%D", "%+"))
        return _best(values, (form,), pl.Datetime) if whole else _of_day(values, (form,))
    texts = values.str.strip_chars().str.replace(r"^(\S+) UTC$", "${1}Z")
    texts = texts.str.replace(r"(\d:\d\d),(\d+)", "$1.$2")
    clock = texts.drop_nulls().head(50)
    halves = len(clock) > 0 and bool(clock.str.contains(r"\d" + AM_PM).all())
    if halves:
        texts = texts.str.replace(AM_PM, " ${1}m")
    if len(clock) and clock.str.contains(r"^\d{1,2}:\d\d(:\d\d)?").all():
        return _of_day(texts, HALVES if halves else CLOCK_FORMATS, values)
    texts = texts.str.replace(r"^(.*\S)[T ](\d{1,2}:)", "${1}T$2").str.replace(r" ?UTC$", "Z")
    zoned = texts.drop_nulls().head(50).str.contains(r"T.*(Z|[+-]\d\d:?\d\d)$").all()
    tails = ["T%H:%M:%S%.f" + ("%#z" if zoned else "")]
    if halves:
        tails = ["T" + half for half in HALVES]
    forms = [day + tail for day in (*DATE_FORMATS[:3], *SLASHED) for tail in tails]
    return _best(texts, forms, pl.Datetime, values)


def _of_day(
    texts: pl.Series, forms: tuple[str, ...], written: pl.Series | None = None
) -> pl.Series:
    """Times of day; the day is put before them, since a text without one is no datetime."""
    dated = ("1970-01-01T" + texts).rename(texts.name)
    whole = ["%Y-%m-%dT" + form for form in forms]
    return past_midnight(_best(dated, whole, pl.Datetime, texts if written is None else written))


def _no_form(written: pl.Series) -> ProfileError:
    sample = next((text for text in written.drop_nulls() if text.strip()), "")
    return ProfileError(
        f"The times of column {written.name!r}, such as {sample!r}, are in no known form.",
        hint=f"say the form in [table], as format = '%d.%m.%Y %H:%M:%S'; {written_times.WRITE}.",
    )


def _likely(texts: pl.Series, forms: Iterable[str], kind) -> list[str]:
    """Of a long column, the forms that read some of its rows as well as any does."""
    filled = texts.drop_nulls()
    if len(filled) <= 2 * FORM_ROWS:
        return [*forms]
    some = pl.concat(
        [filled.head(FORM_ROWS // 2), filled.gather_every(2 * len(filled) // FORM_ROWS)]
    )
    reads = {form: len(some) - made.null_count() for form, made in _read(some, forms, kind)}
    best = max(reads.values(), default=0)
    return [form for form, often in reads.items() if 2 * often >= best] if best else [*forms]


def _read(texts: pl.Series, forms: Iterable[str], kind) -> Iterator[tuple[str, pl.Series]]:
    """Each form and what it makes of the texts [ns]."""
    for form in forms:
        try:
            if kind is pl.Date:
                midnight = texts + "T00:00:00"
                yield form, fields.written_as(midnight, form + "T%H:%M:%S")
            else:
                zone = "UTC" if "%#z" in form or "%z" in form or form == "%+" else None
                yield form, fields.written_as(texts, form, zone)
        except pl.exceptions.PolarsError:
            continue  # a form that polars takes for nothing


def _best(texts: pl.Series, forms, kind, written: pl.Series | None = None) -> pl.Series:
    """The texts by the form that reads most of them. Raises ProfileError.

    written  the same as they stand in the table, if they were made alike: what a hint speaks of
    """
    forms = _likely(texts, forms, kind)
    read = [(len(made) - made.null_count(), form, made) for form, made in _read(texts, forms, kind)]
    read.sort(key=lambda item: -item[0])
    quoted = texts if written is None else written
    if not read or read[0][0] == 0:
        raise _no_form(quoted)
    sample = next(iter(quoted.drop_nulls()), "")
    if len(read) > 1 and read[0][0] == read[1][0] and not read[0][2].equals(read[1][2]):
        raise DateOpen(
            f"The times of column {texts.name!r}, such as {sample!r}, can be read with the "
            f"{_leads(read[0][1])} or with the {_leads(read[1][1])} first.",
            hint="say which in [table]: format = "
            f"{_as_written(read[0][1], sample)!r} or {_as_written(read[1][1], sample)!r}.",
            either=read[0][2],
        )
    return read[0][2].rename(texts.name)


def _leads(form: str) -> str:
    return {"d": "day", "m": "month", "b": "month"}.get(form[1:2], "year")


def _as_written(form: str, sample: str) -> str:
    """The form in which a text stands in the table, of the one that all were brought into."""
    form = form if re.search(r"\dT\d", sample) else form.replace("T%", " %")
    fraction = re.search(r"\d([.,])\d+(?=\D*$)", sample)
    form = form.replace("%.f", f"{fraction[1]}%f" if fraction else "")
    if "%p" in form and not re.search(r"\s[apAP]\.?[mM]", sample):
        form = form.replace(" %p", "%p")
    return form.replace("%#z", " UTC" if sample.endswith(" UTC") else "%z")
