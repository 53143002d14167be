"""The MCAP container, byte by byte: what is intact is handed on, what is not is counted and named.

`mcap.reader` gives up at the first fault and `rerun` hangs or aborts on some of them, so the record
level is walked here, from lengths checked against the file's size and chunks checked against their
CRC before anything looks inside them.
"""

from __future__ import annotations

import logging
import struct
import zlib
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import IO

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex, Header, Metadata, Schema, Statistics

from shiplog.exceptions import LogUnreadable

log = logging.getLogger(__name__)

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")  # opcode and length of every record
CHUNK_HEAD = struct.Struct("<QQQII")  # start, end, uncompressed size, CRC, length of compression
FOOTER = struct.Struct("<QQI")
MESSAGE_HEAD = 22  # bytes before a message's payload
MOST_IN_A_CHUNK = 1 << 30  # a size beyond this is taken for damage, not allocated
BLOCK = 4 << 20  # bytes of records handed on at once: enough to make per-topic work cheap


@dataclass(frozen=True, slots=True)
class Loss:
    """One stretch of the file that could not be read."""

    kind: str  # "crc" | "truncated"
    offset: int  # byte in the file
    reason: str
    start: int | None = None  # ns, log time, where the chunk or its index says so
    end: int | None = None
    chunk: bool = False


