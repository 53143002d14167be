"""Tracks on a chart, north up: measured, simulated, and with the named causes; hulls to scale."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from shiplog.nomenclature import frames
from shiplog.nomenclature.numbers import figure, in_minutes
from shiplog.report import colours
from shiplog.report.figures import hull, style
from shiplog.report.figures.content import Content, Picture
from shiplog.report.figures.picture_data import AFTER, MEASURED, PictureData

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_HULLS = {"closeup": 10, "voyage": 24}  # on one track: more would hide the lines
# How far a simulated track is followed beyond the measured one, in sizes of that: all of a window,
# where the reader is to see how far off it ends.
ROOM = {"closeup": 2.0, "voyage": 0.35}
SHAPE = 1.15  # width of a chart over its height
MARGIN = 0.12  # of the tracks, left free around them: the scale bar is below the lowest
MINUTE_M = 1852.0  # m: a minute of latitude
MOST_WINDOWS = 100  # with a track on the chart of a voyage
GAP_S = 2.5  # s between rows of a second each, from which a track is broken
FEW = 1e-9
MADE_FAST = "the line's point, 90 %"
FARTHEST_POINT = 1.0  # sizes of the tracks of a voyage: so far off a line's point is still drawn


def closeup_window(data: PictureData) -> tuple[str, int] | None:
    """Voyage and number of the held-out window whose error fell most; where nothing was named, of
    the one with the largest error. None without a window."""
    if data.errors.is_empty():
        return None
    first = next(iter(data.models))
    sign = pl.when(pl.col("model") == first).then(1.0).when(pl.col("model") == AFTER).then(-1.0)
    rows = (
        data.errors.with_columns(part=sign * pl.col("loss"))
        .group_by("voyage", "window", maintain_order=True)
        .agg(fell=pl.col("part").sum(), there=pl.col("part").is_not_null().any())
        .filter("there")
        .sort("fell", descending=True, maintain_order=True)
    )
    return None if rows.is_empty() else (rows["voyage"][0], rows["window"][0])


def closeup_table(content: Content) -> pl.DataFrame:
    """line (MEASURED or a model), piece, time, x0, y0, heading of one window."""
    data = content.data
    if (chosen := closeup_window(data)) is None:
        return _lines(data.measured.clear(), data.tracks.clear())
    voyage, window = chosen
    tracks = data.tracks.filter(pl.col("voyage") == voyage, pl.col("window") == window)
    begin, end = tracks["time"].min(), tracks["time"].max()
    inside = pl.col("time").is_between(begin, end)
    return _lines(data.measured.filter(pl.col("voyage") == voyage, inside), tracks)


def voyage_table(content: Content) -> pl.DataFrame:
    """The same columns, of every window of a voyage."""
    return _lines(content.data.measured, content.data.tracks)


def _lines(measured: pl.DataFrame, tracks: pl.DataFrame) -> pl.DataFrame:
    keep = ["line", "voyage", "piece", "time", "x0", "y0", "heading"]
    gap = pl.col("time").diff().fill_null(0.0) > GAP_S
    first = measured.with_columns(line=pl.lit(MEASURED), piece=gap.cum_sum().cast(pl.Int64))
    others = (
        _few(tracks)
        .filter(pl.col("model") != MEASURED)
        .with_columns(line=pl.col("model"), piece=pl.col("window"))
    )
    return pl.concat([first.select(keep), others.select(keep)])


def _few(tracks: pl.DataFrame) -> pl.DataFrame:
    """Of very many windows of a voyage evenly spaced ones: more would hide each other."""
    count = tracks.select("voyage", "window").n_unique()
    step = -(-count // MOST_WINDOWS)
    return tracks if step <= 1 else tracks.filter(pl.col("window") % step == 0)


def draw_closeup(axes: Axes, table: pl.DataFrame, content: Content) -> None:
    _draw(axes, table, content, "closeup")


def draw_voyage(axes: Axes, table: pl.DataFrame, content: Content) -> None:
    _draw(axes, table, content, "voyage")


def _draw(axes: Axes, table: pl.DataFrame, content: Content, of: str) -> None:
    data = content.data
    voyage = str(table["voyage"][0])
    shape = hull.outline(data.length, data.breadth, data.outline)
    axes.set_aspect("equal", adjustable="box")
    for line, label, colour in legend(data):
        rows = table.filter(pl.col("line") == line)
        if rows.is_empty():
            continue
        _draw_line(axes, rows, label, colour, 2.0 if line == MEASURED else 1.4)
        if line == MEASURED or of == "closeup":
            _draw_hulls(axes, rows, shape, colour, MOST_HULLS[of], data.length)
    for bank in data.banks:
        x0, y0 = np.array(bank).T
        axes.plot(y0, x0, color=colours.web(colours.BANK), linewidth=2.5)
    _draw_starts(axes, table.filter(pl.col("line") != MEASURED))
    _limit(axes, table, data.length, ROOM[of], data.made_fast[:1] if of == "voyage" else ())
    _draw_made_fast(axes, data)
    _label(axes, data, voyage)
    _draw_scale(axes)
    _draw_arrows(axes, data, voyage)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, columnspacing=1.2)


def _draw_starts(axes: Axes, simulated: pl.DataFrame) -> None:
    """A dot where each window begins, at the measured state."""
    starts = simulated.group_by("piece", maintain_order=True).agg(pl.all().sort_by("time").first())
    if len(starts):
        axes.plot(
            starts["y0"].to_numpy(), starts["x0"].to_numpy(), "o", markersize=3.5, zorder=5,
            color=colours.web(colours.MEASURED), label="window starts",
        )  # fmt: skip


def _draw_made_fast(axes: Axes, data: PictureData) -> None:
    """A cross where a named line goes to, as long as its interval; nothing outside the chart."""
    if not data.made_fast:
        return
    (x, y), (south, west), (north, east) = data.made_fast
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    if not (left <= y <= right and bottom <= x <= top):
        return
    axes.errorbar(
        [y], [x], xerr=[[y - west], [east - y]], yerr=[[x - south], [north - x]], fmt="D",
        color=colours.web(colours.NAMED_FORCE), markersize=5.0, markerfacecolor="none",
        capsize=3.0, zorder=6, label=MADE_FAST,
    )  # fmt: skip
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)


def legend(data: PictureData) -> list[tuple[str, str, str]]:
    """(line, its label, its colour) in the order in which they are drawn."""
    after = data.models.get(AFTER)
    of = colours.colours(list(data.models.values()), extended=[after] if after else [])
    found = [(MEASURED, "measured", colours.web(colours.MEASURED))]
    return found + [(key, label, colours.web(of[label])) for key, label in data.models.items()]


def _draw_line(axes: Axes, rows: pl.DataFrame, label: str, colour: str, width: float) -> None:
    pieces = rows.partition_by("piece", maintain_order=True)
    for i, piece in enumerate(pieces):
        x0, y0 = (piece[k].to_numpy() for k in ("x0", "y0"))
        _, y0, x0 = style.thinned(piece["time"].to_numpy(), y0, x0)
        axes.plot(y0, x0, color=colour, linewidth=width, label=label if i == 0 else None)


def _draw_hulls(
    axes: Axes, rows: pl.DataFrame, shape: np.ndarray, colour: str, most: int, length: float
) -> None:
    from matplotlib.collections import PolyCollection

    rows = rows.drop_nulls(["x0", "y0", "heading"])
    x0, y0 = (rows[k].to_numpy() for k in ("x0", "y0"))
    sailed = float(np.nansum(np.hypot(np.diff(x0), np.diff(y0))))
    time = rows["time"].to_numpy()
    if len(time) < 2:
        return
    every = hull.interval(float(np.ptp(time)), sailed, length, most)
    marks = np.flatnonzero(np.diff(np.floor(time / every), prepend=-1.0) > 0)
    heading = rows["heading"].to_numpy()
    outlines = hull.placed(shape, x0[marks], y0[marks], heading[marks])
    outlines = outlines[np.isfinite(outlines).all((1, 2))]
    axes.add_collection(
        PolyCollection(
            list(outlines), facecolors="none", edgecolors=colour, linewidths=0.6, zorder=3
        )
    )


def _limit(
    axes: Axes, table: pl.DataFrame, length: float, room: float,
    points: tuple[tuple[float, float], ...] = (),
) -> None:  # fmt: skip
    """All that was measured, with room for what was simulated: a model that diverges must not
    shrink the ship to a dot. With `points` (x₀, y₀) where they are not too far off."""
    own = table.filter(pl.col("line") == MEASURED)
    if own.drop_nulls(["x0", "y0"]).is_empty():
        own = table
    ends = [_ends_of(own[name]) for name in ("y0", "x0")]
    size = max(high - low for low, high in ends)
    beyond = FARTHEST_POINT * size
    for x0, y0 in points:
        if all(a - beyond <= v <= b + beyond for v, (a, b) in zip((y0, x0), ends, strict=True)):
            ends = [(min(a, v), max(b, v)) for v, (a, b) in zip((y0, x0), ends, strict=True)]
    margin = max(MARGIN * size, 1.2 * length)
    spans = []
    for (low, high), name in zip(ends, ("y0", "x0"), strict=True):
        least, most = _ends_of(table[name])
        low, high = (
            min(low, max(least, low - room * size)),
            max(high, min(most, high + room * size)),
        )
        spans.append((low - margin, high + margin))
    wide = max(spans[0][1] - spans[0][0], SHAPE * (spans[1][1] - spans[1][0]))
    for (low, high), whole, limit in zip(
        spans, (wide, wide / SHAPE), (axes.set_xlim, axes.set_ylim), strict=True
    ):
        middle = 0.5 * (low + high)
        limit(middle - 0.5 * whole, middle + 0.5 * whole)


def _ends_of(values: pl.Series) -> tuple[float, float]:
    """The least and the largest finite value; zero without one."""
    there = values.drop_nulls().to_numpy()
    there = there[np.isfinite(there)]
    return (float(there.min()), float(there.max())) if len(there) else (0.0, 0.0)


def _label(axes: Axes, data: PictureData, voyage: str) -> None:
    """Latitude and longitude where the log has coordinates, else metres."""
    place = data.voyages.filter(pl.col("voyage") == voyage)
    latitude = place["latitude"][0] if len(place) else None
    axes.grid(color=colours.web(colours.GRID), linewidth=0.5)
    axes.set_axisbelow(True)
    axes.locator_params(nbins=4)
    if latitude is None or place["longitude"][0] is None:
        axes.set_xlabel("y₀ [m], east")
        axes.set_ylabel("x₀ [m], north")
        return
    datum = float(latitude), float(place["longitude"][0])
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    size = max(east - west, north - south) / MINUTE_M  # minutes
    digits = min(max(1 - math.floor(math.log10(max(size, FEW))), 1), 4)
    axes.xaxis.set_major_formatter(
        lambda y0, _: in_minutes(frames.geodetic(south, y0, datum)[1], "EW", digits)
    )
    axes.yaxis.set_major_formatter(
        lambda x0, _: in_minutes(frames.geodetic(x0, west, datum)[0], "NS", digits)
    )
    axes.locator_params(axis="x", nbins=3)
    axes.tick_params(labelsize=6.5)


def _draw_scale(axes: Axes) -> None:
    """A bar of a round length, at the bottom left."""
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    third = (east - west) / 3.5
    power = 10.0 ** math.floor(math.log10(max(third, FEW)))
    size = max(k * power for k in (1.0, 2.0, 5.0) if k * power <= third)
    left, low = west + 0.04 * (east - west), south + 0.05 * (north - south)
    axes.plot([left, left + size], [low, low], color=colours.web(colours.TEXT), linewidth=2.5)
    text = f"{size:g} m" if size < 1000 else f"{size / 1000:g} km"
    axes.annotate(text, (left + size / 2, low), (0, 3), textcoords="offset points", ha="center",
                  fontsize=7.5)  # fmt: skip


def _draw_arrows(axes: Axes, data: PictureData, voyage: str) -> None:
    """North; where the mean true wind blows, and a named current sets, with their speeds."""
    ink = colours.web(colours.TEXT)
    arrows = [(0.0, "N", ink)]
    place = data.voyages.filter(pl.col("voyage") == voyage)
    if len(place) and (speed := place["wind_speed"][0]) is not None:
        towards = float(place["wind_from"][0]) + math.pi
        arrows.append((towards, f"wind\n{speed:.1f} m/s", colours.web(colours.WIND)))
    if data.current is not None:
        speed, towards = data.current
        arrows.append((towards, f"current\n{speed:.2f} m/s", colours.web(colours.CURRENT)))
    for i, (angle, text, colour) in enumerate(arrows):
        middle = (1.09, 0.92 - 0.34 * i)
        half = np.array([math.sin(angle), math.cos(angle)]) * 15.0  # points: as long on any chart
        axes.annotate(
            "", middle, xycoords="axes fraction", xytext=tuple(-half), textcoords="offset points",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.4, "shrinkA": 0,
                        "shrinkB": 0},
        )  # fmt: skip
        axes.annotate(
            text, middle, (0, -19), xycoords="axes fraction", textcoords="offset points",
            ha="center", va="top", fontsize=6.5, color=colour, annotation_clip=False,
        )  # fmt: skip


def closeup_words(table: pl.DataFrame, content: Content) -> str:
    if table.is_empty():
        return "No window was simulated."
    begin, end = table["time"].min(), table["time"].max()
    assert isinstance(begin, float) and isinstance(end, float)
    which = "whose error fell most" if AFTER in content.data.models else "with the largest error"
    return (
        f"Chart of the held-out window {which}: {table['voyage'][0]}, {begin:.0f} to {end:.0f} s. "
        f"{_ends(table, content.data)}"
    )


def _ends(table: pl.DataFrame, data: PictureData) -> str:
    """How far each model ends from what was measured."""
    last = {
        line: rows.drop_nulls(["x0", "y0"]).tail(1)
        for line in (MEASURED, *data.models)
        if len(rows := table.filter(pl.col("line") == line))
    }
    found = []
    for key in data.models:
        if key in last and len(last[key]) and len(last.get(MEASURED, ())):
            off = math.hypot(*(last[key][k][0] - last[MEASURED][k][0] for k in ("x0", "y0")))
            found.append(
                f"At its end {data.models.get(key, key)} is {figure(off, 3)} m "
                f"({figure(off / data.length)} ship lengths) from where the ship was"
            )
    return " ".join(f"{one}." for one in found)


def voyage_words(table: pl.DataFrame, content: Content) -> str:
    names = ", ".join(label for _, label, _ in legend(content.data))
    found = f"Chart of {table['voyage'][0]}, north up, tracks: {names}.{_made_fast(content.data)}"
    if not content.data.models:
        return found
    return f"{found} Every simulated track begins at the measured state, at a dot."


def _made_fast(data: PictureData) -> str:
    if not data.made_fast:
        return ""
    (x, y), (south, west), (north, east) = data.made_fast
    return (
        f" The line's point is at x0 {x:.1f} m ({south:.1f} to {north:.1f}), y0 {y:.1f} m "
        f"({west:.1f} to {east:.1f})."
    )


CLOSEUP = Picture(
    "Where it was, and where it was simulated", closeup_table, draw_closeup, closeup_words,
    height=3.7,
)  # fmt: skip
VOYAGE = Picture(
    "Tracks of a voyage", voyage_table, draw_voyage, voyage_words, voyage=True, height=3.7
)
