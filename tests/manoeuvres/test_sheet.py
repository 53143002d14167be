"""A sheet's columns, its scale, and what a table shows of an interval."""

import pytest

from shiplog.manoeuvres.entry import lines_of
from shiplog.manoeuvres.quantity import QUANTITIES, Estimate
from shiplog.report.manoeuvres.sheet import limit, met, value
from shiplog.ship_profile import file as profiles

KVLCC2 = profiles.load("kvlcc2")  # 7 m, of a ship of 320 m


def columns(**named):
    return {name: Estimate(x, 0.9 * x, 1.1 * x) for name, x in named.items()}


def test_froudes_law_scales_times_and_rates_and_nothing_else():
    every = columns(**dict.fromkeys(QUANTITIES, 2.0))

    def by_name(scale):
        made = lines_of("zigzag", 0.17, 0.17, KVLCC2, 1.2, scale, every, None, None)
        return {line.name: line for line in made}

    one, ship = by_name(1.0), by_name(49.0)
    factor = {"s": 7.0, "deg/s": 1.0 / 7.0}
    for name, line in ship.items():
        wanted = factor.get(QUANTITIES[name].unit, 1.0)
        for end in ("value", "low", "high"):
            was = getattr(one[name].measured, end)
            assert getattr(line.measured, end) == pytest.approx(wanted * was), name


def test_a_models_limits_are_those_of_the_ship():
    """7 m: not meant. 343 m and 8.4 m/s: L/V is 40.8 s, and the overshoot may be 20 deg."""
    over = columns(first_overshoot=15.0)
    ten = 0.17453
    (model,) = lines_of("zigzag", ten, ten, KVLCC2, 1.2, 1.0, over, None, None)
    (ship,) = lines_of("zigzag", ten, ten, KVLCC2, 1.2, 49.0, over, None, None)
    assert not model.limit.applies and met(model) is None and limit(model).startswith("(")
    assert ship.limit.applies and ship.limit.value == 20.0 and met(ship) is True
    (worse,) = lines_of("zigzag", ten, ten, KVLCC2, 1.2, 49.0, columns(first_overshoot=21.0),
                        None, None)  # fmt: skip
    assert met(worse) is False


def test_what_was_not_measured_is_not_listed_of_a_record():
    simulated = columns(advance=3.0, transfer=1.5)
    found = lines_of("turn", 0.61, 0.0, KVLCC2, 1.2, 1.0, columns(advance=3.1), simulated, None)
    assert [line.name for line in found] == ["advance"]
    alone = lines_of("turn", 0.61, 0.0, KVLCC2, 1.2, 1.0, None, simulated, None)
    assert [line.name for line in alone] == ["advance", "transfer"]


@pytest.mark.parametrize(
    "estimate, text",
    [
        (Estimate(3.018, 2.5, 3.6), "3.0 (2.5 to 3.6)"),
        (Estimate(3.018, 2.95, 3.09), "3.02 (2.95 to 3.09)"),
        (Estimate(3.018, 3.0179, 3.0181), "3.02"),
        (Estimate(47.3, 30.0, 60.0), "47 (30 to 60)"),
        (Estimate(3.018, 2.5, 3.6, "outside the training data"), "3.0* (2.5 to 3.6)"),
        (None, "-"),
    ],
)
def test_an_interval_decides_its_digits(estimate, text):
    assert value(estimate) == text
