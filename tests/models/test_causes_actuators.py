"""What acts of an actuator's order: closed forms, and loops that walk row by row."""

import math
from dataclasses import replace

import closed
import numpy as np
import pytest
from cause_ships import BY, TWIN, setting

from shiplog.models import causes as catalogue
from shiplog.models.causes import Orders
from shiplog.models.causes import actuator_response as response

RECORD = closed.record(TWIN)
ROWS = len(RECORD)
TIME = np.arange(ROWS) * RECORD.step
RAMP, SINE = np.minimum(TIME, 40.0)[:, None], 10.0 * np.sin(0.2 * TIME)[:, None]


def test_a_limit_cuts_both_ways():
    assert response.limited(SINE, 0.25) == pytest.approx(np.clip(SINE, -4.0, 4.0))
    assert response.limited(SINE, 0.0) is SINE


def test_a_ramp_through_play_is_half_of_it_late():
    """Up by 1 a second, 3 wide: 1.5 behind; after the turn nothing moves until 3 are gone."""
    after = response.play(RECORD, RAMP, 3.0)
    assert after[100:400] == pytest.approx(RAMP[100:400] - 1.5)
    back = np.concatenate((RAMP[:300], RAMP[300] - RAMP[: ROWS - 300]))
    after = response.play(RECORD, back, 3.0)[:, 0]
    stood = np.flatnonzero(np.isclose(after, 30.0 - 0.1 - 1.5) | np.isclose(after, 30.0 - 1.5))
    assert (stood[-1] - stood[0]) * RECORD.step == pytest.approx(3.0, abs=0.3)


def test_a_dead_zone_moves_the_rest_towards_zero():
    after = response.dead_zone(SINE, 4.0)
    assert after == pytest.approx(np.sign(SINE) * np.maximum(np.abs(SINE) - 2.0, 0.0))
    assert response.dead_zone(after, -4.0)[np.abs(SINE) > 2.0] == pytest.approx(
        SINE[np.abs(SINE) > 2.0]
    )


def test_a_rate_turns_a_step_into_a_ramp_and_leaves_what_is_slow():
    """A step of 6 at 2 a second takes 3 s; a ramp of 1 a second is left as it is."""
    step = np.where(TIME[:, None] >= 10.0, 6.0, 0.0)
    after = response.rate_limited(RECORD, step, 0.5)
    late = np.clip(2.0 * (TIME - 10.0 + RECORD.step), 0.0, 6.0)[:, None]
    assert after == pytest.approx(late, abs=1e-9)
    assert response.rate_limited(RECORD, RAMP, 0.5) == pytest.approx(RAMP)


def test_a_lag_of_a_ramp_is_its_time_late():
    """T ẏ = t - y from balance: y = t - T (1 - e^(-t/T))."""
    after = response.lagged(RECORD, RAMP, 2.0)[:300, 0]
    t = TIME[:300]
    assert after == pytest.approx(t - 2.0 * (1.0 - np.exp(-t / 2.0)), abs=1e-9)


@pytest.mark.parametrize("of", ("play", "rate_limited"))
def test_a_stretch_begins_anew(of):
    """Nothing of one stretch is left in the next one."""
    starts = np.zeros(ROWS, bool)
    starts[[0, 500]] = True
    cut = replace(RECORD, starts=starts)
    jump = np.where(TIME[:, None] >= TIME[500], 7.0, 0.0)
    assert getattr(response, of)(cut, jump, 2.0) == pytest.approx(jump)


def orders(**columns) -> Orders:
    """Of an order by name, 1 for the others' extent."""
    names = TWIN.actuator_names
    values = np.stack([np.resize(columns.get(n, [0.0, 0.0]), ROWS) for n in names], 1)
    return Orders.of(replace(RECORD, actuator=values))


def test_what_never_moved_is_not_testable():
    """An order that is constant says nothing of its unit; one that moves is tested by itself."""
    still = replace(setting(), orders=orders(propeller=[3.0, 3.0], rudder_port=[0.5, -0.5]))
    for name in ("actuator_limit", "actuator_rate", "actuator_dead_band", "actuator_stuck"):
        assert [c.units for c in BY[name].each(still)] == [("rudder_port",)]
    nothing = replace(setting(), orders=orders())
    chosen, untested = catalogue.testable(nothing)
    assert not [c for c in chosen if c.name.startswith("actuator")]
    assert "no actuator's order moves" in untested["actuator_limit"]
    assert "orders that differ" in untested["actuators_exchanged"]


def test_units_with_one_order_cannot_be_exchanged():
    one = replace(setting(), orders=orders(rudder_port=[0.5, -0.5], rudder_starboard=[0.5, -0.5]))
    assert BY["actuators_exchanged"].each(one) == BY["actuator_coupling"].each(one) == ()
    two = replace(setting(), orders=orders(rudder_port=[0.5, -0.5], rudder_starboard=[0.1, 0.3]))
    (pair,) = BY["actuators_exchanged"].each(two)
    assert len(BY["actuator_coupling"].each(two)) == 2
    after = pair.read(RECORD, np.ones(1)).actuator
    assert after[:, [1, 0, 2]] == pytest.approx(RECORD.actuator)


def test_a_limit_is_displayed_in_degrees_and_is_of_size_below_the_orders():
    two = replace(setting(), orders=orders(rudder_port=[0.5, -0.5], rudder_starboard=[0.1, 0.3]))
    (all_of, port, _) = BY["actuator_limit"].each(two)
    assert (all_of.label, port.label) == ("actuator_limit:rudders", "actuator_limit:rudder_port")
    value, unit = port.displayed(np.array([1.0 / 0.2]))["limit"]
    assert (float(value), unit) == (pytest.approx(math.degrees(0.2)), "deg")
    assert port.practical(np.array([1.0 / 0.2]), two)
    assert not port.practical(np.array([1.0 / 0.49]), two)  # 98 % of what was ordered
    assert not all_of.compatible(port.label) and not port.compatible(all_of.label)
    assert port.compatible("actuator_limit:rudder_starboard")


def test_a_stuck_unit_stays_at_its_value_in_its_quarter():
    two = replace(setting(), orders=orders(rudder_port=[0.5, -0.5]))
    (stuck,) = BY["actuator_stuck"].each(two)
    numbers = np.array([0.0, 1.0, 0.0, 0.0, 0.25])
    after, before = stuck.read(RECORD, numbers).actuator, RECORD.actuator
    second = (RECORD.share >= 0.25) & (RECORD.share < 0.5)
    assert second.any()
    assert after[second, 0] == pytest.approx(0.25)
    assert np.array_equal(after[~second], before[~second])
    assert np.array_equal(after[:, 1:], before[:, 1:])
