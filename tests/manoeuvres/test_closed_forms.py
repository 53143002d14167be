"""Quantities against what can be worked out by hand, to 1e-6."""

import math

import numpy as np
import pytest
from exact_ships import Nomoto

from shiplog.manoeuvres import drift, steadiness, stopping, turning, zigzags
from shiplog.manoeuvres.track import Track

LENGTH = 100.0
WITHIN = 1e-6


def circle(radius, speed, beta=0.0, step=1.0, turns=2.2, side=1.0, approach=20.0, first=0.7,
           flow=(0.0, 0.0)):  # fmt: skip
    """Straight ahead, then at once on a circle, with drift angle β (bow inwards) from there on."""
    time = np.arange(-approach, turns * 2.0 * math.pi * radius / speed, step)
    on = np.maximum(time, 0.0)
    rate = speed / radius
    course = first + side * rate * on  # of the velocity
    state = np.zeros((len(time), 6))
    ahead = np.where(time < 0.0, speed * time, radius * np.sin(rate * on))
    across = side * radius * (1.0 - np.cos(rate * on))
    c, s = math.cos(first), math.sin(first)
    state[:, 0] = c * ahead - s * across + flow[0] * time
    state[:, 2] = s * ahead + c * across + flow[1] * time
    drifting = np.where(time > 0.0, side * beta, 0.0)
    state[:, 4] = course + drifting
    u, v = speed * np.cos(drifting), -speed * np.sin(drifting)
    cos, sin = np.cos(state[:, 4]), np.sin(state[:, 4])
    state[:, 1] = u + cos * flow[0] + sin * flow[1]
    state[:, 3] = v - sin * flow[0] + cos * flow[1]
    state[:, 5] = np.where(time >= 0.0, side * rate, 0.0)
    rudder = np.where(time >= 0.0, side * math.radians(35.0), 0.0)
    return Track(time, state, rudder, np.ones(len(time)), LENGTH)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["starboard", "port"])
@pytest.mark.parametrize("radius", [150.0, 400.0])
def test_a_circle_has_its_radius(radius, side):
    found = turning.quantities(circle(radius, 5.0, side=side), 0.0, side)
    assert found["advance"] == pytest.approx(radius / LENGTH, abs=WITHIN)
    assert found["transfer"] == pytest.approx(radius / LENGTH, abs=WITHIN)
    assert found["tactical_diameter"] == pytest.approx(2.0 * radius / LENGTH, abs=WITHIN)
    assert found["steady_diameter"] == pytest.approx(2.0 * radius / LENGTH, abs=WITHIN)
    assert found["speed_loss"] == pytest.approx(0.0, abs=WITHIN)
    assert found["drift_angle"] == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["starboard", "port"])
def test_the_bow_points_into_the_circle_by_the_drift_angle(side):
    found = turning.quantities(circle(200.0, 5.0, beta=math.radians(12.0), side=side), -1.0, side)
    assert found["drift_angle"] == pytest.approx(12.0, abs=1e-6)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["starboard", "port"])
def test_a_current_is_found_and_taken_out(side):
    flow = (0.4, -0.25)
    track = circle(200.0, 5.0, side=side, flow=flow)
    found = drift.of_turn(track, 0.0, side)
    assert found.velocity == pytest.approx(flow, abs=2e-4)
    still = turning.quantities(track.without(np.array(flow)), 0.0, side)
    assert still["tactical_diameter"] == pytest.approx(4.0, abs=WITHIN)
    over_ground = turning.quantities(track, 0.0, side)
    assert abs(over_ground["tactical_diameter"] - 4.0) > 0.1


@pytest.mark.parametrize("turned", [100.0, 200.0, 300.0, 460.0])
def test_a_turn_that_is_too_short_shows_no_current(turned):
    assert drift.of_turn(circle(200.0, 5.0, turns=turned / 360.0), 0.0, 1.0) is None


def test_a_part_of_a_turn_gives_what_it_has():
    assert not turning.quantities(circle(200.0, 5.0, turns=80.0 / 360.0), 0.0, 1.0)
    found = turning.quantities(circle(200.0, 5.0, turns=120.0 / 360.0), 0.0, 1.0)
    assert set(found) == {"advance", "transfer"}
    found = turning.quantities(circle(200.0, 5.0, turns=300.0 / 360.0), 0.0, 1.0)
    assert {"advance", "tactical_diameter", "steady_diameter"} <= set(found)


