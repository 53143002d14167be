"""Which lines of a profile still say CHECK."""

import pytest

from shiplog.exceptions import ProfileError
from shiplog.ship_profile import file as profile_file
from shiplog.ship_profile.unchecked_lines import unchecked_lines

DRAFT = """# Look over every line that says CHECK.
[ship]
name = "CHECK # no comment"
length_m = 1.0  # CHECK: the log does not say
[sensors.position]
kind = "local"
topic = "/a#b"  # 10 Hz, checked
fields = ["x", "y"]  # CHECK: to the north?
unit = "m"
lever_arm_m = [0.0, 0.0]  # CHECK
[sensors.velocity]
kind = "body"
topic = "/v"
fields = [
    "u",
    "v",  # CHECK: to starboard?
]
[sensors.heading]  # CHECK: magnetic
topic = "/h"
field = "psi"
unit = "deg"  # checked, not CHECKED
[[actuators]]
name = "rudder"
kind = "rudder"
topic = "/r"
field = "angle"
unit = "deg"
position_m = [0.0, 0.0]  # CHECK
# area_m2 = 0.0  # CHECK: estimated where left out
[[actuators]]
kind = "propeller"
position_m = [0.0, 0.0]  # CHECK: where?
name = 'shaft'
topic = "/p"
field = "n"
[table]
"psi # [deg]" = { channel = "heading", unit = "deg" }  # CHECK: unit
t = { channel = "time" }  # 10 Hz
x.channel = "x0"  # CHECK
"""


def test_a_key_is_named_by_where_it_stands():
    assert unchecked_lines(DRAFT) == (
        "ship.length_m", "sensors.position.fields", "sensors.position.lever_arm_m",
        "sensors.velocity.fields", "sensors.heading", "actuators.rudder.position_m",
        "actuators.shaft.position_m", "table.psi # [deg]", "table.x.channel",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("line", "key"),
    [
        ('ship = { name = "a", length_m = 2.0 }  # CHECK', "ship"),
        ("ship.length_m = 2.0 # look: CHECK", "ship.length_m"),
        ("\"ship\" . 'length_m' = 2.0# CHECK", "ship.length_m"),
        ("actuators = []  # CHECK", "actuators"),
    ],
)
def test_other_ways_to_write_it(line, key):
    assert unchecked_lines(line) == (key,)


@pytest.mark.parametrize(
    "line", ["# CHECK", "a = '# CHECK'", 'a = "\\"# CHECK"', "a = 1  # recheck, CHECKED", ""]
)
def test_what_is_no_mark(line):
    assert unchecked_lines(line) == ()


def test_the_profile_keeps_them_and_a_looked_over_one_has_none():
    parsed = profile_file.parse(DRAFT, "draft.toml")
    assert parsed.unchecked == unchecked_lines(DRAFT)
    assert profile_file.parse(DRAFT.replace("CHECK:", "").replace("CHECK", ""), "d").unchecked == ()
    assert profile_file.load("esso-osaka").unchecked == ()


def test_it_is_no_key_of_a_profile_and_is_not_offered_as_one():
    with pytest.raises(ProfileError, match="unchecked is not a known key"):
        profile_file.parse("unchecked = []\n" + DRAFT, "draft.toml")
    with pytest.raises(ProfileError) as found:
        profile_file.parse("uncheked = []\n" + DRAFT, "draft.toml")
    assert "did you mean" not in found.value.message
