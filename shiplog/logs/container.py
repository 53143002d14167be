"""The MCAP container: what is intact is handed on, what is not is counted and named.

Records are parsed by the `mcap` library. Its readers give up at the first fault, though, and
allocate whatever a damaged length says, so lengths are checked here against the file's size, chunks
against their stated size and CRC, and a walk goes on at the next chunk that the summary knows.
"""

from __future__ import annotations

import logging
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import IO

import lz4.frame
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)  # fmt: skip
from mcap.stream_reader import StreamReader, breakup_chunk

from .refusals import MAGIC, check_file, check_magic

log = logging.getLogger(__name__)

HEAD = struct.Struct("<BQ")  # opcode and length of every record
FOOTER = struct.Struct("<QQI")
INDEX = struct.Struct("<HI")  # channel and bytes of a message index, before its pairs
TAIL = HEAD.size + FOOTER.size + len(MAGIC)
AFTER_CRC = 4 + len(MAGIC)  # the end of a file that the summary's checksum leaves out
CARRIERS = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.MESSAGE_INDEX)
MOST_IN_A_CHUNK = 1 << 30  # a size beyond this is taken for damage, not allocated


@dataclass(frozen=True, slots=True)
class Loss:
    """One stretch of the file that could not be read."""

    kind: str  # "crc" | "truncated"
    offset: int  # byte in the file
    reason: str
    start: int | None = None  # ns, log time, where the chunk or its index says so
    end: int | None = None
    chunk: bool = False


@dataclass(frozen=True, slots=True)
class Sound:
    """A chunk that is what it says, unpacked; or one record that stands in no chunk."""

    offset: int
    chunk: Chunk


@dataclass(frozen=True, slots=True)
class Index:
    """What follows a chunk: the log times of one channel's messages in it [n] ns, in file order."""

    channel: int
    times: np.ndarray


@dataclass(slots=True)
class Survey:
    """What the summary says, and what a walk through the file has met so far."""

    path: Path
    size: int
    header: Header = field(default_factory=lambda: Header("", ""))
    ended: bool = True  # a footer and the closing magic are there
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    statistics: Statistics | None = None
    indexed: dict[int, ChunkIndex] = field(default_factory=dict)  # by where the chunk stands
    chunks: int = 0
    losses: list[Loss] = field(default_factory=list)
    unvouched: bool = False  # some messages stand outside any CRC

    @property
    def chunks_lost(self) -> int:
        return sum(loss.chunk for loss in self.losses)


def survey(path: Path) -> Survey:
    """Open a log: its magic, header and, when it has a sound one, its summary."""
    check_file(path)
    found = Survey(path, path.stat().st_size)
    with path.open("rb") as stream:
        check_magic(path, stream.read(len(MAGIC)), found.size)
        _read_summary(stream, found)
        opcode, length, fault = _head(stream, len(MAGIC), found.size)
        if fault is None and opcode == Opcode.HEADER:
            found.header = _parsed(Header, stream.read(length)) or found.header
    return found


def _read_summary(stream: IO[bytes], found: Survey) -> None:
    """Read the summary section, unless there is none or its checksum is wrong."""
    tail = _read(stream, max(found.size - TAIL, 0), TAIL)
    if tail[: HEAD.size] != HEAD.pack(Opcode.FOOTER, FOOTER.size) or tail[-8:] != MAGIC:
        found.ended = False
        return
    start, _, crc = FOOTER.unpack_from(tail, HEAD.size)
    if start == 0:
        return  # written without one, which is no fault
    try:
        section = _read(stream, start, max(found.size - start, 0))
        if crc and zlib.crc32(section[:-AFTER_CRC]) != crc:
            raise ValueError("checksum of the summary")
        records = list(StreamReader(BytesIO(section), skip_magic=True).records)
    except Exception as error:
        log.debug("summary: %s", error)
        reason = "has a damaged summary; what follows was counted from the data itself"
        found.losses.append(Loss("crc", found.size - TAIL, reason))
        return
    for record in records:
        note(found, record)
        if isinstance(record, Statistics):
            found.statistics = record
        elif isinstance(record, ChunkIndex):
            found.indexed[record.chunk_start_offset] = record
        elif isinstance(record, MetadataIndex):
            opcode, length, fault = _head(stream, record.offset, found.size)
            if fault is None and opcode == Opcode.METADATA:
                note(found, _parsed(Metadata, stream.read(length)))


def note(found: Survey, record: McapRecord | None) -> None:
    """Keep a description met among the data."""
    if isinstance(record, Schema):
        found.schemas.setdefault(record.id, record)
    elif isinstance(record, Channel):
        found.channels.setdefault(record.id, record)
    elif isinstance(record, Metadata):  # of several with one name the last is the fullest (rosbag2)
        found.metadata[record.name] = record.metadata


def walk(found: Survey) -> Iterator[Sound | Index]:
    """All that is sound, in file order; `found` is brought up to date on the way."""
    with found.path.open("rb") as stream:
        for offset, opcode, body in _records(stream, found):
            if opcode == Opcode.CHUNK:
                unpacked = _unpacked(offset, body)
                if isinstance(unpacked, Sound):
                    yield unpacked
                else:
                    found.losses.append(unpacked)
            elif opcode == Opcode.MESSAGE_INDEX:
                yield from _index(body)
            else:
                loose = HEAD.pack(opcode, len(body)) + body
                yield Sound(offset, Chunk("", loose, 0, 0, 0, len(loose)))


