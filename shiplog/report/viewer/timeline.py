"""Everything along time: the error, the six states, the actuators and the apparent wind."""

from __future__ import annotations

import math

import numpy as np
import polars as pl
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from shiplog.nomenclature import channels
from shiplog.report.viewer import display, style
from shiplog.report.viewer.comparison_data import BAND
from shiplog.report.viewer.display import Drawn
from shiplog.report.viewer.style import entity

POSITION_TITLES = {"x0": "north x₀ [m]", "y0": "east y₀ [m]"}  # x₀ alone says little
IN_THE_FIRST_COLUMN = ("surge", "sway", "yaw_rate", "heading")  # the others are one column on


def blueprint(drawn: Drawn, voyage: str | None) -> rrb.Container | None:
    """Two columns of plots, each over the whole voyage: a linked time axis would not show it."""
    if voyage is None:
        return None
    rows = drawn.measured.filter(pl.col("voyage") == voyage)
    whole = whole_voyage(rows)
    simulated = drawn.simulated.filter(pl.col("voyage") == voyage)

    def plot(
        name: str, *origin: str, legend: bool = False, shows: list[str] | None = None
    ) -> rrb.View:
        reach = readable_range(rows, simulated, shows) if shows else None
        return rrb.TimeSeriesView(
            origin=entity(*origin),
            name=name,
            axis_x=whole,
            axis_y=None if reach is None else rrb.ScalarAxis(range=reach),
            plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=legend),
            background=style.plot_background(),
        )

    seeds = display.drawn_seeds(drawn)
    banded = [m for m in drawn.models if display.has_band(_bold(simulated, m, seeds[m]), "surge")]
    titles = {c.name: POSITION_TITLES.get(c.name, c.label) for c in channels.STATE}
    if banded:  # named once: a legend would hide a third of so flat a plot
        titles["surge"] += f", pale lines: 90 % band of {', '.join(banded)}"
    states = {
        name: plot(title, "state", voyage, name, shows=[name]) for name, title in titles.items()
    }
    first = [plot("error: log10(1 + d), dots where a window starts", "error", voyage, legend=True)]
    first += [states.pop(name) for name in IN_THE_FIRST_COLUMN]
    second: list[rrb.View | rrb.Container] = [rrb.Horizontal(*states.values())]
    second += [
        plot(f"{'s, '.join(kinds)}s [{unit}]", "actuator", voyage, group, legend=True, shows=names)
        for group, (kinds, unit, names) in actuator_groups(drawn).items()
    ]
    if drawn.has_wind:
        second += [
            plot(f"apparent {c.label}", "wind", voyage, c.name, shows=[c.name])
            for c in channels.WIND
        ]
    return rrb.Horizontal(
        rrb.Vertical(*first, row_shares=[1.15, 0.95, 0.95, 0.95, 1.1]), rrb.Vertical(*second)
    )


def whole_voyage(rows: pl.DataFrame, after: float = 0.04) -> rrb.TimeAxis:
    """A time axis over all of these rows, which stays when another is zoomed.

    after    share of the voyage that is left free at its end, where the legend stands
    """
    time = display.column(rows, "time")
    before = 0.04 * float(np.ptp(time))
    whole = rrb.TimeRange(
        start=rrb.TimeRangeBoundary.absolute(seconds=float(np.min(time)) - before),
        end=rrb.TimeRangeBoundary.absolute(seconds=float(np.max(time) + after * np.ptp(time))),
    )
    return rrb.TimeAxis(link="Independent", view_range=whole)


def send(recording: rr.RecordingStream, drawn: Drawn) -> None:
    """Every channel of every voyage, whole columns at a time."""
    measured = drawn.measured
    simulated = drawn.simulated
    for voyage in drawn.voyages:
        _send_measured(recording, drawn, voyage, measured.filter(pl.col("voyage") == voyage))
        _send_simulated(recording, drawn, voyage, simulated.filter(pl.col("voyage") == voyage))


