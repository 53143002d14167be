"""NMEA sentences and ROS bags, each written by hand, converted and equal to the same voyage."""

import errno
import re
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from circle_layouts import (
    COMMON,
    DATUM,
    RATE,
    SENSORS,
    SPEED,
    START,
    Voyage,
    converted,
    direct,
    iso,
    profile_of,
    same,
)

from shiplog.commands.convert import convert
from shiplog.logs.reading.read import read
from shiplog.machine import files
from shiplog.ship_profile import file as profiles


def sentence(body: str) -> str:
    return f"${body}*{reduce(xor, body.encode()):02X}"


def degrees_minutes(value: float, width: int) -> str:
    whole = int(abs(value))
    return f"{whole:0{width}d}{(abs(value) - whole) * 60:010.7f}"


def nmea(v: Voyage, i: int) -> list[str]:
    """One burst of a bridge's instruments; GGA, which has no date, before RMC, which has."""
    when = iso(v.unix[i], "%H%M%S")[:9]
    where = (
        f"{degrees_minutes(v.latitude[i], 2)},N,{degrees_minutes(v.longitude[i], 3)},E"
    )  # fmt: skip
    speed, day = SPEED * 3600 / 1852, iso(v.unix[i], "%d%m%y")[:6]
    return [
        sentence(f"GPGGA,{when},{where},4,12,0.7,3.0,M,40.0,M,,"),
        sentence(f"HEHDT,{v.heading_deg[i]:.4f},T"),
        sentence(f"GPRMC,{when},A,{where},{speed:.5f},{v.course_deg[i]:.4f},{day},,,A"),
        sentence(f"TIROT,{np.degrees(RATE) * 60:.4f},A"),
        sentence(f"WIMWV,{v.wind_angle[i]:.3f},R,{v.wind_speed[i]:.4f},M,A"),
        sentence(f"ERRPM,S,1,{v.rps[i] * 60:.3f},,A"),
        sentence(f"AGRSA,{v.rudder[i]:.4f},A,,"),
    ]


NMEA = (*COMMON, "wind")


def nmea_profile():
    gyro = SENSORS["yaw_rate"].replace('"/gyro"', '"/gyro/rate"')
    text = '[ship]\nname = "c"\nlength_m = 20.0\n' + "".join(SENSORS[p] for p in NMEA[:3]) + gyro
    return profiles.parse(text + "".join(SENSORS[p] for p in NMEA[3:]) + DATUM, "test")


def nmea_known(folder: Path, profile, v: Voyage) -> pl.DataFrame:
    """NMEA's two sentences are two topics; the voyage is the same."""
    merged = profile_of(*NMEA[:3], "yaw_rate", *NMEA[3:])
    return direct(folder, merged, v).select(pl.col(["time", *profile.columns, "quality"]))


def test_3_nmea_of_a_multiplexer_with_receive_stamps(tmp_path):
    """Unix milliseconds and N before each sentence: the log of a Signal K server.

    Its clock is 2 s late against GNSS; headings keep step with positions all the same.
    """
    v = Voyage()
    lines = [
        f"{round((v.unix[i] + 2.0) * 1000)};N;{line}"
        for i in range(len(v.t)) for line in nmea(v, i)
    ]  # fmt: skip
    (tmp_path / "mux.log").write_text("\n".join(lines) + "\n")
    (path,) = converted(tmp_path, tmp_path / "mux.log", None)
    profile = nmea_profile()
    same(path, profile, nmea_known(tmp_path, profile, v))


def test_4_nmea_as_a_receiver_sends_it(tmp_path):
    """No stamp but RMC's and GGA's own: a serial line recorded as it is, with a midnight in it."""
    v = Voyage(start=START + 12 * 3600 - 30)
    lines = [line for i in range(len(v.t)) for line in nmea(v, i)]
    (tmp_path / "line.nmea").write_text("\r\n".join(lines) + "\r\n")
    (path,) = converted(tmp_path, tmp_path / "line.nmea", None)
    profile = nmea_profile()
    same(path, profile, nmea_known(tmp_path, profile, v))


