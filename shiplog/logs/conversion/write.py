"""Columns to an MCAP log of our own making: protobuf, zstd, chunked, every index and CRC.

The messages of a topic differ only in their numbers, so their wire bytes are laid out as one
numpy matrix instead of one message object each. Bytes are canonical proto3: fields in the order of
their numbers, zeros left out, NaN kept.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    EnumDescriptorProto,
    EnumValueDescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
)
from google.protobuf.timestamp_pb2 import DESCRIPTOR as TIMESTAMP_FILE
from mcap.writer import CompressionType, IndexType, Writer

from shiplog.exceptions import ShiplogError, listed, nearest
from shiplog.logs.health import stored_findings
from shiplog.logs.health.health_report import Finding
from shiplog.machine import files
from shiplog.nomenclature.units import SECOND_NS

LOG_CONTRACT = "1"
CHUNK_BYTES = 1024 * 1024  # bytes before compression
BLOCK_ROWS = 8192  # messages that are laid out at once: a long log takes no more memory

LOCATION_FIX = "foxglove.LocationFix"
COVARIANCE = "position_covariance"
SCHEMAS: Mapping[str, tuple[str, ...]] = {
    LOCATION_FIX: ("latitude", "longitude", "altitude"),
    "shiplog.GnssVelocity": ("sog_mps", "cog_deg"),
    "shiplog.Gyro": ("heading_deg", "yaw_rate_degps"),
    "shiplog.Wind": ("speed_mps", "direction_deg"),
    "shiplog.Rudder": ("angle_deg",),
    "shiplog.Propeller": ("speed_rps",),
    "shiplog.Azimuth": ("angle_deg",),
    "shiplog.Thruster": ("command",),
    "shiplog.ShipState": (
        "x0_m", "y0_m", "heading_deg", "surge_mps", "sway_mps", "yaw_rate_degps",
    ),
}  # fmt: skip
THE_MESSAGES_OWN = ("timestamp", "frame_id")  # fields of every message, in addition

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_DOUBLE, _BYTES, _ENUM = 1, 2, 0  # wire types: 64 bit, length-delimited, varint


@dataclass(frozen=True, slots=True)
class Series:
    """One topic of a log, column by column, N messages.

    schema        full protobuf name; one not in `SCHEMAS` gets a message of the columns' names
    time          [N] int64 ns since 1970, when it was measured: the message's `timestamp`
    columns       field name -> [N] float64, NaN allowed. A field of the schema that is not given
                  is written as NaN, because protobuf would show it as 0. `foxglove.LocationFix`
                  also takes `position_covariance` [N, 9], east-north-up in m², row by row
    log_time      [N] ns, the recorder's clock, `time` unless given; it orders the file
    publish_time  [N] ns, the sensor's clock, `time` unless given
    metadata      of the channel: unit, sign, sensor, nominal_hz
    """

    topic: str
    schema: str
    time: np.ndarray
    columns: Mapping[str, np.ndarray]
    log_time: np.ndarray | None = None
    publish_time: np.ndarray | None = None
    frame_id: str = ""
    metadata: Mapping[str, str] = field(default_factory=dict)


def write_log(
    path: str | os.PathLike[str],
    series: Sequence[Series],
    *,
    ship: str,
    datum: tuple[float, float] | None = None,
    notes: Mapping[str, str] | None = None,
    findings: Sequence[Finding] = (),
) -> None:
    """Write one voyage. `path` appears when the log is whole, and not at all if anything fails.

    datum   latitude and longitude [deg] of the local plane's origin
    notes   further entries of the metadata record `voyage`
    findings  what was found on the way here, for whoever reads the log
    """
    path = Path(path)
    _refuse_twins(series)
    voyage = {"ship": ship, "contract": LOG_CONTRACT}
    if datum is not None:
        voyage["datum"] = f"{float(datum[0])!r},{float(datum[1])!r}"
    for key, value in (notes or {}).items():
        voyage.setdefault(key, value)  # ship, datum and contract are not a note's to change
    with files.whole(path) as partial, open(partial, "wb") as stream:
        _write(Writer(
            stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD,
            index_types=IndexType.ALL, enable_crcs=True,
        ), series, voyage, findings)  # fmt: skip
        stream.flush()
        os.fsync(stream.fileno())


def refuse_existing(path: Path) -> None:
    """Raises ShiplogError for a log that is there already, which may be the only one of its
    kind."""
    if path.exists():
        raise ShiplogError(
            f"{path} exists already.", hint="choose another --out, or remove that log."
        )


def _refuse_twins(series: Sequence[Series]) -> None:
    """One topic, one channel: readers disagree on what two channels of one topic mean."""
    topics = [one.topic for one in series]
    twice = {topic for topic in topics if topics.count(topic) > 1}
    if twice:
        raise ShiplogError(
            f"Topics given more than once: {listed(twice)}.",
            hint="join their columns into one series, or give each its own topic.",
        )


def _write(
    writer: Writer,
    series: Sequence[Series],
    voyage: Mapping[str, str],
    findings: Sequence[Finding],
) -> None:
    writer.start(profile="")
    writer.add_metadata("voyage", dict(voyage))
    if findings:
        writer.add_metadata(stored_findings.RECORD, stored_findings.as_record(findings))
    schemas: dict[tuple, int] = {}
    channels: list[int] = []
    clocks: list[tuple[np.ndarray, np.ndarray]] = []
    messages: list[Iterator[bytes]] = []
    for one in series:
        time = _clock(one, "time", one.time)
        log_time = time if one.log_time is None else _clock(one, "log_time", one.log_time)
        publish = (
            time if one.publish_time is None else _clock(one, "publish_time", one.publish_time)
        )
        if not len(time) == len(log_time) == len(publish):
            raise ShiplogError(f"{one.topic}: the three clocks differ in length.")
        fields = _fields(one)
        key = (one.schema, fields)
        if key not in schemas:
            if any(one.schema == name for name, _ in schemas):
                raise ShiplogError(f"Two layouts of {one.schema}: its topics differ in columns.")
            schemas[key] = writer.register_schema(
                one.schema, "protobuf", descriptor(one.schema, fields).SerializeToString()
            )
        channels.append(
            writer.register_channel(one.topic, "protobuf", schemas[key], dict(one.metadata))
        )
        order = np.argsort(log_time, kind="stable")
        clocks.append((log_time[order], publish[order]))
        messages.append(encode(one, order))

    channel = np.repeat(np.arange(len(series)), [len(log) for log, _ in clocks])
    log_time = np.concatenate([log for log, _ in clocks] or [np.empty(0, np.int64)])
    publish = np.concatenate([publish for _, publish in clocks] or [np.empty(0, np.int64)])
    merged = np.argsort(log_time, kind="stable")
    for first in range(0, len(merged), BLOCK_ROWS):
        block = merged[first : first + BLOCK_ROWS]
        for which, log, published in zip(
            channel[block].tolist(), log_time[block].tolist(), publish[block].tolist(), strict=True
        ):
            writer.add_message(channels[which], log, next(messages[which]), published)
    writer.finish()


def _clock(one: Series, name: str, values: np.ndarray) -> np.ndarray:
    values = np.asarray(values)
    if values.ndim != 1 or not (np.issubdtype(values.dtype, np.integer) or len(values) == 0):
        raise ShiplogError(
            f"{one.topic}: {name} is {values.dtype}{list(values.shape)}, not whole nanoseconds.",
            hint="float seconds cannot hold a nanosecond of this century.",
        )
    if len(values) and int(values.min()) < 0:
        raise ShiplogError(
            f"{one.topic}: {name} has times before 1970.",
            hint="a log counts from 1970 on; add the same number to all times, of a table that "
            "counts from a negative number, too.",
        )
    return values.astype(np.int64, copy=False)


def _fields(one: Series) -> tuple[str, ...]:
    """The double fields of this series' message, in the order of their numbers."""
    rows = len(one.time)
    for name, values in one.columns.items():
        expected = (rows, 9) if (one.schema, name) == (LOCATION_FIX, COVARIANCE) else (rows,)
        if np.shape(values) != expected:
            raise ShiplogError(
                f"{one.topic}: column {name!r} has shape {np.shape(values)}, expected {expected}."
            )
    known = SCHEMAS.get(one.schema)
    if known is None:
        if wrong := [n for n in (*one.schema.split("."), *one.columns) if not _NAME.fullmatch(n)]:
            raise ShiplogError(
                f"{one.topic}: {listed(wrong)} cannot be the name of a protobuf message or field.",
                hint="use letters, digits and underscores, and no digit first.",
            )
        if reserved := set(THE_MESSAGES_OWN) & set(one.columns):
            raise ShiplogError(f"{one.topic}: the field {listed(reserved)} is the message's own.")
        return tuple(one.columns)
    allowed = (*known, COVARIANCE) if one.schema == LOCATION_FIX else known
    for name in one.columns:
        if name not in allowed:
            raise ShiplogError(
                f"{one.topic}: {one.schema} has no field {name!r}{nearest(name, allowed)}",
                hint=f"its fields: {', '.join(allowed)}.",
            )
    return known


