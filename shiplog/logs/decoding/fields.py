"""Field paths (`position_covariance[0]`, `value.lon` inside JSON text) and time stamps."""

from __future__ import annotations

import re
from collections.abc import Mapping

import polars as pl

from shiplog.nomenclature import units
from shiplog.nomenclature.units import SECOND_NS, UNIX_NS

STAMP_FIELDS = (
    "timestamp", "stamp", "header.stamp", "header.timestamp",
    "transforms[0].timestamp", "transforms[0].header.stamp",
)  # fmt: skip
STAMP_PARTS = (("seconds", "nanos"), ("sec", "nanosec"), ("sec", "nsec"), ("secs", "nsecs"))
# Numbers that look like Unix time and are not: they gain as much as the recorder's clock does in
# another unit, to a factor of two for a log that is played faster or slower, and would be of
# messages further apart than any instrument's. The latter keeps a log whose recorder wrote all at
# once, a thousand times as fast.
SAME_PACE, LONGEST_PERIOD_NS = 2.0, 5.0 * SECOND_NS
LOW, HIGH = 0.05, 0.95  # quantiles: a few stray times do not make a pace
MOST_NS = 9.2e18  # what 64 bits hold

Steps = tuple[str | int, ...]


def steps(path: str) -> Steps:
    """`a.b[0].c` as ("a", "b", 0, "c")."""
    found = re.findall(r"\[(\d+)\]|([^.\[\]]+)", path)
    return tuple(int(index) if index else name for index, name in found)


def locate(path: str, layout: Mapping[str, pl.DataType]) -> tuple[str, Steps] | None:
    """The leaf that holds `path`, and the steps left to take inside its values."""
    if path in layout:
        return path, ()
    way = steps(path)
    for cut in range(len(way), 0, -1):
        if any(isinstance(step, int) for step in way[:cut]):
            continue
        leaf = ".".join(map(str, way[:cut]))
        if leaf in layout and _leads_on(layout[leaf], way[cut:]):
            return leaf, way[cut:]
    return None


def _leads_on(dtype: pl.DataType, rest: Steps) -> bool:
    for step in rest:
        if isinstance(dtype, (pl.String, pl.Binary)):
            return True  # JSON inside: only its values can say
        if isinstance(step, int) and isinstance(dtype, (pl.List, pl.Array)):
            dtype = _made(dtype.inner)
        elif isinstance(step, str) and isinstance(dtype, pl.Struct):
            inner = {field.name: _made(field.dtype) for field in dtype.fields}
            if step not in inner:
                return False
            dtype = inner[step]
        else:
            return False
    return True


def _made(dtype) -> pl.DataType:
    return dtype() if isinstance(dtype, type) else dtype


def value(leaf: str, rest: Steps, dtype: pl.DataType) -> pl.Expr:
    """The column at the end of `rest`; text taken out of JSON stays text until `parsed`."""
    column = pl.col(leaf)
    for taken, step in enumerate(rest):
        if isinstance(dtype, (pl.String, pl.Binary)):
            inside = "".join(f"[{s}]" if isinstance(s, int) else f".{s}" for s in rest[taken:])
            return column.cast(pl.String, strict=False).str.json_path_match(f"${inside}")
        if isinstance(step, int):
            column = column.list.get(step, null_on_oob=True)
            dtype = _made(dtype.inner) if isinstance(dtype, pl.List) else dtype
        else:
            column = column.struct.field(step)
            named = {f.name: f.dtype for f in dtype.fields} if isinstance(dtype, pl.Struct) else {}
            dtype = _made(named.get(step, pl.Null))
    return column


def is_text(leaf: str, rest: Steps, layout: Mapping[str, pl.DataType]) -> bool:
    """Whether `value` reaches into JSON, so that its column needs `parsed`."""
    dtype = layout[leaf]
    for step in rest:
        if isinstance(dtype, (pl.String, pl.Binary)):
            return True
        if isinstance(dtype, pl.List):
            dtype = _made(dtype.inner)
        elif isinstance(dtype, pl.Struct):
            dtype = _made({f.name: f.dtype for f in dtype.fields}[str(step)])
    return False


def parsed(column: pl.Series) -> pl.Series:
    """Texts out of JSON as the numbers or truths they all are, else as texts."""
    present = column.drop_nulls()
    if present.is_empty():
        return column
    if present.is_in(["true", "false"]).all():
        return (column == "true").rename(column.name)
    number = column.cast(pl.Float64, strict=False)
    return number if number.null_count() == column.null_count() else column


