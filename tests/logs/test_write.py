"""Logs come back to the bit, through three readers that share no code with the writer."""

import math
import struct

import numpy as np
import pytest
from google.protobuf import timestamp_pb2
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory
from rerun.chunk import McapReader

from shiplog.exceptions import ShiplogError
from shiplog.logs.conversion import write
from shiplog.logs.conversion.write import SCHEMAS, Series, write_log

START = 1_700_000_000_123_456_789
AWKWARD = np.array([0.0, -0.0, math.nan, math.inf, -math.inf, 5e-324, 0.1, -179.99999999999997])


def bits(values) -> bytes:
    return struct.pack(f"<{len(values)}d", *values)


def stamps(count: int, period: int = 100_000_000) -> np.ndarray:
    return START + period * np.arange(count, dtype=np.int64)


def decoded(path) -> dict[str, list]:
    """Topic -> (message record, protobuf message), in the reader's order of log time."""
    found: dict[str, list] = {}
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, proto in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append((message, proto))
    return found


@pytest.mark.parametrize("schema", [name for name in SCHEMAS if name.startswith("shiplog.")])
def test_every_schema_comes_back_to_the_bit(tmp_path, schema):
    time = stamps(len(AWKWARD))
    columns = {name: np.roll(AWKWARD, i) for i, name in enumerate(SCHEMAS[schema])}
    series = Series("/topic", schema, time, columns, frame_id="base_link")
    write_log(tmp_path / "a.mcap", [series], ship="a ship")
    messages = decoded(tmp_path / "a.mcap")["/topic"]
    for name, values in columns.items():
        assert bits([getattr(proto, name) for _, proto in messages]) == bits(values)
    assert [proto.timestamp.ToNanoseconds() for _, proto in messages] == time.tolist()
    assert {proto.frame_id for _, proto in messages} == {"base_link"}
    assert [d.number for d in messages[0][1].DESCRIPTOR.fields] == list(range(1, len(columns) + 3))


def test_the_bytes_are_what_protobuf_itself_would_write(tmp_path):
    rng = np.random.default_rng(1)
    time = np.concatenate(
        [[0, 1, 999_999_999, 1_000_000_000, 127, 128], rng.integers(0, 2**62, 200)]
    )
    rudder = np.where(rng.random(206) < 0.3, 0.0, rng.normal(size=206))
    write_log(
        tmp_path / "a.mcap",
        [Series("/rudder/port", "shiplog.Rudder", time, {"angle_deg": rudder}, frame_id="x" * 200)],
        ship="",
    )
    for message, proto in decoded(tmp_path / "a.mcap")["/rudder/port"]:
        assert proto.SerializeToString(deterministic=True) == message.data


