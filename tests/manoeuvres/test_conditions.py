"""Whether a manoeuvre is of the standard: MSC.137(76), 4 and MSC/Circ.1053."""

import math

import pytest

from shiplog.manoeuvres import conditions
from shiplog.manoeuvres.conditions import Conditions
from shiplog.manoeuvres.recognition import Approach, Found
from shiplog.manoeuvres.track import Track
from shiplog.ship_profile import file as profiles


@pytest.mark.parametrize(
    "wind, number",  # m/s at 10 m (WMO): the range of each number
    [(0.1, 0), (1.0, 1), (2.5, 2), (4.4, 3), (6.7, 4), (8.1, 5), (10.6, 5), (10.9, 6), (17.3, 8)],
)  # fmt: skip
def test_beaufort(wind, number):
    assert conditions.beaufort(wind) == number


def manoeuvre(kind="turn", angle=35.0, heading=0.0, part="", **approach):
    usual = {"speed": 8.0, "yaw": 0.01, "rudder": 0.01, "gained": 0.0, "screw": 1.0}
    steady = Approach(**(usual | approach))
    none = Track(*([None] * 4), 320.0)  # type: ignore[arg-type]
    return Found("trip", kind, 10.0, 99.0, 1.0, math.radians(angle), math.radians(heading), (10.0,),
                 none, steady, part)  # fmt: skip


def why(found, wind=3.0, depth=200.0, usual=8.0, scale=1.0):
    profile = profiles.load("kvlcc2-full-scale")
    cond = Conditions(8.0, wind, 0.0, depth, None, ())
    return " ".join(conditions.why_not(found, cond, profile, usual, scale))


def test_a_standard_turn_is_one():
    assert why(manoeuvre()) == ""
    assert why(manoeuvre("zigzag", 10.0, 10.0)) == why(manoeuvre("zigzag", 20.0, 20.0)) == ""


@pytest.mark.parametrize(
    "found, how, says",
    [
        (manoeuvre(angle=20.0), {}, "20 deg"),
        (manoeuvre("zigzag", 15.0, 15.0), {}, "15/15"),
        (manoeuvre(), {"wind": 11.0}, "6 Bft"),
        (manoeuvre(), {"wind": 3.0, "scale": 25.0}, "15 m/s"),  # a model's wind, times 5
        (manoeuvre(), {"depth": 60.0}, "2.9 T"),  # T = 20.8 m
        (manoeuvre(speed=7.0), {}, "90 %"),
        (manoeuvre(yaw=0.2), {}, "not steady"),
        (manoeuvre(gained=0.1), {}, "+10%"),
        (manoeuvre(part="one reversal"), {}, "one reversal"),
    ],
)
def test_what_keeps_it_from_being_one(found, how, says):
    assert says in why(found, **how)
