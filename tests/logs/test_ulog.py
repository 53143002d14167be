"""PX4 ULog files: bytes by the documented format, and what a reader of them must do right."""

import math

import made_ulog as ulog
import numpy as np
import pytest
from circle_layouts import DATUM, SENSORS, START, Voyage, direct, profile_of, same

from shiplog.commands.convert import convert, draft
from shiplog.commands.prepare import check_logs
from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion import formats
from shiplog.logs.conversion.ulog import read_ulog
from shiplog.logs.conversion.ulog_messages import read_messages
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.unchecked_lines import unchecked_lines

ROLES = ("position", "ned", "heading", "yaw_rate")


@pytest.fixture
def flight(tmp_path):
    path = tmp_path / "flight.ulg"
    path.write_bytes(ulog.circle())
    return path


def topics(data: bytes, tmp_path) -> dict:
    path = tmp_path / "log.ulg"
    path.write_bytes(data)
    return {one.topic: one for one in read_ulog(path).series}


def one_topic(name: str, rows: list[tuple], fields="", instances=(0,), start=ulog.BOOT_US) -> bytes:
    fields = fields or ulog.FORMATS[name]
    out = ulog.header(start) + ulog.fmt(name, fields)
    out += b"".join(ulog.subscribe(n, name, n) for n in instances)
    return out + b"".join(ulog.sample(row[0], fields, *row[1:]) for row in rows)


def test_the_voyage_equals_that_in_mcap(tmp_path, flight):
    profile = profile_of(*ROLES)
    text = '[ship]\nname = "circle"\nlength_m = 20.0\n' + "".join(SENSORS[one] for one in ROLES)
    for old, new in (('"/gnss/ned"', '"/gnss/velocity"'), ('["north", "east"]',
                     '["north_mps", "east_mps"]'), ('[sensors.yaw_rate]\ntopic = "/gyro"',
                     '[sensors.yaw_rate]\ntopic = "/gyro/rate"')):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    assert formats.recognise(flight).name == "PX4 ULog files"
    done = convert([flight], None, tmp_path / "logs")
    assert not done.refused and not done.lost
    same(done.logs[0], profiles.parse(text + DATUM, "px4"), direct(tmp_path, profile, Voyage()))


def test_pyulog_reads_the_same_numbers(flight):
    """An independent reader of the same bytes."""
    library = pytest.importorskip("pyulog", reason="pip install pyulog")
    theirs = library.ULog(str(flight))
    ours = read_messages(flight, ulog.FORMATS)
    for data in theirs.data_list:
        rows = ours.topics[data.name, data.multi_id]
        for name, values in data.data.items():
            label, _, index = name.partition("[")
            column = rows[label][:, int(index.rstrip("]"))] if index else rows[label]
            np.testing.assert_array_equal(column, values, name)
    assert ours.parameters == pytest.approx(theirs.initial_parameters)


def test_a_draft_takes_the_motors_that_are_used(flight):
    text = draft(flight)
    drafted = profiles.parse(text, "draft")
    assert [(one.topic, one.kind, one.unit) for one in drafted.actuators] == [
        ("/thruster/motor_1", "thruster", "1"), ("/thruster/motor_2", "thruster", "1")
    ]  # fmt: skip
    assert drafted.sensors.heading.topic == "/gyro"  # and not that of one antenna, which is blank
    assert drafted.sensors.position.lever_arm_m == pytest.approx((0.2, 0.1))
    assert "ship.length_m" in unchecked_lines(text)


# --- times --------------------------------------------------------------------------------------


def test_times_are_those_of_measurement_in_utc(flight):
    """timestamp_sample, tied to UTC by the receiver; what is older than the log is none of it."""
    found = {one.topic: one for one in read_ulog(flight).series}
    for topic in ("/gnss/fix", "/gyro", "/gyro/rate", "/thruster/motor_1"):
        assert (found[topic].time == Voyage().ns).all(), topic


def test_a_sample_time_of_0_is_none(tmp_path):
    rows = [(0, ulog.BOOT_US + 1000 * k, 0, ulog.quaternion(0.5), [0.0] * 4, 0) for k in range(3)]
    found = topics(one_topic("vehicle_attitude", rows), tmp_path)["/gyro"]
    assert found.time.tolist() == [1000 * (ulog.BOOT_US + 1000 * k) for k in range(3)]


def test_a_simulation_counts_from_1970_already(tmp_path):
    start = round(START * 1e6)
    rows = [(0, start + 1000 * k, start + 1000 * k, ulog.quaternion(0.5), [0.0] * 4, 0)
            for k in range(3)]  # fmt: skip
    path = tmp_path / "sitl.ulg"
    path.write_bytes(one_topic("vehicle_attitude", rows, start=start))
    found = read_ulog(path)
    assert found.series[0].time[0] == start * 1000 and not found.findings


