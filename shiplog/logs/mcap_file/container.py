"""What an MCAP file says of itself, and which copy of a description is believed.

The messages come from `scan`, which reads what is sound wherever it stands. Here are the header,
the summary and the descriptions of channels: of those that stand in a file several times, the copy
that a CRC vouches for is taken.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO

import numpy as np
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

from shiplog.logs.mcap_file import records
from shiplog.logs.mcap_file.records import HEAD, parsed
from shiplog.logs.mcap_file.refusals import MAGIC

FOOTER = struct.Struct("<QQI")
INDEXED = struct.Struct("<QQQQ")  # of a chunk's index: times, where it stands, bytes of its record
TAIL = HEAD.size + FOOTER.size + len(MAGIC)
AFTER_CRC = 4 + len(MAGIC)  # the end of a file that the summary's checksum leaves out
LARGEST_SUMMARY = 256 << 20  # bytes; that of a day in chunks of a second has 10 MB
FARTHEST = 1 << 48  # bytes: file systems refuse to look beyond what they can hold
SECTION = 1 << 16  # numbers of channels and of schemas in a log, which are its own
SUMMARY: dict[int, type] = {
    Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel, Opcode.STATISTICS: Statistics,
    Opcode.CHUNK_INDEX: ChunkIndex, Opcode.METADATA_INDEX: MetadataIndex,
}  # fmt: skip

# How far a copy of a description is believed: a better one replaces it, an equal one does not.
BROKEN, LOOSE, SUMMED, VOUCHED = range(4)  # no CRC; that of the summary; that of its chunk


@dataclass(frozen=True, slots=True)
class Loss:
    """One stretch of the file that could not be read."""

    kind: str  # "crc" | "truncated"
    offset: int  # byte in the file
    reason: str
    start: int | None = None  # ns, log time, where the chunk or its index says so
    end: int | None = None
    chunk: bool = False
    held: dict[int, int] = field(default_factory=dict)  # messages by channel; 0: not known


def lost(offset: int, reason: str, stated: Chunk | ChunkIndex) -> Loss:
    """The loss of a chunk that says from when to when it reached."""
    return Loss("crc", offset, reason, stated.message_start_time, stated.message_end_time, True)


def held_by(entry: ChunkIndex | None) -> dict[int, int]:
    """The channels that its index says it has, and not how many messages of each."""
    return dict.fromkeys(entry.message_index_offsets, 0) if entry else {}


@dataclass(frozen=True, slots=True)
class Sound:
    """A chunk that is what it says (`chunks.opened`)."""

    offset: int
    section: int
    chunk: Chunk
    end: int  # byte behind its packed records


@dataclass(frozen=True, slots=True)
class Alone:
    """A schema, a channel or a message outside any chunk, which no CRC vouches for."""

    offset: int
    section: int
    opcode: int
    body: bytes
    whole: bool


@dataclass(frozen=True, slots=True)
class Index:
    """What follows a chunk: one channel's messages in it, in file order.

    times   [n] ns, log times
    places  [n] bytes, where the records begin in the unpacked chunk
    """

    channel: int
    times: np.ndarray
    places: np.ndarray


@dataclass(slots=True)
class Survey:
    """What a log says of itself, and what a walk through it has met so far.

    The numbers of channels and schemas are the log's own; where several logs stand in one file,
    those of the second are SECTION higher, and so on.
    """

    path: Path
    size: int
    header: Header = field(default_factory=lambda: Header("", ""))
    begin: int = len(MAGIC)  # where the first record stands
    end: int = 0  # where the summary begins, if it is sound, else the file's end
    ended: bool = True  # a footer and the closing magic are there
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    metadata_indexed: int = 0  # records that the summary points to
    statistics: Statistics | None = None
    summed: list[McapRecord] = field(default_factory=list)  # descriptions in a sound summary
    indexed: dict[int, ChunkIndex] = field(default_factory=dict)  # by where the chunk stands
    hinted: dict[int, int] = field(default_factory=dict)  # the same of a summary that is not sound:
    # bytes of the chunk's record, a claim that its own CRC has to bear out
    sections: int = 1  # logs that stand in the file one behind the other
    counts: dict[int, int] = field(default_factory=dict)  # messages by channel, if not in summary
    chunks: int = 0
    losses: list[Loss] = field(default_factory=list)
    unvouched: bool = False  # some messages stand outside any CRC
    beliefs: dict[tuple[type, int | str], int] = field(default_factory=dict)

    @property
    def chunks_lost(self) -> int:
        return sum(loss.chunk for loss in self.losses)

    @property
    def described(self) -> bool:
        """Whether the summary has every description that there is."""
        stated = self.statistics
        if stated is None:
            return False
        counts = stated.channel_count, stated.schema_count, stated.metadata_count
        return counts == (len(self.channels), len(self.schemas), self.metadata_indexed)


def note(found: Survey, record: McapRecord | None, belief: int, section: int = 0) -> None:
    """Keep a description, unless a better copy is known."""
    first = section * SECTION
    if isinstance(record, Metadata):  # of several with one name the last is the fullest (rosbag2)
        found.metadata[record.name] = record.metadata
        return
    if not isinstance(record, (Schema, Channel)):
        return
    if section:
        record = replace(record, id=record.id + first)
        if isinstance(record, Channel) and record.schema_id:
            record = replace(record, schema_id=record.schema_id + first)
    key = (type(record), record.id)
    if belief <= found.beliefs.get(key, -1):
        return
    found.beliefs[key] = belief
    kept = found.schemas if isinstance(record, Schema) else found.channels
    kept[record.id] = record  # type: ignore[assignment]


def read_summary(stream: IO[bytes], found: Survey) -> None:
    """Read the summary, unless there is none, its checksum is wrong or it is another log's."""
    found.end = found.size
    tail = read_at(stream, max(found.size - TAIL, 0), TAIL)
    if tail[: HEAD.size] != HEAD.pack(Opcode.FOOTER, FOOTER.size) or tail[-8:] != MAGIC:
        # a newer writer's footer may be longer; then the summary is left, and nothing else
        found.ended = tail[-8:] == MAGIC and _longer_footer(stream, found.size)
        _take_hints(stream, found, tail)
        return
    start, _, crc = FOOTER.unpack_from(tail, HEAD.size)
    if start == 0:
        return  # written without one, which is no fault
    length = found.size - start
    section = read_at(stream, start, length) if TAIL < length <= LARGEST_SUMMARY else b""
    sound = len(section) == length and (not crc or zlib.crc32(section[:-AFTER_CRC]) == crc)
    met = _tiled(section[: length - TAIL]) if sound else None
    if met is None:
        reason = "has a damaged summary; what follows was counted from the data itself"
        found.losses.append(Loss("crc", found.size - TAIL, reason))
        _take_hints(stream, found, tail)
        return
    found.end = start
    found.summed = [record for record in met if isinstance(record, (Schema, Channel))]
    for record in met:
        note(found, record, SUMMED)
        if isinstance(record, Statistics):
            found.statistics = record
        elif isinstance(record, ChunkIndex):
            found.indexed[record.chunk_start_offset] = record
        elif isinstance(record, MetadataIndex):
            found.metadata_indexed += 1
            opcode, length, fault = head(stream, record.offset, found.size)
            if fault is None and opcode == Opcode.METADATA and length <= LARGEST_SUMMARY:
                note(found, parsed(Metadata, stream.read(length)), SUMMED)


