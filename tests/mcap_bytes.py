"""An MCAP file from its records, byte by byte: what no library would write can be written here."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
ATTACHMENT, ATTACHMENT_INDEX, STATISTICS, METADATA, METADATA_INDEX = range(9, 14)
SUMMARY_OFFSET, DATA_END = 14, 15


def record(opcode: int, body: bytes, padding: bytes = b"") -> bytes:
    return struct.pack("<BQ", opcode, len(body) + len(padding)) + body + padding


def text(content: str | bytes) -> bytes:
    raw = content if isinstance(content, bytes) else content.encode()
    return struct.pack("<I", len(raw)) + raw


def mapping(entries: dict[str, str]) -> bytes:
    inside = b"".join(text(key) + text(value) for key, value in entries.items())
    return struct.pack("<I", len(inside)) + inside


def numbers(entries: dict[int, int]) -> bytes:
    inside = b"".join(struct.pack("<HQ", key, value) for key, value in entries.items())
    return struct.pack("<I", len(inside)) + inside


def schema(number: int, name: str, encoding: str, data: bytes) -> bytes:
    return struct.pack("<H", number) + text(name) + text(encoding) + text(data)


def channel(number: int, of: int, topic: str | bytes, encoding: str, metadata=()) -> bytes:
    return struct.pack("<HH", number, of) + text(topic) + text(encoding) + mapping(dict(metadata))


def message(number: int, sequence: int, logged: int, published: int, data: bytes) -> bytes:
    return struct.pack("<HIQQ", number, sequence, logged, published) + data


def chunk(
    raw: bytes, start: int, end: int, packed: bytes | None = None, kind: str = "",
    crc: int | None = None, size: int | None = None,
) -> bytes:  # fmt: skip
    """A chunk's body; its CRC and its size are right unless they are given."""
    packed = raw if packed is None else packed
    head = struct.pack("<QQQI", start, end, len(raw) if size is None else size,
                       zlib.crc32(raw) if crc is None else crc)  # fmt: skip
    return head + text(kind) + struct.pack("<Q", len(packed)) + packed


def records(data: bytes) -> Iterable[tuple[int, int, int]]:
    """Opcode, offset and length of each record of a sound file."""
    at = len(MAGIC)
    while at < len(data) - len(MAGIC):
        opcode, length = struct.unpack_from("<BQ", data, at)
        yield opcode, at, 9 + length
        at += 9 + length
