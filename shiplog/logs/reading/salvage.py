"""The sure route: chunk by chunk and message by message, through the packages of each encoding.

It reads what Rerun cannot (JSON, logs without a summary) or must not be given (damaged ones), about
ten times slower.
"""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import numpy as np
import polars as pl
from mcap.records import Channel, Message

from shiplog.logs.decoding.messages import Decoder
from shiplog.logs.decoding.tables import Tables, Tally, room
from shiplog.logs.mcap_file import chunks, scan, sound_messages
from shiplog.logs.mcap_file.container import SECTION, Alone, Index, Sound, Survey
from shiplog.logs.mcap_file.records import HEAD, MESSAGE, TooLarge

BATCH_BYTES = 4 << 20  # bytes of payloads decoded at once: enough to make per-topic work cheap
SMALLEST_MESSAGE = HEAD.size + MESSAGE.size  # bytes of one without a payload
OVERHEAD = 64  # bytes that a message takes without its payload: empty ones are not for nothing
LARGE_TEXT = 4096  # bytes on average: an image or a video in base64, left out unless asked for


def messages(found: Survey) -> Iterator[list[Message]]:
    """The messages of each sound chunk in batches, or each message that stands alone; none of a
    chunk that holds more than the whole log can."""
    for item in scan.walk(found):
        if not isinstance(item, Index) and not _overfull(item, room(found)):
            yield from filter(None, sound_messages.messages_of(found, item))


def read_all(tables: Tables, topics: Collection[str] | None = None) -> Tally:
    """Decode the wanted messages on `topics` (None: on all), and count every message."""
    tally = Tally()
    batch: dict[int, list[Message]] = {}
    held = 0
    for item in scan.walk(tables.found):
        if isinstance(item, Index):
            continue
        if left_out := _overfull(item, tables.room):
            _count(tables, topics, left_out, tally)
            continue
        for met in sound_messages.messages_of(tables.found, item):
            for message in met:
                batch.setdefault(message.channel_id, []).append(message)
                held += len(message.data) + OVERHEAD
            if held >= BATCH_BYTES:
                _take(tables, topics, batch, tally)
                batch, held = {}, 0
    _take(tables, topics, batch, tally)
    return tally


def _overfull(item: Sound | Alone, most: int) -> Counter[int]:
    """The messages by channel of a chunk that holds more than so many; else nothing.

    They are counted and not made; every description of a channel is known by now.
    """
    if isinstance(item, Alone) or item.chunk.uncompressed_size // SMALLEST_MESSAGE <= most:
        return Counter()
    try:
        counts = chunks.message_counts(item.chunk)
    except ValueError:  # `messages_of` says what is wrong with it
        return Counter()
    first = item.section * SECTION
    return Counter({n + first: c for n, c in counts.items()} if counts.total() > most else {})


def _count(
    tables: Tables, topics: Collection[str] | None, counts: Mapping[int, int], tally: Tally
) -> None:
    for number, count in counts.items():
        channel = tables.found.channels.get(number)
        tally.add(number, count, known=channel is not None)
        if channel is not None and (topics is None or channel.topic in topics):
            _too_many(tables, channel, count)


def _too_many(tables: Tables, channel: Channel, count: int) -> None:
    if tables.decoder(channel) is not None:
        tables.too_many[channel.topic] = tables.too_many.get(channel.topic, 0) + count


def _take(
    tables: Tables,
    topics: Collection[str] | None,
    batch: Mapping[int, list[Message]],
    tally: Tally,
) -> None:
    for number, met in batch.items():
        channel = tables.found.channels.get(number)
        logged = nanoseconds([m.log_time for m in met])
        tally.note(number, logged, known=channel is not None)
        if channel is not None and (topics is None or channel.topic in topics):
            decode(tables, channel, met, logged)


