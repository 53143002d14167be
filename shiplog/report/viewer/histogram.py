"""What the training data covered and the test voyages asked for, as in the paper's figures.

Frequencies are logarithmic; Rerun has no such axis, so log10(1 + rows) is drawn.
"""

from __future__ import annotations

import math

import numpy as np
import polars as pl
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from shiplog.nomenclature import channels
from shiplog.nomenclature.channels import Channel
from shiplog.report import colours
from shiplog.report.viewer import display, style
from shiplog.report.viewer.display import Drawn
from shiplog.report.viewer.style import entity
from shiplog.voyages.windows.wind_histogram import ANGLE_BIN, FASTEST, SPEED_BIN, wind_counts

MOST_BINS = 40
SETS = ("training", "test")


def blueprint(drawn: Drawn, voyage: str | None) -> rrb.Container | None:
    """A tab of their own."""
    if voyage is not None:
        return None
    winds = [
        rrb.Spatial2DView(
            origin=entity("hist", "wind", of),
            name=f"Apparent wind, {_whose(drawn, of)} [rows, log scale]",
            background=style.GROUND,
            visual_bounds=_wind_bounds(drawn),
        )
        for of in (SETS if drawn.has_wind else ())
    ]
    singles = [
        rrb.BarChartView(
            origin=entity("hist", channel.name),
            name=f"{channel.label}: log10(1 + rows)",
            plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=True),
            background=style.plot_background(),
        )
        for channel in _singles(drawn)
    ]
    return rrb.Grid(*singles, *winds, grid_columns=3, name="Coverage")


def _whose(drawn: Drawn, of: str) -> str:
    """Training of which model, where a picture shows several."""
    return f"{of} of {drawn.trained}" if of == "training" and drawn.trained else of


def send(recording: rr.RecordingStream, drawn: Drawn) -> None:
    """Training data and all test voyages, side by side."""
    sets = dict(zip(SETS, (drawn.training, drawn.measured), strict=True))
    for channel in _singles(drawn):
        values = {of: _finite(table, channel.name) for of, table in sets.items()}
        edges = bins(np.concatenate(list(values.values())))
        width = float(edges[1] - edges[0])
        for of, shift, colour in zip(
            SETS, (-0.22, 0.22), (colours.TRAINING, colours.TRIAL), strict=True
        ):
            count = np.histogram(values[of], edges)[0]
            recording.log(
                entity("hist", channel.name, of),
                rr.BarChart(
                    np.log10(1.0 + count),
                    abscissa=edges[:-1] + (0.5 + shift) * width,  # side by side: none hides
                    widths=np.full(len(count), 0.44 * width, dtype=np.float32),
                    color=colour,
                ),
                static=True,
            )
    if drawn.has_wind:
        counts = {of: wind_counts(table, _fastest(drawn)) for of, table in sets.items()}
        most = max(float(np.log10(1.0 + count).max()) for count in counts.values())
        for of, count in counts.items():
            _send_wind(recording, of, count, most)


