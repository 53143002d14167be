"""One table a topic, of the requested columns, whichever reader its rows came from."""

from __future__ import annotations

import logging
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from mcap.records import Channel

from shiplog.logs.decoding import fields
from shiplog.logs.decoding.decoders import decoder
from shiplog.logs.decoding.fields import is_text, locate, parsed, stamp_leaves, value
from shiplog.logs.decoding.messages import Decoder, Undecodable
from shiplog.logs.mcap_file.container import Survey

# Rows go with the file's size, not with its messages: three million empty messages fit into
# 13 kB. Messages of instruments take 5 bytes and more, however well they are packed.
LEAST_ROWS, ROWS_PER_BYTE = 1_000_000, 0.5
MOST_STEPS = 20  # steps back of a channel that are kept: more are disorder, and no restart

log = logging.getLogger(__name__)


def room(found: Survey) -> int:
    """Rows that a log of this size can have."""
    return LEAST_ROWS + int(ROWS_PER_BYTE * found.size)


CHANNEL = ":channel"  # asked for as a field: by which of a topic's channels each message came
TIME_COLUMNS = ("log_time", "publish_time", "stamp")


@dataclass(slots=True)
class Table:
    """One topic's rows so far."""

    parts: list[pl.DataFrame] = field(default_factory=list)
    texts: set[str] = field(default_factory=set)  # columns taken out of JSON, typed at the end
    counts: dict[int, pl.Series] = field(default_factory=dict)  # stamps as numbers, by part

    def finish(self) -> pl.DataFrame:
        self._date()
        parts, self.parts = self.parts, []
        frame = parts[0] if len(parts) == 1 else _joined(parts)
        parts.clear()
        for name in self.texts & set(frame.columns):
            frame = frame.with_columns(parsed(frame[name]))
        times = frame["log_time"]
        return frame if times.is_sorted() else frame.sort("log_time", maintain_order=True)

    def _date(self) -> None:
        """Stamps that are numbers, in the unit of all of them; a batch may be of a few strays."""
        if not self.counts:
            return
        logged = pl.concat([self.parts[number]["log_time"] for number in self.counts])
        every = pl.concat([c.cast(pl.Float64).fill_nan(None) for c in self.counts.values()])
        unit = fields.unix_unit(every, logged)
        if unit is not None:
            for number, counts in self.counts.items():
                stamp = fields.instants(counts, unit)
                self.parts[number] = self.parts[number].with_columns(stamp=stamp)
        self.counts.clear()


@dataclass(slots=True)
class Order:
    """Whether a channel's messages were written in the order of their log time."""

    last: int
    back: int = 0  # how many steps back in time
    largest: int = 0  # ns
    first: int = 0  # ns, the first log time
    # steps back: log times before and after [ns], and how many messages came before
    steps: list[tuple[int, int, int]] = field(default_factory=list)


@dataclass(slots=True)
class Tally:
    """The messages of a log, counted by channel."""

    counts: dict[int, int] = field(default_factory=dict)
    order: dict[int, Order] = field(default_factory=dict)
    first: int | None = None
    orphans: int = 0  # messages of channels that nothing defines

    def note(self, channel: int, times: np.ndarray, known: bool) -> None:
        """Count messages by their log times [n], in file order."""
        if not known:
            self.orphans += len(times)
        if not known or not len(times):
            return
        so_far = self.counts.get(channel, 0)
        self.counts[channel] = so_far + len(times)
        earliest = int(times.min())
        self.first = earliest if self.first is None else min(self.first, earliest)
        order = self.order.setdefault(channel, Order(int(times[0]), first=int(times[0])))
        steps = np.diff(times, prepend=order.last)
        order.back += int((steps < 0).sum())
        order.largest = max(order.largest, -int(steps.min()))
        for at in np.flatnonzero(steps < 0)[: MOST_STEPS - len(order.steps)].tolist():
            before = int(times[at - 1]) if at else order.last
            order.steps.append((before, int(times[at]), so_far + at))
        order.last = int(times[-1])

    def add(self, channel: int, count: int, known: bool) -> None:
        """Count messages of which nothing else is known."""
        if known:
            self.counts[channel] = self.counts.get(channel, 0) + count
        else:
            self.orphans += count


