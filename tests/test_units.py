"""Units against their definitions, and there and back again."""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shiplog.exceptions import ProfileError
from shiplog.nomenclature import units
from shiplog.ship_profile.profile import Column, Source

TURN = Fraction("6.283185307179586476925286766559")  # rad
# NIST SP 811, Appendix B; a servo's full command is 400 us of its pulse.
DEFINED = {
    "1": 1, "%": Fraction(1, 100), "permille": Fraction(1, 1000),
    "m": 1, "cm": Fraction(1, 100), "mm": Fraction(1, 1000), "km": 1000,
    "ft": Fraction(3048, 10_000),
    "m/s": 1, "cm/s": Fraction(1, 100), "mm/s": Fraction(1, 1000), "km/h": Fraction(1000, 3600),
    "mph": Fraction(1_609_344, 3_600_000), "kn": Fraction(1852, 3600),
    "knots": Fraction(1852, 3600),
    "rad": 1, "deg": TURN / 360, "rad/s": 1, "deg/s": TURN / 360, "deg/min": TURN / 360 / 60,
    "rps": 1, "rev/s": 1, "rpm": Fraction(1, 60), "pwm": Fraction(1, 400),
    "s": 1, "ms": Fraction(1, 1000), "us": Fraction(1, 10**6), "ns": Fraction(1, 10**9),
    "min": 60, "h": 3600, "d": 86_400,
}  # fmt: skip


def test_every_unit_is_as_it_is_defined():
    assert units.TO_SI.keys() == DEFINED.keys()
    for unit, factor in units.TO_SI.items():
        assert factor == pytest.approx(float(DEFINED[unit]), rel=1e-15), unit


def test_every_unit_measures_one_thing():
    named = [unit for of_one in units.MEASURES.values() for unit in of_one]
    assert sorted(named) == sorted(DEFINED)
    assert units.measure("kn") == "speed" and units.measure("furlong") is None


@given(
    value=st.floats(-1e6, 1e6), offset=st.floats(-1e3, 1e3),
    sign=st.sampled_from([1.0, -1.0, 0.5, -12.0]), unit=st.sampled_from(sorted(DEFINED)),
)  # fmt: skip
@settings(max_examples=60, deadline=None)
def test_what_a_profile_makes_of_a_number_is_undone_by_the_definition(value, offset, sign, unit):
    source = Source(topic="/rudder", field="angle", unit=unit, sign=sign, offset=offset)
    ((zero, factor),) = source.scale()
    si = (value - zero) * factor
    back = si / (sign * float(DEFINED[unit])) + offset
    assert back == pytest.approx(value, abs=1e-9 * (abs(value) + abs(offset) + 1.0))


def cased(unit):
    return {unit.upper(), unit.title(), unit.swapcase(), unit.capitalize()} - set(units.CASED)


@pytest.mark.parametrize("unit", sorted(DEFINED))
def test_a_profile_takes_a_unit_in_any_letter_case(unit):
    for written in cased(unit):
        source = Source(topic="/a", fields=("b", "c"), units=(written, written))
        assert source.units == (unit, unit)
        ((zero, factor),) = Source(topic="/a", field="b", unit=written).scale()
        assert (zero, factor) == (0.0, units.factor(unit))
        assert Column(channel="time", unit=written).unit == unit


def test_no_two_units_differ_by_letter_case_alone():
    assert len({unit.lower() for unit in DEFINED}) == len(DEFINED)


@pytest.mark.parametrize(("unit", "meant"), [("kN", "kilonewtons"), ("M", "nautical miles")])
def test_where_case_decides_a_unit_is_not_guessed(unit, meant):
    with pytest.raises(ProfileError, match=meant):
        Source(topic="/a", field="b", unit=unit).scale()
