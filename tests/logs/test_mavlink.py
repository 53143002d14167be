"""MAVLink telemetry logs: frames written by the documented serialization, and what a reader of them
must do right."""

import builtins
import struct

import numpy as np
import pytest
from circle_layouts import RATE, SPEED, START, Voyage, direct, profile_of, same

from shiplog.commands.convert import convert, draft
from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion import formats
from shiplog.logs.conversion.mavlink import read_telemetry
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.unchecked_lines import unchecked_lines

needed = pytest.mark.skipif(
    not __import__("importlib.util").util.find_spec("pymavlink"), reason="shiplog[ardupilot]"
)
MESSAGES = {  # number, struct in the order of sending, extra byte of the checksum; common.xml
    "HEARTBEAT": (0, "<IBBBBB", 50), "SYSTEM_TIME": (2, "<QI", 137),
    "PARAM_VALUE": (22, "<fHH16sB", 220), "GPS_RAW_INT": (24, "<QiiiHHHHBBiIIIIH", 24),
    "ATTITUDE": (30, "<Iffffff", 39), "GLOBAL_POSITION_INT": (33, "<IiiiihhhH", 104),
    "SERVO_OUTPUT_RAW": (36, "<IHHHHHHHHBHHHHHHHH", 222), "VFR_HUD": (74, "<ffffhH", 20),
    "WIND": (168, "<fff", 1),
}  # fmt: skip
SHORT = {"GPS_RAW_INT": 30, "SERVO_OUTPUT_RAW": 21}  # bytes without what MAVLink 2 added


def crc(data: bytes) -> int:
    """CRC-16/MCRF4XX, bit by bit: polynomial 0x1021, reflected."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0x8408 if value & 1 else 0)
    return value


class Station:
    """A ground station's log: what came, when, over which link."""

    def __init__(self, version=2) -> None:
        self.log, self.version, self.counter = b"", version, {}

    def take(self, name, *values, at, sender=(1, 1), version=0, links=(0,), signed=False) -> None:
        """at  Unix s"""
        number, layout, extra = MESSAGES[name]
        payload = struct.pack(layout, *values)
        sequence = self.counter[sender] = (self.counter.get(sender, -1) + 1) % 256
        if (version or self.version) == 1:
            payload = payload[: SHORT.get(name, len(payload))]
            body = bytes([len(payload), sequence, *sender, number]) + payload
            frame = b"\xfe" + body
        else:
            payload = payload.rstrip(b"\0") or b"\0"
            head = bytes([len(payload), int(signed), 0, sequence, *sender])
            body = head + number.to_bytes(3, "little") + payload
            frame = b"\xfd" + body
        frame += struct.pack("<H", crc(body + bytes([extra]))) + bytes(13 * signed)
        for link in links:
            stamp = (round(at * 1e6) & ~3) | link
            self.log += struct.pack(">Q", stamp) + frame


def circle(version=2, **more) -> Station:
    """The circle as a boat sends it, in bursts of a second to the ground station, 30 ms later."""
    v, s = Voyage(), Station(version)
    north, east = v.velocity
    for i, (name, value) in enumerate((("SERVO1_FUNCTION", 73.0), ("SERVO3_FUNCTION", 74.0))):
        s.take("PARAM_VALUE", value, 2, i, name.encode(), 9, at=START - 1 + i / 10)
    for i in range(len(v.t)):
        boot, at = 100_000 + 100 * i, START + np.ceil(v.t[i] + 0.03)
        lat, lon = round(1e7 * v.latitude[i]), round(1e7 * v.longitude[i])
        if i % 10 == 0:
            s.take("SYSTEM_TIME", round(v.unix[i] * 1e6), boot, at=at, **more)
            s.take("HEARTBEAT", 5, 11, 3, 81, 4, 3, at=at, **more)
        s.take("ATTITUDE", boot, 0.0, 0.0, np.angle(np.exp(1j * v.heading[i])), 0.0, 0.0, RATE,
               at=at, **more)  # fmt: skip
        s.take(
            "GLOBAL_POSITION_INT",
            boot,
            lat,
            lon,
            0,
            0,
            round(100 * north[i]),
            round(100 * east[i]),
            0,
            round(100 * v.heading_deg[i]) % 36000,
            at=at,
            **more,
        )
        s.take(
            "GPS_RAW_INT",
            boot * 1000,
            lat,
            lon,
            0,
            100,
            65535,
            round(100 * SPEED),
            round(100 * v.course_deg[i]) % 36000,
            3,
            12,
            0,
            0,
            0,
            0,
            0,
            0,
            at=at,
            **more,
        )
        s.take("SERVO_OUTPUT_RAW", boot * 1000 % 2**32, 1500 + i % 100, 0, 1600 - i % 90, *(0,) * 5,
               0, *(0,) * 8, at=at, **more)  # fmt: skip
    return s


