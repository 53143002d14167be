"""ROS messages from their bytes: CDR (ROS 2; OMG DDS-XTYPES 1.3, 7.4) and ROS 1's serialization.

In CDR a number stands at a multiple of its own size, counted from behind the encapsulation header;
in XCDR version 2 at a multiple of 4 bytes at most; in ROS 1 one follows the other. So numbers in a
row are unpacked at once, by a format for each of the eight places where the row may begin. Nothing
beyond the payload's end is read: one that is shorter than its schema says is no message.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any

import numpy as np
import polars as pl
import zstandard
from mcap.records import Schema

from shiplog.logs.decoding.messages import Fields, leaves_of
from shiplog.logs.decoding.ros_definitions import Definition, Field, definition
from shiplog.logs.mcap_file.records import LARGEST_MESSAGE

LETTERS = {
    "bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
DTYPES: dict[str, pl.DataType] = {
    "bool": pl.Boolean(), "byte": pl.UInt8(), "char": pl.UInt8(),  # `char` is unsigned
    "int8": pl.Int8(), "uint8": pl.UInt8(), "int16": pl.Int16(), "uint16": pl.UInt16(),
    "int32": pl.Int32(), "uint32": pl.UInt32(), "int64": pl.Int64(), "uint64": pl.UInt64(),
    "float32": pl.Float64(), "float64": pl.Float64(), "string": pl.String(),
}  # fmt: skip
BYTES = ("byte", "char", "uint8")
# The second byte of a CDR payload, behind a 0: byte order, and the largest alignment. The others
# are parameter lists and delimited types, which no ROS message is.
ENCAPSULATIONS = {0: (">", 8), 1: ("<", 8), 6: (">", 4), 7: ("<", 4)}
PLAIN = (0, 1)  # of these, what other readers know, too
HEADER = 4  # bytes of it
PACKED = zstandard.FRAME_HEADER  # what begins a payload that rosbag2 compressed by itself
DEEPEST = 30  # messages in messages

Reader = Callable[[bytes, int, list[Any]], int]  # payload, where from, what it adds to → where to


def messages(schema: Schema) -> RosMessages:
    """The decoder of one schema; any exception says that its definition is broken."""
    return RosMessages(definition(schema), ros1=schema.encoding == "ros1msg")


class RosMessages:
    """Messages of one definition, taken apart leaf by leaf; texts and lists only where wanted."""

    def __init__(self, described: Definition, ros1: bool) -> None:
        self._described, self._ros1 = described, ros1
        kinds = _Kinds(described, ros1)
        kind = kinds.struct(described.root)
        self.layout = dict(leaves_of(kind))
        self.bulk = frozenset(kinds.bulk)

    def columns(
        self, payloads: Sequence[bytes], leaves: Collection[str] | None
    ) -> tuple[pl.DataFrame, np.ndarray]:
        """As `messages.Decoder` has it."""
        names = list(self.layout if leaves is None else leaves)
        readers: dict[int, tuple[Reader, list[int]]] = {}
        bad = np.zeros(len(payloads), np.bool_)
        rows: list[list[Any]] = []
        for i, payload in enumerate(payloads):
            try:
                if payload[: len(PACKED)] == PACKED:
                    payload = unpacked(payload)
                form = 1 if self._ros1 else _encapsulation(payload)
                if form not in readers:
                    readers[form] = self._reader(form, names)
                read, places = readers[form]
                values: list[Any] = []
                read(payload, 0 if self._ros1 else HEADER, values)
                rows.append([values[place] for place in places])
            except (ValueError, struct.error, zstandard.ZstdError, OverflowError):
                bad[i] = True
        columns = zip(*rows, strict=True) if rows else [()] * len(names)
        named = zip(names, columns, strict=bool(rows))
        return pl.DataFrame([pl.Series(n, v, self.layout[n]) for n, v in named]), bad

    def _reader(self, form: int, names: Sequence[str]) -> tuple[Reader, list[int]]:
        """What reads payloads of one encapsulation, and where the leaves stand in its answer."""
        order, most = ("<", 1) if self._ros1 else ENCAPSULATIONS[form]
        made = _Program(self._described, order, most, self._ros1, frozenset(names))
        read = made.struct(self._described.root, "")
        return read, [made.leaves.index(name) for name in names]


def unpacked(payload: bytes) -> bytes:
    """Of a payload in zstd, within the limits of a message. Raises ValueError beyond them."""
    if zstandard.frame_content_size(payload) > LARGEST_MESSAGE:
        raise ValueError("a message larger than any")
    return zstandard.ZstdDecompressor().decompress(payload, max_output_size=LARGEST_MESSAGE)


def _encapsulation(payload: bytes) -> int:
    """Raises ValueError where there is none that is known."""
    if len(payload) < HEADER or payload[0] != 0 or payload[1] not in ENCAPSULATIONS:
        raise ValueError("no CDR payload")
    return payload[1]


class _Kinds:
    """The types of a message's fields."""

    def __init__(self, described: Definition, ros1: bool) -> None:
        self._types, self._ros1 = described.types, ros1
        self._met = Fields()
        self.bulk: list[str] = []

    def struct(self, kind: str, prefix: str = "", depth: int = 0) -> pl.Struct:
        """Raises ValueError for a message without end, or with a part that cannot be read."""
        types: dict[str, pl.DataType] = {}
        self._met.more(len(self._types[kind]))
        if depth > DEEPEST:
            raise ValueError("it contains itself")
        for field in self._types[kind]:
            if field.kind in self._types:
                single = self.struct(field.kind, f"{prefix}{field.name}.", depth + 1)
                if not single.fields:
                    continue  # an empty message
            elif field.kind == "byte" and self._ros1:
                single = pl.Int8()
            elif field.kind in DTYPES:
                single = DTYPES[field.kind]
            else:
                raise ValueError(f"{prefix}{field.name} is a {field.kind}, which is not read")
            types[field.name] = single if field.count is None else pl.List(single)
            if field.count == 0 and field.kind in BYTES:
                self.bulk.append(prefix + field.name)
        return pl.Struct(types)


