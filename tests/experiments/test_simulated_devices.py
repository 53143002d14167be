"""Actuators of the known ship that do not do as recorded, lines, a tow, fenders: closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pipelines.experiments.simulated_ship import CALM, Effects, Ship, cases, sail
from pipelines.experiments.simulated_ship.devices import DEVICES
from pipelines.experiments.simulated_ship.gear import Faulty, external_of, pulls
from pipelines.experiments.simulated_ship.ship import BANK_EAST

pytestmark = pytest.mark.long  # a simulator of the experiments; the product has its own tests
QUICK = replace(Ship(), rudder_time=0.05, rudder_rate=1e3, propeller_time=0.05)
START = (0.0, 0.4, 0.0, 0.0, 0.5, 0.0)


def sailed(order, *faults, ship=QUICK, seconds=25.0, **external):
    return sail(
        seconds, seed=0, wind=CALM, ship=ship, helm=lambda *_: order, start=START,
        effects=Effects(gear=faults, external=external),
    )  # fmt: skip


def apart(a, b) -> float:
    return float(np.hypot(a.x0 - b.x0, a.y0 - b.y0).max())


@pytest.mark.parametrize(
    ("order", "acts", "faults"),
    [
        ((-0.5, 0.5, 10.0), (-0.2, 0.5, 10.0), (Faulty("rudder_port", limit=0.2),)),
        ((0.3, 0.3, 10.0), (0.3, 0.3, 6.0), (Faulty("propeller", limit=6.0),)),
        ((0.3, 0.3, 10.0), (0.3, 0.3, 8.5), (Faulty("propeller", dead=1.5),)),
        ((0.3, 0.3, 10.0), (0.3, 0.2, 10.0), (Faulty("rudder_starboard", play=0.1),)),
        ((0.3, 0.2, 10.0), (0.3, 0.29, 10.0), (Faulty("rudder_starboard", share=0.3),)),
        ((0.3, 0.3, 10.0), (0.3, 0.3, 5.0), (Faulty("propeller", stand=5.0, since=0, until=2),)),
        ((0.4, 0.4, 10.0), (0.2, 0.1, 10.0), (
            Faulty("rudder_port", limit=0.2), Faulty("rudder_starboard", limit=0.1))),
    ],
)  # fmt: skip
def test_a_faulty_unit_acts_as_another_order_and_records_its_own(order, acts, faults):
    faulty, other, free = sailed(order, *faults), sailed(acts), sailed(order)
    assert apart(faulty, other) < 0.06 * apart(free, other)
    for name in ("rudder_port", "rudder_starboard", "propeller"):
        assert np.array_equal(getattr(faulty, name), getattr(free, name))


def test_a_slow_unit_is_one_of_a_smaller_rate():
    rate = math.radians(3.0)
    slow = replace(QUICK, rudder_rate=rate)
    order = (0.5, 0.5, 10.0)
    both = (Faulty("rudder_port", rate=rate), Faulty("rudder_starboard", rate=rate))
    faulty = sailed(order, *both)
    assert apart(faulty, sailed(order, ship=slow)) < 0.03 * apart(faulty, sailed(order))


def test_what_pulls_from_outside_by_hand():
    def of(at_north, at_east, psi, campaign=0.0, **given):
        return pulls(external_of(given), BANK_EAST, 0.5, at_north, at_east, psi, campaign)

    spring = {"stiffness": 0.5, "length": 4.0, "north": 10.0, "line_at": 1.0}
    assert of(7.0, 0.0, 0.0, **spring) == (0.0, 0.0, 0.0)  # slack
    assert of(0.0, 0.0, 0.0, **spring) == pytest.approx((0.5 * 5.0, 0.0, 0.0))
    far = math.hypot(10.0, 1.0)  # heading west: the end is 1 m west of midship
    side = 0.5 * (far - 4.0) * 10.0 / far
    x, y, n = of(0.0, 0.0, -math.pi / 2, **spring)
    assert (y, n) == pytest.approx((side, side)) and x == pytest.approx(-side / 10.0)
    winch = {"force": 2.0, "length": 4.0, "north": 10.0}
    assert of(0.0, 0.0, math.pi, **winch) == pytest.approx((-2.0, 0.0, 0.0), abs=1e-9)
    tow = {"tow": 2.0, "towards": 1.0, "turning": 2.0, "tow_at": -1.2}
    assert of(3.0, 5.0, 2.0, 0.5, **tow) == pytest.approx((2.0, 0.0, 0.0), abs=1e-12)
    assert of(3.0, 5.0, 2.0 - math.pi / 2, 0.5, **tow) == pytest.approx((0, 2.0, -2.4), abs=1e-12)
    fender = {"fender": 8.0, "reach": 2.0}
    assert of(0, 38.75, 0.0, **fender) == pytest.approx((0.0, -4.0, 0.0))  # a gap of 1 m
    assert of(0, 37.0, 0.0, **fender) == (0.0, 0.0, 0.0)


def test_who_calls_at_the_wall_leans_on_it_and_does_not_go_through():
    case = cases.draw(3, cause="contact", size=1.0)
    v = cases.voyage(case, case.trial[1])
    gap = BANK_EAST - 0.5 * case.ship.breadth - v.y0
    assert 0.01 < np.mean(gap < case.effects.external["reach"]) < 0.4
    assert gap.min() > -0.3


@pytest.mark.parametrize("name", DEVICES)
def test_every_device_reaches_the_trial_alone_and_says_its_unit(name):
    full, none = cases.draw(12, cause=name, size=1.0), cases.draw(12, cause="none")
    (cause,) = full.causes
    assert (cause.name, cause.family, full.verdict) == (name.partition(":")[0], None, "named")
    assert (full.ship, full.laws, full.nominal, full.trial) == (
        none.ship, none.laws, none.nominal, none.trial
    )  # fmt: skip
    assert full.effects != none.effects == full.ordinary
    if name.startswith("actuator"):
        units = ("rudder_port", "rudder_starboard", "propeller")
        assert cause.parameters["actuator"]["value"] in units


def test_two_faulty_units_are_both_there():
    case = cases.draw(12, cause="actuator_limit:drive+actuator_rate:steering", size=1.0)
    assert {one.unit for one in case.effects.gear} > {"propeller"} and len(case.effects.gear) == 2