@pytest.mark.parametrize("angle, heading", [(10.0, 10.0), (20.0, 20.0), (5.0, 1.0), (35.0, 5.0)])
@pytest.mark.parametrize("mirrored", [1.0, -1.0], ids=["starboard", "port"])
def test_overshoots_of_a_nomoto_ship_are_exact(angle, heading, mirrored):
    ship = Nomoto(0.08, 12.0, math.radians(angle), math.radians(heading), speed=4.0)
    peaks = [ship.peak(k) for k in (1, 2, 3, 4)]
    time, state, rudder = ship.sampled(0.1, peaks[3][0] + 10.0)
    state[:, [2, 4, 5]] *= mirrored
    track = Track(time, state, mirrored * rudder, np.ones(len(time)), LENGTH)
    found = zigzags.quantities(track, ship.orders, mirrored, math.radians(angle))
    for name, (_, peak) in zip(zigzags.ORDINALS, peaks, strict=False):
        over = math.degrees(abs(peak)) - heading
        assert found[f"{name}_overshoot"] == pytest.approx(over, abs=WITHIN), name
    assert found["check_time"] == pytest.approx(peaks[0][0] - ship.orders[1], abs=WITHIN)
    assert found["period"] == pytest.approx(peaks[2][0] - peaks[0][0], abs=WITHIN)
    if angle == 10.0:  # ψ = Kδ (t - T (1 - e^(-t/T))) at the first order back
        assert found["initial_turning"] == pytest.approx(4.0 * ship.orders[1] / LENGTH, abs=WITHIN)
    else:
        assert "initial_turning" not in found


def test_a_zigzag_with_one_reversal_has_one_overshoot():
    ship = Nomoto(0.08, 12.0, math.radians(20.0), math.radians(20.0), speed=4.0)
    end = 0.5 * (ship.peak(1)[0] + ship.orders[2])
    time, state, rudder = ship.sampled(0.1, end)
    track = Track(time, state, rudder, np.ones(len(time)), LENGTH)
    found = zigzags.quantities(track, ship.orders[:2], 1.0, math.radians(20.0))
    assert set(found) == {"first_overshoot", "check_time"}


def test_a_stop_at_a_constant_rate_reaches_half_the_square():
    """U²/(2 a), along and ahead; the course across the heading is a deviation."""
    speed, rate, beta = 8.0, 0.05, math.radians(30.0)
    time = np.arange(0.0, 170.0, 0.1)
    moving = np.minimum(time, speed / rate)
    u = speed - rate * time
    state = np.zeros((len(time), 6))
    gone = speed * moving - 0.5 * rate * moving**2
    state[:, 0], state[:, 2] = gone * math.cos(beta), gone * math.sin(beta)
    state[:, 1], state[:, 4] = np.where(u > 0.0, u, u), beta
    track = Track(time, state, np.zeros(len(time)), -np.ones(len(time)), LENGTH)
    found = stopping.quantities(track, 0.0)
    reach = speed**2 / (2.0 * rate) / LENGTH
    assert found["track_reach"] == pytest.approx(reach, abs=WITHIN)
    assert found["head_reach"] == pytest.approx(reach, abs=WITHIN)
    assert found["lateral_deviation"] == pytest.approx(0.0, abs=WITHIN)
    assert stopping.quantities(track.between(0.0, 100.0), 0.0) == {}


def test_the_loop_of_a_spiral_lies_between_the_zeros_of_both_ways():
    """Of straight branches r = s (δ - δ₀) with δ₀ = ∓2 deg."""

    def rate(angle, zero):
        return 0.1 * math.radians(angle - zero)

    there = [(math.radians(a), rate(a, -2.0)) for a in (15.0, 10.0, 5.0, 0.0, -5.0, -10.0)]
    back = [(math.radians(a), rate(a, 2.0)) for a in (-15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0)]
    assert steadiness.loop([*there, *back])["loop_width"] == pytest.approx(4.0, abs=WITHIN)
    stable = [(math.radians(a), rate(a, 0.5)) for a in (10, 5, 1, -1, -5, -10, -5, -1, 1, 5, 10)]
    assert steadiness.loop(stable)["loop_width"] == pytest.approx(0.0, abs=WITHIN)
    assert steadiness.loop(stable[:3]) == {}
