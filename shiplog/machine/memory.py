"""Memory that is free again, given back to the operating system."""

from __future__ import annotations

import ctypes
import sys


def give_back() -> None:
    """What the C library keeps of memory that was freed, for the next request. Arrays of a few
    megabytes leave gaps between those that stay, and of a long computation a quarter of its memory
    may be gaps. Where the library has no such call, nothing happens."""
    if sys.platform != "linux":
        return
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # glibc's
    if trim is not None:
        trim(0)
