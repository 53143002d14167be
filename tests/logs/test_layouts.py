"""Ten layouts that people's data come in, each converted and equal to the same voyage in MCAP.

The voyage is in closed form: a circle at constant speed. Each layout is written here by hand, in
the words and units of where it occurs, and knows nothing of what `convert` writes.
"""

import json
from datetime import UTC, datetime
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from pipelines.convert import convert
from shiplog import profile_file as profiles
from shiplog.logs.read import contents, read
from shiplog.logs.write import Series, write_log
from shiplog.voyages.ingest import ingest

START = 1_617_969_600.0  # 2021-04-09 12:00:00 UTC
SPEED, RATE, RADIUS_M = 2.0, 0.02, 100.0  # m/s, rad/s: half a circle and more in 200 s
SECONDS, HZ = 60.0, 10.0
LATITUDE, LONGITUDE = 56.04, 12.65  # of the circle's centre
M_PER_LATITUDE = 111_350.0  # any smooth map to degrees will do: all layouts hold the same degrees
M_PER_LONGITUDE = 62_300.0


class Voyage:
    """The circle at 10 Hz, drifting by 0.1 rad: heading and course differ."""

    def __init__(self, hz: float = HZ, start: float = START) -> None:
        self.t = np.arange(round(SECONDS * hz) + 1) / hz
        self.unix = start + self.t
        self.ns = np.round(self.t * 1e9).astype(np.int64) + int(start) * 1_000_000_000
        self.course = (5.6 + RATE * self.t) % (2 * np.pi)  # rad, passes north after 34 s
        self.heading = (self.course - 0.1) % (2 * np.pi)
        self.north = RADIUS_M * np.sin(self.course)
        self.east = -RADIUS_M * np.cos(self.course)
        self.latitude = LATITUDE + self.north / M_PER_LATITUDE
        self.longitude = LONGITUDE + self.east / M_PER_LONGITUDE
        self.rudder = 10.0 * np.sin(0.1 * self.t)  # deg
        self.rps = 8.0 + 0.5 * np.sin(0.05 * self.t)
        self.wind_speed = 5.0 + np.sin(0.03 * self.t)  # m/s
        self.wind_angle = (40.0 + 10 * np.sin(0.04 * self.t)) % 360  # deg, from the bow

    @property
    def course_deg(self):
        return np.degrees(self.course)

    @property
    def heading_deg(self):
        return np.degrees(self.heading)

    @property
    def velocity(self):
        """North and east, m/s."""
        return SPEED * np.cos(self.course), SPEED * np.sin(self.course)


SENSORS = {
    "position": """[sensors.position]
kind = "geodetic"
topic = "/gnss/fix"
fields = ["latitude", "longitude"]
unit = "deg"
""",
    "local": """[sensors.position]
kind = "local"
topic = "/ship/state"
fields = ["x0_m", "y0_m"]
unit = "m"
""",
    "sog_cog": """[sensors.velocity]
topic = "/gnss/velocity"
fields = ["sog_mps", "cog_deg"]
units = ["m/s", "deg"]
""",
    "ned": """[sensors.velocity]
kind = "ned"
topic = "/gnss/ned"
fields = ["north", "east"]
unit = "m/s"
""",
    "body": """[sensors.velocity]
kind = "body"
topic = "/ship/state"
fields = ["surge_mps", "sway_mps"]
unit = "m/s"
""",
    "heading": """[sensors.heading]
topic = "/gyro"
field = "heading_deg"
unit = "deg"
""",
    "yaw_rate": """[sensors.yaw_rate]
topic = "/gyro"
field = "yaw_rate_degps"
unit = "deg/s"
""",
    "wind": """[sensors.wind]
topic = "/wind/apparent"
fields = ["speed_mps", "direction_deg"]
units = ["m/s", "deg"]
""",
    "rudder": """[[actuators]]
name = "rudder"
kind = "rudder"
topic = "/rudder/main"
field = "angle_deg"
unit = "deg"
""",
    "propeller": """[[actuators]]
name = "propeller"
kind = "propeller"
topic = "/propeller/shaft_1"
field = "speed_rps"
unit = "rps"
""",
}  # fmt: skip
DATUM = f"[site]\ndatum = [{LATITUDE}, {LONGITUDE}]\n"
USUAL = ("position", "sog_cog", "heading", "rudder", "propeller")