def _take_hints(stream: IO[bytes], found: Survey, tail: bytes) -> None:
    """Note where a summary that is not sound says that chunks stand, as far as it can be read."""
    if len(tail) < TAIL or tail[-8:] != MAGIC:
        return
    start, _, _ = FOOTER.unpack_from(tail, HEAD.size)
    length = found.size - start
    if not TAIL < length <= LARGEST_SUMMARY:
        return
    section, at = read_at(stream, start, length), 0
    while at + HEAD.size <= len(section):
        opcode, length = HEAD.unpack_from(section, at)
        at += HEAD.size
        if opcode == Opcode.CHUNK_INDEX and INDEXED.size <= length <= len(section) - at:
            _, _, where, whole = INDEXED.unpack_from(section, at)
            if where + whole <= start and whole > HEAD.size:
                found.hinted[where] = whole
        at += length


def _longer_footer(stream: IO[bytes], size: int) -> bool:
    """Whether the last record is a footer to which a newer writer has appended something."""
    before = read_at(stream, max(size - TAIL - HEAD.size - 64, 0), TAIL + HEAD.size + 64)
    return any(
        before[at : at + HEAD.size] == HEAD.pack(Opcode.FOOTER, len(before) - at - HEAD.size - 8)
        for at in range(len(before) - TAIL)
    )


def _tiled(section: bytes) -> list[McapRecord] | None:
    """The records that fill a summary to its last byte; None where they do not."""
    met = []
    try:
        for data, runs in records.split([section], len(section)):
            for opcode, begin, stop in records.places(runs):
                if opcode in SUMMARY:
                    met.append(parsed(SUMMARY[opcode], bytes(data[begin:stop])))
    except ValueError:
        return None
    return None if None in met else met


def head(stream: IO[bytes], position: int, size: int) -> tuple[int, int, Loss | None]:
    """Opcode and length of the record at `position`, refused when it cannot be true."""
    begin = read_at(stream, position, HEAD.size)
    if len(begin) < HEAD.size:
        return 0, 0, Loss("truncated", position, "ends in the middle of its data")
    opcode, length = HEAD.unpack(begin)
    if opcode == 0:
        return 0, 0, Loss("crc", position, "holds no record where one should begin")
    there = size - position - HEAD.size
    if length > there:
        reason = f"holds a record of {length} bytes of which {there} are there"
        return 0, 0, Loss("truncated", position, reason)
    return opcode, length, None


def read_at(stream: IO[bytes], offset: int, length: int) -> bytes:
    """Bytes of a file, fewer at its end; an offset that no file reaches is damage."""
    if offset > FARTHEST:
        return b""
    stream.seek(offset)
    return stream.read(length)


def index_of(body: bytes, section: int) -> Iterator[Index]:
    """A message index at once: the library's own loop over it takes longer than all the rest."""
    begin = struct.Struct("<HI")  # channel and bytes of the pairs that follow
    if len(body) < begin.size:
        return  # its messages are then missing from the counts
    channel, length = begin.unpack_from(body)
    if length % 16 or begin.size + length > len(body):
        return
    pairs = np.frombuffer(body, "<i8", length // 8, begin.size).reshape(-1, 2)
    in_file = pairs[np.argsort(pairs[:, 1], kind="stable")]
    yield Index(channel + section * SECTION, in_file[:, 0], in_file[:, 1])
