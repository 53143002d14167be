"""ROS 2: the types of its message definitions, and `mcap_ros2` to parse CDR."""

from __future__ import annotations

import contextlib
import io

import polars as pl
from mcap.records import Schema
from mcap_ros2._dynamic import TimeDefinition, _for_each_msgdef
from mcap_ros2.decoder import DecoderFactory

from .messages import Fields, Messages

SCALAR_TYPES: dict[str, pl.DataType] = {
    "bool": pl.Boolean(), "byte": pl.UInt8(), "char": pl.UInt8(),  # `char` is unsigned in ROS 2
    "int8": pl.Int8(), "uint8": pl.UInt8(), "int16": pl.Int16(), "uint16": pl.UInt16(),
    "int32": pl.Int32(), "uint32": pl.UInt32(), "int64": pl.Int64(), "uint64": pl.UInt64(),
    "float32": pl.Float64(), "float64": pl.Float64(), "string": pl.String(),
}  # fmt: skip
BYTES = ("byte", "char", "uint8")


def messages(schema: Schema) -> Messages:
    """The decoder of one schema; any exception says that its definition is broken."""
    kinds = _Kinds(schema)
    kind = kinds.struct(kinds.root)  # first: the package follows parts of parts without end
    with contextlib.redirect_stderr(io.StringIO()):  # it prints what it is about to raise
        parse = DecoderFactory().decoder_for("cdr", schema)
    if parse is None:
        raise ValueError("no ros2msg definition")
    return Messages(kind, parse, getattr, kinds.bulk)


class _Kinds:
    """Every message type that a schema defines. The package parses them but does not show them."""

    def __init__(self, schema: Schema) -> None:
        # writers may leave these two out of the schema
        self._fields = {
            f"builtin_interfaces/{kind}": TimeDefinition.fields for kind in ("Time", "Duration")
        }
        self.bulk: list[str] = []
        self._met = Fields()

        def keep(name, short, definition):
            self._fields[short] = definition.fields

        _for_each_msgdef(schema.name, schema.data.decode(), keep)
        package, *_, name = schema.name.split("/")
        self.root = f"{package}/{name}"

    def struct(self, kind: str, prefix: str = "") -> pl.Struct:
        types: dict[str, pl.DataType] = {}
        self._met.more(len(self._fields[kind]))
        for field in self._fields[kind]:
            one = field.type
            if one.is_primitive_type():
                single = SCALAR_TYPES[one.type]
            else:
                single = self.struct(f"{one.pkg_name}/{one.type}", f"{prefix}{field.name}.")
                if not single.fields:
                    continue  # an empty message
            types[field.name] = pl.List(single) if one.is_array else single
            if one.is_dynamic_array() and one.type in BYTES:
                self.bulk.append(prefix + field.name)
        return pl.Struct(types)
