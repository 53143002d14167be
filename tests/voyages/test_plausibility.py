"""What can be of a ship, on ships whose sizes are published and motions known in closed form."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
import sailing

from shiplog.ship_profile import file as profiles
from shiplog.voyages.contradictions import plausible_measures, wind_contradictions
from shiplog.voyages.contradictions.plausibility import TABLE, Asked, findings
from shiplog.voyages.sensors import comparison

SHIPPED = ("esso-vectwin", "esso-osaka", "blueboat", "milliampere", "kvlcc2", "kvlcc2-full-scale")
TANKER = """
[ship]
name = "tanker"
length_m = {length}
breadth_m = 58.0
draught_m = 20.8
mass_kg = {mass}
block_coefficient = 0.81
[sensors.position]
kind = "local"
topic = "/p"
fields = ["x", "y"]
[sensors.velocity]
topic = "/v"
fields = ["sog", "cog"]
units = ["m/s", "deg"]
[sensors.heading]
topic = "/h"
field = "heading"
unit = "deg"
[sensors.wind]
topic = "/w"
fields = ["speed", "direction"]
units = ["m/s", "deg"]
[[actuators]]
name = "rudder"
kind = "rudder"
topic = "/r"
field = "angle"
unit = "deg"
position_m = [{rudder}, 0.0]
limits = {limits}
[[actuators]]
name = "propeller"
kind = "propeller"
topic = "/n"
field = "speed"
unit = "rpm"
position_m = [-158.0, 0.0]
diameter_m = {diameter}
"""


def tanker(**changes):
    """The KVLCC2: 320 m, 312 600 m³, a propeller of 9.86 m (SIMMAN 2008)."""
    given = {
        "length": 320.0, "mass": 3.2e8, "rudder": -160.0, "limits": [-35.0, 35.0],
        "diameter": 9.86,
    }  # fmt: skip
    return profiles.parse(TANKER.format(**(given | changes)), "tanker.toml")


def said(profile) -> list[tuple[str, str, str]]:
    """(kind, channel, key to look at) of what a profile alone says."""
    found = findings(plausible_measures.of_profile(profile))
    return [(f.kind, f.channel, f.sentence.partition("ook at ")[2].split(",")[0].rstrip("."))
            for f in found]  # fmt: skip


@pytest.mark.parametrize("name", SHIPPED)
def test_the_shipped_ships_are_plausible(name):
    assert said(profiles.load(name)) == []


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, []),
        ({"mass": 3.2e5}, [("contradiction", "ship", "ship.mass_kg")]),
        ({"mass": 4.16e8}, [("contradiction", "ship", "ship.mass_kg")]),  # its box has 3.95e8 kg
        ({"length": 32.0}, [("contradiction", "ship", "ship.length_m")]),
        ({"length": 1000.0}, [("implausible", "ship", "ship.mass_kg")]),
        ({"diameter": 986.0}, [("contradiction", "propeller", "actuators.propeller.diameter_m")]),
        ({"diameter": 25.0}, [("implausible", "propeller", "actuators.propeller.diameter_m")]),
        ({"rudder": 160.0}, [("implausible", "rudder", "actuators.rudder.position_m")]),
        ({"limits": [-2000.0, 2000.0]}, [("contradiction", "rudder", "actuators.rudder.unit")]),
    ],
    ids=str,
)
def test_one_wrong_number_of_a_profile_is_one_finding(changes, expected):
    assert said(tanker(**changes)) == expected


def test_a_mass_in_tonnes_is_named_as_such():
    (found,) = findings(plausible_measures.of_profile(tanker(mass=3.2e5)))
    assert (found.kind, found.reason) == ("contradiction", "unit")
    assert "a mass in t" in found.sentence


def test_two_rudders_ahead_are_asked_once_and_rudders_at_both_ends_never():
    plain = tanker()
    blade = plain.actuators[0]

    def with_rudders(*places):
        blades = tuple(
            blade.model_copy(update={"name": f"r{i}", "position_m": (x, 0.0)})
            for i, x in enumerate(places)
        )
        return plain.model_copy(update={"actuators": (*blades, plain.actuators[1])})

    assert [kind for kind, *_ in said(with_rudders(150.0, 150.0))] == ["implausible"]
    assert said(with_rudders(150.0, -150.0)) == []


def test_every_row_has_a_reason_a_key_and_limits_in_order():
    for row in TABLE.values():
        assert row.source and row.keys
        assert row.possible[0] <= row.usual[0] < row.usual[1] <= row.possible[1]


def straight(profile, speed, turns, seconds=120.0, turning=0.0, rudder=0.0, wind=5.0):
    """Rows [n] at 10 Hz of a ship at constant speed, rate of turn and revolutions."""
    t = np.arange(0.0, seconds, 0.1)
    heading = np.mod(turning * t + math.pi, 2.0 * math.pi) - math.pi
    along = np.full_like(t, speed)
    columns = {
        "x0": np.cumsum(np.cos(turning * t)) * 0.1 * speed,
        "y0": np.cumsum(np.sin(turning * t)) * 0.1 * speed,
        "heading": heading, "surge": along, "sway": 0.0 * t, "yaw_rate": 0.0 * t + turning,
        "rudder": 0.0 * t + rudder, "propeller": 0.0 * t + turns,
        "wind_speed": 0.0 * t + wind, "wind_angle": 0.0 * t,
    }  # fmt: skip
    return pl.DataFrame(
        {"time": t} | {n: columns[n] for n in profile.columns} | {"quality": np.zeros(len(t), int)}
    )


def of_rows(profile, table) -> list[tuple[str, str]]:
    return [(f.kind, f.sentence) for f in plausible_measures.of_log(table, profile)]


@pytest.mark.parametrize(
    ("turns", "kind", "words"),
    [
        (75 / 60, "", ""),  # 15.5 knots at 75 rpm: U/(nD) = 0.65
        (20 / 60, "", ""),  # and at dead slow, still going
        (75 / 60 / 60, "contradiction", "revolutions per second that are called rpm"),
        (75.0, "contradiction", "revolutions per minute that are called rps"),
        (75 / 60 / 10, "implausible", "actuators.propeller"),  # 6.5: asked
    ],
)
def test_revolutions_are_held_against_the_speed(turns, kind, words):
    profile = tanker()
    found = of_rows(profile, straight(profile, 8.0, turns))
    assert [k for k, _ in found] == ([kind] if kind else [])
    assert all(words in sentence for _, sentence in found)


def test_a_ship_at_its_berth_is_asked_nothing():
    profile = tanker()
    assert of_rows(profile, straight(profile, 0.01, 75.0 / 60)) == []


@pytest.mark.parametrize(
    ("rudder", "turning", "expected"),
    [
        (math.radians(35.0), 0.01, []),  # r L/U = 0.4
        (35.0, 0.01, ["contradiction"]),  # 2005 deg: degrees that are called rad
        (math.radians(0.6), 0.01, ["implausible"]),  # 35 deg as 0.6 rad, that is called deg
        (math.radians(0.6), 0.0, []),  # a straight passage
    ],
)
def test_rudder_angles_are_held_against_the_turn(rudder, turning, expected):
    profile = tanker()
    found = of_rows(profile, straight(profile, 8.0, 75 / 60, 300.0, turning, rudder))
    assert [k for k, _ in found] == expected
    assert all("actuators.rudder.unit" in sentence for _, sentence in found)


def test_a_wind_of_a_hundred_metres_a_second_cannot_be():
    profile = tanker()
    ((kind, sentence),) = of_rows(profile, straight(profile, 8.0, 75 / 60, wind=90.0))
    assert kind == "contradiction" and "sensors.wind.units" in sentence and "knots" in sentence
    ((kind, _),) = of_rows(profile, straight(profile, 8.0, 75 / 60, wind=60.0))
    assert kind == "implausible"


def boat(limits=None):
    """A boat of 2 m, whose velocity has limits where its owner has stated some."""
    text = sailing.PROFILE.replace("length_m = 3.0", "length_m = 2.0")
    profile = profiles.parse(text, "boat.toml")
    if limits is None:
        return profile
    sensors = profile.sensors
    velocity = sensors.velocity.model_copy(update={"limits": limits})
    return profile.model_copy(update={"sensors": sensors.model_copy(update={"velocity": velocity})})


def test_a_planing_boat_is_asked_and_its_owner_can_answer():
    """10 m/s of 2 m: a Froude number of 2.3; 25 kn are 12.9 m/s."""
    table = straight(boat(), 10.0, 30.0)
    ((kind, sentence),) = of_rows(boat(), table)
    assert kind == "implausible" and "Froude number U/sqrt(g L) is 2.26" in sentence
    assert of_rows(boat((-5.0, 25.0)), table) == []


def test_what_the_sensors_contradict_is_not_asked_again():
    profile = tanker()
    table = straight(profile, 8.0, 75 / 60 / 60)
    assert plausible_measures.of_log(table, profile) != []
    for channel in ("velocity", "propeller"):
        known = SimpleNamespace(kind="contradiction", channel=channel)
        assert plausible_measures.of_log(table, profile, [known]) == []


def test_a_ratio_that_is_outside_by_little_is_a_question():
    (found,) = findings([Asked("Froude number", 1.6, "velocity")])
    assert (found.kind, found.reason, found.high) == ("implausible", "", 1.5)


# --- the wind over ground -------------------------------------------------------------------------


def blown(turns=4, wind=(3.0, -2.0), speed=0.8, gust=0.3, seconds=600.0):
    """A ship that circles in a wind from `wind` [m/s along x0, y0]: heading, apparent wind."""
    t = np.arange(0.0, seconds, 0.1)
    psi = 2.0 * math.pi * turns * t / seconds
    rng = np.random.default_rng(5)
    c, s = np.cos(psi), np.sin(psi)
    north = wind[0] + speed * c + gust * rng.standard_normal(len(t))
    east = wind[1] + speed * s + gust * rng.standard_normal(len(t))
    ahead, starboard = c * north + s * east, -s * north + c * east
    return t, psi, speed, np.hypot(ahead, starboard), np.arctan2(starboard, ahead)


def wind_of(psi, speed, wind_speed, wind_angle):
    profile = sailing.profile()
    zero = 0.0 * psi
    columns = {
        "x0": np.cumsum(np.cos(psi)) * 0.1 * speed, "y0": np.cumsum(np.sin(psi)) * 0.1 * speed,
        "heading": np.arctan2(np.sin(psi), np.cos(psi)), "surge": zero + speed, "sway": zero,
        "yaw_rate": zero, "rudder": zero, "propeller": zero,
        "wind_speed": wind_speed, "wind_angle": wind_angle,
    }  # fmt: skip
    table = pl.DataFrame({n: columns[n] for n in profile.columns} | {"quality": zero.astype(int)})
    return list(wind_contradictions.compare(table, profile).findings)


def test_a_wind_that_keeps_its_direction_is_not_said():
    _, psi, speed, of, angle = blown()
    assert wind_of(psi, speed, of, angle) == []


def test_a_mirrored_vane_turns_the_wind_with_the_ship():
    _, psi, speed, of, angle = blown()
    (found,) = wind_of(psi, speed, of, -angle)
    assert (found.kind, found.channel, found.reason) == ("contradiction", "wind", "sign")
    assert "positive to port" in found.sentence
    assert "`sign = [1.0, -1.0] on [sensors.wind]`" in found.sentence


def test_a_direction_from_north_is_named_as_such():
    _, psi, speed, of, angle = blown()
    (found,) = wind_of(psi, speed, of, angle + psi)
    assert found.kind == "implausible" and "counted from north" in found.sentence


def test_a_direction_towards_is_seen_by_a_ship_as_fast_as_the_gusts():
    _, psi, _, of, angle = blown(turns=12, wind=(0.5, 0.3), speed=2.0, seconds=1200.0)
    (found,) = wind_of(psi, 2.0, of, angle + math.pi)
    assert "where it blows to" in found.sentence
    assert wind_of(psi, 2.0, of, angle) == []


def test_a_ship_on_one_heading_says_nothing_of_the_vane():
    _, psi, speed, of, angle = blown(turns=0)
    assert wind_of(psi, speed, of, -angle) == []


def test_a_heading_that_is_contradicted_says_nothing_of_the_vane():
    """Anticlockwise, it would make a sound vane look mirrored."""
    _, psi, speed, of, angle = blown()
    profile = sailing.profile()
    zero = 0.0 * psi
    columns = {
        "x0": np.cumsum(np.cos(psi)) * 0.1 * speed, "y0": np.cumsum(np.sin(psi)) * 0.1 * speed,
        "heading": np.arctan2(np.sin(-psi), np.cos(-psi)), "surge": zero + speed, "sway": zero,
        "yaw_rate": zero, "rudder": zero, "propeller": zero, "wind_speed": of, "wind_angle": angle,
    }  # fmt: skip
    table = pl.DataFrame({n: columns[n] for n in profile.columns} | {"quality": zero.astype(int)})
    found = comparison.compare(table, profile)
    assert any(f.kind == "contradiction" for f in found.findings)
    assert "wind" not in {f.channel for f in found.findings}
    assert wind_contradictions.compare(table, profile).findings


def test_the_page_has_every_row_with_its_limits():
    """A limit that is asked and stands on no page would be a hidden one."""
    page = (Path(__file__).parents[2] / "docs" / "reference" / "plausibility.md").read_text("utf-8")
    section = page.partition("\n## ")[0]
    rows = {
        cells[0]: cells[1:]
        for line in section.splitlines()
        if line.startswith("| ")
        for cells in [[cell.strip() for cell in line.strip("|").split("|")]]
    }
    assert set(rows) - {"row"} - {"---"} == set(TABLE)
    for name, limit in TABLE.items():
        words = " ".join(rows[name])
        for number in (*limit.usual, *limit.possible):
            if math.isfinite(number) and number > 0.0:
                assert f"{number:g}" in words, (name, number)


def test_a_length_that_no_displacement_bounds_is_listed():
    """m = rho C_B L B T: without one of them a length in feet is as good."""
    whole = profiles.load("esso-vectwin")
    assert plausible_measures.not_compared(whole) == ()
    for key in ("block_coefficient", "mass_kg", "breadth_m", "draught_m"):
        lacks = whole.model_copy(update={"ship": whole.ship.model_copy(update={key: None})})
        (left,) = plausible_measures.not_compared(lacks)
        assert left.what == "the ship's length" and left.reason and left.would_show
