"""The last minutes of messages, topic by topic, as `ingest` would have read them from a file."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

import polars as pl
from mcap.records import Message

from shiplog.logs.decoding.tables import Tables
from shiplog.logs.mcap_file.container import Survey
from shiplog.logs.reading import salvage
from shiplog.nomenclature.units import SECOND_NS

ROOM = 1_000_000_000  # rows: a window is bounded by its seconds, not by the size of a file
JOINED = 8  # parts of a topic that are made one: each look adds a part

Frames = Mapping[str, pl.DataFrame]


@dataclass
class Window:
    """Messages of the last `seconds` by the recorder's clock; the older ones are dropped.

    topics    all that a message or a description named so far
    metadata  records of the log, such as "voyage"
    newest    ns, the latest log time; 0 before the first
    """

    seconds: float
    parts: dict[str, list[pl.DataFrame]] = field(default_factory=dict)
    topics: set[str] = field(default_factory=set)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    newest: int = 0

    def add(self, frames: Frames) -> int:
        """Messages that came; how many."""
        count = 0
        for topic, frame in frames.items():
            if not frame.height:
                continue
            self.topics.add(topic)
            kept = self.parts.setdefault(topic, [])
            kept.append(frame)
            if len(kept) > JOINED:
                kept[:] = [pl.concat(kept, how="diagonal_relaxed")]
            self.newest = max(self.newest, last_time(frame))
            count += frame.height
        if count:
            self._forget()
        return count

    def frames(self, seconds: float | None = None) -> dict[str, pl.DataFrame]:
        """The messages of the last seconds, of the whole window unless given, by log time."""
        since = self.newest - round((seconds or self.seconds) * SECOND_NS)
        found = {}
        for topic, parts in self.parts.items():
            frame = parts[0] if len(parts) == 1 else pl.concat(parts, how="diagonal_relaxed")
            frame = frame.filter(pl.col("log_time") > since)
            if frame.height:
                times = frame["log_time"]
                found[topic] = frame if times.is_sorted() else frame.sort(
                    "log_time", maintain_order=True
                )  # fmt: skip
        return found

    def clear(self) -> None:
        """Nothing of before: another voyage begins."""
        self.parts.clear()
        self.newest = 0

    def _forget(self) -> None:
        since = self.newest - round(self.seconds * SECOND_NS)
        for topic, parts in list(self.parts.items()):
            if first_time(parts[0]) < since - SECOND_NS * 10:
                kept = pl.concat(parts, how="diagonal_relaxed").filter(pl.col("log_time") > since)
                self.parts[topic] = [kept]
                if not kept.height:
                    del self.parts[topic]


def first_time(frame: pl.DataFrame) -> int:
    """The earliest log time of some messages of a topic [ns]; 0 where none has one."""
    times = frame["log_time"].drop_nulls().to_numpy()
    return int(times.min()) if len(times) else 0


def last_time(frame: pl.DataFrame) -> int:
    """The latest log time of some messages of a topic [ns]; 0 where none has one."""
    times = frame["log_time"].drop_nulls().to_numpy()
    return int(times.max()) if len(times) else 0


def newest(frames: Frames) -> int:
    """The latest log time of them [ns]; 0 where there is no message."""
    return max((last_time(f) for f in frames.values()), default=0)


def oldest(frames: Frames) -> int:
    """The earliest log time of them [ns]; 0 where there is no message."""
    times = [first_time(f) for f in frames.values() if f.height]
    return min(times, default=0)


class Decoding:
    """Messages of one log, of the wanted fields, as frames."""

    def __init__(self, found: Survey, wanted: Mapping[str, Collection[str]]) -> None:
        self.found, self.tables = found, Tables(found, wanted)

    def frames(self, batches: Iterable[list[Message]]) -> dict[str, pl.DataFrame]:
        """What the messages hold of the wanted fields."""
        by_channel: dict[int, list[Message]] = {}
        for batch in batches:
            for message in batch:
                by_channel.setdefault(message.channel_id, []).append(message)
        self.tables.room = ROOM
        for number, met in by_channel.items():
            channel = self.found.channels.get(number)
            if channel is not None:
                logged = salvage.nanoseconds([m.log_time for m in met])
                salvage.decode(self.tables, channel, met, logged)
        return self.tables.finish()

    @property
    def failed(self) -> int:
        """Messages so far whose bytes did not fit their schema."""
        return sum(self.tables.failed.values())


class Inflow:
    """Messages that came and are not yet in the window: a recorder hands over minutes at once, and
    a replay hours, of which a look takes a few seconds."""

    def __init__(self) -> None:
        self._waiting: dict[str, list[pl.DataFrame]] = {}

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def add(self, frames: Frames) -> None:
        for topic, frame in frames.items():
            if frame.height:
                self._waiting.setdefault(topic, []).append(frame)

    def take(self, seconds: float) -> dict[str, pl.DataFrame]:
        """The oldest messages, of so many seconds by the recorder's clock."""
        firsts = [first_time(f) for fs in self._waiting.values() for f in fs]
        if not firsts:
            return {}
        until = min(firsts) + round(seconds * SECOND_NS)
        found: dict[str, pl.DataFrame] = {}
        for topic, parts in list(self._waiting.items()):
            frame = parts[0] if len(parts) == 1 else pl.concat(parts, how="diagonal_relaxed")
            now = pl.col("log_time") < until
            found[topic], later = frame.filter(now), frame.filter(~now)
            if later.height:
                self._waiting[topic] = [later]
            else:
                del self._waiting[topic]
        return found
