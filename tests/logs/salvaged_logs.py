"""A log of ten chunks, record by record, and what is read of it."""

from __future__ import annotations

import json
import struct
import zlib

import mcap_bytes as mcap
import zstandard

TOPICS = ("/gyro", "/wind", "/rudder")
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
CHUNKS, EACH = 10, 12  # messages of a chunk, on each topic in turn


def payload(k: int) -> bytes:
    return json.dumps({"x": k, "text": "a" * (k % 7)}).encode()


def packed(raw: bytes, first: int, last: int, kind: str = "zstd", **claims) -> bytes:
    data = zstandard.ZstdCompressor().compress(raw) if kind == "zstd" else raw
    return mcap.chunk(raw, START + first * SECOND, START + last * SECOND, data, kind, **claims)


def described(topics=TOPICS) -> bytes:
    return b"".join(
        mcap.record(mcap.CHANNEL, mcap.channel(n, 0, t, "json")) for n, t in enumerate(topics, 1)
    )


def parts(topics=TOPICS, kind: str = "zstd") -> list[tuple[int, bytes]]:
    """The records of the data section; message k comes k seconds after the start."""
    made = [(mcap.HEADER, mcap.text("") + mcap.text("test"))]
    for number in range(CHUNKS):
        first = number * EACH
        raw, pairs = described(topics) if number == 0 else b"", {}
        for k in range(first, first + EACH):
            channel = k % len(topics) + 1
            pairs.setdefault(channel, []).append((START + k * SECOND, len(raw)))
            body = mcap.message(channel, k, START + k * SECOND, START + k * SECOND, payload(k))
            raw += mcap.record(mcap.MESSAGE, body)
        made.append((mcap.CHUNK, packed(raw, first, first + EACH - 1, kind)))
        for channel, entries in pairs.items():
            inside = b"".join(struct.pack("<QQ", *pair) for pair in entries)
            made.append((mcap.MESSAGE_INDEX, struct.pack("<H", channel) + mcap.text(inside)))
    return made


def file(made: list[tuple[int, bytes]], summary: bytes = b"", ended: bool = True) -> bytes:
    data = mcap.MAGIC + b"".join(mcap.record(*one) for one in made)
    if not ended:
        return data
    data += mcap.record(mcap.DATA_END, bytes(4))
    start = len(data) if summary else 0
    footer = struct.pack("<BQ", mcap.FOOTER, 20) + struct.pack("<QQ", start, 0)
    crc = zlib.crc32(summary + footer) if summary else 0
    return data + summary + footer + struct.pack("<I", crc) + mcap.MAGIC


def places(data: bytes, opcode: int) -> list[tuple[int, int]]:
    return [(at, length) for kind, at, length in mcap.records(data) if kind == opcode]


def numbers(found) -> list[int]:
    """The messages that were read, by their number; several of one number stay several."""
    return sorted(int(x) for frame in found.frames.values() for x in frame["x"])


def without(*lost: int) -> list[int]:
    """All messages but those of the chunks `lost`."""
    return [k for k in range(CHUNKS * EACH) if k // EACH not in lost]


GOOD = file(parts())
CHUNK_AT = places(GOOD, mcap.CHUNK)


def changed(data: bytes, at: int, new: bytes) -> bytes:
    return data[:at] + new + data[at + len(new) :]
