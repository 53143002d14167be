"""Coordinates with a letter, values that stand for none, and the status of a fix in a table."""

import polars as pl
import pytest

from shiplog.commands.convert import convert
from shiplog.drafting import draft_table
from shiplog.exceptions import ProfileError
from shiplog.logs.conversion import cells
from shiplog.logs.reading.read import read
from shiplog.ship_profile import file as profiles

PROFILE = """[ship]
name = "s"
length_m = 5.0
[sensors.position]
kind = "geodetic"
topic = "/gnss/fix"
fields = ["latitude", "longitude"]
unit = "deg"
[sensors.velocity]
kind = "sog_cog"
topic = "/gnss/velocity"
fields = ["sog_mps", "cog_deg"]
units = ["m/s", "deg"]
[sensors.heading]
topic = "/gyro"
field = "heading_deg"
unit = "deg"
[table]
t = "time"
lat = { channel = "latitude", unit = "deg" }
lon = { channel = "longitude", unit = "deg" }
sog = "sog"
cog = { channel = "cog", unit = "deg" }
psi = { channel = "heading", unit = "deg" }
"""


@pytest.mark.parametrize(
    ("text", "degrees"),
    [
        ("4530.2012N", 45 + 30.2012 / 60), ("4530.2012S", -45 - 30.2012 / 60),
        ("N4530.2012", 45 + 30.2012 / 60), ("4530,2012 n", 45 + 30.2012 / 60),
        ("0530.5N", 5 + 30.5 / 60), ("45 30.2012 S", -45 - 30.2012 / 60),
        ("45°30.2012'N", 45 + 30.2012 / 60), ("45° 30' 12.6\" S", -45 - 30 / 60 - 12.6 / 3600),
        ("N 45-30.2012", 45 + 30.2012 / 60), ("45:30:12.6N", 45 + 30 / 60 + 12.6 / 3600),
        ("45°30′12.6″N", 45 + 30 / 60 + 12.6 / 3600),
    ],
)  # fmt: skip
def test_a_coordinate_with_its_letter_is_degrees(text, degrees):
    (found,) = cells.coordinates(pl.Series([text]), "NS", 90.0)
    assert found == pytest.approx(degrees, abs=1e-9)


def test_degrees_with_a_letter_are_no_minutes():
    found = cells.coordinates(pl.Series(["45.50335N", "5.5 S", "S 45.5°"]), "NS", 90.0)
    assert found.to_list() == pytest.approx([45.50335, -5.5, -45.5])
    (east,) = cells.coordinates(pl.Series(["130.5E"]), "EW", 360.0)
    assert east == 130.5
    (parted,) = cells.coordinates(pl.Series(["01335.0504W"]), "EW", 360.0)
    assert parted == pytest.approx(-13 - 35.0504 / 60)
    # the others of the column say in what it counts: 0 deg 30.5 min is no 30.5 deg
    mixed = cells.coordinates(pl.Series(["30.5N", "0130.5N"]), "NS", 90.0)
    assert mixed.to_list() == pytest.approx([30.5 / 60, 1 + 30.5 / 60])


@pytest.mark.parametrize(
    "text", ["4560.0N", "4530.2E", "9130.0N", "4530.2", "45 30", "45 75.0 N", "N", "x", "4530.2 NE"]
)
def test_what_is_no_coordinate_is_none(text):
    assert cells.coordinates(pl.Series([text]), "NS", 90.0)[0] is None


def converted(tmp_path, header, rows, profile=PROFILE):
    (tmp_path / "t.csv").write_text("\n".join([header, *rows]), encoding="utf-8")
    return convert([tmp_path / "t.csv"], profiles.parse(profile, "mine"), tmp_path / "out")


HEADER = "t,lat,lon,sog,cog,psi"


def test_coordinates_with_letters_are_converted(tmp_path):
    rows = [f"{i},4530.{i:04d}S,01335.{i:04d}W,2,90,90" for i in range(20)]
    done = converted(tmp_path, HEADER, rows)
    fix = read(done.logs[0]).frames["/gnss/fix"]
    assert fix["latitude"].to_list() == pytest.approx(
        [-45 - (30 + i / 1e4) / 60 for i in range(20)]
    )
    assert fix["longitude"][3] == pytest.approx(-13 - 35.0003 / 60) and not done.lost


@pytest.mark.parametrize(
    ("cog", "missing", "blank"),
    [("360", "[360]", True), ("360.0", "[360, 511]", True), ("no", '["no"]', True),
     ("360", "[]", False), ("359.99", "[360]", False), ("-", "[]", True)],
)  # fmt: skip
def test_values_that_stand_for_none_are_blank(tmp_path, cog, missing, blank, caplog):
    rows = [f"{i},54,10,2,{cog if i % 3 == 0 else 45.5},90" for i in range(30)]
    stated = PROFILE.replace('"cog", unit = "deg"', f'"cog", unit = "deg", missing = {missing}')
    assert stated != PROFILE
    done = converted(tmp_path, HEADER, rows, stated)
    found = read(done.logs[0]).frames["/gnss/velocity"]["cog_deg"].fill_nan(None)
    assert found.null_count() == (10 if blank else 0) and not done.lost
    assert "no numbers" not in caplog.text


