"""ArduPilot DataFlash logs: what a reader of them must do right, one fact a test.

The bytes are made by the documented layout (`made_dataflash`).
"""

import struct

import numpy as np
import pytest
from circle_layouts import RATE, START, Voyage, direct, profile_of, same
from made_dataflash import (
    FORMATS,
    circle,
    fmt,
    gps_time,
    header,
    left_us,
    record,
    right_us,
)

from shiplog.commands.convert import convert, draft
from shiplog.commands.prepare import check_logs, expand, ingest_logs
from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion import formats
from shiplog.logs.conversion.boot_clock import utc_of_gps
from shiplog.logs.conversion.dataflash import read_dataflash
from shiplog.logs.conversion.dataflash_records import read_records
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.unchecked_lines import unchecked_lines
from shiplog.voyages.ingest.ingest import ingest
from shiplog.voyages.store.store import Store


@pytest.fixture
def trip(tmp_path):
    path = tmp_path / "trip.BIN"
    path.write_bytes(circle())
    return path


def topics(data: bytes, tmp_path) -> dict:
    path = tmp_path / "log.bin"
    path.write_bytes(data)
    return {one.topic: one for one in read_dataflash(path).series}


def test_the_voyage_equals_that_in_mcap(tmp_path, trip):
    """Position to 1e-7 deg, angles to a float: every channel at every time."""
    (path,) = convert([trip], None, tmp_path / "logs").logs
    without = profile_of("position", "sog_cog", "heading", "wind")
    same(path, without, direct(tmp_path, without, Voyage()))


def test_a_draft_leaves_only_the_ship_and_the_places_of_its_thrusters(trip):
    text = draft(trip)
    assert "Drafted from trip.BIN" in text
    open_keys = {key for key in unchecked_lines(text) if key != "sensors.yaw_rate.topic"}
    assert open_keys == {  # a circle's yaw rate never changes, and the draft says so
        "ship.length_m", "actuators.thruster_left.position_m", "actuators.thruster_right.position_m"
    }  # fmt: skip
    drafted = profiles.parse(text, "draft")
    left, right = drafted.actuators
    assert (left.name, right.name) == ("thruster_left", "thruster_right")  # no gripper, no ghost
    assert (left.unit, left.offset, left.limits) == ("pwm", 1500.0, (1100.0, 1900.0))
    assert left.scale() == [(1500.0, pytest.approx(1 / 400))]
    assert right.scale() == [(1500.0, pytest.approx(-1 / 500))]  # 1000 to 2000 µs, reversed
    assert drafted.sensors.position.lever_arm_m == (0.3, -0.1)
    assert drafted.sensors.heading.topic == "/gyro"


def test_it_is_ingested_as_it_is(tmp_path, trip):
    (tmp_path / "boat.toml").write_text(draft(trip).replace("[0.3, -0.1]", "[0.0, 0.0]"))
    done = ingest_logs([trip], str(tmp_path / "boat.toml"), Store(tmp_path / "store"))
    (report,) = done.reports
    assert report.name == "trip" and done.complete
    table = ingest(
        convert([trip], None, tmp_path / "logs").logs[0],
        profiles.load(str(tmp_path / "boat.toml")),
    ).table
    v = Voyage()
    boat = table.filter(table["thruster_left"].is_finite())
    assert np.nanmax(np.abs(boat["yaw_rate"].to_numpy() - RATE)) < 1e-6
    inside = np.arange(10, 590)
    at = (table["time"].dt.epoch("ns").to_numpy() - v.ns[0]) / 1e9
    pulse = np.interp(at, v.t, left_us(v))
    ours = table["thruster_left"].to_numpy()
    assert np.nanmax(np.abs(ours[inside] - (pulse[inside] - 1500.0) / 400.0)) < 0.02


def test_check_reads_the_recorders_own_file_and_a_folder_stands_for_each(tmp_path, trip):
    (tmp_path / "second.bin").write_bytes(circle())
    (tmp_path / "notes.txt").write_text("sunny")
    assert [path.name for path in expand([tmp_path])] == ["second.bin", "trip.BIN"]
    done = check_logs([tmp_path])
    assert [report.name for report in done.reports] == ["second", "trip"] and done.complete
    logs = convert([tmp_path], None, tmp_path / "logs").logs
    assert [path.name for path in logs] == ["second.mcap", "trip.mcap"]


