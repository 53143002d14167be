"""When a rudder was ordered over, from gears whose motion is known in closed form."""

import math

import numpy as np
import pytest

from shiplog.manoeuvres.holds import holds, ordered
from shiplog.manoeuvres.track import Track

ORDER = 60.0  # s


def moved(time, angle, stood, rate, lag):
    """δ [deg] of dδ/dt = clip((angle - δ)/lag, ±rate): a line, then an exponential."""
    way, t = angle - stood, np.maximum(time - ORDER, 0.0)
    limited = max(abs(way) - rate * lag, 0.0)  # deg that are gone at the full rate
    slow = (abs(way) - limited) * np.exp(-np.maximum(t - limited / rate, 0.0) / max(lag, 1e-9))
    return stood + math.copysign(1.0, way) * np.where(t < limited / rate, rate * t, abs(way) - slow)


def found(rudder, time, base=0.0):
    track = Track(time, np.zeros((len(time), 6)), np.radians(rudder), np.ones(len(time)), 100.0)
    last = holds(track, 20.0)[-1]
    return ordered(track, ORDER - 40.0, last, math.radians(base))


@pytest.mark.parametrize("stood", [0.0, 1.0, -1.0])
@pytest.mark.parametrize("angle", [10.0, -20.0, 35.0])
@pytest.mark.parametrize("rate, lag", [(2.3, 2.0), (4.0, 2.0), (6.7, 1.0), (3.0, 1e-6)])
def test_a_gear_that_slows_down_towards_the_angle_ordered(rate, lag, angle, stood):
    """By the line through 0.2 to 0.8 of the way, 10 deg at 4 deg/s are found 0.7 s too early."""
    time = np.arange(0.0, 120.0, 0.1)
    assert found(moved(time, angle, stood, rate, lag), time) == pytest.approx(ORDER, abs=0.15)


def test_a_feedback_in_half_degrees():
    time = np.arange(0.0, 120.0, 0.1)
    shown = np.round(2.0 * moved(time, 10.0, 0.0, 4.0, 2.0)) / 2.0
    assert found(shown, time) == pytest.approx(ORDER, abs=0.2)


@pytest.mark.parametrize("base", [1.2, -6.0, -12.0])
def test_a_record_that_begins_with_the_order(base):
    """The mean angle before it is then one of its way."""
    time = np.arange(59.5, 120.0, 0.1)
    shown = moved(time, -35.0, 1.2, 16.0, 1e-6)
    assert found(shown, time, base) == pytest.approx(ORDER, abs=0.1)


def test_a_way_of_one_step_begins_at_the_last_sample_before_it():
    time = np.arange(0.0, 120.0, 0.1)
    assert found(np.where(time < ORDER + 0.05, 0.0, 10.0), time) == pytest.approx(ORDER, abs=0.051)
