"""The fields of every topic, from schemas where they say and from a few messages where not."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import polars as pl

from . import container, kernels
from .decoders import Decoder, Json, Piece, Undecodable, decoder

SAMPLE = 200  # messages of a topic that are decoded


def sample(
    found: container.Survey, topics: Iterable[str] | None
) -> dict[str, dict[str, pl.DataType]]:
    """Leaf fields by topic; JSON inside a text adds `leaf.field`. Undecodable topics are absent."""
    asked = None if topics is None else set(topics)
    readers: dict[int, Decoder | None] = {}
    fields: dict[str, dict[str, pl.DataType]] = {}
    seen: set[int] = set()
    expected = _expected(found)
    for block in container.blocks(found):
        channels, logged, published, start, length, defined, _ = kernels.split(
            np.frombuffer(block, np.uint8)
        )
        for opcode, at, size in defined.tolist():
            container.definition(found, opcode, block[at : at + size])
        for number in set(np.unique(channels).tolist()) - seen:
            seen.add(number)
            rows = np.flatnonzero(channels == number)[:SAMPLE]
            piece = Piece(block, start[rows], length[rows], logged[rows], published[rows])
            reader = _reader(found, number, readers, asked)
            if reader is not None:
                into = fields.setdefault(found.channels[number].topic, {})
                _learn(reader, piece, into)
        if expected is not None and expected <= seen:
            break
    for number, channel in found.channels.items():  # topics that never spoke
        reader = _reader(found, number, readers, asked)
        if reader is not None:
            fields.setdefault(channel.topic, {}).update(
                {n: t for n, t in reader.layout.items() if n not in fields[channel.topic]}
            )
    return fields


def _expected(found: container.Survey) -> set[int] | None:
    statistics = found.summary and found.summary.statistics
    if not statistics:
        return None
    return {number for number, count in statistics.channel_message_counts.items() if count}


def _reader(
    found: container.Survey, number: int, readers: dict[int, Decoder | None], asked: set[str] | None
) -> Decoder | None:
    channel = found.channels.get(number)
    if channel is None or (asked is not None and channel.topic not in asked):
        return None
    if number not in readers:
        try:
            readers[number] = decoder(channel, found.schemas.get(channel.schema_id))
        except Undecodable:
            readers[number] = None
    return readers[number]


def _learn(reader: Decoder, piece: Piece, into: dict[str, pl.DataType]) -> None:
    into.update(reader.layout)
    texts = [n for n, t in reader.layout.items() if t in (pl.String, pl.Binary)]
    if reader.layout and not texts:
        return
    frame, _ = reader.columns(piece, texts if reader.layout else None)
    if not reader.layout:
        into.update(frame.schema)
    for name, dtype in frame.schema.items():
        if dtype not in (pl.String, pl.Binary):
            continue
        inside = [v if isinstance(v, bytes) else v.encode() for v in frame[name].drop_nulls()]
        inside = [v for v in inside if v.lstrip()[:1] == b"{"]
        if inside:
            nested, _ = Json(None).columns(_piece(inside), None)
            into.update({f"{name}.{inner}": kind for inner, kind in nested.schema.items()})


def _piece(payloads: list[bytes]) -> Piece:
    length = np.array([len(p) for p in payloads], np.int64)
    start = np.cumsum(length) - length
    times = np.zeros(len(payloads), np.int64)
    return Piece(b"".join(payloads), start, length, times, times)