def test_it_is_known_by_its_content(tmp_path):
    (tmp_path / "no_ending").write_bytes(circle())
    assert formats.recognise(tmp_path / "no_ending").name == "ArduPilot DataFlash logs"


def test_pymavlink_reads_the_same_numbers(trip):
    """An independent reader of the same bytes, in its own units."""
    reader = pytest.importorskip("pymavlink.DFReader", reason="shiplog[ardupilot]")
    log = reader.DFReader_binary(str(trip))
    theirs: dict[str, list] = {"GPS": [], "ATT": [], "IMU": [], "RCOU": [], "GPA": []}
    while (message := log.recv_match(type=list(theirs))) is not None:
        theirs[message.get_type()].append(message)
    log.close()
    ours = read_records(trip, theirs)
    for name, label in (("GPS", "Lat"), ("GPS", "Alt"), ("ATT", "Yaw"), ("IMU", "GyrZ"),
                        ("RCOU", "C3"), ("GPA", "HAcc")):  # fmt: skip
        wanted = [getattr(message, label) for message in theirs[name]]
        assert ours.tables[name].number(label).tolist() == wanted, (name, label)


# --- frames -------------------------------------------------------------------------------------


def test_formats_come_before_use_and_may_be_repeated(tmp_path):
    data = header(("ATT",))
    data += record("ATT", 1_000_000, 0, 0, 0, 0, 0, 10.0, 3)
    data += fmt(FORMATS["ATT"][0], "ATT", *FORMATS["ATT"][1:3])  # again
    data += record("ATT", 2_000_000, 0, 0, 0, 0, 0, 20.0, 3)
    found = topics(data, tmp_path)["/gyro"]
    assert found.columns["heading_deg"].tolist() == [10.0, 20.0]


def test_a_head_inside_of_a_record_is_none(tmp_path):
    """A3 95 and the number of a kind, in the middle of a float and of a text."""
    inside = struct.unpack("<f", b"\xa3\x95\x88\x42")[0]
    data = header(("ATT", "MSG"))
    for i in range(50):
        data += record("MSG", 900_000 + i, "\xa3" if i % 2 else "x")
        data += record("ATT", 1_000_000 + i, inside, 0, 0, 0, 0, float(i), 3)
    assert topics(data, tmp_path)["/gyro"].columns["heading_deg"].tolist() == list(range(50))


def test_blocks_of_any_length_hold_the_same_records(tmp_path, trip, monkeypatch):
    from shiplog.logs.conversion import dataflash_records as reader

    whole = read_records(trip, ("GPS", "ATT", "RCOU"))
    for size in (211, 4096):
        monkeypatch.setattr(reader, "BLOCK_BYTES", size)
        parts = read_records(trip, ("GPS", "ATT", "RCOU"))
        assert parts.records == whole.records and parts.skipped == parts.cut == 0
        for name in ("GPS", "ATT", "RCOU"):
            assert (parts.tables[name].rows == whole.tables[name].rows).all()


# --- units and angles ---------------------------------------------------------------------------


def test_a_multiplier_is_of_the_raw_number_and_never_twice(tmp_path):
    """Letters c, C, e, E are hundredths already, L is 1e-7 deg; NTUN.Yaw is `H` with B: hundredths
    of a degree; GMS is ms with C; `-` is no multiplier."""
    (tmp_path / "u.bin").write_bytes(
        header(("GPS", "GPA", "NTUN", "RCOU"))
        + record("GPS", 1, 0, 3, 312_816_600, 2046, 9, 65, 422_923_858, -710_000_000, 1234, 0.5,
                 90.0, 0.0, 0.0, 1)
        + record("GPA", 1, 0, 1, 80, 1, 12, 0.0, 1, 208_734, 100, -2_147_483_648, 0, 0)
        + record("NTUN", 1, 0.0, 0.0, 0.0, 34_981, 0.0)
        + record("RCOU", 1, *range(1500, 1514))
    )  # fmt: skip
    found = read_records(tmp_path / "u.bin", ("GPS", "GPA", "NTUN", "RCOU"))
    gps = found.tables["GPS"]
    assert gps.number("Lat")[0] == 42.2923858 and gps.number("Lng")[0] == -71.0
    assert gps.number("Alt")[0] == 12.34 and gps.number("HDop")[0] == 0.65
    assert gps.number("GMS")[0] == 312_816.6 and gps.unit["GMS"] == "s"
    assert gps.number("Status")[0] == 3.0 and gps.number("GWk")[0] == 2046.0
    assert found.tables["GPA"].number("SAcc")[0] == 0.12
    assert found.tables["NTUN"].number("Yaw")[0] == 349.81
    assert found.tables["NTUN"].unit["Yaw"] == "deg"
    assert (
        found.tables["RCOU"].number("C2")[0] == 1501.0 and found.tables["RCOU"].unit["C1"] == "us"
    )


