"""The track on a chart: north up, hulls to scale, every rollout from where it was started.

Rerun's 2D views have y pointing down, so a point is drawn at (y₀, -x₀).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from shiplog.report import colours
from shiplog.report.figures import hull
from shiplog.report.viewer import chart, display, made_fast, style, surroundings
from shiplog.report.viewer.comparison_data import Moment
from shiplog.report.viewer.display import Drawn
from shiplog.report.viewer.style import entity

HULL = hull.OUTLINE  # of a ship whose profile has none
NORTHWARD = pl.DataFrame({"x0": [0.0], "y0": [0.0], "heading": [0.0]})
FARTHEST_M = 500.0  # m
METRES = {"m": 1.0, "km": 1000.0}  # in a unit of the chart
MEASURED = "measured"
LONG = 20_000  # points of tracks, beyond which a software renderer takes many seconds
COARSE = 1.0 / 2000.0  # of the chart: less than a point of a screen
MOST_HULLS = 60  # on one track: more would hide the lines


def blueprint(drawn: Drawn, voyage: str | None) -> rrb.View | None:
    """The chart of one voyage."""
    if voyage is None:
        return None
    drawn, unit = in_chart_units(drawn)
    rows = drawn.measured.filter(pl.col("voyage") == voyage)
    frame = framed(drawn, voyage, about=drawn.moment)
    every = hull_interval(rows, drawn.ship_length)
    return rrb.Spatial2DView(
        origin=entity("track", voyage),
        name=f"Track [{unit}], hull every {every:g} s, dots: window starts",
        background=style.GROUND,
        visual_bounds=rrb.VisualBounds2D(x_range=frame.x_range, y_range=frame.y_range),
    )


def framed(
    drawn: Drawn,
    voyage: str,
    room: float = 0.0,
    view: tuple[float, float] = chart.TALL,
    about: Moment | None = None,
) -> chart.Frame:
    """The chart of a voyage in chart units, or of what is about a moment of it.

    view   the size of its view [points]
    """
    entries = list(key(drawn))
    if about is not None and about.voyage == voyage:
        begin, end = about.span
        within = pl.col("time").is_between(begin, end)
        drawn = replace(
            drawn,
            measured=drawn.measured.filter(within),
            simulated=drawn.simulated.filter(within),
        )
    return chart.frame(*extent(drawn, voyage, room), entries, view, voyage in drawn.datums)


def key(drawn: Drawn) -> dict[str, colours.Colour]:
    """What the colours of the chart are."""
    return {MEASURED: colours.MEASURED, **colours.colours(drawn.models, drawn.extended)}


def send(
    recording: rr.RecordingStream,
    drawn: Drawn,
    room: float = 0.0,
    view: tuple[float, float] = chart.TALL,
) -> None:
    """Tracks and hulls of every voyage, measured and simulated.

    room, view   as for `framed`
    """
    drawn, unit = in_chart_units(drawn)
    measured = drawn.measured
    simulated = drawn.simulated
    seeds = display.drawn_seeds(drawn)
    for voyage in drawn.voyages:
        rows = measured.filter(pl.col("voyage") == voyage)
        _send_chart(recording, drawn, voyage, unit, room, view)
        _send_measured(recording, drawn, voyage, rows)
        if drawn.moment is not None and drawn.moment.voyage == voyage:
            _mark(recording, voyage, rows, drawn.moment)
        _send_window_starts(recording, voyage, simulated.filter(pl.col("voyage") == voyage))
        for model, colour in colours.colours(drawn.models, drawn.extended).items():
            rollouts = simulated.filter(pl.col("voyage") == voyage, pl.col("model") == model)
            bold = pl.col("seed") == seeds[model]
            _send_simulated(recording, drawn, voyage, model, colour, rollouts.filter(bold))
            others = _strips(rollouts.filter(~bold), ("seed", "window"))
            recording.log(
                entity("track", voyage, "seeds", model),
                rr.LineStrips2D(
                    others,
                    colors=colours.faded(colour),
                    radii=rr.Radius.ui_points(0.5),
                    draw_order=12.0,
                ),
                static=True,
            )


def in_chart_units(drawn: Drawn) -> tuple[Drawn, str]:
    """Metres, or kilometres at sea: Rerun 0.41 pales lines far from the origin of a 2D view."""
    places = np.concatenate([display.column(drawn.measured, name) for name in ("x0", "y0")])
    if not (np.abs(places) > FARTHEST_M).any():
        return drawn, "m"
    km = [pl.col(name) / 1000.0 for name in ("x0", "y0")]
    small = replace(
        drawn,
        ship_length=drawn.ship_length / 1000.0,
        ship_breadth=drawn.ship_breadth / 1000.0,
        ship_outline=tuple((x / 1000.0, y / 1000.0) for x, y in drawn.ship_outline),
        measured=drawn.measured.with_columns(km),
        simulated=drawn.simulated.with_columns(km),
        banks=tuple(tuple((x / 1000.0, y / 1000.0) for x, y in bank) for bank in drawn.banks),
        made_fast=None if drawn.made_fast is None else drawn.made_fast.scaled(1000.0),
    )
    return small, "km"


def positions(table: pl.DataFrame) -> NDArray[np.float64]:
    """[N, 2] where the rows are on the chart: east, and south."""
    return np.column_stack((display.column(table, "y0"), -display.column(table, "x0")))


def outline(drawn: Drawn) -> NDArray[np.float64]:
    """[K, 2] (ahead, starboard) of midship: the ship's own outline, closed, or one like it."""
    return hull.outline(drawn.ship_length, drawn.ship_breadth, drawn.ship_outline)


