"""One walk through a log before Rerun sees it: every chunk checked, every message counted.

What needs no other walk is decoded on the way: protobuf messages of which only numbers are wanted,
many at once; and large messages, such as images, whose bytes Rerun would take apart one by one.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import polars as pl
from mcap.opcode import Opcode
from mcap.records import Channel, Message

from shiplog.logs.decoding import ros
from shiplog.logs.decoding.protobuf import ProtobufMessages
from shiplog.logs.decoding.tables import Tables, Tally
from shiplog.logs.mcap_file import chunks, scan
from shiplog.logs.mcap_file.container import Index, Sound
from shiplog.logs.mcap_file.records import MESSAGE
from shiplog.logs.reading import rerun_route, salvage

LARGE_BYTES = 4096  # bytes on average: the package of an encoding is then as fast as copying them
HELD_BYTES = 16 << 20  # bytes of messages that wait to be decoded together
HEADS = np.dtype([
    ("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"),
    ("logged", "<i8"), ("published", "<i8"),
])  # of a message record, before its payload  # fmt: skip


def checked(tables: Tables) -> tuple[Tally, set[str]] | None:
    """The messages of a sound log, and the topics whose tables are filled already.

    The counts are those of the message indexes, and must be those of the statistics. None where
    they are not, or where anything is damaged: the tables are then to be begun anew.
    """
    found, tally, decoded = tables.found, Tally(), _Decoded(tables)
    if rerun_route.suitable(tables).keys() - decoded.channels.keys():
        rerun_route.worker().start()  # Rerun loads while the chunks are checked
    try:
        for item in scan.walk(found):
            if isinstance(item, Index):
                tally.note(item.channel, item.times, known=item.channel in found.channels)
                decoded.take(item)
            elif isinstance(item, Sound):
                decoded.open(item)
        decoded.decode()
    except ValueError:  # what has no checksum is not what its index says
        return None
    stated = found.statistics and found.statistics.channel_message_counts
    counted = stated and {number: count for number, count in stated.items() if count}
    damaged = found.losses or found.unvouched or tally.orphans
    done = {number: one.count for number, one in decoded.channels.items() if one.count}
    if damaged or counted != tally.counts or not done.items() <= tally.counts.items():
        return None
    return tally, {found.channels[number].topic for number in done}


class _Decoded:
    """The channels that are decoded on this walk."""

    def __init__(self, tables: Tables) -> None:
        self.tables = tables
        self.channels = {number: Waiting(tables, number) for number in candidates(tables)}
        self._cdr = {n for n in rerun_route.suitable(tables) if _is_cdr(tables.found.channels[n])}
        self._chunk = np.zeros(0, np.uint8)
        self._held = 0

    def open(self, item: Sound) -> None:
        """The chunk to which the indexes that follow belong. One that is not unpacked at once is
        taken here."""
        self._chunk = np.zeros(0, np.uint8)
        if item.chunk.compression == "" and item.chunk.uncompressed_size <= chunks.AT_ONCE:
            self._chunk = np.frombuffer(item.chunk.data, np.uint8)
            return
        for batch in chunks.contents(item.chunk, only=self.channels.keys() | self._cdr):
            for message in batch:
                if not isinstance(message, Message):
                    continue
                if message.channel_id in self._cdr:
                    self._plain(message.channel_id, np.frombuffer(message.data[:2], np.uint8)[None])
                if message.channel_id in self.channels:
                    self.channels[message.channel_id].take_alone(message)

    def _plain(self, channel: int, begins: np.ndarray) -> None:
        """Keep a channel from Rerun whose payloads [n, 2 bytes] do not all begin as plain CDR:
        compressed ones would be taken for numbers."""
        if begins.shape[1] < 2 or not (
            (begins[:, 0] == 0).all() and np.isin(begins[:, 1], ros.PLAIN).all()
        ):
            self.tables.odd.add(channel)
            self._cdr.discard(channel)

    def take(self, index: Index) -> None:
        """Raises ValueError where a message is not where the index says."""
        asked = index.channel in self.channels or index.channel in self._cdr
        if not asked or not len(self._chunk) or not len(index.times):
            return
        heads, sizes = _heads(self._chunk, index)
        if index.channel in self._cdr:
            least = 2 if sizes.min() >= 2 else 0
            self._plain(index.channel, _windows(self._chunk, least, index.places + HEADS.itemsize))
        if index.channel not in self.channels:
            return
        waiting = self.channels[index.channel]
        if not waiting.suits(sizes):
            del self.channels[index.channel]
            return
        waiting.take(self._chunk, index.places + HEADS.itemsize, heads, sizes)
        self._held += int(sizes.sum()) + salvage.OVERHEAD * len(sizes)
        if self._held >= HELD_BYTES:
            self.decode()

    def decode(self) -> None:
        """Raises ValueError where there are more messages than a log of this size can hold."""
        for waiting in self.channels.values():
            waiting.decode()
        self._held = 0


class Waiting:
    """Messages of one channel until they are decoded together."""

    def __init__(self, tables: Tables, number: int) -> None:
        self.tables, self.channel = tables, tables.found.channels[number]
        reader = tables.decoder(self.channel)
        leaves = tables.leaves(self.channel.topic, reader) if reader else None
        self._flat = reader.flat(leaves or ()) if isinstance(reader, ProtobufMessages) else None
        self.count = 0
        self._large: bool | None = None  # not known before the first of them
        self._messages: list[Message] = []
        self._heads: list[np.ndarray] = []
        self._rows = 0
        self._payloads: dict[int, list[tuple[np.ndarray, np.ndarray]]] = {}  # by their size

    def suits(self, sizes: np.ndarray) -> bool:
        """Whether messages like the first ones are decoded here. What was begun with a chunk that
        is unpacked piece by piece is gone on with: its rows stand in the tables already."""
        if self._large is None:
            begun = self.count > 0 and self._flat is None
            self._large = begun or bool(sizes.mean() >= LARGE_BYTES)
        return self._large or self._flat is not None

    def take(
        self, chunk: np.ndarray, begins: np.ndarray, heads: np.ndarray, sizes: np.ndarray
    ) -> None:
        """Messages [n] whose payloads of `sizes` bytes begin there in the chunk."""
        self.count += len(heads)
        if self._large:
            bounds = zip(heads, begins.tolist(), sizes.tolist(), strict=True)
            self._messages += [_message(head, chunk[at : at + size]) for head, at, size in bounds]
            return
        self._heads.append(heads)
        for size in np.unique(sizes).tolist():
            rows = np.flatnonzero(sizes == size)
            self._payloads.setdefault(size, []).append(
                (rows + self._rows, _windows(chunk, size, begins[rows]))
            )
        self._rows += len(heads)

    def take_alone(self, message: Message) -> None:
        """One of a chunk that is unpacked piece by piece."""
        self._decode_flat()
        self.count += 1
        self._messages.append(message)
        if len(message.data) * len(self._messages) >= salvage.BATCH_BYTES:
            self.decode()

    def decode(self) -> None:
        self._decode_flat()
        met, self._messages = self._messages, []
        if met:
            logged = salvage.nanoseconds([message.log_time for message in met])
            salvage.decode(self.tables, self.channel, met, logged)

    def _decode_flat(self) -> None:
        if not self._rows or self._flat is None:
            return
        self.tables.room -= self._rows
        if self.tables.room < 0:
            raise ValueError("more messages than a log of this size can hold")
        heads, topic = np.concatenate(self._heads), self.channel.topic
        frame, bad = self._flat.columns(self._rows, self._payloads)
        if bad.any():
            self.tables.failed[topic] = self.tables.failed.get(topic, 0) + int(bad.sum())
        logged, published = (pl.Series(heads[name][~bad]) for name in ("logged", "published"))
        self.tables.add(topic, frame, logged, published)
        self._heads, self._rows, self._payloads = [], 0, {}


def _is_cdr(channel: Channel) -> bool:
    return channel.message_encoding == "cdr"


def candidates(tables: Tables) -> list[int]:
    """Channels with messages, alone on a wanted topic, that may be decoded here."""
    channels, stated = tables.found.channels, tables.found.statistics
    counts = stated.channel_message_counts if stated else {}
    alone = Counter(channel.topic for channel in channels.values())
    return [
        number
        for number, channel in channels.items()
        if counts.get(number) and alone[channel.topic] == 1 and _may(tables, channel)
    ]


def _may(tables: Tables, channel: Channel) -> bool:
    reader = tables.decoder(channel)
    if reader is None:
        return False
    leaves = tables.leaves(channel.topic, reader)
    flat = isinstance(reader, ProtobufMessages) and reader.flat(leaves or ()) is not None
    return flat or bool(reader.bulk)


def _heads(chunk: np.ndarray, index: Index) -> tuple[np.ndarray, np.ndarray]:
    """The heads of the messages that an index names in a chunk, and their payloads' bytes."""
    last = len(chunk) - HEADS.itemsize
    if index.places.min() < 0 or index.places.max() > last:
        raise ValueError("an index that points beyond its chunk")
    heads = np.ndarray(last + 1, HEADS, chunk, strides=(1,))[index.places]
    room = len(chunk) - index.places - (HEADS.itemsize - MESSAGE.size)
    true = (heads["opcode"] == Opcode.MESSAGE) & (heads["channel"] == index.channel)
    true &= (heads["logged"] == index.times) & (heads["length"] >= MESSAGE.size)
    true &= heads["length"] <= room.astype(np.uint64)
    if not true.all():
        raise ValueError("an index of other messages")
    return heads, heads["length"].astype(np.int64) - MESSAGE.size


def _windows(chunk: np.ndarray, size: int, begins: np.ndarray) -> np.ndarray:
    """Bytes [n, size] of a chunk from each of the places on."""
    if size == 0:
        return np.zeros((len(begins), 0), np.uint8)
    windows = np.ndarray(len(chunk) - size + 1, f"V{size}", chunk, strides=(1,))
    return windows[begins].view(np.uint8).reshape(-1, size)


def _message(head: np.void, payload: np.ndarray) -> Message:
    logged, published = int(head["logged"]), int(head["published"])
    return Message(
        int(head["channel"]), logged, payload.tobytes(), published, int(head["sequence"])
    )
