"""Profiles that say what cannot be: refused in a user's words, with the key."""

import textwrap
import tomllib
from pathlib import Path

import pytest
import sailing
import tomli_w

from pipelines.experiments import profile_reference
from shiplog.exceptions import ProfileError
from shiplog.nomenclature import units
from shiplog.ship_profile import file as profile_file
from shiplog.ship_profile import profile
from shiplog.ship_profile import table_channels as profile_channels

ARM, SIGMA = "lever_arm_m = [0.7, -0.2]", "sigma = 0.01"
FINITE = "has to be a finite number"


@pytest.mark.parametrize("name", profile_file.shipped())
def test_every_shipped_profile_is_taken(name):
    assert profile_file.load(name).source == name


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (ARM, "lever_arm_m = [nan, 0.0]", f"sensors.position.lever_arm_m.0 {FINITE}"),
        (ARM, "lever_arm_m = [0.0, 1e999]", f"sensors.position.lever_arm_m.1 {FINITE}"),
        ("length_m = 3.0", "length_m = inf", f"ship.length_m {FINITE}"),
        ("length_m = 3.0", "length_m = -3.0", "ship.length_m has to be greater than or equal to"),
        (SIGMA, "sigma = -5", "sensors.position.sigma has to be greater than or equal to 0"),
        (SIGMA, "sigma = [0.1, -0.1]", "sensors.position.sigma.1 has to be greater than or equal"),
        (SIGMA, "sigma = nan", f"sensors.position.sigma {FINITE}"),
        (SIGMA, "sigma = []", "sensors.position.sigma is missing"),
        (SIGMA, "sigma = 'a'", "sensors.position.sigma has to be a number"),
        ("sign = -1.0", "sign = inf", f"actuators.0.sign {FINITE}"),
        ("sign = -1.0", "sign = 0", "`sign` is 0, and every value would be"),
        ("sign = -1.0", "sign = -1e308", "`sign` is -1e+308; it is 1, -1 or another factor"),
        ("sign = -1.0", "sign = 1e-300", "`sign` is 1e-300; it is 1, -1 or another factor"),
        ("sign = -1.0", "sign = []", "`sign` has 0 entries for 1 fields"),
        (ARM, "offset = []", "`offset` has 0 entries for 2 fields"),
        (SIGMA, "sigma = 1e-200", "`sigma` is 1e-200; it is 0 or at least 1e-09"),
        ("[-35.0, 35.0]", "[35.0, -35.0]", "the lower one stands first"),
        ("[-35.0, 35.0]", "[-inf, inf]", f"actuators.0.limits.0 {FINITE}"),
        ('name = "rudder"\n', 'name = "../../x"\n', "letters, digits and underscores only"),
        ("[ship]", "[site]\ndatum = [nan, 0.0]\n[ship]", f"site.datum.0 {FINITE}"),
        ("[ship]", "[table]\n'v [m/s]' = {channel='sway', sign=nan}\n[ship]",
         f"table.v [m/s].sign {FINITE}"),
        ('field = "heading_deg"\nunit = "deg"', 'field = "heading_deg"\nunit = "m"',
         "the field 'heading_deg' of sensors.heading in 'm', a unit of length; it takes angle: "
         "rad, deg."),
        ('["m/s", "deg"]', '["deg", "m/s"]', "the field 'speed_mps' of sensors.wind in 'deg'"),
        ('units = ["kn", "deg"]', 'unit = "kn"', "the field 'cog_deg' of sensors.velocity in 'kn'"),
        ('field = "angle_deg"\nunit = "deg"', 'field = "angle_deg"\nunit = "m/s"',
         "the rudder 'rudder' in 'm/s', a unit of speed; it takes angle or ratio or servo pulse"),
        ('unit = "rpm"', 'unit = "rad/s"', "the propeller 'propeller' in 'rad/s'"),
        ('unit = "rpm"', 'unit = "us"', "the propeller 'propeller' in 'us', a unit of time"),
        ("[ship]", "[table]\n'v' = {channel='sway', unit='deg'}\n[ship]",
         "the column 'v' of [table] in 'deg', a unit of angle; it takes speed"),
        ("[ship]", "[table]\n't' = {channel='time', unit='m/s'}\n[ship]",
         "the column 't' of [table] in 'm/s', a unit of speed; it takes time"),
        ("[ship]", "x = " + "9" * 6000 + "\n[ship]", "not valid TOML"),
        ("[ship]", "x = " + "[" * 20_000 + "]" * 20_000 + "\n[ship]", "not valid TOML"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_its_key(old, new, words):
    assert old in sailing.PROFILE
    with pytest.raises(ProfileError) as found:
        sailing.profile(sailing.PROFILE.replace(old, new))
    assert words in found.value.message and found.value.hint
    assert "constrained" not in found.value.message and "tuple[" not in found.value.message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"local"', '"geodetic"', "sensors.position of kind 'geodetic' needs a unit"),
        ("[ship]", "[table]\nLat = 'latitude'\n[ship]", "[table] 'Lat' needs a unit"),
    ],
)
def test_a_place_on_earth_has_its_unit(old, new, words):
    text = sailing.PROFILE.replace('unit = "m"', "")
    sailing.profile(text)
    with pytest.raises(ProfileError) as found:
        sailing.profile(text.replace(old, new))
    assert words in found.value.message and '"deg"' in found.value.message


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('field = "angle_deg"\nunit = "deg"', 'field = "angle_deg"\nunit = "pwm"'),
        ('field = "angle_deg"\nunit = "deg"', 'field = "angle_deg"\nunit = "%"'),
        ('unit = "rpm"', 'unit = "1"'),
        ('unit = "rpm"', 'unit = "rev/s"'),
        ('"propeller"\ntopic = "/propeller"\nfield = "speed_rpm"\nunit = "rpm"',
         '"thruster"\ntopic = "/propeller"\nfield = "lever"\nunit = "deg"'),
        ('unit = "m"\n', 'unit = "ft"\n'),
        ("[ship]", "[table]\n'mmsi' = {channel='vessel', unit='1'}\n[ship]"),
    ],
)  # fmt: skip
def test_a_command_may_stand_for_what_it_drives(old, new):
    assert old in sailing.PROFILE
    sailing.profile(sailing.PROFILE.replace(old, new, 1))


