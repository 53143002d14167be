"""Two profiles of one ship: what makes two ships of it, and what is of no consequence."""

import pytest
import sailing

from shiplog.ship_profile.differences import differences, readings

MINE = sailing.profile()


def with_text(*changes):
    text = sailing.PROFILE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    if "geodetic" in text:
        text = text.replace('unit = "m"', 'unit = "deg"', 1)
    return sailing.profile(text)


def test_a_profile_does_not_differ_from_itself():
    assert differences(MINE, MINE) == () and readings(MINE, MINE) == ()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("length_m = 3.0", "length_m = 3.3", "ship.length_m (3 and 3.3)"),
        (
            "lever_arm_m = [0.7, -0.2]", "lever_arm_m = [-0.7, -0.2]",
            "sensors.position.lever_arm_m ([0.7, -0.2] and [-0.7, -0.2])",
        ),
        ('kind = "local"', 'kind = "geodetic"', "sensors.position.kind (local and geodetic)"),
        (
            'kind = "propeller"', 'kind = "propeller"\nposition_m = [-1.5, 0.2]',
            "actuators.propeller.position_m ([0, 0] and [-1.5, 0.2])",
        ),
        ('kind = "propeller"', 'kind = "thruster"', "actuators.propeller.kind"),
    ],
)  # fmt: skip
def test_sizes_places_and_kinds_make_another_ship(old, new, said):
    (found,) = differences(MINE, with_text((old, new)))
    assert found.startswith(said)


def test_particulars_that_both_state_are_compared_and_an_estimate_is_not():
    heavy = with_text(("length_m = 3.0", "length_m = 3.0\nmass_kg = 244.6"))
    light = with_text(("length_m = 3.0", "length_m = 3.0\nmass_kg = 0.2446"))
    assert differences(heavy, light) == ("ship.mass_kg (244.6 and 0.2446)",)
    assert differences(MINE, light) == ()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('topic = "/gyro"', 'topic = "/compass"'),
        ("sigma = 0.05", "sigma = 0.5"),
        ("limits = [-35.0, 35.0]", "limits = [-40.0, 40.0]"),
    ],
)
def test_topics_accuracies_and_limits_of_a_rudder_are_of_no_consequence(old, new):
    assert differences(MINE, with_text((old, new))) == ()


def test_a_line_to_check_is_of_no_consequence():
    assert differences(MINE, MINE.model_copy(update={"unchecked": ("ship.length_m",)})) == ()


def test_the_same_field_read_in_two_ways_is_named():
    turned = with_text(("sign = -1.0", "sign = 1.0"))
    assert readings(MINE, turned) == ("actuators.rudder",)
    other = with_text(("sign = -1.0", "sign = 1.0"), ('topic = "/rudder"', 'topic = "/helm"'))
    assert readings(MINE, other) == ()


def test_two_sources_that_read_each_others_field_are_named():
    crossed = with_text(
        ('topic = "/rudder"', 'topic = "/other"'), ('field = "angle_deg"', 'field = "other"'),
        ('topic = "/propeller"', 'topic = "/rudder"'),
        ('field = "speed_rpm"', 'field = "angle_deg"'),
        ('topic = "/other"', 'topic = "/propeller"'), ('field = "other"', 'field = "speed_rpm"'),
    )  # fmt: skip
    assert readings(MINE, crossed) == ("actuators.rudder", "actuators.propeller")