def profile_of(*parts: str, table: str = ""):
    text = '[ship]\nname = "circle"\nlength_m = 20.0\n' + "".join(SENSORS[p] for p in parts)
    return profiles.parse(text + DATUM + ("[table]\n" + table if table else ""), "test")


def direct(folder: Path, profile, voyage: Voyage, extra: dict | None = None) -> pl.DataFrame:
    """The same voyage written topic by topic with the log writer, and ingested."""
    v = voyage
    north, east = v.velocity
    drift = v.course - v.heading
    state = {
        "x0_m": v.north, "y0_m": v.east,
        "surge_mps": SPEED * np.cos(drift), "sway_mps": SPEED * np.sin(drift),
    }  # fmt: skip
    everything = {
        "/gnss/fix": ("foxglove.LocationFix", {"latitude": v.latitude, "longitude": v.longitude}),
        "/gnss/velocity": (
            "shiplog.GnssVelocity",
            {"sog_mps": np.full(len(v.t), SPEED), "cog_deg": v.course_deg},
        ),
        "/gnss/ned": ("test.Ned", {"north": north, "east": east}),
        "/ship/state": ("shiplog.ShipState", state),
        "/gyro": (
            "shiplog.Gyro",
            {"heading_deg": v.heading_deg, "yaw_rate_degps": np.full(len(v.t), np.degrees(RATE))},
        ),
        "/wind/apparent": (
            "shiplog.Wind", {"speed_mps": v.wind_speed, "direction_deg": v.wind_angle},
        ),
        "/rudder/main": ("shiplog.Rudder", {"angle_deg": v.rudder}),
        "/propeller/shaft_1": ("shiplog.Propeller", {"speed_rps": v.rps}),
    }  # fmt: skip
    wanted = profile.wanted()
    write_log(
        folder / "direct.mcap",
        [Series(t, schema, v.ns, c) for t, (schema, c) in everything.items() if t in wanted],
        ship="circle",
    )
    return ingest(folder / "direct.mcap", profile).table


TOLERANCE = {  # what the layouts' own decimals allow, all below a sensor's noise
    "x0": 0.02, "y0": 0.02, "surge": 2e-3, "sway": 2e-3, "heading": 2e-5, "yaw_rate": 2e-4,
    "rudder": 2e-4, "propeller": 2e-3, "wind_speed": 2e-3, "wind_angle": 2e-3,
}  # fmt: skip


def same(converted: Path, profile, known: pl.DataFrame, relative_time: bool = False) -> None:
    """Every value of every channel, at the same time; angles modulo 2π."""
    found = ingest(converted, profile).table
    if relative_time:
        found = found.with_columns(pl.col("time") - found["time"][0] + known["time"][0])
    assert found.height == known.height
    apart = (found["time"] - known["time"]).dt.total_nanoseconds().abs().max()
    assert apart < 1_000_000  # ms, which some layouts round to
    for name in profile.columns:
        ours, theirs = found[name].to_numpy(), known[name].to_numpy()
        assert np.isfinite(theirs).sum() > 0.9 * len(theirs)
        assert (np.isfinite(ours) == np.isfinite(theirs)).all(), name
        off = ours - theirs
        if name in ("heading", "wind_angle"):
            off = np.angle(np.exp(1j * off))
        assert np.nanmax(np.abs(off)) < TOLERANCE[name], name


def converted(folder: Path, source: Path, profile) -> list[Path]:
    done = convert([source], profile, folder / "logs")
    assert not done.refused and not done.lost, (done.refused, done.lost)
    return done.logs


def iso(unix: float, form: str = "%Y-%m-%dT%H:%M:%S") -> str:
    whole = datetime.fromtimestamp(round(unix * 1000) / 1000, UTC)
    return whole.strftime(form) + f".{round(unix * 1000) % 1000:03d}"


