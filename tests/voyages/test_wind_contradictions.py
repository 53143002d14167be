"""A true wind that stands still, seen from a ship that turns: worked out here by components."""

import math
from importlib import resources

import numpy as np
import polars as pl
import pytest

from shiplog.ship_profile import file as profiles
from shiplog.voyages.contradictions.wind_contradictions import compare

PROFILE = profiles.load("esso-vectwin")
KNOT = 1852 / 3600


def sailed(speed=2.0, wind=6.0, swing=60.0, seconds=600, gusts=0.1, seed=0):
    """A table at 10 Hz: `swing` [deg] to both sides of north-east, the wind from the west."""
    rng = np.random.default_rng(seed)
    t = np.arange(10 * seconds) / 10
    heading = math.radians(45) + math.radians(swing) * np.sin(2 * np.pi * t / 97)
    blowing = wind * (1 + gusts * np.sin(t / 5) + gusts / 2 * rng.standard_normal(len(t)))
    north, east = 0.0 * blowing, -blowing  # where it comes from
    ahead = np.cos(heading) * north + np.sin(heading) * east + speed
    aside = -np.sin(heading) * north + np.cos(heading) * east
    return pl.DataFrame({
        "heading": np.angle(np.exp(1j * heading)), "surge": np.full(len(t), speed),
        "sway": np.zeros(len(t)), "wind_speed": np.hypot(ahead, aside),
        "wind_angle": np.arctan2(aside, ahead), "quality": np.zeros(len(t), np.int32),
    })  # fmt: skip


def recorded(table, speed=lambda s, row: s, angle=lambda a, row: a):
    row = {name: table[name].to_numpy() for name in table.columns}
    turned = np.angle(np.exp(1j * angle(row["wind_angle"], row)))
    return table.with_columns(
        wind_speed=pl.Series(speed(row["wind_speed"], row)), wind_angle=pl.Series(turned)
    )


WRONG = {  # what was recorded, words of the sentence, reason
    "mirrored": (sailed(), {"angle": lambda a, row: -a}, "sign = [1.0, -1.0]", "sign"),
    "mirrored, a slow ship": (
        sailed(0.4, 2.0), {"angle": lambda a, row: -a}, "positive to port", "sign",
    ),
    "mirrored, in strong gusts": (
        sailed(gusts=0.3), {"angle": lambda a, row: -a}, "positive to port", "sign",
    ),
    "blows to, a fast ship": (
        sailed(6.0, 6.0), {"angle": lambda a, row: a + np.pi}, "offset = [0.0, 180]", "frame",
    ),
    "from north": (
        sailed(), {"angle": lambda a, row: a + row["heading"]}, "counted from north", "frame",
    ),
    "radians as degrees": (
        sailed(), {"angle": lambda a, row: np.radians(a)}, '"rad"', "unit",
    ),
    "zero to starboard, a fast ship": (
        sailed(6.0, 6.0), {"angle": lambda a, row: a + np.pi / 2}, "offset = [0.0, 90]", "frame",
    ),
    "knots, a fast ship in a light wind": (
        sailed(10.0, 4.0, gusts=0.03), {"speed": lambda s, row: s / KNOT}, "kn", "unit",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_another_reading_of_the_wind_is_named(case):
    table, changed, words, reason = WRONG[case]
    (finding,) = compare(recorded(table, **changed), PROFILE).findings
    kind = "implausible" if case == "from north" else "contradiction"  # or the vane is stuck
    assert (finding.kind, finding.channel, finding.reason) == (kind, "wind", reason)
    assert words in finding.sentence


SOUND = {
    "turns": sailed(), "slow": sailed(0.3, 1.2), "fast": sailed(12.0, 3.0),
    "strong gusts": sailed(gusts=0.4), "hardly turns": sailed(swing=8.0),
    "circles": sailed(swing=400.0), "calm": sailed(3.0, 0.1), "astern": sailed(-2.0, 5.0),
    "short": sailed(seconds=120),
}  # fmt: skip


@pytest.mark.parametrize("case", SOUND)
@pytest.mark.parametrize("scale", [0.8, 1.0, 1.2], ids=["hull's lee", "free", "speed-up"])
def test_a_wind_that_stands_still_contradicts_nothing(case, scale):
    """A hull slows or speeds up the air at the mast by a fifth: no other unit."""
    table = SOUND[case].with_columns(pl.col("wind_speed") * scale)
    assert compare(table, PROFILE).findings == ()


def test_a_wind_that_veers_contradicts_nothing():
    """By 90 deg in 20 minutes, as behind a front; and one that falls asleep."""
    table = sailed(seconds=1200)
    veered = np.linspace(0.0, math.pi / 2, table.height)
    row = {name: table[name].to_numpy() for name in table.columns}
    air = row["wind_speed"] * np.exp(1j * row["wind_angle"]) - row["surge"]
    moved = air * np.exp(1j * veered) + row["surge"]
    seen = recorded(table, lambda s, r: np.abs(moved), lambda a, r: np.angle(moved))
    assert compare(seen, PROFILE).findings == ()


def test_without_a_wind_sensor_nothing_is_compared():
    calm = PROFILE.model_copy(update={"sensors": PROFILE.sensors.model_copy(update={"wind": None})})
    table, changed, _, _ = WRONG["mirrored"]
    assert compare(recorded(table, **changed), calm).findings == ()


OTHER = {  # what is wrong in the profile, what is recorded is right → the key
    "unit": ('units = ["m/s", "deg"]', 'units = ["kn", "deg"]', {"speed": lambda s, row: KNOT * s},
             'units = ["m/s", "deg"] on [sensors.wind]'),
    "sign": ("sigma = [0.1, 2.0]", "sigma = [0.1, 2.0]\nsign = [1.0, -1.0]",
             {"angle": lambda a, row: -a}, "sign = 1.0 on [sensors.wind]"),
    "zero": ("sigma = [0.1, 2.0]", "sigma = [0.1, 2.0]\noffset = [0.0, 180.0]",
             {"angle": lambda a, row: a - np.pi}, "offset = [0.0, 0] on [sensors.wind]"),
}  # fmt: skip


@pytest.mark.parametrize("case", OTHER)
def test_the_key_builds_on_what_the_profile_says_already(case):
    """What the user set wrong is to be taken back, and not to be set once more."""
    old, new, changed, key = OTHER[case]
    shipped = resources.files("shiplog") / "profiles" / "esso-vectwin.toml"
    text = shipped.read_text("utf-8")
    head, wind = text.split("[sensors.wind]")
    assert old in wind
    wrong = profiles.parse(f"{head}[sensors.wind]{wind.replace(old, new, 1)}", "wrong.toml")
    table = sailed(10.0, 4.0, gusts=0.03)
    (finding,) = compare(recorded(table, **changed), wrong).findings
    assert key in finding.sentence


@pytest.mark.parametrize(
    ("table", "open_"),
    [
        (sailed(10.0, 4.0, gusts=0.03), set()),
        (sailed(0.1, 2.0, gusts=0.3), {"the wind's unit", "whether the wind blows from or to, and "
                                       "the vane's zero"}),
        (sailed(swing=8.0), {"wind"}),
    ],
    ids=["fast", "slow", "hardly turns"],
)  # fmt: skip
def test_what_the_motion_does_not_exclude_is_listed(table, open_):
    left = compare(table, PROFILE).not_compared
    assert {one.what for one in left} == open_
    assert all(one.reason and one.would_show for one in left)
