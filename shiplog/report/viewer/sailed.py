"""A simulation as a Rerun recording: its path, its states with their band, and its actuators."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import rerun as rr
import rerun.blueprint as rrb

from shiplog.nomenclature.channels import STATE, Channel
from shiplog.report import colours
from shiplog.report.viewer import recording as recordings
from shiplog.report.viewer import style
from shiplog.report.viewer.comparison_data import BAND, DrawnActuator
from shiplog.ship_profile.profile import Profile


def write(band: pl.DataFrame, title: str, profile: Profile, path: Path) -> None:
    """`band`: time, the states with _low and _high, the actuators. Raises ShiplogError."""
    driven = tuple(DrawnActuator(a.name, a.kind, a.si_unit).channel for a in profile.actuators)
    channels = (*STATE, *driven)
    charts = [rrb.TimeSeriesView(origin=f"/{c.name}", name=c.label) for c in channels]
    track = rrb.Spatial2DView(origin="/track", name="track [m], x₀ upwards")
    screen = recordings.screen([rrb.Horizontal(
        track, rrb.Grid(*charts, grid_columns=2), column_shares=[1.0, 1.45], name=title
    )])  # fmt: skip
    with recordings.whole(title, screen, path) as recording:
        # y points down in a 2D view: a place is drawn at (y₀, -x₀)
        strip = np.stack((band["y0"].to_numpy(), -band["x0"].to_numpy()), -1)
        line = rr.LineStrips2D([strip], colors=[colours.MODELS[0]])
        recording.log("/track/simulated", line, static=True)
        time = rr.TimeColumn(style.TIMELINE, duration=band["time"].to_numpy())
        for channel in channels:
            _send(recording, band, channel, time)


def _send(
    recording: rr.RecordingStream, band: pl.DataFrame, channel: Channel, time: rr.TimeColumn
) -> None:
    for name in (channel.name, *(channel.name + end for end in BAND)):
        if name not in band.columns:
            continue
        values = band[name].cast(pl.Float64).fill_null(float("nan")).to_numpy()
        entity = f"/{channel.name}/{name}"
        shade = colours.MODELS[0] if name == channel.name else colours.TRAINING
        recording.log(entity, rr.SeriesLines(colors=[shade], names=[name]), static=True)
        recording.send_columns(
            entity, [time], rr.Scalars.columns(scalars=values * channel.to_display)
        )