def hulls(table: pl.DataFrame, outline: NDArray[np.float64]) -> NDArray[np.float64]:
    """[N, K, 2] (east, south) of the outline [K, 2] of the ship at every row, to scale."""
    x0, y0 = (display.column(table, name) for name in ("x0", "y0"))
    heading = np.radians(display.column(table, "heading"))
    return hull.placed(outline, x0, y0, heading) * (1.0, -1.0)


def hull_interval(rows: pl.DataFrame, length: float) -> float:
    """The round number of seconds that leaves at most MOST_HULLS outlines on a track, and mostly
    a ship's length between them."""
    time = display.column(rows, "time")
    sailed = float(np.nansum(np.linalg.norm(np.diff(positions(rows), axis=0), axis=1)))
    return hull.interval(
        float(time[-1] - time[0]) if len(time) else 0.0, sailed, length, MOST_HULLS
    )


def _send_measured(
    recording: rr.RecordingStream, drawn: Drawn, voyage: str, rows: pl.DataFrame
) -> None:
    recording.log(
        entity("track", voyage, "measured"),
        rr.LineStrips2D(
            _lines(positions(rows), display.pieces(rows)),
            colors=colours.MEASURED,
            radii=rr.Radius.ui_points(1.25),
            draw_order=10.0,
        ),
        static=True,
    )
    every = hull_interval(rows, drawn.ship_length)
    marks = rows.filter((pl.col("time") / every).floor().diff().fill_null(1) > 0)
    recording.log(
        entity("track", voyage, "measured", "hulls"),
        rr.LineStrips2D(
            _whole(hulls(marks, outline(drawn))),
            colors=colours.faded(colours.MEASURED, 0.8),
            radii=rr.Radius.ui_points(0.5),
            draw_order=11.0,
        ),
        static=True,
    )
    _send_moving_hull(recording, drawn, voyage, "measured", colours.MEASURED, rows)