def test_headings_are_of_ATT_and_yaw_rate_of_the_gyro(tmp_path):
    """ATT.Yaw in deg, 0 to 360, in 0.01 deg before 4.6; IMU.GyrZ in rad/s, z downwards."""
    old = FORMATS | {"ATT": (136, "QccccCC", "TimeUS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw",
                             "sddddhh", "FBBBBBB")}  # fmt: skip
    data = header(("ATT", "IMU"), old)
    data += record("ATT", 5, 0, 0, 0, 0, 0, 34_981, formats=old)
    data += record("IMU", 5, 0, 0.0, 0.0, 0.02, 0.0, 0.0, -9.8, formats=old)
    found = topics(data, tmp_path)
    assert found["/gyro"].columns["heading_deg"].tolist() == [349.81]
    rate = found["/gyro/rate"].columns["yaw_rate_degps"][0]
    assert rate == pytest.approx(np.degrees(0.02), rel=1e-7)


# --- stamps -------------------------------------------------------------------------------------


def test_times_are_those_of_measurement(trip):
    """Fixes by week and ms; all others by the median of UTC - GPA.SMS, and not by when records
    were written, 0.15 s and more later."""
    found = {one.topic: one for one in read_dataflash(trip).series}
    v = Voyage()
    fix = found["/gnss/fix"]
    valid = np.isfinite(fix.columns["latitude"])
    assert (fix.time[valid] == v.ns).all()
    assert np.abs(found["/gyro"].time - v.ns).max() <= 1_000_000


def test_without_GPA_it_is_said_that_the_clock_may_be_late(tmp_path):
    data = header(("GPS", "ATT"))
    for i in range(21):
        at, (week, ms) = 1_000_000 + 200_000 * i, gps_time(START + 0.2 * i)
        late = 100_000 + (40_000 if i == 0 else 1000 * (i % 7))  # the first one is an outlier
        data += record("GPS", at + late, 0, 3, ms, week, 9, 65, 1, 1, 0, 1.0, 0.0, 0.0, 0.0, 1)
        data += record("ATT", at + late, 0, 0, 0, 0, 0, 1.0, 3)
    (tmp_path / "log.bin").write_bytes(data)
    found = read_dataflash(tmp_path / "log.bin")
    series = {one.topic: one for one in found.series}
    assert any("GPA" in one.sentence and "0.1 to 0.2 s" in one.sentence for one in found.findings)
    early = (series["/gyro"].time - series["/gnss/fix"].time)[1:]
    assert np.abs(early).max() <= 4_000_000  # the median, not the first


@pytest.mark.parametrize(("unix", "leap"), [(1_401_624_000, 16), (1_451_217_600, 17),
                                            (1_780_228_800, 18)])  # fmt: skip
def test_leap_seconds_are_those_of_the_date(unix, leap):
    """Noon of 2014-06-01, 2015-12-27 and 2026-05-31."""
    week, seconds = divmod(unix - 315_964_800 + leap, 604_800)
    (utc,) = utc_of_gps(np.array([week]), np.array([seconds * 1000]))
    assert utc == unix * 1_000_000_000


def test_a_log_without_gps_counts_from_1970(tmp_path):
    data = header(("ATT",)) + record("ATT", 8_900_000, 0, 0, 0, 0, 0, 1.0, 3)
    (tmp_path / "61.BIN").write_bytes(data)
    found = read_dataflash(tmp_path / "61.BIN")
    assert found.series[0].time.tolist() == [8_900_000_000]
    assert any("no UTC" in one.sentence for one in found.findings)