def test_1_csv_of_a_gnss_receiver(tmp_path):
    """ISO times, degrees, knots: GNSS compasses and receivers (u-center, Emlid, Septentrio)."""
    v = Voyage()
    lines = ["time,lat,lon,SOG [kn],COG [deg],heading [deg],rudder [deg],rpm"]
    for i in range(len(v.t)):
        lines.append(
            f"{iso(v.unix[i])}Z,{v.latitude[i]:.9f},{v.longitude[i]:.9f},"
            f"{SPEED * 3600 / 1852:.6f},{v.course_deg[i]:.5f},{v.heading_deg[i]:.5f},"
            f"{v.rudder[i]:.4f},{v.rps[i] * 60:.4f}"
        )
    (tmp_path / "rover.csv").write_text("\n".join(lines))
    table = """time = { channel = "time" }
lat = { channel = "latitude", unit = "deg" }
lon = { channel = "longitude", unit = "deg" }
"SOG [kn]" = { channel = "sog", unit = "kn" }
"COG [deg]" = { channel = "cog", unit = "deg" }
"heading [deg]" = { channel = "heading", unit = "deg" }
"rudder [deg]" = { channel = "rudder", unit = "deg" }
rpm = { channel = "propeller", unit = "rpm" }
"""
    profile = profile_of(*USUAL, table=table)
    (path,) = converted(tmp_path, tmp_path / "rover.csv", profile)
    same(path, profile, direct(tmp_path, profile, v))


def test_2_table_of_a_towing_tank(tmp_path):
    """Semicolons, decimal commas, a preamble, a row of units, Latin-1, seconds from the start:
    free-running model tests of European tanks."""
    v = Voyage()
    lines = ["Versuch 12; Rundlauf", "Modell: M1; Maßstab 1:20", ""]
    lines += ["Zeit;X;Y;u;v;Kurs;r;Ruder;n", "s;m;m;m/s;m/s;°;°/s;°;1/s"]
    drift = v.course - v.heading
    columns = (
        v.t, v.north, v.east, SPEED * np.cos(drift), SPEED * np.sin(drift), v.heading_deg,
        np.full(len(v.t), np.degrees(RATE)), v.rudder, v.rps,
    )  # fmt: skip
    for row in zip(*columns, strict=True):
        lines.append(";".join(f"{value:.5f}".replace(".", ",") for value in row))
    (tmp_path / "V12.asc").write_text("\r\n".join(lines), encoding="latin-1", newline="")
    table = """Zeit = { channel = "time", unit = "s" }
X = { channel = "x0", unit = "m" }
Y = { channel = "y0", unit = "m" }
u = { channel = "surge", unit = "m/s" }
v = { channel = "sway", unit = "m/s" }
Kurs = { channel = "heading", unit = "deg" }
r = { channel = "yaw_rate", unit = "deg/s" }
Ruder = { channel = "rudder", unit = "deg" }
n = { channel = "propeller", unit = "rps" }
"""
    profile = profile_of("local", "body", "heading", "yaw_rate", "rudder", "propeller", table=table)
    (path,) = converted(tmp_path, tmp_path / "V12.asc", profile)
    same(path, profile, direct(tmp_path, profile, v), relative_time=True)


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


NMEA = (*USUAL, "wind")


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


def ros_known(folder: Path, v: Voyage) -> pl.DataFrame:
    merged = profile_of("position", "sog_cog", "heading", "yaw_rate")
    return direct(folder, merged, v)


