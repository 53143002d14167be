"""The probability that each named cause acts, along the recorded time of the trial."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from shiplog.report import colours
from shiplog.report.figures import style
from shiplog.report.figures.bars import spoken
from shiplog.report.figures.content import Content, Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HOURS_S = 7200.0  # a trial that is longer has its axis in hours, else in minutes
HALF = 0.5  # probability, from which "from the start" is the likelier answer
TALL = 0.8  # of the row of a cause, from a probability of 0 to 1


def table(content: Content) -> pl.DataFrame:
    """cause, voyage, begin, end [s of recorded time], probability."""
    return content.data.acting


def draw(axes: Axes, rows: pl.DataFrame, content: Content) -> None:
    unit, name = _unit(rows)
    causes = rows["cause"].unique(maintain_order=True).to_list()
    for place, cause in enumerate(causes):
        own = rows.filter(pl.col("cause") == cause)
        edges = np.append(own["begin"].to_numpy(), own["end"].to_numpy()[-1]) / unit
        base = float(place) + 0.5 * TALL
        axes.stairs(
            base - TALL * own["probability"].to_numpy(), edges, baseline=base, fill=True,
            color=colours.web(colours.EXTENDED), alpha=0.75,
        )  # fmt: skip
        axes.axhline(base, color=colours.web(colours.TEXT), linewidth=0.6)
    first = rows.filter(pl.col("cause") == causes[0])
    seams = first.filter(pl.col("voyage") != pl.col("voyage").shift(1))["begin"].to_numpy()
    for at in seams / unit:
        axes.axvline(at, color=colours.web(colours.TEXT), linestyle=":", linewidth=0.8)
    axes.set_yticks(np.arange(len(causes)), [style.short(spoken(c), most=24) for c in causes],
                    fontsize=7.5)  # fmt: skip
    axes.set_ylim(max(len(causes), 1) - 0.4, -0.6)
    axes.set_xlim(0.0, float(rows["end"].to_numpy().max()) / unit)
    axes.set_xlabel(f"recorded time, voyages one after another [{name}]", loc="right")


def words(rows: pl.DataFrame, content: Content) -> str:
    if rows.is_empty():
        return "No named cause has a beginning."
    said = []
    for cause in content.verdict["causes"]:
        if (found := cause.get("onset")) is None:
            continue
        name = spoken(cause["name"])
        if found["from_start"] >= HALF:
            said.append(f"{name} is present from the start ({found['from_start']:.2f})")
        else:
            said.append(
                f"{name} begins between {found['low']:.0f} and {found['high']:.0f} s (90 %)"
            )
    return (
        "Height of each bar: the probability that the cause acts at that time; a dotted line is "
        f"the start of a voyage. {'; '.join(said)}."
    )


def _unit(rows: pl.DataFrame) -> tuple[float, str]:
    longest = float(rows["end"].to_numpy().max())
    return (3600.0, "h") if longest > HOURS_S else (60.0, "min")


OF_ONSET = Picture("Since when", table, draw, words, height=0.85, by_row=0.42, rows_of="cause")
