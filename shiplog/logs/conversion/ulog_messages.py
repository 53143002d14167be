"""The messages of a PX4 ULog file, a numpy table for each topic and instance.

A header with the time of the start, then messages: size, type, payload. `F` names the fields of a
format, `A` gives a number to a topic and instance, `D` is a sample of that number (docs.px4.io,
ULog File Format). Crash dumps are appended at offsets that the flags name, where the message before
may be cut off.
"""

from __future__ import annotations

import re
import struct
from array import array
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

MAGIC = b"ULog\x01\x12\x35"
HEADER_BYTES, HEAD_BYTES, FLAG_BYTES = 16, 3, 40
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
    """All samples of the topics `wanted`, of every instance."""
    return _Reader(path.read_bytes(), frozenset(wanted)).found


class _Reader:
    def __init__(self, data: bytes, wanted: frozenset[str]) -> None:
        self.data, self.wanted = data, wanted
        self.formats: dict[str, str] = {}
        self.places: dict[int, array] = {}  # number of a subscription → where its samples begin
        self.named: dict[int, tuple[str, int]] = {}
        self.ended: list[tuple[tuple[str, int], array]] = []  # of numbers that were given again
        self.found = ULog()
        if len(data) >= HEADER_BYTES:
            self.found.start_us = int.from_bytes(data[8:16], "little")
        ends = self._appended()
        begin = HEADER_BYTES
        for end in (*ends, len(data)):
            self._messages(begin, end, last=end == len(data))
            begin = end
        self._tables()

    def _appended(self) -> list[int]:
        """Offsets of appended parts, in order."""
        data = self.data
        if data[HEADER_BYTES + 2 : HEADER_BYTES + 3] != b"B" or len(data) < HEADER_BYTES + 43:
            return []
        flags = data[HEADER_BYTES + HEAD_BYTES : HEADER_BYTES + HEAD_BYTES + FLAG_BYTES]
        offsets = struct.unpack("<3Q", flags[16:40])
        appended = flags[8] & 1
        return sorted(o for o in offsets if HEADER_BYTES < o < len(data)) if appended else []

    def _messages(self, at: int, end: int, last: bool) -> None:
        """The messages from `at` on."""
        data, places, found = self.data, self.places, self.found
        count = 0
        while at + HEAD_BYTES <= end:
            size, kind = data[at] | data[at + 1] << 8, data[at + 2]
            after = at + HEAD_BYTES + size
            if kind == 68 and after <= end:  # D
                number = data[at + 3] | data[at + 4] << 8
                if number in places:
                    places[number].append(at + 5)
                    places[number].append(size - 2)
                count += 1
                at = after
                continue
            if kind not in KINDS or after > end:
                following = data.find(SYNC, at + 1, end)
                if following < 0 and last and kind in KINDS:
                    break  # the last message, cut off
                if following >= 0 or last:
                    found.skipped += (end if following < 0 else following) - at
                at = end if following < 0 else following
                continue
            self._other(kind, data[at + HEAD_BYTES : after])
            count += 1
            at = after
        found.messages += count
        found.cut += max(0, end - at) if last else 0

    def _other(self, kind: int, body: bytes) -> None:
        """A message that is no sample."""
        letter = chr(kind)
        if letter == "F":
            name, _, fields = body.decode("ascii", "replace").partition(":")
            self.formats[name] = fields
        elif letter == "A" and len(body) > 3:
            number = int.from_bytes(body[1:3], "little")
            name = body[3:].decode("ascii", "replace")
            if number in self.places:
                self.ended.append((self.named[number], self.places[number]))
                del self.places[number]
            if name in self.wanted:
                self.named[number] = name, body[0]
                self.places[number] = array("q")
        elif letter == "P" and body:
            key = body[1 : 1 + body[0]].decode("ascii", "replace").split(" ")
            value = body[1 + body[0] : 5 + body[0]]
            if len(key) == 2 and len(value) == 4 and key[0] in ("int32_t", "float"):
                form = "<i" if key[0] == "int32_t" else "<f"
                self.found.parameters[key[1]] = float(struct.unpack(form, value)[0])
        elif letter == "O" and len(body) >= 2:
            self.found.dropouts.append(int.from_bytes(body[:2], "little"))

    def _tables(self) -> None:
        """The samples of each topic and instance; several subscriptions of one are joined."""
        raw = np.frombuffer(self.data, np.uint8)
        parts: dict[tuple[str, int], list[np.ndarray]] = {}
        known = [(self.named[number], at) for number, at in self.places.items()]
        for key, at in (*self.ended, *known):
            dtype = self._dtype(key[0])
            if dtype is None or not len(at):
                continue
            begin, size = np.array(at, np.int64).reshape(-1, 2).T
            whole = size >= _least(dtype)  # padding at the end may be missing
            rows = np.zeros(int(whole.sum()), dtype)
            self.found.skipped += int(size[~whole].sum())
            for length in np.unique(size[whole]).tolist():
                same = size[whole] == length
                taken = min(length, dtype.itemsize)
                part = np.zeros((int(same.sum()), dtype.itemsize), np.uint8)
                part[:, :taken] = raw[begin[whole][same][:, None] + np.arange(taken)]
                rows[same] = part.view(dtype).reshape(-1)
            parts.setdefault(key, []).append(rows)
        for key, several in parts.items():
            rows = np.concatenate(several)
            order = np.argsort(rows["timestamp"], kind="stable")
            self.found.topics[key] = rows[order]

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


def _least(dtype: np.dtype) -> int:
    """Bytes without the padding at the end."""
    names = list(dtype.names or ())
    while names and names[-1].startswith("_padding"):
        names.pop()
    if not names:
        return dtype.itemsize
    last = (dtype.fields or {})[names[-1]]
    return int(last[1]) + last[0].itemsize
