"""What a diagnosis found: where it tells most on the chart, the missing force together with the
force of the named causes, and the error before and after."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl
import rerun as rr
import rerun.blueprint as rrb

from shiplog.nomenclature import channels
from shiplog.nomenclature.numbers import NINETY_SPREADS
from shiplog.report import colours
from shiplog.report.evaluation.text_table import inert
from shiplog.report.viewer import chart, display, forces, style, timeline, tracking, trajectory
from shiplog.report.viewer.comparison_data import ComparisonData
from shiplog.report.viewer.diagnosis_data import AFTER, BEFORE, Exhibit
from shiplog.report.viewer.display import Drawn
from shiplog.report.viewer.style import entity

LACKS = "model lacks (black)"  # a dark dot does not show on a dark legend
ROOM = 1.0  # sizes of the measured track that a simulated one is followed beyond it
AXIS_OF_CHANNEL = dict(zip((c.name for c in channels.VELOCITY), forces.FORCE_AXES, strict=True))
DRAWABLE = str.maketrans({  # Rerun's fonts lack these, and its headless viewer falls over them
    "ᵀ": "'", "ᵢ": "_i", "⁻": "^-", "₊": "_+", "₋": "_-", "∇": "grad ",
})  # fmt: skip
ACTING_COLOURS = (colours.NAMED_FORCE, colours.BLUE, colours.GREEN, colours.PURPLE)
CUT_OFF = 4.0  # times the middle error before: where the axis of errors ends at the latest


@dataclass(frozen=True)
class Pictured:
    """An exhibit ready to be drawn.

    tracks      its voyages, and of each the window that tells most as a voyage of its own
    models      what `tracks` calls BEFORE and, where there is one, AFTER
    closeups    voyage → the name of that window
    components  voyage, time, part, surge, sway, yaw [N, N m]: as ComparisonData.forces
    errors      voyage, time, seconds, before, after: root mean square
    position_errors  as `tracking.with_errors`
    """

    exhibit: Exhibit
    tracks: Drawn
    models: dict[str, str]
    closeups: dict[str, str]
    components: pl.DataFrame
    errors: pl.DataFrame
    position_errors: pl.DataFrame

    @property
    def voyages(self) -> list[str]:
        """The most telling one first."""
        return list(dict.fromkeys((*self.closeups, *self.exhibit.voyages)))


def pictured(exhibit: Exhibit) -> Pictured:
    """Tables as the other views take them."""
    models = {BEFORE: exhibit.run or ("before" if exhibit.extended else "the model")}
    if exhibit.extended:
        models[AFTER] = f"with {_spoken(exhibit.extended)}"
    closeups, measured, tracks = {}, [], []
    datums = dict(exhibit.datums)
    for row in exhibit.telling.to_dicts():
        begin, end = row["time"], row["time"] + row["seconds"]
        name = f"{row['voyage']}, {begin:.0f} to {end:.0f} s"
        of, within = pl.col("voyage") == row["voyage"], pl.col("time").is_between(begin, end)
        closeups[row["voyage"]] = name
        if row["voyage"] in datums:
            datums[name] = datums[row["voyage"]]
        measured.append(exhibit.measured.filter(of, within).with_columns(voyage=pl.lit(name)))
        tracks.append(
            exhibit.tracks.filter(of, pl.col("window") == row["window"]).with_columns(
                voyage=pl.lit(name)
            )
        )
    compared = ComparisonData(
        title=exhibit.title,
        ship_length=exhibit.ship_length,
        ship_breadth=exhibit.ship_breadth,
        ship_outline=exhibit.ship_outline,
        banks=exhibit.banks,
        extended=(models[AFTER],) if AFTER in models else (),
        datums=datums,
        current=exhibit.current,
        made_fast=exhibit.made_fast,
        actuators=(),
        has_wind="wind_speed" in exhibit.measured.columns,
        measured=pl.concat([*measured, exhibit.measured]),
        simulated=pl.concat([*tracks, exhibit.tracks]).with_columns(
            pl.col("model").replace(models), seed=pl.lit(0), d=pl.lit(0.0)
        ),
        training=exhibit.measured.clear(),
        summary=exhibit.report,
    )
    # L is over seconds: its value per second has a root that reads as a speed
    root = [(pl.col(n) / pl.col("seconds")).sqrt().alias(n) for n in (BEFORE, AFTER)]
    drawn = display.drawn(compared)
    return Pictured(
        exhibit, drawn, models, closeups, _components(exhibit),
        exhibit.errors.with_columns(root), tracking.with_errors(drawn),
    )  # fmt: skip


def _spoken(names: tuple[str, ...]) -> str:
    """Causes in words; what one of them is of stands in brackets: "clock offset (gnss)"."""
    spoken = [name.replace("_", " ").partition(":") for name in names]
    return " and ".join(f"{cause} ({of})" if of else cause for cause, _, of in spoken)


def _components(exhibit: Exhibit) -> pl.DataFrame:
    """A row an instant and part: what the model lacks, the ends of its band, what was named."""
    part = {
        LACKS: pl.col("force"),
        "low": pl.col("force") - NINETY_SPREADS * pl.col("sd"),
        "high": pl.col("force") + NINETY_SPREADS * pl.col("sd"),
        "named": pl.col("named"),
    }
    return pl.concat(
        exhibit.residual.with_columns(part=pl.lit(name), value=value)
        .pivot("channel", index=["voyage", "time", "part"], values="value")
        .rename(AXIS_OF_CHANNEL)
        .select("voyage", "time", "part", *forces.FORCE_AXES)
        .sort("time", maintain_order=True)
        for name, value in part.items()
    )


# --- where each picture stands --------------------------------------------------------------------


def blueprint(picture: Pictured) -> list[rrb.Container]:
    """A tab a voyage: chart and report left, along time right."""
    return [_tab(picture, voyage) for voyage in picture.voyages[: display.MOST_TABS]]


def _tab(picture: Pictured, voyage: str) -> rrb.Container:
    names = [_in_words(picture, voyage), "Whole voyage"]
    charts = [picture.closeups.get(voyage), voyage]
    left = rrb.Vertical(
        rrb.Tabs(
            *(_chart(picture, c, n) for c, n in zip(charts, names, strict=True) if c),
            active_tab=0,
        ),
        rrb.TextDocumentView(origin="/report", name="Report"),
        row_shares=[1.55, 1.0],
    )
    right: list[rrb.View] = []
    if (picture.components["voyage"] == voyage).any():
        right += [_force(picture, voyage, axis) for axis in forces.FORCE_AXES]
    if (picture.errors["voyage"] == voyage).any():
        right += [_positions(picture, voyage), _errors(picture, voyage)]
    if (picture.exhibit.acting["voyage"] == voyage).any():
        right.append(_since_when(picture, voyage))
    if not right:  # too short for either
        return rrb.Vertical(left, name=voyage)
    return rrb.Horizontal(left, rrb.Vertical(*right), column_shares=[1.0, 1.45], name=voyage)


def _in_words(picture: Pictured, voyage: str) -> str:
    """The window's heading: why this one is shown, and when it was."""
    _, unit = trajectory.in_chart_units(picture.tracks)
    what = "Most improved" if voyage in picture.exhibit.improved else "Largest error"
    when = picture.closeups.get(voyage, "").removeprefix(f"{voyage}, ")
    return f"{what}, {when} [{unit}]"


