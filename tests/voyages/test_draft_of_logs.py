"""A draft of a log whose axes, units and topics are not ours: what is unsure says CHECK."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from shiplog.drafting import draft
from shiplog.exceptions import ChannelMissing
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import ingest

START_S = 1_700_000_000
TURN = math.radians(3.0)  # rad/s, the bow to starboard
SPEED, LEEWAY = 2.0, -0.3  # m/s, ahead and to starboard


def log_of(path: Path, topics: dict, seconds: float = 60.0, metadata: dict | None = None) -> Path:
    """A log of JSON at 10 Hz: topic → (schema, message as a function of the time in s)."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        opened = {
            topic: writer.register_channel(
                topic, "json", writer.register_schema(schema, "jsonschema", b"{}"), metadata or {}
            )
            for topic, (schema, _) in topics.items()
        }
        for i in range(round(10 * seconds)):
            stamp = START_S * 1_000_000_000 + 100_000_000 * i
            for topic, (_, message) in topics.items():
                content = json.dumps(message(i / 10)).encode()
                writer.add_message(opened[topic], stamp, content, stamp)
        writer.finish()
    return path


def section(text: str, name: str) -> str:
    return text.split(f"[{name}]")[1].split("\n\n")[0]


def heading(t: float) -> float:
    return 0.5 + TURN * t


def place(t: float) -> tuple[float, float]:
    """North and east of a ship that turns at an even rate, m."""
    north = (SPEED * np.sin(heading(t)) + LEEWAY * np.cos(heading(t))) / TURN
    east = (-SPEED * np.cos(heading(t)) + LEEWAY * np.sin(heading(t))) / TURN
    return float(north), float(east)


def orientation(t: float) -> dict:
    """From east towards north, as REP 103 has it."""
    yaw = math.pi / 2 - heading(t)
    return {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}


ROS = {
    "/odometry": ("nav_msgs/msg/Odometry", lambda t: {
        "pose": {"pose": {"position": {"x": place(t)[1], "y": place(t)[0], "z": 0.0}}},
        "twist": {"twist": {"linear": {"x": SPEED, "y": -LEEWAY, "z": 0.0}}}}),
    "/imu/data": ("sensor_msgs/msg/Imu", lambda t: {
        "orientation": orientation(t), "angular_velocity": {"x": 0.0, "y": 0.0, "z": -TURN}}),
}  # fmt: skip


def test_a_ros_log_is_not_mirrored(tmp_path):
    """REP 103: x to the east, y to the north or to port, z upwards."""
    path = log_of(tmp_path / "ros.mcap", ROS)
    text = draft(path)
    table = ingest(path, profiles.parse(text, "draft")).table[50:-50]
    assert table["yaw_rate"].to_numpy() == pytest.approx(TURN, abs=1e-6)
    assert np.diff(np.unwrap(table["heading"])) == pytest.approx(TURN / 10, abs=1e-6)
    assert table["surge"].to_numpy() == pytest.approx(SPEED)
    assert table["sway"].to_numpy() == pytest.approx(LEEWAY)
    along = np.diff(table["x0"]) * 10
    assert along[0] == pytest.approx(
        SPEED * math.cos(heading(5.05)) - LEEWAY * math.sin(heading(5.05)), abs=0.01
    )
    assert "sign = -1.0  # CHECK: ROS has z upwards" in section(text, "sensors.yaw_rate")
    assert "CHECK: ROS has y to port" in section(text, "sensors.velocity")
    assert "CHECK: north, east" in section(text, "sensors.position")


