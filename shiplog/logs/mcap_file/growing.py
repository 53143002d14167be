"""An MCAP file that a recorder still writes: what was appended since the last look.

Records are taken as soon as they are whole; half a record waits for its other half. A chunk whose
checksum is wrong is counted as lost and passed over. Bytes that are no record end the reading of
this file: where the next one begins is then not known, and `ingest` searches for it afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import IO

from mcap.opcode import Opcode
from mcap.records import Message

from shiplog.logs.mcap_file import chunks, sound_messages
from shiplog.logs.mcap_file.container import Alone, Loss, Sound, Survey, lost
from shiplog.logs.mcap_file.records import HEAD
from shiplog.logs.mcap_file.refusals import MAGIC, refusal

READ_BYTES = 1 << 20  # of one look: some seconds of a ship's log, a few MB once unpacked
LARGEST_RECORD = 1 << 30  # bytes, as of a chunk: what states more is no record
ALONE = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.METADATA)


class GrowingFile:
    """The messages that were appended, look by look; `found` has the descriptions so far.

    at       byte up to which all was read: from there another process can go on, once it has read
             the descriptions before it
    ended    the recorder has closed the file
    damaged  why nothing behind `at` can be read; empty where it can
    """

    def __init__(self, path: Path) -> None:
        self.path, self.at = path, 0
        self.found = Survey(path, 0)
        self.ended, self.damaged = False, ""

    def look(self, most: int = READ_BYTES) -> Iterator[list[Message]]:
        """The messages of all whole records in the next `most` bytes, or of one larger record, in
        batches. Raises LogUnreadable for a file that is no log, and OSError."""
        if self.damaged:
            return
        with self.path.open("rb") as stream:
            size = stream.seek(0, 2)
            stop = min(size, self.at + most)
            while self.at < size and not self.damaged:
                item, after = self._next(stream, size)
                if after is None:
                    return
                self.at = after
                if item is not None:
                    yield from filter(None, sound_messages.messages_of(self.found, item))
                if self.at >= stop:
                    return

    def _next(self, stream: IO[bytes], size: int) -> tuple[Sound | Alone | None, int | None]:
        """What stands at `at`, if it is of use, and the byte behind it; None while it is not
        whole."""
        stream.seek(self.at)
        if self.at == 0 or self.ended:
            return None, self._magic(stream, size)
        head = stream.read(HEAD.size)
        if len(head) < HEAD.size:
            return None, None
        opcode, length = HEAD.unpack(head)
        if opcode == 0 or length > LARGEST_RECORD:
            self.damaged = f"at byte {self.at} it holds no record"
            self.found.losses.append(Loss("crc", self.at, self.damaged))
            return None, None
        offset, end = self.at, self.at + HEAD.size + length
        if end > size:
            return None, None
        if opcode == Opcode.FOOTER:
            end += len(MAGIC)
            self.ended = size >= end
            return None, end if self.ended else None
        if opcode == Opcode.CHUNK:
            return self._chunk(stream.read(length), offset, end), end
        if opcode in ALONE:
            return Alone(offset, 0, opcode, stream.read(length), True), end
        return None, end

    def _magic(self, stream: IO[bytes], size: int) -> int | None:
        """Past the magic with which a log begins, also one that was appended to another."""
        start = stream.read(len(MAGIC))
        if len(start) < len(MAGIC):
            return None
        refused = refusal(self.path, start, size)
        if refused is not None and self.at == 0:
            raise refused.error
        if refused is not None:
            self.damaged = f"at byte {self.at} another file was appended, which is no log"
            return None
        if self.ended:  # its channels have numbers of their own
            self.found = Survey(self.path, 0, metadata=dict(self.found.metadata))
            self.ended = False
        return self.at + len(MAGIC)

    def _chunk(self, body: bytes, offset: int, end: int) -> Sound | None:
        packed = chunks.chunk(body)
        if packed is None:
            self.found.losses.append(Loss("crc", offset, "holds a chunk that is none", chunk=True))
            return None
        self.found.chunks += 1
        try:
            return Sound(offset, 0, chunks.opened(packed), end)
        except ValueError as error:
            self.found.losses.append(lost(offset, f"holds a chunk that {error}", packed))
            return None
