"""Memory that was freed goes back to the operating system."""

import ctypes
import sys
from pathlib import Path

import pytest

from shiplog.machine import memory

STATM = Path("/proc/self/statm")


def _resident() -> int:
    """Bytes, of pages of 4 kB."""
    return 4096 * int(STATM.read_text().split()[1])


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "malloc_trim"),
    reason="the C library keeps what it has",
)
def test_gaps_between_what_stays_are_given_back():
    """Eight hundred blocks of 100 kB, of which every eighth stays: 70 MB of gaps."""
    blocks = [bytearray(100_000) for _ in range(800)]
    for block in blocks:
        block[::4096] = bytes(range(1, 1 + len(range(0, 100_000, 4096))))  # every page is in use
    kept = blocks[::8]
    del blocks, block
    before = _resident()
    memory.give_back()
    assert before - _resident() > 40e6
    assert len(kept) == 100


def test_elsewhere_nothing_happens(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(ctypes, "CDLL", lambda _: pytest.fail("there is no such library"))
    memory.give_back()
