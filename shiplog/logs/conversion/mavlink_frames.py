"""The frames of a MAVLink telemetry log (.tlog), a numpy table for each kind of message.

Each frame stands behind its receive time, eight bytes big-endian, µs since 1970, whose lowest two
bits are the number of the link. FE begins a frame of MAVLink 1, FD one of MAVLink 2, whose payload
ends before its trailing zeros (mavlink.io, Packet Serialization). Either may follow the other.
Definitions of the messages are pymavlink's.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from shiplog.nomenclature.units import UNIX_NS, YEAR_2000_NS, YEAR_2100_NS

STAMP_BYTES = 8
V1, V2 = 0xFE, 0xFD
V1_HEAD, V2_HEAD, CRC_BYTES, SIGNATURE_BYTES, SIGNED = 6, 10, 2, 13, 1
US = UNIX_NS["us"]
TIMES_US = (YEAR_2000_NS // US, YEAR_2100_NS // US)  # receive times that can be
SAME_US = 1_000_000  # a frame that came over two links came within that


@dataclass(frozen=True)
class Messages:
    """All messages of a kind, in the order of the file.

    rows      [n] structured: the fields as they are sent
    received  [n] µs since 1970, by the ground station
    sender    [n] system · 256 + component
    sequence  [n] counter of the sender
    """

    rows: np.ndarray
    received: np.ndarray
    sender: np.ndarray
    sequence: np.ndarray

    def take(self, at: np.ndarray) -> Messages:
        return Messages(self.rows[at], self.received[at], self.sender[at], self.sequence[at])

    def __len__(self) -> int:
        return len(self.rows)


@dataclass
class Telemetry:
    """What a file holds of the kinds that were asked for.

    frames    how many there are, of all kinds
    damaged   frames whose checksum is wrong; skipped: bytes between frames; cut: bytes at the end
    twice     messages that came over a second link, too, and count once
    """

    messages: dict[str, Messages] = field(default_factory=dict)
    frames: int = 0
    damaged: int = 0
    skipped: int = 0
    cut: int = 0
    twice: int = 0


def begins_as_telemetry(start: bytes) -> bool:
    """Whether bytes are a receive time and the beginning of a frame, and that again behind it."""
    if len(start) < STAMP_BYTES + V1_HEAD or not _is_frame(start, 0):
        return False
    after = STAMP_BYTES + _length(start, STAMP_BYTES)
    return len(start) < after + STAMP_BYTES + 1 or _is_frame(start, after)


def read_frames(path: Path, wanted: Collection[str], dialect: ModuleType) -> Telemetry:
    """All messages of the kinds `wanted`, of every sender.

    dialect  a module of pymavlink: definitions by number
    """
    data = path.read_bytes()
    found = Telemetry()
    kinds = {number: kind for number, kind in dialect.mavlink_map.items() if kind.msgname in wanted}
    places = _places(data, kinds, found)
    raw = np.frombuffer(data, np.uint8)
    parts: dict[str, list[Messages]] = {}
    for (number, marker, length), at in places.items():
        kind = kinds[number]
        one = _messages(raw, np.frombuffer(at, np.int64), kind, marker, length, found)
        parts.setdefault(kind.msgname, []).append(one)
    for name, several in parts.items():
        joined = _joined(several)
        once = _once(joined)
        found.twice += len(joined) - len(once)
        found.messages[name] = once
    return found


def _is_frame(data: bytes, at: int) -> bool:
    stamp = int.from_bytes(data[at : at + STAMP_BYTES], "big")
    marked = data[at + STAMP_BYTES : at + STAMP_BYTES + 1] in (b"\xfe", b"\xfd")
    return marked and TIMES_US[0] < stamp < TIMES_US[1]


def _length(data: bytes, at: int) -> int:
    """Bytes of the frame at a place."""
    if data[at] == V1:
        return V1_HEAD + data[at + 1] + CRC_BYTES
    signature = SIGNATURE_BYTES if data[at + 2] & SIGNED else 0
    return V2_HEAD + data[at + 1] + CRC_BYTES + signature


def _places(
    data: bytes, wanted: Collection[int], found: Telemetry
) -> dict[tuple[int, int, int], array]:
    """Where frames of a number, version and length begin, receive time first."""
    places: dict[tuple[int, int, int], array] = {}
    at, end = 0, len(data)
    while at + STAMP_BYTES + V1_HEAD <= end:
        frame = at + STAMP_BYTES
        marker = data[frame]
        if marker not in (V1, V2) or not _is_frame(data, at):
            following = _next(data, at + 1)
            found.skipped += following - at
            at = following
            continue
        after = frame + _length(data, frame)
        if after > end:
            break
        found.frames += 1
        if marker == V1:
            number = data[frame + 5]
        else:
            number = data[frame + 7] | data[frame + 8] << 8 | data[frame + 9] << 16
        if number in wanted:
            places.setdefault((number, marker, data[frame + 1]), array("q")).append(at)
        at = after
    found.cut = end - at
    return places


def _next(data: bytes, begin: int) -> int:
    """The next place where a frame may begin: one that another one follows."""
    for at in range(begin, len(data) - STAMP_BYTES - V1_HEAD):
        if data[at + STAMP_BYTES] in (V1, V2) and _is_frame(data, at):
            after = at + STAMP_BYTES + _length(data, at + STAMP_BYTES)
            if after == len(data) or _is_frame(data, after):
                return at
    return len(data)


def _messages(
    raw: np.ndarray, at: np.ndarray, kind: type, marker: int, length: int, found: Telemetry
) -> Messages:
    """The frames of one kind and length; a payload that was cut at zeros is filled up again."""
    head = V1_HEAD if marker == V1 else V2_HEAD
    dtype = _dtype(kind)
    frames = sliding_window_view(raw, STAMP_BYTES + head + length + CRC_BYTES)[at]
    payload = frames[:, STAMP_BYTES + head : -CRC_BYTES]
    sound = _crc(frames[:, STAMP_BYTES + 1 : -CRC_BYTES], kind.crc_extra) == (  # type: ignore
        frames[:, -2] | frames[:, -1].astype(np.uint16) << 8
    )
    found.damaged += int((~sound).sum())
    frames, payload = frames[sound], payload[sound][:, : dtype.itemsize]
    whole = np.zeros((len(frames), dtype.itemsize), np.uint8)
    whole[:, : payload.shape[1]] = payload
    stamp = np.ascontiguousarray(frames[:, :STAMP_BYTES]).view(">u8").reshape(-1)
    system = 3 if marker == V1 else 5
    number = frames[:, STAMP_BYTES + system].astype(np.int64) * 256
    number += frames[:, STAMP_BYTES + system + 1]
    return Messages(
        whole.view(dtype).reshape(-1), (stamp & ~np.uint64(3)).astype(np.int64), number,
        frames[:, STAMP_BYTES + system - 1].astype(np.int64),
    )  # fmt: skip


def _dtype(kind: type) -> np.dtype:
    """The fields of a message in the order in which they are sent."""
    counts = re.findall(r"(\d*)([a-zA-Z])", kind.unpacker.format)  # type: ignore[attr-defined]
    fields: list[tuple] = []
    names = iter(kind.ordered_fieldnames)  # type: ignore[attr-defined]
    for (count, letter), name in zip(counts, names, strict=True):
        if letter == "s":
            fields.append((name, f"S{count or 1}"))
        elif count:
            fields.append((name, f"<{letter}", (int(count),)))
        else:
            fields.append((name, f"<{letter}"))
    return np.dtype(fields)


def _crc(body: np.ndarray, extra: int) -> np.ndarray:
    """CRC-16/MCRF4XX of each row [n, k] and the byte that stands for the message's definition."""
    crc = np.full(len(body), 0xFFFF, np.uint16)
    for column in (*body.T, np.full(len(body), extra, np.uint8)):
        low = column ^ (crc & 0xFF).astype(np.uint8)
        low ^= low << 4
        wide = low.astype(np.uint16)
        crc = (crc >> 8) ^ (wide << 8) ^ (wide << 3) ^ (wide >> 4)
    return crc


def _joined(parts: list[Messages]) -> Messages:
    """In the order in which they came."""
    received = np.concatenate([part.received for part in parts])
    order = np.argsort(received, kind="stable")
    return Messages(
        np.concatenate([part.rows for part in parts])[order], received[order],
        np.concatenate([part.sender for part in parts])[order],
        np.concatenate([part.sequence for part in parts])[order],
    )  # fmt: skip


def _once(found: Messages) -> Messages:
    """Without what came again over another link: same sender, counter and content, at one time."""
    order = np.lexsort((found.received, found.sequence, found.sender))
    one = found.take(order)
    again = np.zeros(len(one), bool)
    again[1:] = (
        (np.diff(one.sender) == 0) & (np.diff(one.sequence) == 0)
        & (np.diff(one.received) <= SAME_US) & (one.rows[1:] == one.rows[:-1])
    )  # fmt: skip
    return found.take(np.sort(order[~again]))
