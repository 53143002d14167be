"""Protobuf: the types that the log's own descriptors state, and `mcap_protobuf` to parse."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import polars as pl
from google.protobuf.descriptor import Descriptor, FieldDescriptor
from mcap.records import Schema
from mcap_protobuf.decoder import DecoderFactory

from shiplog.logs.decoding.messages import Fields, Messages, leaves_of
from shiplog.logs.decoding.protobuf_layout import DEEPEST, FlatMessages, flat, repeated

F = FieldDescriptor
SCALAR_TYPES: dict[int, pl.DataType] = {
    F.TYPE_DOUBLE: pl.Float64(), F.TYPE_FLOAT: pl.Float64(), F.TYPE_BOOL: pl.Boolean(),
    F.TYPE_INT32: pl.Int32(), F.TYPE_SINT32: pl.Int32(), F.TYPE_SFIXED32: pl.Int32(),
    F.TYPE_INT64: pl.Int64(), F.TYPE_SINT64: pl.Int64(), F.TYPE_SFIXED64: pl.Int64(),
    F.TYPE_UINT32: pl.UInt32(), F.TYPE_FIXED32: pl.UInt32(),
    F.TYPE_UINT64: pl.UInt64(), F.TYPE_FIXED64: pl.UInt64(),
    F.TYPE_STRING: pl.String(), F.TYPE_BYTES: pl.Binary(),
    F.TYPE_ENUM: pl.Int32(),  # a number in every encoding
}  # fmt: skip


class ProtobufMessages(Messages):
    """Messages of a schema that can also be decoded many at once."""

    def __init__(self, descriptor: Descriptor, parse: Callable[[bytes], Any]) -> None:
        kind = _struct(descriptor, (descriptor.full_name,), Fields())
        bulk = [name for name, dtype in leaves_of(kind) if dtype == pl.Binary]
        super().__init__(kind, parse, _getter(), bulk)
        self._descriptor = descriptor

    def flat(self, leaves: Sequence[str]) -> FlatMessages | None:
        """The decoder of these leaves alone, where they are numbers."""
        return flat(self, self._descriptor, leaves)


def messages(schema: Schema) -> ProtobufMessages:
    """The decoder of one schema; any exception says that its descriptors are broken."""
    parse = DecoderFactory().decoder_for("protobuf", schema)
    if parse is None:
        raise ValueError("no protobuf descriptors")
    return ProtobufMessages(parse(b"").DESCRIPTOR, parse)


def _struct(kind: Descriptor, inside: tuple[str, ...], met: Fields) -> pl.Struct:
    met.more(len(kind.fields))
    types = {field.name: _dtype(field, inside, met) for field in kind.fields}
    return pl.Struct({name: dtype for name, dtype in types.items() if dtype is not None})


def _dtype(field: FieldDescriptor, inside: tuple[str, ...], met: Fields) -> pl.DataType | None:
    """The type of a field; None for what holds nothing, or would contain itself."""
    single = SCALAR_TYPES.get(field.type)
    if single is None:
        kind = field.message_type
        if field.type == F.TYPE_GROUP or kind is None or kind.full_name in inside:
            return None
        if len(inside) > DEEPEST:
            return None
        single = _struct(kind, (*inside, kind.full_name), met)
        if not single.fields:
            return None
    return pl.List(single) if repeated(field) else single


def _getter() -> Callable[[Any, str], Any]:
    """A field of a message, None where it can be absent and is; remembers which can be."""
    optional: dict[Descriptor, frozenset[str]] = {}

    def get(message: Any, name: str) -> Any:
        kind = message.DESCRIPTOR
        if kind not in optional:
            optional[kind] = frozenset(field.name for field in kind.fields if field.has_presence)
        if name in optional[kind] and not message.HasField(name):
            return None
        return getattr(message, name)

    return get