def descriptor(schema: str, fields: Sequence[str]) -> FileDescriptorSet:
    """The message's file and those it depends on: a reader needs nothing else."""
    package, _, name = schema.rpartition(".")
    message = DescriptorProto(name=name)
    fix = schema == LOCATION_FIX

    def add(field_name: str, number: int, kind: int, type_name: str = "", many: bool = False):
        label = FieldDescriptorProto.LABEL_REPEATED if many else FieldDescriptorProto.LABEL_OPTIONAL
        message.field.add(
            name=field_name, number=number, type=kind, label=label, type_name=type_name or None,
            json_name=re.sub(r"_(.)", lambda m: m[1].upper(), field_name),
        )  # fmt: skip

    double, timestamp = FieldDescriptorProto.TYPE_DOUBLE, ".google.protobuf.Timestamp"
    add("timestamp", 6 if fix else 1, FieldDescriptorProto.TYPE_MESSAGE, timestamp)
    add("frame_id", 7 if fix else 2, FieldDescriptorProto.TYPE_STRING)
    for number, field_name in enumerate(fields, 1 if fix else 3):
        add(field_name, number, double)
    if fix:  # foxglove/foxglove-sdk, schemas/proto/foxglove/LocationFix.proto; later versions only
        # add optional fields from 8 on (color, metadata, heading, speed), which we do not write.
        kind = "PositionCovarianceType"
        names = ("UNKNOWN", "APPROXIMATED", "DIAGONAL_KNOWN", "KNOWN")
        values = [EnumValueDescriptorProto(name=n, number=i) for i, n in enumerate(names)]
        message.enum_type.append(EnumDescriptorProto(name=kind, value=values))
        add(COVARIANCE, 4, double, many=True)
        add("position_covariance_type", 5, FieldDescriptorProto.TYPE_ENUM, f".{schema}.{kind}")
    stamp = FileDescriptorProto()
    TIMESTAMP_FILE.CopyToProto(stamp)
    own = FileDescriptorProto(
        name=f"{schema.replace('.', '/')}.proto", package=package, syntax="proto3",
        dependency=[stamp.name], message_type=[message],
    )  # fmt: skip
    return FileDescriptorSet(file=[stamp, own])