def _chart(picture: Pictured, voyage: str, name: str) -> rrb.View:
    tracks, _ = trajectory.in_chart_units(picture.tracks)
    frame = trajectory.framed(tracks, voyage, ROOM, chart.FLAT)
    return rrb.Spatial2DView(
        origin=entity("track", voyage),
        name=name,
        background=style.GROUND,
        visual_bounds=rrb.VisualBounds2D(x_range=frame.x_range, y_range=frame.y_range),
    )


def _force(picture: Pictured, voyage: str, axis: str) -> rrb.View:
    what, _, positive = forces.FORCE_AXES[axis]
    name, factor = forces.unit(picture.components, axis)
    return rrb.TimeSeriesView(
        origin=entity("unexplained", voyage, axis),
        name=f"{what} [{name}], positive {positive}",
        axis_x=_whole_voyage(picture, voyage),
        axis_y=rrb.ScalarAxis(range=forces.readable_range(picture.components, axis, factor)),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=axis == "surge"),
        background=style.plot_background(),
    )


def _positions(picture: Pictured, voyage: str) -> rrb.View:
    errors = picture.position_errors.filter(pl.col("voyage") == voyage)
    measured = picture.tracks.measured.filter(pl.col("voyage") == voyage)
    return rrb.TimeSeriesView(
        origin=entity("position_errors", voyage),
        name="position error in each held-out window [m]",
        axis_x=_whole_voyage(picture, voyage),
        axis_y=rrb.ScalarAxis(range=tracking.position_range(errors, measured)),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=False),
        background=style.plot_background(),
    )


def _errors(picture: Pictured, voyage: str) -> rrb.View:
    return rrb.TimeSeriesView(
        origin=entity("errors", voyage),
        name="velocity error of each held-out window, root mean square [cm/s, or 0.1 deg/s]",
        axis_x=_whole_voyage(picture, voyage),
        axis_y=rrb.ScalarAxis(range=error_range(picture.errors)),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop, visible=False),
        background=style.plot_background(),
    )


def _since_when(picture: Pictured, voyage: str) -> rrb.View:
    return rrb.TimeSeriesView(
        origin=entity("acting", voyage),
        name="probability that each named cause acts",
        axis_x=_whole_voyage(picture, voyage),
        axis_y=rrb.ScalarAxis(range=(-0.04, 1.08)),
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
        background=style.plot_background(),
    )


