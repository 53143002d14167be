"""The messages of a PX4 ULog file, a numpy table for each topic and instance.

A header with the time of the start, then messages: size, type, payload. `F` names the fields of a
format, `A` gives a number to a topic and instance, `D` is a sample of that number (docs.px4.io,
ULog File Format). Crash dumps are appended at offsets that the flags name, where the message before
may be cut off.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

MAGIC = b"ULog\x01\x12\x35"
HEADER_BYTES, HEAD_BYTES, FLAG_BYTES, NUMBER_BYTES = 16, 3, 40, 2
SAMPLE, FLAGS = ord("D"), ord("B")
BLOCK_BYTES = 1 << 20  # read at once
SYNC = b"\x08\x00S\x2f\x73\x13\x20\x25\x0c\xbb\x12"  # a whole message, to begin again at
TYPES = {
    "int8_t": "<i1", "uint8_t": "<u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4",
    "uint32_t": "<u4", "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8",
    "bool": "?", "char": "S1",
}  # fmt: skip
KINDS = frozenset(b"BFIMPQARDLCSO")
_ARRAY = re.compile(r"([\w/]+)(?:\[(\d+)\])?$")
DEEPEST = 8  # formats within formats


@dataclass
class ULog:
    """What a file holds of the topics that were asked for.

    start_us    when the log began, by the vehicle's clock
    topics      (name, instance) → structured rows [n], in the order of the file
    parameters  as they were at the start
    dropouts    ms of each gap that the logger itself reports
    skipped     bytes that are no message; cut: bytes of a last message
    """

    start_us: int = 0
    topics: dict[tuple[str, int], np.ndarray] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)
    dropouts: list[int] = field(default_factory=list)
    messages: int = 0
    skipped: int = 0
    cut: int = 0


def read_messages(path: Path, wanted: Collection[str]) -> ULog:
    """All samples of the topics `wanted`, of every instance, block by block."""
    with path.open("rb") as stream:
        return _Reader(stream, path.stat().st_size, frozenset(wanted)).found


class _Reader:
    """Samples are most of a file: where one begins is seen by its type, its number and the length
    of its format, for a block at once. Every other message is read by itself."""

    def __init__(self, stream: BinaryIO, size: int, wanted: frozenset[str]) -> None:
        self.data, self.raw, self.wanted = b"", np.zeros(0, np.uint8), wanted
        self.formats: dict[str, str] = {}
        self.named: dict[int, tuple[str, int]] = {}  # number of a subscription → what it is of
        self.least = np.full(1 << 16, -1, np.int64)  # number → bytes of a sample, not padded
        self.padded = np.full(1 << 16, -1, np.int64)
        self.parts: dict[tuple[str, int], list[np.ndarray]] = {}
        self.found = ULog()
        start = stream.read(HEADER_BYTES + HEAD_BYTES + FLAG_BYTES)
        if len(start) >= HEADER_BYTES:
            self.found.start_us = int.from_bytes(start[8:16], "little")
        begin = HEADER_BYTES
        for end in (*_appended(start, size), size):
            self._part(stream, begin, end, last=end == size)
            begin = end
        for key, several in self.parts.items():
            rows = np.concatenate(several)
            several.clear()
            ordered = (rows["timestamp"][1:] >= rows["timestamp"][:-1]).all()
            order = slice(None) if ordered else np.argsort(rows["timestamp"], kind="stable")
            self.found.topics[key] = rows[order]

    def _part(self, stream: BinaryIO, begin: int, end: int, last: bool) -> None:
        """The messages from one byte of the file to another; what is cut off at the end of a part
        that another one follows is a crash."""
        stream.seek(begin)
        rest = b""
        while begin < end:
            block = stream.read(min(BLOCK_BYTES, end - begin))
            begin = begin + len(block) if block else end
            self.data = rest + block
            self.raw = np.frombuffer(self.data, np.uint8)
            rest = self.data[self._messages(begin == end) :]
        self.found.cut += len(rest) if last else 0

    def _messages(self, final: bool) -> int:
        """The messages of a block; how many of its bytes were used. What follows begins the next.

        final  no further block continues the last message
        """
        at = 0
        while at + HEAD_BYTES <= len(self.data):
            before = at
            if self.data[at + 2] == SAMPLE:
                at = self._samples(at, final)
            if at == before:
                at = self._one(at, final)
                if at == before:
                    break
        return at

    def _samples(self, at: int, final: bool) -> int:
        """Samples from `at` on, and what stands between them; where they stopped."""
        block = self.raw[at:]
        if len(block) < HEAD_BYTES + NUMBER_BYTES:
            return at
        heads = np.flatnonzero(block[2:-2] == SAMPLE)
        two = sliding_window_view(block, 2)
        sizes = two[heads].view("<u2").reshape(-1).astype(np.int64)
        numbers = two[heads + HEAD_BYTES].view("<u2").reshape(-1)
        known = (sizes == self.least[numbers]) | (sizes == self.padded[numbers])
        heads, sizes, numbers = heads[known], sizes[known], numbers[known]
        after = heads + HEAD_BYTES + sizes
        gaps = np.flatnonzero(np.append(after[:-1] != heads[1:], True))  # no sample follows at once
        keep = np.zeros(len(heads), bool)
        pos, k = 0, 0
        while k < len(heads) and heads[k] == pos:
            until = int(gaps[np.searchsorted(gaps, k)])
            keep[k : until + 1] = True
            pos = int(after[until])
            k = int(np.searchsorted(heads, pos))
            if pos > len(block):  # goes on in the next block, or is cut off
                keep[until], pos = False, int(heads[until])
                break
            others = len(self.named)
            while pos + HEAD_BYTES < len(block) and (k >= len(heads) or heads[k] != pos):
                following = self._one(at + pos, final) - at
                if following == pos or len(self.named) != others:
                    pos, k = following, len(heads)  # look for samples anew from there
                    break
                pos = following
                k = int(np.searchsorted(heads, pos))
        self.found.messages += int(keep.sum())
        for number in np.flatnonzero(np.bincount(numbers[keep])).tolist():
            if self.named[number][0] in self.wanted:
                mine = keep & (numbers == number)
                self._keep(number, heads[mine] + at, sizes[mine])
        return at + pos

    def _keep(self, number: int, begin: np.ndarray, size: np.ndarray) -> None:
        """Samples [n] of a subscription; padding at the end may be missing."""
        dtype = self._dtype(self.named[number][0])
        assert dtype is not None, number
        whole = np.zeros((len(begin), dtype.itemsize), np.uint8)
        first = begin + HEAD_BYTES + NUMBER_BYTES
        for length in np.flatnonzero(np.bincount(size)).tolist():
            same = np.flatnonzero(size == length)
            taken = min(length - NUMBER_BYTES, dtype.itemsize)
            whole[same, :taken] = sliding_window_view(self.raw, taken)[first[same]]
        rows = whole.view(dtype).reshape(-1)
        self.parts.setdefault(self.named[number], []).append(rows)

    def _one(self, at: int, final: bool) -> int:
        """One message; where the next one begins, `at` itself where it is not whole."""
        data = self.data
        size, kind = data[at] | data[at + 1] << 8, data[at + 2]
        after, end = at + HEAD_BYTES + size, len(data)
        if kind in KINDS and after > end and not final:
            return at
        if kind not in KINDS or after > end:
            following = data.find(SYNC, at + 1)
            if following < 0 and kind in KINDS:
                return at  # the last message, cut off
            following = end if following < 0 else following
            self.found.skipped += following - at
            return following
        if kind == SAMPLE:  # of a format or number that nothing describes
            self.found.skipped += after - at
        else:
            self._other(kind, data[at + HEAD_BYTES : after])
            self.found.messages += 1
        return after

    def _other(self, kind: int, body: bytes) -> None:
        """A message that is no sample."""
        letter = chr(kind)
        if letter == "F":
            name, _, fields = body.decode("ascii", "replace").partition(":")
            self.formats[name] = fields
        elif letter == "A" and len(body) > 3:
            number = int.from_bytes(body[1:3], "little")
            name = body[3:].decode("ascii", "replace")
            dtype = self._dtype(name)
            if dtype is not None:
                self.named[number] = name, body[0]
                self.least[number] = _least(dtype) + NUMBER_BYTES
                self.padded[number] = dtype.itemsize + NUMBER_BYTES
        elif letter == "P" and body:
            key = body[1 : 1 + body[0]].decode("ascii", "replace").split(" ")
            value = body[1 + body[0] : 5 + body[0]]
            if len(key) == 2 and len(value) == 4 and key[0] in ("int32_t", "float"):
                form = "<i" if key[0] == "int32_t" else "<f"
                self.found.parameters[key[1]] = float(struct.unpack(form, value)[0])
        elif letter == "O" and len(body) >= 2:
            self.found.dropouts.append(int.from_bytes(body[:2], "little"))

    def _dtype(self, name: str) -> np.dtype | None:
        """Fields of a topic; None for one whose format is not there or that has no time."""
        fields = self._fields(name, DEEPEST)
        if not fields or not any(label == "timestamp" for label, *_ in fields):
            return None
        return np.dtype(fields)

    def _fields(self, name: str, deep: int) -> list[tuple]:
        fields: list[tuple] = []
        for text in self.formats.get(name, "").split(";"):
            kind, _, label = text.strip().partition(" ")
            found = _ARRAY.match(kind)
            if not found or not label:
                continue
            count = int(found[2] or 1)
            if found[1] in TYPES:
                shape = ((count,),) if found[2] else ()
                fields.append((label, TYPES[found[1]], *shape))
            elif deep:
                inner = self._fields(found[1], deep - 1)
                if inner:
                    fields.append((label, inner, (count,)))
        return fields


def _appended(start: bytes, size: int) -> list[int]:
    """Offsets of appended parts, in order, of the first bytes of a file."""
    if len(start) < HEADER_BYTES + HEAD_BYTES + FLAG_BYTES or start[HEADER_BYTES + 2] != FLAGS:
        return []
    flags = start[HEADER_BYTES + HEAD_BYTES :]
    offsets = struct.unpack("<3Q", flags[16:40])
    return sorted(one for one in offsets if HEADER_BYTES < one < size) if flags[8] & 1 else []


def _least(dtype: np.dtype) -> int:
    """Bytes without the padding at the end."""
    names = list(dtype.names or ())
    while names and names[-1].startswith("_padding"):
        names.pop()
    if not names:
        return dtype.itemsize
    offsets = {name: part for name, part in (dtype.fields or {}).items()}
    kind, offset, *_ = offsets[names[-1]]
    return int(offset) + kind.itemsize
