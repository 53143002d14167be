"""Who sends on a topic: channels of one name, and frames of reference in the messages.

A few chunks are looked at, from the first to the last: who sends all the time shows in each. To
read the frame of every message would take longer than to read their numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import polars as pl
from mcap.opcode import Opcode
from mcap.records import Channel, ChunkIndex

from shiplog.logs.decoding.fields import locate
from shiplog.logs.decoding.tables import CHANNEL, Tables
from shiplog.logs.mcap_file import chunks, scan
from shiplog.logs.mcap_file.container import Survey, head, index_of, read_at
from shiplog.logs.mcap_file.records import HEAD, MESSAGE

CHUNKS = 5  # that are looked at
MESSAGES = 64  # of a channel in a chunk
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
            yield from _of_chunk(stream, entries[at], channels, found.size)


def _of_chunk(
    stream: IO[bytes], entry: ChunkIndex, channels: set[int], size: int
) -> Iterator[tuple[int, list[bytes]]]:
    """The payloads that stand where the indexes behind the chunk say; what is damaged is nothing
    here: whoever reads all of the log reports it."""
    length = entry.chunk_length - HEAD.size
    if not 0 < length <= chunks.AT_ONCE or entry.uncompressed_size > chunks.AT_ONCE:
        return
    packed = chunks.chunk(read_at(stream, entry.chunk_start_offset + HEAD.size, length))
    try:
        data = bytes(chunks.opened(packed).data) if packed else b""
    except ValueError:
        return
    for number in channels & set(entry.message_index_offsets):
        offset = entry.message_index_offsets[number]
        opcode, length, fault = head(stream, offset, size)
        if fault is not None or opcode != Opcode.MESSAGE_INDEX:
            continue
        for index in index_of(read_at(stream, offset + HEAD.size, length), 0):
            places = index.places[:MESSAGES].tolist()
            yield number, [one for place in places if (one := _payload(data, place)) is not None]


def _payload(data: bytes, place: int) -> bytes | None:
    """Of the message whose record begins there."""
    if not 0 <= place <= len(data) - HEAD.size - MESSAGE.size:
        return None
    opcode, length = HEAD.unpack_from(data, place)
    begin = place + HEAD.size
    whole = opcode == Opcode.MESSAGE and MESSAGE.size <= length <= len(data) - begin
    return data[begin + MESSAGE.size : begin + length] if whole else None


def _name(channel: Channel, others: Collection[Channel]) -> str:
    """Who sends, in the words of the channel's metadata; else its number."""
    alike = [one for one in others if one.topic == channel.topic]
    for name in NAMES:
        told = [one.metadata.get(name) for one in alike]
        if all(told) and len(set(told)) == len(told):
            return channel.metadata[name]
    return f"channel {channel.id}"
