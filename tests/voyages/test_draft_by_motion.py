"""What a draft finds in the data: units, signs, accuracies, neutral pulses, what lives."""

import json
import math
import re

import numpy as np
import polars as pl
import pytest
from mcap.writer import Writer

from shiplog.commands.convert import convert, draft
from shiplog.drafting import draft as draft_log
from shiplog.drafting import draft_table
from shiplog.exceptions import ShiplogError
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import ingest

START_NS = 1_700_000_000_000_000_000
T = np.arange(0.0, 400.0, 0.5)
METRE = 111_320.0


def sailed(t=T, speed=2.0, middle=190.0, swing=120.0):
    """A ship whose heading swings: north and east [m] by the trapezoidal rule, of a fine grid."""
    fine = np.arange(0.0, t[-1] + 0.02, 0.01)
    psi = np.radians(middle + swing * np.sin(2.0 * np.pi * fine / 130.0))
    along = speed * (1.0 + 0.2 * np.sin(2.0 * np.pi * fine / 90.0))
    north, east = (
        np.concatenate(([0.0], np.cumsum(v[1:] + v[:-1]) * 0.005))
        for v in (along * np.cos(psi), along * np.sin(psi))
    )
    rate = np.gradient(psi, fine)
    found = {"psi": psi, "u": along, "north": north, "east": east, "rate": rate}
    return {name: np.interp(t, fine, values) for name, values in found.items()}


SHIP = sailed()
NOISE = np.random.default_rng(7)


