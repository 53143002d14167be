"""JSON: polars' reader for many messages at once, one message at a time only where that fails."""

from __future__ import annotations

import json
import logging
import math
from collections.abc import Collection, Iterator, Sequence
from io import BytesIO
from typing import Any

import numpy as np
import polars as pl
from mcap.records import Schema

from shiplog.logs.decoding.messages import MOST_FIELDS

log = logging.getLogger(__name__)

DEEPEST = 64  # further down no message goes; polars' reader takes seconds for a few that do


class Json:
    """Messages without types of their own, but for what a JSON schema calls a number."""

    def __init__(self, schema: Schema | None) -> None:
        self.layout: dict[str, pl.DataType] = {}
        self.bulk: frozenset[str] = frozenset()
        self._stated = _stated_types(schema)

    def columns(
        self, payloads: Sequence[bytes], leaves: Collection[str] | None
    ) -> tuple[pl.DataFrame, np.ndarray]:
        bad = np.zeros(len(payloads), np.bool_)
        if any(len(payload) > 2 * DEEPEST for payload in payloads):  # as one so deep has to be
            payloads = [b"" if _is_too_deep(payload) else payload for payload in payloads]
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

    def _one_by_one(self, payloads: Sequence[bytes], bad: np.ndarray) -> pl.DataFrame:
        rows: list[dict[str, Any]] = []
        for i, payload in enumerate(payloads):
            try:
                message = json.loads(payload)
                if not isinstance(message, dict):
                    raise ValueError("not an object")
                rows.append(dict(_leaves(message)))
            except (ValueError, RecursionError):
                bad[i] = True
        names = dict.fromkeys(name for row in rows for name in row)
        return pl.DataFrame([_column(name, [row.get(name) for row in rows]) for name in names])


def _is_too_deep(payload: bytes) -> bool:
    """Whether a message goes deeper, or has more fields, than any does."""
    if len(payload) <= 2 * DEEPEST:
        return False
    brackets = payload.count(b"{") + payload.count(b"[")
    if brackets <= DEEPEST and payload.count(b":") <= MOST_FIELDS:
        return False
    try:
        parts = [json.loads(payload)]
    except ValueError:
        return False  # no JSON at all, as will be found
    except RecursionError:
        return True
    names: set[str] = set()
    for _ in range(DEEPEST):
        for part in parts:
            names.update(part if isinstance(part, dict) else ())
        inside = [part.values() if isinstance(part, dict) else part for part in parts]
        parts = [one for part in inside for one in part if isinstance(one, (dict, list))]
        if not parts or len(names) > MOST_FIELDS:
            break
    return bool(parts) or len(names) > MOST_FIELDS


def _leaves(message: dict, prefix: str = "", depth: int = 0) -> Iterator[tuple[str, Any]]:
    for key, field in message.items():
        if isinstance(field, dict) and field and depth < 16:
            yield from _leaves(field, f"{prefix}{key}.", depth + 1)
        else:
            yield f"{prefix}{key}", field if field != {} else None


def _column(name: str, values: list[Any]) -> pl.Series:
    if any(isinstance(v, float) for v in values):
        values = [_float(v) if type(v) is int else v for v in values]
    try:
        return pl.Series(name, values, strict=True)
    except Exception:  # mixed types: keep the values, as text
        text = [v if v is None or isinstance(v, str) else json.dumps(v) for v in values]
        return pl.Series(name, text, pl.String)


def _float(number: int) -> float:
    try:
        return float(number)
    except OverflowError:  # hundreds of digits: beyond any number, as 1e400 is
        return math.inf if number > 0 else -math.inf


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
    while any(isinstance(dtype, pl.Struct) for dtype in frame.dtypes):
        columns: list[pl.Series] = []
        for column in frame:
            if isinstance(column.dtype, pl.Struct):
                inner = column.struct
                columns += [inner.field(f).rename(f"{column.name}.{f}") for f in inner.fields]
            else:
                columns.append(column)
        frame = pl.DataFrame(columns)
    return frame
