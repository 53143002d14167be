"""Reading logs: whole, damaged, mixed and hostile ones, with the counts worked out beforehand."""

from __future__ import annotations

import contextlib
import json
import math
import multiprocessing
import os
import random
import struct
import subprocess
import sys
import time
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
from mcap.writer import CompressionType, IndexType, Writer
from mcap_protobuf.decoder import DecoderFactory as ProtobufFactory
from mcap_ros2.decoder import DecoderFactory as Ros2Factory
from mcap_ros2.writer import Writer as Ros2Writer
from polars.testing import assert_frame_equal

from shiplog.exceptions import LogUnreadable
from shiplog.logs import rerun_route
from shiplog.logs.check import check
from shiplog.logs.read import contents, fields, read

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


@pytest.fixture(scope="module")
def good(tmp_path_factory) -> Path:
    return protobuf_log(tmp_path_factory.mktemp("logs") / "good.mcap")


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


def test_a_good_log_is_read_whole_and_as_the_protobuf_package_reads_it(good):
    found = read(good)
    assert (found.health.route, found.health.messages_read) == ("fast", COUNT)
    assert (found.health.messages_lost, found.health.chunks_lost) == (0, 0)
    assert found.health.findings == ()
    assert found.contents.metadata == {"voyage": {"ship": "x"}}
    assert found.contents.topics["/a"].metadata == {"unit": "m"}
    for topic in ("/a", "/b", "/c"):
        assert_frame_equal(found.frames[topic], by_the_package(good, topic))


def test_contents_come_without_reading_the_messages(good):
    found = contents(good)
    assert {t: topic.messages for t, topic in found.topics.items()} == {
        "/a": 1000,
        "/b": 1000,
        "/c": 1000,
    }
    assert (found.library, found.size) == ("test", good.stat().st_size)
    assert found.topics["/a"].schema == "t.Kind"


def test_wanted_fields_are_the_only_ones_kept(good):
    paths = ("value", "covariance[1]", "points[0].z", "point", "nothing")
    found = read(good, {"/a": paths, "/absent": ("x",)})
    whole = by_the_package(good, "/a")
    frame = found.frames["/a"]
    assert list(found.frames) == ["/a"]
    times = ["log_time", "publish_time", "stamp"]
    assert frame.columns == [*times, "value", "covariance[1]", "points[0].z"]
    assert_frame_equal(frame.select("value"), whole.select("value"))
    assert frame["covariance[1]"].to_list() == [
        row[1] if len(row) > 1 else None for row in whole["covariance"].to_list()
    ]
    assert frame["points[0].z"].to_list() == [
        row[0]["z"] if row else None for row in whole["points"].to_list()
    ]
    assert found.health.messages_read == COUNT
    raw = read(good, {"/a": ("raw",)}).frames["/a"]["raw"]
    assert raw.to_list() == [bytes([k % 256]) for k in range(0, COUNT, 3)]


def test_fields_are_listed_with_their_types(good):
    found = fields(good, ["/a"])
    assert list(found) == ["/a"]
    assert found["/a"]["covariance"] == pl.List(pl.Float64)
    assert found["/a"]["raw"] == pl.Binary
    assert found["/a"]["point.x"] == pl.Float64