def decode(tables: Tables, channel: Channel, met: list[Message], logged: np.ndarray) -> None:
    """Messages of one channel, and their log times [n] ns, into its table if it is wanted."""
    reader = tables.decoder(channel)
    if reader is None:
        return
    tables.room -= len(met)
    if tables.room < 0:
        _too_many(tables, channel, len(met))
    else:
        _decode(tables, channel, reader, met, logged)


def _decode(
    tables: Tables, channel: Channel, reader: Decoder, met: list[Message], logged: np.ndarray
) -> None:
    topic = channel.topic
    kept = np.array([not isinstance(m.data, TooLarge) for m in met], bool)
    if not kept.all():
        tables.too_large[topic] = tables.too_large.get(topic, 0) + int((~kept).sum())
        met, logged = [m for m, k in zip(met, kept, strict=True) if k], logged[kept]
    frame, bad = _columns(reader, [m.data for m in met], tables.leaves(topic, reader))
    if tables.wanted is None and not reader.layout:
        frame = frame.drop(s.name for s in frame if _large(s))
    published = nanoseconds([m.publish_time for m in met])
    if bad.any():
        tables.failed[topic] = tables.failed.get(topic, 0) + int(bad.sum())
    tables.add(topic, frame, pl.Series(logged[~bad]), pl.Series(published[~bad]), channel.id)


def _columns(
    reader: Decoder, payloads: list[bytes], leaves: list[str] | None
) -> tuple[pl.DataFrame, np.ndarray]:
    """Each payload once, however often it was sent: millions of one kind cost no more than one.

    Those of a schema that are large are few, and to compare them takes longer than to decode them.
    """
    if reader.layout and sum(map(len, payloads)) > LARGE_TEXT * len(payloads):
        return reader.columns(payloads, leaves)
    first = {payload: i for i, payload in enumerate(dict.fromkeys(payloads))}
    if len(first) > len(payloads) // 2:
        return reader.columns(payloads, leaves)
    frame, bad = reader.columns(list(first), leaves)
    which = np.fromiter((first[p] for p in payloads), np.int64, len(payloads))
    if not frame.width:  # messages without a field
        return frame, bad[which]
    row = np.cumsum(~bad) - 1  # of each payload that decoded, in the frame
    return frame[row[which[~bad[which]]]], bad[which]


def repeated(path: Path, suspects: Mapping[str, Collection[int]]) -> dict[str, list[int]]:
    """Log times of payloads that came before, among the messages with a suspect's log time [ns]."""
    found = scan.survey(path)
    payloads: dict[str, set[int]] = {topic: set() for topic in suspects}
    again: dict[str, list[int]] = {topic: [] for topic in suspects}
    for chunk in _messages_on(found, suspects):
        for message in chunk:
            channel = found.channels.get(message.channel_id)
            topic = channel.topic if channel else ""
            if message.log_time in suspects.get(topic, ()):
                payload = hash(message.data)
                if payload in payloads[topic]:
                    again[topic].append(message.log_time)
                payloads[topic].add(payload)
    return again


def _messages_on(found: Survey, topics: Collection[str]) -> Iterator[list[Message]]:
    """Those on some topics at least, without a copy of the others where they stand in chunks."""
    if found.sections > 1:  # whose channels have other numbers in the chunks
        yield from messages(found)
        return
    numbers = {number for number, channel in found.channels.items() if channel.topic in topics}
    for item in scan.walk(found):
        if isinstance(item, Sound):
            with contextlib.suppress(ValueError):  # it was reported when the log was read
                for batch in chunks.contents(item.chunk, only=numbers):
                    yield [record for record in batch if isinstance(record, Message)]
        elif isinstance(item, Alone):
            yield from sound_messages.messages_of(found, item)


def nanoseconds(times: list[int]) -> np.ndarray:
    """Times as 64 bits with a sign [n]; what is beyond was damage and becomes negative."""
    return np.array(times, np.uint64).view(np.int64)


def _large(column: pl.Series) -> bool:
    if column.dtype != pl.String:
        return False
    return (column.str.len_bytes().mean() or 0) > LARGE_TEXT  # type: ignore[operator]