def read(station: Station, tmp_path) -> tuple[dict, list]:
    path = tmp_path / "made.tlog"
    path.write_bytes(station.log)
    found = read_telemetry(path)
    return {one.topic: one for one in found.series}, found.findings


@needed
@pytest.mark.parametrize("version", [1, 2])
def test_the_voyage_equals_that_in_mcap(tmp_path, version):
    path = tmp_path / "trip.tlog"
    path.write_bytes(circle(version).log)
    profile = profile_of("position", "sog_cog", "heading", "yaw_rate")
    (log,) = convert([path], None, tmp_path / "logs").logs
    # cdeg of the course of a velocity: 0.01 deg at 2 m/s is 3e-4 m/s
    same(log, profile, direct(tmp_path, profile, Voyage()))
    text = draft(path)
    drafted = profiles.parse(text, "draft")
    assert [one.name for one in drafted.actuators] == ["thruster_left", "thruster_right"]
    assert drafted.sensors.position.topic == "/gnss/fix"
    assert "actuators.thruster_left.position_m" in unchecked_lines(text)


@needed
def test_a_first_frame_of_mavlink_1_hides_no_mavlink_2(tmp_path):
    station = Station()
    station.take("HEARTBEAT", 0, 6, 8, 0, 0, 3, at=START, sender=(255, 190), version=1)
    station.log += circle().log
    found, _ = read(station, tmp_path)
    assert len(found["/gyro"].time) == 601


@needed
def test_a_payload_that_was_cut_at_zeros_is_filled_up(tmp_path):
    station = Station()
    station.take("ATTITUDE", 1000, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, at=START, signed=True)
    found, _ = read(station, tmp_path)
    assert found["/gyro"].columns["yaw_rate_degps"].tolist() == [0.0]
    assert found["/gyro"].columns["heading_deg"][0] == pytest.approx(28.6479, abs=1e-4)


@needed
def test_times_are_the_vehicles_and_not_those_of_the_bursts(tmp_path):
    found, _ = read(circle(), tmp_path)
    v = Voyage()
    assert (np.abs(found["/gyro"].time - v.ns) <= 1000).all()
    assert (np.abs(found["/thruster/left"].time - v.ns) <= 1000).all()


@needed
def test_the_ground_stations_own_clock_is_not_the_vehicles(tmp_path):
    """255 sends SYSTEM_TIME, too; the vehicle's is 0 until its receiver knows the time."""
    station = Station()
    for i in range(20):
        at = START + i
        station.take("SYSTEM_TIME", round((at + 3600) * 1e6), 5_000_000, at=at, sender=(255, 190))
        station.take("SYSTEM_TIME", 0 if i < 5 else round(at * 1e6), 1000 * i, at=at + 0.4)
        station.take("ATTITUDE", 1000 * i, 0.0, 0.0, 0.5, 0.0, 0.0, 0.01, at=at + 0.4)
    found, _ = read(station, tmp_path)
    assert found["/gyro"].time[0] == round(START * 1e9)