ROS_PROFILE = """[ship]
name = "usv"
length_m = 20.0
[sensors.position]
kind = "geodetic"
topic = "/gnss/fix"
fields = ["latitude", "longitude"]
unit = "deg"
[sensors.velocity]
kind = "enu"
topic = "/gnss/vel"
fields = ["twist.linear.x", "twist.linear.y"]
unit = "m/s"
[sensors.heading]
kind = "quaternion_enu"
topic = "/imu/data"
fields = ["orientation.z", "orientation.w"]
[sensors.yaw_rate]
topic = "/imu/data"
field = "angular_velocity.z"
unit = "rad/s"
sign = -1.0
"""


def ros_bag(v: Voyage, writer, store) -> None:
    """NavSatFix, TwistStamped and Imu, east-north-up as REP 103 says."""
    types = store.types
    stamped = "seq" in {name for name, _ in store.fielddefs["std_msgs/msg/Header"][1]}
    topics = {
        "/gnss/fix": "sensor_msgs/msg/NavSatFix",
        "/gnss/vel": "geometry_msgs/msg/TwistStamped",
        "/imu/data": "sensor_msgs/msg/Imu",
    }
    with writer:
        lines = {
            t: writer.add_connection(t, kind, typestore=store) for t, kind in topics.items()
        }  # fmt: skip
        vector = types["geometry_msgs/msg/Vector3"]
        north, east = v.velocity
        for i, ns in enumerate(v.ns.tolist()):
            stamp = types["builtin_interfaces/msg/Time"](ns // 10**9, ns % 10**9)
            arguments = (i, stamp, "gnss") if stamped else (stamp, "gnss")
            header = types["std_msgs/msg/Header"](*arguments)
            yaw = np.pi / 2 - v.heading[i]
            status = types["sensor_msgs/msg/NavSatStatus"](0, 1)
            fix = types["sensor_msgs/msg/NavSatFix"](
                header, status, v.latitude[i], v.longitude[i], 0.0, np.zeros(9), 0
            )
            twist = types["geometry_msgs/msg/Twist"](
                vector(east[i], north[i], 0.0), vector(0, 0, 0)
            )
            turned = types["geometry_msgs/msg/Quaternion"](
                0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)
            )
            imu = types["sensor_msgs/msg/Imu"](
                header, turned, np.zeros(9), vector(0.0, 0.0, -RATE), np.zeros(9),
                vector(0.0, 0.0, 9.8), np.zeros(9),
            )  # fmt: skip
            output = (fix, types["geometry_msgs/msg/TwistStamped"](header, twist), imu)
            for (topic, kind), message in zip(topics.items(), output, strict=True):
                ros1 = not hasattr(writer, "metapath")
                encode = store.serialize_ros1 if ros1 else store.serialize_cdr
                writer.write(lines[topic], ns, encode(message, kind))


def ros2_bag(source: Path, v: Voyage) -> Path:
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    writer = Writer(source, version=8, storage_plugin=StoragePlugin.SQLITE3)
    ros_bag(v, writer, get_typestore(Stores.ROS2_HUMBLE))
    return source


def ros_known(folder: Path, v: Voyage) -> pl.DataFrame:
    merged = profile_of("position", "sog_cog", "heading", "yaw_rate")
    return direct(folder, merged, v)


def ros1_bag(source: Path, v: Voyage) -> Path:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    ros_bag(v, Writer(source), get_typestore(Stores.ROS1_NOETIC))
    return source


