"""The columns of a table that say when a row was, of which voyage and of which vessel."""

from __future__ import annotations

import re
from pathlib import Path

import polars as pl

from shiplog.drafting import facts, words
from shiplog.drafting.column_names import FoundColumn
from shiplog.exceptions import ProfileError, ShiplogError
from shiplog.logs.conversion import clock, written_times
from shiplog.logs.conversion.columns import busiest, text_of
from shiplog.logs.conversion.delimited import DelimitedTable
from shiplog.nomenclature import units

_CALLED = r"(_?(id|nr|no|num|number|name|code))"
LABEL_COLUMNS = {  # how a label's column is called
    "time": r"t(_(s|sec|ms|us|ns|utc))?|t_\w+_(s|sec|ms|us|ns)|"
            r"time\w*|stamp\w*|utc\w*|(base_?)?date_?time|epoch\w*|"
            r"unix\w*|.*_timestamp|(gps|gnss|log|rec)_?time\w*|elapsed\w*|seconds",
    "date": r"date(_utc)?|day|(gps|gnss|utc)_?date",
    "voyage": rf"(run|voyage|trial|trip){_CALLED}?|test{_CALLED}|sequence",
    "vessel": rf"mmsi|imo{_CALLED}?|(vessel|ship){_CALLED}?|call_?sign",
}  # fmt: skip
TIME_UNITS = {  # how a name's last word says in what it counts time
    "s": "s", "sec": "s", "secs": "s", "second": "s", "seconds": "s", "ms": "ms", "msec": "ms",
    "millis": "ms", "milliseconds": "ms", "us": "us", "usec": "us", "micros": "us",
    "microseconds": "us", "ns": "ns", "nsec": "ns", "nanos": "ns", "nanoseconds": "ns",
    "min": "min", "mins": "min", "minutes": "min", "h": "h", "hours": "h", "d": "d", "days": "d",
}  # fmt: skip
RATES_HZ = (0.02, 100.0)  # how often a ship's motion is recorded
USUAL_HZ = (1.0, 10.0)  # and how often it mostly is
STANDS_STILL = 0.01  # of the rows: a clock that stands still in more is less fit than another
DAY_S, MINUTE = 86_400.0, 100.0  # seconds of a day; of hhmmss, what a minute adds


def found_labels(table: DelimitedTable, path: Path, vessel: str | None) -> list[FoundColumn]:
    """Time, date, voyage and vessel. Raises ProfileError where no vessel is chosen of several."""
    frame = table.frame
    labels: list[FoundColumn] = []
    dated = False
    for channel, pattern in LABEL_COLUMNS.items():
        names = [n for n in frame.columns if re.fullmatch(pattern, words.bare(n))]
        if channel == "time":
            names = [n for n in frame.columns if isinstance(frame[n].dtype, pl.Datetime)] + names
            names = sorted(names, key=lambda n: (not facts.holds("time", frame[n]),
                                                 _repeats(frame[n])))  # fmt: skip
        elif channel == "date":
            names = [] if dated else names
        else:
            names = [n for n in names if _tells_apart(frame[n], table)]
        if not names:
            continue
        values = frame[names[0]]
        if channel == "time":
            beside = any(re.fullmatch(LABEL_COLUMNS["date"], words.bare(n)) for n in frame.columns)
            labels.append(_time(values, table, beside))
            dated = _is_dated(values, labels[-1])
        elif channel == "date":
            labels += _date(values)
        elif channel == "vessel":
            labels.append(_vessel(values, path, vessel))
        else:
            labels.append(FoundColumn(names[0], channel, None))
    return labels


def _repeats(values: pl.Series) -> bool:
    """Whether a clock of numbers stands still from row to row, as one of too few digits does."""
    if not values.dtype.is_numeric() or len(values) < 2:
        return False
    same = (values.cast(pl.Float64).diff().drop_nulls() == 0).mean()
    return isinstance(same, float) and same > STANDS_STILL


def _tells_apart(values: pl.Series, table: DelimitedTable) -> bool:
    """Whether a column names voyages or vessels: some names for many rows, and no measurement."""
    name = values.name
    if words.unit_of(name) or table.units.get(name, "").strip():
        return False
    if values.dtype.is_float() and not bool((values.fill_nan(None).drop_nulls() % 1 == 0).all()):
        return False
    return 1 < values.n_unique() < len(values) / 2


def _vessel(values: pl.Series, path: Path, vessel: str | None) -> FoundColumn:
    ships = text_of(values)
    if vessel is None or vessel not in ships:
        raise ProfileError(
            f"{path.name} holds {ships.n_unique()} vessels in {values.name!r}"
            f"{'' if vessel is None else f', and none is {vessel}'}: {busiest(ships)}.",
            hint="say which with --vessel.",
        )
    return FoundColumn(values.name, "vessel", None, only=vessel)


def _date(values: pl.Series) -> list[FoundColumn]:
    """The date that a time of day belongs to; the 15 of a month is none."""
    try:
        clock.dates(values)
    except ShiplogError as error:
        if words.bare(values.name) == "day":
            return []
        return [FoundColumn(values.name, "date", None, (_asked(error),))]
    return [FoundColumn(values.name, "date", None)]