def test_without_a_receiver_times_count_from_1970(tmp_path):
    rows = [(0, ulog.BOOT_US, 0, ulog.quaternion(0.5), [0.0] * 4, 0)]
    path = tmp_path / "indoors.ulg"
    path.write_bytes(one_topic("vehicle_attitude", rows))
    assert any("no UTC" in one.sentence for one in read_ulog(path).findings)


def test_never_published_is_no_sample(tmp_path):
    """A stamp of 0: the topic was never published."""
    rows = [(0, 0, 0, ulog.quaternion(2.0), [0.0] * 4, 0),
            (0, ulog.BOOT_US, 0, ulog.quaternion(0.5), [0.0] * 4, 0)]  # fmt: skip
    found = topics(one_topic("vehicle_attitude", rows), tmp_path)["/gyro"]
    assert found.columns["heading_deg"] == pytest.approx([math.degrees(0.5)], abs=1e-4)


# --- units and blanks ---------------------------------------------------------------------------


def test_until_1_13_positions_are_whole_numbers(tmp_path):
    rows = [(0, ulog.BOOT_US + 200_000 * k, round((START + 0.2 * k) * 1e6), 473_977_419,
             85_455_938, 488_000, 0.1, 0.8, 1.0, 2.0, math.nan, 3) for k in range(3)]  # fmt: skip
    found = topics(one_topic("vehicle_gps_position", rows, ulog.OLD_GPS), tmp_path)
    assert found["/gnss/fix"].columns["latitude"].tolist() == [47.3977419] * 3
    assert found["/gnss/fix"].time[0] == round(START * 1e9)
    assert "/gnss/heading" not in found


def test_what_is_no_measurement_is_blank(tmp_path):
    """No fix; an estimate that says of itself, in an int8, that it is not valid."""
    gps = ulog.FORMATS["vehicle_gps_position"]
    rows = [(0, ulog.BOOT_US + k, 0, 56.0, 12.0, 0, 0.1, 0.8, 1.0, 2.0, 1.5, 3 if k else 1)
            for k in range(2)]  # fmt: skip
    found = topics(one_topic("vehicle_gps_position", rows, gps), tmp_path)
    assert np.isnan(found["/gnss/fix"].columns["latitude"]).tolist() == [True, False]
    assert found["/gnss/heading"].columns["heading_deg"][1] == pytest.approx(math.degrees(1.5))
    rows = [(0, ulog.BOOT_US + k, 0, 0.0, 0.0, 1.0, 2.0, k, 1) for k in range(2)]
    found = topics(one_topic("vehicle_local_position", rows), tmp_path)
    assert np.isnan(found["/ekf/local_position"].columns["x0_m"]).tolist() == [True, False]
    assert found["/ekf/velocity"].columns["east_mps"].tolist() == [2.0, 2.0]


def test_heading_is_of_the_quaternion_with_w_first(tmp_path):
    """Heeled by 10 deg: the heading is that of the bow all the same."""
    yaw, roll = math.radians(250.0), math.radians(10.0)
    cy, sy, cr, sr = (f(a / 2) for a in (yaw, roll) for f in (math.cos, math.sin))
    q = [cy * cr, cy * sr, sy * sr, sy * cr]
    rows = [(0, ulog.BOOT_US, 0, q, [0.0] * 4, 0)]
    found = topics(one_topic("vehicle_attitude", rows), tmp_path)["/gyro"]
    assert found.columns["heading_deg"] == pytest.approx([250.0], abs=1e-4)


def test_motors_that_are_not_used_are_none(tmp_path):
    """NaN of multicopters, 0 throughout of rovers and boats."""
    controls = [0.3, math.nan, 0.0, -0.2, *(math.nan,) * 8]
    rows = [(0, ulog.BOOT_US + k, 0, controls, 0) for k in range(3)]
    found = topics(one_topic("actuator_motors", rows), tmp_path)
    assert set(found) == {"/thruster/motor_1", "/thruster/motor_4"}


# --- structure ----------------------------------------------------------------------------------


def test_two_subscriptions_of_one_instance_are_joined_and_instances_stay_apart(tmp_path):
    name = "vehicle_attitude"
    fields = ulog.FORMATS[name]
    out = ulog.header() + ulog.fmt(name, fields)
    out += ulog.subscribe(3, name, 0) + ulog.subscribe(5, name, 1) + ulog.subscribe(9, name, 0)
    for k, number in enumerate((3, 5, 9, 3)):
        out += ulog.sample(number, fields, ulog.BOOT_US + k, 0, ulog.quaternion(0.1 * k), [0.0] * 4,
                           0)  # fmt: skip
    (tmp_path / "log.ulg").write_bytes(out)
    found = read_messages(tmp_path / "log.ulg", (name,))
    assert {key: len(rows) for key, rows in found.topics.items()} == {(name, 0): 3, (name, 1): 1}


