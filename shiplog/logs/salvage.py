"""The sure route: chunk by chunk and message by message, through the packages of each encoding.

It reads what Rerun cannot (JSON, logs without a summary) or must not be given (damaged ones), about
ten times slower.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path

import numpy as np
import polars as pl
from mcap.records import Channel, Message

from . import container
from .messages import Decoder
from .tables import Tables, Tally

BATCH = 4 << 20  # bytes of payloads decoded at once: enough to make per-topic work cheap
LARGE_TEXT = 4096  # bytes on average: an image or a video in base64, left out unless asked for


def messages(found: container.Survey) -> Iterator[list[Message]]:
    """The messages of each sound chunk, or each message that stands alone."""
    for sound in container.walk(found):
        if isinstance(sound, container.Sound):
            here = []
            for record in container.contents_of(found, sound):
                if isinstance(record, Message):
                    here.append(record)
                else:
                    container.note(found, record)
            if here:
                yield here


def read_all(tables: Tables, topics: Collection[str] | None = None) -> Tally:
    """Decode the wanted messages on `topics` (None: on all), and count every message."""
    tally = Tally()
    batch: dict[int, list[Message]] = {}
    held = 0
    for chunk in messages(tables.found):
        for message in chunk:
            batch.setdefault(message.channel_id, []).append(message)
            held += len(message.data)
        if held >= BATCH:
            _take(tables, topics, batch, tally)
            batch, held = {}, 0
    _take(tables, topics, batch, tally)
    return tally


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
        if channel is None or (topics is not None and channel.topic not in topics):
            continue
        reader = tables.decoder(channel)
        if reader is not None:
            _decode(tables, channel, reader, met, logged)


def _decode(
    tables: Tables, channel: Channel, reader: Decoder, met: list[Message], logged: np.ndarray
) -> None:
    topic = channel.topic
    frame, bad = reader.columns([m.data for m in met], tables.leaves(topic, reader))
    if tables.wanted is None and not reader.layout:
        frame = frame.drop(s.name for s in frame if _large(s))
    published = nanoseconds([m.publish_time for m in met])
    if bad.any():
        tables.failed[topic] = tables.failed.get(topic, 0) + int(bad.sum())
    tables.add(topic, frame, pl.Series(logged[~bad]), pl.Series(published[~bad]))


def repeated(path: Path, suspects: Mapping[str, Collection[int]]) -> dict[str, list[int]]:
    """Log times of payloads that came before, among the messages with a suspect's log time [ns]."""
    found = container.survey(path)
    payloads: dict[str, set[int]] = {topic: set() for topic in suspects}
    again: dict[str, list[int]] = {topic: [] for topic in suspects}
    for chunk in messages(found):
        for message in chunk:
            channel = found.channels.get(message.channel_id)
            topic = channel.topic if channel else ""
            if message.log_time in suspects.get(topic, ()):
                payload = hash(message.data)
                if payload in payloads[topic]:
                    again[topic].append(message.log_time)
                payloads[topic].add(payload)
    return again


def nanoseconds(times: list[int]) -> np.ndarray:
    """Times as 64 bits with a sign [n]; what is beyond was damage and becomes negative."""
    return np.array(times, np.uint64).view(np.int64)


def _large(column: pl.Series) -> bool:
    if column.dtype != pl.String:
        return False
    return (column.str.len_bytes().mean() or 0) > LARGE_TEXT  # type: ignore[operator]
