"""10 Hz to 1 Hz in polars: averages centred on their stamp, circular where angles are averaged.

Nothing is repaired: rows with an unusable mark stay out of the averages, a second with too few
rows is missing, and a missing second starts a new segment that no window crosses.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import timedelta
from pathlib import Path

import polars as pl

from shiplog.nomenclature.channels import UNUSABLE, WINDOW, Quality
from shiplog.nomenclature.units import SECOND_NS

ONE_SECOND = pl.duration(seconds=1)
ONE_DAY = timedelta(days=1)
LEAST_SAMPLES = 5  # of ten: fewer is not an average over the second
COMPARED = ("surge", "sway", "heading", "yaw_rate")  # to see whether two voyages are the same data


def mean_angle(name: str) -> pl.Expr:
    """Circular mean in (-π, π]: 359° and 1° average to 0°, not to 180°."""
    angle = pl.col(name)
    return pl.arctan2(angle.sin().mean(), angle.cos().mean()).alias(name)


def averages(
    table: pl.LazyFrame,
    columns: Sequence[str],
    circular: Iterable[str],
    least: int = LEAST_SAMPLES,
) -> pl.DataFrame:
    """10 Hz rows of one voyage to 1 Hz rows (Sec. 4.1 of the paper), by time.

    table: voyage, time, `columns` (SI), quality. Bins run from half a second before their stamp
    to half a second after. The rows of a bin are added in the order of time, whatever the number
    of threads: `group_by` adds parts in the order in which its threads end, and coefficients
    fitted to such means differ in the eighth digit.
    """
    circular = set(circular)
    means = [mean_angle(c) if c in circular else pl.col(c).mean() for c in columns]
    good = pl.col("quality") & int(UNUSABLE) == 0
    jump = pl.col("quality") & int(Quality.JUMP) != 0
    shifted = pl.col("time").dt.offset_by("500ms")
    rows = table.filter(good | jump).with_columns(time=shifted).collect().rechunk()
    unseen = rows.filter(~good)["time"].dt.truncate("1s").unique()  # where the jump's row is bad
    if len(unseen):
        rows = rows.filter(good)
    if not rows["time"].is_sorted():
        rows = rows.sort("time", maintain_order=True)
    return (
        rows.set_sorted("time")
        .group_by_dynamic("time", every="1s")
        .agg(
            pl.col("voyage").first(),
            *means,
            samples=pl.len(),
            jump=jump.any(),
        )
        .filter((pl.col("samples") >= least) & ~pl.col("jump"))
        .filter(~pl.col("time").is_in(unseen.implode()))
        .select("voyage", pl.exclude("voyage", "jump"))
    )


def resample(
    tables: Iterable[pl.LazyFrame],
    columns: Sequence[str],
    circular: Iterable[str],
    least: int = LEAST_SAMPLES,
) -> pl.DataFrame:
    """The 1 Hz table of some voyages: voyage, time, `columns`, samples, elapsed, segment; sorted.

    tables: 10 Hz rows, one lazy table a voyage. `segment` counts from 0 in each voyage; within
    one, the stamps are exactly 1 s apart. `elapsed` counts whole seconds from the voyage's first
    row, usable or not, as the findings of its log and its parts do; 0 is also what the first
    average has that is centred up to 0.1 s before that row.
    """
    circular = frozenset(circular)
    return segments(pl.concat(_by_day(tables, columns, circular, least)))


def sink_averages(
    tables: Iterable[pl.LazyFrame], columns: Sequence[str], circular: Iterable[str], folder: Path
) -> None:
    """The same averages to Parquet, a file a day and voyage, for tables larger than memory."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, day in enumerate(_by_day(tables, columns, frozenset(circular), LEAST_SAMPLES)):
        day.write_parquet(folder / f"{number:06d}.parquet")


def _by_day(
    tables: Iterable[pl.LazyFrame], columns: Sequence[str], circular: Iterable[str], least: int
) -> Iterator[pl.DataFrame]:
    """The averages of each voyage, a table a day, with `elapsed`."""
    for table in tables:
        begin = table.select(pl.col("time").min()).collect()["time"].to_physical().item()
        since = (pl.col("time").cast(pl.Int64) - begin).clip(lower_bound=0)
        elapsed = (since // SECOND_NS).cast(pl.Float64)
        for day in days(table):
            yield averages(day, columns, circular, least).with_columns(elapsed=elapsed)


def days(table: pl.LazyFrame) -> Iterator[pl.LazyFrame]:
    """One voyage's rows in pieces of at most a day, cut where bins are.

    A day of rows is some 100 MB, whatever the voyage's length.
    """
    first, last = (
        table.select(pl.col("time").min().alias("first"), pl.col("time").max().alias("last"))
        .collect()
        .row(0)
    )
    if first is None or last - first <= ONE_DAY:
        yield table
        return
    edge = first.replace(microsecond=0) - timedelta(milliseconds=500)
    while edge <= last:
        yield table.filter((pl.col("time") >= edge) & (pl.col("time") < edge + ONE_DAY))
        edge += ONE_DAY


def segments(seconds: pl.DataFrame) -> pl.DataFrame:
    """Sort 1 Hz rows and number the stretches without a missing second."""
    return seconds.sort("voyage", "time").with_columns(
        segment=(pl.col("time").diff() != ONE_SECOND).fill_null(False).cum_sum().over("voyage")
    )


def usable(seconds: pl.DataFrame) -> tuple[int, int]:
    """Of a 1 Hz table, how many seconds it has and how many windows of `WINDOW` fit into them."""
    lengths = seconds.group_by("voyage", "segment").len()["len"]
    return seconds.height, int((lengths // WINDOW).sum())


def twins(seconds: pl.DataFrame) -> dict[str, str]:
    """Voyage → the first of those that hold the same data under other names.

    Two that share nothing are one where both share rows with a third.
    """
    first: dict[str, str] = {}
    pairs: list[tuple[str, str]] = shared_rows(seconds).select("left", "right").rows()
    for left, right in pairs:
        both = first.get(left, left), first.get(right, right)
        root = min(both)
        first = {name: root if of in both else of for name, of in first.items()}
        first |= {name: root for name in (left, right, *both)}
    return {name: root for name, root in first.items() if name != root}


def shared_rows(seconds: pl.DataFrame, least: int = 10) -> pl.DataFrame:
    """Pairs of voyages with identical rows: left, right, rows. The same data under two names.

    Two recordings never agree in all of surge, sway, heading and yaw rate to the last digit. Of a
    row that a voyage has many times, as a simulated one on a straight course, as many are shared
    as the other has.
    """
    key = pl.struct(*COMPARED).hash(seed=1)
    keys = (
        seconds.filter((pl.col("surge") != 0) | (pl.col("sway") != 0) | (pl.col("yaw_rate") != 0))
        .group_by("voyage", key=key)
        .agg(times=pl.len())
    )
    pairs = keys.join(keys, on="key", suffix="_other").filter(
        pl.col("voyage") < pl.col("voyage_other")
    )
    return (
        pairs.group_by(left="voyage", right="voyage_other")
        .agg(rows=pl.min_horizontal("times", "times_other").sum())
        .filter(pl.col("rows") >= least)
        .sort("left", "right")
    )