def test_a_fix_has_the_official_field_numbers(tmp_path):
    """foxglove.LocationFix built here anew from foxglove's own .proto, and read with that."""
    pool = DescriptorPool()
    files = FileDescriptorSet()
    file = files.file.add(name="theirs.proto", package="foxglove", syntax="proto3")
    pool.AddSerializedFile(timestamp_pb2.DESCRIPTOR.serialized_pb)
    file.dependency.append(timestamp_pb2.DESCRIPTOR.name)
    message = file.message_type.add(name="LocationFix")
    double, repeated = 1, 3
    for number, name in ((1, "latitude"), (2, "longitude"), (3, "altitude")):
        message.field.add(name=name, number=number, type=double, label=1)
    message.field.add(name="position_covariance", number=4, type=double, label=repeated)
    message.field.add(name="position_covariance_type", number=5, type=5, label=1)
    message.field.add(
        name="timestamp", number=6, type=11, label=1, type_name=".google.protobuf.Timestamp"
    )
    message.field.add(name="frame_id", number=7, type=9, label=1)
    pool.AddSerializedFile(file.SerializeToString())
    theirs = GetMessageClass(pool.FindMessageTypeByName("foxglove.LocationFix"))

    covariance = np.tile(np.diag([4e-4, 4e-4, 1.6e-3]).reshape(9), (3, 1))
    covariance[2, 1] = covariance[2, 3] = 1e-5  # the last one is not diagonal
    latitude = np.array([34.82, -34.82, 1 / 3])
    fix = Series(
        "/gnss/fix", "foxglove.LocationFix", stamps(3),
        {"latitude": latitude, "longitude": latitude + 100, "position_covariance": covariance},
        frame_id="antenna",
    )  # fmt: skip
    write_log(tmp_path / "a.mcap", [fix], ship="a ship")
    for row, (record, proto) in enumerate(decoded(tmp_path / "a.mcap")["/gnss/fix"]):
        read = theirs.FromString(record.data)
        assert (read.latitude, read.longitude) == (latitude[row], latitude[row] + 100)
        assert math.isnan(read.altitude)  # not given: NaN, and never a silent 0
        assert list(read.position_covariance) == covariance[row].tolist()
        assert read.position_covariance_type == (2, 2, 3)[row]
        assert read.timestamp.ToNanoseconds() == stamps(3)[row]
        assert read.frame_id == "antenna"
        assert proto.SerializeToString() == read.SerializeToString() == record.data


def several() -> list[Series]:
    count = 30_000
    time = stamps(count)
    wave = np.sin(np.arange(count) / 50)
    return [
        Series(
            "/gyro", "shiplog.Gyro", time, {"heading_deg": wave, "yaw_rate_degps": -wave},
            log_time=time + 7_000_000, publish_time=time + 1,
            metadata={"unit": "deg", "nominal_hz": "10"},
        ),
        Series("/rudder/port", "shiplog.Rudder", time[::2] + 3, {"angle_deg": wave[::2]}),
        Series("/rudder/starboard", "shiplog.Rudder", time[:0], {"angle_deg": wave[:0]}),
        Series("/raw/load", "someone.Load", time[::5], {"shaft_nm": wave[::5], "t": wave[::5]}),
    ]  # fmt: skip


def test_the_file_is_whole_indexed_and_says_what_it_is(tmp_path):
    path = tmp_path / "a.mcap"
    write_log(path, several(), ship="a ship", datum=(34.82, 135.52), notes={"pond": "Inukai"})
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        metadata = list(reader.iter_metadata())
        times = [message.log_time for _, _, message in reader.iter_messages(log_time_order=False)]
        header = reader.get_header()
    assert header.profile == ""
    counts = {
        summary.channels[i].topic: n for i, n in summary.statistics.channel_message_counts.items()
    }
    assert counts == {"/gyro": 30_000, "/rudder/port": 15_000, "/raw/load": 6_000}
    assert {c.topic for c in summary.channels.values()} == {*counts, "/rudder/starboard"}
    assert {s.name for s in summary.schemas.values()} == {
        "shiplog.Gyro", "shiplog.Rudder", "someone.Load",
    }  # fmt: skip
    assert times == sorted(times)
    assert len(summary.chunk_indexes) == summary.statistics.chunk_count > 1
    assert all(c.compression == "zstd" and c.message_index_offsets for c in summary.chunk_indexes)
    assert [m.name for m in metadata] == ["voyage"]
    assert metadata[0].metadata == {
        "ship": "a ship", "datum": "34.82,135.52", "contract": "1", "pond": "Inukai",
    }  # fmt: skip
    with open(path, "rb") as stream:
        records = list(StreamReader(stream, emit_chunks=True, validate_crcs=True).records)
    assert all(r.uncompressed_crc for r in records if isinstance(r, Chunk))
    assert records[-1].summary_crc
    gyro = next(c for c in summary.channels.values() if c.topic == "/gyro")
    assert gyro.metadata == {"unit": "deg", "nominal_hz": "10"}