def contents_of(found: Survey, sound: Sound) -> list[McapRecord]:
    """Schemas, channels and messages of a chunk; none when they are not what its size says."""
    try:
        return breakup_chunk(sound.chunk)
    except Exception as error:  # only where nothing had a checksum
        log.debug("records at byte %d: %s", sound.offset, error)
        found.losses.append(_lost(sound.offset, "does not hold sound records", sound.chunk))
        return []


def _records(stream: IO[bytes], found: Survey) -> Iterator[tuple[int, int, bytes]]:
    """Walk the data section: offset, opcode and body of each record that carries messages."""
    position = len(MAGIC)
    visited: set[int] = set()
    while True:
        opcode, length, fault = _head(stream, position, found.size)
        if fault is None and opcode in (Opcode.DATA_END, Opcode.FOOTER):
            break
        if fault is not None:
            resume = min((at for at in found.indexed if at > position), default=None)
            # the loss of an indexed chunk is reported below, with its times
            if position not in found.indexed:
                kind = fault.kind if resume is None else "crc"
                found.losses.append(replace(fault, kind=kind))
            if resume is None:
                break
            position = resume
            continue
        if opcode in CARRIERS:
            found.unvouched |= opcode == Opcode.MESSAGE
            if opcode == Opcode.CHUNK:
                found.chunks += 1
                visited.add(position)
            yield position, opcode, stream.read(length)
        elif opcode == Opcode.METADATA:
            note(found, _parsed(Metadata, stream.read(length)))
        position += HEAD.size + length
    if fault is None and not found.ended:
        found.losses.append(Loss("truncated", found.size, "has a damaged or incomplete ending"))
    for offset, index in found.indexed.items():
        if offset not in visited:
            found.chunks += 1
            found.losses.append(_lost(offset, "has lost its beginning", index))


def _head(stream: IO[bytes], position: int, size: int) -> tuple[int, int, Loss | None]:
    """Opcode and length of the record at `position`, refused when it cannot be true."""
    head = _read(stream, position, HEAD.size)
    if len(head) < HEAD.size:
        return 0, 0, Loss("truncated", position, "ends in the middle of its data")
    opcode, length = HEAD.unpack(head)
    if opcode == 0:
        return 0, 0, Loss("crc", position, "holds no record where one should begin")
    there = size - position - HEAD.size
    if length > there:
        reason = f"holds a record of {length} bytes of which {there} are there"
        return 0, 0, Loss("truncated", position, reason)
    return opcode, length, None


def _unpacked(offset: int, body: bytes) -> Sound | Loss:
    """A chunk's records, if its size and its CRC are right."""
    chunk = _parsed(Chunk, body)
    if chunk is None:
        return Loss("crc", offset, "states a size that cannot be", chunk=True)
    try:
        data = _decompressed(chunk)
        if len(data) != chunk.uncompressed_size:
            raise ValueError("does not have the size it states")
        if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
            raise ValueError("does not match its checksum")
    except ValueError as error:
        return _lost(offset, str(error), chunk)
    except Exception as error:  # zstandard and lz4 each raise their own
        log.debug("chunk at byte %d: %s", offset, error)
        return _lost(offset, "cannot be decompressed", chunk)
    return Sound(offset, replace(chunk, compression="", data=data))


def _decompressed(chunk: Chunk) -> bytes:
    """Never more than the chunk states, and that only when the frame agrees: no bombs."""
    size = chunk.uncompressed_size
    if size > MOST_IN_A_CHUNK:
        raise ValueError("states a size that cannot be")
    if chunk.compression == "":
        return chunk.data
    if chunk.compression == "lz4":
        return lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    if chunk.compression != "zstd":
        raise ValueError(f"is compressed by unknown {chunk.compression[:16]!r}")
    stated = zstandard.get_frame_parameters(chunk.data).content_size
    if stated == size:
        return zstandard.ZstdDecompressor().decompress(chunk.data)
    if stated not in (0, zstandard.CONTENTSIZE_UNKNOWN):
        raise ValueError("does not have the size it states")
    return zstandard.ZstdDecompressor().stream_reader(chunk.data).read(size + 1)


def _index(body: bytes) -> Iterator[Index]:
    """A message index at once: the library's own loop over it takes longer than all the rest."""
    if len(body) < INDEX.size or (len(body) - INDEX.size) % 16:
        return  # its messages are then missing from the counts
    pairs = np.frombuffer(body, "<i8", offset=INDEX.size).reshape(-1, 2)
    in_file = pairs[np.argsort(pairs[:, 1], kind="stable")]
    yield Index(INDEX.unpack_from(body)[0], in_file[:, 0])


def _lost(offset: int, reason: str, stated: Chunk | ChunkIndex) -> Loss:
    return Loss("crc", offset, reason, stated.message_start_time, stated.message_end_time, True)


def _parsed(kind: type, body: bytes):
    try:
        return kind.read(ReadDataStream(BytesIO(body)))
    except Exception as error:
        log.debug("%s: %s", kind.__name__, error)
        return None


def _read(stream: IO[bytes], offset: int, length: int) -> bytes:
    stream.seek(offset)
    return stream.read(length)