@pytest.mark.parametrize("generation", [1, 2])
def test_5_and_6_ros_bags_of_a_usv(tmp_path, generation):
    """ROS 1 .bag and ROS 2 .db3 of unmanned boats (Heron, WAM-V, Otter): a topic an instrument."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    v = Voyage()
    if generation == 1:
        source = tmp_path / "usv.bag"
        ros_bag(v, Writer1(source), get_typestore(Stores.ROS1_NOETIC))
    else:
        source = tmp_path / "usv"
        writer = Writer2(source, version=8, storage_plugin=StoragePlugin.SQLITE3)
        ros_bag(v, writer, get_typestore(Stores.ROS2_HUMBLE))
    (path,) = converted(tmp_path, source, None)
    assert read(path).frames["/imu/data"]["log_time"].to_list() == v.ns.tolist()
    profile = profiles.parse(ROS_PROFILE + DATUM, "usv")
    same(path, profile, ros_known(tmp_path, v))


PX4 = """[ship]
name = "circle"
length_m = 20.0
[table]
timestamp = { channel = "time", unit = "us" }
[sensors.position]
kind = "geodetic"
topic = "/log_7_vehicle_gps_position_0"
fields = ["latitude_deg", "longitude_deg"]
unit = "deg"
[sensors.velocity]
kind = "ned"
topic = "/log_7_vehicle_gps_position_0"
fields = ["vel_n_m_s", "vel_e_m_s"]
unit = "m/s"
[sensors.heading]
topic = "/log_7_vehicle_local_position_0"
field = "heading"
unit = "rad"
[sensors.yaw_rate]
topic = "/log_7_vehicle_angular_velocity_0"
field = "xyz_2_"
unit = "rad/s"
[[actuators]]
name = "rudder"
kind = "rudder"
topic = "/log_7_actuator_outputs_0"
field = "output_0_"
unit = "deg"
offset = 1500.0
sign = 0.1
"""


def test_7_csv_a_topic_of_an_autopilot(tmp_path):
    """One CSV a topic, microseconds since the start of the autopilot, servo pulses: what ulog2csv
    makes of the logs of PX4 boats."""
    v = Voyage()
    folder = tmp_path / "flight"
    folder.mkdir()
    us = [112_574_307 + ns // 1000 for ns in (v.ns - v.ns[0]).tolist()]
    north, east = v.velocity
    none, pulses = np.zeros(len(v.t)), 1500.0 + 10.0 * v.rudder
    heading = np.arctan2(np.sin(v.heading), np.cos(v.heading))
    tables = {
        "vehicle_gps_position": {
            "time_utc_usec": v.ns // 1000, "latitude_deg": v.latitude,
            "longitude_deg": v.longitude, "vel_n_m_s": north, "vel_e_m_s": east,
        },
        "vehicle_local_position": {"x": v.north, "y": v.east, "heading": heading},
        "vehicle_angular_velocity": {
            "xyz[0]": none, "xyz[1]": none, "xyz[2]": np.full(len(v.t), RATE),
        },
        "actuator_outputs": {"noutputs": none + 2, "output[0]": pulses, "output[1]": none},
    }  # fmt: skip
    for name, columns in tables.items():
        frame = pl.DataFrame({"timestamp": us, **columns})
        frame.write_csv(folder / f"log_7_{name}_0.csv")
    profile = profiles.parse(PX4 + DATUM, "px4")
    (path,) = converted(tmp_path, folder, profile)
    known = direct(tmp_path, profile_of("position", "ned", "heading", "yaw_rate", "rudder"), v)
    same(path, profile, known, relative_time=True)


def test_8_ais_table_with_mmsi(tmp_path):
    """One CSV of many ships, local date form, tenths of knots: archives of AIS authorities."""
    v = Voyage(hz=0.5)
    other = 219_000_001
    lines = ["# Timestamp,MMSI,Latitude,Longitude,SOG,COG,Heading"]
    for i in range(len(v.t)):
        when = iso(v.unix[i], "%d/%m/%Y %H:%M:%S")[:-4]
        lines.append(
            f"{when},265000002,{v.latitude[i]:.7f},{v.longitude[i]:.7f},"
            f"{SPEED * 3600 / 1852:.6f},{v.course_deg[i]:.4f},{v.heading_deg[i]:.4f}"
        )
        lines.append(f"{when},{other},55.1,12.1,0.0,0.0,511")
    (tmp_path / "ais.csv").write_text("\n".join(lines))
    table = """Timestamp = { channel = "time", format = "%d/%m/%Y %H:%M:%S" }
