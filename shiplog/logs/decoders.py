"""Payloads to columns: one decoder a schema, each with the same three things.

`layout` names every leaf field and its type (empty for JSON, whose messages say it themselves);
`bulk` are leaves too large to keep unasked, such as images; `columns` decodes one block's messages
of one channel into the leaves that are wanted and marks the messages that would not decode.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Collection
from dataclasses import dataclass
from io import BytesIO
from typing import Protocol

import numpy as np
import polars as pl
from mcap.records import Channel, Schema

log = logging.getLogger(__name__)


class Undecodable(Exception):
    """Why a topic is left out; it never leaves this package."""


@dataclass(frozen=True, slots=True)
class Piece:
    """The messages of one channel in one block, in file order."""

    data: bytes
    start: np.ndarray  # [n] where each payload begins in `data`
    length: np.ndarray  # [n]
    log: np.ndarray  # [n] ns
    publish: np.ndarray  # [n] ns

    def payloads(self) -> list[bytes]:
        ends = (self.start + self.length).tolist()
        return [self.data[a:b] for a, b in zip(self.start.tolist(), ends, strict=True)]


class Decoder(Protocol):
    layout: dict[str, pl.DataType]
    bulk: frozenset[str]

    def columns(
        self, piece: Piece, leaves: Collection[str] | None
    ) -> tuple[pl.DataFrame, np.ndarray]:
        """Leaves of the messages that decoded, and which of all did not [n] bool."""
        ...


def decoder(channel: Channel, schema: Schema | None) -> Decoder:
    """The decoder of a channel, or `Undecodable` with the reason."""
    from .cdr import Cdr
    from .protobuf import Protobuf

    if channel.message_encoding == "json":
        return Json(schema)
    named = f"message encoding {channel.message_encoding!r}"
    if schema is None:
        raise Undecodable(f"{named} without a schema")
    known = {("protobuf", "protobuf"): Protobuf, ("cdr", "ros2msg"): Cdr}
    kind = known.get((channel.message_encoding, schema.encoding))
    if kind is None:
        raise Undecodable(f"{named} with schema encoding {schema.encoding!r} is not known")
    try:
        return kind(schema)
    except Undecodable as reason:
        raise Undecodable(f"schema {schema.name!r} is broken: {reason}") from reason
    except Exception as error:  # protobuf and ROS parsers raise what they like
        reason = " ".join(str(error).split())[:160]
        raise Undecodable(
            f"schema {schema.name!r} is broken: {type(error).__name__} {reason}"
        ) from error


class Json:
    """JSON: whole blocks through polars' reader, one message at a time only where that fails."""

    def __init__(self, schema: Schema | None) -> None:
        self.layout: dict[str, pl.DataType] = {}
        self.bulk: frozenset[str] = frozenset()
        self._stated = _stated_types(schema)

    def columns(
        self, piece: Piece, leaves: Collection[str] | None
    ) -> tuple[pl.DataFrame, np.ndarray]:
        payloads = piece.payloads()
        bad = np.zeros(len(payloads), np.bool_)
        text = b"\n".join(
            p.replace(b"\n", b" ").replace(b"\r", b" ") if b"\n" in p or b"\r" in p else p
            for p in payloads
        )
        try:
            frame = pl.read_ndjson(BytesIO(text), infer_schema_length=None)
            if frame.height != len(payloads):
                raise ValueError("a payload is empty")
        except Exception as error:
            log.debug("one JSON message at a time: %s", error)
            frame = self._one_by_one(payloads, bad)
        frame = flat(frame)
        numbers = [
            pl.col(name).cast(self._stated[name], strict=False)
            for name, dtype in frame.schema.items()
            if name in self._stated and dtype.is_integer()
        ]
        wide = [
            pl.col(name).cast(pl.Float64 if dtype == pl.Float32 else pl.UInt64, strict=False)
            for name, dtype in frame.schema.items()
            if dtype in (pl.Int128, pl.Float32)
        ]
        return frame.with_columns(numbers).with_columns(wide), bad

    def _one_by_one(self, payloads: list[bytes], bad: np.ndarray) -> pl.DataFrame:
        columns: dict[str, list] = {}
        rows = 0
        for i, payload in enumerate(payloads):
            try:
                message = json.loads(payload)
                if not isinstance(message, dict):
                    raise ValueError("not an object")
            except (ValueError, RecursionError):
                bad[i] = True
                continue
            for name, field in _leaves(message):
                columns.setdefault(name, [None] * rows).append(field)
            rows += 1
            for values in columns.values():
                if len(values) < rows:
                    values.append(None)
        made = []
        for name, values in columns.items():
            if any(isinstance(v, float) for v in values):
                values = [float(v) if type(v) is int else v for v in values]
            try:
                made.append(pl.Series(name, values, strict=True))
            except Exception:  # mixed types: keep what was said, as text
                text = [None if v is None else v if isinstance(v, str) else json.dumps(v)
                        for v in values]  # fmt: skip
                made.append(pl.Series(name, text, pl.String))
        return pl.DataFrame(made) if made else pl.DataFrame({"": [None] * rows}).select([])


def _leaves(message: dict, prefix: str = "", depth: int = 0):
    for key, field in message.items():
        if isinstance(field, dict) and field and depth < 16:
            yield from _leaves(field, f"{prefix}{key}.", depth + 1)
        else:
            yield f"{prefix}{key}", field if field != {} else None


def _stated_types(schema: Schema | None) -> dict[str, pl.DataType]:
    """Leaves that a JSON schema calls numbers: 25 is then 25.0 as in the other encodings."""
    found: dict[str, pl.DataType] = {}

    def walk(node: object, prefix: str, depth: int) -> None:
        properties = node.get("properties") if isinstance(node, dict) else None
        if not isinstance(properties, dict) or depth > 16:
            return
        for name, inner in properties.items():
            if isinstance(inner, dict):
                if inner.get("type") == "number":
                    found[prefix + name] = pl.Float64()
                walk(inner, f"{prefix}{name}.", depth + 1)

    if schema is not None and schema.encoding == "jsonschema":
        try:
            walk(json.loads(schema.data), "", 0)
        except (ValueError, RecursionError):
            log.debug("schema %s is no JSON", schema.name)
    return found


def flat(frame: pl.DataFrame) -> pl.DataFrame:
    """Structs as columns with dotted names, all the way down."""
    while nested := [n for n, dtype in frame.schema.items() if isinstance(dtype, pl.Struct)]:
        columns: list[pl.Series] = []
        for name in frame.columns:
            column = frame[name]
            if name not in nested:
                columns.append(column)
                continue
            for inner in column.struct.fields:
                columns.append(column.struct.field(inner).rename(f"{name}.{inner}"))
        frame = pl.DataFrame(columns) if columns else frame.select([])
    return frame
