"""A draft of a table takes each column for what its name and unit say, and marks what is unsure."""

import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from shiplog.commands.convert import convert
from shiplog.drafting import draft_table, facts
from shiplog.ship_profile import file as profiles
from shiplog.voyages.ingest.ingest import ingest

COUNT = 240
STEPS = np.arange(COUNT)
SHIP = {
    "time": STEPS * 1.0, "lat": 59.0 + STEPS * 1e-5, "lon": 10.0 + STEPS * 1e-5,
    "sog [kn]": 4.0 + np.sin(STEPS), "cog [deg]": (40.0 + STEPS) % 360,
    "heading [deg]": (45.0 + STEPS) % 360, "rudder [deg]": 10.0 * np.cos(STEPS),
}  # fmt: skip


def table_of(path: Path, columns: dict, without: tuple[str, ...] = ()) -> Path:
    """A CSV of the ship's columns, with these before them."""
    ship = {name: values for name, values in SHIP.items() if name not in (*without, *columns)}
    pl.DataFrame({**columns, **ship}).write_csv(path)
    return path


def lines(path: Path, columns: dict, without: tuple[str, ...] = ()) -> dict[str, str]:
    """The draft's lines in [table] by their column; it can be read as a profile."""
    text = draft_table(table_of(path / "t.csv", columns, without))
    profiles.parse(text, "draft")
    found = re.findall(r'^(?:# Second choice: )?"(.*?)" = (\{.*)$', text, re.MULTILINE)
    return dict(found)


def drafted(path: Path, columns: dict, without: tuple[str, ...] = ()):
    return profiles.parse(draft_table(table_of(path / "t.csv", columns, without)), "draft")


@pytest.mark.parametrize(
    ("name", "values", "unit", "check"),
    [
        ("time_ms", STEPS * 50, "ms", False),
        ("timestamp_ms", 1000 + STEPS * 20, "ms", False),
        ("Time [min]", STEPS / 1200, "min", False),
        ("TimeUS", 90_000_000 + STEPS * 40_000, "us", False),
        ("t_s", STEPS * 0.1, "s", False),
        ("time", STEPS * 0.1, None, False),
        ("time", STEPS * 1.0, None, False),
        ("time", STEPS * 50, "ms", True),
        ("timestamp", 5_000_000 + STEPS * 50_000, "us", True),
        ("time", 1_700_000_000 + STEPS, None, False),
        ("timestamp_ms", 1_700_000_000_000 + STEPS * 100, "ms", False),
        ("timestamp_s", 1_700_000_000_000 + STEPS * 100, "ms", True),
        ("Time", 45000.5 + STEPS / 86400, "d", True),
        ("time_s", STEPS * 1e-4, "s", True),
    ],
)
def test_a_number_is_the_time_that_its_name_or_its_rate_says(tmp_path, name, values, unit, check):
    line = lines(tmp_path, {name: values}, without=("time",))[name]
    assert (f'unit = "{unit}"' in line) if unit else ("unit" not in line.split("}")[0])
    assert ("CHECK" in line) == check


def clock_of(second: np.ndarray) -> np.ndarray:
    return second // 3600 * 10_000 + second // 60 % 60 * 100 + second % 60


@pytest.mark.parametrize("start", [45_290, 3_590, 30])
def test_a_clock_written_as_a_number_is_to_be_checked(tmp_path, start):
    """123450 is 12:34:50, as NMEA writes it; seconds of a day are left as they are."""
    columns = {"date": np.full(COUNT, 230324), "time": clock_of(start + STEPS)}
    assert "CHECK: hours, minutes, seconds" in lines(tmp_path, columns)["time"]
    assert "CHECK" not in lines(tmp_path, {"time": start + STEPS})["time"]