class Tables:
    """What is wanted of a log, how its topics are decoded, and the rows that there are."""

    def __init__(
        self, found: Survey, wanted: Mapping[str, Collection[str]] | None, others: bool = False
    ) -> None:
        """wanted, others   as `read` has them"""
        self.found, self.wanted, self.others = found, wanted, others
        self.failed: dict[str, int] = {}  # messages by topic whose payload did not decode
        self.too_large: dict[str, int] = {}  # messages by topic that were not kept
        self.too_many: dict[str, int] = {}  # likewise, for being more than a log of this size holds
        self.room = room(found)  # rows that may still come
        self.undecodable: dict[str, str] = {}
        self.odd: set[int] = set()  # channels whose payloads no other reader may be given
        self._tables: dict[str, Table] = {}
        self._decoders: dict[int, Decoder | None] = {}
        self._shared: dict[tuple, Decoder | Undecodable] = {}

    def finish(self, first: Collection[str] = ()) -> dict[str, pl.DataFrame]:
        """The tables by topic; those in `first` before the others, in the order of the log's
        channels, whichever reader was the first to end."""
        named = [channel.topic for channel in self.found.channels.values()]
        order = dict.fromkeys([*(topic for topic in named if topic in first), *self._tables])
        tables = {topic: self._tables[topic] for topic in order if topic in self._tables}
        return {topic: table.finish() for topic, table in tables.items() if table.parts}

    def decoder(self, channel: Channel) -> Decoder | None:
        """The decoder of a wanted topic; None for what is not wanted or cannot be decoded."""
        if self.wanted is not None and not self.others and channel.topic not in self.wanted:
            return None
        if channel.id not in self._decoders:
            schema = self.found.schemas.get(channel.schema_id)
            key = (channel.message_encoding, schema and (schema.name, schema.encoding, schema.data))
            if key not in self._shared:
                try:
                    self._shared[key] = decoder(channel, schema)
                except Undecodable as reason:
                    self._shared[key] = reason
            made = self._shared[key]
            if isinstance(made, Undecodable):
                self.undecodable[channel.topic] = str(made)
            self._decoders[channel.id] = None if isinstance(made, Undecodable) else made
        return self._decoders[channel.id]

    def topics(self, tally: Tally) -> set[str]:
        """The wanted topics that have messages and can be decoded."""
        channels = [self.found.channels[number] for number in tally.counts]
        return {c.topic for c in channels if self.decoder(c) is not None}

    def leaves(self, topic: str, reader: Decoder) -> list[str] | None:
        """The leaves to decode; None where only the messages know them (JSON)."""
        if not reader.layout:
            return None
        if self.wanted is None:
            return [leaf for leaf in reader.layout if leaf not in reader.bulk]
        asked = (*self.wanted.get(topic, ()), *stamp_leaves(reader.layout))
        found = [locate(path, reader.layout) for path in asked]
        return list(dict.fromkeys(at[0] for at in found if at))

    def add(
        self, topic: str, frame: pl.DataFrame, logged: pl.Series, published: pl.Series,
        channel: int = 0,
    ) -> None:  # fmt: skip
        """Rows of one topic: its leaves, and the two times that are not in the messages. `channel`
        they came by, where several have the topic."""
        table = self._tables.setdefault(topic, Table())
        if not len(logged):
            return
        stamp = pl.Series("stamp", [None] * len(logged), pl.Int64)
        if frame.width:  # messages without a field have none
            leaves = stamp_leaves(frame.schema)
            stamp = fields.stamps(frame, leaves)
            if (counts := fields.counted(frame, leaves)) is not None:
                table.counts[len(table.parts)] = counts
        columns = [
            s.rename(n) for n, s in zip(TIME_COLUMNS, (logged, published, stamp), strict=True)
        ]
        if self.wanted is None:
            columns += [s for s in frame.get_columns() if s.name not in TIME_COLUMNS]
            table.parts.append(pl.DataFrame(columns))
            return
        expressions = []
        if CHANNEL in self.wanted.get(topic, ()):
            columns.append(pl.Series(CHANNEL, np.full(len(logged), channel)))
        for path in self.wanted.get(topic, ()):
            at = locate(path, frame.schema)
            if at is not None and path not in TIME_COLUMNS:
                expressions.append(value(*at, frame.schema[at[0]]).alias(path))
                if is_text(*at, frame.schema):
                    table.texts.add(path)
        table.parts.append(pl.DataFrame(columns + frame.select(expressions).get_columns()))


def _joined(parts: list[pl.DataFrame]) -> pl.DataFrame:
    try:
        return pl.concat(parts, how="diagonal_relaxed", rechunk=False)
    except Exception as error:  # one name, two kinds of value
        log.debug("columns of two types become text: %s", error)
    kinds: dict[str, set] = {}
    for part in parts:
        for name, dtype in part.schema.items():
            kinds.setdefault(name, set()).add(dtype)
    mixed = [n for n, types in kinds.items() if len(types - {pl.Null}) > 1]
    mixed = [n for n in mixed if not all(t.is_numeric() or t == pl.Null for t in kinds[n])]
    texts = [
        part.with_columns(_as_text(part[name]) for name in mixed if name in part.columns)
        for part in parts
    ]
    return pl.concat(texts, how="diagonal_relaxed", rechunk=False)


def _as_text(column: pl.Series) -> pl.Series:
    if column.dtype.is_nested():
        texts = [None if item is None else str(item) for item in column.to_list()]
        return pl.Series(column.name, texts, pl.String)
    return column.cast(pl.String, strict=False)