def test_damaged_and_whole_logs_agree_on_what_both_have(good, tmp_path):
    where, size, lost = chunks(good)[1]
    data = bytearray(good.read_bytes())
    data[where + size // 2] ^= 0xFF
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    found, whole = read(path), read(good)
    assert found.health.route == "salvage"
    for topic, frame in found.frames.items():
        kept = whole.frames[topic].filter(pl.col("log_time").is_in(frame["log_time"].implode()))
        assert_frame_equal(frame, kept)
    assert sum(f.height for f in found.frames.values()) == COUNT - lost


@pytest.mark.parametrize("which", [0, 2, -1], ids=["first", "middle", "last"])
def test_a_flipped_byte_costs_its_chunk_and_no_more(good, tmp_path, which):
    where, size, lost = chunks(good)[which]
    data = bytearray(good.read_bytes())
    data[where + size // 2] ^= 0xFF
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    health = read(path).health
    assert (health.messages_read, health.messages_lost) == (COUNT - lost, lost)
    assert (health.chunks, health.chunks_lost) == (len(chunks(good)), 1)
    (finding,) = [f for f in health.findings if f.kind == "crc"]
    assert finding.start_s is not None
    assert finding.end_s is not None and finding.end_s > finding.start_s


def test_a_payload_that_does_not_match_its_checksum_is_refused(tmp_path):
    path = protobuf_log(tmp_path / "plain.mcap", compression=CompressionType.NONE)
    where, size, lost = chunks(path)[1]
    data = bytearray(path.read_bytes())
    data[where + size - 20] ^= 0x01
    path.write_bytes(data)
    health = read(path).health
    assert (health.messages_read, health.messages_lost) == (COUNT - lost, lost)
    assert kinds(read(path)) == ["crc"]


def test_everything_before_a_cut_is_kept(good, tmp_path):
    data = good.read_bytes()
    pieces = chunks(good)
    where, size, _ = pieces[3]
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: where + size // 2])
    found = read(path)
    assert found.health.messages_read == sum(count for _, _, count in pieces[:3])
    assert (found.health.messages_lost, found.health.route) == (None, "salvage")
    (finding,) = found.health.findings
    assert finding.kind == "truncated"
    assert contents(path).topics["/a"].messages == found.frames["/a"].height


def test_a_log_cut_in_its_summary_loses_nothing(good, tmp_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes(good.read_bytes()[:-200])
    found = read(path)
    assert found.health.messages_read == COUNT
    assert kinds(found) == ["truncated"]


@pytest.mark.parametrize(
    "options",
    [
        {"use_chunking": False},
        {"index_types": IndexType.NONE, "use_summary_offsets": False, "use_statistics": False,
         "repeat_channels": False, "repeat_schemas": False},
        {"compression": CompressionType.LZ4},
        {"compression": CompressionType.NONE},
        {"enable_crcs": False},
        {"use_statistics": False},
    ],
    ids=["unchunked", "no summary", "lz4", "uncompressed", "no checksums", "no statistics"],
)  # fmt: skip
def test_other_ways_of_writing_give_the_same_tables(good, tmp_path, options):
    path = protobuf_log(tmp_path / "other.mcap", **options)
    found, whole = read(path), read(good)
    assert (found.health.messages_read, found.health.messages_lost) == (COUNT, 0)
    assert found.health.findings == ()
    for topic, frame in whole.frames.items():
        assert_frame_equal(found.frames[topic], frame)


def test_jittered_log_times_are_sorted_and_reported(tmp_path):
    path = protobuf_log(
        tmp_path / "jitter.mcap",
        times=lambda k: START + k * SECOND // 10 + (SECOND if k % 10 == 0 else 0),
    )
    found = read(path)
    assert found.health.messages_read == COUNT
    assert all(frame["log_time"].is_sorted() for frame in found.frames.values())
    disorder = [f for f in found.health.findings if f.kind == "out_of_order"]
    assert disorder[0].channel == "log"
    assert disorder[0].value == pytest.approx(0.7)
    assert {f.channel for f in disorder[1:]} == {"/a", "/b", "/c"}


def test_one_topic_on_two_channels_is_one_table(tmp_path):
    path = tmp_path / "two.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        first = writer.register_schema("t.Kind", "protobuf", DESCRIPTORS)
        second = writer.register_schema("Other", "jsonschema", b"{}")
        one = writer.register_channel("/x", "protobuf", first)
        other = writer.register_channel("/x", "json", second)
        for k in range(20):
            writer.add_message(one, START + 2 * k, Kind(value=k).SerializeToString(), START)
            writer.add_message(other, START + 2 * k + 1, b'{"other": 1.5}', START)
        writer.finish()
    frame = read(path).frames["/x"]
    assert frame.height == 40
    assert frame["value"].to_list()[:4] == [0.0, None, 1.0, None]
    assert frame["other"].to_list()[:4] == [None, 1.5, None, 1.5]
    assert contents(path).topics["/x"].schema == "t.Kind, Other"


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "empty"),
        (b"\x89MCA", "cut off"),
        (b"\x89MCAP0\r\n", "recovered"),
        (b"PAR1" + bytes(40), "shiplog convert"),
        (b"time,x\n1,2\n" * 9, "74 69 6D 65"),
        (b"\x89MCAP0\n" + bytes(40), "line-ending"),
    ],
    ids=["zero bytes", "cut magic", "only magic", "parquet", "csv", "stripped CR"],
)
def test_what_is_no_log_is_refused_with_a_reason(tmp_path, content, says):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(LogUnreadable, match=says):
        read(path)


