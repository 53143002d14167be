"""One number of a cause in several results, each with its 90 % interval."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from shiplog.nomenclature.numbers import figure as digits
from shiplog.report import colours
from shiplog.report.figures import style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCHEMA = {
    "result": pl.String, "cause": pl.String, "parameter": pl.String, "unit": pl.String,
    "value": pl.Float64, "low": pl.Float64, "high": pl.Float64,
}  # fmt: skip


def by_parameter(table: pl.DataFrame) -> Iterator[tuple[str, pl.DataFrame]]:
    """Title and rows of each number."""
    for (cause, name), own in table.group_by("cause", "parameter", maintain_order=True):
        yield f"{cause}, {str(name).replace('_', ' ')}", own


def figure(rows: pl.DataFrame) -> Figure:
    """A dot and its interval for each result."""
    with style.drawing(height=0.9 + 0.28 * len(rows)) as made:
        axes = made.add_subplot()
        value, low, high = (rows[k].to_numpy() for k in ("value", "low", "high"))
        place = np.arange(len(rows))
        ink = colours.web(colours.MEASURED)
        axes.hlines(place, low, high, color=ink, linewidth=2.0)
        axes.plot(value, place, "o", color=ink, markersize=5.0)
        axes.set_yticks(place, rows["result"].to_list())
        axes.set_ylim(len(rows) - 0.5, -0.5)
        unit = str(rows["unit"][0])
        axes.set_xlabel(f"{rows['parameter'][0]} [{unit}]".replace("_", " "))
        if low.min() <= 0.0 <= high.max():
            axes.axvline(0.0, color=colours.web(colours.ZERO), linewidth=1.0)
    return made


def words(rows: pl.DataFrame) -> str:
    said = [
        f"{r['result']} {digits(r['value'], 3)} ({digits(r['low'], 3)} to {digits(r['high'], 3)}) "
        f"{r['unit']}"
        for r in rows.to_dicts()
    ]
    return "; ".join(said) + "."


def _meet(a: tuple[float, float], b: tuple[float, float], turn: float) -> bool:
    """Whether two intervals have a value in common; of directions, with whole turns between."""
    return any(a[0] <= b[1] + k * turn and b[0] + k * turn <= a[1] for k in (-1, 0, 1))


def verdict(rows: pl.DataFrame, names: Sequence[str]) -> str:
    """In words whether a number changed: where two 90 % intervals have no value in common."""
    if len(rows) < len(names):
        return "named in some only"
    turn = 360.0 if rows["unit"][0] == "deg" and rows["parameter"][0] == "direction" else 0.0
    spans = rows.select("low", "high").rows()
    apart = any(not _meet(a, b, turn) for a, b in combinations(spans, 2))
    return "yes: the intervals are apart" if apart else "no: the intervals meet"