def numbers(content, place=()):
    """The place of every number in a TOML's content."""
    if isinstance(content, dict):
        inside = content.items()
    elif isinstance(content, list):
        inside = enumerate(content)
    else:
        return [place] if isinstance(content, (int, float)) else []
    return [found for key, value in inside for found in numbers(value, (*place, key))]


def with_number(content, place, number):
    """The content with another number at a place."""
    if not place:
        return number
    changed = dict(content) if isinstance(content, dict) else list(content)
    changed[place[0]] = with_number(content[place[0]], place[1:], number)
    return changed


EVERY_NUMBER = tomllib.loads(
    """
ship = { name = "s", length_m = 3.0, breadth_m = 0.5, draught_m = 0.2, mass_kg = 250.0, \
full_load_draught_m = 0.3, x_g_m = 0.1, block_coefficient = 0.8, frontal_area_m2 = 0.1, \
lateral_area_m2 = 0.5, outline = [[1.5, 0.0], [-1.5, 0.2], [-1.5, -0.2]] }
site = { banks = [[[0.0, 0.0], [10.0, 0.0]]], depth_m = 5.0, density = 1e3, datum = [35.0, 139.0] }
[sensors]
position = { topic = "/p", fields = ["a", "o"], unit = "deg", lever_arm_m = [1.0, 0.1], \
sigma = 0.1 }
velocity = { topic = "/v", fields = ["s", "c"], sign = [1.0, -1.0], offset = [0.0, 1.0], \
sigma = [0.1, 0.2] }
heading = { kind = "quaternion_ned", topic = "/h", fields = ["x", "y", "z", "w"], sign = -1.0, \
offset = 3.0, tolerance_s = 0.5, missing = [511.0], resolution = 0.1, \
mounting_deg = [180.0, 0.0, 90.0] }
yaw_rate = { topic = "/h", field = "r", limits = [-1.0, 1.0] }
[[actuators]]
name = "rudder"
kind = "rudder"
topic = "/r"
field = "angle"
limits = [-35.0, 35.0]
position_m = [-1.5, 0.0]
direction_deg = 10.0
diameter_m = 0.1
area_m2 = 0.01
span_m = 0.1
[[actuators]]
name = "shaft"
kind = "propeller"
topic = "/s"
field = "rpm"
gear_ratio = 2.0
[table]
v = { channel = "sog", sign = 2.0, offset = 1.0, missing = [102.3] }
"""
)
NUMBERS = numbers(EVERY_NUMBER)
KEYS = {place[-1] if isinstance(place[-1], str) else place[-2] for place in NUMBERS}
KEYS |= {"banks", "outline"}  # lists of points