def test_a_unit_of_something_else_is_another_instrument(tmp_path):
    """Thrust in kN, a pitch, a rate and a time step drive nothing that a model knows."""
    columns = {
        "Shaft thrust [kN]": 100.0 + STEPS, "Propeller pitch [deg]": 20.0 + np.sin(STEPS),
        "Rudder rate [deg/s]": np.sin(2.0 * STEPS), "delta_t": 1.0 + 1e-3 * np.sin(STEPS),
        "Shaft speed [rpm]": 90.0 + np.sin(STEPS / 9), "Azimuth power [kW]": 3.0 + np.sin(STEPS),
    }  # fmt: skip
    profile = drafted(tmp_path, columns)
    assert {(a.kind, a.name) for a in profile.actuators} == {
        ("rudder", "rudder"), ("propeller", "shaft_speed"),
    }  # fmt: skip
    found = lines(tmp_path, columns)
    assert set(columns) & set(found) == {"Shaft speed [rpm]"}
    assert 'unit = "rpm"' in found["Shaft speed [rpm]"]


def test_the_speed_of_an_engine_is_no_speed_over_ground(tmp_path):
    found = lines(tmp_path, {"Speed [rpm]": 90.0 + np.sin(STEPS / 9)})
    assert 'channel = "sog"' in found["sog [kn]"]
    assert "CHECK: of the engine" in found["Speed [rpm]"]


def test_a_pod_has_an_angle_and_a_shaft(tmp_path):
    columns = {"Azimuth 1 angle [deg]": STEPS * 1.0, "Azimuth 1 RPM": 90.0 + np.sin(STEPS / 9)}
    actuators = drafted(tmp_path, columns, without=("rudder [deg]",)).actuators
    assert [(a.kind, a.unit) for a in actuators] == [("azimuth", "deg"), ("thruster", "rpm")]


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("delta", "rudder"), ("delta_r", "rudder"), ("rudder_angle_port", "rudder"),
        ("rudderAngle1", "rudder"), ("STBD Rudder position", "rudder"),
        ("steering_angle", "rudder"), ("rudder_mode", None), ("rudder_rate", None),
        ("heading_delta", None), ("delta_psi", None), ("delta_t", None),
        ("n", "propeller"), ("n_p", "propeller"), ("n1", "propeller"), ("prop_speed", "propeller"),
        ("shaft1", "propeller"), ("proportional", None), ("shaft_torque", None), ("n_sats", None),
        ("thrleft", "thruster"), ("bow_thruster", "thruster"), ("motor_a", "thruster"),
        ("ESC2", "thruster"), ("description", None), ("motor_hours", None), ("engine", None),
        ("azimuth_2", "azimuth"), ("pod_angle_stbd", "azimuth"), ("podium", None),
        ("rudder_" + "sb" * 60 + "x", None), ("rudder_" + "1" * 200 + "x", None),
    ],
)  # fmt: skip
def test_a_name_is_an_actuators_where_only_which_one_follows_it(tmp_path, name, kind):
    found = drafted(tmp_path, {name: 20.0 * np.sin(STEPS / 3)}, ("rudder [deg]",)).actuators
    assert [a.kind for a in found] == ([kind] if kind else [])


def test_speed_over_ground_before_the_speed_log(tmp_path):
    found = lines(tmp_path, {"Speed [kn]": 3.0 + np.sin(STEPS / 7)})
    assert found["sog [kn]"].startswith('{ channel = "sog"')
    assert "CHECK: over ground?" in found["Speed [kn]"]
    alone = lines(tmp_path, {"Speed [kn]": 3.0 + np.sin(STEPS / 7)}, without=("sog [kn]",))
    assert "CHECK: over ground?" in alone["Speed [kn]"]


def test_a_heading_from_north_before_a_magnetic_one(tmp_path):
    """(M) is no metre."""
    columns = {"Heading (M)": STEPS + 40.0, "Heading (T)": STEPS + 45.0}
    profile = drafted(tmp_path, columns, without=("heading [deg]",))
    taken = {c.channel: (name, c.unit) for name, c in profile.table.items()}
    assert taken["heading"] == ("Heading (T)", "deg")
    alone = lines(tmp_path, {"Heading (M)": STEPS + 40.0}, without=("heading [deg]",))
    assert "magnetic" in alone["Heading (M)"] and 'unit = "deg"' in alone["Heading (M)"]


WIND = {"Wind direction [deg]": STEPS + 9.0, "Relative wind speed [m/s]": STEPS / 9.0,
        "Relative wind direction [deg]": 20.0 + np.sin(STEPS)}  # fmt: skip
