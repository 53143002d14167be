"""Limits on what one file of a stranger may take, and what was being read when they were passed.

Unpacking, decoding and tables are done by native libraries, which end their whole process where
they run out of memory. So a command reads in a child process (`cli/guard`); before each file the
child says its name and sets its limits here. Where nobody guards, nothing is limited.
"""

from __future__ import annotations

import os
import signal
from dataclasses import dataclass, field
from pathlib import Path

from shiplog.exceptions import LogUnreadable
from shiplog.machine import limits

# Of a small file, and of a large one: memory, of which the libraries alone reserve 0.4 GB on two
# cores and more on many; and processor time, of which a sound log takes 1 s for a MB on the slower
# route, its check and its sensors included.
LEAST_BYTES, BYTES_PER_BYTE = 4 << 30, 64
LEAST_S, S_PER_MB = 60.0, 20.0


@dataclass
class Watch:
    """A pipe to the parent, and the files that ended a child before, each with its signal."""

    pipe: int
    fatal: dict[bytes, int] = field(default_factory=dict)


watch: Watch | None = None


def begin(path: Path) -> None:
    """Set the limits of one file, or folder of files.

    Raises LogUnreadable for one that has ended a process.
    """
    if watch is None:
        return
    name = os.fsencode(path)
    if name in watch.fatal:
        raise LogUnreadable(
            f"Reading {path} was given up: {reason(watch.fatal[name])}.",
            hint="if the file is sound, it is too large for this computer: cut it into parts.",
        )
    os.write(watch.pipe, name + b"\0")
    grown(path)


def grown(path: Path) -> None:
    """What the file that is being read has become: unpacked, it is larger."""
    if watch is not None:
        size = size_of(path)
        limits.set_limits(memory(size), LEAST_S + S_PER_MB * size / 1e6)


def end() -> None:
    """Nothing is being read any more."""
    if watch is not None:
        os.write(watch.pipe, b"\0")


def reason(number: int) -> str:
    """What a signal says that ended a process."""
    if number == getattr(signal, "SIGXCPU", None):
        return "it took more processor time than a file of its size may"
    if number == signal.SIGABRT:
        return "it needed more memory than a file of its size may"
    if number == signal.SIGKILL:
        return "the process was ended from outside, by the system where it has no memory left"
    return f"it ended the process that read it ({signal.Signals(number).name})"


def size_of(path: Path) -> int:
    """Bytes of a file, or of all files in a folder."""
    try:
        if path.is_dir():
            return sum(inside.stat().st_size for inside in path.rglob("*") if inside.is_file())
        return path.stat().st_size
    except OSError:
        return 0


def memory(size: int) -> int:
    """Bytes that a process may take for a file of so many."""
    return LEAST_BYTES + BYTES_PER_BYTE * size
