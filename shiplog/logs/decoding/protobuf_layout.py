"""Protobuf messages that differ in their numbers alone, decoded as a matrix of bytes.

A sensor's messages have the same fields in the same order. So the first one is taken apart, and the
rest that agree with it in every tag and length are read column by column. What agrees with none of
the layouts met so far is left to the protobuf package, which also decides what is broken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import polars as pl
from google.protobuf.descriptor import Descriptor, FieldDescriptor

from shiplog.logs.decoding.messages import Messages

F = FieldDescriptor
VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5  # wire types
ZIGZAG = (F.TYPE_SINT32, F.TYPE_SINT64)
SIGNED = (F.TYPE_INT32, F.TYPE_INT64, *ZIGZAG)
WIRE = {
    F.TYPE_DOUBLE: FIXED64, F.TYPE_FIXED64: FIXED64, F.TYPE_SFIXED64: FIXED64,
    F.TYPE_FLOAT: FIXED32, F.TYPE_FIXED32: FIXED32, F.TYPE_SFIXED32: FIXED32,
    F.TYPE_INT32: VARINT, F.TYPE_INT64: VARINT, F.TYPE_UINT32: VARINT, F.TYPE_UINT64: VARINT,
    F.TYPE_SINT32: VARINT, F.TYPE_SINT64: VARINT, F.TYPE_BOOL: VARINT, F.TYPE_ENUM: VARINT,
    F.TYPE_STRING: BYTES, F.TYPE_BYTES: BYTES, F.TYPE_MESSAGE: BYTES,
}  # fmt: skip
FIXED = {
    F.TYPE_DOUBLE: "<f8", F.TYPE_FLOAT: "<f4", F.TYPE_FIXED64: "<u8", F.TYPE_SFIXED64: "<i8",
    F.TYPE_FIXED32: "<u4", F.TYPE_SFIXED32: "<i4",
}  # fmt: skip
DTYPES = {
    pl.Float64: np.float64, pl.Boolean: np.bool_, pl.Int32: np.int32, pl.Int64: np.int64,
    pl.UInt32: np.uint32, pl.UInt64: np.uint64,
}  # fmt: skip
DEEPEST = 12  # messages in messages; further down, or inside their own kind, nothing is read
LONGEST_VARINT = 10  # bytes
MOST_LAYOUTS = 64  # of messages of one length; instruments have fewer than ten

Groups = Mapping[int, Sequence[tuple[np.ndarray, np.ndarray]]]


class _Odd(Exception):
    """A message that is left to the protobuf package."""


@dataclass(slots=True)
class _Layout:
    """Where the fields of a message of L bytes are.

    mask    [L] which bits of each byte every message of this layout shares, and `same` [L] those
    fields  dotted name → its type, where its value begins, and its bytes
    inside  dotted names of the messages in it that are there
    texts   (first, end) of strings, which here are ASCII
    """

    mask: np.ndarray
    same: np.ndarray
    fields: dict[str, tuple[int, int, int]] = field(default_factory=dict)
    inside: set[str] = field(default_factory=set)
    texts: list[tuple[int, int]] = field(default_factory=list)

    def fits(self, messages: np.ndarray) -> np.ndarray:
        """Which of the messages [n, L] have this layout [n]."""
        fit = ((messages & self.mask) == self.same).all(axis=1)
        for first, end in self.texts:
            fit &= (messages[:, first:end] < 0x80).all(axis=1)
        return fit


class FlatMessages:
    """The numbers `leaves` of one schema's messages."""

    def __init__(self, reader: Messages, kind: Descriptor, leaves: Sequence[str]) -> None:
        self._reader, self._kind, self._leaves = reader, kind, list(leaves)
        self._types = {leaf: DTYPES[type(reader.layout[leaf])] for leaf in leaves}
        self._layouts: dict[int, list[_Layout]] = {}

    def columns(self, count: int, groups: Groups) -> tuple[pl.DataFrame, np.ndarray]:
        """Leaves of the messages that decoded, and which of all did not [count] bool.

        groups  bytes of a message → (rows [n], messages [n, bytes]) of that length
        """
        values = {leaf: np.zeros(count, dtype) for leaf, dtype in self._types.items()}
        nulls = {leaf: np.zeros(count, np.bool_) for leaf in self._leaves}
        others: list[tuple[int, bytes]] = []
        for length, parts in groups.items():
            rows = np.concatenate([part[0] for part in parts])
            messages = np.concatenate([part[1] for part in parts])
            others += self._of_length(length, rows, messages, values, nulls)
        bad = self._one_by_one(others, values, nulls, count)
        good = ~bad
        return pl.DataFrame([
            _series(leaf, self._reader.layout[leaf], values[leaf][good], nulls[leaf][good])
            for leaf in self._leaves
        ]), bad  # fmt: skip

    def _of_length(
        self, length: int, rows: np.ndarray, messages: np.ndarray,
        values: dict[str, np.ndarray], nulls: dict[str, np.ndarray],
    ) -> list[tuple[int, bytes]]:  # fmt: skip
        """Fill in the messages [n, length] whose layout is known; the others with their rows."""
        known = self._layouts.setdefault(length, [])
        others: list[tuple[int, bytes]] = []
        tried = 0
        while len(rows):
            if tried == len(known):
                if tried == MOST_LAYOUTS:
                    left = zip(rows.tolist(), messages, strict=True)
                    return others + [(row, message.tobytes()) for row, message in left]
                first = messages[0].tobytes()
                layout = self._layout(first)
                if layout is None:
                    others.append((int(rows[0]), first))
                    rows, messages = rows[1:], messages[1:]
                    continue
                known.append(layout)
            layout = known[tried]
            tried += 1
            fit = layout.fits(messages)
            if fit.all():
                self._fill(layout, rows, messages, values, nulls)
                return others
            self._fill(layout, rows[fit], messages[fit], values, nulls)
            rows, messages = rows[~fit], messages[~fit]
        return others

    def _fill(
        self, layout: _Layout, rows: np.ndarray, messages: np.ndarray,
        values: dict[str, np.ndarray], nulls: dict[str, np.ndarray],
    ) -> None:  # fmt: skip
        for leaf in self._leaves if len(rows) else ():
            if leaf in layout.fields:
                values[leaf][rows] = _decoded(messages, *layout.fields[leaf])
            elif self._absent(leaf, layout):
                nulls[leaf][rows] = True

    def _absent(self, leaf: str, layout: _Layout) -> bool:
        """Whether a field that was not sent is null, and not zero."""
        kind, parts = self._kind, leaf.split(".")
        for depth, name in enumerate(parts[:-1], start=1):
            if ".".join(parts[:depth]) not in layout.inside:
                return True
            kind = _inner(kind.fields_by_name[name])
        return kind.fields_by_name[parts[-1]].has_presence

    def _layout(self, message: bytes) -> _Layout | None:
        size = len(message)
        layout = _Layout(np.zeros(size, np.uint8), np.zeros(size, np.uint8))
        try:
            _lay_out(layout, message, 0, size, self._kind, "", DEEPEST)
        except _Odd:
            return None
        layout.same = np.frombuffer(message, np.uint8) & layout.mask
        return layout

    def _one_by_one(
        self, others: list[tuple[int, bytes]], values: dict[str, np.ndarray],
        nulls: dict[str, np.ndarray], count: int,
    ) -> np.ndarray:  # fmt: skip
        """Fill in what the package decodes; which rows it does not [count]."""
        bad = np.zeros(count, np.bool_)
        if others:
            rows = np.array([row for row, _ in others])
            frame, failed = self._reader.columns([payload for _, payload in others], self._leaves)
            bad[rows[failed]] = True
            rows = rows[~failed]
            for leaf in self._leaves:
                column = frame[leaf]
                nulls[leaf][rows] = column.is_null().to_numpy()
                zero = False if column.dtype == pl.Boolean else 0
                values[leaf][rows] = column.fill_null(zero).to_numpy()
        return bad


