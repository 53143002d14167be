"""MCAP records from their bytes: never beyond their end, and whatever a name's bytes are.

The classes are those of the `mcap` library, and so are their fields' order and types. Its readers
believe every length, take what a newer writer appended for the next record, and end at a name that
is not UTF-8; here a record gets its own bytes and no more.
"""

from __future__ import annotations

import logging
import struct
from collections import Counter
from collections.abc import Iterable, Iterator
from io import BytesIO

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Channel, McapRecord, Message, Metadata, Schema

log = logging.getLogger(__name__)

HEAD = struct.Struct("<BQ")  # opcode and length of every record
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
LARGEST_MESSAGE = 32 << 20  # bytes: four times an uncompressed HD image; what is larger is left out
# Records of one kind and length, one behind the other, mostly a single one: opcode, where the first
# body begins, the length of each (of one too large to keep, more than is there), and how many.
Run = tuple[int, int, int, int]
Place = tuple[int, int, int]  # opcode, where the body begins, and where it ends if it is there
ALIKE = 64  # records of one kind and length in a row, after which more of them are looked for
LOOKED_AHEAD = 1024  # of which so many at first, and eight times as many each time
RECORD_TYPES: dict[int, type] = {
    Opcode.SCHEMA: Schema, Opcode.CHANNEL: Channel, Opcode.METADATA: Metadata,
}  # fmt: skip


class TooLarge(bytes):
    """In place of a payload beyond LARGEST_MESSAGE: the message is counted, not kept."""


class Unnamed(Channel):
    """A channel of which only the number can be read."""


class _Body(ReadDataStream):
    def read(self, length: int) -> bytes:
        data = super().read(length)
        if len(data) < length:
            raise EndOfFile
        return data

    def read_prefixed_string(self) -> str:
        return self.read(self.read4()).decode("utf-8", "backslashreplace")


def parsed(kind: type, body: bytes):
    """One record; None where its bytes are not what they say."""
    try:
        return kind.read(_Body(BytesIO(body)))
    except Exception as error:  # the library raises struct.error, EndOfFile and others
        log.debug("%s: %s", kind.__name__, error)
        return None


def record(opcode: int, body: bytes | memoryview, whole: bool = True) -> McapRecord | None:
    """A schema, channel, message or metadata record; None for any other, or where it is broken.

    whole   False where `body` is only the beginning of a message too large to keep
    """
    if opcode == Opcode.MESSAGE:
        if len(body) < MESSAGE.size:
            return None
        channel, sequence, logged, published = MESSAGE.unpack_from(body)
        payload = bytes(body[MESSAGE.size :]) if whole else TooLarge()
        return Message(channel, logged, payload, published, sequence)
    kind = RECORD_TYPES.get(opcode)
    return parsed(kind, bytes(body)) if kind and whole else None


def exact(opcode: int, body: bytes) -> bool:
    """Whether bytes are a schema or a channel from the first to the last, and nothing else."""
    stream = _Body(BytesIO(body))
    try:
        made = RECORD_TYPES[opcode].read(stream)
    except Exception:  # the bytes are anything: whatever the library raises, they are no record
        return False
    return stream.count == len(body) and bool(getattr(made, "topic", None) or made.id)


def unnamed(opcode: int, body: bytes | memoryview) -> Unnamed | None:
    """A broken description of a channel: its messages are counted all the same."""
    if opcode != Opcode.CHANNEL or len(body) < 8:
        return None
    number = int.from_bytes(body[:2], "little")
    return Unnamed(number, f"channel {number} (description damaged)", "", {}, 0)


def split(pieces: Iterable[bytes], size: int) -> Iterator[tuple[memoryview, list[Run]]]:
    """The records in bytes that come in pieces, `size` of them in all: piece by piece.

    Raises ValueError where the bytes are no records.
    """
    kept, skip, taken = b"", 0, 0
    for piece in pieces:
        taken += len(piece)
        if skip >= len(piece):
            skip -= len(piece)
            continue
        data = memoryview(kept + piece[skip:] if kept or skip else piece)
        skip, at, end, rest = 0, 0, len(data), size - taken
        runs: list[Run] = []
        before, alike = -1, 0
        while at + HEAD.size <= end:
            opcode, length = HEAD.unpack_from(data, at)
            begin, stop = at + HEAD.size, at + HEAD.size + length
            if opcode == 0 or stop - end > rest:
                raise ValueError("does not hold sound records")
            if stop <= end:
                alike = alike + 1 if length == before else 0
                before = length
                count = 1 if alike < ALIKE else _alike(data, at, HEAD.size + length)
                runs.append((opcode, begin, length, count))
                stop = at + count * (HEAD.size + length)
            elif length > LARGEST_MESSAGE and end - begin >= MESSAGE.size:
                runs.append((opcode, begin, length, 1))
                skip = stop - end
            else:
                break
            at = stop
        kept = bytes(data[at:]) if at < end else b""
        yield data, runs
    if skip or len(kept) >= HEAD.size:  # fewer bytes than a record has are nothing
        raise ValueError("does not hold sound records")


def _alike(data: memoryview, at: int, step: int) -> int:
    """How many records from `at` on have the same head. Not one by one: three million empty
    messages fit into 13 kB."""
    most, count, look = (len(data) - at) // step, 0, LOOKED_AHEAD
    first = np.frombuffer(data, np.uint8, HEAD.size, at)
    while count < most:
        look = min(look, most - count)
        heads = np.ndarray((look, HEAD.size), np.uint8, data, at + count * step, (step, 1))
        others = np.flatnonzero((heads != first).any(axis=1))
        if len(others):
            return count + int(others[0])
        count, look = count + look, 8 * look
    return count


def places(runs: Iterable[Run]) -> Iterator[Place]:
    """Each record of the runs."""
    for opcode, begin, length, count in runs:
        if count == 1:
            yield opcode, begin, begin + length
            continue
        step = HEAD.size + length
        for at in range(begin, begin + count * step, step):
            yield opcode, at, at + length


def count_messages(data: memoryview, runs: Iterable[Run], counts: Counter[int]) -> list[Run]:
    """Count the messages by channel, and leave what else there is."""
    others: list[Run] = []
    for run in runs:
        opcode, begin, length, count = run
        if opcode != Opcode.MESSAGE:
            others.append(run)
        elif length < MESSAGE.size:
            continue
        elif count == 1:
            counts[data[begin] + 256 * data[begin + 1]] += 1
        else:
            bytes_ = np.ndarray((count, 2), np.uint8, data, begin, (HEAD.size + length, 1))
            found = np.bincount(bytes_[:, 0] + np.uint16(256) * bytes_[:, 1])
            counts.update({int(n): int(found[n]) for n in np.flatnonzero(found)})
    return others
