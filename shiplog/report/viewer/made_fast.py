"""Where a named line goes to, on the chart of tracks: a cross as long as its 90 % interval."""

from __future__ import annotations

import rerun as rr

from shiplog.report import colours
from shiplog.report.figures.chart import FARTHEST_POINT, MADE_FAST
from shiplog.report.viewer import chart, style
from shiplog.report.viewer.comparison_data import MadeFast
from shiplog.report.viewer.style import entity

Range = tuple[float, float]


def seen(ranges: list[Range], fast: MadeFast, size: float) -> list[Range]:
    """East and north ranges of tracks of this size, wider where the point is not too far off."""
    x0, y0 = fast.point
    near = [
        low - FARTHEST_POINT * size <= at <= high + FARTHEST_POINT * size
        for (low, high), at in zip(ranges, (y0, x0), strict=True)
    ]
    if not all(near):
        return ranges
    return [(min(low, at), max(high, at)) for (low, high), at in zip(ranges, (y0, x0), strict=True)]


def send(recording: rr.RecordingStream, voyage: str, fast: MadeFast, frame: chart.Frame) -> None:
    """The cross, and below it what it is."""
    recording.log(
        entity("track", voyage, "made_fast"),
        rr.LineStrips2D(
            [[(y, -x) for x, y in line] for line in fast.cross],
            colors=colours.NAMED_FORCE,
            radii=rr.Radius.ui_points(2.0),
            draw_order=34.0,
        ),
        static=True,
    )
    x, y = fast.point
    below = (y, -x + 0.2 * chart.LINE * frame.point)
    style.labels(recording, entity("track", voyage, "made_fast", "label"), [below], [MADE_FAST])
