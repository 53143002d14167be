"""A picture of a recording without any screen, for the README and for tests."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rerun.experimental import ViewerClient, ViewerState

from shiplog.exceptions import ShiplogError
from shiplog.report.viewer import native
from shiplog.report.viewer.comparison_data import TIMELINE

LOAD_TIMEOUT_S = 30.0  # s
DRAWN = 1.5  # s until a software renderer has drawn what it loaded


def screenshot(rrd: str | Path, png: str | Path, time_s: float | None = None) -> ViewerState:
    """Save what the viewer shows at first sight, at `time_s`, and return the viewer's state."""
    with headless() as viewer:
        viewer.open(str(native.existing(rrd)))
        end = time.monotonic() + LOAD_TIMEOUT_S
        while (state := viewer.get_state()).loading or not state.views:
            if time.monotonic() > end:
                raise ShiplogError(f"The viewer did not load {rrd} within {LOAD_TIMEOUT_S:g} s.")
            time.sleep(0.1)
        time.sleep(DRAWN)
        if time_s is not None:
            viewer.set_time(TIMELINE, duration=time_s, play_state="paused")
            time.sleep(DRAWN)
        png = Path(png).resolve()
        png.parent.mkdir(parents=True, exist_ok=True)
        viewer.save_screenshot(str(png))
        return viewer.get_state()


@contextmanager
def headless() -> Iterator[ViewerClient]:
    """A viewer without a window, ended whatever happens."""
    port = native.free_port()
    with tempfile.TemporaryFile() as output:
        process = native.start(["--headless", "--port", str(port)], output, supervised=True)
        try:
            native.wait_for(process, (port,), LOAD_TIMEOUT_S)
            yield ViewerClient(f"rerun+http://{native.HOST}:{port}/proxy")
        except (TimeoutError, ConnectionError):  # it never listened, or ended when it had to draw
            raise ShiplogError(
                f"The headless viewer did not start: {native.last_words(output)}",
                hint="it needs a Vulkan driver, such as the package mesa-vulkan-drivers.",
            ) from None
        finally:
            native.stop(process)
