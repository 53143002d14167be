"""Logs that other programs wrote: read as their own packages read them, or refused."""

from __future__ import annotations

import polars as pl
import pytest
from made_logs import assert_same
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory as Ros2Factory
from polars.testing import assert_frame_equal

from shiplog.exceptions import LogUnreadable
from shiplog.logs.reading.check import check
from shiplog.logs.reading.read import fields, read

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