def table(**columns):
    lat = 54.0 + SHIP["north"] / METRE
    lon = 10.0 + SHIP["east"] / METRE / math.cos(math.radians(54.0))
    course = np.degrees(SHIP["psi"]) % 360.0
    whole = {"time": START_NS // 10**9 + T, "lat": lat, "lon": lon}
    whole |= {"sog": SHIP["u"], "cog": course, "heading": course}
    return pl.DataFrame(whole | columns)


def drafted(tmp_path, **columns):
    """The draft's lines in [table] by column, and the profile that they make."""
    path = tmp_path / "t.parquet"
    table(**columns).write_parquet(path)
    text = draft_table(path)
    found = dict(re.findall(r'^"(.*?)" = (\{.*)$', text, re.MULTILINE))
    return found, profiles.parse(text, "draft"), text


def log_of(path, topics, every=0.5):
    """JSON messages: topic → columns [n], or (times [n] s, columns)."""
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        for topic, content in topics.items():
            times, columns = content if isinstance(content, tuple) else (None, content)
            schema = writer.register_schema("own", "jsonschema", b"{}")
            channel = writer.register_channel(topic, "json", schema)
            for i in range(len(next(iter(columns.values())))):
                at = START_NS + round(1e9 * (every * i if times is None else times[i]))
                message = {name: float(values[i]) for name, values in columns.items()}
                writer.add_message(channel, at, json.dumps(message).encode(), at)
        writer.finish()
    return path


def topics(**changed):
    frame = table()
    whole = {
        "/gnss/fix": {"lat": frame["lat"], "lon": frame["lon"]},
        "/gnss/vel": {"sog": frame["sog"], "cog": frame["cog"]},
        "/compass": {"heading": frame["heading"]},
    }
    return whole | changed


@pytest.mark.parametrize(
    ("unit", "factor"), [("m/s", 1.0), ("kn", 1852 / 3600), ("km/h", 1 / 3.6), ("cm/s", 0.01)]
)
def test_a_speed_has_the_unit_in_which_the_position_changes(tmp_path, unit, factor):
    line, profile, _ = drafted(tmp_path, sog=SHIP["u"] / factor)
    assert profile.table["sog"].unit == unit
    assert "CHECK" in line["sog"] and "how fast the position changes" in line["sog"]
    path = log_of(tmp_path / "a.mcap", topics(**{
        "/gnss/vel": {"sog": SHIP["u"] / factor, "cog": table()["cog"]}}))  # fmt: skip
    assert profiles.parse(draft_log(path), "d").sensors.velocity.units == (unit, "deg")


def test_a_stated_unit_stays_and_is_to_be_checked_where_the_position_says_another(tmp_path):
    line, profile, _ = drafted(tmp_path, sog_kn=SHIP["u"], sog=np.full(len(T), np.nan))
    assert profile.table["sog_kn"].unit == "kn"
    assert "CHECK" in line["sog_kn"] and "as if it were in m/s" in line["sog_kn"]
    line, profile, _ = drafted(tmp_path, sog_mps=SHIP["u"], sog=np.full(len(T), np.nan))
    assert "CHECK" not in line["sog_mps"]


DEG, RAD, CDEG = ("deg", 180.0 / math.pi, 1.0), ("rad", 1.0, 1.0), ("deg", 18_000.0 / math.pi, 0.01)


@pytest.mark.parametrize(
    ("middle", "swing", "unit", "factor", "sign"),
    [(190.0, 120.0, *DEG), (40.0, 15.0, *DEG), (40.0, 15.0, *RAD), (350.0, 60.0, *RAD),
     (350.0, 60.0, *CDEG), (190.0, 120.0, *CDEG)],
)  # fmt: skip
def test_an_angle_has_the_unit_in_which_it_points_along_the_way(
    tmp_path, middle, swing, unit, factor, sign
):
    ship = sailed(middle=middle, swing=swing)
    lat = 54.0 + ship["north"] / METRE
    lon = 10.0 + ship["east"] / METRE / math.cos(math.radians(54.0))
    angle = (ship["psi"] % (2.0 * math.pi)) * factor
    columns = {"lat": lat, "lon": lon, "sog": ship["u"], "cog": angle, "hdg": angle}
    _, profile, _ = drafted(tmp_path, **columns, heading=np.full(len(T), np.nan))
    for name in ("cog", "hdg"):
        assert (profile.table[name].unit, profile.table[name].sign) == (unit, sign)
    path = log_of(tmp_path / "a.mcap", {
        "/gnss/fix": {"lat": lat, "lon": lon}, "/gnss/vel": {"sog": ship["u"], "cog": angle},
        "/compass": {"hdg": angle}})  # fmt: skip
    sensors = profiles.parse(draft_log(path), "draft").sensors
    assert sensors.heading.unit == unit and sensors.heading.sign == sign
    voyage = ingest(path, profiles.parse(draft_log(path), "draft"))
    assert np.abs(voyage.table["sway"].to_numpy()[20:-20]).max() < 0.05


@pytest.mark.parametrize(
    ("unit", "factor", "sign"),
    [("rad/s", 1.0, 1.0), ("rad/s", 1.0, -1.0), ("deg/s", 180 / math.pi, 1.0),
     ("deg/min", 10_800 / math.pi, -1.0)],
)  # fmt: skip
def test_a_rate_has_the_unit_and_the_sign_of_the_turn(tmp_path, unit, factor, sign):
    rate = sign * SHIP["rate"] * factor + NOISE.normal(0.0, 1e-3 * factor, len(T))
    line, profile, _ = drafted(tmp_path, yaw_rate=rate)
    assert (profile.table["yaw_rate"].unit, profile.table["yaw_rate"].sign) == (unit, sign)
    assert ("turned round" in line["yaw_rate"]) == (sign < 0.0)
    path = log_of(tmp_path / "a.mcap", topics(**{"/gyro": {"rot": rate}}))
    sensor = profiles.parse(draft_log(path), "draft").sensors.yaw_rate
    assert sensor.unit == unit and sensor.sign == (sign if sign < 0.0 else 1.0)
    table = ingest(path, profiles.parse(draft_log(path), "draft")).table[20:-20]
    turned = np.gradient(np.unwrap(table["heading"].to_numpy()), 0.1)
    assert table["yaw_rate"].to_numpy() == pytest.approx(turned, abs=0.02)


def test_accuracy_and_resolution_are_drafted_with_how_they_were_found(tmp_path):
    noisy = (np.degrees(SHIP["psi"]) + NOISE.normal(0.0, 0.5, len(T))) % 360.0
    coarse = np.round(SHIP["u"] / 0.1) * 0.1
    _, profile, text = drafted(tmp_path, heading=noisy, sog=coarse)
    sensors = profile.sensors
    assert sensors.heading.sigma == pytest.approx(0.5, rel=0.15)
    assert sensors.velocity.resolution == pytest.approx(0.1)
    assert sensors.velocity.sigma == pytest.approx(0.1 / math.sqrt(12.0), rel=0.2)
    assert "estimated from the record" in text
    path = log_of(tmp_path / "a.mcap", topics(**{"/compass": {"heading": np.round(noisy)}}))
    heading = profiles.parse(draft_log(path), "draft").sensors.heading
    assert heading.resolution == pytest.approx(1.0, rel=1e-3)
    assert heading.sigma == pytest.approx(math.hypot(0.5, 1.0 / math.sqrt(12.0)), rel=0.2)


NEEDED = {
    "rudder": ("position_m", "area_m2", "span_m"),
    "propeller": ("position_m", "diameter_m"),
    "thruster": ("position_m", "diameter_m", "direction_deg"),
}


@pytest.mark.parametrize("kind", NEEDED)
def test_what_a_model_needs_stands_in_the_draft_of_a_log_too(tmp_path, kind):
    field = {"rudder": "angle_deg", "propeller": "speed_rps", "thruster": "command"}[kind]
    path = log_of(tmp_path / "a.mcap", topics(**{f"/{kind}/x": {field: np.sin(T / 9.0)}}))
    _, _, of_table = drafted(tmp_path, **{f"{kind}_port": np.sin(T / 9.0)})
    for text in (draft_log(path), of_table):
        part = text.split("[[actuators]]")[1]
        for key in NEEDED[kind]:
            assert re.search(rf"^(# )?{key} = .*CHECK", part, re.MULTILINE), (kind, key)
        for key in ("length_m", "breadth_m", "draught_m", "mass_kg"):
            assert re.search(rf"^(# )?{key} = .*CHECK", text, re.MULTILINE), key
    assert "ship.length_m" in profiles.parse(draft_log(path), "d").unchecked


def test_an_order_that_is_sent_when_it_changes_is_held(tmp_path):
    at = np.cumsum(NOISE.exponential(8.0, 60))
    order = np.arange(60.0) % 7.0 - 3.0
    ordered, real = (at, {"angle_deg": order}), {"angle_deg": np.sin(T)}
    both = topics(**{"/rudder/order": ordered, "/rudder/real": real})
    path = log_of(tmp_path / "a.mcap", both)
    (rudder,) = profiles.parse(draft_log(path), "draft").actuators
    assert (rudder.topic, rudder.between) == ("/rudder/real", "line")
    path = log_of(tmp_path / "b.mcap", topics(**{"/rudder/order": (at, {"angle_deg": order})}))
    (rudder,) = profiles.parse(draft_log(path), "draft").actuators
    assert (rudder.topic, rudder.between) == ("/rudder/order", "hold")


@pytest.mark.parametrize(
    "dead",
    [
        {"heading": np.zeros(len(T))},
        {"yaw": np.full(3, 0.5)},
        (np.arange(8) * 45.0, {"heading": np.arange(8.0)}),
    ],
    ids=["all zero", "three messages", "seldom"],
)
def test_the_topic_that_lives_is_drafted(tmp_path, dead):
    path = log_of(tmp_path / "a.mcap", topics(**{"/a_gnss_heading": dead}))
    text = draft_log(path)
    assert profiles.parse(text, "draft").sensors.heading.topic == "/compass"
    assert "/a_gnss_heading" in text.split("[sensors.heading]")[1]


def test_a_column_that_lives_is_drafted_before_one_that_does_not(tmp_path):
    yaw = np.degrees(SHIP["psi"]) % 360.0
    nothing = {"heading": np.zeros(len(T)), "GPS.Yaw": np.zeros(len(T))}
    _, profile, _ = drafted(tmp_path, **nothing, **{"ATT.Yaw": yaw})
    taken = {column.channel: name for name, column in profile.table.items()}
    assert taken["heading"] == "ATT.Yaw"


@pytest.mark.parametrize(
    ("names", "kind"),
    [({"GPS.Lat": "lat", "GPS.Lng": "lon", "ATTITUDE.yaw": "psi"}, "sog_cog"),
     ({"GLOBAL_POSITION_INT.lat": "lat7", "GLOBAL_POSITION_INT.lon": "lon7",
       "GLOBAL_POSITION_INT.vx": "vn100", "GLOBAL_POSITION_INT.vy": "ve100",
       "GLOBAL_POSITION_INT.hdg": "cdeg"}, "ned"),
     ({"lat": "lat", "lon": "lon", "vel_n_m_s": "vn", "vel_e_m_s": "ve", "hdg": "deg"}, "ned")],
    ids=["ArduPilot", "MAVLink", "PX4"],
)  # fmt: skip
def test_names_of_flight_recorders_are_known(tmp_path, names, kind):
    frame = table()
    vn, ve = (SHIP["u"] * g(SHIP["psi"]) for g in (np.cos, np.sin))
    wrapped = np.degrees(SHIP["psi"]) % 360.0
    values = {
        "lat": frame["lat"], "lon": frame["lon"], "psi": np.radians(wrapped), "deg": wrapped,
        "lat7": (frame["lat"] * 1e7).round(), "lon7": (frame["lon"] * 1e7).round(),
        "vn": vn, "ve": ve, "vn100": np.round(vn * 100), "ve100": np.round(ve * 100),
        "cdeg": np.round(wrapped * 100),
    }  # fmt: skip
    columns = {"time": frame["time"], **{name: values[what] for name, what in names.items()}}
    if kind == "sog_cog":
        columns |= {"GPS.Spd": SHIP["u"], "GPS.GCrs": wrapped}
    path = tmp_path / "t.csv"
    pl.DataFrame(columns).write_csv(path)
    text = draft_table(path)
    profile = profiles.parse(text.replace("length_m = 1.0", "length_m = 2.0"), "draft")
    assert profile.sensors.kind("velocity") == kind
    (log,) = convert([path], profile, tmp_path / "logs").logs
    stored = ingest(log, profile).table[20:-20]
    assert stored["surge"].to_numpy().mean() == pytest.approx(2.0, abs=0.1)
    assert np.abs(stored["sway"].to_numpy()).max() < 0.1


def boat(gain, neutral, rng):
    """Two thrusters and what they do: u' = (p + s)/2 - u/5, r' = (p - s)/2 - r, by Euler."""
    step, count = 0.1, 6000
    p, s = (np.repeat(rng.choice([-0.5, 0.0, 0.0, 0.6], count // 60), 60) for _ in range(2))
    u, r, psi = np.zeros(count), np.zeros(count), np.zeros(count)
    for i in range(1, count):
        u[i] = u[i - 1] + step * ((p[i - 1] + s[i - 1]) / 2.0 - u[i - 1] / 5.0)
        r[i] = r[i - 1] + step * ((p[i - 1] - s[i - 1]) / 2.0 - r[i - 1])
        psi[i] = psi[i - 1] + step * r[i - 1]
    x, y = (np.cumsum(u * g(psi)) * step for g in (np.cos, np.sin))
    pulses = {"thr_left": neutral + gain[0] * 400.0 * p, "thr_right": neutral + gain[1] * 400.0 * s}
    return pl.DataFrame({
        "t_s": np.arange(count) * step, "x_ned": x, "y_ned": y,
        "yaw_deg": np.degrees(psi) % 360.0, "yaw_rate_degps": np.degrees(r), "surge_mps": u,
        "sway_mps": 0.0 * u, **pulses,
    })  # fmt: skip


@pytest.mark.parametrize(
    ("gain", "stated"),
    [((1.0, 1.0), True), ((-1.0, 1.0), True), ((-1.0, 1.0), False), ((1.0, -1.0), False)],
    ids=str,
)
def test_polarity_and_neutral_pulse_are_what_the_data_say(tmp_path, gain, stated):
    frame = boat(gain, 1511.0, np.random.default_rng(3))
    if stated:
        frame = frame.with_columns(thr_left_pwm_zero_point=1511.0, thr_right_pwm_zero_point=1511.0)
    frame.write_parquet(tmp_path / "t.parquet")
    text = draft_table(tmp_path / "t.parquet")
    profile = profiles.parse(text, "draft")
    for name, sign in zip(("thr_left", "thr_right"), gain, strict=True):
        column = profile.table[name]
        assert (column.offset, column.sign) == (1511.0, sign)
    left, right = (part for part in text.split("[[actuators]]")[1:3])
    assert "as a thruster to port does" in left and "as a thruster to starboard does" in right
    assert "CHECK: the neutral pulse" in left


@pytest.mark.parametrize(
    "dead",
    [{"SERVO_OUTPUT_RAW.port": np.ones(len(T)), "thruster_bow": np.zeros(len(T))},
     {"thruster_port": np.zeros(len(T)), "thruster_starboard": np.zeros(len(T))},
     {"motor_3": np.full(len(T), -1.0)}],
    ids=["an output's number", "two that stand at 0", "one that is off"],
)  # fmt: skip
def test_the_number_of_an_output_and_what_never_moves_are_no_thrusters(tmp_path, dead):
    driven = {"rudder": np.sin(T), "rpm": np.full(len(T), 90.0)}
    _, profile, text = drafted(tmp_path, **dead, **driven)
    assert {a.name for a in profile.actuators} == {"rudder", "rpm"}
    named = next(line for line in text.splitlines() if "called like an actuator" in line)
    assert "CHECK" in named and all(name in named for name in dead)


@pytest.mark.parametrize("names", [("rud_p", "rud_s"), ("rud_port", "rud_stbd"), ("RudP", "RudS")])
def test_short_names_of_rudders_are_known(tmp_path, names):
    _, profile, _ = drafted(tmp_path, **dict(zip(names, (np.sin(T), np.cos(T)), strict=True)))
    assert [a.kind for a in profile.actuators] == ["rudder", "rudder"]


def test_a_folder_of_a_table_a_voyage_is_one_draft(tmp_path, caplog):
    folder = tmp_path / "trips"
    folder.mkdir()
    for name in ("a", "b", "c"):
        table(**{"t [s]": T}).drop("time").write_csv(folder / f"{name}.csv")
    with caplog.at_level("INFO"):
        text = draft(folder)
    said = [r.message for r in caplog.records if "a voyage each" in r.message]
    assert len(said) == 1 and "3 tables" in said[0]
    profile = profiles.parse(text, "draft")
    assert profile.table["t [s]"].channel == "time"
    assert len(convert([folder], profile, tmp_path / "logs").logs) == 3


@pytest.mark.parametrize(("unit", "ticks"), [("us", 1e6), ("ms", 1e3)])
def test_stamps_since_boot_are_drafted_and_converted(tmp_path, unit, ticks):
    folder = tmp_path / "flight"
    folder.mkdir()
    clock = (12.3 * ticks + T * ticks).astype(np.int64)
    frame = table()
    for name, columns in {
        "gps": {"lat": frame["lat"], "lon": frame["lon"], "sog": frame["sog"], "cog": frame["cog"]},
        "attitude": {"heading": frame["heading"]},
    }.items():
        pl.DataFrame({"timestamp": clock, **columns}).write_csv(folder / f"{name}.csv")
    profile = profiles.parse(draft(folder), "draft")
    assert profile.table["timestamp"].unit == unit and "table.timestamp" in profile.unchecked
    (log,) = convert([folder], profile, tmp_path / "logs").logs
    assert ingest(log, profile).report.seconds == pytest.approx(T[-1], abs=0.2)


def test_tables_of_no_clock_are_one_sentence_and_no_empty_draft(tmp_path):
    folder = tmp_path / "flight"
    folder.mkdir()
    for i in range(30):
        pl.DataFrame({"a": T, f"b{i}": T}).write_csv(folder / f"topic{i}.csv")
    pl.DataFrame({"utc": ["2024-05-01T00:00:00Z"], "v": [1.0]}).write_csv(folder / "z.csv")
    with pytest.raises(ShiplogError) as refused:
        draft(folder)
    assert refused.value.message.count("column of times") == 1
    assert "30 tables" in refused.value.message


@pytest.mark.parametrize(
    ("north", "east", "after"), [(12.0, 0.0, 0.003), (0.0, 7.0, 0.25), (-4.0, 3.0, 0.1)]
)
def test_two_receivers_in_one_table_are_said(tmp_path, north, east, after):
    frame = table()
    other = frame.with_columns(
        pl.col("lat") + north / METRE,
        pl.col("lon") + east / METRE / math.cos(math.radians(54.0)),
        pl.col("time") + after,
    )
    both = pl.concat((frame, other)).sort("time")
    both.write_csv(tmp_path / "t.csv")
    text = draft_table(tmp_path / "t.csv")
    line = next(one for one in text.splitlines() if 'channel = "time"' in one)
    apart = f"{math.hypot(north, east):.3g} m"
    assert "CHECK" in line and "two receivers" in line and apart in line
    assert "333 Hz" not in text


@pytest.mark.parametrize(
    ("name", "most", "unit"),
    [("motor_left", 1.0, "1"), ("motor_left", 100.0, "%"), ("motor_left", 1000.0, "permille"),
     ("motor_speed", 900.0, "rpm"), ("motor_speed", 30.0, "rps")],
)  # fmt: skip
def test_a_command_has_the_unit_of_its_size(tmp_path, name, most, unit):
    line, profile, _ = drafted(tmp_path, **{name: most * np.sin(T / 11.0)})
    assert profile.actuators[0].unit == unit and "CHECK" in line[name]
    path = log_of(tmp_path / "a.mcap", topics(**{f"/motor/{name}": {
        "motor_speed" if "speed" in name else "command": most * np.sin(T / 11.0)}}))  # fmt: skip
    assert profiles.parse(draft_log(path), "d").actuators[0].unit == unit