def test_an_empty_log_and_a_missing_one_are_refused(tmp_path):
    path = protobuf_log(tmp_path / "none.mcap", count=0)
    with pytest.raises(LogUnreadable, match="no messages"):
        read(path)
    assert contents(path).topics["/a"].messages == 0
    for wrong in (tmp_path, tmp_path / "absent.mcap"):
        with pytest.raises(LogUnreadable):
            read(wrong)


def test_stated_sizes_are_not_believed(good, tmp_path):
    """A chunk that claims 512 MB and a record that claims 2 EB are damage, not allocations."""
    where, _, lost = chunks(good)[1]
    data = bytearray(good.read_bytes())
    head = where - 8 - 4 - 4 - 4 - 8  # the uncompressed size, before CRC, "zstd" and the length
    assert struct.unpack_from("<Q", data, head)[0] < 40_000
    struct.pack_into("<Q", data, head, 512 << 20)
    path = tmp_path / "bomb.mcap"
    path.write_bytes(data)
    assert read(path).health.messages_lost == lost
    struct.pack_into("<Q", data, head - 24, 2 << 60)  # the record's own length
    path.write_bytes(data)
    assert read(path).health.messages_lost == lost  # found again through the chunk index


def small(path: Path, **options) -> Path:
    return protobuf_log(path, count=300, topics=("/a", "/b"), chunk_size=4096, **options)


@pytest.mark.parametrize("chunked", [True, False], ids=["chunks", "no chunks"])
def test_random_damage_never_raises_anything_else_and_never_adds_messages(tmp_path, chunked):
    whole = small(tmp_path / "whole.mcap", use_chunking=chunked).read_bytes()
    chance = random.Random(1)
    path = tmp_path / "damaged.mcap"
    for _ in range(30):
        flipped = bytearray(whole)
        flipped[chance.randrange(len(whole))] ^= 1 << chance.randrange(8)
        for data in (flipped, whole[: chance.randrange(len(whole))]):
            path.write_bytes(data)
            try:
                found = read(path)
                check(path)
            except LogUnreadable:
                continue
            finally:
                with contextlib.suppress(LogUnreadable):
                    contents(path)
                    fields(path)
            assert found.health.messages_read <= 300
            assert sum(f.height for f in found.frames.values()) <= 300


def test_messages_that_do_not_fit_their_schema_are_left_out_and_counted(tmp_path):
    path = tmp_path / "odd.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("t.Kind", "protobuf", DESCRIPTORS)
        a = writer.register_channel("/a", "protobuf", schema)
        j = writer.register_channel("/j", "json", 0)
        for k in range(10):
            writer.add_message(a, START + k, Kind(value=k).SerializeToString() if k else b"\xff", 0)
            text = b'{"x": 1,\n "y": NaN}' if k != 4 else b"{broken"
            writer.add_message(j, START + k, text if k != 5 else b'{"x": "text"}', 0)
        writer.finish()
    found = read(path)
    assert found.frames["/a"]["value"].to_list() == [float(k) for k in range(1, 10)]
    assert found.frames["/j"].height == 9
    assert found.frames["/j"]["x"].to_list() == ["1"] * 4 + ["text"] + ["1"] * 4
    assert {(f.channel, f.value) for f in found.health.findings if f.kind == "crc"} == {
        ("/a", 1.0),
        ("/j", 1.0),
    }


