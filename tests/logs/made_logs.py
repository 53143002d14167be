"""Logs of every kind of field, the same read by the format's own packages, and by Rerun."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import polars as pl
import pytest
from google.protobuf import descriptor_pb2 as pb
from google.protobuf import descriptor_pool, message_factory, timestamp_pb2
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from mcap_protobuf.decoder import DecoderFactory as ProtobufFactory
from polars.testing import assert_frame_equal

from shiplog.logs.reading import rerun_route
from shiplog.logs.reading.read import read

COUNT = 3000
SECOND = 1_000_000_000
START = 1_700_000_000 * SECOND
KIND = pb.FieldDescriptorProto


def message_kind():
    """A message with every kind of field, and its self-contained descriptors."""
    clock = pb.FileDescriptorProto()
    timestamp_pb2.DESCRIPTOR.CopyToProto(clock)
    file = pb.FileDescriptorProto(
        name="t.proto", package="t", syntax="proto3", dependency=[clock.name]
    )
    colour = file.enum_type.add(name="Colour")
    colour.value.add(name="RED", number=0)
    colour.value.add(name="BLUE", number=3)
    point = file.message_type.add(name="Point")
    for number, name in enumerate("xyz", start=1):
        point.field.add(name=name, number=number, type=KIND.TYPE_DOUBLE, label=1)
    kind = file.message_type.add(name="Kind")

    def add(name, number, type_, label=1, of=None):
        kind.field.add(name=name, number=number, type=type_, label=label, type_name=of)

    add("timestamp", 1, KIND.TYPE_MESSAGE, of=".google.protobuf.Timestamp")
    add("value", 2, KIND.TYPE_DOUBLE)
    add("small", 3, KIND.TYPE_FLOAT)
    add("signed", 4, KIND.TYPE_SINT32)
    add("negative", 5, KIND.TYPE_INT64)
    add("large", 6, KIND.TYPE_UINT64)
    add("on", 7, KIND.TYPE_BOOL)
    add("frame_id", 8, KIND.TYPE_STRING)
    add("raw", 9, KIND.TYPE_BYTES)
    add("point", 10, KIND.TYPE_MESSAGE, of=".t.Point")
    add("points", 11, KIND.TYPE_MESSAGE, 3, ".t.Point")
    add("covariance", 12, KIND.TYPE_DOUBLE, 3)
    add("colour", 13, KIND.TYPE_ENUM, of=".t.Colour")
    add("fixed", 14, KIND.TYPE_SFIXED32)
    add("names", 15, KIND.TYPE_STRING, 3)
    kind.oneof_decl.add(name="_maybe")
    kind.field.add(
        name="maybe", number=16, type=KIND.TYPE_DOUBLE, label=1, proto3_optional=True, oneof_index=0
    )
    pool = descriptor_pool.DescriptorPool()
    pool.Add(clock)
    pool.Add(file)
    made = message_factory.GetMessageClass(pool.FindMessageTypeByName("t.Kind"))
    return pb.FileDescriptorSet(file=[clock, file]).SerializeToString(), made


DESCRIPTORS, Kind = message_kind()


def sample(k: int, newest: int = 77):
    """Message number k; its fields come and go."""
    message = Kind(value=k + 0.5, small=k / 8, signed=-k, negative=-(2**40) - k, large=2**63 + k)
    message.timestamp.seconds, message.timestamp.nanos = divmod(START + k * SECOND // 10, SECOND)
    message.frame_id = f"ship {k} ü"
    message.on = k % 2 == 0
    message.fixed = -7
    message.raw = bytes([k % 256])
    if k % 4 == 0:
        message.point.x = math.sin(k)
        message.covariance.extend([k, 0.0, -1.5][: k % 7])
        message.names.extend(["a", "b"])
    if k % 5 == 0:
        message.points.add(x=1.0, z=k)
        message.colour = 3
        message.maybe = 0.0
    if k % 7 == 0:
        message.colour = newest  # 77 is newer than the schema: what makes Rerun's reader abort
    return message


def protobuf_log(
    path: Path,
    count: int = COUNT,
    topics=("/a", "/b", "/c"),
    times=None,
    make=sample,
    replaced: Mapping[int, bytes] = MappingProxyType({}),
    **options,
):
    options = {"chunk_size": 16_384, "compression": CompressionType.ZSTD} | options
    with path.open("wb") as stream:
        writer = Writer(stream, **options)
        writer.start(library="test")
        schema = writer.register_schema("t.Kind", "protobuf", DESCRIPTORS)
        channels = [writer.register_channel(t, "protobuf", schema, {"unit": "m"}) for t in topics]
        writer.add_metadata("voyage", {"ship": "x"})
        for k in range(count):
            stamp = START + k * SECOND // 10
            when = stamp if times is None else times(k)
            data = replaced.get(k, make(k).SerializeToString())
            writer.add_message(channels[k % len(channels)], when, data, stamp, k)
        writer.finish()
    return path


def json_log(path: Path, messages) -> Path:
    """One topic; each message with its log time and its publish time."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/j", "json", 0)
        for when, published, message in messages:
            writer.add_message(channel, when, json.dumps(message).encode(), published)
        writer.finish()
    return path