@pytest.mark.parametrize("generation", [1, 2])
def test_5_and_6_ros_bags_of_a_usv(tmp_path, generation):
    """ROS 1 .bag and ROS 2 .db3 of unmanned boats (Heron, WAM-V, Otter): a topic an instrument."""
    v = Voyage()
    source = ros1_bag(tmp_path / "usv.bag", v) if generation == 1 else ros2_bag(tmp_path / "u", v)
    (path,) = converted(tmp_path, source, None)
    assert read(path).frames["/imu/data"]["log_time"].to_list() == v.ns.tolist()
    profile = profiles.parse(ROS_PROFILE + DATUM, "usv")
    same(path, profile, ros_known(tmp_path, v))


def test_the_files_of_a_bag_are_one_log(tmp_path):
    source = ros2_bag(tmp_path / "usv", Voyage())
    (first,) = source.glob("*.db3")
    (source / "usv_1.db3").write_bytes(first.read_bytes())  # as a bag that was split has them
    done = convert([*sorted(source.glob("*.db3")), source], None, tmp_path)
    assert done.logs == [tmp_path / "usv.mcap"] and not done.refused and not done.lost


def test_a_full_disk_is_no_fault_of_the_bag(tmp_path, monkeypatch):
    source = ros2_bag(tmp_path / "usv", Voyage())

    def refuse(_path):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files, "flush", refuse)
    (why,) = convert([source], None, tmp_path).refused.values()
    assert "usv.mcap: No space left on device" in why and "ROS bag" not in why


def found_in(data: bytes, text: bytes) -> list[int]:
    return [match.start() for match in re.finditer(re.escape(text), data)]


def damaged(path: Path, at: int, put: bytes) -> None:
    data = bytearray(path.read_bytes())
    data[at : at + len(put)] = put
    path.write_bytes(data)


def lost_of(folder: Path, source: Path) -> tuple[Path, str]:
    """The log of a damaged bag, and what is missing in it."""
    done = convert([source], None, folder)
    assert not done.refused
    (path,), (lost,) = done.logs, done.lost.values()
    return path, lost


@pytest.mark.parametrize("generation", [1, 2])
def test_a_damaged_bag_keeps_what_was_read_before_the_damage(tmp_path, generation):
    v = Voyage()
    if generation == 1:
        file = source = ros1_bag(tmp_path / "usv.bag", v)
        begins = found_in(file.read_bytes(), b"op=\x02")  # of messages
        place = begins[len(begins) * 2 // 3]
    else:
        source = ros2_bag(tmp_path / "usv", v)
        (file,) = source.glob("*.db3")
        begins = found_in(file.read_bytes(), b"\0\1\0\0")  # of messages in CDR
        place = begins[len(begins) * 2 // 3] - 24  # where the row says what it holds
    damaged(file, place, bytes(64))
    path, lost = lost_of(tmp_path, source)
    assert "the bag is damaged there (" in lost and "copy the original again" in lost
    frames = read(path).frames
    count = sum(frame.height for frame in frames.values())
    assert f"what comes after {count} messages" in lost and count > 100
    for frame in frames.values():
        times = frame["log_time"].to_list()
        assert times == v.ns.tolist()[: len(times)]


def test_a_bag_that_is_damaged_at_its_beginning_is_refused_as_one(tmp_path):
    source = ros2_bag(tmp_path / "usv", Voyage())
    (file,) = source.glob("*.db3")
    damaged(file, 4096, bytes(file.stat().st_size - 4096))
    (why,) = convert([source], None, tmp_path).refused.values()
    assert "usv cannot be read as a ROS bag" in why and "fault of the program" not in why
    assert not list(tmp_path.glob("*.mcap"))


def test_a_message_that_does_not_fit_its_definition_costs_no_other(tmp_path):
    v = Voyage()
    source = ros1_bag(tmp_path / "usv.bag", v)
    text = b"\4\0\0\0gnss"  # of a header, with its length
    places = found_in(source.read_bytes(), text)
    for place in places[300:303]:
        damaged(source, place, b"\xff\xff\xff\x7f")
    path, lost = lost_of(tmp_path, source)
    assert lost.count("1 of its messages do not fit their definition") == 3
    assert {frame.height for frame in read(path).frames.values()} == {len(v.ns) - 1}