def test_undecodable_topics_are_named_and_the_rest_is_kept(tmp_path):
    path = tmp_path / "mixed.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        good_one = writer.register_schema("t.Kind", "protobuf", DESCRIPTORS)
        bad = writer.register_schema("t.Kind", "protobuf", b"\xff\xff")
        ros = writer.register_schema("a/srv/B_Event", "ros2msg", b"---\nint64 a\n")
        channels = [
            writer.register_channel("/good", "protobuf", good_one),
            writer.register_channel("/bad", "protobuf", bad),
            writer.register_channel("/service", "cdr", ros),
            writer.register_channel("/odd", "wrong_format", good_one),
            writer.register_channel("/bare", "protobuf", 0),
        ]
        for channel in channels:
            writer.add_message(channel, START, Kind(value=1.0).SerializeToString(), START)
        writer.finish()
    found = read(path)
    assert list(found.frames) == ["/good"]
    assert set(found.health.undecodable) == {"/bad", "/service", "/odd", "/bare"}
    assert "wrong_format" in found.health.undecodable["/odd"]
    assert found.health.messages_read == 5
    with pytest.raises(LogUnreadable, match="wrong_format"):
        read(path, {"/odd": ("value",)})


def json_log(path: Path, messages) -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/j", "json", 0)
        for when, published, message in messages:
            writer.add_message(channel, when, json.dumps(message).encode(), published)
        writer.finish()
    return path


@pytest.mark.parametrize(
    "stamp",
    [
        {"timestamp": {"sec": 1_700_000_000, "nsec": 5}},
        {"stamp": {"sec": 1_700_000_000, "nanosec": 5}},
        {"header": {"stamp": {"seconds": 1_700_000_000, "nanos": 5}}},
        {"timestamp": "2023-11-14T22:13:20.000000005Z"},
        {"timestamp": "2023-11-14T23:13:20.000000005+01:00"},
        {"timestamp": "2023-11-14T22:13:20.000000005"},
        {"timestamp": 1_700_000_000_000_000_005},
    ],
)
def test_every_way_to_say_when_gives_one_stamp(tmp_path, stamp):
    path = json_log(tmp_path / "t.mcap", [(START, START, stamp | {"x": 1})] * 2)
    assert read(path).frames["/j"]["stamp"].to_list() == [START + 5] * 2


def test_counters_are_no_clocks(tmp_path):
    path = json_log(tmp_path / "t.mcap", [(START, START, {"timestamp": 12.5})])
    assert read(path).frames["/j"]["stamp"].to_list() == [None]


