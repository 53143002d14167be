"""One walk through a log that yields what is sound, wherever it stands.

Records follow each other as long as their lengths are true. Where one is not, everything since the
last sound item is searched for the next one: a chunk whose CRC is right, a chunk that the summary
knows, the beginning of another log. So damage costs what it hit, and no more.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, TypeVar

from mcap.opcode import Opcode
from mcap.records import Header, Metadata

from shiplog.logs.mcap_file import beginnings, chunks, records, sound_messages
from shiplog.logs.mcap_file.container import (
    LARGEST_SUMMARY,
    LOOSE,
    SECTION,
    SUMMED,
    Alone,
    Index,
    Loss,
    Sound,
    Survey,
    head,
    held_by,
    index_of,
    lost,
    note,
    read_at,
    read_summary,
)  # fmt: skip
from shiplog.logs.mcap_file.read_ahead import ReadAhead
from shiplog.logs.mcap_file.records import HEAD, MESSAGE, parsed
from shiplog.logs.mcap_file.refusals import MAGIC, check_file, refusal

Item = Sound | Index | Alone
Taken = TypeVar("Taken", Sound, Alone)

LONGEST_ALONE = 1_000_000  # bytes of a message that a search takes: in most bytes is no message
LEAST_DESCRIPTION, LARGEST_DESCRIPTION = 14, 1 << 22  # bytes; large schemas have 100 kB
NEAR_NS = 10**14  # 28 h: how far from the others the log time of such a message may be
LONGEST_FOOTER = 64  # bytes, of which 20 are known
# What may be unpacked: real logs are packed to a tenth, seldom to a fiftieth, of their size.
MOST_WORK, MOST_RATIO = 8 << 30, 50


def survey(path: Path) -> Survey:
    """Open a log: its magic, its header and every description that it holds.

    Raises LogUnreadable for what is no log and holds nothing of one.
    """
    check_file(path)
    found = Survey(path, path.stat().st_size)
    with path.open("rb") as stream:
        refused = refusal(path, stream.read(len(MAGIC)), found.size)
        if refused is not None:
            first = None if refused.final else _first_sound(stream, found)
            if first is None:
                raise refused.error
            found.begin = first
        read_summary(stream, found)
        opcode, length, fault = head(stream, found.begin, found.size)
        if fault is None and opcode == Opcode.HEADER and length <= LARGEST_SUMMARY:
            found.header = parsed(Header, stream.read(length)) or found.header
    if not found.described:
        _describe(found)
    return found


def _first_sound(stream: IO[bytes], found: Survey) -> int | None:
    """Where the first thing that can be read stands in a file without a log's magic."""
    found.end = found.size
    try:
        return _Walk(stream, found, ReadAhead(stream, found.path, {})).next_sound(0)
    except _Enough:
        return None


def _describe(found: Survey) -> None:
    """Walk once for the descriptions alone: one may stand behind the messages that need it."""
    state = found.path.stat()
    key = (str(found.path.resolve()), state.st_size, state.st_mtime_ns, state.st_ino)
    if _last.get("key") != key:
        trial = replace(found, losses=[], metadata=dict(found.metadata))
        counts: Counter[int] = Counter()
        for item in walk(trial):
            if not isinstance(item, Index):
                for _ in sound_messages.messages_of(trial, item, counts):
                    pass
        trial.counts = {n: count for n, count in counts.items() if n in trial.channels}
        _last.update(key=key, trial=trial)
    trial = _last["trial"]
    for name in ("schemas", "channels", "metadata", "beliefs", "counts"):
        setattr(found, name, dict(getattr(trial, name)))
    found.sections = trial.sections
    if found.sections > 1:  # each has its own, and none of them speaks for the file
        found.losses, found.statistics = [], None


_last: dict[str, Any] = {}  # the walk of `_describe`: a command opens one log several times


def walk(found: Survey) -> Iterator[Item]:
    """All that is sound, in file order; `found` is brought up to date on the way."""
    with found.path.open("rb") as stream, ReadAhead(stream, found.path, found.indexed) as ahead:
        yield from _Walk(stream, found, ahead).items()


