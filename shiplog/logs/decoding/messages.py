"""What a decoder is, and what protobuf's and ROS 2's have in common.

`layout` names every leaf field and its type (empty for JSON, whose messages say it themselves);
`bulk` are leaves too large to keep unasked, such as images; `columns` decodes messages into the
leaves that are wanted and marks those that would not decode.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any, Protocol

import numpy as np
import polars as pl

MOST_FIELDS = 10_000  # of a message, in all its parts: an autopilot's state has some hundred


class Undecodable(Exception):
    """Why a topic is left out; it never leaves this package."""


class Fields:
    """How many fields a schema has had so far: ten types of eight parts each make 8^10 of them."""

    def __init__(self) -> None:
        self.count = 0

    def more(self, count: int) -> None:
        """Raises ValueError where that is more than a message has."""
        self.count += count
        if self.count > MOST_FIELDS:
            raise ValueError(f"it has more than {MOST_FIELDS} fields")


class Decoder(Protocol):
    layout: dict[str, pl.DataType]
    bulk: frozenset[str]

    def columns(
        self, payloads: Sequence[bytes], leaves: Collection[str] | None
    ) -> tuple[pl.DataFrame, np.ndarray]:
        """Leaves of the messages that decoded, and which of all did not [n] bool."""
        ...


class Messages:
    """Messages with a schema: parsed by their package, taken apart along the schema's types.

    kind   the type of a whole message, and `bulk` what not to keep of it unasked
    parse  from a payload to an object, or an exception
    get    a field of such an object, None where the message does not have it
    """

    def __init__(
        self,
        kind: pl.Struct,
        parse: Callable[[bytes], Any],
        get: Callable[[Any, str], Any],
        bulk: Collection[str],
    ) -> None:
        self.layout = dict(leaves_of(kind))
        self.bulk = frozenset(bulk)
        self._parse, self._get = parse, get

    def columns(
        self, payloads: Sequence[bytes], leaves: Collection[str] | None
    ) -> tuple[pl.DataFrame, np.ndarray]:
        wanted = {n: self.layout[n] for n in (self.layout if leaves is None else leaves)}
        ways = [(name.split("."), dtype) for name, dtype in wanted.items()]
        bad = np.zeros(len(payloads), np.bool_)
        rows: list[list[Any]] = []
        for i, payload in enumerate(payloads):
            try:
                message = self._parse(payload)
                rows.append([self._value(self._at(message, way), dtype) for way, dtype in ways])
            except Exception:  # each package raises its own; one payload must not cost the others
                bad[i] = True
        values = zip(*rows, strict=True) if rows else [()] * len(wanted)
        named = zip(wanted.items(), values, strict=bool(rows))
        return pl.DataFrame([pl.Series(n, v, dtype) for (n, dtype), v in named]), bad

    def _at(self, message: Any, way: Sequence[str]) -> Any:
        for name in way:
            if message is not None:
                message = self._get(message, name)
        return message

    def _value(self, found: Any, dtype: Any) -> Any:
        if isinstance(dtype, pl.List):  # never null: what was not sent is empty
            if hasattr(found, "items"):  # a map, in the order of its keys: it has none of its own
                return [{"key": k, "value": self._value(v, _valued(dtype))}
                        for k, v in sorted(found.items())]  # fmt: skip
            return [] if found is None else [self._value(item, dtype.inner) for item in found]
        if isinstance(dtype, pl.Struct) and found is not None:
            return {f.name: self._value(self._get(found, f.name), f.dtype) for f in dtype.fields}
        if dtype == pl.UInt8 and found is not None:
            return found & 0xFF  # `char` is unsigned in ROS 2
        return found


def _valued(entries: pl.List) -> Any:
    return {f.name: f.dtype for f in entries.inner.fields}["value"]  # type: ignore[union-attr]


def leaves_of(kind: pl.Struct, prefix: str = "") -> Iterator[tuple[str, pl.DataType]]:
    """Every field of a message that is not a message itself, under its dotted name."""
    for field in kind.fields:
        if isinstance(field.dtype, pl.Struct):
            yield from leaves_of(field.dtype, f"{prefix}{field.name}.")
        else:
            yield prefix + field.name, field.dtype  # type: ignore[misc]
