"""Where in bytes that nothing vouches for a log, a chunk, a message or a description may begin."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterator
from typing import IO

from mcap.opcode import Opcode

from shiplog.logs.mcap_file.container import read_at
from shiplog.logs.mcap_file.records import HEAD
from shiplog.logs.mcap_file.refusals import MAGIC

LOOKED = 1 << 20  # bytes that are searched at once
OVERLAP = len(MAGIC) + HEAD.size
BEGINNING = re.compile(  # of a log; a chunk below 1 TB; a message or a description below 16 MB
    re.escape(MAGIC) + rb"\x01|\x06.{5}\0{3}|[\x03-\x05].{3}\0{5}", re.DOTALL
)


def beginnings(stream: IO[bytes], start: int, limit: int) -> Iterator[tuple[int, int]]:
    """Where in [start, limit) a log, a chunk or a message may begin, and which (its opcode)."""
    while start < limit:
        window = read_at(stream, start, min(LOOKED, limit - start) + OVERLAP)
        at = 0
        while at < LOOKED and (hit := BEGINNING.search(window, at)):
            at = hit.start()
            if at >= LOOKED or start + at >= limit:
                break
            yield start + at, Opcode.HEADER if window[at] == MAGIC[0] else window[at]
            at += 1
        start += LOOKED


def select_range(places: list[int], start: int, end: int) -> list[int]:
    """Those of sorted places in [start, end)."""
    return places[bisect_left(places, start) : bisect_left(places, end)]
