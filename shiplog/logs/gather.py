"""From blocks of records to one table a topic, keeping only what was asked for."""

from __future__ import annotations

import logging
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from mcap.records import Channel, Schema

from . import container, kernels
from .decoders import Decoder, Piece, Undecodable, decoder
from .fields import is_text, locate, settled, stamp_leaves, stamps, value

log = logging.getLogger(__name__)

TIMES = ("log_time", "publish_time", "stamp")
DIGEST = "\0digest"  # a column no field can be named: equal payloads, equal digests
LARGE_TEXT = 4096  # bytes on average: an image or a video in base64, left out unless asked for


@dataclass(slots=True)
class Table:
    """One topic's rows so far."""

    parts: list[pl.DataFrame] = field(default_factory=list)
    texts: set[str] = field(default_factory=set)  # columns taken out of JSON, typed at the end
    failed: int = 0  # messages whose payload did not decode

    def add(self, part: pl.DataFrame) -> None:
        self.parts.append(part)

    def finish(self) -> pl.DataFrame:
        parts, self.parts = self.parts, []
        frame = parts[0] if len(parts) == 1 else _joined(parts)
        parts.clear()
        for name in self.texts:
            frame = frame.with_columns(settled(frame[name]))
        times = frame["log_time"]
        return frame if times.is_sorted() else frame.sort("log_time", maintain_order=True)


@dataclass(slots=True)
class Order:
    """Whether a topic's messages were written in the order of their log time."""

    last: int
    back: int = 0  # how many steps back in time
    largest: int = 0  # ns


class Gatherer:
    """Takes blocks in file order; `tables`, `order`, `counts` and `undecodable` are the result."""

    def __init__(
        self, found: container.Survey, wanted: Mapping[str, Collection[str]] | None
    ) -> None:
        self._found = found
        self._wanted = wanted
        self._decoders: dict[int, Decoder | None] = {}
        self._shared: dict[tuple, Decoder | Undecodable] = {}
        self.tables: dict[str, Table] = {}
        self.order: dict[str, Order] = {}
        self.counts: dict[int, int] = {}  # messages by channel
        self.undecodable: dict[str, str] = {}
        self.orphans = 0  # messages of channels that nothing defines
        self.first: int | None = None
        self.last: int | None = None
        self.broken_blocks = 0

    def take(self, block: bytes, decode: bool = True) -> None:
        channels, logged, published, start, length, defined, whole = kernels.split(
            np.frombuffer(block, np.uint8)
        )
        self.broken_blocks += not whole
        for opcode, at, size in defined.tolist():
            container.definition(self._found, opcode, block[at : at + size])
        if not len(channels):
            return
        self.first = min(self.first or logged.min(), logged.min())
        self.last = max(self.last or logged.max(), logged.max())
        by_channel = np.argsort(channels, kind="stable")
        ids, begins = np.unique(channels[by_channel], return_index=True)
        for number, rows in zip(ids.tolist(), np.split(by_channel, begins[1:]), strict=True):
            channel = self._found.channels.get(number)
            if channel is None:
                self.orphans += len(rows)
                continue
            self.counts[number] = self.counts.get(number, 0) + len(rows)
            if decode:
                self._note_order(channel.topic, logged[rows])
                self._decode(
                    channel,
                    Piece(block, start[rows], length[rows], logged[rows], published[rows]),
                )

    def _note_order(self, topic: str, logged: np.ndarray) -> None:
        order = self.order.setdefault(topic, Order(int(logged[0])))
        steps = np.diff(logged, prepend=order.last)
        order.back += int((steps < 0).sum())
        order.largest = max(order.largest, -int(steps.min()))
        order.last = int(logged[-1])

    def _decode(self, channel: Channel, piece: Piece) -> None:
        topic = channel.topic
        if self._wanted is not None and topic not in self._wanted:
            return
        reader = self._decoder(channel)
        if reader is None:
            return
        asked = None if self._wanted is None else list(self._wanted[topic])
        leaves = _needed(reader, asked)
        frame, bad = reader.columns(piece, leaves)
        data = np.frombuffer(piece.data, np.uint8)
        digests = kernels.digests(data, piece.start, piece.length)
        table = self.tables.setdefault(topic, Table())
        if bad.any():
            table.failed += int(bad.sum())
            piece = Piece(b"", piece.start, piece.length, piece.log[~bad], piece.publish[~bad])
        if len(piece.log):
            part = _part(frame, piece, asked, leaves, table.texts)
            table.add(part.with_columns(pl.Series(DIGEST, digests[~bad])))

    def _decoder(self, channel: Channel) -> Decoder | None:
        if channel.id not in self._decoders:
            schema: Schema | None = self._found.schemas.get(channel.schema_id)
            key = (channel.message_encoding, schema and (schema.name, schema.encoding, schema.data))
            if key not in self._shared:
                try:
                    self._shared[key] = decoder(channel, schema)
                except Undecodable as reason:
                    self._shared[key] = reason
            made = self._shared[key]
            if isinstance(made, Undecodable):
                self.undecodable[channel.topic] = str(made)
                self._decoders[channel.id] = None
            else:
                self._decoders[channel.id] = made
        return self._decoders[channel.id]


def _needed(reader: Decoder, asked: list[str] | None) -> list[str] | None:
    """The leaves to decode; None where only the messages know them (JSON)."""
    if not reader.layout:
        return None
    if asked is None:
        return [leaf for leaf in reader.layout if leaf not in reader.bulk]
    found = [locate(path, reader.layout) for path in (*asked, *stamp_leaves(reader.layout))]
    return list(dict.fromkeys(at[0] for at in found if at))


def _part(
    frame: pl.DataFrame,
    piece: Piece,
    asked: list[str] | None,
    leaves: list[str] | None,
    texts: set[str],
) -> pl.DataFrame:
    """One piece's rows: the three times and the columns that were asked for."""
    times = [
        pl.Series("log_time", piece.log),
        pl.Series("publish_time", piece.publish),
        _stamp(frame, len(piece.log)),
    ]
    if asked is None:
        columns = [
            frame[name]
            for name, dtype in frame.schema.items()
            if name not in TIMES and not (leaves is None and _large(frame[name], dtype))
        ]
        return pl.DataFrame(times + columns)
    expressions = []
    for path in asked:
        at = locate(path, frame.schema)
        if at is not None and path not in TIMES:
            expressions.append(value(*at, frame.schema[at[0]]).alias(path))
            if is_text(*at, frame.schema):
                texts.add(path)
    return pl.DataFrame(times + frame.select(expressions).get_columns())


def _stamp(frame: pl.DataFrame, rows: int) -> pl.Series:
    if frame.width == 0:
        return pl.Series("stamp", [None] * rows, pl.Int64)
    return stamps(frame, stamp_leaves(frame.schema)).rename("stamp")


def _large(column: pl.Series, dtype: pl.DataType) -> bool:
    if dtype != pl.String:
        return False
    return (column.str.len_bytes().mean() or 0) > LARGE_TEXT  # type: ignore[operator]


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
