"""The voyages on their time, with the stretches that a verdict marks."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from shiplog.nomenclature.numbers import counted
from shiplog.report import colours
from shiplog.report.figures import style
from shiplog.report.figures.content import Content, Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

KINDS = {  # of an interval → its words and colour
    "external": ("pushed, held or towed", colours.BANK),
    "coverage": ("outside the training data", colours.ORANGE),
    "active": ("unrecorded thruster at work", colours.EXTENDED),
}
OTHERS = (colours.BLUE, colours.GREEN, colours.PURPLE, colours.TEXT, colours.SKY)  # of other kinds
MOST_KINDS = 8  # in a legend
LONGEST = 24  # letters of a name at the axis: more would leave no room for the voyages
SHORTEST = 0.005  # of the axis, that a stretch is drawn with: a shorter one could not be seen
WHOLE = 0.95  # of a voyage: a finding of as much is one of the whole voyage
short = partial(style.short, most=LONGEST)
SCHEMA = {
    "voyage": pl.String, "kind": pl.String, "start_s": pl.Float64, "end_s": pl.Float64,
}  # fmt: skip


def table(content: Content) -> pl.DataFrame:
    """voyage, kind (`sailed` or that of an interval), start_s, end_s; without intervals that are
    the whole voyage."""
    rows = [(v, "sailed", 0.0, s) for v, s in
            content.data.voyages.select("voyage", "seconds").iter_rows()]  # fmt: skip
    rows += [
        (one["voyage"], one["kind"], float(one["start_s"]), float(one["end_s"]))
        for one in content.verdict["intervals"]
    ]
    rows += [
        (one["voyage"], "active", float(one["start_s"]), float(one["end_s"]))
        for cause in content.verdict["causes"]
        for one in cause.get("times") or ()
    ]
    found = pl.DataFrame(rows, SCHEMA, orient="row")
    whole = pl.col("end_s").filter(pl.col("kind") == "sailed").max().over("voyage")
    inside = pl.col("end_s") - pl.col("start_s") < WHOLE * whole
    return found.filter(inside | (pl.col("kind") == "sailed"))


def draw(axes: Axes, rows: pl.DataFrame, content: Content) -> None:
    names = rows["voyage"].unique(maintain_order=True).to_list()
    place = {name: i for i, name in enumerate(names)}
    seen: set[str] = set()
    kinds = [k for k in rows["kind"].unique(maintain_order=True) if k not in ("sailed", *KINDS)]
    others = {k: (k, OTHERS[i % len(OTHERS)]) for i, k in enumerate(kinds)}
    least = SHORTEST * float(rows["end_s"].to_numpy().max())
    for voyage, kind, start, end in rows.iter_rows():
        if kind == "sailed":
            axes.barh(place[voyage], end, height=0.28, color=colours.web(colours.GRID))
            continue
        label, colour = (KINDS | others)[kind]
        axes.barh(
            place[voyage], max(end - start, least), left=start, height=0.5,
            color=colours.web(colour),
            label=None if kind in seen or len(seen) >= MOST_KINDS else label,
        )  # fmt: skip
        seen.add(kind)
    axes.set_yticks(np.arange(len(names)), [short(name) for name in names], fontsize=7.0)
    axes.set_ylim(max(len(names), 2) - 0.4, -0.6)
    axes.set_xlabel("time since the start of the voyage [s]", loc="right")
    if seen:
        axes.legend(loc="lower center", bbox_to_anchor=(0.45, 1.0), ncols=3, columnspacing=1.0,
                    handlelength=1.0)  # fmt: skip


def words(rows: pl.DataFrame, content: Content) -> str:
    marked = rows.filter(pl.col("kind") != "sailed")
    if marked.is_empty():
        return "No stretch of these voyages is marked."
    kinds = marked["kind"].value_counts(sort=True)
    text = ", ".join(
        f"{KINDS.get(k, (k,))[0]} {n} {'time' if n == 1 else 'times'}" for k, n in kinds.iter_rows()
    )
    return f"Stretches of {counted(rows['voyage'].n_unique(), 'voyage')}: {text}."


OF_STRETCHES = Picture("Stretches", table, draw, words, height=1.1, by_row=0.22, rows_of="voyage")
