"""Protobuf: numbers and texts by a compiled table, lists of messages by the protobuf package."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl
from google.protobuf.descriptor import Descriptor, FieldDescriptor
from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory

from . import kernels
from .columns import blanked, lists, numbers, texts
from .decoders import Piece, Undecodable

log = logging.getLogger(__name__)

F = FieldDescriptor
DEEPEST = 12  # further down, and in a message inside its own kind, nothing is read
KINDS: dict[int, tuple[int, str, pl.DataType]] = {  # how it is packed, as numpy, as a column
    F.TYPE_DOUBLE: (kernels.DOUBLE, "f8", pl.Float64()),
    F.TYPE_FLOAT: (kernels.FLOAT, "f4", pl.Float64()),
    F.TYPE_INT32: (kernels.VARINT, "i4", pl.Int32()),
    F.TYPE_INT64: (kernels.VARINT, "i8", pl.Int64()),
    F.TYPE_UINT32: (kernels.VARINT, "u4", pl.UInt32()),
    F.TYPE_UINT64: (kernels.VARINT, "u8", pl.UInt64()),
    F.TYPE_SINT32: (kernels.ZIGZAG, "i4", pl.Int32()),
    F.TYPE_SINT64: (kernels.ZIGZAG, "i8", pl.Int64()),
    F.TYPE_FIXED32: (kernels.FIXED32, "u4", pl.UInt32()),
    F.TYPE_FIXED64: (kernels.FIXED64, "u8", pl.UInt64()),
    F.TYPE_SFIXED32: (kernels.FIXED32, "i4", pl.Int32()),
    F.TYPE_SFIXED64: (kernels.FIXED64, "i8", pl.Int64()),
    F.TYPE_BOOL: (kernels.VARINT, "?", pl.Boolean()),
    F.TYPE_ENUM: (kernels.VARINT, "i4", pl.Int32()),  # a number in every encoding
    F.TYPE_STRING: (kernels.TEXT, "", pl.String()),
    F.TYPE_BYTES: (kernels.TEXT, "", pl.Binary()),
}


@dataclass(frozen=True, slots=True)
class Leaf:
    """One field at the end of a path of enclosing messages."""

    dtype: pl.DataType
    way: tuple[FieldDescriptor, ...]

    @property
    def field(self) -> FieldDescriptor:
        return self.way[-1]

    @property
    def compiled(self) -> bool:
        """Whether the table can hold it: not lists of texts or of messages."""
        kind = KINDS.get(self.field.type)
        return kind is not None and not (_repeated(self.field) and kind[0] == kernels.TEXT)


class Protobuf:
    """Messages of one schema, described by the descriptors that came with the log."""

    def __init__(self, schema: Schema) -> None:
        parse = DecoderFactory().decoder_for("protobuf", schema)
        if parse is None:
            raise Undecodable("no protobuf descriptors")
        self._parse: Callable[[bytes], Any] = parse
        self._leaves: dict[str, Leaf] = {}
        self._collect(parse(b"").DESCRIPTOR, "", (), ())
        self.layout = {name: leaf.dtype for name, leaf in self._leaves.items()}
        self.bulk = frozenset(n for n, t in self.layout.items() if t == pl.Binary)
        self._tables: dict[frozenset[str], Table] = {}

    def _collect(
        self,
        kind: Descriptor,
        prefix: str,
        way: tuple[FieldDescriptor, ...],
        inside: tuple[str, ...],
    ) -> None:
        for field in kind.fields:
            here = (*way, field)
            inner = field.message_type
            if field.type == F.TYPE_MESSAGE and inner is not None and not _repeated(field):
                if inner.full_name not in inside and len(here) < DEEPEST:
                    within = (*inside, inner.full_name)
                    self._collect(inner, f"{prefix}{field.name}.", here, within)
            elif field.type != F.TYPE_GROUP:
                dtype = _dtype(field, inside)
                if dtype is not None:
                    self._leaves[prefix + field.name] = Leaf(dtype, here)

    def columns(
        self, piece: Piece, leaves: Collection[str] | None
    ) -> tuple[pl.DataFrame, np.ndarray]:
        wanted = {n: self._leaves[n] for n in (self._leaves if leaves is None else leaves)}
        quick = frozenset(name for name, leaf in wanted.items() if leaf.compiled)
        table = self._tables.get(quick)
        if table is None:
            table = self._tables[quick] = Table({n: wanted[n] for n in wanted if n in quick})
        columns, bad = table.decode(piece)
        if len(quick) < len(wanted):
            slow = {n: leaf for n, leaf in wanted.items() if n not in quick}
            columns, bad = self._with_slow(piece, slow, columns, bad)
        elif bad.any():
            columns = [column.filter(pl.Series(~bad)) for column in columns]
        made = {column.name: column for column in columns}
        return pl.DataFrame([made[name] for name in wanted]), bad

    def _with_slow(
        self, piece: Piece, slow: dict[str, Leaf], columns: list[pl.Series], bad: np.ndarray
    ) -> tuple[list[pl.Series], np.ndarray]:
        bad = bad.copy()
        values: dict[str, list] = {name: [] for name in slow}
        for i, payload in enumerate(piece.payloads()):
            if bad[i]:
                continue
            try:
                message = self._parse(payload)
            except Exception:
                bad[i] = True
                continue
            for name, leaf in slow.items():
                values[name].append(_plain(message, leaf))
        columns = [column.filter(pl.Series(~bad)) for column in columns]
        made = [pl.Series(n, values[n], leaf.dtype, strict=False) for n, leaf in slow.items()]
        return columns + made, bad


class Table:
    """Wanted leaves as the rows of numbers that `kernels.protobuf` follows."""

    def __init__(self, leaves: dict[str, Leaf]) -> None:
        self._leaves = leaves
        nodes: dict[tuple[int, ...], int] = {(): 0}
        rows: list[tuple[int, int, int, int]] = []
        self._nodes: list[int] = []  # the node of each column, and the nodes around it
        self._around: dict[int, list[int]] = {0: []}
        for column, leaf in enumerate(leaves.values()):
            node = 0
            for depth, parent in enumerate(leaf.way[:-1]):
                numbers = tuple(field.number for field in leaf.way[: depth + 1])
                if numbers not in nodes:
                    nodes[numbers] = len(nodes)
                    rows.append((node, parent.number, kernels.MESSAGE, nodes[numbers]))
                    self._around[nodes[numbers]] = [*self._around[node], nodes[numbers]]
                node = nodes[numbers]
            kind = KINDS[leaf.field.type][0] + kernels.REPEATED * _repeated(leaf.field)
            rows.append((node, leaf.field.number, kind, column))
            self._nodes.append(node)
        self._rows = np.array(rows or [(0, 0, 0, 0)], np.int64)
        self._lists = any(_repeated(leaf.field) for leaf in leaves.values())

    def decode(self, piece: Piece) -> tuple[list[pl.Series], np.ndarray]:
        n, width = piece.start.size, max(len(self._leaves), 1)
        data = np.frombuffer(piece.data, np.uint8)
        bits = np.zeros((width, n), np.uint64)
        extent = np.zeros((width, n, 2), np.int64)
        seen = np.zeros((width, n), np.bool_)
        present = np.zeros((len(self._around), n), np.bool_)
        counts = np.zeros((width, n), np.int64)
        base = np.zeros(width, np.int64)
        flat = np.empty(0, np.uint64)

        bad = np.zeros(n, np.bool_)
        where = (data, piece.start, piece.length, self._rows, bits, extent, seen, present)
        kernels.protobuf(*where, flat, base, counts, bad)
        total = counts.sum(axis=1)
        if self._lists and total.sum():  # the first run counted, the second fills
            base = np.cumsum(total) - total
            flat = np.empty(int(total.sum()), np.uint64)
            kernels.protobuf(*where, flat, base, counts, bad)
        columns = []
        for c, (name, leaf) in enumerate(self._leaves.items()):
            missing = np.zeros(n, np.bool_)
            for node in self._around[self._nodes[c]]:
                missing |= ~present[node]
            if leaf.field.has_presence:
                missing |= ~seen[c]
            kind, number, _ = KINDS[leaf.field.type]
            if _repeated(leaf.field):
                values = numbers(flat[base[c] : base[c] + total[c]], number)
                column = lists(values, counts[c], leaf.dtype)
            elif kind == kernels.TEXT:
                column = texts(data, extent[c, :, 0], extent[c, :, 1], leaf.dtype)
            else:
                column = numbers(bits[c], number)
            columns.append(blanked(column, missing).rename(name))
        return columns, bad


def _repeated(field: FieldDescriptor) -> bool:
    if hasattr(field, "is_repeated"):  # protobuf 6 and later; `label` is on its way out
        return bool(field.is_repeated)
    return getattr(field, "label", None) == F.LABEL_REPEATED


def _dtype(field: FieldDescriptor, inside: tuple[str, ...]) -> pl.DataType | None:
    """The column type of a leaf; None for what would contain itself."""
    if field.type in KINDS:
        single = KINDS[field.type][2]
    elif field.type == F.TYPE_MESSAGE and (kind := field.message_type) is not None:
        if kind.full_name in inside or len(inside) > DEEPEST:
            return None
        within = (*inside, kind.full_name)
        inner = {f.name: _dtype(f, within) for f in kind.fields}
        fields = [pl.Field(name, dtype) for name, dtype in inner.items() if dtype is not None]
        if not fields:
            return None
        single = pl.Struct(fields)
    else:
        return None
    return pl.List(single) if _repeated(field) else single


def _plain(message: Any, leaf: Leaf) -> Any:
    for field in leaf.way[:-1]:
        if not message.HasField(field.name):
            return None
        message = getattr(message, field.name)
    return _value(getattr(message, leaf.field.name), leaf.field, leaf.dtype)


def _value(found: Any, field: FieldDescriptor, dtype: Any) -> Any:
    if isinstance(dtype, pl.List):
        entries = field.message_type
        if entries is not None and entries.GetOptions().map_entry:
            key, inner = entries.fields
            entry = entries.fields_by_name["value"]
            kinds = {f.name: f.dtype for f in dtype.inner.fields}  # type: ignore[union-attr]
            return [
                {key.name: k, inner.name: _value(v, entry, kinds.get(inner.name))}
                for k, v in found.items()
            ]
        return [_value(item, field, dtype.inner) for item in found]
    if isinstance(dtype, pl.Struct):
        values = {}
        named = found.DESCRIPTOR.fields_by_name
        for inner in dtype.fields:
            described = named[inner.name]
            if described.has_presence and not found.HasField(inner.name):
                values[inner.name] = None
            else:
                values[inner.name] = _value(getattr(found, inner.name), described, inner.dtype)
        return values
    return found
