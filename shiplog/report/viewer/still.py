"""A comparison as one picture, for mail and paper: of each voyage the tracks and the errors."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from shiplog.machine import files
from shiplog.report import colours
from shiplog.report.figures import style
from shiplog.report.viewer import display, surroundings, tracking
from shiplog.report.viewer.comparison_data import ComparisonData
from shiplog.report.viewer.display import Drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH, ROW = 10.0, 3.9  # inches: the picture is wide, a voyage is tall
KINDS = (".png", ".svg")
SHAPE = 1.25  # width of a chart over its height, as the grid leaves it
POINTS = 1500  # of a line: more than its width on a screen or a page
MOST_HULLS = 24
RULES: dict[Any, Any] = style.RULES | {"savefig.dpi": 150.0}  # a picture for mail


def write(comparison: ComparisonData, path: Path) -> None:
    """PATH, a .png or .svg: whole or not at all, without a window."""
    from matplotlib.figure import Figure

    drawn = display.drawn(comparison)
    voyages = drawn.voyages if drawn.moment is None else [drawn.moment.voyage]
    kind = path.suffix.lower().removeprefix(".")
    facts = {"Date": None} if kind == "svg" else {}
    with style.styled(RULES):
        figure = Figure(figsize=(WIDTH, ROW * len(voyages) + 0.5), layout="constrained")
        _draw(figure, drawn, voyages)
        with files.whole(path) as partial:
            figure.savefig(partial, format=kind, metadata=facts)


def _draw(figure: Figure, drawn: Drawn, voyages: list[str]) -> None:
    errors = tracking.with_errors(drawn)
    grid = figure.add_gridspec(2 * len(voyages), 2, width_ratios=[1.0, 1.25])
    for number, voyage in enumerate(voyages):
        rows = slice(2 * number, 2 * number + 2)
        chart = figure.add_subplot(grid[rows, 0])
        _draw_chart(chart, drawn, voyage)
        position = figure.add_subplot(grid[2 * number, 1])
        heading = figure.add_subplot(grid[2 * number + 1, 1], sharex=position)
        of = errors.filter(pl.col("voyage") == voyage)
        _draw_errors(position, drawn, of, tracking.POSITION)
        _draw_errors(heading, drawn, of, tracking.HEADING)
        measured = _of(drawn, drawn.measured, voyage)
        if not of.is_empty():
            near = _of(drawn, of, voyage)
            position.set_ylim(*tracking.position_range(near, measured))
            heading.set_ylim(*tracking.heading_range(near))
        if drawn.moment is not None:
            position.set_xlim(*drawn.moment.span)
            for axes in (position, heading):
                axes.axvline(drawn.moment.seconds, color=colours.web(colours.TEXT), linewidth=0.7)
        position.set_ylabel("position error [m]")
        position.tick_params(labelbottom=False)
        heading.set_ylabel("heading error [deg]")
        heading.set_xlabel("time [s]")
    handles, names = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=min(len(names), 4))
    figure.suptitle(drawn.title, x=0.01, ha="left")


def _of(drawn: Drawn, table: pl.DataFrame, voyage: str) -> pl.DataFrame:
    """Rows of a voyage; about the moment, where there is one."""
    rows = table.filter(pl.col("voyage") == voyage)
    if drawn.moment is None or drawn.moment.voyage != voyage:
        return rows
    near = rows.filter(pl.col("time").is_between(*drawn.moment.span))
    return rows if near.is_empty() else near


def _draw_chart(axes: Axes, drawn: Drawn, voyage: str) -> None:
    from matplotlib.collections import PolyCollection

    from shiplog.report.viewer import trajectory

    rows = _of(drawn, drawn.measured, voyage)
    simulated = _of(drawn, drawn.simulated, voyage)
    east, north = trajectory.extent(replace(drawn, measured=rows, simulated=simulated), voyage)
    wide, tall = east[1] - east[0], north[1] - north[0]
    wide, tall = max(wide, SHAPE * tall), max(tall, wide / SHAPE)
    axes.set_aspect("equal", adjustable="box")
    for limit, ends, length in ((axes.set_xlim, east, wide), (axes.set_ylim, north, tall)):
        middle = (ends[0] + ends[1]) / 2.0
        limit(middle - length / 2.0, middle + length / 2.0)
    seeds = display.drawn_seeds(drawn)
    of = colours.colours(drawn.models, drawn.extended)
    _line(axes, rows, "y0", "x0", colours.MEASURED, 2.0, "measured")
    for model, colour in of.items():
        bold = simulated.filter(pl.col("model") == model, pl.col("seed") == seeds[model])
        _line(axes, bold, "y0", "x0", colour, 1.2, model)
    every = trajectory.hull_interval(rows, drawn.ship_length)
    marks = rows.filter((pl.col("time") / every).floor().diff().fill_null(1) > 0)
    hulls = trajectory.hulls(marks, trajectory.outline(drawn)) * (1.0, -1.0)
    hulls = hulls[np.isfinite(hulls).all(axis=(1, 2))]
    edge = colours.web(colours.faded(colours.MEASURED, 0.8))
    axes.add_collection(
        PolyCollection(list(hulls), facecolors="none", edgecolors=edge, linewidths=0.5, zorder=3)
    )
    for bank in drawn.banks:
        x0, y0 = np.array(bank).T
        axes.plot(y0, x0, color=colours.web(colours.BANK), linewidth=2.0)
    axes.grid(color=colours.web(colours.GRID), linewidth=0.5)
    axes.set_title(f"{voyage}, hull every {every:g} s")
    axes.set_xlabel("y₀ [m], east")
    axes.set_ylabel("x₀ [m], north")
    _draw_arrows(axes, drawn, voyage)


def _draw_arrows(axes: Axes, drawn: Drawn, voyage: str) -> None:
    """North, the mean true wind as it blows, a named current as it sets: above the tracks."""
    from matplotlib.figure import Figure
    from matplotlib.transforms import offset_copy

    figure = axes.get_figure()
    assert isinstance(figure, Figure)
    arrows = [("N", 0.0, colours.TEXT)]
    rows = drawn.measured.filter(pl.col("voyage") == voyage)
    wind = surroundings.mean_true_wind(rows) if drawn.has_wind else None
    if wind is not None and wind.steady:
        arrows.append((wind.said, wind.comes_from + math.pi, colours.WIND))
    if (current := drawn.current) is not None:
        arrows.append((surroundings.said(current), current.direction, colours.CURRENT))
    for x, (name, angle, colour) in zip((0.05, 0.17, 0.62), arrows, strict=False):
        dx, dy = 11.0 * math.sin(angle), 11.0 * math.cos(angle)  # points
        middle = offset_copy(axes.transAxes, figure, x=dx, y=dy, units="points")
        axes.annotate(
            "", xy=(x, 0.93), xycoords=middle, xytext=(-2.0 * dx, -2.0 * dy),
            textcoords="offset points", zorder=6,
            arrowprops={"arrowstyle": "-|>", "color": colours.web(colour), "linewidth": 1.3},
        )  # fmt: skip
        axes.annotate(
            name, xy=(x, 0.93), xycoords="axes fraction", xytext=(13.0, -3.0),
            textcoords="offset points", fontsize=7.5, color=colours.web(colour), zorder=6,
        )  # fmt: skip


def _draw_errors(axes: Axes, drawn: Drawn, errors: pl.DataFrame, name: str) -> None:
    seeds = display.drawn_seeds(drawn)
    axes.axhline(0.0, color=colours.web(colours.ZERO), linewidth=0.7)
    axes.grid(color=colours.web(colours.GRID), linewidth=0.5)
    for model, colour in colours.colours(drawn.models, drawn.extended).items():
        bold = errors.filter(pl.col("model") == model, pl.col("seed") == seeds[model])
        _line(axes, bold, "time", name, colour, 1.0, model)


def _line(
    axes: Axes, rows: pl.DataFrame, across: str, up: str, colour: colours.Colour, width: float,
    label: str,
) -> None:  # fmt: skip
    """A line that is broken between windows and where nothing was measured."""
    if rows.is_empty():
        return
    begins = display.pieces(rows)
    x, y = (np.insert(display.column(rows, name), begins, np.nan) for name in (across, up))
    keep = _kept(y) if across == "time" else _kept(x) | _kept(y)
    axes.plot(x[keep], y[keep], color=colours.web(colour), linewidth=width, label=label)


def _kept(values: np.ndarray) -> np.ndarray:
    """Which of the values [n] a picture needs: of each stretch the first, lowest and highest."""
    keep = np.ones(len(values), dtype=bool)
    if len(values) <= 2 * POINTS:
        return keep
    keep[:] = ~np.isfinite(values)  # what breaks a line
    for stretch in np.array_split(np.arange(len(values)), POINTS // 2):
        known = stretch[np.isfinite(values[stretch])]
        if len(known):
            ends = (known[0], known[np.argmin(values[known])], known[np.argmax(values[known])])
            keep[list(ends)] = True
    return keep
