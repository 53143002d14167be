"""Whole logs: every field, topic, encoding and clock, with the counts worked out beforehand."""

from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest
from made_logs import (
    COUNT,
    DESCRIPTORS,
    SECOND,
    START,
    Kind,
    assert_same,
    by_hand,
    by_the_package,
    chunks,
    json_log,
    known_colours,
    protobuf_log,
    sample,
)
from mcap.reader import make_reader
from mcap.records import ChunkIndex
from mcap.writer import CompressionType, IndexType, Writer
from polars.testing import assert_frame_equal

from shiplog.exceptions import LogUnreadable
from shiplog.logs.mcap_file import chunks as chunks_module
from shiplog.logs.mcap_file import read_ahead, scan
from shiplog.logs.mcap_file.container import Index, Sound
from shiplog.logs.reading import preflight, rerun_route
from shiplog.logs.reading.check import check
from shiplog.logs.reading.read import contents, fields, read


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


@pytest.fixture
def on_the_walk(monkeypatch):
    """Every log is checked first, however small; says which topics were decoded meanwhile."""
    given: list[str] = []
    whole = preflight.checked

    def watched(tables):
        sound = whole(tables)
        given.extend(sound[1] if sound else ())
        return sound

    monkeypatch.setattr(rerun_route, "LEAST_MESSAGES", 0)
    monkeypatch.setattr(rerun_route, "LEAST_WARM", 0)
    monkeypatch.setattr(preflight, "checked", watched)
    return given


def chunk_indexes(path: Path) -> list[ChunkIndex]:
    """In the order of the file."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary
    return sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)


NUMBERS = ("value", "small", "signed", "point.x", "maybe", "timestamp.nanos")


@pytest.mark.parametrize("jitter", [0, 10], ids=["in order", "out of order"])
@pytest.mark.parametrize("compression", list(CompressionType))
def test_numbers_and_large_messages_are_decoded_on_the_walk(
    tmp_path, on_the_walk, jitter, compression
):
    """/a by Rerun, which also gives texts, /b as pictures, /c as numbers; in the log's order."""

    def make(k: int):
        message = sample(k, newest=3)
        message.raw = bytes([k % 256]) * (9000 if k % 3 == 1 else 1)
        return message

    path = protobuf_log(
        tmp_path / "log.mcap", count=900, make=make, compression=compression,
        times=lambda k: START + k // 3 * SECOND + (9 * SECOND if jitter and k % jitter == 0 else 0),
    )  # fmt: skip
    wanted = {"/a": ("value", "names"), "/b": ("value", "names"), "/c": NUMBERS}
    found = assert_same(path, wanted)
    assert sorted(on_the_walk) == ["/b", "/c"]
    assert list(found.frames) == ["/a", "/b", "/c"] and found.health.route == "fast"
    assert assert_same(path, {"/c": NUMBERS}, others=True).frames["/a"].width == 3
    assert assert_same(path, {}, others=True).frames.keys() == {"/a", "/b", "/c"}


def test_a_bad_payload_costs_one_message_on_the_walk(tmp_path, on_the_walk):
    path = known_colours(tmp_path / "log.mcap", count=90, replaced={30: b"\xff", 31: b"\x42\x20a"})
    found = assert_same(path, {}, others=True)
    assert set(on_the_walk) == {"/a", "/b", "/c"}
    assert {t: frame.height for t, frame in found.frames.items()} == {"/a": 29, "/b": 29, "/c": 30}
    assert [f.value for f in found.health.findings] == [1.0, 1.0]


def test_chunks_too_large_to_be_unpacked_at_once_are_decoded_on_the_walk(
    tmp_path, on_the_walk, monkeypatch
):
    """And a walk that misses a message of theirs is not believed."""
    path = known_colours(tmp_path / "log.mcap", count=900)
    monkeypatch.setattr(chunks_module, "AT_ONCE", 4096)
    assert_same(path, {}, others=True)
    assert set(on_the_walk) == {"/a", "/b", "/c"}
    on_the_walk.clear()
    whole, missed = preflight.Waiting.take_alone, []

    def missing(self, message):
        if missed:
            whole(self, message)
        missed.append(message)

    monkeypatch.setattr(preflight.Waiting, "take_alone", missing)
    assert_same(path, {}, others=True)
    assert on_the_walk == [] and missed


def test_what_large_chunks_began_a_small_one_ends(tmp_path, on_the_walk, monkeypatch):
    """Texts and bytes in messages of 100 bytes: none of them twice, whoever decodes the last."""
    wanted = {t: ("value", "names") for t in ("/a", "/b", "/c")}
    path = known_colours(tmp_path / "log.mcap", count=900)
    *large, last = (chunk.uncompressed_size for chunk in chunk_indexes(path))
    assert last < min(large)
    monkeypatch.setattr(chunks_module, "AT_ONCE", last)
    assert {frame.height for frame in assert_same(path, wanted).frames.values()} == {300}
    assert set(on_the_walk) == {"/a", "/b", "/c"}


def test_a_topic_of_two_channels_is_not_decoded_on_the_walk(tmp_path, on_the_walk):
    path = known_colours(tmp_path / "log.mcap", count=300, topics=("/a", "/b", "/a"))
    assert assert_same(path, {}, others=True).frames["/a"].height == 200
    assert on_the_walk == ["/b"]


@pytest.mark.parametrize("lie", ["place", "time", "beyond"])
def test_an_index_that_lies_is_not_believed(tmp_path, on_the_walk, monkeypatch, lie):
    """Nothing of what was decoded before is left in the tables: the log is read anew."""
    path = known_colours(tmp_path / "log.mcap", count=900)
    expected = by_hand(path, {}, True)
    whole, met = scan.index_of, []
    monkeypatch.setattr(preflight, "HELD_BYTES", 1000)

    def lying(body, section):
        for index in whole(body, section):
            places, times = index.places.copy(), index.times.copy()
            met.append(index)
            if len(met) < 9:
                pass
            elif lie == "time":
                times[-1] += 1
            else:
                places[-1] = places[0] if lie == "place" else 1 << 40
            yield Index(index.channel, times, places)

    monkeypatch.setattr(scan, "index_of", lying)
    found = read(path, {}, others=True)
    assert on_the_walk == []
    assert found.frames.keys() == expected.frames.keys()
    for topic, frame in found.frames.items():
        assert_frame_equal(frame, expected.frames[topic])


def test_chunks_read_ahead_are_those_of_the_file(tmp_path, monkeypatch):
    """With threads and without: the same items, and the same losses where a chunk is damaged."""
    path = known_colours(tmp_path / "log.mcap")
    where, size, _ = chunks(path)[3]
    data = bytearray(path.read_bytes())
    data[where + size // 2] ^= 0xFF
    damaged = tmp_path / "damaged.mcap"
    damaged.write_bytes(data)
    for log in (path, damaged):
        met = []
        for fewest in (2, 10**9):
            monkeypatch.setattr(read_ahead, "FEWEST_CHUNKS", fewest)
            found = scan.survey(log)
            items = [i for i in scan.walk(found) if isinstance(i, Sound)]
            met.append(([(i.offset, bytes(i.chunk.data)) for i in items], found.losses))
        assert met[0] == met[1] and len(met[0][0]) > 8
        assert len(met[0][1]) == (log == damaged)


@pytest.mark.shared
def test_the_walk_and_the_packages_give_one_table_of_every_foreign_log(shared_data, on_the_walk):
    for path in sorted((shared_data / "mcap").glob("[cp]*/*.mcap")):
        assert_same(path)
        assert_same(path, {}, others=True)
    assert len(on_the_walk) > 1200
