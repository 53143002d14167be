"""Starting Rerun's own programs: the native viewer, the web server and the headless viewer.

They listen on this machine only, and send no usage statistics. A browser gets the page of
`web_page`, which asks nobody else.
"""

from __future__ import annotations

import contextlib
import importlib.util
import logging
import os
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from shiplog.exceptions import ShiplogError
from shiplog.machine import child
from shiplog.report.viewer import web_page
from shiplog.report.viewer.comparison_data import TIMELINE

log = logging.getLogger(__name__)

HOST = "127.0.0.1"
RERUN = f"rerun --bind {HOST}"  # as a user starts it: alone, it listens on every interface
WITHOUT_A_WINDOW = "use --save FILE.rrd to keep the recording, or --web to look at it in a browser."
NATIVE_PATIENCE = 2.0  # s: a viewer that has no graphics says so at once
WEB_PATIENCE = 30.0  # s: the first start on a slow disk
_DIRECT = urllib.request.build_opener(urllib.request.ProxyHandler({}))  # this machine, no proxy


def open_viewer(path: str | Path, time_s: float | None = None) -> None:
    """Show a recording in the native viewer, which stays open when shiplog is done.

    time_s   where the cursor stands at first; the recording's beginning unless given
    """
    path = existing(path)
    if sys.platform == "linux" and not (os.getenv("DISPLAY") or os.getenv("WAYLAND_DISPLAY")):
        raise ShiplogError("No display is there to open the viewer on.", hint=WITHOUT_A_WINDOW)
    port = free_port()
    with tempfile.TemporaryFile() as output:
        viewer = start([str(path), "--port", str(port)], output)
        with contextlib.suppress(subprocess.TimeoutExpired):
            if viewer.wait(NATIVE_PATIENCE) != 0:
                raise ShiplogError(
                    f"The viewer did not start: {child.last_words(output)}", hint=WITHOUT_A_WINDOW
                )
    if time_s is not None:
        _put_cursor(port, time_s)


def _put_cursor(port: int, time_s: float) -> None:
    """Where the viewer does not take it, its charts are about the moment all the same."""
    from rerun.experimental import ViewerClient

    from shiplog.report.viewer import control

    try:
        viewer = ViewerClient(control.address(HOST, port))
        if control.loaded(viewer) is not None:
            control.seek(viewer, time_s)
    except (ConnectionError, RuntimeError) as error:
        log.warning("the viewer's cursor was not set to %g s: %s", time_s, error)


@dataclass(frozen=True)
class Served:
    """A recording that a browser on this machine can look at, until `stop`."""

    address: str
    page: web_page.Page

    def wait(self) -> None:
        """Until the user ends it with Ctrl-C."""
        try:
            with contextlib.suppress(KeyboardInterrupt):
                self.page.wait()
        finally:
            self.stop()

    def stop(self) -> None:
        self.page.stop()

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def serve(path: str | Path, port: int = 9090, time_s: float | None = None) -> Served:
    """Serve a recording to browsers on this machine; another port is taken if `port` is in use.

    time_s   where the cursor stands at first; the recording's beginning unless given
    """
    path = existing(path)
    moment = None if time_s is None else web_page.cursor_at(TIMELINE, time_s)
    page = web_page.Page(HOST, free_port(port), path, _web_program(), moment)
    return Served(page.address, page)


def _web_program() -> dict[str, bytes]:
    """Rerun's viewer for browsers, which only its own server hands out: asked, and ended."""
    with tempfile.TemporaryFile() as output:
        port = free_port()
        # given a recording elsewhere, which it never asks for, it serves nothing but its page
        arguments = ["--serve-web", "--web-viewer-port", str(port), f"http://{HOST}/none.rrd"]
        process = start(arguments, output, supervised=True)
        try:
            wait_for(process, (port,), WEB_PATIENCE)
            found = {}
            for name in web_page.PROGRAM:
                address = f"http://{HOST}:{port}/{name}"
                with _DIRECT.open(address, timeout=WEB_PATIENCE) as answer:
                    found[name] = answer.read()
            return found
        except OSError:  # TimeoutError, and what urllib reports, are of this kind
            raise ShiplogError(
                f"The web viewer did not start: {child.last_words(output)}",
                hint=f"use --save FILE.rrd, and open the file with `{RERUN} FILE.rrd`.",
            ) from None
        finally:
            child.stop(process)


def start(arguments: list[str], output: IO[bytes], supervised: bool = False) -> subprocess.Popen:
    """Start Rerun's program, listening on this machine only.

    supervised   it ends when this process ends: a server without a command is a third of a core
                 until the machine is switched off
    """
    command = [str(_program()), *arguments, "--bind", HOST]
    return child.program(command, output, _environment(), supervised)


def not_started(output: IO[bytes]) -> ShiplogError:
    """The error of a viewer that did not start, with its last words."""
    return ShiplogError(
        f"The viewer did not start: {child.last_words(output)}", hint=WITHOUT_A_WINDOW
    )


def free_port(wanted: int = 0) -> int:
    """`wanted` if nobody listens there, or one the system gives."""
    for port in (wanted, 0):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.bind((HOST, port))
            return probe.getsockname()[1]
    raise ShiplogError("No network port is free on this machine.", hint=WITHOUT_A_WINDOW)


def wait_for(process: subprocess.Popen, ports: tuple[int, ...], patience: float) -> None:
    """Until the process listens on every port; TimeoutError if it ends or takes too long."""
    end = time.monotonic() + patience
    waiting = list(ports)
    while waiting:
        with socket.socket() as probe:
            if probe.connect_ex((HOST, waiting[0])) == 0:
                waiting.pop(0)
                continue
        if process.poll() is not None or time.monotonic() > end:
            raise TimeoutError
        time.sleep(0.05)


def _program() -> Path:
    """The program inside rerun-sdk: its Python wrapper would stand between us and stopping it."""
    spec = importlib.util.find_spec("rerun_cli")
    if spec is None or not spec.submodule_search_locations:
        raise ShiplogError(
            "rerun-sdk is not installed.", hint="in the clone of shiplog: pip install ."
        )
    folder = Path(spec.submodule_search_locations[0])
    places = ("rerun", "rerun.exe", "Rerun.app/Contents/MacOS/Rerun")
    for place in places:
        if (folder / place).is_file():
            return folder / place
    raise ShiplogError(
        f"rerun-sdk has no viewer in {folder}.",
        hint="open the saved .rrd on a machine where `rerun` runs.",
    )


def _environment() -> dict[str, str]:
    """Rerun 0.41 sends usage statistics unless it believes to be in CI, or the user's settings,
    which are not ours to change, say otherwise; RERUN_ANALYTICS and DO_NOT_TRACK are not read."""
    return {**os.environ, "CI": "true"}


def existing(path: str | Path) -> Path:
    path = Path(path).resolve()
    if not path.is_file():
        raise ShiplogError(f"There is no recording {path}.", hint="save one with --save FILE.rrd.")
    return path
