"""Colours, times, names and a light ground as Rerun takes them."""

from __future__ import annotations

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from shiplog.report import colours
from shiplog.report.viewer.comparison_data import TIMELINE

GROUND = list(colours.PAPER)


def instants(seconds: np.ndarray) -> rr.TimeColumn:
    """Seconds [n] as the recording's time, to the nearest nanosecond.

    Rerun 0.41 cuts what is below a nanosecond off an array of seconds: one instant of forty at
    10 Hz is then 1 ns early, and is no instant of what was logged by another call.
    """
    whole = np.rint(np.asarray(seconds, np.float64) * 1e9).astype("timedelta64[ns]")
    return rr.TimeColumn(TIMELINE, duration=whole)


def entity(*parts: str) -> str:
    """An entity path: names of voyages and models keep their spaces and slashes, escaped."""
    return rr.new_entity_path(list(parts))


def plot_background() -> rrb.archetypes.PlotBackground:
    return rrb.archetypes.PlotBackground(color=colours.PAPER, show_grid=False)


def labels(recording: rr.RecordingStream, path: str, places: list, names: list[str]) -> None:
    """Words on a chart, each centred below its place."""
    recording.log(
        path,
        rr.Points2D(
            places,
            labels=names,
            show_labels=True,
            colors=colours.TEXT,
            radii=rr.Radius.ui_points(0.0),
        ),
        static=True,
    )