class _Enough(Exception):
    """More was unpacked than a log of this size can hold."""


class _Walk:
    def __init__(self, stream: IO[bytes], found: Survey, ahead: ReadAhead) -> None:
        self.stream, self.found, self.ahead = stream, found, ahead
        self.anchor = found.begin  # what stands before has been handed on, or its loss is known
        self.section, self.closed, self.begun, self.chunked = 0, False, False, False
        self.past_data = False  # behind a DATA_END: what is broken there is no message
        self.visited: set[int] = set()
        self.searched = found.begin  # nothing sound begins between the anchor and here
        self.starts, self.hints = sorted(found.indexed), sorted(found.hinted)
        self.low: int | None = None  # ns, log times of the messages so far
        self.high = 0
        self.lost: Loss | None = None  # the chunk before, if it was not sound
        self.open: int | None = None  # of the losses, the one whose end in time is not known yet
        self.work = MOST_WORK + MOST_RATIO * found.size

    def items(self) -> Iterator[Item]:
        found = self.found
        if read_at(self.stream, 0, len(MAGIC)) != MAGIC:
            found.losses.append(Loss("crc", 0, "does not begin as an MCAP log does"))
        position: int | None = found.begin
        try:
            while position is not None and position < found.end:
                fault, item, after = self._step(position)
                if fault is not None:
                    position = self._resume(position, fault)
                    continue
                if item is not None:
                    yield item
                position = after
        except _Enough:
            reason = "unpacks to far more than a log of its size can; what follows was not read"
            found.losses.append(Loss("crc", self.anchor, reason, start=self.high))
        self._finish()

    def _step(self, position: int) -> tuple[Loss | None, Item | None, int]:
        """What stands at `position`: a fault, or an item or none and where the next record is."""
        found = self.found
        if read_at(self.stream, position, len(MAGIC)) == MAGIC:
            self.closed = self.begun
            return None, None, position + len(MAGIC)
        opcode, length, fault = head(self.stream, position, found.size)
        after = position + HEAD.size + length
        bad = None
        if fault is None and opcode == Opcode.CHUNK:
            bad = self._open(position, length)
            if isinstance(bad, Sound):
                return None, self._take(bad, bad.end), after
        entry, hint = found.indexed.get(position), found.hinted.get(position)
        whole = entry.chunk_length if entry else hint
        if whole and (fault or opcode != Opcode.CHUNK or after != position + whole):
            sound = self._open(position, whole - HEAD.size)
            if isinstance(sound, Sound) and (entry or sound.chunk.uncompressed_crc):
                after = position + whole
                return None, self._take(sound, after), after
        if fault is not None:
            return fault, None, 0
        beyond = bisect_right(self.starts, position)
        if beyond < len(self.starts) and after > self.starts[beyond]:
            reason = f"holds a record of {length} bytes that reaches into the next chunk"
            return Loss("crc", position, reason), None, 0
        if isinstance(bad, Loss):
            self._lose(bad)
            if bad.start is not None:  # its lengths are true: what is in it, its CRC speaks against
                self.searched = after
            return None, None, after
        item = self._other(position, opcode, length)
        if item is None and opcode != Opcode.ATTACHMENT:  # which may hold a whole log
            if self.next_sound(max(self.anchor, self.searched), after) is not None:
                return Loss("crc", position, "holds a record that reaches over others"), None, 0
            self.searched = after
        return None, item, after

    def _other(self, position: int, opcode: int, length: int) -> Item | None:
        """A record that is no chunk."""
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            whole = length <= records.LARGEST_MESSAGE
            body = self._body(position, length if whole else MESSAGE.size)
            self.found.unvouched |= opcode == Opcode.MESSAGE
            item = Alone(position, self._number(), opcode, body, whole)
            if self._certain(item):
                return self._take(item, position + HEAD.size + length)
            if position == self.found.begin:  # a damaged header
                return None
            return self._mistaken(position, length) or self._take(item, self.anchor)
        if opcode == Opcode.MESSAGE_INDEX and length <= LARGEST_SUMMARY:
            index = next(index_of(self._body(position, length), self.section), None)
            if index is not None and self.lost is not None:
                held = self.lost.held
                held[index.channel] = held.get(index.channel, 0) + len(index.times)
                return None
            return index or self._mistaken(position, length)
        if opcode == Opcode.METADATA and length <= LARGEST_SUMMARY:
            note(self.found, parsed(Metadata, self._body(position, length)), LOOSE)
        self.past_data |= opcode == Opcode.DATA_END and length <= LONGEST_FOOTER
        return self._mistaken(position, length)

    def _mistaken(self, position: int, length: int) -> Sound | None:
        """The chunk that a record of another kind is, when only its opcode is damaged."""
        sound = self._vouched(position, length)
        return self._take(sound, sound.end) if sound else None

    def _vouched(self, position: int, length: int) -> Sound | None:
        """The chunk with a right CRC whose body of this length follows the head at `position`."""
        sound = self._open(position, length)
        return sound if isinstance(sound, Sound) and sound.chunk.uncompressed_crc else None

    def _take(self, item: Taken, after: int) -> Taken:
        """Note where a sound item ends, and what it says of time."""
        self.anchor, self.begun, self.lost = after, True, None
        times: tuple[int, ...] = ()
        if isinstance(item, Sound):
            self.chunked, self.past_data = True, False
            self.found.chunks += 1
            self.visited.add(item.offset)
            times = (item.chunk.message_start_time, item.chunk.message_end_time)
        elif item.opcode == Opcode.MESSAGE and len(item.body) >= MESSAGE.size:
            times = (MESSAGE.unpack_from(item.body)[2],)
            self.past_data = False
        if times:
            if self.open is not None:
                losses = self.found.losses
                losses[self.open] = replace(losses[self.open], end=times[0])
                self.open = None
            self.low = times[0] if self.low is None else min(self.low, times[0])
            self.high = max(self.high, times[-1])
        return item

    def _certain(self, item: Alone) -> bool:
        """Whether it is a description to its last byte, or a message of a known channel."""
        if item.opcode != Opcode.MESSAGE:
            return records.exact(item.opcode, item.body)
        if len(item.body) < MESSAGE.size:
            return False
        return MESSAGE.unpack_from(item.body)[0] + item.section * SECTION in self.found.channels

    def _number(self) -> int:
        """The section of what is handed on now; a closing magic before it begins another."""
        if self.closed:
            self.closed = self.past_data = False
            self.section += 1
            self.found.sections = max(self.found.sections, self.section + 1)
            for record in self.found.summed:
                note(self.found, record, SUMMED, self.section)
        return self.section

    def _open(self, position: int, length: int) -> Sound | Loss:
        """The chunk whose body of this length follows the head at `position`, checked."""
        most = chunks.FIXED_BYTES + chunks.LONGEST_NAME
        start = read_at(self.stream, position + HEAD.size, most)
        if chunks.stated(start[: max(length, 0)], length) is None:
            return Loss("crc", position, "states a size that cannot be", chunk=True)
        packed = chunks.chunk(self.ahead.body(position, length))
        if packed is None:
            return Loss("crc", position, "ends in the middle of its data", chunk=True)
        if packed.uncompressed_size <= chunks.MOST_IN_A_CHUNK:  # else it is not unpacked
            self.work -= packed.uncompressed_size
        if self.work < 0:
            raise _Enough
        try:
            opened = self.ahead.opened(position, packed)
        except ValueError as error:
            return lost(position, str(error), packed)
        begin = chunks.FIXED_BYTES + len(packed.compression.encode())
        end = position + HEAD.size + begin + len(packed.data)
        return Sound(position, self._number(), opened, end)

    def _body(self, position: int, length: int) -> bytes:
        return read_at(self.stream, position + HEAD.size, length)

    def _lose(self, loss: Loss) -> None:
        """A chunk at its place that is not sound; the indexes behind it say what it held."""
        self.found.chunks += 1
        self.visited.add(loss.offset)
        entry = self.found.indexed.get(loss.offset)
        loss = replace(loss, held=held_by(entry))
        self.found.losses.append(loss)
        self.lost = loss

    def _resume(self, position: int, fault: Loss) -> int | None:
        """Note a fault, unless it is noted elsewhere, and find where it goes on."""
        found = self.found
        after = self.next_sound(self.anchor)
        known = position in found.indexed or any(x.offset == position for x in found.losses)
        if not known and not self.past_data and not self.closed:
            kind = fault.kind if after is None else "crc"
            self.open = len(found.losses)
            found.losses.append(replace(fault, kind=kind, start=self.high or None))
        self.lost = None
        if after is not None:  # the next search begins behind it, whatever it turns out to be
            self.anchor = after + 1
        return after

    def next_sound(self, start: int, end: int | None = None) -> int | None:
        """Where the next chunk, message or log begins that can be read, from `start` on; before
        `end`, where one is given."""
        end = self.found.end if end is None else min(end, self.found.end)
        limit = next(filter(self._indexed, beginnings.select_range(self.starts, start, end)), end)
        limit = next(filter(self._hinted, beginnings.select_range(self.hints, start, limit)), limit)
        for at, kind in beginnings.beginnings(self.stream, start, limit):
            if kind == Opcode.CHUNK and self._checked(at):
                return at
            if kind == Opcode.MESSAGE and self._plausible(at):
                return at
            if kind in (Opcode.SCHEMA, Opcode.CHANNEL) and self._described(at, kind):
                return at
            if kind == Opcode.HEADER:
                return at
        return limit if limit < end else None

    def _indexed(self, position: int) -> bool:
        length = self.found.indexed[position].chunk_length - HEAD.size
        return isinstance(self._open(position, length), Sound)

    def _hinted(self, position: int) -> bool:
        """Whether a chunk stands where a damaged summary says so: its CRC has to be right."""
        length = self.found.hinted[position] - HEAD.size
        self.work -= length  # a damaged summary may name one place a million times over
        return self._vouched(position, length) is not None

    def _checked(self, position: int) -> bool:
        """Whether a chunk stands here whose CRC is right, and is one."""
        _, length, fault = head(self.stream, position, self.found.size)
        if fault is not None or length <= chunks.FIXED_BYTES:
            return False
        self.work -= chunks.FIXED_BYTES
        return self._vouched(position, length) is not None

    def _plausible(self, position: int) -> bool:
        """Whether a message may stand here; only where there are no chunks, which vouch for it."""
        _, length, fault = head(self.stream, position, self.found.size)
        if self.chunked or fault or not MESSAGE.size <= length < LONGEST_ALONE or self.low is None:
            return False
        channel, _, time, _ = MESSAGE.unpack(self._body(position, MESSAGE.size))
        known = channel + self.section * SECTION in self.found.channels
        return known and self.low - NEAR_NS <= time <= self.high + NEAR_NS

    def _described(self, position: int, opcode: int) -> bool:
        """Whether a description stands here: its lengths fill its record to the last byte."""
        _, length, fault = head(self.stream, position, self.found.size)
        if fault or not LEAST_DESCRIPTION <= length <= LARGEST_DESCRIPTION:
            return False
        self.work -= length
        return records.exact(opcode, self._body(position, length))

    def _finish(self) -> None:
        """What only the end shows: a missing ending, and indexed chunks that were not met."""
        found = self.found
        if not found.ended and not any(loss.kind == "truncated" for loss in found.losses):
            found.losses.append(Loss("truncated", found.size, "has a damaged or incomplete ending"))
        for offset, entry in found.indexed.items():
            if offset not in self.visited:
                found.chunks += 1
                found.losses.append(
                    replace(lost(offset, "has lost its beginning", entry), held=held_by(entry))
                )
