"""Force components: what each part of the first physical model exerts on the ship,
along the measured voyage."""

from __future__ import annotations

import numpy as np
import polars as pl
import rerun as rr
import rerun.blueprint as rrb

from shiplog.report import colours
from shiplog.report.viewer import display, style, timeline
from shiplog.report.viewer.display import Drawn
from shiplog.report.viewer.style import entity

FORCE_AXES = {  # what a plot shows: its name, its unit, where positive points
    "surge": ("surge force", "N", "ahead"),
    "sway": ("sway force", "N", "to starboard"),
    "yaw": ("yaw moment", "N m", "bow to starboard"),
}
SPIKES = 0.5  # % of a part's rows at either end that need not fit on the axis
PREFIXES = ((1e7, "M", 1e6), (1e4, "k", 1e3), (0.0, "", 1.0))  # from which force on, name, factor


def blueprint(drawn: Drawn, voyage: str | None) -> rrb.Container | None:
    """A tab of its own, in it a tab a voyage: three plots over the whole voyage."""
    if voyage is not None:
        return None
    rows = of_first_model(drawn)
    known = rows["voyage"].unique().to_list()
    tabs = [
        _plots(drawn, voyage, rows, rows.filter(pl.col("voyage") == voyage))
        for voyage in [v for v in drawn.voyages if v in known][: display.MOST_TABS]
    ]
    if not tabs:
        return None
    return rrb.Tabs(*tabs, active_tab=0, name=f"Forces, {rows['model'][0]}")


def send(recording: rr.RecordingStream, drawn: Drawn) -> None:
    """One line per part, of one colour in every plot of every voyage."""
    rows = of_first_model(drawn)
    of = colours.forces(rows["part"].unique(maintain_order=True).to_list())
    for voyage in rows["voyage"].unique(maintain_order=True):
        _send_zero(recording, voyage, rows.filter(pl.col("voyage") == voyage))
    factors = {axis: unit(rows, axis)[1] for axis in FORCE_AXES}
    for (voyage, part), lines in rows.group_by("voyage", "part", maintain_order=True):
        whole = part == "total"  # behind, and wide: visible under a part that acts alone
        for axis, factor in factors.items():
            timeline.send_lines(
                recording,
                # drawn in order of names: the sum before its terms
                entity("force", voyage, axis, "sum" if whole else "terms", part),
                display.column(lines, "time"),
                display.column(lines, axis)[:, None] / factor,
                display.pieces(lines),
                [f"{part} (black)" if whole else part],
                of[part],
                2.5 if whole else 1.5,
            )


def of_first_model(drawn: Drawn) -> pl.DataFrame:
    """The forces of the first model that has any; no rows where none has."""
    if drawn.forces is None:
        return pl.DataFrame(schema=dict.fromkeys(("model", "voyage", "part"), pl.String))
    having = drawn.forces["model"].unique(maintain_order=True).to_list()
    first = next((model for model in (*drawn.models, *having) if model in having), "")
    return drawn.forces.filter(pl.col("model") == first)


def unit(rows: pl.DataFrame, axis: str) -> tuple[str, float]:
    """Newtons, or thousands or millions of them: one for all voyages, which then compare."""
    most = max(abs(end) for end in _reach(rows, axis))
    prefix, factor = next((name, factor) for least, name, factor in PREFIXES if most >= least)
    return prefix + FORCE_AXES[axis][1], factor


def readable_range(rows: pl.DataFrame, axis: str, factor: float = 1.0) -> tuple[float, float]:
    """An axis that shows zero and what every part does, but for its spikes."""
    low, high = (end / factor for end in _reach(rows, axis))
    low, high = timeline.with_two_labels(low, max(high, low + 1e-3))
    margin = 0.08 * (high - low)
    return low - margin, high + margin


def _plots(drawn: Drawn, voyage: str, all_rows: pl.DataFrame, rows: pl.DataFrame) -> rrb.Container:
    measured = drawn.measured.filter(pl.col("voyage") == voyage)
    plots = []
    for axis, (what, _, positive) in FORCE_AXES.items():
        name, factor = unit(all_rows, axis)
        plots.append(
            rrb.TimeSeriesView(
                origin=entity("force", voyage, axis),
                name=f"{what} [{name}], positive {positive}",
                axis_x=timeline.whole_voyage(measured, after=0.07),
                axis_y=rrb.ScalarAxis(range=readable_range(rows, axis, factor)),
                plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=axis == "surge"),
                background=style.plot_background(),
            )
        )
    return rrb.Vertical(*plots, name=voyage)


def _send_zero(recording: rr.RecordingStream, voyage: str, rows: pl.DataFrame) -> None:
    """A line at zero, behind all: Rerun's own grid is black, and heavier than what is drawn."""
    ends = display.column(rows, "time")[[0, -1]]
    for axis in FORCE_AXES:
        path = entity("force", voyage, axis, "nothing")
        none = np.empty(0, dtype=np.intp)
        timeline.send_lines(
            recording, path, ends, np.zeros((2, 1)), none, ["zero"], colours.ZERO, 1.0
        )


def _reach(rows: pl.DataFrame, axis: str) -> tuple[float, float]:
    """From the lowest to the highest that a part does, zero among it, without its spikes.

    Part by part: a bow thruster's minute is no spike because the hull force acts all the time.
    """
    ends = [0.0]
    for _, lines in rows.group_by("part"):
        values = display.column(lines, axis)
        values = values[np.isfinite(values)]
        if len(values):
            ends.append(float(np.percentile(values, SPIKES, method="higher")))
            ends.append(float(np.percentile(values, 100.0 - SPIKES, method="lower")))
    return min(ends), max(ends)