def encode(one: Series, order: np.ndarray) -> Iterator[bytes]:
    """Wire bytes of each message, in `order` [N]."""
    for first in range(0, len(order), BLOCK_ROWS):
        yield from _encoded(one, order[first : first + BLOCK_ROWS])


def _encoded(one: Series, order: np.ndarray) -> Iterator[bytes]:
    """The same of some messages.

    Every message is a row of a byte matrix wide enough for the longest; `keep` masks the bytes
    that proto3 leaves out (zeros, the unused end of a varint), and one gather joins what stays.
    """
    rows = len(order)
    time = np.asarray(one.time, np.int64)[order]
    frame = _Field(rows).constant(one.frame_id.encode())
    numbers = [_column(one, name, order) for name in _fields(one)]
    parts: list[_Field]
    if one.schema == LOCATION_FIX:
        parts = [_double(i, values) for i, values in enumerate(numbers, 1)]
        if COVARIANCE in one.columns:
            parts += _covariance(np.asarray(one.columns[COVARIANCE], float)[order])
        parts += [_timestamp(6, time), frame.tagged(7)]
    else:
        parts = [_timestamp(1, time), frame.tagged(2)]
        parts += [_double(i, values) for i, values in enumerate(numbers, 3)]
    matrix = np.concatenate([part.bytes for part in parts], axis=1)
    keep = np.concatenate([part.keep for part in parts], axis=1)
    blob = matrix[keep].tobytes()
    start = 0
    for end in np.cumsum(keep.sum(axis=1)).tolist():
        yield blob[start:end]
        start = end