def test_every_key_that_takes_a_number_is_tried():
    sections = (profile.Ship, profile.Sensor, profile.Actuator, profile.Site, profile.Column)
    numeric = {
        key for section in sections for key, field in section.model_fields.items()
        if "float" in str(field.annotation)
    }  # fmt: skip
    assert numeric - KEYS == set() and len(numeric) > 20
    profile_file.parse(tomli_w.dumps(EVERY_NUMBER), "every.toml")


@pytest.mark.parametrize("number", [1e308, -1e308, 10**400], ids=["1e308", "-1e308", "400 digits"])
@pytest.mark.parametrize("place", NUMBERS, ids=lambda place: ".".join(map(str, place)))
def test_no_number_is_taken_that_no_ship_has(place, number):
    text = tomli_w.dumps(with_number(EVERY_NUMBER, place, number))
    with pytest.raises(ProfileError) as found:
        profile_file.parse(text, "every.toml")
    key = place[-1] if isinstance(place[-1], str) else place[-2]
    assert str(key) in found.value.message or {"banks", "outline"} & set(place)
    assert "\n" not in found.value.message and found.value.hint


def test_a_profile_that_is_no_text_or_no_file(tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_bytes(b"\xff\xfe[ship]")
    with pytest.raises(ProfileError, match="UTF-8"):
        profile_file.load(bad)
    with pytest.raises(ProfileError, match="is a folder"):
        profile_file.load(tmp_path)


def test_the_reference_is_what_the_code_reads():
    pages = Path(__file__).parent.parent / "docs" / "reference"
    for name, text in (
        ("profile.md", profile_reference.text()),
        (profile_reference.UNITS, profile_reference.units_text()),
    ):
        assert (pages / name).read_text(encoding="utf-8") == text, (
            "python -m pipelines.experiments.profile_reference --markdown ..."
        )


def test_the_reference_has_every_key_kind_channel_and_unit():
    page = profile_reference.text() + profile_reference.units_text()
    sections = (profile.Ship, profile.Sensor, profile.Actuator, profile.Site, profile.Column)
    keys = {key for section in sections for key in section.model_fields}
    kinds = {f'"{kind}"' for each in profile_channels.SENSOR_KINDS.values() for kind in each}
    channels = {name for names in profile_channels.TABLE_CHANNELS.values() for name in names}
    for word in (
        *keys,
        *kinds,
        *channels,
        *profile_channels.TABLE_LABELS,
        *units.TO_SI,
        *profile_file.shipped(),
    ):
        assert f"`{word}`" in page
    example = page[page.index("    [ship]") : page.index("Position and heading are needed")]
    ship = profile_file.parse(textwrap.dedent(example), "docs/reference/profile.md")
    assert ship.sensors.position.lever_arm_m == (3.2, 0.0)


@pytest.mark.parametrize(
    ("sensors", "words"),
    [
        (("position", "velocity"), "has no heading,"),
        (("heading",), "has no position,"),
        ((), "has no position and no heading,"),
    ],
)
def test_what_a_log_does_not_have_is_reported_with_what_records_it(sensors, words):
    sections = sailing.PROFILE.split("[sensors.")
    kept = [part for part in sections[1:] if part.startswith(sensors)]
    ship, actuators = sections[0], "[[actuators]]" + sailing.PROFILE.split("[[actuators]]", 1)[1]
    text = "".join((ship, *(f"[sensors.{part}" for part in kept), actuators))
    with pytest.raises(ProfileError) as refused:
        profile_file.parse(text, "circle.toml")
    assert words in str(refused.value)
    assert ("record a gyro or a GNSS compass" in str(refused.value)) == ("heading" not in sensors)


def test_a_folder_of_its_name_hides_no_shipped_profile(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "kvlcc2").mkdir()
    (tmp_path / "mine").mkdir()
    assert profile_file.load("kvlcc2").source == "kvlcc2"
    with pytest.raises(ProfileError, match="mine is a folder"):
        profile_file.load("mine")


@pytest.mark.parametrize("bank", ["[[0.0, 0.0]]", "[[0.0, 0.0], [0.0, 0.0], [50.0, 0.0]]"])
def test_a_bank_has_a_direction_between_its_points(bank):
    """Between two that coincide every simulation would have no number."""
    with pytest.raises(ProfileError, match="bank 1 needs two points"):
        sailing.profile(sailing.PROFILE + f"\n[site]\nbanks = [{bank}]\n")
