"""Limits of a process, of Linux; elsewhere there are none. They are soft, so that the next may be
higher.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager


def set_limits(memory: int | None = None, seconds: float | None = None) -> None:
    """Of this process: bytes of memory, and seconds of processor time from now."""
    if sys.platform != "linux":
        return
    import resource

    wanted = {}
    if memory is not None:
        wanted[resource.RLIMIT_DATA] = memory
    if seconds is not None:
        used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
        wanted[resource.RLIMIT_CPU] = int(used + seconds) + 1
    for kind, most in wanted.items():
        _, hard = resource.getrlimit(kind)
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (most, hard))


@contextmanager
def lifted() -> Iterator[None]:
    """No limits in a block: a process that is started there sets its own."""
    if sys.platform != "linux":
        yield
        return
    import resource

    kinds = (resource.RLIMIT_DATA, resource.RLIMIT_CPU)
    before = [resource.getrlimit(kind) for kind in kinds]
    for kind, (_, hard) in zip(kinds, before, strict=True):
        resource.setrlimit(kind, (hard, hard))
    try:
        yield
    finally:
        for kind, limits in zip(kinds, before, strict=True):
            resource.setrlimit(kind, limits)


def reserved() -> int:
    """Bytes of data and stacks that this process has reserved; 0 where that is not known."""
    if sys.platform != "linux":
        return 0
    with open("/proc/self/statm") as pages:
        return int(pages.read().split()[5]) * os.sysconf("SC_PAGESIZE")