def bins(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Edges at multiples of a round width (1, 2 or 5), at most MOST_BINS bins."""
    low, high = (values.min(), values.max()) if len(values) else (0.0, 0.0)
    span = max(float(high - low), 1e-6 * max(abs(high), 1.0))
    power = 10.0 ** math.floor(math.log10(span / MOST_BINS))
    width = next(
        power * k for k in (1.0, 2.0, 5.0, 10.0, 20.0) if span / (power * k) < MOST_BINS - 1
    )
    first, last = math.floor(low / width), math.floor(high / width) + 1
    return width * np.arange(first, last + 1, dtype=np.float64)


CELL = 10  # picture units a direction bin is wide
TALL = 130  # picture units the speed axis is about
RAMP = np.array([(226, 240, 190), (127, 205, 187), (44, 127, 184), (8, 29, 88)], dtype=float)


def _send_wind(
    recording: rr.RecordingStream, of: str, count: NDArray[np.int64], most: float
) -> None:
    """The counts as a tensor, and a picture of them with axes, which a tensor view lacks."""
    logarithm = np.log10(1.0 + count)
    recording.log(
        entity("hist", "wind", of),
        rr.Tensor(logarithm, dim_names=("direction", "speed"), value_range=[0.0, max(most, 1.0)]),
        static=True,
    )
    high = _cell_height(count.shape[1])
    cells = _coloured(logarithm, most)[..., :3].transpose(1, 0, 2)[::-1]  # speed upwards
    picture = np.repeat(np.repeat(cells, high, axis=0), CELL, axis=1)
    tall, wide = picture.shape[:2]
    path = entity("hist", "wind", of, "picture")
    recording.log(path, rr.Image(picture, color_model="RGB", draw_order=1.0), static=True)
    _send_axes(recording, of, count.shape[1], (tall, wide, high), most)


def _send_axes(
    recording: rr.RecordingStream, of: str, speeds: int, size: tuple[int, int, int], most: float
) -> None:
    """Ticks, their numbers and the key of a picture of `size`: tall, wide, and high a speed."""
    tall, wide, high = size
    ticks, names, marks = [], [], []
    for degrees in range(0, 361, 90):
        x = degrees / ANGLE_BIN * CELL
        ticks.append([(x, 0.0), (x, tall + 2.0)])
        marks.append((x, tall + 10.0))
        names.append(f"{degrees}°")
    fastest = speeds * SPEED_BIN
    step = next(s for s in (1.0, 2.0, 5.0, 10.0, 20.0) if fastest / s <= 6.5 or s == 20.0)
    for speed in np.arange(0.0, fastest + 1e-9, step):
        y = tall - speed / SPEED_BIN * high
        ticks.append([(-2.0, y), (wide, y)])
        marks.append((-12.0, y))
        names.append(f"{speed:g} m/s" if speed else "")
    scale = np.linspace(0.0, 1.0, tall)[::-1, None] * np.ones((1, 1))
    shades = _coloured(scale * most, most)
    bar = entity("hist", "wind", of, "key")
    recording.log(
        bar,
        rr.LineStrips2D(
            [[(wide + 8.0, i + 0.5), (wide + 12.0, i + 0.5)] for i in range(tall)],
            colors=shades[:, 0],
            radii=0.55,
        ),
        static=True,
    )
    for rows in (1, 10, 100, 1000, 10_000, 100_000, 1_000_000):
        if math.log10(1.0 + rows) <= most:
            marks.append((wide + 20.0, tall * (1.0 - math.log10(1.0 + rows) / most)))
            names.append(f"{rows}")
    recording.log(
        entity("hist", "wind", of, "ticks"),
        rr.LineStrips2D(ticks, colors=colours.GRID, radii=rr.Radius.ui_points(0.5), draw_order=2.0),
        static=True,
    )
    recording.log(
        entity("hist", "wind", of, "axes"),
        rr.Points2D(
            marks,
            labels=names,
            show_labels=True,
            colors=colours.TEXT,
            radii=rr.Radius.ui_points(0.0),
        ),
        static=True,
    )


def _coloured(logarithm: NDArray[np.float64], most: float) -> NDArray[np.uint8]:
    """[..., 4] the ramp's colours; what holds no row at all is left clear."""
    place = np.clip(logarithm / max(most, 1e-9), 0.0, 1.0) * (len(RAMP) - 1)
    shades = [np.interp(place, np.arange(len(RAMP)), RAMP[:, i]) for i in range(3)]
    return np.where(
        (logarithm > 0.0)[..., None], np.stack(shades, axis=-1), colours.PAPER[:3]
    ).astype(np.uint8)


def _wind_bounds(drawn: Drawn) -> rrb.VisualBounds2D:
    speeds = round(_fastest(drawn) / SPEED_BIN)
    wide = round(360.0 / ANGLE_BIN) * CELL
    return rrb.VisualBounds2D(
        x_range=[-30.0, wide + 35.0], y_range=[-8.0, speeds * _cell_height(speeds) + 30.0]
    )


def _cell_height(speeds: int) -> int:
    return max(1, round(TALL / speeds))


def _fastest(drawn: Drawn) -> float:
    """The end of the speed axis: whole m/s, one for training and test."""
    tables = (drawn.training, drawn.measured)
    values = np.concatenate([_finite(table, "wind_speed") for table in tables])
    return min(math.ceil(values.max() + SPEED_BIN) if len(values) else 1.0, FASTEST)


def _finite(table: pl.DataFrame, name: str) -> NDArray[np.float64]:
    values = display.column(table, name)
    return values[np.isfinite(values)]


def _singles(drawn: Drawn) -> tuple[Channel, ...]:
    """The paper's: velocities and actuators."""
    return channels.VELOCITY + tuple(a.channel for a in drawn.actuators)