TRUE = {"Wind Speed (true) [kn]": STEPS / 9.0, "Wind Dir (true) [deg]": STEPS + 9.0}
FELT = {"Wind Speed (app) [kn]": STEPS / 8.0, "Wind Dir (app) [deg]": STEPS + 7.0}
PLAIN = {"wind_speed_mps": STEPS / 9.0, "wind_dir_deg": STEPS + 9.0}


@pytest.mark.parametrize(
    ("columns", "speed", "angle", "check"),
    [
        (WIND, "Relative wind speed [m/s]", "Relative wind direction [deg]", False),
        (TRUE | FELT, "Wind Speed (app) [kn]", "Wind Dir (app) [deg]", False),
        (TRUE, None, None, False),
        ({"TWS [kn]": STEPS / 9.0, "TWD [deg]": STEPS + 9.0}, None, None, False),
        (PLAIN, "wind_speed_mps", "wind_dir_deg", True),
        (PLAIN | FELT, "Wind Speed (app) [kn]", "Wind Dir (app) [deg]", False),
        ({"AWS [kn]": STEPS / 9.0, "wind_dir_deg": STEPS + 9.0}, "AWS [kn]", "wind_dir_deg", True),
    ],
)
def test_the_wind_is_the_apparent_one_of_one_instrument(tmp_path, columns, speed, angle, check):
    profile = drafted(tmp_path, columns)
    taken = {c.channel: name for name, c in profile.table.items()}
    assert (taken.get("wind_speed"), taken.get("wind_angle")) == (speed, angle)
    if angle:
        assert ("CHECK" in lines(tmp_path, columns)[angle]) == check


def test_every_shaft_has_the_unit_of_its_name(tmp_path):
    columns = {
        "port_rpm": 90.0 + np.sin(STEPS), "rpm_stbd": 80.0 + np.cos(STEPS),
        "RPM": 70.0 + np.sin(STEPS / 5), "Engine RPM": 700.0 + np.sin(STEPS / 6),
    }  # fmt: skip
    propellers = [a for a in drafted(tmp_path, columns).actuators if a.kind == "propeller"]
    assert [a.name for a in propellers] == ["port", "rpm_stbd", "rpm"]
    found = lines(tmp_path, columns)
    assert all('unit = "rpm"' in found[name] and "CHECK" not in found[name]
               for name in ("port_rpm", "rpm_stbd", "RPM"))  # fmt: skip
    engine = lines(tmp_path, {"Engine RPM": columns["Engine RPM"]})
    assert "CHECK: of the engine" in engine["Engine RPM"] and 'unit = "rpm"' in engine["Engine RPM"]


@pytest.mark.parametrize("name", ["motor_left_us", "PWM left [us]", "pwm_left", "servo1_raw"])
def test_a_neutral_pulse_is_no_command(tmp_path, name):
    path = table_of(tmp_path / "t.csv", {name: 1500.0 + 100.0 * (STEPS > 100)})
    profile = profiles.parse(draft_table(path), "draft")
    (log,) = convert([path], profile, tmp_path).logs
    driven = ingest(log, profile).table[profile.actuator_names[-1]]
    assert driven[5] == pytest.approx(0.0) and driven[-5] == pytest.approx(0.25)
    assert "CHECK: the neutral pulse" in lines(tmp_path, {name: 1500.0 + STEPS})[name]


def test_a_rudder_in_percent_is_a_command(tmp_path):
    path = table_of(tmp_path / "t.csv", {"Rudder (%)": 50.0 * (STEPS > 9)}, ("rudder [deg]",))
    profile = profiles.parse(draft_table(path), "draft")
    assert profile.actuators[0].unit == "%"
    (log,) = convert([path], profile, tmp_path).logs
    assert ingest(log, profile).table["rudder"][-5] == pytest.approx(0.5)


LABELS = {
    "Vessel Speed [kn]": np.round(5.0 + np.sin(STEPS), 1),
    "Trip distance [nm]": np.round(STEPS / 50, 1),
    "trip": np.round(STEPS / 50, 1),
    "ship_speed": STEPS // 20,
    "trial_duration": STEPS // 20,
}


@pytest.mark.parametrize("name", LABELS)
def test_a_measurement_is_no_label(tmp_path, name):
    assert not {"vessel", "voyage"} & {
        column.channel for column in drafted(tmp_path, {name: LABELS[name]}).table.values()
    }


