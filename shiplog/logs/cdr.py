"""ROS 2 in CDR: fields in order by compiled steps, lists of messages by the mcap_ros2 package."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
import polars as pl
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from . import kernels
from .columns import lists, numbers, texts
from .decoders import Piece, Undecodable

NUMBERS: dict[str, tuple[str, pl.DataType]] = {  # as numpy, as a column
    "bool": ("?", pl.Boolean()),
    "byte": ("u1", pl.UInt8()),
    "char": ("u1", pl.UInt8()),  # unsigned in ROS 2
    "int8": ("i1", pl.Int8()),
    "uint8": ("u1", pl.UInt8()),
    "int16": ("i2", pl.Int16()),
    "uint16": ("u2", pl.UInt16()),
    "int32": ("i4", pl.Int32()),
    "uint32": ("u4", pl.UInt32()),
    "int64": ("i8", pl.Int64()),
    "uint64": ("u8", pl.UInt64()),
    "float32": ("f4", pl.Float64()),
    "float64": ("f8", pl.Float64()),
    "string": ("", pl.String()),
}
BYTES = ("byte", "char", "uint8")
CLOCK = "int32 sec\nuint32 nanosec"  # writers may leave these two out of the schema
BUILT_IN = {"builtin_interfaces/Time": CLOCK, "builtin_interfaces/Duration": CLOCK}
FIELD = re.compile(
    r"^(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?:<=)?(?P<size>\d*)\])?\s+(?P<name>[A-Za-z]\w*)"
)
CONSTANT = re.compile(r"^[A-Za-z][\w/]*(?:<=\d+)?\s+\w+\s*=")


@dataclass(frozen=True, slots=True)
class Field:
    """One line of a message definition. `array` is None, a fixed size, or 0 for any length."""

    name: str
    type: str
    array: int | None


class Cdr:
    """Messages of one ROS 2 type."""

    def __init__(self, schema: Schema) -> None:
        self._kinds = definitions(schema.name, schema.data.decode())
        self._ways: dict[str, tuple[Field, ...]] = {}
        self.layout: dict[str, pl.DataType] = {}
        self._steps: dict[tuple[str, ...], np.ndarray] = {}
        self._name = short(schema.name)
        self._collect(self._name, "", ())
        self._parse: Callable[[bytes], Any] = _package_parser(schema)
        self.bulk = frozenset(
            name for name, way in self._ways.items() if way[-1].array == 0 and way[-1].type in BYTES
        )

    def _collect(self, kind: str, prefix: str, way: tuple[Field, ...]) -> None:
        for field in self._kinds[kind]:
            here = (*way, field)
            if field.type not in NUMBERS and field.array is None:
                self._collect(self._named(field.type, kind), f"{prefix}{field.name}.", here)
                continue
            self._ways[prefix + field.name] = here
            self.layout[prefix + field.name] = self._dtype(field, kind)

    def _named(self, kind: str, user: str) -> str:
        name = short(kind) if "/" in kind else f"{user.split('/')[0]}/{kind}"
        if name not in self._kinds:
            raise Undecodable(f"{name} is not defined")
        return name

    def _dtype(self, field: Field, user: str) -> pl.DataType:
        if field.type in NUMBERS:
            single = NUMBERS[field.type][1]
        else:
            kind = self._named(field.type, user)
            single = pl.Struct({f.name: self._dtype(f, kind) for f in self._kinds[kind]})
        return single if field.array is None else pl.List(single)

    def columns(
        self, piece: Piece, leaves: Collection[str] | None
    ) -> tuple[pl.DataFrame, np.ndarray]:
        wanted = list(self._ways if leaves is None else leaves)
        quick = tuple(name for name in wanted if self._compiled(name))
        steps = self._steps.get(quick)
        if steps is None:
            steps = self._steps[quick] = self._compile({n: c for c, n in enumerate(quick)})
        columns, bad = self._decode(piece, steps, quick)
        slow = [name for name in wanted if name not in quick]
        if slow:
            columns, bad = self._with_slow(piece, slow, columns, bad)
        elif bad.any():
            columns = [column.filter(pl.Series(~bad)) for column in columns]
        made = {column.name: column for column in columns}
        return pl.DataFrame([made[name] for name in wanted]), bad

    def _compiled(self, name: str) -> bool:
        """Whether the steps can hold it: not lists of texts or of messages."""
        field = self._ways[name][-1]
        return field.type in NUMBERS and not (field.type == "string" and field.array is not None)

    def _compile(self, columns: dict[str, int]) -> np.ndarray:
        """The steps `kernels.cdr` follows through a message, all fields in order."""
        steps: list[tuple[int, int, int, int]] = []

        def walk(kind: str, prefix: str, inside_list: bool) -> None:
            if not self._kinds[kind]:  # an empty message holds one byte
                steps.append((kernels.NUMBER, 1, -1, 0))
            for field in self._kinds[kind]:
                column = -1 if inside_list else columns.get(prefix + field.name, -1)
                count = -1 if field.array == 0 else field.array or 0
                if field.type in NUMBERS and field.type != "string":
                    size = np.dtype(NUMBERS[field.type][0]).itemsize
                    op = kernels.NUMBER if field.array is None else kernels.NUMBERS
                    steps.append((op, size, column, count))
                elif field.array is None and field.type == "string":
                    steps.append((kernels.STRING, 0, column, 0))
                elif field.array is None:
                    walk(self._named(field.type, kind), f"{prefix}{field.name}.", inside_list)
                else:
                    at = len(steps)
                    steps.append((kernels.LOOP, 0, -1, count))
                    if field.type == "string":
                        steps.append((kernels.STRING, 0, -1, 0))
                    else:
                        walk(self._named(field.type, kind), "", True)
                    steps.append((kernels.END, at, -1, 0))
                    steps[at] = (kernels.LOOP, len(steps), -1, count)

        walk(self._name, "", False)
        return np.array(steps, np.int64)

    def _decode(
        self, piece: Piece, steps: np.ndarray, names: tuple[str, ...]
    ) -> tuple[list[pl.Series], np.ndarray]:
        n, width = piece.start.size, max(len(names), 1)
        data = np.frombuffer(piece.data, np.uint8)
        bits = np.zeros((width, n), np.uint64)
        extent = np.zeros((width, n, 2), np.int64)
        counts = np.zeros((width, n), np.int64)
        base = np.zeros(width, np.int64)
        flat = np.empty(0, np.uint64)
        where = (data, piece.start, piece.length, steps, bits, extent)
        bad = np.zeros(n, np.bool_)
        kernels.cdr(*where, flat, base, counts, bad)
        total = counts.sum(axis=1)
        if total.sum():  # the first run counted, the second fills
            base = np.cumsum(total) - total
            flat = np.empty(int(total.sum()), np.uint64)
            kernels.cdr(*where, flat, base, counts, bad)
        columns = []
        for c, name in enumerate(names):
            field = self._ways[name][-1]
            number = NUMBERS[field.type][0]
            if field.array is not None:
                values = numbers(flat[base[c] : base[c] + total[c]], number)
                column = lists(values, counts[c], self.layout[name])
            elif field.type == "string":
                column = texts(data, extent[c, :, 0], extent[c, :, 1], pl.String())
            else:
                column = numbers(bits[c], number)
            columns.append(column.rename(name))
        return columns, bad

    def _with_slow(
        self, piece: Piece, names: list[str], columns: list[pl.Series], bad: np.ndarray
    ) -> tuple[list[pl.Series], np.ndarray]:
        bad = bad.copy()
        values: dict[str, list] = {name: [] for name in names}
        for i, payload in enumerate(piece.payloads()):
            if bad[i]:
                continue
            try:
                message = self._parse(payload)
            except Exception:
                bad[i] = True
                continue
            for name in names:
                found = message
                for field in self._ways[name]:
                    found = getattr(found, field.name)
                values[name].append(_plain(found, self.layout[name]))
        columns = [column.filter(pl.Series(~bad)) for column in columns]
        made = [pl.Series(n, values[n], self.layout[n], strict=False) for n in names]
        return columns + made, bad


def _package_parser(schema: Schema) -> Callable[[bytes], Any]:
    with contextlib.redirect_stdout(io.StringIO()):  # it prints what it is about to raise
        parse = DecoderFactory().decoder_for("cdr", schema)
    if parse is None:
        raise Undecodable("no ros2msg definition")
    return parse


def definitions(name: str, text: str) -> dict[str, list[Field]]:
    """Every message type a schema defines, under its short name `package/Type`."""
    found = {kind: _fields(lines) for kind, lines in BUILT_IN.items()}
    current = name
    for part in re.split(r"^={3,}\s*$", text, flags=re.MULTILINE):
        named = re.search(r"^MSG:\s+(\S+)\s*$", part, flags=re.MULTILINE)
        if named:
            current = named.group(1)
            part = part.replace(named.group(0), "")
        found[short(current)] = _fields(part)
    return found


def short(name: str) -> str:
    """`package/msg/Type` as `package/Type`."""
    parts = name.split("/")
    return f"{parts[0]}/{parts[-1]}"


def _fields(text: str) -> list[Field]:
    fields = []
    for line in text.splitlines():
        line = line.split("#", 1)[0].strip()
        if not line or CONSTANT.match(line):
            continue
        match = FIELD.match(line)
        if match is None:
            raise Undecodable(f"no field definition: {line!r}")
        array = None if match["array"] is None else 0 if "<=" in match["array"] else match["size"]
        fields.append(
            Field(match["name"], match["type"], None if array is None else int(array or 0))
        )
    return fields


def _plain(found: Any, dtype: Any) -> Any:
    if isinstance(dtype, pl.List):
        if dtype.inner == pl.UInt8:
            return list(bytes(x & 0xFF for x in found))
        return [_plain(item, dtype.inner) for item in found]
    if isinstance(dtype, pl.Struct):
        return {f.name: _plain(getattr(found, f.name), f.dtype) for f in dtype.fields}
    if dtype == pl.UInt8:
        return found & 0xFF  # `char` is unsigned in ROS 2
    return found
