"""Everything along time: errors, states, actuators and the apparent wind."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
import polars as pl
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from shiplog.nomenclature import channels
from shiplog.report import colours
from shiplog.report.viewer import display, style, tracking
from shiplog.report.viewer.comparison_data import BAND
from shiplog.report.viewer.display import Drawn
from shiplog.report.viewer.style import entity

STATES = ("surge", "sway", "yaw_rate", "heading")  # drawn; where it was, the chart shows
LEGEND_ROOM = 0.22  # of the voyage, free at the end of plots with a legend
HALF_TURN = 180.0  # deg
LONG = 10_000  # instants: more than ten for each point of the widest plot
FITS_A_TITLE = 22  # letters after what stands in the longest one
SPREAD = ("_lowest", "_highest")  # of all seeds
CURVES: dict[str, tuple[str, ...]] = {  # column → its entity, in which the voyage comes second
    **{c.name: ("state", c.name) for c in channels.STATE},
    tracking.POSITION: ("error", "position"), tracking.HEADING: ("error", "heading"),
}  # fmt: skip


# Kind, rows, suffixes of its columns, names, colour, width.
Lines = tuple[str, pl.DataFrame, tuple[str, ...], list[str], colours.Colour, float]


@dataclass(frozen=True)
class Plot:
    """One axis along time: its title, its entity, from where to where it shows."""

    title: str
    origin: tuple[str, ...]
    reach: tuple[float, float] | None
    legend: bool = False


def blueprint(drawn: Drawn, voyage: str | None) -> rrb.Container | None:
    """Two columns of plots, each over the whole voyage: a linked time axis would not show it."""
    if voyage is None:
        return None
    of = pl.col("voyage") == voyage
    here = replace(drawn, simulated=drawn.simulated.filter(of), measured=drawn.measured.filter(of))
    columns = []
    for plots in plots_of(drawn, voyage, tracking.with_errors(here)):
        legends = any(plot.legend for plot in plots)
        axis = time_axis(drawn, voyage, LEGEND_ROOM if legends else 0.04)
        views = [
            rrb.TimeSeriesView(
                origin=entity(*plot.origin),
                name=plot.title,
                axis_x=axis,
                axis_y=None if plot.reach is None else rrb.ScalarAxis(range=plot.reach),
                plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=plot.legend),
                background=style.plot_background(),
            )
            for plot in plots
        ]
        columns.append(rrb.Vertical(*views))
    return rrb.Horizontal(*columns, column_shares=[1.25, 1.0][: len(columns)])


def plots_of(drawn: Drawn, voyage: str, errors: pl.DataFrame) -> list[list[Plot]]:
    """First how far each model is off and the states, then what acted on ship and models.

    errors   as `tracking.with_errors`
    """
    rows = shown(drawn, voyage, drawn.measured.filter(pl.col("voyage") == voyage))
    simulated = shown(drawn, voyage, errors.filter(pl.col("voyage") == voyage))
    titles = {c.name: c.label for c in channels.STATE if c.name in STATES}
    seeds = display.drawn_seeds(drawn)
    banded = [m for m in drawn.models if display.has_band(_bold(simulated, m, seeds[m]), "surge")]
    if banded:  # named once: a legend would hide a third of so flat a plot
        whose = f" of {', '.join(banded)}"
        titles["surge"] += ", pale lines: 90 % band" + whose * (len(whose) <= FITS_A_TITLE)
    first: list[Plot] = []
    if not simulated.is_empty():
        reach = tracking.position_range(simulated, rows)
        origin = ("error", voyage, "position")
        first.append(Plot("position error [m], dots: window starts", origin, reach))
        reach = tracking.heading_range(simulated)
        first.append(Plot("heading error [deg]", ("error", voyage, "heading"), reach))
    for name in STATES:
        reach = readable_range(rows, simulated, [name])
        if name == "heading":
            seam = compass_seam(drawn, voyage)
            reach = (seam - 2.0 * HALF_TURN - 8.0, seam + 8.0)
        first.append(Plot(titles[name], ("state", voyage, name), reach))
    second = [
        Plot(
            f"{_plural(kinds, names)} [{unit}]",
            ("actuator", voyage, group),
            readable_range(rows, simulated, names),
            legend=len(names) > 1,
        )
        for group, (kinds, unit, names) in actuator_groups(drawn).items()
    ]
    if drawn.has_wind:
        for c in channels.WIND:
            reach = readable_range(rows, simulated, [c.name])
            second.append(Plot(f"apparent {c.label}", ("wind", voyage, c.name), reach))
    return [first, second] if second else [first]


def _plural(kinds: list[str], names: list[str]) -> str:
    return ", ".join(kinds) if len(names) == 1 else ", ".join(f"{kind}s" for kind in kinds)


def time_axis(drawn: Drawn, voyage: str, after: float = 0.04) -> rrb.TimeAxis:
    """Over the whole voyage, or what is about a moment of it."""
    if (moment := drawn.moment) is None or moment.voyage != voyage:
        return whole_voyage(drawn.measured.filter(pl.col("voyage") == voyage), after)
    begin, end = moment.span
    return _span(begin, end + after * moment.window)


def shown(drawn: Drawn, voyage: str, table: pl.DataFrame) -> pl.DataFrame:
    """The rows that are on the time axis at first, which its other axis is made for."""
    if (moment := drawn.moment) is None or moment.voyage != voyage:
        return table
    near = table.filter(pl.col("time").is_between(*moment.span))
    return table if near.is_empty() else near


def compass_seam(drawn: Drawn, voyage: str) -> float:
    """Where headings begin anew, 180 or 360 deg: what the measured one crosses less often."""
    rows = drawn.measured.filter(pl.col("voyage") == voyage)
    heading = display.column(rows, "heading")
    crossings = {
        seam: int((np.abs(np.diff(on_compass(heading, seam))) > HALF_TURN).sum())
        for seam in (2.0 * HALF_TURN, HALF_TURN)
    }
    return min(crossings, key=lambda seam: crossings[seam])


def on_compass(heading: NDArray[np.float64], seam: float) -> NDArray[np.float64]:
    """A heading that counts on [deg], within the turn that ends at `seam`."""
    return (heading - seam) % (2.0 * HALF_TURN) + seam - 2.0 * HALF_TURN


def broken_at_seam(values: NDArray[np.float64], begins: NDArray[np.intp]) -> NDArray[np.intp]:
    """`begins`, and where a bearing [N] or [N, K] passes its seam, which is no jump."""
    step = np.abs(np.diff(values, axis=0)) > HALF_TURN
    return np.union1d(begins, np.flatnonzero(step if step.ndim == 1 else step.any(axis=1)) + 1)


def whole_voyage(rows: pl.DataFrame, after: float = 0.04) -> rrb.TimeAxis:
    """A time axis over all of these rows, which stays when another is zoomed.

    after    share of the voyage that is left free at its end, where the legend stands
    """
    time = display.column(rows, "time")
    length = float(np.ptp(time))
    return _span(float(np.min(time)) - 0.04 * length, float(np.max(time)) + after * length)


def _span(begin: float, end: float) -> rrb.TimeAxis:
    span = rrb.TimeRange(
        start=rrb.TimeRangeBoundary.absolute(seconds=begin),
        end=rrb.TimeRangeBoundary.absolute(seconds=end),
    )
    return rrb.TimeAxis(link="Independent", view_range=span)


def send(recording: rr.RecordingStream, drawn: Drawn) -> None:
    """Every channel of every voyage, whole columns at a time."""
    measured = drawn.measured
    simulated = tracking.with_errors(drawn)
    for voyage in drawn.voyages:
        _send_measured(recording, drawn, voyage, measured.filter(pl.col("voyage") == voyage))
        _send_simulated(recording, drawn, voyage, simulated.filter(pl.col("voyage") == voyage))
        if (moment := drawn.moment) is not None and moment.voyage == voyage:
            for plot in chain(*plots_of(drawn, voyage, simulated)):
                _mark(recording, plot, moment.seconds)


def _mark(recording: rr.RecordingStream, plot: Plot, seconds: float) -> None:
    """An upright line at the moment: a recording's cursor is at its beginning when it is opened
    again."""
    if plot.reach is None:
        return
    ends = np.array([[plot.reach[0]], [plot.reach[1]]])
    at = np.array([seconds, seconds + 1e-3])  # of two values at one instant only one is drawn
    path = entity(*plot.origin, "moment")
    send_lines(
        recording,
        path,
        at,
        ends,
        np.empty(0, dtype=np.intp),
        ["the moment (black)"],
        colours.TEXT,
        0.7,
    )


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
    seam = compass_seam(drawn, voyage)

    def line(
        path: str, channel: channels.Channel, colour: colours.Colour, name: str, width: float = 1.25
    ) -> None:
        values, breaks = display.column(rows, channel.name), begins
        if channel.name == "heading":
            values = on_compass(values, seam)
        if channel.circular:
            breaks = broken_at_seam(values, begins)
        send_lines(recording, path, time, values[:, None], breaks, [name], colour, width)

    for channel in channels.STATE:  # wide: visible under a model that is right
        path = entity("state", voyage, channel.name, "measured")
        line(path, channel, colours.MEASURED, "measured", 2.5)
    by_name = {actuator.name: actuator for actuator in drawn.actuators}
    for group, (_, _, names) in actuator_groups(drawn).items():
        for i, name in enumerate(names):
            path = entity("actuator", voyage, group, name)
            colour = colours.ACTUATORS[i % len(colours.ACTUATORS)]
            line(path, by_name[name].channel, colour, name.replace("_", " "))
    if drawn.has_wind:
        for channel in channels.WIND:
            line(entity("wind", voyage, channel.name), channel, colours.MEASURED, channel.label)


def _send_simulated(
    recording: rr.RecordingStream, drawn: Drawn, voyage: str, simulated: pl.DataFrame
) -> None:
    seeds = display.drawn_seeds(drawn)
    seam = compass_seam(drawn, voyage)
    for model, colour in colours.colours(drawn.models, drawn.extended).items():
        rollouts = simulated.filter(pl.col("model") == model)
        bold = _bold(simulated, model, seeds[model])
        spread = _spread(rollouts) if rollouts["seed"].n_unique() > 1 else None
        for name, parent in CURVES.items():
            lines: list[Lines] = [("simulated", bold, ("",), [model], colour, 1.25)]
            if display.has_band(bold, name):  # what the model itself doubts, not how training went
                lines.append(("band", bold, BAND, ["90 % band"] * 2, colours.faded(colour), 0.7))
            elif spread is not None:
                ends = ["lowest, highest seed"] * 2  # of one name: one line in a legend
                lines.append(("seeds", spread, SPREAD, ends, colours.faded(colour), 0.7))
            for kind, rows, suffixes, names, of, width in lines:
                values = np.column_stack([display.column(rows, name + end) for end in suffixes])
                begins = display.pieces(rows)
                if name == "heading":
                    values = on_compass(values, seam)
                    begins = broken_at_seam(values, begins)
                # drawn in order of names: what is pale before what was simulated
                path = entity(parent[0], voyage, *parent[1:], kind, model)
                time = display.column(rows, "time")
                send_lines(recording, path, time, values, begins, names, of, width)
    _send_window_starts(recording, voyage, simulated)


def _bold(simulated: pl.DataFrame, model: str, seed: int) -> pl.DataFrame:
    return simulated.filter(pl.col("model") == model, pl.col("seed") == seed)


def _spread(rollouts: pl.DataFrame) -> pl.DataFrame:
    """The lowest and the highest of all seeds at every instant."""
    names = list(CURVES)
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
    path = entity("error", voyage, "position", "window_starts")
    recording.log(
        path,
        rr.SeriesPoints(
            colors=colours.MEASURED,
            markers="Circle",
            marker_sizes=2.5,
            names="window starts (black)",
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
    colour: colours.Colour,
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
            # averaging over pixels would round off the peaks; of a long line each pixel's ends stay
            aggregation_policy="Off" if len(time) <= LONG else "MinMax",
        ),
        static=True,
    )
    columns = rr.Scalars.columns(scalars=values.ravel())
    recording.send_columns(
        path,
        indexes=[style.instants(time)],
        columns=columns.partition([count] * len(time)) if count > 1 else columns,
    )
