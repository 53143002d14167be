"""IMO MSC.137(76), 5.3, as a table: the resolution's numbers, written out."""

import math

import pytest

from shiplog.manoeuvres import criteria

# L/V in s: first and second overshoot of a 10/10 zigzag in deg
TEN = [
    (5.0, 10.0, 25.0), (9.99, 10.0, 25.0), (10.0, 10.0, 25.0), (15.0, 12.5, 28.75),
    (20.0, 15.0, 32.5), (25.0, 17.5, 36.25), (29.99, 19.995, 39.9925), (30.0, 20.0, 40.0),
    (40.0, 20.0, 40.0),
]  # fmt: skip


@pytest.mark.parametrize("length_time, first, second", TEN)
def test_overshoots_of_ten_ten(length_time, first, second):
    assert criteria.first_overshoot(length_time) == pytest.approx(first)
    assert criteria.second_overshoot(length_time) == pytest.approx(second)
    ten, length = math.radians(10.0), 200.0
    for name, value in (("first_overshoot", first), ("second_overshoot", second)):
        one = criteria.limit(name, "zigzag", ten, ten, length, length / length_time)
        assert one.applies and one.value == pytest.approx(value)


def degrees(*values):
    return [math.radians(v) for v in values]


@pytest.mark.parametrize(
    "name, kind, angle, heading, value, clause",
    [
        ("advance", "turn", 35.0, 0.0, 4.5, "5.3.1"),
        ("tactical_diameter", "turn", 35.0, 0.0, 5.0, "5.3.1"),
        ("initial_turning", "zigzag", 10.0, 10.0, 2.5, "5.3.2"),
        ("first_overshoot", "zigzag", 20.0, 20.0, 25.0, "5.3.3.3"),
        ("track_reach", "stop", 0.0, 0.0, 15.0, "5.3.4"),
    ],
)
def test_limits_that_are_numbers(name, kind, angle, heading, value, clause):
    one = criteria.limit(name, kind, *degrees(angle, heading), 180.0, 8.0)
    assert (one.value, one.clause, one.applies) == (value, clause, True)


def test_what_has_no_limit():
    ten, twenty = degrees(10.0, 20.0)
    assert criteria.limit("transfer", "turn", math.radians(35.0), 0.0, 180.0, 8.0) is None
    assert criteria.limit("second_overshoot", "zigzag", twenty, twenty, 180.0, 8.0) is None
    assert criteria.limit("first_overshoot", "zigzag", ten, twenty, 180.0, 8.0) is None
    assert criteria.limit("third_overshoot", "zigzag", ten, ten, 180.0, 8.0) is None


@pytest.mark.parametrize("length, applies", [(99.9, False), (100.0, True), (320.0, True)])
def test_short_ships_are_not_meant(length, applies):
    one = criteria.limit("advance", "turn", math.radians(35.0), 0.0, length, 8.0)
    assert one.applies is applies
    assert bool(one.why_not) is not applies
    assert "chemical tankers" in one.why_not or applies


def test_a_turn_with_less_rudder_and_a_stop_by_coasting_are_not_meant():
    twenty = criteria.limit("advance", "turn", math.radians(20.0), 0.0, 180.0, 8.0)
    assert not twenty.applies and "35" in twenty.why_not
    coasting = criteria.limit("track_reach", "stop", 0.0, 0.0, 180.0, 8.0, astern=False)
    assert not coasting.applies and "astern" in coasting.why_not