def readable_range(
    measured: pl.DataFrame, simulated: pl.DataFrame, names: list[str]
) -> tuple[float, float] | None:
    """An axis that shows what was measured large, and a model that diverges only in part."""
    real = np.concatenate([display.column(measured, name) for name in names])
    if not np.isfinite(real).any():
        return None
    low, high = float(np.nanmin(real)), float(np.nanmax(real))
    room = 0.6 * max(high - low, 1e-3)
    drawn = [name + end for name in names for end in ("", *BAND)]
    models = [display.column(simulated, n) for n in drawn if n in simulated.columns]
    every = np.concatenate([real, *models])
    low, high = (
        max(low - room, float(np.nanmin(every))),
        min(high + room, float(np.nanmax(every))),
    )
    low, high = with_two_labels(low, max(high, low + 1e-3))
    margin = 0.05 * (high - low)
    return low - margin, high + margin


def with_two_labels(low: float, high: float) -> tuple[float, float]:
    """The range widened, unless by much, until two of the powers of ten that Rerun labels are in.

    A plot of this height has room for some seven labels, so finer steps stay without any.
    """
    step = 10.0 ** math.ceil(math.log10((high - low) / 7.0))
    wide = (low, high)
    while math.floor(wide[1] / step) - math.ceil(wide[0] / step) < 1:
        down, up = (math.ceil(wide[0] / step) - 1) * step, (math.floor(wide[1] / step) + 1) * step
        wide = (down, wide[1]) if wide[0] - down < up - wide[1] else (wide[0], up)
    return wide if wide[1] - wide[0] <= 2.0 * (high - low) else (low, high)


def actuator_groups(drawn: Drawn) -> dict[str, tuple[list[str], str, list[str]]]:
    """Actuators by unit, as plots share an axis: entity → kinds, display unit, names."""
    groups: dict[str, tuple[list[str], str, list[str]]] = {}
    for actuator in drawn.actuators:
        unit = {"rad": "deg"}.get(actuator.unit, actuator.unit)
        group = {"rad": "angle", "rev/s": "revolutions"}.get(actuator.unit, "setting")
        kinds, _, names = groups.setdefault(group, ([], unit, []))
        names.append(actuator.name)
        if actuator.kind not in kinds:
            kinds.append(actuator.kind)
    return groups


def _send_measured(
    recording: rr.RecordingStream, drawn: Drawn, voyage: str, rows: pl.DataFrame
) -> None:
    time, begins = display.column(rows, "time"), display.pieces(rows)

    def line(
        path: str, channel: channels.Channel, colour: style.Colour, name: str, width: float = 1.25
    ) -> None:
        values = display.column(rows, channel.name)
        breaks = begins
        if channel.circular and channel.name != "heading":  # a bearing passing north is no jump
            jumps = np.flatnonzero(np.abs(np.diff(values)) > 180.0) + 1
            breaks = np.union1d(begins, jumps)
        send_lines(recording, path, time, values[:, None], breaks, [name], colour, width)

    for channel in channels.STATE:
        path = entity("state", voyage, channel.name, "measured")
        line(path, channel, style.MEASURED, "measured", 2.5)  # visible under a model that is right
    by_name = {actuator.name: actuator for actuator in drawn.actuators}
    for group, (_, _, names) in actuator_groups(drawn).items():
        for i, name in enumerate(names):
            path = entity("actuator", voyage, group, name)
            colour = style.ACTUATOR_COLOURS[i % len(style.ACTUATOR_COLOURS)]
            line(path, by_name[name].channel, colour, name.replace("_", " "))
    if drawn.has_wind:
        for channel in channels.WIND:
            line(entity("wind", voyage, channel.name), channel, style.MEASURED, channel.label)