@pytest.mark.parametrize(
    ("column", "values", "missing"),
    [("fix_type", "1 3 3", "[0, 1]"), ("gps_quality", "6 1 4", "[0, 6, 7, 8]"),
     ("valid", "false true true", '["false"]'), ("status", "V A A", '["V"]'),
     ("mode", "E A D", '["E", "M", "N", "S"]'), ("fix", "0 1 1", "[0]")],
)  # fmt: skip
def test_a_status_blanks_position_and_velocity(tmp_path, column, values, missing, caplog):
    values = values.split()
    rows = [f"{i},54.1,10.1,2.1,90.1,90.1,{values[i % 3]}" for i in range(30)]
    header = f"{HEADER},{column}"
    (tmp_path / "d.csv").write_text("\n".join([header, *rows]))
    (line,) = [
        x for x in draft_table(tmp_path / "d.csv").splitlines() if x.startswith(f'"{column}')
    ]
    assert f'channel = "status", missing = {missing}' in line and "CHECK" in line
    done = converted(tmp_path, header, rows, PROFILE + line.split("#")[0] + "\n")
    frames = read(done.logs[0]).frames
    assert frames["/gnss/fix"]["latitude"].fill_nan(None).null_count() == 10
    assert frames["/gnss/velocity"]["sog_mps"].fill_nan(None).null_count() == 10
    assert frames["/gyro"]["heading_deg"].fill_nan(None).null_count() == 0
    assert "10 of 30 rows have no fix" in caplog.text


@pytest.mark.parametrize(
    ("column", "values"),
    [("fix_type", "3 3 3"), ("gps_quality", "1 4 5"), ("quality", "0.5 0.6 0.9"),
     ("mode", "auto manual auto"), ("status", "0 0 1"), ("valid", "0 0 0"),
     ("engine_mode", "E A A")],
)  # fmt: skip
def test_a_column_that_says_no_fix_is_missing_is_no_status(tmp_path, column, values):
    values = values.split()
    rows = [f"{i},54.1,10.1,2.1,90.1,90.1,{values[i % 3]}" for i in range(30)]
    (tmp_path / "d.csv").write_text("\n".join([f"{HEADER},{column}", *rows]))
    assert '"status"' not in draft_table(tmp_path / "d.csv")


def test_a_status_without_its_values_is_asked_for(tmp_path):
    rows = [f"{i},54,10,2,90,90,{i % 2}" for i in range(30)]
    done = converted(tmp_path, HEADER + ",fix", rows, PROFILE + 'fix = "status"\n')
    (why,) = done.refused.values()
    assert "missing = [0]" in why and "0 (15 rows)" in why


@pytest.mark.parametrize(("unit", "factor"), [("m/s", 1.0), ("kn", 3600 / 1852), ("km/h", 3.6)])
def test_a_speed_without_a_unit_is_in_that_of_the_position(tmp_path, unit, factor):
    """Due east at 4 to 6 m/s, 1 deg of longitude being 111 195 m x cos 54 deg."""
    place, rows = 10.0, []
    for i in range(200):
        speed = 5.0 + (i % 40) / 20.0 - 1.0
        rows.append(
            f"2024-06-01T10:{i // 60:02d}:{i % 60:02d}Z,54.0,{place:.8f},{factor * speed:.3f},90,90"
        )
        place += speed / (111_195.0 * 0.587_785_25)
    (tmp_path / "d.csv").write_text("\n".join(["time,lat,lon,sog,cog,heading", *rows]))
    (line,) = [x for x in draft_table(tmp_path / "d.csv").splitlines() if x.startswith('"sog"')]
    assert f'unit = "{unit}"' in line and "fits how fast the position changes" in line


@pytest.mark.parametrize("speeds", ["nothing like it", "at rest"])
def test_a_speed_that_fits_no_unit_keeps_the_usual_one(tmp_path, speeds):
    step, speed = (1e-4, 4.7) if speeds == "nothing like it" else (0.0, 0.02)
    rows = [
        f"2024-06-01T10:{i // 60:02d}:{i % 60:02d}Z,54.0,{10.0 + step * i:.6f},{speed},90,90"
        for i in range(200)
    ]
    (tmp_path / "d.csv").write_text("\n".join(["time,lat,lon,sog,cog,heading", *rows]))
    (line,) = [x for x in draft_table(tmp_path / "d.csv").splitlines() if x.startswith('"sog"')]
    assert 'unit = "m/s"' in line and "unit not stated" in line


def test_a_draft_of_a_table_without_a_header_asks_for_each_column(tmp_path):
    rows = [f"2024-06-01T10:00:{i:02d}Z,54.{i:02d},10.5,5" for i in range(40)]
    (tmp_path / "d.csv").write_text("\n".join(rows))
    asked = [x for x in draft_table(tmp_path / "d.csv").splitlines() if x.startswith('# "column_')]
    assert len(asked) == 4 and all("CHECK" in line for line in asked)
    assert "54 to 54.39" in asked[1]


def test_a_decimal_sign_that_is_none_is_refused():
    with pytest.raises(ProfileError, match="decimal"):
        profiles.parse(
            PROFILE.replace('t = "time"', 't = { channel = "time", decimal = ";" }'), "m"
        )