def test_a_topic_without_a_field_that_is_read_costs_itself(tmp_path):
    """An estimate of another version, that does not say whether its velocity is valid."""
    fields = ulog.FORMATS["vehicle_local_position"].replace("v_xy_valid", "v_xy_ok")
    rows = [(0, ulog.BOOT_US + k, 0, 1.0, 2.0, 3.0, 4.0, 1, 1) for k in range(3)]
    found = topics(one_topic("vehicle_local_position", rows, fields), tmp_path)
    assert list(found) == ["/ekf/local_position"]


def test_receivers_stay_apart(tmp_path):
    """sensor_gps has an instance each, where vehicle_gps_position is not there."""
    fields = ulog.FORMATS["vehicle_gps_position"]
    out = ulog.header() + ulog.fmt("sensor_gps", fields)
    out += ulog.subscribe(0, "sensor_gps", 0) + ulog.subscribe(1, "sensor_gps", 1)
    for k in range(6):
        out += ulog.sample(k % 2, fields, ulog.BOOT_US + k, 0, 56.0 + k % 2, 12.0, 0, 0.1, 0.8, 1.0,
                           2.0, math.nan, 3)  # fmt: skip
    found = topics(out, tmp_path)
    assert found["/gnss/fix"].columns["latitude"].tolist() == [56.0] * 3
    assert found["/gnss/fix/gps_2"].columns["latitude"].tolist() == [57.0] * 3


def test_padding_at_the_end_may_be_there_or_not(tmp_path, flight):
    (tmp_path / "padded.ulg").write_bytes(ulog.circle(padded=True))
    padded, bare = read_ulog(tmp_path / "padded.ulg"), read_ulog(flight)
    for one, other in zip(padded.series, bare.series, strict=True):
        for name, column in one.columns.items():
            np.testing.assert_array_equal(column, other.columns[name])


def test_blocks_of_any_length_hold_the_same_samples(flight, monkeypatch):
    from shiplog.logs.conversion import ulog_messages as reader

    whole = read_messages(flight, ulog.FORMATS)
    for size in (157, 4096):
        monkeypatch.setattr(reader, "BLOCK_BYTES", size)
        parts = read_messages(flight, ulog.FORMATS)
        assert (parts.messages, parts.cut, parts.skipped) == (whole.messages, 0, 0)
        assert {k: len(v) for k, v in parts.topics.items()} == {
            k: len(v) for k, v in whole.topics.items()
        }


def test_damage_in_the_middle_costs_what_is_before_the_next_sync(tmp_path, flight):
    raw = bytearray(flight.read_bytes())
    middle = len(raw) // 2
    sync = b"\x08\x00S\x2f\x73\x13\x20\x25\x0c\xbb\x12"
    cut = raw.find(b"\x1e\x00D\x02\x00", middle)  # a sample of the angular velocity begins here
    assert cut > 0
    damaged = raw[:cut] + b"\xee" * 50 + sync + raw[cut:]
    (tmp_path / "hole.ulg").write_bytes(damaged)
    whole, found = (read_messages(p, ulog.FORMATS) for p in (flight, tmp_path / "hole.ulg"))
    assert found.skipped == 50 and found.messages == whole.messages + 1


def test_appended_parts_are_read_by_their_offsets(tmp_path):
    """A crash dump behind a message that was cut off."""
    name, fields = "vehicle_attitude", ulog.FORMATS["vehicle_attitude"]

    def rows(first):
        return b"".join(
            ulog.sample(0, fields, ulog.BOOT_US + first + k, 0, ulog.quaternion(0.5), [0.0] * 4, 0)
            for k in range(5)
        )

    def body(at):
        return ulog.header(appended=at) + ulog.fmt(name, fields) + ulog.subscribe(0, name) + rows(0)

    cut = rows(5)[:30]
    offset = len(body((1,))) + len(cut)
    (tmp_path / "log.ulg").write_bytes(body((offset,)) + cut + rows(100))
    found = read_messages(tmp_path / "log.ulg", (name,))
    assert len(found.topics[name, 0]) == 10 and not found.cut


def test_dropouts_are_said(tmp_path):
    path = tmp_path / "slow.ulg"
    path.write_bytes(ulog.circle() + ulog.dropout(120) + ulog.dropout(80))
    said = [one.sentence for one in read_ulog(path).findings]
    assert any("2 times, for 200 ms in all" in one for one in said)


def test_of_a_truncated_file_what_is_whole_is_read(tmp_path, flight):
    cut = tmp_path / "cut.ulg"
    cut.write_bytes(flight.read_bytes()[:-1010])
    done = check_logs([cut])
    assert not done.complete  # exit 3
    assert any(one.kind == "truncated" for one in done.reports[0].findings)


def test_a_log_of_nothing_says_what_to_log(tmp_path):
    (tmp_path / "none.ulg").write_bytes(ulog.header())
    with pytest.raises(ChannelMissing) as refused:
        read_ulog(tmp_path / "none.ulg")
    assert "vehicle_attitude" in refused.value.hint