def test_logs_until_2014_count_ms_and_name_outputs_Ch(tmp_path):
    old = {
        "ATT": (
            136,
            "IccccCCHH",
            "TimeMS,DesRoll,Roll,DesPitch,Pitch,DesYaw,Yaw,ErrRP,ErrYaw",
            "",
            "",
        ),
        "RCOU": (138, "Ihhhhhhhh", "TimeMS,Ch1,Ch2,Ch3,Ch4,Ch5,Ch6,Ch7,Ch8", "", ""),
    }
    data = header(("ATT", "RCOU"), old, described=False)
    for i in range(30):
        data += record("ATT", 1000 + 100 * i, 0, 0, 0, 0, 0, 9000, 0, 0, formats=old)
        data += record("RCOU", 1000 + 100 * i, 1500 + i, 1500, 0, 0, 0, 0, 0, 0, formats=old)
    found = topics(data, tmp_path)
    assert found["/gyro"].time[1] - found["/gyro"].time[0] == 100_000_000
    assert [name for name in found if name.startswith("/servo")] == ["/servo/output_1"]
    assert "CHECK" in found["/servo/output_1"].metadata["doubt"]


# --- blanks, order, several ---------------------------------------------------------------------


def test_what_is_no_measurement_is_blank(tmp_path):
    """A fix below 3D, the yaw of one antenna, an output that is off, a float that is NaN."""
    week, ms = gps_time(START)
    data = header(("GPS", "RCOU", "ATT", "PARM"))
    data += record("PARM", 0, "SERVO1_FUNCTION", 26.0, 0.0)
    data += record("GPS", 1000, 0, 2, ms, week, 4, 900, 560_000_000, 120_000_000, 0, 1.0, 5.0, 0.0,
                   0.0, 1)  # fmt: skip
    data += record("GPS", 201_000, 0, 3, ms + 200, week, 9, 65, 560_000_000, 120_000_000, 0, 1.0,
                   5.0, 0.0, 0.0, 1)  # fmt: skip
    data += record("RCOU", 1000, 0, *(1500,) * 13) + record("RCOU", 2000, 1600, *(1500,) * 13)
    data += record("ATT", 1000, 0, 0, 0, 0, 0, float("nan"), 3)
    found = topics(data, tmp_path)
    assert np.isnan(found["/gnss/fix"].columns["latitude"]).tolist() == [True, False]
    assert "/gnss/heading" not in found
    pulses = found["/rudder/steering"].columns["pulse_us"]
    assert np.isnan(pulses[0]) and pulses[1] == 1600.0
    assert np.isnan(found["/gyro"].columns["heading_deg"][0])


def test_threads_swap_records_and_times_are_sorted_stably(tmp_path):
    data = header(("ATT",))
    for at, yaw in ((3000, 3.0), (1000, 1.0), (2000, 2.0), (2000, 2.5)):
        data += record("ATT", at, 0, 0, 0, 0, 0, yaw, 3)
    found = topics(data, tmp_path)["/gyro"]
    assert found.columns["heading_deg"].tolist() == [1.0, 2.0, 2.5, 3.0]


def test_the_receiver_in_use_has_the_plain_name(tmp_path):
    """GPS.U says which; an instance field is marked # in FMTU; each stays by itself."""
    week, ms = gps_time(START)
    data = header(("GPS",))
    for i in range(5):
        for receiver, used in ((0, 0), (1, 1)):
            lat = 560_000_000 + 1000 * receiver
            data += record("GPS", 1000 + 200_000 * i, receiver, 3, ms + 200 * i, week, 9, 65, lat,
                           120_000_000, 0, 1.0, 5.0, 0.0, 45.0 * receiver, used)  # fmt: skip
    found = topics(data, tmp_path)
    assert found["/gnss/fix"].columns["latitude"].tolist() == [56.0001] * 5
    assert found["/gnss/fix"].metadata["sensor"] == "GPS 2"
    assert found["/gnss/fix/gps_1"].columns["latitude"].tolist() == [56.0] * 5
    assert found["/gnss/heading"].columns["heading_deg"].tolist() == [45.0] * 5


