"""Who sends on a topic: channels of one name, and frames of reference in the messages.

A few chunks are looked at, from the first to the last: who sends all the time shows in each. To
read the frame of every message would take longer than to read their numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl
from mcap.records import Channel, Message

from . import chunks, scan
from .container import Survey, read_at
from .fields import locate
from .records import HEAD
from .tables import CHANNEL, Tables

CHUNKS = 5  # that are looked at
MESSAGES = 200  # of a channel in a chunk
__all__ = ["CHANNEL", "Senders", "senders"]
NAMES = ("callerid", "frame_id", "node", "publisher")  # in a channel's metadata: who sends


@dataclass(slots=True)
class Senders:
    """Of one topic.

    channels  their names by number, where there are several
    frames    the fields that hold more than one frame, and those that were seen
    """

    channels: dict[int, str] = field(default_factory=dict)
    frames: dict[str, set[str]] = field(default_factory=dict)

    @property
    def several(self) -> bool:
        return len(self.channels) > 1 or any(len(seen) > 1 for seen in self.frames.values())


def senders(path: Path, asked: dict[str, Collection[str]]) -> dict[str, Senders]:
    """Who sends on the topics that are `asked` for, each with the fields that may hold a frame."""
    found = scan.survey(path)
    stated = found.statistics.channel_message_counts if found.statistics else None
    made: dict[str, Senders] = {topic: Senders() for topic in asked}
    channels = {
        number: channel for number, channel in found.channels.items()
        if channel.topic in asked and (stated is None or stated.get(number))
    }  # fmt: skip
    for number, channel in channels.items():
        made[channel.topic].channels[number] = _name(channel, channels.values())
    tables = Tables(found, {topic: () for topic in asked})
    for number, payloads in _samples(found, set(channels)):
        channel = channels[number]
        reader = tables.decoder(channel)
        if reader is None:
            continue
        paths = [p for p in asked[channel.topic] if not reader.layout or _is_text(p, reader.layout)]
        if not paths:
            continue
        frame, _ = reader.columns(payloads, paths if reader.layout else None)
        for one in paths:
            if one in frame.columns and frame.schema[one] == pl.String:
                seen = made[channel.topic].frames.setdefault(one, set())
                seen.update(frame[one].drop_nulls().to_list())
    return made


def _is_text(path: str, layout: dict[str, pl.DataType]) -> bool:
    at = locate(path, layout)
    return at is not None and not at[1] and layout[at[0]] == pl.String


def _samples(found: Survey, channels: set[int]) -> Iterator[tuple[int, list[bytes]]]:
    """The first payloads of each channel in some chunks."""
    entries = sorted(found.indexed.values(), key=lambda entry: entry.chunk_start_offset)
    entries = [e for e in entries if channels & set(e.message_index_offsets)]
    last = len(entries) - 1
    chosen = {round(i * last / (CHUNKS - 1)) for i in range(CHUNKS)} if last > 0 else {0}
    with found.path.open("rb") as stream:
        for at in sorted(chosen) if entries else ():
            entry = entries[at]
            length = entry.chunk_length - HEAD.size
            if not 0 < length <= chunks.AT_ONCE or entry.uncompressed_size > chunks.AT_ONCE:
                continue
            body = read_at(stream, entry.chunk_start_offset + HEAD.size, length)
            yield from _of_chunk(body, channels)


def _of_chunk(body: bytes, channels: Collection[int]) -> Iterator[tuple[int, list[bytes]]]:
    packed = chunks.chunk(body)
    met: dict[int, list[bytes]] = {}
    try:
        for batch in chunks.contents(chunks.opened(packed), only=channels) if packed else ():
            for message in batch:
                if isinstance(message, Message):
                    payloads = met.setdefault(message.channel_id, [])
                    if len(payloads) < MESSAGES:
                        payloads.append(bytes(message.data))
    except ValueError:  # a damaged one: whoever reads all of them says so
        return
    yield from met.items()


def _name(channel: Channel, others: Collection[Channel]) -> str:
    """Who sends, in the words of the channel's metadata; else its number."""
    alike = [one for one in others if one.topic == channel.topic]
    for name in NAMES:
        told = [one.metadata.get(name) for one in alike]
        if all(told) and len(set(told)) == len(told):
            return channel.metadata[name]
    return f"channel {channel.id}"
