"""The process of a command: its streams, signals, exit code, and the message for an exception.

Results on stdout, progress on stderr. Exit codes: 0 done, 1 the input is at fault, 2 wrong usage,
3 done but something was lost or refused.
"""

from __future__ import annotations

import io
import logging
import os
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

import typer

from shiplog.cli import guard
from shiplog.cli.app import app
from shiplog.exceptions import ShiplogError
from shiplog.machine import disk_cache

# XLA shares a loop out to as many threads as the machine has cores, and rounds another way where
# another thread begins. On one thread the numbers are the same on every number of cores, and a
# diagnosis takes a fifth less processor time. XLA reads NPROC when it first computes.
ONE_THREAD = "1"
STOPPED = 130  # by Ctrl-C, as shells have it
STOPPED_SENTENCE = "stopped; what was finished is kept"


class _Lines(logging.Handler):
    """Log lines to whatever stderr is now: while a bar is drawn, they appear above it."""

    def emit(self, record: logging.LogRecord) -> None:
        print(self.format(record), file=sys.stderr, flush=True)


def main(parts: object = None) -> None:
    """Entry point: settings of this process, then `run`."""
    _open_missing()
    disk_cache.keep_compiled()
    one_thread()
    logging.basicConfig(format="%(message)s", handlers=[_Lines()], level=logging.WARNING)
    logging.getLogger("shiplog").setLevel(logging.INFO)
    for number in (signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM)):
        if signal.getsignal(number) is signal.SIG_DFL:  # not under nohup
            signal.signal(number, _stopped)
    ended = guard.guarded(sys.argv[1:])  # in the child there is none: it runs the command
    sys.exit(run(parts=parts) if ended is None else ended)


def one_thread() -> None:
    """XLA of this process: the same numbers on every number of cores."""
    os.environ["NPROC"] = ONE_THREAD


def _open_missing() -> None:
    """Standard streams that were closed before the start lead nowhere: a job goes on without them,
    and no file that it opens takes their place."""
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            nowhere = open(os.devnull, mode)  # noqa: SIM115  stays open: it stands in for a stream
            os.set_inheritable(nowhere.fileno(), True)
            setattr(sys, name, nowhere)


def run(arguments: Sequence[str] | None = None, parts: object = None) -> int:
    """The exit code of a command line, that of this process unless one is given. `parts` of the
    decision are those that act in a diagnosis: an experiment hands them in.

    Whatever goes wrong is a sentence on stderr and never a traceback: a fault of the input says
    what to mend, and a fault of the program where its trace was written.
    """
    for stream in (sys.stdout, sys.stderr):  # a file's name need not be text
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        app(arguments, obj=parts)
    except SystemExit as ended:  # as every command ends
        code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        if code == STOPPED:  # of Ctrl-C, as typer returns it; SIGTERM has its own message
            typer.echo(STOPPED_SENTENCE, err=True)
        return code
    except BaseException as error:  # a panic of polars is no Exception
        fault = _fault(error)
        typer.echo(str(fault), err=True)
        return fault.exit_code
    return 0


def _fault(error: BaseException) -> ShiplogError:
    """The message for a user."""
    if isinstance(error, ShiplogError):
        return error
    from shiplog.machine.unexpected import unexpected

    return unexpected(error)


def _stopped(number: int, _frame: object) -> NoReturn:
    """Asked to end: everything that was started is ended on the way out."""
    signal.signal(number, signal.SIG_IGN)
    typer.echo(STOPPED_SENTENCE, err=True)
    sys.exit(128 + number)
