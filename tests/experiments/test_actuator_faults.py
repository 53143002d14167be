"""Faults of actuators in measured records: the order that is written leads, through the fault, back
to what acted."""

import numpy as np
import pytest

from pipelines.experiments.findings import actuator_faults
from shiplog.exceptions import ShiplogError

TIME = np.arange(0.0, 60.0, 0.1)


def zigzag(rate=0.2, most=0.35):
    """Ramps of one rate between two plateaus."""
    wanted = most * np.sign(np.sin(2.0 * np.pi * TIME / 20.0 + 0.1))
    acted = np.zeros(len(TIME))
    for i in range(1, len(TIME)):
        acted[i] = acted[i - 1] + np.clip(wanted[i] - acted[i - 1], -0.1 * rate, 0.1 * rate)
    return acted, wanted


def test_a_stop_s_order_is_larger_at_the_stop_alone():
    acted, _ = zigzag()
    order = actuator_faults.beyond_stop(acted, 0.35, 0.5)
    assert np.clip(order, -0.35, 0.35) == pytest.approx(acted, abs=0.03 * 0.35)
    assert np.abs(order).max() == 0.5 and np.mean(order != acted) > 0.5
    with pytest.raises(ShiplogError, match="beyond the limit"):
        actuator_faults.beyond_stop(acted, 0.3, 0.5)


def test_a_ramp_s_order_is_the_step_that_it_follows():
    acted, wanted = zigzag()
    order = actuator_faults.before_ramps(acted, TIME, 0.2)
    followed = np.zeros(len(TIME))
    for i in range(1, len(TIME)):
        followed[i] = followed[i - 1] + np.clip(order[i] - followed[i - 1], -0.02, 0.02)
    assert followed == pytest.approx(acted, abs=0.021)  # within one row of its rate
    assert np.mean(np.abs(order - wanted) < 0.03) > 0.97
    with pytest.raises(ShiplogError, match="cannot be written"):
        actuator_faults.before_ramps(wanted, TIME, 0.2)  # what jumps has no rate


def test_a_dead_zone_and_backlash_lead_back_to_what_acted():
    acted = 0.4 * np.sin(2.0 * np.pi * TIME / 13.0) * (TIME > 5.0)
    order = actuator_faults.before_dead_zone(acted, 0.1)
    assert order - np.clip(order, -0.1, 0.1) == pytest.approx(acted, abs=1e-3)
    order = actuator_faults.before_backlash(acted, 0.05)
    stands, followed = 0.0, []
    for x in order:
        stands = min(max(stands, x - 0.05), x + 0.05)
        followed.append(stands)
    assert np.array(followed) == pytest.approx(acted, abs=1e-3)