@dataclass(slots=True)
class Summary:
    """What the end of the file says about the rest."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    statistics: Statistics | None = None
    chunks: list[ChunkIndex] = field(default_factory=list)
    metadata_offsets: list[int] = field(default_factory=list)


@dataclass(slots=True)
class Survey:
    """What a walk through the file has met so far."""

    path: Path
    size: int
    header: Header = field(default_factory=lambda: Header("", ""))
    summary: Summary | None = None
    ended: bool = True  # a footer and the closing magic are there
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    chunks: int = 0
    losses: list[Loss] = field(default_factory=list)
    unvouched: bool = False  # some records stand outside any CRC

    @property
    def chunks_lost(self) -> int:
        return sum(loss.chunk for loss in self.losses)


def survey(path: Path) -> Survey:
    """Open a log: its magic, header and, when it has a sound one, its summary."""
    if not path.is_file():
        found = "is a folder" if path.is_dir() else "does not exist"
        raise LogUnreadable(f"{path} {found}.", hint="give the path of one MCAP file.")
    size = path.stat().st_size
    with path.open("rb") as stream:
        start = stream.read(len(MAGIC))
        _check_magic(path, start, size)
        found = Survey(path, size)
        _find_summary(stream, found)
        if found.summary is not None:
            found.schemas |= found.summary.schemas
            found.channels |= found.summary.channels
            for offset in found.summary.metadata_offsets:
                _note_metadata(found, _body_at(stream, offset, size, Opcode.METADATA))
        header = _body_at(stream, len(MAGIC), size, Opcode.HEADER)
        if header is not None:
            found.header = _parsed(Header, header) or found.header
    return found


def blocks(found: Survey) -> Iterator[bytes]:
    """Streams of sound records (schemas, channels, messages), in file order, ~BLOCK bytes each.

    Chunks are decompressed and checked by two threads, a few ahead; `found` is brought up to date.
    """
    gathered: list[bytes] = []
    held = 0
    with found.path.open("rb") as stream, ThreadPoolExecutor(2) as pool:
        ahead: deque[Future[bytes | Loss] | bytes] = deque()
        for piece in _pieces(stream, found):
            ahead.append(pool.submit(_unpack, *piece) if isinstance(piece, tuple) else piece)
            while len(ahead) > 4:
                held += _settle(ahead.popleft(), gathered, found)
                if held >= BLOCK:
                    yield b"".join(gathered)
                    gathered, held = [], 0
        while ahead:
            held += _settle(ahead.popleft(), gathered, found)
    if held:
        yield b"".join(gathered)


def _settle(item: Future[bytes | Loss] | bytes, gathered: list[bytes], found: Survey) -> int:
    data = item if isinstance(item, bytes) else item.result()
    if isinstance(data, Loss):
        found.losses.append(data)
        return 0
    gathered.append(data)
    return len(data)


def _pieces(stream: IO[bytes], found: Survey) -> Iterator[bytes | tuple[int, bytes]]:
    """Walk the data section: whole chunk records, and runs of records that stand in no chunk."""
    indexed = sorted(c.chunk_start_offset for c in found.summary.chunks) if found.summary else []
    visited: set[int] = set()
    position = len(MAGIC)
    run = position  # start of the records outside chunks that have not been handed on
    times = {c.chunk_start_offset: c for c in found.summary.chunks} if found.summary else {}
    while True:
        opcode, length, fault = _head(stream, position, found.size)
        if fault is None and opcode in (Opcode.DATA_END, Opcode.FOOTER):
            break
        loose = opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE)
        if fault is not None or not loose or position - run > BLOCK:
            if position > run:
                yield _read(stream, run, position - run)
            run = position if loose else position + HEAD.size + length
        if fault is not None:
            resume = next((offset for offset in indexed if offset > position), None)
            if position not in times:  # a chunk's own loss is told below, with its times
                kind = fault.kind if resume is None else "crc"
                found.losses.append(replace(fault, kind=kind))
            if resume is None:
                run = position = found.size
                break
            position = run = resume
            continue
        if opcode == Opcode.CHUNK:
            visited.add(position)
            found.chunks += 1
            yield position, _read(stream, position + HEAD.size, length)
        elif opcode == Opcode.MESSAGE:
            found.unvouched = True
        elif opcode == Opcode.METADATA:
            _note_metadata(found, _read(stream, position + HEAD.size, length))
        position += HEAD.size + length
    reached_end = position < found.size
    if position > run:
        yield _read(stream, run, position - run)
    if reached_end and not found.ended:
        found.losses.append(Loss("truncated", found.size, "has a damaged or incomplete ending"))
    for offset, index in times.items():
        if offset not in visited:
            found.chunks += 1
            start, end = index.message_start_time, index.message_end_time
            found.losses.append(Loss("crc", offset, "has lost its beginning", start, end, True))


def _head(stream: IO[bytes], position: int, size: int) -> tuple[int, int, Loss | None]:
    """Opcode and length of the record at `position`, refused when it cannot be true."""
    head = _read(stream, position, HEAD.size)
    if len(head) < HEAD.size:
        return 0, 0, Loss("truncated", position, "ends in the middle of its data")
    opcode, length = HEAD.unpack(head)
    if opcode == 0:
        return 0, 0, Loss("crc", position, "holds no record where one should begin")
    if position + HEAD.size + length > size:
        reason = (
            f"holds a record of {length} bytes of which {size - position - HEAD.size} are there"
        )
        return 0, 0, Loss("truncated", position, reason)
    return opcode, length, None


def _unpack(offset: int, body: bytes) -> bytes | Loss:
    """A chunk's records, if its size and its CRC are right."""
    start = end = None
    try:
        start, end, size, crc, named = CHUNK_HEAD.unpack_from(body)
        data_at = CHUNK_HEAD.size + named + 8
        (length,) = struct.unpack_from("<Q", body, data_at - 8)
        if data_at + length > len(body):
            raise ValueError("states a size that cannot be")
        compression = body[CHUNK_HEAD.size : data_at - 8].decode()
        data = _decompressed(compression, body[data_at : data_at + length], size)
        if len(data) != size:
            raise ValueError("does not have the size it states")
        if crc and zlib.crc32(data) != crc:
            raise ValueError("does not match its checksum")
        return data
    except ValueError as error:
        return Loss("crc", offset, str(error), start, end, True)
    except Exception as error:  # zstandard, lz4 and struct each raise their own
        log.debug("chunk at byte %d: %s", offset, error)
        return Loss("crc", offset, "cannot be decompressed", start, end, True)


def _decompressed(compression: str, packed: bytes, size: int) -> bytes:
    """Never more than the chunk states, and that only when the frame agrees: no bombs."""
    if size > MOST_IN_A_CHUNK:
        raise ValueError("states a size that cannot be")
    if compression == "":
        return packed
    if compression == "lz4":
        return lz4.frame.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
    if compression != "zstd":
        raise ValueError(f"is compressed by unknown {compression[:16]!r}")
    stated = zstandard.get_frame_parameters(packed).content_size
    if stated == size:
        return zstandard.ZstdDecompressor().decompress(packed)
    if stated not in (0, zstandard.CONTENTSIZE_UNKNOWN):
        raise ValueError("does not have the size it states")
    return zstandard.ZstdDecompressor().stream_reader(packed).read(size + 1)


