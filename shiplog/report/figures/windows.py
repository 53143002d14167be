"""L of every held-out window before and after, along the voyages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import polars as pl

from shiplog.nomenclature.numbers import counted
from shiplog.report import colours
from shiplog.report.figures import style
from shiplog.report.figures.chart import legend
from shiplog.report.figures.content import Content, Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LETTER = 0.022  # of the axis, that a letter of a name takes, with what is left free of it
SLANTED = 0.07  # of the axis, that a slanted name takes
LONGEST = 16  # letters of a name under the axis
MOST_WINDOWS = 300  # that are drawn


def table(content: Content) -> pl.DataFrame:
    """model, voyage, window, time, seconds, loss, place (of the window, from 0 on), without windows
    in which a model diverges."""
    rows = content.data.errors.drop_nulls("loss")
    order = rows.select("voyage", "window").unique(maintain_order=True).with_row_index("place")
    return _few(rows.join(order, on=["voyage", "window"], maintain_order="left"))


def _few(rows: pl.DataFrame) -> pl.DataFrame:
    """Of very many windows, of each few in a row those with the least and the largest L of any
    model, so that no extreme is lost."""
    step = -(-2 * rows["place"].n_unique() // MOST_WINDOWS)
    if step <= 1:
        return rows
    loss = pl.col("loss")
    kept = rows.group_by(pl.col("place") // step).agg(
        pl.col("place").get(loss.arg_min()).alias("least"),
        pl.col("place").get(loss.arg_max()).alias("most"),
    )
    places = {*kept["least"].to_list(), *kept["most"].to_list()}
    return rows.filter(pl.col("place").is_in(list(places)))


def draw(axes: Axes, rows: pl.DataFrame, content: Content) -> None:
    ends = rows.group_by("place", maintain_order=True).agg(
        low=pl.col("loss").min(), high=pl.col("loss").max()
    )
    axes.vlines(
        ends["place"].to_numpy(), ends["low"].to_numpy(), ends["high"].to_numpy(),
        color=colours.web(colours.GRID), linewidth=1.5, zorder=1,
    )  # fmt: skip
    for key, label, colour in legend(content.data):
        own = rows.filter(pl.col("model") == key)
        if len(own):
            axes.plot(own["place"].to_numpy(), own["loss"].to_numpy(), "o", color=colour,
                      markersize=3.5, label=label)  # fmt: skip
    axes.set_yscale("log")
    style.plain_log(axes.yaxis)
    firsts = rows.group_by("voyage", maintain_order=True).agg(pl.col("place").min())
    places, names, flat = ticks(firsts["place"].to_list(), firsts["voyage"].to_list(),
                                int(rows["place"].to_numpy().max()) + 1)  # fmt: skip
    axes.set_xticks(places)
    axes.set_xticklabels(names, rotation=0 if flat else 30, ha="left" if flat else "right",
                         rotation_mode="anchor")  # fmt: skip
    axes.set_xlabel("windows, from the first of each voyage on")
    axes.set_ylabel("L of a window")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)


def ticks(places: list[int], names: list[str], windows: int) -> tuple[list[int], list[str], bool]:
    """Voyages that have their name under the axis, so that none overlaps the next, and whether the
    names lie flat: they do where each ends before the next begins."""
    short = [style.short(name, LONGEST) for name in names]
    flat = all(
        (after - before) / windows > LETTER * len(name)
        for before, after, name in zip(places, places[1:], short, strict=False)
    )
    if flat:
        return places, short, True
    kept: list[int] = []
    for i, place in enumerate(places):
        if not kept or (place - places[kept[-1]]) / windows >= SLANTED:
            kept.append(i)
    return [places[i] for i in kept], [short[i] for i in kept], False


def words(rows: pl.DataFrame, content: Content) -> str:
    if rows.is_empty():
        return "No window was simulated."
    every = content.data.errors.drop_nulls("loss")
    means = dict(every.group_by("model").agg(pl.col("loss").mean()).iter_rows())
    text = ", ".join(
        f"{means[key]:.0f} of {label}" for key, label, _ in legend(content.data) if key in means
    )
    count = every.select("voyage", "window").n_unique()
    return f"L of {counted(count, 'window')}; in the mean {text}."


OF_WINDOWS = Picture("Every window", table, draw, words)
