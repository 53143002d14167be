"""A picture of a recording without any screen, for the README and for tests."""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from rerun.experimental import ViewerClient, ViewerState

from shiplog.exceptions import ShiplogError
from shiplog.machine import child
from shiplog.report.viewer import control, native

DRAWN = 1.5  # s until a software renderer has drawn what it loaded


def screenshot(
    rrd: str | Path, png: str | Path, time_s: float | None = None, drawn: float = DRAWN
) -> ViewerState:
    """Save what the viewer shows at first sight, at `time_s`, and return the viewer's state.

    drawn   s that the viewer is given to draw
    """
    with headless() as viewer:
        viewer.open(str(native.existing(rrd)))
        if control.loaded(viewer) is None:
            raise ShiplogError(
                f"The viewer did not load {rrd} within {control.LOAD_TIMEOUT_S:g} s."
            )
        time.sleep(drawn)
        if time_s is not None:
            control.seek(viewer, time_s)
            time.sleep(drawn)
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
            native.wait_for(process, (port,), control.LOAD_TIMEOUT_S)
            yield ViewerClient(control.address(native.HOST, port))
        except (TimeoutError, ConnectionError):  # it never listened, or ended when it had to draw
            raise _why(output) from None
        finally:
            child.stop(process)


def _why(output: IO[bytes]) -> ShiplogError:
    """What ended the viewer. Without a window it ends at a letter that its font lacks; with one,
    and in a browser, it draws a box."""
    output.seek(0)
    said = output.read().decode(errors="replace")
    if lacking := re.search(r'No glyph for "(.+?)"', said):
        return ShiplogError(
            f"The headless viewer has no letter {lacking[1]!r}, which a name or text has.",
            hint="open the recording in the viewer, which draws a box instead, or rename it.",
        )
    return ShiplogError(
        f"The headless viewer did not start: {child.last_words(output)}",
        hint="it needs a Vulkan driver, such as the package mesa-vulkan-drivers.",
    )