def test_until_4_0_the_second_receiver_and_imu_have_their_own_names(tmp_path):
    old = {
        "GPS": (134, "QBIHBcLLeffB", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,U",
                "", ""),
        "GPS2": (135, "QBIHBcLLeffB", "TimeUS,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,U",
                 "", ""),
        "IMU2": (137, "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "", ""),
        "IMU": (139, "Qffffff", "TimeUS,GyrX,GyrY,GyrZ,AccX,AccY,AccZ", "", ""),
    }  # fmt: skip
    week, ms = gps_time(START)
    data = header(tuple(old), old, described=False)
    for i in range(3):
        for name, lat in (("GPS", 1), ("GPS2", 2)):
            data += record(name, 1000 + 200_000 * i, 3, ms + 200 * i, week, 9, 65, lat * 10**7, 1,
                           0, 1.0, 5.0, int(name == "GPS"), formats=old)  # fmt: skip
        for name, z in (("IMU", 0.1), ("IMU2", 0.2)):
            data += record(name, 1000 * i, 0.0, 0.0, z, 0.0, 0.0, -9.8, formats=old)
    found = topics(data, tmp_path)
    assert found["/gnss/fix"].columns["latitude"][0] == 1.0
    assert found["/gnss/fix/gps_2"].columns["latitude"][0] == 2.0
    assert found["/gyro/rate/imu_2"].columns["yaw_rate_degps"][0] == pytest.approx(11.459, abs=1e-3)


def test_the_estimate_is_of_the_core_that_the_autopilot_steered_by(tmp_path):
    """XKF4.PI says which; the estimate ranks behind the receiver in a draft."""
    data = header(("XKF1", "XKF4"))
    for core in (0, 1):
        data += record("XKF1", 1000, core, 0, 0, 0, 1.0 + core, 2.0, *(0.0,) * 5, 0, 0, 0, 0)
    data += record("XKF4", 1000, 0, *(0,) * 5, *(0.0,) * 3, *(0,) * 4, 1)
    found = topics(data, tmp_path)
    assert found["/ekf/velocity"].columns["north_mps"].tolist() == [2.0]


# --- outputs ------------------------------------------------------------------------------------


def test_outputs_are_what_their_function_says(tmp_path):
    """26 and 70: a rudder and a propeller; motors 1 to 12; no ghost of an output with no function,
    with another, or of one that is off."""
    parameters = {"SERVO1_FUNCTION": 26, "SERVO3_FUNCTION": 70, "SERVO3_TRIM": 1100,
                  "SERVO3_MIN": 1100, "SERVO5_FUNCTION": 33, "SERVO6_FUNCTION": 85,
                  "SERVO7_FUNCTION": 0, "SERVO8_FUNCTION": 59, "SERVO9_FUNCTION": 34}  # fmt: skip
    data = header(("RCOU", "PARM"))
    data += b"".join(record("PARM", 0, k, float(v), 0.0) for k, v in parameters.items())
    for i in range(9):
        data += record("RCOU", 1000 * i, *(1500 + 10 * i,) * 8, *(0,) * 6)
    found = topics(data, tmp_path)
    assert set(found) == {
        "/rudder/steering", "/propeller/throttle", "/thruster/motor_1", "/thruster/motor_12"
    }  # fmt: skip
    throttle = found["/propeller/throttle"].metadata
    assert (throttle["offset"], throttle["sign"]) == ("1100", "0.5")  # one way: 1100 to 1900 µs
    assert "direction_deg" not in found["/thruster/motor_1"].metadata  # ArduPilot does not say


def test_right_pulses_are_kept_as_they_are(trip):
    found = {one.topic: one for one in read_dataflash(trip).series}
    v = Voyage()
    assert (found["/thruster/right"].columns["pulse_us"] == right_us(v)).all()
    assert abs(found["/thruster/right"].time[0] - v.ns[0]) <= 1_000_000


def test_what_a_log_lacks_is_said_with_what_to_record(tmp_path):
    """A receiver alone: it can be checked, and that is all."""
    week, ms = gps_time(START)
    data = header(("GPS",))
    for i in range(50):
        data += record("GPS", 200_000 * i, 0, 3, ms + 200 * i, week, 9, 65, 560_000_000 + 9 * i,
                       120_000_000, 0, 1.0, 5.0, 0.0, 0.0, 1)  # fmt: skip
    (tmp_path / "alone.BIN").write_bytes(data)
    done = check_logs([tmp_path / "alone.BIN"])
    said = {one.channel: one.sentence for one in done.reports[0].findings}
    assert done.complete and "no voyage made of it" in said["heading"] and "ATT" in said["heading"]
    assert "no model trained" in said["actuators"] and "SERVOn_FUNCTION" in said["actuators"]
    assert "No heading was recognised; a voyage needs it" in draft(tmp_path / "alone.BIN")


def test_a_heading_that_stands_still_is_not_drafted_before_a_real_one(tmp_path):
    """ATT without a compass, and a receiver with two antennas."""
    week, ms = gps_time(START)
    data = header(("GPS", "ATT"))
    for i in range(80):
        at = 200_000 * i
        data += record("GPS", at, 0, 3, ms + 200 * i, week, 9, 65, 560_000_000 + 90 * i,
                       120_000_000, 0, 1.0, 5.0, 0.0, 10.0 + 0.5 * i, 1)  # fmt: skip
        data += record("ATT", at, 0, 0, 0, 0, 0, 0.0, 3)
    (tmp_path / "two.BIN").write_bytes(data)
    text = draft(tmp_path / "two.BIN")
    assert 'topic = "/gnss/heading"' in text.split("[sensors.heading]")[1].split("#")[0]


def test_outputs_that_pass_the_sticks_through_are_named(tmp_path):
    data = header(("RCOU", "PARM", "ATT")) + record("PARM", 0, "SERVO1_FUNCTION", 1.0, 0.0)
    data += record("PARM", 0, "SERVO3_FUNCTION", 59.0, 0.0)
    data += record("ATT", 5, 0, 0, 0, 0, 0, 1.0, 3)
    data += b"".join(record("RCOU", 1000 * i, *(1500 + i,) * 14) for i in range(9))
    (tmp_path / "sticks.BIN").write_bytes(data)
    said = [one.sentence for one in read_dataflash(tmp_path / "sticks.BIN").findings]
    assert any("SERVO1_FUNCTION 1, SERVO3_FUNCTION 59" in one for one in said)


# --- damage -------------------------------------------------------------------------------------


def test_of_a_truncated_file_what_is_whole_is_read(tmp_path, trip):
    cut = tmp_path / "cut.BIN"
    cut.write_bytes(trip.read_bytes()[:-1000])
    done = check_logs([cut])
    (report,) = done.reports
    assert not done.complete  # exit 3
    assert any(f.kind == "truncated" and "cuts off a record" in f.sentence for f in report.findings)
    whole, (log,) = check_logs([trip]).reports[0], convert([cut], None, tmp_path / "logs").logs
    assert 0.9 * whole.messages_read < report.messages_read < whole.messages_read
    assert log.exists()


def test_damage_in_the_middle_costs_its_records_only(tmp_path, trip):
    raw = bytearray(trip.read_bytes())
    middle = len(raw) // 2
    raw[middle : middle + 300] = b"\x07" * 300
    (tmp_path / "hole.BIN").write_bytes(raw)
    whole, holed = (read_records(p, ("ATT",)) for p in (trip, tmp_path / "hole.BIN"))
    assert 300 <= holed.skipped < 600 and not holed.cut
    assert 0 < whole.records - holed.records < 20
    assert any("damaged" in what for what in read_dataflash(tmp_path / "hole.BIN").lost)


def test_a_damaged_format_of_units_costs_the_units(tmp_path):
    """A record's name for its field is one letter off."""
    raw = circle().replace(b"TimeUS,Id,Label", b"TimeUS,Id,Labxl", 1)
    (tmp_path / "units.BIN").write_bytes(raw)
    found = {one.topic: one for one in read_dataflash(tmp_path / "units.BIN").series}
    assert len(found["/gyro"].time) == 601


def test_a_card_filled_up_with_nothing_is_whole(tmp_path, trip):
    for filler in (b"\0", b"\xff"):
        (tmp_path / "filled.BIN").write_bytes(trip.read_bytes() + filler * 5000)
        assert not read_dataflash(tmp_path / "filled.BIN").lost


def test_a_log_of_nothing_says_what_to_record(tmp_path):
    (tmp_path / "empty.BIN").write_bytes(header(("MSG",)) + record("MSG", 1, "ArduRover V4.5"))
    with pytest.raises(ChannelMissing) as refused:
        read_dataflash(tmp_path / "empty.BIN")
    assert "LOG_BITMASK" in refused.value.hint and "1 record" not in refused.value.hint