def _mark(recording: rr.RecordingStream, voyage: str, rows: pl.DataFrame, moment: Moment) -> None:
    """Where the ship was at the moment."""
    time, places = display.column(rows, "time"), positions(rows)
    known = np.isfinite(places).all(axis=1)
    if not known.any():
        return
    place = [float(np.interp(moment.seconds, time[known], axis)) for axis in places[known].T]
    recording.log(
        entity("track", voyage, "moment"),
        rr.Points2D(
            [place],
            labels=[f"{moment.seconds:g} s"],
            show_labels=True,
            colors=colours.TEXT,
            radii=rr.Radius.ui_points(6.0),
            draw_order=35.0,
        ),
        static=True,
    )


def _send_simulated(
    recording: rr.RecordingStream,
    drawn: Drawn,
    voyage: str,
    model: str,
    colour: colours.Colour,
    rollouts: pl.DataFrame,
) -> None:
    recording.log(
        entity("track", voyage, "simulated", model),
        rr.LineStrips2D(
            _strips(rollouts, ("window",)),
            colors=colour,
            radii=rr.Radius.ui_points(1.0),
            draw_order=20.0,
        ),
        static=True,
    )
    _send_moving_hull(recording, drawn, voyage, model, colour, rollouts)


def _send_window_starts(
    recording: rr.RecordingStream, voyage: str, simulated: pl.DataFrame
) -> None:
    """Every rollout of a window starts at the measured state: one dot serves all models."""
    points = positions(simulated.group_by("window").agg(pl.all().sort_by("time").first()))
    recording.log(
        entity("track", voyage, "window_starts"),
        rr.Points2D(
            points[np.isfinite(points).all(axis=1)],
            colors=colours.MEASURED,
            radii=rr.Radius.ui_points(3.5 if len(points) <= MOST_HULLS else 1.5),
            draw_order=25.0,
        ),
        static=True,
    )


def _send_moving_hull(
    recording: rr.RecordingStream,
    drawn: Drawn,
    voyage: str,
    whose: str,
    colour: colours.Colour,
    rows: pl.DataFrame,
) -> None:
    heading = np.radians(display.column(rows, "heading"))
    points = np.column_stack((positions(rows), np.zeros(len(rows))))
    valid = np.isfinite(points).all(axis=1) & np.isfinite(heading)
    if not valid.any():
        return
    zero = np.zeros(int(valid.sum()))
    half = heading[valid] / 2.0  # about Rerun's z, which points into the chart: clockwise
    path = entity("track", voyage, "now", whose)
    time = display.column(rows, "time")[valid]
    recording.send_columns(  # from the first instant on: before it a hull would lie at the origin
        path,
        indexes=[style.instants(time[:1])],
        columns=rr.LineStrips2D.columns(
            strips=list(hulls(NORTHWARD, outline(drawn))),
            colors=[colour],
            radii=-1.5,  # negative: points of the screen, as Radius.ui_points makes them
            draw_order=30.0,
        ),
    )
    recording.send_columns(
        path,
        indexes=[style.instants(time)],
        columns=rr.Transform3D.columns(
            translation=points[valid],
            quaternion=np.column_stack((zero, zero, np.sin(half), np.cos(half))),
        ),
    )


def _send_chart(
    recording: rr.RecordingStream,
    drawn: Drawn,
    voyage: str,
    unit: str,
    room: float,
    view: tuple[float, float],
) -> None:
    """What stands about the tracks, and what the site has."""
    frame = framed(drawn, voyage, room, view, drawn.moment)
    datum = drawn.datums.get(voyage)
    chart.send_grid(recording, voyage, frame, METRES[unit], datum)
    rows = drawn.measured.filter(pl.col("voyage") == voyage)
    wind = surroundings.mean_true_wind(rows) if drawn.has_wind else None
    chart.send_arrows(recording, voyage, frame, unit, wind, drawn.current)
    chart.send_key(recording, voyage, frame, key(drawn))
    if drawn.banks:
        recording.log(
            entity("track", voyage, "banks"),
            rr.LineStrips2D(
                [[(y, -x) for x, y in bank] for bank in drawn.banks],
                colors=colours.BANK,
                radii=rr.Radius.ui_points(2.0),
                draw_order=2.0,
            ),
            static=True,
        )
        below = np.array((0.0, chart.LINE * frame.point))  # not on a coordinate, which are round
        middles = [np.mean([(y, -x) for x, y in bank], axis=0) + below for bank in drawn.banks]
        path = entity("track", voyage, "banks", "labels")
        style.labels(recording, path, middles, ["bank"] * len(middles))

    if drawn.made_fast is not None:
        made_fast.send(recording, voyage, drawn.made_fast, frame)