def chunks(path: Path) -> list[tuple[int, int, int]]:
    """Of each chunk: where its data begins, how long it is, and how many messages it holds."""
    found = []
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary
        counts = []
        stream.seek(0)
        for record in StreamReader(stream, emit_chunks=True).records:
            if isinstance(record, Chunk):
                counts.append(0)
            elif type(record).__name__ == "MessageIndex":
                counts[-1] += len(record.records)
        for index, count in zip(
            sorted(summary.chunk_indexes, key=lambda c: c.chunk_start_offset), counts, strict=True
        ):
            end = index.chunk_start_offset + index.chunk_length
            found.append((end - index.compressed_size, index.compressed_size, count))
    assert sum(count for _, _, count in found) == COUNT
    return found


def by_the_package(path: Path, topic: str) -> pl.DataFrame:
    """The same table through `mcap` and `protobuf`, message by message."""
    rows = []
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[ProtobufFactory()])
        for _, _, message, decoded in reader.iter_decoded_messages(topics=[topic]):
            point = decoded.point if decoded.HasField("point") else None
            rows.append(
                {
                    "log_time": message.log_time,
                    "publish_time": message.publish_time,
                    "stamp": decoded.timestamp.seconds * SECOND + decoded.timestamp.nanos,
                    "timestamp.seconds": decoded.timestamp.seconds,
                    "timestamp.nanos": decoded.timestamp.nanos,
                    "value": decoded.value,
                    "small": decoded.small,
                    "signed": decoded.signed,
                    "negative": decoded.negative,
                    "large": decoded.large,
                    "on": decoded.on,
                    "frame_id": decoded.frame_id,
                    "point.x": point.x if point else None,
                    "point.y": point.y if point else None,
                    "point.z": point.z if point else None,
                    "points": [{"x": p.x, "y": p.y, "z": p.z} for p in decoded.points],
                    "covariance": list(decoded.covariance),
                    "colour": decoded.colour,
                    "fixed": decoded.fixed,
                    "names": list(decoded.names),
                    "maybe": decoded.maybe if decoded.HasField("maybe") else None,
                }
            )
    types = {"large": pl.UInt64, "timestamp.nanos": pl.Int32, "signed": pl.Int32}
    types |= {"colour": pl.Int32, "fixed": pl.Int32}
    return pl.DataFrame(rows, schema_overrides=types, infer_schema_length=None)


def kinds(found) -> list[str]:
    return sorted({finding.kind for finding in found.health.findings})


def known_colours(path: Path, **options) -> Path:
    """A log that Rerun can read: no enum number beyond the schema."""
    return protobuf_log(path, make=lambda k: sample(k, newest=3), **options)


def by_hand(path: Path, wanted=None, others=False):
    """The same through the packages, whatever Rerun could do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rerun_route, "worth_it", lambda tables: False)
        return read(path, wanted, others)


def assert_same(path: Path, wanted=None, others=False):
    one, other = read(path, wanted, others), by_hand(path, wanted, others)
    assert (one.contents, one.health) == (other.contents, other.health)
    assert one.frames.keys() == other.frames.keys()
    for topic, frame in one.frames.items():
        assert_frame_equal(frame, other.frames[topic])
    return one