class _Program:
    """Readers of types, in one byte order and alignment."""

    def __init__(
        self, described: Definition, order: str, most: int, ros1: bool, wanted: frozenset[str]
    ) -> None:
        self._types, self._order, self._most, self._ros1 = described.types, order, most, ros1
        self._wanted = wanted
        self._length = struct.Struct(f"{order}I")
        self._origin = 0 if ros1 else HEADER
        self.leaves: list[str] = []  # of what is read, in its order

    def struct(self, kind: str, prefix: str) -> Reader:
        return _in_turn(self._joined(self._steps(kind, prefix)))

    def _steps(self, kind: str, prefix: str) -> Iterator[str | Reader]:
        """Letters of single numbers, and readers of all else, in the order of the bytes."""
        fields = self._types[kind]
        if not fields and not self._ros1:  # ROS 2 gives it a byte
            self.leaves.append("")
            yield "B"
        for field in fields:
            path = prefix + field.name
            if field.count is None and field.kind in self._types:
                yield from self._steps(field.kind, f"{path}.")
                continue
            self.leaves.append(path)
            if field.count is not None:
                yield self._list(field, path)
            elif field.kind == "string":
                yield self._text(path in self._wanted)
            else:
                yield self._letter(field.kind)

    def _letter(self, kind: str) -> str:
        return "b" if self._ros1 and kind == "byte" else LETTERS[kind]

    def _joined(self, steps: Iterator[str | Reader]) -> Iterator[Reader]:
        run = ""
        for step in steps:
            if isinstance(step, str):
                run += step
                continue
            if run:
                yield self._run(run)
            run = ""
            yield step
        if run:
            yield self._run(run)

    def _run(self, letters: str) -> Reader:
        """Numbers that follow each other."""
        formats = [self._format(letters, place) for place in range(8)]
        origin = self._origin

        def read(data: bytes, at: int, into: list[Any]) -> int:
            form = formats[(at - origin) % 8]
            into += form.unpack_from(data, at)
            return at + form.size

        return read

    def _format(self, letters: str, place: int) -> struct.Struct:
        text, at = self._order, place
        for letter in letters:
            gap = -at % min(struct.calcsize(f"<{letter}"), self._most)
            text += "x" * gap + letter
            at += gap + struct.calcsize(f"<{letter}")
        return struct.Struct(text)

    def _aligned(self, at: int, size: int) -> int:
        return at + (self._origin - at) % min(size, self._most)

    def _count(self, data: bytes, at: int) -> tuple[int, int]:
        at = self._aligned(at, 4)
        (count,) = self._length.unpack_from(data, at)
        return count, at + 4

    def _text(self, wanted: bool) -> Reader:
        ends = not self._ros1  # CDR counts the zero at the end, and an empty text may have none

        def read(data: bytes, at: int, into: list[Any]) -> int:
            length, at = self._count(data, at)
            if at + length > len(data):
                raise ValueError("a text beyond the payload's end")
            into.append(
                _letters(data[at : at + length - (ends and length > 0)]) if wanted else None
            )
            return at + length

        return read

    def _list(self, field: Field, path: str) -> Reader:
        if field.kind in LETTERS:
            return self._numbers(field, path in self._wanted)
        element = self._element(field.kind)

        def read(data: bytes, at: int, into: list[Any]) -> int:
            count = field.count
            if not count:
                count, at = self._count(data, at)
            if count > len(data):  # of bytes or more each; of nothing, there cannot be so many
                raise ValueError("more elements than bytes")
            here = []
            for _ in range(count):
                value, at = element(data, at)
                here.append(value)
            into.append(here)
            return at

        return read

    def _numbers(self, field: Field, wanted: bool) -> Reader:
        letter = self._letter(field.kind)
        size = struct.calcsize(f"<{letter}")

        def read(data: bytes, at: int, into: list[Any]) -> int:
            count = field.count
            if not count:
                count, at = self._count(data, at)
            at = self._aligned(at, size) if count else at
            end = at + count * size
            if end > len(data):
                raise ValueError("a list beyond the payload's end")
            here = struct.unpack_from(f"{self._order}{count}{letter}", data, at) if wanted else ()
            into.append(here)
            return end

        return read

    def _element(self, kind: str) -> Callable[[bytes, int], tuple[Any, int]]:
        """What reads one text or message of a list."""
        if kind == "string":
            text = self._text(True)

            def one(data: bytes, at: int) -> tuple[Any, int]:
                here: list[Any] = []
                at = text(data, at, here)
                return here[0], at

            return one
        inner = _Program(Definition(kind, self._types), self._order, self._most, self._ros1, _All())
        read = inner.struct(kind, "")
        ways = [leaf.split(".") if leaf else [] for leaf in inner.leaves]

        def message(data: bytes, at: int) -> tuple[Any, int]:
            here: list[Any] = []
            at = read(data, at, here)
            made: dict[str, Any] = {}
            for way, value in zip(ways, here, strict=True):
                inside = made
                for name in way[:-1]:
                    inside = inside.setdefault(name, {})
                if way:
                    inside[way[-1]] = value
            return made, at

        return message


class _All(frozenset):
    """Every name."""

    def __contains__(self, name: object) -> bool:
        return True


def _in_turn(readers: Iterator[Reader]) -> Reader:
    made = list(readers)
    if len(made) == 1:
        return made[0]

    def read(data: bytes, at: int, into: list[Any]) -> int:
        for one in made:
            at = one(data, at, into)
        return at

    return read


def _letters(raw: bytes) -> str:
    """UTF-8, or what an older program wrote."""
    try:
        return raw.decode()
    except UnicodeDecodeError:
        return raw.decode("latin-1")
