"""Sets the time cursor of a viewer that runs: a recording cannot hold it."""

from __future__ import annotations

import time

from rerun.experimental import ViewerClient, ViewerState

from shiplog.report.viewer.comparison_data import TIMELINE

LOAD_TIMEOUT_S = 30.0  # s
ASK_AGAIN = 0.1  # s


def address(host: str, port: int) -> str:
    return f"rerun+http://{host}:{port}/proxy"


def loaded(viewer: ViewerClient) -> ViewerState | None:
    """Its state once a recording is there and laid out; None where that takes too long."""
    end = time.monotonic() + LOAD_TIMEOUT_S
    while (state := viewer.get_state()).loading or not state.views:
        if time.monotonic() > end:
            return None
        time.sleep(ASK_AGAIN)
    return state


def seek(viewer: ViewerClient, time_s: float) -> None:
    """Put the cursor at that second, and leave it there."""
    viewer.set_time(TIMELINE, duration=time_s, play_state="paused")