def _asked(error: ShiplogError) -> str:
    """What a line of a draft says of times that can be read in two ways or in none."""
    return " ".join(f"{error.message} {error.hint or ''}".split()).rstrip(". ")


def _is_dated(values: pl.Series, time: FoundColumn) -> bool:
    """Whether a time says its day itself."""
    try:
        times = clock.instants(values, time.unit)
    except ShiplogError:
        return False
    return clock.typical(times.cast(pl.Float64)) >= units.YEAR_2000_NS


def _time(values: pl.Series, table: DelimitedTable, with_date: bool) -> FoundColumn:
    """The column of times; a unit only where its size does not say it."""
    number = clock.number_of(values) if values.dtype == pl.String else values
    if number.dtype.is_numeric() and number.null_count() <= len(number) / 2:
        return _counted(number, table, with_date)
    try:
        times = clock.instants(values)
    except ShiplogError as error:
        return FoundColumn(values.name, "time", None, (_asked(error),))
    if times.null_count() == len(times):
        return FoundColumn(values.name, "time", None, ("no time was understood",))
    naive = not isinstance(values.dtype, pl.Datetime) or values.dtype.time_zone is None
    text = str(values.drop_nulls().head(1).to_list())
    assumed = (
        values.dtype in (pl.String, pl.Datetime) and naive and not ("Z" in text or "+" in text)
    )
    return FoundColumn(values.name, "time", None, ("taken as UTC",) if assumed else ())


def counted_time(number: pl.Series, table: DelimitedTable) -> FoundColumn:
    """A column of numbers as a time, by its size, its name and its step."""
    return _counted(number, table, False)


def _counted(number: pl.Series, table: DelimitedTable, with_date: bool) -> FoundColumn:
    """Times that are numbers: Unix time by their size, else what their name or their rate says."""
    name, number = number.name, number.cast(pl.Float64).fill_nan(None)
    most, step = clock.typical(number), clock.typical(number.diff())
    stated = _stated_unit(name, table)
    unix = units.unix_unit(most)
    if written_times.is_cut(number):
        return FoundColumn(name, "time", stated, (written_times.cut(name, number).message,))
    if unix:
        same = stated in (None, unix)
        doubt = () if same else (f"called {stated}, and Unix time in {unix} by its size",)
        return FoundColumn(name, "time", stated if same else unix, doubt)
    if _reads_as_clock(number, with_date):
        return FoundColumn(
            name, "time", stated, ("hours, minutes, seconds in one number (hhmmss)?",)
        )
    if stated:
        return FoundColumn(name, "time", stated, _of_rate(step * units.factor(stated)))
    rates = {unit: units.SECOND_NS / ns / step for unit, ns in units.UNIX_NS.items() if step}
    distance = {
        unit: max(USUAL_HZ[0] / rate, rate / USUAL_HZ[1], 1.0)
        for unit, rate in rates.items()
        if RATES_HZ[0] <= rate <= RATES_HZ[1]
    }
    unit = min(distance, key=lambda u: distance[u], default="s")
    if unit != "s":
        return FoundColumn(name, "time", unit, ("of the step between rows",))
    if len(distance) > 1:
        return FoundColumn(name, "time", None, ("seconds, of the step between rows",))
    if written_times.too_fast(number) is not None:
        days = written_times.counts_days(most)
        doubt = f"{days[0]} numbers of days" if days else "days? Hours? Not seconds, by its steps"
        return FoundColumn(name, "time", "d", (doubt,))
    return FoundColumn(name, "time", None, _of_rate(step))


def _of_rate(step_s: float) -> tuple[str, ...]:
    """What to check of a time step that no log of a ship's motion has."""
    if step_s <= 0 or RATES_HZ[0] <= 1.0 / step_s <= RATES_HZ[1]:
        return ()
    return (f"its unit: {step_s:.3g} s from row to row",)


def _stated_unit(name: str, table: DelimitedTable) -> str | None:
    """The unit of time that a name or the row of units says: `time_ms`, `TimeUS`, `t [min]`."""
    bracket = re.search(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$", name)
    written = [bracket[1]] if bracket else []
    written.append(table.units.get(name, ""))
    plain = re.split(r"[^a-z]+", words.parted(name[: bracket.start()] if bracket else name))
    for text in (*written, plain[-1] if len(plain) > 1 else ""):
        unit = TIME_UNITS.get(text.strip().lower()) or words.fitting(words.spelled(text), ("time",))
        if unit:
            return unit
    return "s" if plain == ["seconds"] else None


def _reads_as_clock(number: pl.Series, with_date: bool) -> bool:
    """Whether numbers are, or may be, times of day as 123450 for 12:34:50."""
    if clock.counts_minutes(number):
        return True
    high = float(number.fill_null(0.0).to_numpy().max(initial=0.0))
    return clock.can_be_hhmmss(number) and (high > DAY_S or (with_date and high >= MINUTE))
