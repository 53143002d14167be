"""Commands that read strangers' files do it in a child process, and the parent says how it ended.

A native library may end its process: without memory, out of time, or by a fault of its own. The
parent then names the file, and starts a child that leaves it out and reads the others. A child is
a fork of a process in which nothing heavy has been loaded yet, and takes milliseconds.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
import os
import select
import signal
import sys
import threading
from collections.abc import Sequence

import typer

from shiplog.machine import reading_limits
from shiplog.machine.reading_limits import Watch

# Commands that read logs and tables, and whether one begins anew where it was: `convert` does not
# write a log that is there already.
GUARDED = {"check": True, "ingest": True, "convert": False, "profile": False}
NOT_GUARDED = "SHIPLOG_IN_ONE_PROCESS"  # set: for a debugger, or a profiler
PR_SET_PDEATHSIG = 1  # of Linux's prctl: the signal that a child gets when its parent has ended
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
        child = _fork(fatal)
        if child is None:
            return None
        code, name = child.wait()
        if code >= 0:
            return code
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


def _fork(fatal: dict[bytes, int]) -> _Child | None:
    gc.freeze()  # a collection would touch every object, and copy the pages that are shared
    reading, writing = os.pipe()
    parent = os.getpid()
    pid = os.fork()
    if pid:
        os.close(writing)
        return _Child(pid, reading)
    os.close(reading)
    os.setpgid(0, 0)  # Ctrl-C reaches the parent alone, which passes it on once
    # The child is in the background for the terminal, which may stop such a one that writes.
    signal.signal(signal.SIGTTOU, signal.SIG_IGN)
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(FAULT)
    reading_limits.watch = Watch(writing, fatal)
    return None


class _Child:
    def __init__(self, pid: int, pipe: int) -> None:
        self.pid, self.pipe = pid, pipe

    def wait(self) -> tuple[int, bytes]:
        """Its exit code, or minus the signal that ended it; and the file that it was reading."""
        passed_on = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
        if signal.getsignal(signal.SIGTSTP) is signal.SIG_DFL:
            passed_on.append(signal.SIGTSTP)
        before = {number: signal.signal(number, lambda *_: None) for number in passed_on}
        # Their numbers come through a pipe, too: one that arrives just before a read is not late
        # until something can be read (the self-pipe trick of D. J. Bernstein).
        woken, waking = os.pipe()
        os.set_blocking(waking, False)
        others = signal.set_wakeup_fd(waking)
        begun = b""  # names of the files that were begun, each with a zero behind it
        while True:
            ready = select.select([self.pipe, woken], [], [])[0]
            if woken in ready:
                for number in os.read(woken, 1 << 16):
                    self._pass_on(number)
            if self.pipe in ready:
                if not (some := os.read(self.pipe, 1 << 16)):
                    break
                begun = (begun + some)[-(1 << 16) :]
        signal.set_wakeup_fd(others)
        os.close(woken)
        os.close(waking)
        os.close(self.pipe)
        _, status = os.waitpid(self.pid, 0)
        for number, handler in before.items():
            signal.signal(number, handler)
        names = begun.split(b"\0")
        return os.waitstatus_to_exitcode(status), names[-2] if len(names) > 1 else b""

    def _pass_on(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            if number != signal.SIGTSTP:
                os.kill(self.pid, number)
                return
            # Ctrl-Z: both stop, and go on together. Where nobody could let this process go on,
            # the system does not stop it.
            os.kill(self.pid, signal.SIGSTOP)
            handler = signal.signal(signal.SIGTSTP, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGTSTP)
            signal.signal(signal.SIGTSTP, handler)
            os.kill(self.pid, signal.SIGCONT)
