"""Tables that people's data come in, each converted and equal to the same voyage in MCAP.

The voyage is in closed form: a circle at constant speed. Each layout is written here by hand, in
the words and units of where it occurs, and knows nothing of what `convert` writes.
"""

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from circle_layouts import (
    COMMON,
    DATUM,
    RATE,
    SPEED,
    Voyage,
    converted,
    direct,
    iso,
    profile_of,
    same,
)

from shiplog.commands.convert import convert
from shiplog.logs.reading.read import contents, read
from shiplog.ship_profile import file as profiles

STEPS = np.arange(20.0)


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
    profile = profile_of(*COMMON, table=table)
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
    profile = profile_of(*COMMON, table=table)
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


def tables_of_topics(folder, **columns):
    """A table a topic, 10 Hz: name → its columns next to the stamps."""
    folder.mkdir()
    (folder / "._gyro.csv").write_bytes(b"\0\5\x16\7")  # as macOS leaves it on a memory stick
    stamp = 1_700_000_000_000_000_000 + 100_000_000 * np.arange(20)
    for name, values in columns.items():
        pl.DataFrame({"stamp_ns": stamp, **values}).write_csv(folder / f"{name}.csv")
    return folder


def test_topics_whose_names_are_alike_in_protobuf_keep_their_columns(tmp_path):
    names = {"方位": {"heading": STEPS}, "速度": {"sog": 2.0 * STEPS}, "風速": {"sog": 3.0 * STEPS}}
    done = convert([tables_of_topics(tmp_path / "trip", **names)], None, tmp_path / "out")
    assert not done.refused and not done.lost
    frames = read(done.logs[0]).frames
    assert frames["/方位"]["heading"].to_list() == STEPS.tolist()
    assert frames["/速度"]["sog"].to_list() == (2.0 * STEPS).tolist()
    assert frames["/風速"]["sog"].to_list() == (3.0 * STEPS).tolist()


def test_a_column_called_as_the_messages_own_time_is_a_field_all_the_same(tmp_path):
    """A device's own counter next to the recorder's stamp."""
    columns = {"timestamp": STEPS, "heading": 2.0 * STEPS}
    done = convert([tables_of_topics(tmp_path / "trip", gyro=columns)], None, tmp_path / "out")
    assert not done.refused
    frame = read(done.logs[0]).frames["/gyro"]
    assert frame["timestamp_2"].to_list() == STEPS.tolist()
    assert frame["stamp"].diff().drop_nulls().unique().to_list() == [100_000_000]


@pytest.mark.parametrize("way", [".", "..", "../trip.1"])
def test_a_folder_gives_its_log_its_name_whatever_the_way_to_it(tmp_path, monkeypatch, way):
    folder = tables_of_topics(tmp_path / "trip.1", gyro={"heading": STEPS})
    (folder / "inside").mkdir()
    monkeypatch.chdir(folder / "inside" if way == ".." else folder)
    assert convert([Path(way)], None, tmp_path / "out").logs == [tmp_path / "out" / "trip.1.mcap"]
