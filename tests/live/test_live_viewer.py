"""What a watch sends to Rerun, and where the viewer listens."""

from __future__ import annotations

import numpy as np
import psutil
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from shiplog.live import viewer
from shiplog.live.alarm import Alarm, Suspect
from shiplog.live.error_now import Point
from shiplog.live.events import SegmentDone, as_json
from shiplog.live.health import Notice
from shiplog.live.viewer import TRACK, LiveView

NOON = 1_780_000_000_000_000_000


def point(number: int) -> Point:
    state = np.array([number, 1.0, 2.0 * number, 0.0, 0.1, 0.0])
    return Point(NOON + number * 10**9, 5.0, state, state + 1.0, 1.41, -2.0, 3.0, 4.0, True, False)


def test_events_become_a_recording(tmp_path):
    path = tmp_path / "watched.rrd"
    recording = rr.RecordingStream("shiplog")
    recording.save(path)
    view = LiveView(recording, "a run, watched")
    for number in range(TRACK + 5):
        view(point(number))
    view(SegmentDone(NOON, 1.5, 7.0, 0.1, "current"))
    alarm = Alarm(NOON, 9.0, 7.0, (Suspect("current", 9.5, NOON),), False, False)
    view(alarm)
    view(Notice(NOON, "silent", "wind", "<b>wind</b> is silent: nothing for 3.0 s."))
    assert len(view._measured) == TRACK  # bounded, however long the watch
    recording.flush()
    recording.disconnect()
    entities = {str(chunk.entity_path) for chunk in RrdReader(path).stream().to_chunks()}
    wanted = {"/error/position/m", "/error/heading/band", "/evidence/statistic", "/words",
              "/track/simulated"}  # fmt: skip
    assert wanted <= entities


def test_an_alarm_calls_itself_a_suspicion():
    alarm = Alarm(NOON, 9.0, 7.0, (Suspect("current", 9.5, NOON),), False, False)
    line = as_json(alarm)
    assert line is not None
    assert "suspicion, not a verdict" in line["sentence"] and "current" in line["sentence"]
    assert line["suspects"][0] == {
        "name": "current", "log_factor": 9.5, "began": "2026-05-28T20:26:40.0Z",
    }  # fmt: skip


@pytest.mark.viewer
def test_the_page_of_a_watch_is_served_to_this_machine_only(monkeypatch):
    """By the kernel's own table of who listens, as `ss -ltn` prints it."""
    shown: list[str] = []
    monkeypatch.setattr(viewer.webbrowser, "open", shown.append)
    view = viewer.opened("a run, watched", web=True)
    process = view.process
    assert process is not None and process.stdin is not None
    server = psutil.Process(process.pid)
    try:
        view(point(1))
        view.recording.flush()
        everyone = (psutil.Process(), server, *server.children(recursive=True))
        found = [c.laddr for one in everyone for c in one.net_connections("inet")
                 if c.status == psutil.CONN_LISTEN]  # fmt: skip
        assert len(found) >= 2 and {address.ip for address in found} == {"127.0.0.1"}
        assert shown[0].startswith("http://127.0.0.1:")
    finally:
        view.recording.disconnect()
        process.stdin.close()  # the viewer ends with it
        process.wait(20.0)
