"""A watch in Rerun: the track, the errors in their bands, the evidence against its threshold.

The viewer is a process of its own, on this machine alone, and forgets the oldest part of what it
was sent beyond VIEWER_MEMORY: a watch of weeks does not fill it. One that is closed does not end
the watch.
"""

from __future__ import annotations

import logging
import tempfile
import webbrowser
from subprocess import Popen
from typing import IO
from urllib.parse import quote

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from shiplog.live.alarm import Alarm
from shiplog.live.error_now import Point
from shiplog.live.events import Event, SegmentDone, sentence
from shiplog.live.health import Notice
from shiplog.report import colours
from shiplog.report.viewer import native, style
from shiplog.report.viewer.comparison_data import TIMELINE

log = logging.getLogger(__name__)

VIEWER_MEMORY = "500MB"
PATIENCE_S = 30.0  # s: the first start on a slow disk
TRACK = 600  # points that are drawn of each track
SAFE_LEVEL = rr.TextLogLevel.INFO
MEASURED, SIMULATED = colours.TEXT, (0x1F, 0x77, 0xB4)


class LiveView:
    """Events of one watch as a Rerun recording.

    recording   where they are sent
    process     the viewer, which ends when nobody holds it any more; None of a file
    """

    def __init__(
        self, recording: rr.RecordingStream, title: str, process: Popen[bytes] | None = None
    ) -> None:
        self.recording, self.process = recording, process
        self._measured: list[tuple[float, float]] = []
        self._simulated: list[tuple[float, float]] = []
        recording.send_recording_name(title)
        recording.send_blueprint(blueprint())

    def __call__(self, event: Event) -> None:
        """Draw an event; points whose rows may still change are drawn, too, and drawn over."""
        if isinstance(event, Point):
            self._point(event)
        elif isinstance(event, SegmentDone):
            self._at(event.time)
            self.recording.log("evidence/statistic", rr.Scalars(event.statistic))
            self.recording.log("evidence/threshold", rr.Scalars(event.threshold))
        elif isinstance(event, Alarm):
            self._at(event.time)
            self.recording.log("words", rr.TextLog(sentence(event), level=rr.TextLogLevel.ERROR))
        elif isinstance(event, Notice):
            self._at(event.time)
            level = SAFE_LEVEL if event.over else rr.TextLogLevel.WARN
            self.recording.log("words", rr.TextLog(event.sentence, level=level))

    def _at(self, time: int) -> None:
        self.recording.set_time(TIMELINE, timestamp=np.datetime64(time, "ns"))

    def _point(self, point: Point) -> None:
        self._at(point.time)
        for name, value in (
            ("error/position/m", point.position_m), ("error/position/band", point.band_m),
            ("error/heading/deg", abs(point.heading_deg)), ("error/heading/band", point.band_deg),
        ):  # fmt: skip
            if value is not None and np.isfinite(value):
                self.recording.log(name, rr.Scalars(value))
        for track, state, path, colour in (
            (self._measured, point.measured, "track/measured", MEASURED),
            (self._simulated, point.simulated, "track/simulated", SIMULATED),
        ):
            track.append((float(state[2]), -float(state[0])))  # east to the right, north up
            del track[:-TRACK]
            self.recording.log(path, rr.Points2D(track, colors=colour))


def blueprint() -> rrb.Blueprint:
    """The track left, time right, words below."""
    ground = style.plot_background()
    plots = [
        rrb.TimeSeriesView(origin=origin, name=name, background=ground)
        for origin, name in (
            ("error/position", "position error, and its band [m]"),
            ("error/heading", "heading error, and its band [deg]"),
            ("evidence", "evidence of a change, and the threshold [nats]"),
        )
    ]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial2DView(origin="track", name="track, measured and simulated"),
            rrb.Vertical(*plots, rrb.TextLogView(origin="words", name="alarms and health")),
        ),
        collapse_panels=True,
    )


def opened(title: str, web: bool) -> LiveView:
    """A view in the native viewer, or in a browser. Raises ShiplogError where none starts."""
    port = native.free_port()
    arguments = ["--port", str(port), "--memory-limit", VIEWER_MEMORY]
    page = native.free_port() if web else 0
    if web:
        arguments = [
            "--serve-web", "--web-viewer-port", str(page), "--port", str(port),
            "--server-memory-limit", VIEWER_MEMORY,
        ]  # fmt: skip
    output: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  # it is the process's
    process = native.start(arguments, output, supervised=True)
    recording = rr.RecordingStream("shiplog")
    try:
        native.wait_for(process, (port, page) if web else (port,), PATIENCE_S)
        address = f"rerun+http://{native.HOST}:{port}/proxy"
        recording.connect_grpc(address)
    except (TimeoutError, RuntimeError) as error:
        raise native.not_started(output) from error
    output.close()  # the viewer writes on: only its last words before a failure are read
    if web:
        url = f"http://{native.HOST}:{page}/?url={quote(address, safe=':/')}"
        log.warning("the watch is shown at %s", url)
        webbrowser.open(url)
    return LiveView(recording, title, process)