def test_repeats_and_clocks_are_found(tmp_path):
    """The recorder runs 0.94 s ahead; message 7 was sent twice, and 20 to 30 is missing."""
    order = [k for k in range(200) if k not in range(20, 30)]
    order.insert(8, 7)
    messages = []
    for copy, k in enumerate(order):
        stamp = START + k * SECOND // 5
        text = {"timestamp": {"sec": stamp // SECOND, "nsec": stamp % SECOND}, "x": k}
        messages.append((stamp + 940_000_000 + copy, stamp, text))
    report = check(json_log(tmp_path / "t.mcap", messages))
    (again,) = [f for f in report.findings if f.kind == "duplicate"]
    assert (again.value, again.start_s) == (1.0, pytest.approx(1.4, abs=1e-6))
    (clock,) = [f for f in report.findings if f.kind == "clock_offset"]
    assert clock.value == pytest.approx(0.94, abs=1e-5)
    assert "recorder's clock is 0.94 s ahead of the publishers'" in clock.sentence
    (gap,) = [f for f in report.findings if f.kind == "gap"]
    assert (gap.start_s, gap.end_s) == (pytest.approx(3.8), pytest.approx(6.0))
    assert report.messages_read == 191


def known_colours(path: Path, **options) -> Path:
    """A log that Rerun can read: no enum number beyond the schema."""
    return protobuf_log(path, make=lambda k: sample(k, newest=3), **options)


@pytest.fixture
def by_rerun(monkeypatch):
    """Every log that may is given to Rerun, however small; says which topics it then gave."""
    given: list[str] = []
    whole = rerun_route.read_most

    def watched(*arguments):
        done = whole(*arguments)
        given.extend(done)
        return done

    monkeypatch.setattr(rerun_route, "LEAST_MESSAGES", 0)
    monkeypatch.setattr(rerun_route, "LEAST_WARM", 0)
    monkeypatch.setattr(rerun_route, "read_most", watched)
    return given


def by_hand(path: Path, wanted=None):
    """The same through the packages, whatever Rerun could do."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rerun_route, "worth_it", lambda tables: False)
        return read(path, wanted)


def assert_same(path: Path, wanted=None):
    one, other = read(path, wanted), by_hand(path, wanted)
    assert (one.contents, one.health) == (other.contents, other.health)
    assert one.frames.keys() == other.frames.keys()
    for topic, frame in one.frames.items():
        assert_frame_equal(frame, other.frames[topic])
    return one


@pytest.mark.parametrize(
    "wanted",
    [None, {"/b": ("value", "small", "points[0].z", "covariance[1]", "names", "point.x", "raw")}],
    ids=["everything", "some"],
)
@pytest.mark.parametrize("jitter", [0, 10], ids=["in order", "out of order"])
def test_rerun_and_the_packages_give_one_protobuf_table(tmp_path, by_rerun, wanted, jitter):
    path = known_colours(
        tmp_path / "log.mcap",
        times=lambda k: START + k // 3 * SECOND + (9 * SECOND if jitter and k % jitter == 0 else 0),
    )
    found = assert_same(path, wanted)
    assert set(by_rerun) == set(found.frames)
    assert found.health.route == "fast"


def test_topics_with_odd_or_shared_names_do_not_get_mixed_up(tmp_path, by_rerun):
    topics = ("/a b.c-d", "x", "/x", "/é(ü)/z")
    path = known_colours(tmp_path / "log.mcap", count=80, topics=topics)
    assert assert_same(path).frames.keys() == set(topics)
    assert set(by_rerun) == {"/a b.c-d", "/é(ü)/z"}  # Rerun calls both x and /x the same


@pytest.mark.parametrize(
    "payload", [b"\xff", b"\x42\x02\xff\xfe", b"\x42\x20a"], ids=["tag", "UTF-8", "cut"]
)
def test_one_bad_payload_costs_one_message_on_either_route(tmp_path, by_rerun, payload):
    path = known_colours(tmp_path / "log.mcap", count=90, replaced={31: payload})
    found = assert_same(path)
    assert set(by_rerun) == {"/a", "/c"}
    assert {t: frame.height for t, frame in found.frames.items()} == {"/a": 30, "/b": 29, "/c": 30}
    (finding,) = found.health.findings
    assert (finding.kind, finding.channel, finding.value) == ("crc", "/b", 1.0)


def test_a_payload_that_ends_reruns_process_is_read_all_the_same(good, by_rerun):
    """An enum number newer than the schema; the next log finds Rerun running again."""
    found = assert_same(good)
    assert by_rerun == []
    assert sum(frame.height for frame in found.frames.values()) == COUNT
    assert_frame_equal(found.frames["/a"], by_the_package(good, "/a"))


def test_rerun_is_not_waited_for_longer_than_it_may_take(tmp_path, by_rerun, monkeypatch):
    path = known_colours(tmp_path / "log.mcap")
    with monkeypatch.context() as impatient:
        impatient.setattr(rerun_route, "START_TIMEOUT_S", 0.0)
        impatient.setattr(rerun_route, "PACE", 1e12)
        assert_same(path)
        assert by_rerun == []
    assert_same(path)
    assert set(by_rerun) == {"/a", "/b", "/c"}


@pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")
def test_a_reader_without_memory_leaves_the_log_to_the_other(tmp_path, by_rerun, monkeypatch):
    """It may take no more than it has when it has just started."""
    path = known_colours(tmp_path / "log.mcap", count=900)
    rerun_route.worker().stop()
    monkeypatch.setattr(rerun_route.reading_limits, "memory", lambda size: 0)
    assert_same(path)
    assert by_rerun == []
    rerun_route.worker().stop()  # it may have survived, with that limit


def test_a_killed_worker_is_replaced(tmp_path, by_rerun):
    path = known_colours(tmp_path / "log.mcap", count=90)
    read(path)
    process = rerun_route.worker()._process
    assert process is not None
    process.kill()
    process.wait()
    read(path)
    assert sorted(by_rerun) == sorted(2 * ["/a", "/b", "/c"])


def test_only_a_clean_log_is_given_to_rerun(tmp_path, by_rerun):
    whole = known_colours(tmp_path / "whole.mcap")
    where, size, lost = chunks(whole)[1]
    data = bytearray(whole.read_bytes())
    data[where + size // 2] ^= 0xFF
    flipped = tmp_path / "flipped.mcap"
    flipped.write_bytes(data)
    assert read(flipped).health.messages_lost == lost
    loose = known_colours(tmp_path / "loose.mcap", use_chunking=False)
    assert read(loose).health.messages_read == COUNT
    bare = known_colours(tmp_path / "bare.mcap", index_types=IndexType.CHUNK)
    assert read(bare).health.messages_read == COUNT
    assert by_rerun == []


SCRIPT = """
import sys
from shiplog.logs import rerun_route
from shiplog.logs.read import read
rerun_route.LEAST_MESSAGES = 0
assert "numba" not in sys.modules and "rerun" not in sys.modules
print(read(sys.argv[1]).health.messages_read, rerun_route.worker()._process.pid)
"""


def test_no_process_is_left_behind(tmp_path):
    """From a script without a main guard, and from a child that multiprocessing spawned."""
    path = known_colours(tmp_path / "log.mcap", count=90)
    command = [sys.executable, "-W", "error", "-c", SCRIPT, str(path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    count, worker = map(int, done.stdout.split())
    assert (count, done.stderr) == (90, "")
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        spawned = pool.apply(_in_a_child, (path,))
        pool.close()
        pool.join()
    for left in (worker, spawned):
        until = time.monotonic() + 10.0
        while _runs(left) and time.monotonic() < until:
            time.sleep(0.05)
        assert not _runs(left)


def _in_a_child(path: Path) -> int:
    rerun_route.LEAST_MESSAGES = 0
    assert read(path).health.messages_read == 90
    process = rerun_route.worker()._process
    assert process is not None
    return process.pid


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    with contextlib.suppress(OSError):  # one that ended but that nobody here may collect
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return True


ROS = """std_msgs/Header header
bool on
char small
float64 value
string<=9 label
int16[3] three
float64[] many
string[] names
Empty nothing
Point[] points
float32 last
uint8 CONSTANT=3
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: t/Empty
================================================================================
MSG: t/Point
float64 x # ahead
string name "none"
float64 y
"""
CLOCK = """================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""


@pytest.mark.parametrize(
    ("definition", "given"),
    [(ROS.replace("Empty nothing\n", "") + CLOCK, ["/kind"]), (ROS + CLOCK, []), (ROS, [])],
    ids=["plain", "with an empty message", "without Time"],
)
def test_rerun_and_the_ros_package_give_one_table(tmp_path, by_rerun, definition, given):
    path = tmp_path / "ros.mcap"
    with path.open("wb") as stream:
        writer = Ros2Writer(stream)
        schema = writer.register_msgdef("t/msg/Kind", definition)
        for k in range(50):
            points = [{"x": i / 2, "name": "p" * i, "y": -i} for i in range(k % 4)]
            message = {
                "header": {"stamp": {"sec": 1_700_000_000 + k, "nanosec": 5}, "frame_id": "f" * k},
                "on": k % 2 == 0, "small": k, "value": k / 3, "label": "x" * (k % 5),
                "three": [k, -k, 7], "many": [0.5] * (k % 3), "names": ["a"] * (k % 2),
                "nothing": {}, "points": points, "last": k / 8,
            }  # fmt: skip
            writer.write_message("/kind", schema, message, START + k, START + k)
        writer.finish()
    found = assert_same(path).frames["/kind"]
    assert by_rerun == given
    assert found["stamp"].to_list() == [START + k * SECOND + 5 for k in range(50)]
    assert found["last"].to_list() == [k / 8 for k in range(50)]
    assert found["three"].to_list() == [[k, -k, 7] for k in range(50)]
    assert found["points"].to_list()[3][2] == {"x": 1.0, "name": "pp", "y": -2.0}


EXPECTED_REFUSALS = {"keelson_klog_2024-05-15_eol_mangled", "rosbag2_wrong_rmw_test_0"}


@pytest.mark.shared
def test_every_foreign_log_is_read_or_refused(shared_data):
    paths = sorted((shared_data / "mcap").glob("*/*.mcap"))
    assert len(paths) >= 17
    refused = set()
    for path in paths:
        try:
            found = read(path)
        except LogUnreadable as error:
            refused.add(path.stem)
            assert error.hint
            continue
        with path.open("rb") as stream:
            counts: dict[str, int] = {}
            for _, channel, _ in make_reader(stream).iter_messages():
                counts[channel.topic] = counts.get(channel.topic, 0) + 1
        assert found.health.messages_read == sum(counts.values())
        assert found.health.messages_lost == 0
        for topic, count in counts.items():
            if topic not in found.health.undecodable:
                assert found.frames[topic].height == count
        assert {t for t, n in counts.items() if n} == set(found.frames) | (
            set(found.health.undecodable) & set(counts)
        )
        check(path)
        fields(path)
    assert refused == EXPECTED_REFUSALS


@pytest.mark.shared
def test_one_content_in_three_encodings_gives_one_table(shared_data):
    logs = {
        kind: read(shared_data / "mcap" / kind / "t2m_location_sensor.mcap").frames
        for kind in ("json", "protobuf", "cdr")
    }
    data = ["log_time", "publish_time", "pressure1", "pressure2", "sensor3", "sensor4"]
    fix = ["log_time", "stamp", "latitude", "longitude", "altitude"]
    for kind in ("protobuf", "cdr"):
        assert_frame_equal(
            logs[kind]["sensorcsv/Data"].select(data), logs["json"]["sensorcsv/Data"].select(data)
        )
        named = "locationcsv/NavSatFix" if kind == "cdr" else "locationcsv/LocationFix"
        assert_frame_equal(
            logs[kind][named].select(fix), logs["json"]["locationcsv/LocationFix"].select(fix)
        )
    arms = [
        read(shared_data / "mcap" / kind / "t2m_lerobot_arm.mcap").frames[
            "episode_000000parquet/Data"
        ]
        for kind in ("json", "protobuf", "cdr")
    ]
    assert_frame_equal(arms[1], arms[0])
    assert_frame_equal(arms[2], arms[0])


@pytest.mark.shared
def test_transforms_and_covariances_agree_where_they_can(shared_data):
    found = []
    for kind in ("json", "protobuf", "cdr"):
        path = "transform.translation.x" if kind == "cdr" else "transforms[0].translation.x"
        log = shared_data / "mcap" / kind / "t2m_location_sensor.mcap"
        topic = "locationcsv/FrameTransforms"
        frame = read(log, {topic: [path]}).frames[topic]
        found.append(frame.rename({path: "x"}).select("stamp", "x"))
    assert_frame_equal(found[1], found[0])
    assert_frame_equal(found[2], found[0])


@pytest.mark.shared
def test_json_inside_protobuf_is_reached_on_649_channels(shared_data):
    path = shared_data / "mcap" / "protobuf" / "keelson_sjofartsverket_ais.mcap"
    found = read(path)
    assert len(found.frames) == 649
    clock = next(f for f in found.health.findings if f.kind == "clock_offset")
    assert "649 topics" in clock.sentence and clock.value is not None and 0.8 < clock.value < 1.3
    topic = "rise/v0/sjofartsverket/pubsub/raw/ais/json/265761380/1"
    frame = read(path, {topic: ["value.lon", "value.accuracy", "value.timestamp"]}).frames[topic]
    assert frame["value.lon"][0] == pytest.approx(11.534422)
    assert frame["value.accuracy"].dtype == pl.Boolean
    assert frame["value.timestamp"][0] == "2024-12-07T13:13:02Z"
    assert fields(path, [topic])[topic]["value.lon"] == pl.Float64


@pytest.mark.shared
def test_rerun_and_the_packages_give_one_table_of_every_foreign_log(shared_data, by_rerun):
    for path in sorted((shared_data / "mcap").glob("[cp]*/*.mcap")):
        assert_same(path)
    assert len(by_rerun) > 600


@pytest.mark.shared
def test_ros_messages_are_read_as_the_ros_package_reads_them(shared_data):
    path = shared_data / "mcap" / "cdr" / "t2m_location_sensor.mcap"
    topic = "locationcsv/NavSatFix"
    frame = read(path).frames[topic]
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[Ros2Factory()])
        messages = [m.decoded_message for m in reader.iter_decoded_messages(topics=[topic])]
    assert frame["latitude"].to_list() == [m.latitude for m in messages]
    assert frame["header.frame_id"].to_list() == [m.header.frame_id for m in messages]
    assert frame["status.service"].to_list() == [m.status.service for m in messages]
    assert frame["position_covariance"].to_list() == [list(m.position_covariance) for m in messages]