def flat(reader: Messages, kind: Descriptor, leaves: Sequence[str]) -> FlatMessages | None:
    """The decoder of numbers alone; None where other things are wanted, or the schema has fields
    that must be sent."""
    wanted = all(type(reader.layout[leaf]) in DTYPES for leaf in leaves)
    if not wanted or any(_field(kind, leaf).type == F.TYPE_ENUM for leaf in leaves):
        return None
    return None if _demanding(kind, set()) else FlatMessages(reader, kind, leaves)


def _field(kind: Descriptor, leaf: str) -> FieldDescriptor:
    *above, last = leaf.split(".")
    for name in above:
        kind = _inner(kind.fields_by_name[name])
    return kind.fields_by_name[last]


def _inner(one: FieldDescriptor) -> Descriptor:
    kind = one.message_type
    assert kind is not None
    return kind


def _demanding(kind: Descriptor, met: set[str]) -> bool:
    """Whether some field is required, so that a message without it is broken."""
    if kind.full_name in met:
        return False
    met.add(kind.full_name)
    return any(
        _required(one)
        or (one.message_type is not None and _demanding(one.message_type, met))
        for one in kind.fields
    )  # fmt: skip


def _required(one: FieldDescriptor) -> bool:
    if hasattr(one, "is_required"):
        return bool(one.is_required)
    return getattr(one, "label", None) == F.LABEL_REQUIRED


