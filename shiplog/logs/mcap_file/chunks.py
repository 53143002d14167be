"""Chunks unpacked within limits: their size, their CRC and their records checked before use.

A size is a claim: a few kilobytes can state gigabytes, or unpack to them without stating it. So
small chunks are unpacked at once, up to what they state, and large ones piece by piece, twice:
first to check them, then for their records.
"""

from __future__ import annotations

import logging
import struct
import zlib
from collections import Counter
from collections.abc import Container, Iterable, Iterator
from dataclasses import replace
from itertools import islice

import lz4.frame
import zstandard
from mcap.opcode import Opcode
from mcap.records import Chunk, McapRecord

from shiplog.logs.mcap_file import records
from shiplog.logs.mcap_file.container import Alone
from shiplog.logs.mcap_file.records import places

log = logging.getLogger(__name__)

FIXED = struct.Struct("<QQQII")  # times, size, CRC, and how long the compression's name is
LENGTH = struct.Struct("<Q")  # of the packed records, behind the compression's name
FIXED_BYTES = FIXED.size + LENGTH.size
LONGEST_NAME = 16  # of a compression
MOST_IN_A_CHUNK = 1 << 30  # bytes; writers make chunks of 1 to 10 MB
AT_ONCE = 16 << 20  # bytes of a chunk that is unpacked at once
PIECE = 4 << 20  # bytes of a larger one that are unpacked at a time
ZSTD_WINDOW_BYTES = 128 << 20  # bytes that zstd may keep to look back into, its own default
BATCH_RECORDS = 10_000  # records handed on at once


def stated(head: bytes, length: int) -> tuple[int, int, int] | None:
    """Where the packed records begin, their unpacked size and CRC; None: this is no chunk.

    head    [>= FIXED_BYTES + LONGEST_NAME bytes, or all that there are] of a body of `length` bytes
    """
    if len(head) < FIXED_BYTES:
        return None
    *_, size, crc, name = FIXED.unpack_from(head)
    begin = FIXED_BYTES + name
    if name > LONGEST_NAME or len(head) < begin:
        return None
    (packed,) = LENGTH.unpack_from(head, begin - LENGTH.size)
    return (begin, size, crc) if begin + packed <= length else None


def chunk(body: bytes) -> Chunk | None:
    """A chunk record; None where its lengths contradict each other."""
    where = stated(body[: FIXED_BYTES + LONGEST_NAME], len(body))
    if where is None:
        return None
    start, end, size, crc, name = FIXED.unpack_from(body)
    begin = where[0]
    (packed,) = LENGTH.unpack_from(body, begin - LENGTH.size)
    compression = body[FIXED.size : FIXED.size + name].decode("utf-8", "backslashreplace")
    data = memoryview(body)[begin : begin + packed]  # no copy: it may be megabytes
    # mcap declares bytes, and uses nothing of them here that a view has not
    return Chunk(compression, data, end, start, crc, size)  # type: ignore[arg-type]


def opened(packed: Chunk) -> Chunk:
    """The chunk, checked; unpacked where it is small. Raises ValueError saying what is wrong."""
    size, crc = packed.uncompressed_size, packed.uncompressed_crc
    if size > MOST_IN_A_CHUNK:
        raise ValueError("states a size that cannot be")
    try:
        if size <= AT_ONCE:
            data = _at_once(packed)
            if len(data) != size:
                raise ValueError("does not have the size it states")
            if crc and zlib.crc32(data) != crc:
                raise ValueError("does not match its checksum")
            return replace(packed, compression="", data=data)
        for _ in records.split(_checked(packed), size):
            pass
        return packed
    except ValueError:
        raise
    except Exception as error:  # zstandard and lz4 each raise their own
        log.debug("a chunk: %s", error)
        raise ValueError("cannot be decompressed") from error