@pytest.mark.parametrize("name", ["trip", "voyage_no", "Trial name", "run_id", "test_number"])
def test_a_name_or_number_of_a_voyage_is_one(tmp_path, name):
    line = lines(tmp_path, {name: STEPS // 60})[name]
    assert line.startswith('{ channel = "voyage" }')


def test_the_day_of_a_month_is_no_date(tmp_path):
    stamp = [f"2024-03-15T12:{i // 60:02d}:{i % 60:02d}Z" for i in range(COUNT)]
    whole = {"Day": np.full(COUNT, 15), "Timestamp": stamp}
    path = table_of(tmp_path / "t.csv", whole, without=("time",))
    profile = profiles.parse(draft_table(path), "draft")
    assert "Day" not in profile.table
    assert not convert([path], profile, tmp_path).refused
    alone = lines(tmp_path, {"Day": np.full(COUNT, 15)})
    assert "Day" not in alone and "time" in alone
    beside = lines(tmp_path, {"date": ["2024-03-15"] * COUNT, "time": [s[11:19] for s in stamp]})
    assert beside["date"].startswith('{ channel = "date" }')


@pytest.mark.parametrize("empty", [[None] * COUNT, [511.0] * COUNT], ids=["blank", "AIS"])
def test_a_column_without_a_value_comes_last(tmp_path, empty):
    columns = {"heading": empty, "yaw": STEPS / 100.0}
    profile = drafted(tmp_path, columns, without=("heading [deg]",))
    assert {c.channel: n for n, c in profile.table.items()}["heading"] == "yaw"


def test_a_kind_without_a_value_comes_after_one_with(tmp_path):
    nothing = {"sog [kn]": [None] * COUNT, "cog [deg]": [None] * COUNT}
    moving = {"u [m/s]": STEPS / 99.0, "v [m/s]": STEPS / 999.0}
    assert drafted(tmp_path, nothing | moving).sensors.kind("velocity") == "body"
    assert drafted(tmp_path, moving).sensors.kind("velocity") == "sog_cog"


def test_an_instrument_that_is_not_needed_is_left_out_where_it_is_blank(tmp_path):
    path = table_of(tmp_path / "t.csv", {"rot [deg/s]": [None] * COUNT})
    text = draft_table(path)
    assert "No yaw_rate was recognised; shiplog does without it" in text
    assert profiles.parse(text, "draft").sensors.yaw_rate is None
    blank = lines(tmp_path, {"heading [deg]": [None] * COUNT})
    assert "CHECK: no value in it" in blank["heading [deg]"]


def test_a_heading_that_ais_has_not_is_to_be_checked(tmp_path):
    line = lines(tmp_path, {"heading [deg]": np.where(STEPS > 99, 511.0, 40.0)})["heading [deg]"]
    assert 'CHECK: 511 is AIS\'s "not available"' in line


def coordinates(path: Path, columns: dict) -> tuple[dict[str, float], str]:
    """The sign of latitude and longitude in a draft, and its lines on them."""
    found = lines(path, columns, without=("lat", "lon"))
    profile = drafted(path, columns, without=("lat", "lon"))
    signs = {c.channel: c.sign for c in profile.table.values()}
    text = " ".join(found[name] for name, c in profile.table.items() if "itude" in c.channel)
    return {name: signs[name] for name in ("latitude", "longitude")}, text


def test_the_letter_of_a_hemisphere_is_a_sign(tmp_path):
    """NMEA has no signs: 40 N, 74 W."""
    west = {"Latitude": 40.0 + STEPS * 1e-5, "N/S": ["N"] * COUNT,
            "Longitude": 74.0 + STEPS * 1e-5, "E/W": ["W"] * COUNT}  # fmt: skip
    signs, text = coordinates(tmp_path, west)
    assert signs == {"latitude": 1.0, "longitude": -1.0} and "CHECK: W, of 'E/W'" in text
    degrees = {"Lat (deg S)": 40.0 + STEPS * 1e-5, "Lon (°E)": 74.0 + STEPS * 1e-5}
    assert coordinates(tmp_path, degrees)[0] == {"latitude": -1.0, "longitude": 1.0}
    named = {"Lat (S)": 40.0 + STEPS * 1e-5, "Lon (E)": 74.0 + STEPS * 1e-5}
    assert coordinates(tmp_path, named)[0] == {"latitude": -1.0, "longitude": 1.0}
    signed = west | {"Longitude": -74.0 + STEPS * 1e-5}
    signs, text = coordinates(tmp_path, signed)
    assert signs["longitude"] == 1.0 and "CHECK" not in text
    mixed = west | {"E/W": ["W"] * 100 + ["E"] * (COUNT - 100)}
    signs, text = coordinates(tmp_path, mixed)
    assert signs["longitude"] == 1.0 and "CHECK: 'E/W' is W in some rows" in text
    contrary = signed | {"E/W": ["E"] * COUNT}
    assert "CHECK: its signs are not those of 'E/W'" in coordinates(tmp_path, contrary)[1]


def test_coordinates_by_their_size(tmp_path):
    counted = {"lat": 473_977_418 + STEPS, "lon": 85_455_939 + STEPS}
    signs, text = coordinates(tmp_path, counted)
    assert signs == {"latitude": 1e-7, "longitude": 1e-7} and "CHECK: taken as 1e-7 deg" in text
    minutes = {"lat": 4807.038 + STEPS * 1e-3, "lon": 1131.0 + STEPS * 1e-3}
    assert "CHECK: beyond 90; degrees and minutes" in coordinates(tmp_path, minutes)[1]
    plain = {"lat": 48.07 + STEPS * 1e-5, "lon": 351.0 + STEPS * 1e-5}
    assert "CHECK" not in coordinates(tmp_path, plain)[1]


def test_the_next_choice_is_another_column(tmp_path):
    """Also where the first one is turned round: 40 S."""
    places = {"Latitude (S)": 40.0 + STEPS * 1e-5, "Longitude": 74.0 + STEPS * 1e-5,
              "dr_lat": 41.0 + STEPS * 1e-5, "dr_lon": 75.0 + STEPS * 1e-5}  # fmt: skip
    text = draft_table(table_of(tmp_path / "t.csv", places, without=("lat", "lon")))
    assert '# Second choice: "dr_lat"' in text and '# Second choice: "dr_lon"' in text


def test_a_position_is_of_one_receiver(tmp_path):
    places = {f"{name}{i}_{axis}": float(i) + STEPS * 1e-5 for i in (1, 2) for name, axis in
              (("gps", "lat"), ("rtk", "lon"))} | {"gps2_lon": 2.0 + STEPS * 1e-5}  # fmt: skip
    taken = {c.channel: n for n, c in drafted(tmp_path, places, ("lat", "lon")).table.items()}
    assert (taken["latitude"], taken["longitude"]) == ("gps2_lat", "gps2_lon")


@pytest.mark.parametrize("rows", [1, COUNT])
def test_a_yaw_rate_without_a_turn_to_compare_it_with_keeps_its_usual_unit(tmp_path, rows):
    """One row, or a heading that is blank: numpy warns of the median of nothing."""
    heading = np.full(rows, np.nan if rows > 1 else 45.0)
    table = {name: values[:rows] for name, values in SHIP.items()} | {"heading [deg]": heading}
    pl.DataFrame({**table, "rot": np.ones(rows)}).write_parquet(tmp_path / "t.parquet")
    text = draft_table(tmp_path / "t.parquet")
    assert '"rot" = { channel = "yaw_rate", unit = "deg/s" }' in text and "unit not stated" in text


def test_a_plain_x_does_not_say_where_north_is(tmp_path):
    path = tmp_path
    found = lines(path, {"X [m]": STEPS * 1.0, "Y [m]": STEPS * 2.0}, without=("lat", "lon"))
    assert "CHECK: to the north?" in found["X [m]"] and "CHECK: to the east?" in found["Y [m]"]
    sure = lines(path, {"x0_m": STEPS * 1.0, "y0_m": STEPS * 2.0}, without=("lat", "lon"))
    assert "CHECK" not in sure["x0_m"] + sure["y0_m"]


def test_a_long_text_is_cut_in_a_comment():
    comment = facts.of_values(pl.Series(["<robot>\n" * 100]))
    assert len(comment) < 80 and "\n" not in comment


def test_a_name_with_quotation_marks_or_a_line_end_is_drafted_as_it_is(tmp_path):
    """As of a spreadsheet whose headers have two lines."""
    path = tmp_path / 'trial "A" \\ 1.parquet'
    odd = {"rudder\n[deg]": SHIP["rudder [deg]"], 'note\n"x"': STEPS * 2.0}
    ship = {name: values for name, values in SHIP.items() if name != "rudder [deg]"}
    pl.DataFrame({**ship, **odd}).write_parquet(path)
    profile = profiles.parse(draft_table(path), "draft")
    assert profile.ship.name == 'trial "A" \\ 1'
    assert profile.table["rudder\n[deg]"].channel == profile.actuators[0].name
    vessels = pl.DataFrame({**SHIP, "vessel": ['the "B"', "C"] * (COUNT // 2)})
    vessels.write_parquet(tmp_path / "fleet.parquet")
    profile = profiles.parse(draft_table(tmp_path / "fleet.parquet", 'the "B"'), "draft")
    assert (profile.ship.name, profile.table["vessel"].only) == ('the "B"', 'the "B"')


def at_sea(count=400):
    """Two knots and more on a turning course: latitude, longitude in deg, speed in knots."""
    second = np.arange(count)
    course = np.radians(60.0 + 40.0 * np.sin(second / 40.0))
    knots = 4.0 + 1.5 * np.sin(second / 55.0)
    north, east = (np.cumsum(knots * 1852 / 3600 * g(course)) for g in (np.cos, np.sin))
    lat, lon = 59.0 + north / 111_320.0, 20.0 + east / (111_320.0 * np.cos(np.radians(59.0)))
    return second, lat, lon, knots, np.degrees(course)


def minutes(degrees, letter, width):
    return [f"{int(d):0{width}d}{d % 1 * 60:07.4f}{letter}" for d in degrees]


@pytest.mark.parametrize("form", ["day or month", "am and pm", "letters", "letters apart"])
@pytest.mark.parametrize(("unit", "factor"), [("kn", 1.0), ("m/s", 1852 / 3600), ("km/h", 1.852)])
def test_a_speed_is_in_the_unit_of_the_way_whatever_is_still_asked(tmp_path, form, unit, factor):
    """That a date may have the day first, or that a place has letters, hides no motion."""
    second, lat, lon, knots, course = at_sea()
    clock = [f"{10 + s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d}" for s in second]
    place = {"Lat": lat.round(7), "Lon": lon.round(7)}
    when = {"Time": [f"05/06/2021 {one}" for one in clock]}
    if form == "am and pm":
        when = {"Time": [f"05/06/2021 {one} am" for one in clock]}
    elif form == "letters":
        place = {"Lat": minutes(lat, "N", 2), "Lon": minutes(lon, "E", 3)}
        when = {"Date": ["05/06/21"] * len(clock), "Time": clock}
    elif form == "letters apart":
        place = {"Lat": [f"N {d:.7f}" for d in lat], "Lon": [f"E {d:.7f}" for d in lon]}
    columns = {**when, **place, "SOG": (knots * factor).round(3), "COG": course.round(2)}
    pl.DataFrame(columns).write_csv(tmp_path / "t.csv")
    text = draft_table(tmp_path / "t.csv")
    (line,) = [one for one in text.splitlines() if one.startswith('"SOG"')]
    assert f'unit = "{unit}"' in line and "fits how fast the position changes" in line


def test_a_set_point_of_a_drive_that_is_measured_is_no_actuator(tmp_path):
    """A speed that was ordered once, next to what the two motors got."""
    time = np.arange(200) * 0.1
    psi = 0.1 * time
    table = pl.DataFrame({
        "t": time, "x": np.sin(psi), "y": -np.cos(psi), "Heading": np.degrees(psi) % 360.0,
        "SpeedSet": np.full(200, 1.0), "PWM_L": 1500.0 + 100.0 * np.sin(time),
        "PWM_R": 1500.0 + 80.0 * np.cos(time),
    })  # fmt: skip
    table.write_csv(tmp_path / "usv.csv")
    text = draft_table(tmp_path / "usv.csv")
    assert text.count("[[actuators]]") == 2
    assert '"SpeedSet"' not in text.split("[table]")[1].split("#")[0]