def _lay_out(
    layout: _Layout, data: bytes, at: int, end: int, kind: Descriptor, path: str | None, left: int
) -> None:
    """Note the fields of a message in data[at:end]. Raises _Odd.

    path  of the message itself, with its dot; None where its fields are no leaves, as in lists
    """
    if left == 0:
        raise _Odd
    one_ofs: set[str] = set()
    while at < end:
        tag, begin = _varint(data, at, end, shortest=True)
        layout.mask[at:begin] = 0xFF
        known = kind.fields_by_number.get(tag >> 3)
        if tag >> 3 == 0 or tag > 0xFFFF_FFFF:
            raise _Odd
        begin, at = _value(layout, data, begin, end, tag & 7)
        if known is not None:  # else the sender's schema is newer
            _note(layout, data, (begin, at), known, tag & 7, path, left)
        if known is not None and known.containing_oneof is not None:
            name = known.containing_oneof.full_name
            if name in one_ofs:  # the last one counts
                raise _Odd
            one_ofs.add(name)


def _value(layout: _Layout, data: bytes, at: int, end: int, wire: int) -> tuple[int, int]:
    """Where a value begins and ends; every message of the layout shares its length."""
    if wire == VARINT:
        begin, (_, after) = at, _varint(data, at, end)
        layout.mask[begin:after] = 0x80
    elif wire == BYTES:
        size, begin = _varint(data, at, end, shortest=True)
        layout.mask[at:begin] = 0xFF
        after = begin + size
    elif wire in (FIXED32, FIXED64):
        begin, after = at, at + (8 if wire == FIXED64 else 4)
    else:
        raise _Odd
    if after > end:
        raise _Odd
    return begin, after


def _note(
    layout: _Layout, data: bytes, place: tuple[int, int], known: FieldDescriptor, wire: int,
    path: str | None, left: int,
) -> None:  # fmt: skip
    begin, after = place
    expected, many = WIRE.get(known.type), repeated(known)
    packed = many and wire == BYTES and expected not in (BYTES, None)
    if expected != wire and not packed:
        raise _Odd
    name = None if path is None or many else path + known.name
    if packed:
        _check_packed(layout, data, begin, after, expected)
    elif known.type == F.TYPE_STRING:
        layout.texts.append((begin, after))
        if not data[begin:after].isascii():
            raise _Odd
    elif known.type == F.TYPE_MESSAGE:
        if name in layout.inside:  # two in one place are merged
            raise _Odd
        if name is not None:
            layout.inside.add(name)
        below = None if name is None else f"{name}."
        _lay_out(layout, data, begin, after, _inner(known), below, left - 1)
    elif name is not None:  # sent twice, the last one counts
        layout.fields[name] = known.type, begin, after - begin


def _check_packed(layout: _Layout, data: bytes, begin: int, after: int, wire: int | None) -> None:
    """A list of numbers in one value."""
    if wire == VARINT:
        layout.mask[begin:after] |= 0x80
        while begin < after:
            if (
                after - begin >= LONGEST_VARINT
                and min(data[begin : begin + LONGEST_VARINT - 1]) > 127
            ):
                raise _Odd
            begin = _varint(data, begin, after)[1]
    elif (after - begin) % (8 if wire == FIXED64 else 4):
        raise _Odd


def _varint(data: bytes, at: int, end: int, shortest: bool = False) -> tuple[int, int]:
    """A number of 7 bits a byte, and where it ends. Raises _Odd where it does not end, or could
    be shorter."""
    value = 0
    for place in range(at, min(end, at + LONGEST_VARINT)):
        value |= (data[place] & 0x7F) << 7 * (place - at)
        if data[place] < 0x80:
            if shortest and place > at and data[place] == 0:
                raise _Odd
            return value, place + 1
    raise _Odd


def repeated(one: FieldDescriptor) -> bool:
    """Whether a field is a list or a map."""
    if hasattr(one, "is_repeated"):  # protobuf 6 and later; `label` is on its way out
        return bool(one.is_repeated)
    return getattr(one, "label", None) == F.LABEL_REPEATED


def _decoded(messages: np.ndarray, kind: int, begin: int, size: int) -> np.ndarray:
    """One field of messages [n, L], [n]."""
    raw = messages[:, begin : begin + size]
    if kind in FIXED:
        return np.ascontiguousarray(raw).view(FIXED[kind])[:, 0]
    value = np.zeros(len(raw), np.uint64)
    for place in range(size):
        value |= (raw[:, place].astype(np.uint64) & np.uint64(0x7F)) << np.uint64(7 * place)
    if kind == F.TYPE_BOOL:
        return value != 0
    if kind in (F.TYPE_INT32, F.TYPE_UINT32, F.TYPE_SINT32):
        value = value.astype(np.uint32)
    if kind in ZIGZAG:
        value = (value >> 1) ^ (~(value & 1) + 1)
    return value.view(f"i{value.itemsize}") if kind in SIGNED else value


def _series(name: str, dtype: pl.DataType, values: np.ndarray, nulls: np.ndarray) -> pl.Series:
    made = pl.Series(name, values, dtype)
    return made.set(pl.Series(nulls), None) if nulls.any() else made