def test_a_topic_that_names_its_axes_keeps_them(tmp_path):
    """North-east-down has the signs of shiplog."""
    path = log_of(tmp_path / "ned.mcap", {
        "/ned/pose": ("geometry_msgs/msg/PoseStamped", lambda t: {
            "pose": {"position": {"x": 1.0, "y": 2.0}, "orientation": orientation(t)}}),
        "/ned/twist": ("geometry_msgs/msg/TwistStamped", lambda t: {
            "twist": {"linear": {"x": 1.0, "y": 2.0}, "angular": {"z": 0.1}}}),
    })  # fmt: skip
    drafted = profiles.parse(text := draft(path), "draft")
    assert drafted.sensors.position.fields == ("pose.position.x", "pose.position.y")
    assert drafted.sensors.kind("velocity") == "ned"
    assert drafted.sensors.kind("heading") == "quaternion_ned"
    assert dict(drafted.sensors.items())["yaw_rate"].scale() == [(0.0, 1.0)]
    for name in ("position", "heading", "yaw_rate"):
        assert "of the topic's name" in section(text, f"sensors.{name}")


PX4 = {
    "/fmu/local": ("px4_msgs/msg/VehicleLocalPosition", lambda t: {"x": t, "y": 0.0}),
    "/vehicle/twist": ("own/Motion", lambda t: {"surge": 1.0, "sway": 0.1}),
    "/compass": ("own/Compass", lambda t: {"heading": 10.0}),
}


def test_axes_that_are_not_of_ros_are_left(tmp_path):
    drafted = profiles.parse(draft(log_of(tmp_path / "a.mcap", PX4)), "draft")
    assert drafted.sensors.position.fields == ("x", "y")
    assert drafted.sensors.velocity.sign == 1.0


def test_a_description_and_a_text_drive_no_ship(tmp_path):
    """`esc` stands in "description", `prop` in "properties", and a thruster's mode is no thrust."""
    urdf = "<robot>" + "<link/>" * 100 + "</robot>"
    path = log_of(tmp_path / "urdf.mcap", PX4 | {
        "/robot_description": ("std_msgs/msg/String", lambda t: {"data": urdf}),
        "/motor/label": ("std_msgs/msg/String", lambda t: {"data": urdf}),
        "/hull/properties": ("own/Speed", lambda t: {"speed": 1.0}),
        "/thruster/mode": ("std_msgs/msg/Int8", lambda t: {"data": 1}),
        "/motor/running": ("std_msgs/msg/Bool", lambda t: {"data": True}),
        "/esc/left": ("std_msgs/msg/Float64", lambda t: {"data": 0.1}),
        "/portPropeller": ("own/Shaft", lambda t: {"rpm": 100.0}),
    })  # fmt: skip
    text = draft(path)
    drafted = profiles.parse(text, "draft")
    assert {(a.kind, a.topic, a.unit) for a in drafted.actuators} == {
        ("propeller", "/portPropeller", "rpm"), ("thruster", "/esc/left", "1"),
    }  # fmt: skip
    assert "<link/>" * 10 not in text
    assert (ingest(path, drafted).report.usable_s or 0) > 50


def test_a_list_of_numbers_is_no_number(tmp_path):
    """ROS's JointState has its positions in a list: a profile names one of them."""
    path = log_of(tmp_path / "joints.mcap", PX4 | {
        "/rudder/joints": ("sensor_msgs/msg/JointState", lambda t: {"position": [0.1, 0.2]}),
        "/rudder/main": ("own/Rudder", lambda t: {"angle_deg": 5.0}),
    })  # fmt: skip
    text = draft(path)
    drafted = profiles.parse(text, "draft")
    assert [a.topic for a in drafted.actuators] == ["/rudder/main"]
    listed = text.replace('"/rudder/main"', '"/rudder/joints"').replace("angle_deg", "position")
    with pytest.raises(ChannelMissing, match=r"'position' .* holds List\(Float64\), not one"):
        ingest(path, profiles.parse(listed, "own"))
    second = profiles.parse(listed.replace('field = "position"', 'field = "position[1]"'), "own")
    assert ingest(path, second).table["rudder_main"][0] == pytest.approx(math.radians(0.2))


def test_an_order_is_drafted_where_what_measures_holds_nothing(tmp_path):
    path = log_of(tmp_path / "o.mcap", PX4 | {
        "/rudder/feedback": ("own/Rudder", lambda t: {"angle_deg": None}),
        "/rudder/command": ("own/Rudder", lambda t: {"angle_deg": 5.0}),
    })  # fmt: skip
    drafted = profiles.parse(draft(path), "draft")
    assert [a.topic for a in drafted.actuators] == ["/rudder/command"]