def test_rerun_reads_every_message(tmp_path):
    path = tmp_path / "a.mcap"
    write_log(path, several(), ship="a ship")
    rows: dict[str, int] = {}
    for chunk in McapReader(str(path), decoders=["protobuf"]).stream():
        if not chunk.is_static:
            rows[chunk.entity_path] = rows.get(chunk.entity_path, 0) + chunk.num_rows
    assert rows == {"/gyro": 30_000, "/rudder/port": 15_000, "/raw/load": 6_000}


def test_the_recorders_clock_orders_the_file_and_measurement_times_stay(tmp_path):
    """Late arrivals: stamps that run backwards are kept as they are."""
    time = stamps(4)[::-1].copy()
    series = Series(
        "/gyro", "shiplog.Gyro", time, {"heading_deg": np.arange(4.0)},
        log_time=stamps(4)[[1, 0, 3, 2]],
    )  # fmt: skip
    write_log(tmp_path / "a.mcap", [series], ship="")
    read = decoded(tmp_path / "a.mcap")["/gyro"]
    assert [m.log_time for m, _ in read] == stamps(4).tolist()
    assert [p.heading_deg for _, p in read] == [1.0, 0.0, 3.0, 2.0]
    assert [p.timestamp.ToNanoseconds() for _, p in read] == time[[1, 0, 3, 2]].tolist()
    assert all(math.isnan(p.yaw_rate_degps) for _, p in read)


def test_a_log_without_messages_still_names_its_channels(tmp_path):
    empty = Series("/gyro", "shiplog.Gyro", np.empty(0, np.int64), {})
    write_log(tmp_path / "a.mcap", [empty], ship="a ship")
    with open(tmp_path / "a.mcap", "rb") as stream:
        summary = make_reader(stream, validate_crcs=True).get_summary()
    assert [c.topic for c in summary.channels.values()] == ["/gyro"]
    assert summary.statistics.message_count == 0


GOOD = {"angle_deg": np.zeros(3)}


@pytest.mark.parametrize(
    ("series", "says"),
    [
        (Series("/r", "shiplog.Rudder", stamps(3), {"angel_deg": np.zeros(3)}), "did you mean"),
        (Series("/r", "shiplog.Rudder", stamps(3), {"angle_deg": np.zeros(2)}), "shape"),
        (Series("/r", "shiplog.Rudder", np.arange(3.0), GOOD), "nanoseconds"),
        (Series("/r", "shiplog.Rudder", stamps(3) * -1, GOOD), "1970"),
        (Series("/r", "shiplog.Rudder", stamps(3), GOOD, log_time=stamps(2)), "clocks"),
        (Series("/r", "my.Raw", stamps(3), {"wind [m/s]": np.zeros(3)}), "protobuf"),
        (Series("/r", "my.Raw", stamps(3), {"timestamp": np.zeros(3)}), "own"),
    ],
)
def test_what_cannot_be_written_is_reported_and_leaves_nothing(tmp_path, series, says):
    (tmp_path / "a.mcap").write_bytes(b"the log that was here before")
    with pytest.raises(ShiplogError, match=says):
        write_log(tmp_path / "a.mcap", [several()[0], series], ship="a ship")
    assert [p.name for p in tmp_path.iterdir()] == ["a.mcap"]
    assert (tmp_path / "a.mcap").read_bytes() == b"the log that was here before"


def test_a_crash_half_way_leaves_no_file(tmp_path, monkeypatch):
    def broken(one, order):
        yield from [b""] * 20_000
        raise KeyboardInterrupt

    monkeypatch.setattr(write, "encode", broken)
    with pytest.raises(KeyboardInterrupt):
        write_log(tmp_path / "a.mcap", several(), ship="a ship")
    assert list(tmp_path.iterdir()) == []


def test_two_series_of_one_topic_are_refused(tmp_path):
    with pytest.raises(ShiplogError, match="/gyro"):
        write_log(tmp_path / "a.mcap", [several()[0], several()[0]], ship="a ship")