def _find_summary(stream: IO[bytes], found: Survey) -> None:
    """Read the summary section, unless there is none or its checksum is wrong."""
    tail = HEAD.size + FOOTER.size + len(MAGIC)
    footer = _read(stream, max(found.size - tail, 0), tail)
    if footer[: HEAD.size] != HEAD.pack(Opcode.FOOTER, FOOTER.size) or footer[-8:] != MAGIC:
        found.ended = False
        return
    start, _, crc = FOOTER.unpack_from(footer, HEAD.size)
    if start == 0:
        return  # written without one, which is no fault
    try:
        section = _read(stream, start, found.size - tail - start)
        if crc and zlib.crc32(section + footer[: HEAD.size + FOOTER.size - 4]) != crc:
            raise ValueError("checksum of the summary")
        found.summary = _parse_summary(section)
    except Exception as error:
        log.debug("summary: %s", error)
        reason = "has a damaged summary; what follows was counted from the data itself"
        found.losses.append(Loss("crc", found.size - tail, reason))


def _parse_summary(section: bytes) -> Summary:
    summary, position = Summary(), 0
    while position + HEAD.size <= len(section):
        opcode, length = HEAD.unpack_from(section, position)
        position += HEAD.size
        if position + length > len(section):
            raise ValueError("a summary record ends beyond the summary")
        record = ReadDataStream(BytesIO(section[position : position + length]))
        position += length
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(record)
            summary.schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(record)
            summary.channels[channel.id] = channel
        elif opcode == Opcode.STATISTICS:
            summary.statistics = Statistics.read(record)
        elif opcode == Opcode.CHUNK_INDEX:
            summary.chunks.append(ChunkIndex.read(record))
        elif opcode == Opcode.METADATA_INDEX:
            summary.metadata_offsets.append(struct.unpack_from("<Q", section, position - length)[0])
    return summary


def definition(found: Survey, opcode: int, body: bytes) -> None:
    """Keep a schema or channel met among the data."""
    if opcode == Opcode.SCHEMA:
        schema = _parsed(Schema, body)
        if schema is not None:
            found.schemas.setdefault(schema.id, schema)
    elif opcode == Opcode.CHANNEL:
        channel = _parsed(Channel, body)
        if channel is not None:
            found.channels.setdefault(channel.id, channel)


def _parsed(kind: type, body: bytes):
    try:
        return kind.read(ReadDataStream(BytesIO(body)))
    except Exception as error:
        log.debug("%s: %s", kind.__name__, error)
        return None


def _note_metadata(found: Survey, body: bytes | None) -> None:
    record = _parsed(Metadata, body) if body is not None else None
    if record is not None:  # of several records of one name the last is the fullest (rosbag2)
        found.metadata[record.name] = record.metadata


def _body_at(stream: IO[bytes], offset: int, size: int, opcode: int) -> bytes | None:
    seen, length, fault = _head(stream, offset, size)
    return _read(stream, offset + HEAD.size, length) if not fault and seen == opcode else None


def _read(stream: IO[bytes], offset: int, length: int) -> bytes:
    stream.seek(offset)
    return stream.read(length)


def _check_magic(path: Path, start: bytes, size: int) -> None:
    if start == MAGIC:
        return
    if size == 0:
        raise LogUnreadable(f"{path} is empty (0 bytes).", hint="copy or record it again.")
    if start[:4] == b"PAR1" or path.suffix.lower() in (".csv", ".parquet", ".txt"):
        raise LogUnreadable(
            f"{path} is a table, not an MCAP log.",
            hint="turn it into a log first: shiplog convert TABLE --profile P --out DIR.",
        )
    shown = start.hex(" ").upper()
    if start[:6] == MAGIC[:6]:
        raise LogUnreadable(
            f"{path} begins with {shown} instead of {MAGIC.hex(' ').upper()}: a line-ending "
            "conversion has stripped its CR bytes, as a git checkout or an FTP transfer in text "
            "mode does. Every such byte in the data is gone too, so the file cannot be mended.",
            hint="copy the original again in binary mode (git: mark *.mcap as binary).",
        )
    if MAGIC.startswith(start):
        raise LogUnreadable(f"{path} is cut off after {size} bytes.", hint="copy it again.")
    raise LogUnreadable(
        f"{path} is no MCAP log: it begins with {shown}, expected {MAGIC.hex(' ').upper()}.",
        hint="give an .mcap file; for a CSV or Parquet table use shiplog convert.",
    )
