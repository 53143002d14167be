"""Commands that read strangers' files do it in a child process, and the parent says how it ended.

A native library may end its process: without memory, out of time, or by a fault of its own. The
parent then names the file, and starts a child that leaves it out and reads the others. A child is
a fork of a process in which nothing heavy has been loaded yet, and takes milliseconds.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Sequence

import typer

from shiplog.machine import child, reading_limits
from shiplog.machine.reading_limits import Watch

# Commands that read logs and tables, and whether one begins anew where it was: `convert` does not
# write a log that is there already.
GUARDED = {"check": True, "ingest": True, "convert": False, "profile": False}
NOT_GUARDED = "SHIPLOG_IN_ONE_PROCESS"  # set: for a debugger, or a profiler
FAULT = 1  # exit code: the input is at fault


def guarded(arguments: Sequence[str]) -> int | None:
    """In the parent the exit code of a child that ran the command; in the child None: run it.

    None, too, where nothing is guarded: another command, another system, several threads.
    """
    asked = next((word for word in arguments if not word.startswith("-")), "")
    if sys.platform != "linux" or asked not in GUARDED or os.environ.get(NOT_GUARDED):
        return None
    if threading.active_count() > 1:
        return None
    fatal: dict[bytes, int] = {}
    while True:
        forked = child.fork()
        if isinstance(forked, int):
            reading_limits.watch = Watch(forked, fatal)
            return None
        code, begun = forked.wait()
        if code >= 0:
            return code
        name = [b"", *begun.split(b"\0")][-2]  # of every file that was begun, a zero behind it
        number, file = -code, os.fsdecode(name)
        if number == signal.SIGKILL or not GUARDED[asked] or not name or name in fatal:
            return _ended(number, file)
        fatal[name] = number


def _ended(number: int, file: str) -> int:
    what = f"Reading {file} was given up" if file else "The command has ended"
    typer.echo(
        f"{what}: {reading_limits.reason(number)}.\n  What was finished is kept; run the command "
        "again without that file, or with fewer.",
        err=True,
    )
    if number == signal.SIGKILL:  # whoever waits for this process sees what happened
        os.kill(os.getpid(), number)
    return FAULT