def test_an_instrument_that_is_not_needed_is_left_out_where_it_is_blank(tmp_path):
    path = log_of(tmp_path / "b.mcap", PX4 | {"/gyro": ("own", lambda t: {"rot": None})})
    assert profiles.parse(draft(path), "draft").sensors.yaw_rate is None


def test_true_wind_is_not_apparent(tmp_path):
    blows = ("own/Wind", lambda t: {"speed_mps": 5.0, "direction_deg": 200.0})
    assert "No wind was recognised" in draft(
        log_of(tmp_path / "true.mcap", PX4 | {"/wind/true": blows})
    )
    unsaid = draft(log_of(tmp_path / "wind.mcap", PX4 | {"/wind": blows}))
    assert "CHECK: apparent wind, or true?" in section(unsaid, "sensors.wind")
    both = draft(log_of(tmp_path / "both.mcap", PX4 | {"/wind/true": blows, "/wind/rel": blows}))
    assert 'topic = "/wind/rel"  # 10 Hz' in section(both, "sensors.wind")


def test_coordinates_of_a_receiver_are_degrees(tmp_path):
    path = log_of(tmp_path / "px4.mcap", PX4 | {
        "/gps": ("own/Gps", lambda t: {"lat": 473977418 + round(10 * t), "lon": 85455939}),
    })  # fmt: skip
    text = draft(path)
    assert "CHECK: taken as 1e-7 deg" in section(text, "sensors.position")
    voyage = ingest(path, profiles.parse(text, "draft"))
    assert voyage.datum == pytest.approx((47.3977418, 8.5455939))


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ({"lat": 4807.038, "lon": 1131.0}, "ddmm.mm"),
        ({"lat": 91.0, "lon": 181.0}, "not available"),
        ({"lat": 5_312_345.5, "lon": 512_345.5}, "these are no degrees"),
    ],
)
def test_coordinates_beyond_the_pole_are_to_be_checked(tmp_path, place, words):
    path = log_of(tmp_path / "a.mcap", PX4 | {"/gps": ("own/Gps", lambda t: place)})
    assert words in section(draft(path), "sensors.position")


def test_a_heading_that_ais_has_not_is_to_be_checked(tmp_path):
    here = {"/compass": ("ais", lambda t: {"heading": 511.0 if t > 10 else 12.0})}
    text = draft(log_of(tmp_path / "a.mcap", PX4 | here))
    assert 'CHECK: 511 is AIS\'s "not available"' in section(text, "sensors.heading")


@pytest.mark.parametrize(("written", "unit"), [("degrees", "deg"), ("knots, degrees", "deg"),
                                               ("rad", "rad"), ("mV", "deg")])  # fmt: skip
def test_the_unit_of_a_channel_is_one_that_a_profile_takes(tmp_path, written, unit):
    """A sensor's metadata are for people; they count for one field, in a unit of its kind."""
    topics = PX4 | {"/gps": ("own", lambda t: {"sog": 1.0, "cog": 2.0})}
    path = log_of(tmp_path / "a.mcap", topics, metadata={"unit": written})
    drafted = profiles.parse(draft(path), "draft")
    assert drafted.sensors.heading.unit == unit
    assert drafted.sensors.velocity.units == ("m/s", "deg")


def test_a_field_in_the_unit_of_something_else_is_passed_over(tmp_path):
    """An engine's `speed_rpm` is no speed over ground, whatever else stands beside it."""
    path = log_of(tmp_path / "a.mcap", PX4 | {
        "/gps/state": ("own", lambda t: {"speed_rpm": 90.0, "speed_kn": 3.0, "course_deg": 9.0}),
    })  # fmt: skip
    drafted = profiles.parse(draft(path), "draft")
    assert drafted.sensors.velocity.fields == ("speed_kn", "course_deg")
    assert drafted.sensors.velocity.units == ("kn", "deg")
