"""How far the simulation is off as a window goes on: median and 90 % of the held-out windows, and
the 90 % band that the model itself states."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from shiplog.nomenclature.numbers import figure
from shiplog.report import colours
from shiplog.report.figures.chart import legend
from shiplog.report.figures.content import Content, Picture
from shiplog.report.figures.picture_data import BEFORE, MEASURED

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEVELS = (0.05, 0.5, 0.95)  # of the windows: a band of 90 %, and its median
MOST_MEDIANS = 10.0  # that the axis goes up to
LEAST_WINDOWS = 3  # fewer have no band
POSITION, HEADING = "position", "heading"
TURN = 2.0 * np.pi
SCHEMA = {
    "model": pl.String, "elapsed": pl.Float64, "low": pl.Float64, "median": pl.Float64,
    "high": pl.Float64, "windows": pl.Int64,
}  # fmt: skip


def table(content: Content, of: str) -> pl.DataFrame:
    """model, elapsed [s since the window's start], low, median, high of the absolute error [m, deg]
    over windows, and their number."""
    tracks = content.data.tracks
    keys = ["voyage", "window", "time"]
    states = tracks.filter(pl.col("model") == MEASURED).select(
        *keys, *(pl.col(k).alias(f"{k}_measured") for k in ("x0", "y0", "heading"))
    )
    both = tracks.filter(pl.col("model") != MEASURED).join(states, on=keys)
    if both.is_empty():
        return pl.DataFrame(schema=SCHEMA)
    if of == POSITION:
        error = (
            (pl.col("x0") - pl.col("x0_measured")) ** 2
            + (pl.col("y0") - pl.col("y0_measured")) ** 2
        ).sqrt()
    else:
        turned = pl.col("heading") - pl.col("heading_measured")
        error = (turned - TURN * (turned / TURN).round()).abs().degrees()
    elapsed = (pl.col("time") - pl.col("time").min().over("voyage", "window")).round(1)
    found = (
        both.with_columns(elapsed=elapsed, error=error.fill_nan(None))
        .drop_nulls("error")
        .group_by("model", "elapsed")
        .agg(
            *(
                pl.col("error").quantile(q, "linear").alias(name)
                for q, name in zip(LEVELS, ("low", "median", "high"), strict=True)
            ),
            windows=pl.len(),
        )
        .sort("model", "elapsed", descending=[True, False])
    )
    return found.select(pl.col(k).cast(v) for k, v in SCHEMA.items())


def draw(axes: Axes, rows: pl.DataFrame, content: Content, of: str) -> None:
    data = content.data
    if len(data.band) and data.band[of].is_finite().any():
        elapsed, half = data.band["elapsed"].to_numpy(), data.band[of].to_numpy()
        half = np.degrees(half) if of == HEADING else half
        axes.fill_between(elapsed, half, color=colours.web(colours.GRID), linewidth=0, zorder=0,
                          label=_band_label(content))  # fmt: skip
    for key, label, colour in legend(data):
        own = rows.filter(pl.col("model") == key)
        if key == MEASURED or own.is_empty():
            continue
        elapsed, low, median, high = (
            own[k].to_numpy() for k in ("elapsed", "low", "median", "high")
        )
        if own["windows"].to_numpy().max() >= LEAST_WINDOWS:
            axes.fill_between(elapsed, low, high, color=colour, alpha=0.18, linewidth=0)
        axes.plot(elapsed, median, color=colour, linewidth=1.8, label=label)
    axes.set_xlabel("time since the start of the window [s]")
    axes.set_xlim(left=0.0)
    top = _top(rows)
    axes.set_ylim(0.0, min(top, 180.0) if of == HEADING else top)
    axes.set_ylabel("position error [m]" if of == POSITION else "heading error [deg]")
    if of == POSITION:
        lengths = axes.secondary_yaxis(
            "right",
            functions=(lambda m: np.divide(m, data.length), lambda n: np.multiply(n, data.length)),
        )
        lengths.set_ylabel("ship lengths")
    axes.legend(loc="upper left")


def _band_label(content: Content) -> str:
    """Of several runs the band is that of the first."""
    models = content.data.models
    if len(models) < 2 or BEFORE in models:
        return "90 % band of the model itself"
    return f"90 % band that {next(iter(models.values()))} states"


def _top(rows: pl.DataFrame) -> float:
    """All of the 90 % of the windows; a model that diverges does not flatten the others: up to ten
    times the largest median."""
    highest, median = rows["high"].max(), rows["median"].max()
    assert isinstance(highest, float) and isinstance(median, float)
    return max(1.25 * min(highest, MOST_MEDIANS * median), 1e-3)


def words(rows: pl.DataFrame, content: Content, of: str) -> str:
    if rows.is_empty():
        return "No window was simulated."
    unit = "m" if of == POSITION else "deg"
    found = []
    for key in content.data.models:
        last = rows.filter(pl.col("model") == key).tail(1)
        if len(last):
            found.append(
                f"after {last['elapsed'][0]:.0f} s {content.data.models.get(key, key)} is "
                f"{figure(last['median'][0])} {unit} off ({figure(last['low'][0])} to "
                f"{figure(last['high'][0])})"
            )
    text = "; ".join(found)
    return (
        f"{of.capitalize()} error of held-out windows: the line is their median, and nine in ten "
        f"of them are in the band around it. {text[:1].upper()}{text[1:]}."
    )


def _picture(of: str, title: str) -> Picture:
    return Picture(title, partial(table, of=of), partial(draw, of=of), partial(words, of=of))


OF_POSITION = _picture(POSITION, "Position error as a window goes on")
OF_HEADING = _picture(HEADING, "Heading error as a window goes on")