def _send_simulated(
    recording: rr.RecordingStream, drawn: Drawn, voyage: str, simulated: pl.DataFrame
) -> None:
    seeds = display.drawn_seeds(drawn)
    simulated = simulated.with_columns(d=(1.0 + pl.col("d")).log10())
    curves: list[tuple[str, tuple[str, ...]]] = [
        (c.name, ("state", voyage, c.name)) for c in channels.STATE
    ]
    curves.append(("d", ("error", voyage)))
    for model, colour in style.colours(drawn.models).items():
        rollouts = simulated.filter(pl.col("model") == model)
        bold = _bold(simulated, model, seeds[model])
        time, begins = display.column(bold, "time"), display.pieces(bold)
        spread = _spread(rollouts) if rollouts["seed"].n_unique() > 1 else None
        for name, parent in curves:
            values = display.column(bold, name)[:, None]
            path = entity(*parent, "simulated", model)
            send_lines(recording, path, time, values, begins, [model], colour, 1.25)
            if display.has_band(bold, name):  # what the model itself doubts, not how training went
                rows, ends, kind, thin = bold, BAND, "band", "90 % band"
            elif spread is not None:
                rows, ends, kind, thin = spread, SPREAD, "seeds", "lowest, highest seed"
            else:
                continue
            send_lines(
                recording,
                entity(*parent, kind, model),  # drawn in order of names: before simulated
                display.column(rows, "time"),
                np.column_stack([display.column(rows, name + end) for end in ends]),
                display.pieces(rows),
                [thin] * 2,  # of one name: one line in the legend
                style.faded(colour),
                0.7,
            )
    _send_window_starts(recording, voyage, simulated)


def _bold(simulated: pl.DataFrame, model: str, seed: int) -> pl.DataFrame:
    return simulated.filter(pl.col("model") == model, pl.col("seed") == seed)


SPREAD = ("_lowest", "_highest")


def _spread(rollouts: pl.DataFrame) -> pl.DataFrame:
    """The lowest and the highest of all seeds at every instant."""
    names = [*(c.name for c in channels.STATE), "d"]
    return (
        rollouts.group_by("window", "time")
        .agg(
            pl.col(names).min().name.suffix(SPREAD[0]),
            pl.col(names).max().name.suffix(SPREAD[1]),
        )
        .sort("window", "time")
    )


def _send_window_starts(
    recording: rr.RecordingStream, voyage: str, simulated: pl.DataFrame
) -> None:
    starts = simulated.group_by("window").agg(pl.col("time").min()).sort("time")
    time = starts["time"].unique(maintain_order=True).to_numpy()
    if not len(time):
        return
    path = entity("error", voyage, "window_starts")
    recording.log(
        path,
        rr.SeriesPoints(
            colors=style.MEASURED, markers="Circle", marker_sizes=2.5, names="window starts"
        ),
        static=True,
    )
    recording.send_columns(
        path,
        indexes=[style.instants(time)],
        columns=rr.Scalars.columns(scalars=np.zeros(len(time))),
    )


def send_lines(
    recording: rr.RecordingStream,
    path: str,
    time: NDArray[np.float64],
    values: NDArray[np.float64],
    begins: NDArray[np.intp],
    names: list[str],
    colour: style.Colour,
    width: float,
) -> None:
    """Lines of values [N, K], with a row of NaN before each of `begins`, which breaks them."""
    if not len(time):
        return
    between = (time[begins - 1] + time[begins]) / 2.0
    time = np.insert(time, begins, between)
    values = np.insert(values, begins, np.nan, axis=0)
    count = values.shape[1]
    recording.log(
        path,
        rr.SeriesLines(
            colors=[colour] * count,
            widths=[width] * count,
            names=names,
            aggregation_policy="Off",  # averaging over pixels would round off the peaks
        ),
        static=True,
    )
    columns = rr.Scalars.columns(scalars=values.ravel())
    recording.send_columns(
        path,
        indexes=[style.instants(time)],
        columns=columns.partition([count] * len(time)) if count > 1 else columns,
    )