def is_number(dtype: pl.DataType) -> bool:
    """Whether a field may hold numbers, as such, as truths or as texts; a list holds several."""
    return not (dtype.is_nested() or dtype == pl.Binary)


def stamp_leaves(layout: Mapping[str, pl.DataType]) -> tuple[str, ...]:
    """The paths a message's own measurement time is made of: (seconds, nanos), (one value,), ()."""
    for base in STAMP_FIELDS:
        for pair in STAMP_PARTS:
            if all((at := locate(f"{base}.{part}", layout)) and not is_text(*at, layout)
                   for part in pair):  # fmt: skip
                return f"{base}.{pair[0]}", f"{base}.{pair[1]}"
        at = locate(base, layout)
        if at and not at[1] and (layout[base].is_numeric() or layout[base] == pl.String):
            return (base,)
    return ()


def stamps(frame: pl.DataFrame, paths: tuple[str, ...]) -> pl.Series:
    """Measurement times in ns [Int64], null where a message has none, or has it as one number:
    see `counted`."""
    nothing = pl.Series("stamp", [None] * frame.height, pl.Int64)
    columns = []
    for path in paths:
        at = locate(path, frame.schema)
        if at is None:
            return nothing
        columns.append(frame.select(value(*at, frame.schema[at[0]]).alias("stamp")).to_series())
    if len(columns) == 2:
        seconds, nanos = (c.cast(pl.Int64, strict=False) for c in columns)
        beyond = seconds.abs() > 9_000_000_000  # would overflow; no clock says so
        return (seconds.set(beyond, None) * SECOND_NS + nanos).rename("stamp")
    return _written(columns[0]) if columns and columns[0].dtype == pl.String else nothing


def _written(column: pl.Series) -> pl.Series:
    when = written_as(column, "%+", "UTC")
    local = written_as(column, "%Y-%m-%dT%H:%M:%S%.f")  # without a zone: taken as UTC
    return when.fill_null(local)


def written_as(texts: pl.Series, form: str, zone: str | None = None) -> pl.Series:
    """Texts in one form as ns [Int64]; null where they are in another, or beyond the years that 64
    bits hold, 1677 to 2262: polars makes a date of another century of those. Raises PolarsError."""
    in_ns, in_us = (
        texts.str.to_datetime(form, strict=False, time_unit=unit, time_zone=zone)
        for unit in ("ns", "us")
    )
    beyond = in_us.cast(pl.Datetime("ns", zone), strict=False).is_null()
    return in_ns.to_physical().set(beyond, None)


def counted(frame: pl.DataFrame, paths: tuple[str, ...]) -> pl.Series | None:
    """Measurement times that are single numbers; all messages of a topic say in which unit."""
    column = frame[paths[0]] if len(paths) == 1 and paths[0] in frame.columns else None
    return column.alias("stamp") if column is not None and column.dtype.is_numeric() else None


def unix_unit(counts: pl.Series, logged: pl.Series) -> int | None:
    """The unit [ns] in which numbers [Float64] are Unix time; None where they are not.

    A counter, or a time since start-up, is no clock to compare with others. It may look like one:
    30 minutes in µs are seconds of 2027. What it gains shows that, by the recorder's clock [ns].
    """
    known, logged = counts.drop_nulls(), logged.filter(counts.is_not_null())
    middle = known.quantile(0.5, "nearest") or 0.0
    unit = UNIX_NS.get(units.unix_unit(middle) or "")
    gained, passed = _span(known), _span(logged)
    if unit is None or gained * unit <= LONGEST_PERIOD_NS * (HIGH - LOW) * len(known):
        return unit
    others = (n for n in UNIX_NS.values() if n != unit)
    counting = any(passed / SAME_PACE <= gained * n <= passed * SAME_PACE for n in others)
    return None if counting else unit


def _span(values: pl.Series) -> float:
    low, high = (values.quantile(share, "nearest") for share in (LOW, HIGH))
    return 0.0 if low is None or high is None else float(high - low)


def instants(counts: pl.Series, unit: int) -> pl.Series:
    """Numbers that count units of so many ns as ns [Int64]; null where 64 bits do not hold them."""
    beyond = ~(counts.cast(pl.Float64).abs() * unit <= MOST_NS)
    if counts.dtype.is_integer():
        return counts.set(beyond, None).cast(pl.Int64, strict=False) * unit
    exact = counts.cast(pl.Float64).set(beyond, None)
    whole = exact.floor()
    rest = ((exact - whole) * unit).round().cast(pl.Int64, strict=False)
    return whole.cast(pl.Int64, strict=False) * unit + rest