def _whole_voyage(picture: Pictured, voyage: str) -> rrb.TimeAxis:
    measured = picture.tracks.measured.filter(pl.col("voyage") == voyage)
    return timeline.whole_voyage(measured, after=0.24)


def error_range(errors: pl.DataFrame) -> tuple[float, float]:
    """From zero to the largest; a rollout that diverged does not flatten the others."""
    values = np.concatenate([display.column(errors, name) for name in (BEFORE, AFTER)])
    middle = float(np.nanmedian(display.column(errors, BEFORE)))
    most = max(min(float(np.nanmax(values)), CUT_OFF * middle), 1e-3)
    return -0.04 * most, 1.08 * most


# --- what is sent ---------------------------------------------------------------------------------


def send(recording: rr.RecordingStream, picture: Pictured) -> None:
    """Charts, forces, errors and the report."""
    trajectory.send(recording, picture.tracks, ROOM, chart.FLAT)
    for voyage in picture.voyages:
        _send_forces(recording, picture, voyage)
        _send_positions(recording, picture, voyage)
        _send_errors(recording, picture, voyage)
        _send_acting(recording, picture, voyage)
    text = picture.exhibit.report.translate(DRAWABLE)
    recording.log(
        "/report", rr.TextDocument(inert(text), media_type=rr.MediaType.MARKDOWN), static=True
    )


def _send_forces(recording: rr.RecordingStream, picture: Pictured, voyage: str) -> None:
    rows = picture.components.filter(pl.col("voyage") == voyage)
    lacks, low, high, named = (
        rows.filter(pl.col("part") == part) for part in (LACKS, "low", "high", "named")
    )
    time, begins = display.column(lacks, "time"), display.pieces(lacks)
    if not len(time):
        return
    ends, none = time[[0, -1]], np.empty(0, dtype=np.intp)
    for axis in forces.FORCE_AXES:
        _, factor = forces.unit(picture.components, axis)
        band = np.column_stack([display.column(end, axis) for end in (low, high)])
        # drawn in order of names: zero, the band, what the model lacks, what was named
        for name, at, values, cuts, labels, colour, width in (
            ("axis", ends, np.zeros((2, 1)), none, ["zero"], colours.ZERO, 1.0),
            ("band", time, band, begins, ["90 % band"] * 2, colours.faded(colours.MEASURED), 0.7),
            ("lacks", time, display.column(lacks, axis)[:, None], begins, [LACKS], colours.MEASURED,
             1.5),
            ("named", time, display.column(named, axis)[:, None], begins,
             [f"force of {_spoken(picture.exhibit.named)}"], colours.NAMED_FORCE, 1.5),
        ):  # fmt: skip
            if np.isfinite(values).any():
                timeline.send_lines(
                    recording, entity("unexplained", voyage, axis, name), at, values / factor,
                    cuts, labels, colour, width,
                )  # fmt: skip


def _colours(picture: Pictured) -> dict[str, colours.Colour]:
    return colours.colours(list(picture.models.values()), picture.tracks.extended)


def _send_positions(recording: rr.RecordingStream, picture: Pictured, voyage: str) -> None:
    """In each window from nought, at the start that both models share."""
    rows = picture.position_errors.filter(pl.col("voyage") == voyage)
    for model, colour in _colours(picture).items():
        of = rows.filter(pl.col("model") == model)
        timeline.send_lines(
            recording, entity("position_errors", voyage, model), display.column(of, "time"),
            display.column(of, tracking.POSITION)[:, None], display.pieces(of), [model], colour,
            1.5,
        )  # fmt: skip


def _send_errors(recording: rr.RecordingStream, picture: Pictured, voyage: str) -> None:
    """A level line a window."""
    rows = picture.errors.filter(pl.col("voyage") == voyage)
    begin = display.column(rows, "time")
    time = np.column_stack((begin, begin + display.column(rows, "seconds"))).ravel()
    of = _colours(picture)
    for name, model in picture.models.items():
        values = np.repeat(display.column(rows, name), 2)
        if np.isfinite(values).any():
            timeline.send_lines(
                recording, entity("errors", voyage, model), time, values[:, None],
                np.arange(2, len(time), 2), [model], of[model], 3.0,
            )  # fmt: skip


def _send_acting(recording: rr.RecordingStream, picture: Pictured, voyage: str) -> None:
    """A line a named cause."""
    rows = picture.exhibit.acting.filter(pl.col("voyage") == voyage)
    for number, cause in enumerate(rows["cause"].unique(maintain_order=True)):
        own = rows.filter(pl.col("cause") == cause)
        timeline.send_lines(
            recording, entity("acting", voyage, cause), display.column(own, "time"),
            display.column(own, "probability")[:, None], np.empty(0, dtype=np.intp),
            [_spoken((cause,))], ACTING_COLOURS[number % len(ACTING_COLOURS)], 2.0,
        )  # fmt: skip