MMSI = { channel = "vessel", only = 265000002 }
Latitude = { channel = "latitude", unit = "deg" }
Longitude = { channel = "longitude", unit = "deg" }
SOG = { channel = "sog", unit = "kn" }
COG = { channel = "cog", unit = "deg" }
Heading = { channel = "heading", unit = "deg" }
"""
    profile = profile_of("position", "sog_cog", "heading", table=table)
    (path,) = converted(tmp_path, tmp_path / "ais.csv", profile)
    same(path, profile, direct(tmp_path, profile, v))


def test_9_parquet_with_datetimes_and_two_voyages(tmp_path):
    """A pandas or Polars export of a fleet's data base: a Datetime column and a voyage's name."""
    v = Voyage()
    north, east = v.velocity
    frame = pl.DataFrame(
        {
            "datetime": pl.Series(v.ns // 1000).cast(pl.Datetime("us")),
            "voyage": ["out/1"] * len(v.t), "lat": v.latitude, "lon": v.longitude,
            "v_north": north, "v_east": east, "heading": v.heading, "yaw_rate": [RATE] * len(v.t),
            "rudder": np.radians(v.rudder), "prop": v.rps,
        }
    )  # fmt: skip
    later = frame.with_columns(pl.col("datetime") + pl.duration(days=1), voyage=pl.lit("home"))
    pl.concat([later, frame]).write_parquet(tmp_path / "fleet.parquet")
    table = """datetime = "time"
voyage = "voyage"
lat = { channel = "latitude", unit = "deg" }
lon = { channel = "longitude", unit = "deg" }
v_north = "velocity_north"
v_east = "velocity_east"
heading = "heading"
yaw_rate = "yaw_rate"
rudder = "rudder"
prop = "propeller"
"""
    parts = ("position", "ned", "heading", "yaw_rate", "rudder", "propeller")
    profile = profile_of(*parts, table=table)
    paths = {p.stem: p for p in converted(tmp_path, tmp_path / "fleet.parquet", profile)}
    assert set(paths) == {"out_1", "home"}
    same(paths["out_1"], profile, direct(tmp_path, profile, v))


def test_10_logger_with_date_and_time_apart_and_gnss_slower_than_the_rest(tmp_path):
    """Tabs, two columns of time, blanks where the GNSS has no new fix: data loggers on board
    (LabVIEW, Campbell, DEWESoft exports)."""
    v = Voyage()
    lines = ["Date\tTime\tLat\tLon\tSpeed\tCourse\tGyro\tRudder\tShaft rpm"]
    for i in range(len(v.t)):
        fix = i % 5 == 0
        gnss = (v.latitude[i], v.longitude[i], SPEED * 3.6, v.course_deg[i])
        displayed = [f"{value:.9f}" if fix else "" for value in gnss]
        lines.append(
            "\t".join(
                ["09.04.2021", iso(v.unix[i], "%H:%M:%S"), *displayed, f"{v.heading_deg[i]:.5f}",
                 f"{v.rudder[i]:.5f}", f"{v.rps[i] * 60:.5f}"]
            )
        )  # fmt: skip
    (tmp_path / "daq.txt").write_text("\n".join(lines))
    table = """Date = "date"
Time = "time"
Lat = { channel = "latitude", unit = "deg" }
Lon = { channel = "longitude", unit = "deg" }
Speed = { channel = "sog", unit = "km/h" }
Course = { channel = "cog", unit = "deg" }
Gyro = { channel = "heading", unit = "deg" }
Rudder = { channel = "rudder", unit = "deg" }
"Shaft rpm" = { channel = "propeller", unit = "rpm" }
"""
    profile = profile_of(*USUAL, table=table)
    (path,) = converted(tmp_path, tmp_path / "daq.txt", profile)
    same(path, profile, direct(tmp_path, profile, v))
    topics = contents(path).topics
    assert topics["/gnss/fix"].messages == 121 and topics["/gyro"].messages == 601


def test_a_converted_log_says_in_json_what_became_of_it(tmp_path):
    from commands import call

    (tmp_path / "empty.csv").write_text("a,b\n")
    code, output, _ = call("convert", tmp_path / "empty.csv", "--out", tmp_path, "--json", "-")
    assert code == 1
    assert list(json.loads(output)["refused"]) == [str(tmp_path / "empty.csv")]
