"""Starting Rerun's own programs: the native viewer, the web server and the headless viewer.

They listen on this machine only, and send no usage statistics. A browser loads Rerun's own page
from the web server; nothing here decides what that page sends.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import socket
import subprocess
import sys
import tempfile
import time
import urllib.parse
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from shiplog.exceptions import ShiplogError
from shiplog.machine import child

HOST = "127.0.0.1"
RERUN = f"rerun --bind {HOST}"  # as a user starts it: alone, it listens on every interface
WITHOUT_A_WINDOW = "use --save FILE.rrd to keep the recording, or --web to look at it in a browser."
NATIVE_PATIENCE = 2.0  # s: a viewer that has no graphics says so at once
WEB_PATIENCE = 30.0  # s: the first start on a slow disk


def open_viewer(path: str | Path) -> None:
    """Show a recording in the native viewer, which stays open when shiplog is done."""
    path = existing(path)
    if sys.platform == "linux" and not (os.getenv("DISPLAY") or os.getenv("WAYLAND_DISPLAY")):
        raise ShiplogError("No display is there to open the viewer on.", hint=WITHOUT_A_WINDOW)
    with tempfile.TemporaryFile() as output:
        viewer = start([str(path), "--port", "auto"], output)
        with contextlib.suppress(subprocess.TimeoutExpired):
            if viewer.wait(NATIVE_PATIENCE) != 0:
                raise ShiplogError(
                    f"The viewer did not start: {child.last_words(output)}", hint=WITHOUT_A_WINDOW
                )


@dataclass(frozen=True)
class Served:
    """A recording that a browser on this machine can look at, until `stop`."""

    address: str
    process: subprocess.Popen

    def wait(self) -> None:
        """Until the server ends, or the user ends it with Ctrl-C."""
        try:
            with contextlib.suppress(KeyboardInterrupt):
                self.process.wait()
        finally:
            self.stop()

    def stop(self) -> None:
        child.stop(self.process)

    def __enter__(self) -> Served:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()


def serve(path: str | Path, port: int = 9090) -> Served:
    """Serve a recording to browsers on this machine; another port is taken if `port` is in use."""
    path = existing(path)
    web, data = free_port(port), free_port(9876)
    source = urllib.parse.quote(f"rerun+http://{HOST}:{data}/proxy", safe="")
    with tempfile.TemporaryFile() as output:
        arguments = [str(path), "--serve-web", "--port", str(data), "--web-viewer-port", str(web)]
        process = start(arguments, output, supervised=True)
        try:
            wait_for(process, (web, data), WEB_PATIENCE)
        except TimeoutError:
            child.stop(process)
            raise ShiplogError(
                f"The web viewer did not start: {child.last_words(output)}",
                hint=f"use --save FILE.rrd, and open the file with `{RERUN} FILE.rrd`.",
            ) from None
    return Served(f"http://{HOST}:{web}/?url={source}", process)


def start(arguments: list[str], output: IO[bytes], supervised: bool = False) -> subprocess.Popen:
    """Start Rerun's program, listening on this machine only.

    supervised   it ends when this process ends: a server without a command is a third of a core
                 until the machine is switched off
    """
    command = [str(_program()), *arguments, "--bind", HOST]
    return child.program(command, output, _environment(), supervised)


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
