"""What a stranger's code may do, in the child process that runs it.

| what | how | where |
| --- | --- | --- |
| memory | RLIMIT_DATA: MEMORY beyond what the child has already | Linux; RLIMIT_AS elsewhere |
| time of a call | an alarm that raises in the call: CALL_S | POSIX |
| network | a filter of system calls: no socket but a local one (seccomp) | Linux on x86-64, arm64 |
| its printing | goes nowhere | everywhere |

It may read and write files as its owner may: the path was given by hand, and it is no sandbox for
hostile code.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import platform
import signal
import struct
import sys
from collections.abc import Iterator

MEMORY = 4 << 30  # bytes: ten times what a simulator of a ship needs, with torch loaded
CALL_S = 20.0  # s that one call may take: a step of a ship takes a millisecond

# System call number of socket(), and the architecture's name in a filter (linux/audit.h)
SOCKET = {"x86_64": (41, 0xC000003E), "aarch64": (198, 0xC00000B7)}
LOCAL = 1  # AF_UNIX
REFUSED = 13  # EACCES
PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, FILTER = 38, 22, 2
LOAD, EQUAL, RETURN = 0x20, 0x15, 0x06  # of a word; jump if equal; return (linux/filter.h)
ALLOW, ERRNO = 0x7FFF0000, 0x00050000
OF_NUMBER, OF_ARCHITECTURE, OF_FIRST_ARGUMENT = 0, 4, 16  # offsets in seccomp_data


class TooLong(Exception):
    """A call took longer than it may."""


def confine() -> list[str]:
    """This process from now on. Returns what could not be limited on this system, in words."""
    _silence()
    lacking = []
    if not _limit_memory():
        lacking.append("memory")
    if not _without_network():
        lacking.append("network")
    return lacking


def _silence() -> None:
    """What it prints would stand in the middle of an answer for machines."""
    null = os.open(os.devnull, os.O_RDWR)
    for number in (0, 1):
        os.dup2(null, number)
    os.close(null)


def _limit_memory() -> bool:
    try:
        import resource
    except ImportError:  # Windows
        return False
    of = resource.RLIMIT_DATA if sys.platform == "linux" else resource.RLIMIT_AS
    try:
        resource.setrlimit(of, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    except (ValueError, OSError):
        return False
    return True


def _without_network() -> bool:
    """A filter that lets socket() make local sockets only."""
    known = SOCKET.get(platform.machine())
    if sys.platform != "linux" or known is None:
        return False
    number, architecture = known
    program = b"".join(
        struct.pack("HBBI", *one)
        for one in (
            (LOAD, 0, 0, OF_ARCHITECTURE),
            (EQUAL, 0, 4, architecture),  # a call of another architecture passes: it has no number
            (LOAD, 0, 0, OF_NUMBER),
            (EQUAL, 0, 2, number),
            (LOAD, 0, 0, OF_FIRST_ARGUMENT),
            (EQUAL, 0, 1, LOCAL),
            (RETURN, 0, 0, ALLOW),
            (RETURN, 0, 0, ERRNO | REFUSED),
        )
    )
    code = ctypes.create_string_buffer(program, len(program))

    class Program(ctypes.Structure):
        _fields_ = (("length", ctypes.c_ushort), ("filter", ctypes.c_void_p))

    given = Program(len(program) // 8, ctypes.cast(code, ctypes.c_void_p))
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0:
        return False
    return libc.prctl(PR_SET_SECCOMP, FILTER, ctypes.byref(given), 0, 0) == 0


@contextlib.contextmanager
def time_limit(seconds: float = CALL_S) -> Iterator[None]:
    """A block that raises TooLong after so many seconds; compiled code ends first."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def late(*_: object) -> None:
        raise TooLong(f"it took longer than {seconds:g} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