def extent(
    drawn: Drawn, voyage: str, room: float = 0.0
) -> tuple[tuple[float, float], tuple[float, float]]:
    """East and north ranges that show all that was measured with room for what was simulated.

    What a diverging model does far outside is left there: it must not shrink the ship to a dot.

    room   how far beyond it is followed, in sizes of the measured track
    """
    of = pl.col("voyage") == voyage
    rows, simulated = drawn.measured.filter(of), drawn.simulated.filter(of)
    ranges, followed = [], []
    for name in ("y0", "x0"):
        values = display.column(rows, name)
        values = values[np.isfinite(values)]
        low, high = (values.min(), values.max()) if len(values) else (0.0, 0.0)
        ranges.append((float(low), float(high)))
        followed.append(display.column(simulated, name))
    size = max(high - low for low, high in ranges)
    if drawn.made_fast is not None:
        ranges = made_fast.seen(ranges, drawn.made_fast, size)
    margin = max(0.08 * size, 1.5 * drawn.ship_length)
    (west, east), (south, north) = (
        _widened(ends, values, room * size) for ends, values in zip(ranges, followed, strict=True)
    )
    return (west - margin, east + margin), (south - margin, north + margin)


def _widened(
    ends: tuple[float, float], values: NDArray[np.float64], most: float
) -> tuple[float, float]:
    """The range with these values in it, but wider by `most` on either side at most."""
    low, high = ends
    values = values[np.isfinite(values)]
    if not len(values):
        return low, high
    return (
        min(low, max(float(values.min()), low - most)),
        max(high, min(float(values.max()), high + most)),
    )


def _strips(rollouts: pl.DataFrame, by: tuple[str, ...]) -> list[NDArray[np.float64]]:
    """One line per rollout."""
    if rollouts.is_empty():
        return []
    begins = np.flatnonzero(rollouts.select(pl.struct(by).rle_id().diff()).to_series() == 1)
    return _lines(positions(rollouts), begins)


def _lines(points: NDArray[np.float64], begins: NDArray[np.intp]) -> list[NDArray[np.float64]]:
    """The points cut at `begins` and where one is not finite."""
    lines = []
    for piece in np.split(points, begins):
        valid = np.isfinite(piece[:, 0] + piece[:, 1])
        lines += [part for part in _runs(piece, valid) if len(part) > 1]
    if len(points) <= LONG:
        return lines
    known = points[np.isfinite(points).all(axis=1)]
    step = COARSE * float(np.ptp(known, axis=0).max())
    return [_coarser(line, step) for line in lines]


def _coarser(line: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """A line with fewer points, of each `step` along it the first: none is farther off."""
    if step == 0.0:
        return line[[0, -1]]
    sailed = np.cumsum(np.linalg.norm(np.diff(line, axis=0, prepend=line[:1]), axis=1))
    keep = np.diff(np.floor(sailed / step), prepend=-1.0) > 0
    keep[-1] = True
    return line[keep]


def _runs(piece: NDArray[np.float64], valid: NDArray[np.bool_]) -> list[NDArray[np.float64]]:
    if valid.all():
        return [piece]
    edges = np.flatnonzero(np.diff(valid.astype(np.int8))) + 1
    parts = zip(np.split(piece, edges), np.split(valid, edges), strict=True)
    return [part for part, good in parts if good.all()]


def _whole(outlines: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    return list(outlines[np.isfinite(outlines).all(axis=(1, 2))])