@needed
def test_pulses_go_on_when_their_counter_wraps(tmp_path):
    """time_usec of SERVO_OUTPUT_RAW is uint32: 4294.967296 s."""
    station = Station()
    for i in range(40):
        boot = 4_293_000_000 + 100_000 * i
        station.take("ATTITUDE", boot // 1000, 0.0, 0.0, 0.5, 0.0, 0.0, 0.01, at=START + i / 10)
        station.take("SYSTEM_TIME", round((START + i / 10) * 1e6), boot // 1000, at=START + i / 10)
        station.take("SERVO_OUTPUT_RAW", boot % 2**32, 1500 + i, *(0,) * 7, 0, *(0,) * 8,
                     at=START + i / 10)  # fmt: skip
    found, _ = read(station, tmp_path)
    pulses = found["/servo/output_1"]
    assert (np.abs(np.diff(pulses.time) - 100_000_000) < 1000).all()
    assert abs(pulses.time[0] - round(START * 1e9)) < 2_000_000


@needed
def test_a_vehicle_that_was_started_again_has_two_clocks(tmp_path):
    station = Station()
    for i in range(40):
        boot = 500_000 + 100 * i if i < 20 else 4_000 + 100 * i
        at = START + i / 10 + (60 if i >= 20 else 0)
        station.take("SYSTEM_TIME", round(at * 1e6), boot, at=at)
        station.take("ATTITUDE", boot, 0.0, 0.0, 0.5, 0.0, 0.0, 0.01, at=at)
    found, _ = read(station, tmp_path)
    steps = np.diff(found["/gyro"].time)
    assert steps.max() == 60_100_000_000 and np.median(steps) == 100_000_000


@needed
def test_messages_of_two_links_count_once(tmp_path):
    single, _ = read(circle(), tmp_path)
    double, said = read(circle(links=(1, 2)), tmp_path)
    assert len(double["/gyro"].time) == len(single["/gyro"].time)
    assert any(one.kind == "duplicate" for one in said)


@needed
def test_another_vehicle_stays_apart(tmp_path):
    station = circle()
    for i in range(30):
        station.take("ATTITUDE", 1000 * i, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, at=START + 70 + i,
                     sender=(7, 1))  # fmt: skip
    found, said = read(station, tmp_path)
    assert len(found["/gyro"].time) == 601 and len(found["/vehicle_7/gyro"].time) == 30
    assert any("/vehicle_7" in one.sentence for one in said)


@needed
def test_what_is_none_is_blank(tmp_path):
    station = Station()
    for i, (fix, vel, cog, yaw) in enumerate(
        ((1, 100, 9000, 0), (3, 65535, 65535, 65535), (3, 200, 9000, 36000), (3, 200, 9000, 4500))
    ):
        station.take("GPS_RAW_INT", round((START + i) * 1e6), 560_000_000, 120_000_000, 0, 100,
                     65535, vel, cog, fix, 9, 0, 0, 0, 0, 0, yaw, at=START + i)  # fmt: skip
    found, _ = read(station, tmp_path)
    nan = np.nan
    assert found["/gnss/fix"].time.tolist() == [round((START + i) * 1e9) for i in range(4)]
    for topic, column, wanted in (
        ("/gnss/fix", "latitude", [nan, 56.0, 56.0, 56.0]),
        ("/gnss/velocity", "sog_mps", [nan, nan, 2.0, 2.0]),
        ("/gnss/velocity", "cog_deg", [nan, nan, 90.0, 90.0]),
        ("/gnss/heading", "heading_deg", [nan, nan, 0.0, 45.0]),
    ):
        np.testing.assert_array_equal(found[topic].columns[column], wanted)


@needed
def test_without_attitude_the_heading_is_that_of_the_position_message(tmp_path):
    """GLOBAL_POSITION_INT: cm/s to north and east, 0.01 deg, 65535 for none."""
    station = Station()
    for i, heading in enumerate((22547, 65535, 0)):
        boot = 1000 * i
        station.take("SYSTEM_TIME", round((START + i) * 1e6), boot, at=START + i)
        station.take("GLOBAL_POSITION_INT", boot, 483_861_418, 100_000_000, 0, 0, 123, -45, 0,
                     heading, at=START + i)  # fmt: skip
    found, _ = read(station, tmp_path)
    np.testing.assert_array_equal(found["/gyro"].columns["heading_deg"], [225.47, np.nan, 0.0])
    assert found["/ekf/velocity"].columns["east_mps"].tolist() == [-0.45] * 3
    assert found["/ekf/position"].columns["latitude"].tolist() == [48.3861418] * 3


@needed
def test_what_has_no_time_of_its_own_has_that_of_reception(tmp_path):
    """WIND, of which the lowest two bits of the stamp are the number of the link."""
    station = circle()
    station.take("WIND", 270.0, 5.0, 0.0, at=START + 7.25, links=(3,))
    found, _ = read(station, tmp_path)
    wind = found["/wind/true_north"]
    assert wind.time.tolist() == [round((START + 7.25) * 1e6) * 1000]
    assert wind.columns["direction_deg"].tolist() == [270.0]


@needed
def test_damage_and_a_cut_end_cost_their_frames_only(tmp_path):
    log = bytearray(circle().log)
    middle = len(log) // 2
    log[middle : middle + 40] = b"\x55" * 40
    path = tmp_path / "hole.tlog"
    path.write_bytes(log[:-7])
    found = read_telemetry(path)
    gyro = next(one for one in found.series if one.topic == "/gyro")
    assert 598 <= len(gyro.time) <= 601
    assert any("cuts off a frame" in what for what in found.lost)


@needed
def test_a_log_of_no_vehicle_says_what_to_stream(tmp_path):
    station = Station()
    for i in range(5):
        station.take("HEARTBEAT", 0, 6, 8, 0, 0, 3, at=START + i, sender=(255, 190))
    with pytest.raises(ChannelMissing, match="5 frames"):
        read(station, tmp_path)


def test_without_pymavlink_the_extra_is_named(tmp_path, monkeypatch):
    """And every other format is read as before: nothing imports it until such a file comes."""
    path = tmp_path / "trip.tlog"
    path.write_bytes(circle().log)
    real = builtins.__import__

    def without(name, *rest, **more):
        if name.startswith("pymavlink"):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return real(name, *rest, **more)

    monkeypatch.setattr("importlib.import_module", without)
    assert formats.recognise(path).name == "MAVLink telemetry logs"
    (why,) = convert([path], None, tmp_path / "logs").refused.values()
    assert "trip.tlog is a MAVLink telemetry log, and pymavlink" in why
    assert "pip install 'shiplog[ardupilot]'" in why