def contents(
    sound: Chunk, counts: Counter[int] | None = None, only: Container[int] | None = None
) -> Iterator[list[McapRecord]]:
    """Schemas, channels and messages of an opened chunk, in batches; all of them or none.

    counts  messages by channel so far: they are then counted here, and not handed on
    only    channels whose messages are handed on, if not all
    Raises ValueError where the bytes are no records, before any is handed on.
    """
    size = sound.uncompressed_size
    if size <= AT_ONCE:  # a larger one was checked when it was opened
        for _ in records.split(_unpacked(sound), size):
            pass
    for data, runs in records.split(_unpacked(sound), size):
        if counts is not None:
            runs = records.count_messages(data, runs, counts)
        bodies = ((opcode, data[at:to], to <= len(data)) for opcode, at, to in places(runs))
        made = _made(bodies, only)
        while batch := list(islice(made, BATCH_RECORDS)):
            yield batch


def message_counts(sound: Chunk) -> Counter[int]:
    """How many messages each channel has in an opened chunk. Raises ValueError as `contents`."""
    counts: Counter[int] = Counter()
    for data, runs in records.split(_unpacked(sound), sound.uncompressed_size):
        records.count_messages(data, runs, counts)
    return counts


def alone(item: Alone, counts: Counter[int] | None) -> Iterator[McapRecord]:
    """The same of a record that stands in no chunk."""
    body = memoryview(item.body)
    if item.opcode == Opcode.MESSAGE and counts is not None:
        records.count_messages(body, [(item.opcode, 0, len(body), 1)], counts)
        return iter(())
    return _made([(item.opcode, body, item.whole)])


def _made(
    bodies: Iterable[tuple[int, memoryview, bool]], only: Container[int] | None = None
) -> Iterator[McapRecord]:
    for opcode, body, whole in bodies:
        message = opcode == Opcode.MESSAGE and len(body) >= records.MESSAGE.size
        if only is not None and message and body[0] + 256 * body[1] not in only:
            continue
        made = records.record(opcode, body, whole) or records.unnamed(opcode, body)
        if made is not None:
            yield made


def _at_once(packed: Chunk) -> bytes:
    """Never more than the chunk states, and that only when the frame agrees."""
    size = packed.uncompressed_size
    if packed.compression == "":
        return packed.data
    if packed.compression == "zstd":
        framed = zstandard.get_frame_parameters(packed.data).content_size
        if framed == size:
            return zstandard.ZstdDecompressor().decompress(packed.data)
        if framed not in (0, zstandard.CONTENTSIZE_UNKNOWN):
            raise ValueError("does not have the size it states")
    return b"".join(_unpacked(packed))


def _checked(packed: Chunk) -> Iterator[bytes]:
    """The same; raises ValueError at the end where the CRC is another one."""
    found = 0
    for piece in _unpacked(packed):
        found = zlib.crc32(piece, found)
        yield piece
    if packed.uncompressed_crc not in (0, found):
        raise ValueError("does not match its checksum")


def _unpacked(packed: Chunk) -> Iterator[bytes]:
    """A chunk's bytes in pieces. Raises ValueError where they are not as many as it states."""
    unpacked = 0
    for piece in _pieces(packed, min(packed.uncompressed_size + 1, PIECE)):
        unpacked += len(piece)
        if unpacked > packed.uncompressed_size:
            break
        yield piece
    if unpacked != packed.uncompressed_size:
        raise ValueError("does not have the size it states")


def _pieces(packed: Chunk, most: int) -> Iterator[bytes]:
    """A chunk's bytes, never more than `most` of them at once."""
    if packed.compression == "" and len(packed.data) <= AT_ONCE:
        yield packed.data
    elif packed.compression == "":
        for at in range(0, len(packed.data), most):
            yield packed.data[at : at + most]
    elif packed.compression == "lz4":
        frame = lz4.frame.LZ4FrameDecompressor()
        piece = frame.decompress(packed.data, max_length=most)
        while piece:
            yield piece
            piece = b"" if frame.eof else frame.decompress(b"", max_length=most)
    elif packed.compression == "zstd":
        whole = zstandard.ZstdDecompressor(max_window_size=ZSTD_WINDOW_BYTES).stream_reader(
            packed.data
        )
        while piece := whole.read(most):
            yield piece
    else:
        raise ValueError(f"is compressed by unknown {packed.compression[:16]!r}")