def _column(one: Series, name: str, order: np.ndarray) -> np.ndarray:
    values = one.columns.get(name)
    if values is None:
        return np.full(len(order), np.nan)
    return np.asarray(values, np.float64)[order]


class _Field:
    """One field of N messages: `bytes` [N, W] and which of them are on the wire, `keep` [N, W]."""

    __slots__ = ("bytes", "keep", "rows")

    def __init__(self, rows: int) -> None:
        self.rows = rows
        self.bytes = np.empty((rows, 0), np.uint8)
        self.keep = np.empty((rows, 0), bool)

    def append(self, block: np.ndarray, keep: np.ndarray) -> _Field:
        self.bytes = np.concatenate([self.bytes, block], axis=1)
        self.keep = np.concatenate([self.keep, np.broadcast_to(keep, block.shape)], axis=1)
        return self

    def constant(self, value: bytes) -> _Field:
        block = np.broadcast_to(np.frombuffer(value, np.uint8), (self.rows, len(value)))
        return self.append(block, np.ones((1, 1), bool))

    def varint(self, values: np.ndarray) -> _Field:
        """Base 128, lowest group first: int64 [N] not negative, at most nine bytes."""
        shifted = values[:, None] >> (7 * np.arange(_varint_width(int(values.max()))))
        longer = (shifted >> 7) != 0
        block = ((shifted & 0x7F) | (longer << 7)).astype(np.uint8)
        first = np.ones((self.rows, 1), bool)  # a lone zero still takes its byte
        return self.append(block, np.concatenate([first, longer[:, :-1]], axis=1))

    def only(self, present: np.ndarray) -> _Field:
        self.keep = self.keep & present[:, None]
        return self

    def tagged(self, number: int) -> _Field:
        """As the length-delimited field `number`; an empty one is left out, as proto3 does."""
        length = self.keep.sum(axis=1)
        head = _Field(self.rows).constant(_tag(number, _BYTES)).varint(length.astype(np.int64))
        return head.append(self.bytes, self.keep).only(length > 0)


def _varint_width(largest: int) -> int:
    return max(1, -(-largest.bit_length() // 7))


def _tag(number: int, wire_type: int) -> bytes:
    key = number << 3 | wire_type
    return bytes([key]) if key < 0x80 else bytes([key & 0x7F | 0x80, key >> 7])


def _double(number: int, values: np.ndarray) -> _Field:
    bits = np.ascontiguousarray(values, "<f8").view(
        "<u8"
    )  # bits: minus zero is written, zero is not
    block = bits.view(np.uint8).reshape(len(values), 8)
    field_ = _Field(len(values)).constant(_tag(number, _DOUBLE))
    return field_.append(block, np.ones((1, 1), bool)).only(bits != 0)


def _timestamp(number: int, time: np.ndarray) -> _Field:
    """google.protobuf.Timestamp; present even when empty, at the epoch itself."""
    seconds, nanos = np.divmod(time, SECOND_NS)
    inner = _Field(len(time)).constant(_tag(1, _ENUM)).varint(seconds).only(seconds > 0)
    second = _Field(len(time)).constant(_tag(2, _ENUM)).varint(nanos).only(nanos > 0)
    inner.append(second.bytes, second.keep)
    length = inner.keep.sum(axis=1).astype(np.int64)
    head = _Field(len(time)).constant(_tag(number, _BYTES)).varint(length)
    return head.append(inner.bytes, inner.keep)


def _covariance(values: np.ndarray) -> list[_Field]:
    """Fields 4 and 5 of LocationFix: packed doubles [N, 9], and whether they are diagonal."""
    rows = len(values)
    block = np.ascontiguousarray(values, "<f8").view(np.uint8).reshape(rows, 72)
    packed = _Field(rows).append(block, np.ones((1, 1), bool)).tagged(4)
    diagonal = (values * (1.0 - np.eye(3).reshape(9)) == 0.0).all(axis=1)
    kind = _Field(rows).constant(_tag(5, _ENUM)).varint(np.where(diagonal, 2, 3).astype(np.int64))
    return [packed, kind]
