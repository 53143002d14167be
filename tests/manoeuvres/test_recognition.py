"""Manoeuvres are found in the motion of a Nomoto ship whose rudder takes its time."""

import math

import numpy as np
import pytest

from shiplog.manoeuvres import recognition
from shiplog.manoeuvres.track import Track

LENGTH, SPEED, STEP = 100.0, 5.0, 0.1
K, T, GEAR = 0.08, 12.0, math.radians(3.0)  # 1/s, s, rad/s


def sailed(orders, seconds, seed=0, screw=lambda t: 1.0, noise=0.1):
    """`orders(t, ψ)` in degrees, and a feedback that counts in half degrees, in SI."""
    rng = np.random.default_rng(seed)
    count = int(seconds / STEP)
    time, state = np.arange(count) * STEP, np.zeros((count, 6))
    rudder, driven = np.zeros(count), np.zeros(count)
    psi = r = delta = x = y = 0.0
    u = SPEED
    for k in range(count):
        state[k] = x, u, y, 0.0, psi, r
        rudder[k], driven[k] = delta, screw(time[k])
        way = math.radians(orders(time[k], math.degrees(psi))) - delta
        delta += math.copysign(min(abs(way), GEAR * STEP), way)
        u += STEP * (0.01 * (driven[k] * SPEED - u) if driven[k] > 0.0 else -0.05)
        x, y = x + STEP * u * math.cos(psi), y + STEP * u * math.sin(psi)
        psi, r = psi + STEP * r, r + STEP * (K * delta - r) / T
    shown = np.radians(np.round(np.degrees(rudder) * 2.0) / 2.0)
    state[:, 4] += math.radians(noise) * rng.standard_normal(count) * 0.1
    return Track(time, state, shown, driven, LENGTH)


def zigzag(angle, heading, begin, most=99):
    side, reversals = [1.0], [0]

    def order(t, psi):
        if t < begin:
            return 0.0
        if side[0] * psi >= heading and reversals[0] < most:
            side[0], reversals[0] = -side[0], reversals[0] + 1
        return side[0] * angle

    return order


def found_in(track):
    return recognition.recognise("trip", [track])


@pytest.mark.parametrize("angle, heading", [(10, 10), (20, 20), (15, 15), (20, 10), (35, 20)])
def test_zigzags_of_any_angle(angle, heading):
    (one,) = found_in(sailed(zigzag(angle, heading, 60.0), 400.0))
    assert one.kind == "zigzag" and one.approach.steady
    assert math.degrees(one.angle) == pytest.approx(angle, abs=0.5)
    assert math.degrees(one.heading) == pytest.approx(heading, abs=0.6)
    assert one.begin == pytest.approx(60.0, abs=0.2)
    assert len(one.orders) >= 5 and not one.part


def test_a_zigzag_to_port_first():
    order = zigzag(20, 20, 60.0)
    (one,) = found_in(sailed(lambda t, psi: -order(t, -psi), 300.0))
    assert one.side == -1.0 and "port first" in one.name


def test_one_reversal_is_a_part_and_says_what_it_gives():
    order = zigzag(20, 20, 60.0, most=1)
    (one,) = found_in(sailed(lambda t, psi: order(t, psi) if t < 110.0 else 0.0, 160.0))
    assert one.kind == "zigzag" and len(one.orders) == 2
    assert "one reversal" in one.part and "no second one" in one.part


@pytest.mark.parametrize("angle", [35.0, -35.0, 20.0])
def test_turns(angle):
    (one,) = found_in(sailed(lambda t, psi: angle if t > 80.0 else 0.0, 500.0))
    assert one.kind == "turn" and one.side == math.copysign(1.0, angle) and not one.part
    assert math.degrees(one.angle) == pytest.approx(abs(angle), abs=0.3)
    assert one.begin == pytest.approx(80.0, abs=0.2)


@pytest.mark.parametrize(
    "until, says", [(120.0, "no tactical diameter"), (215.0, "no steady turn"),
                    (300.0, "360 deg apart"), (60.0, "")]
)  # fmt: skip
def test_parts_of_turns(until, says):
    """The rudder is put back 15 deg before: nothing is left of a turn of 45."""

    def order(t, psi):
        done = psi > until - 15.0
        order.done = order.done or done
        return 0.0 if t < 60.0 or order.done else 20.0

    order.done = False
    found = [one for one in found_in(sailed(order, 400.0)) if one.kind == "turn"]
    if not says:
        assert not found
    else:
        assert says in found[0].part


def test_a_pull_out_follows_its_turn():
    track = sailed(lambda t, psi: 20.0 if 60.0 < t < 250.0 else 0.0, 400.0)
    turn, pull = found_in(track)
    assert (turn.kind, pull.kind) == ("turn", "pull_out")
    assert pull.begin == pytest.approx(250.0, abs=0.2)


def test_a_stop_and_one_that_is_not_whole():
    (one,) = found_in(sailed(lambda t, psi: 0.0, 260.0, screw=lambda t: 1.0 if t < 80.0 else -1.0))
    assert one.kind == "stop" and not one.part and one.begin == pytest.approx(80.0, abs=0.2)
    (one,) = found_in(sailed(lambda t, psi: 0.0, 150.0, screw=lambda t: 1.0 if t < 80.0 else -1.0))
    assert "not stopped" in one.part
    (one,) = found_in(sailed(lambda t, psi: 0.0, 260.0, screw=lambda t: 1.0 if t < 80.0 else 0.0))
    assert "never astern" in one.part


def test_a_spiral_to_both_sides_and_back():
    angles = [15, 10, 5, 0, -5, -10, -15, -10, -5, 0, 5, 10, 15]
    track = sailed(lambda t, psi: angles[min(int(t / 90.0), len(angles) - 1)], 90.0 * len(angles))
    spirals = [one for one in found_in(track) if one.kind == "spiral"]
    assert len(spirals) == 1 and not spirals[0].part
    assert [round(math.degrees(a)) for a, _ in spirals[0].steps] == angles
    rates = [r for _, r in spirals[0].steps]
    assert rates == pytest.approx([K * math.radians(a) for a in angles], abs=2e-4)


@pytest.mark.parametrize("seed", range(4))
def test_keeping_a_course_is_no_manoeuvre(seed):
    rng = np.random.default_rng(seed)
    walk = np.cumsum(rng.standard_normal(500)) * 0.5

    def order(t, psi):
        return float(np.clip(-2.0 * psi + walk[int(t)], -8.0, 8.0))

    assert not [one for one in found_in(sailed(order, 499.0, seed)) if one.kind == "turn"]
    assert not [one for one in found_in(sailed(order, 499.0, seed)) if len(one.orders) > 2]


def test_a_ship_that_lies_still_has_none():
    track = sailed(lambda t, psi: 35.0, 100.0, screw=lambda t: 0.0)
    still = Track(track.time, track.state * 0.0, track.rudder, track.screw * 0.0, LENGTH)
    assert recognition.recognise("trip", [still]) == []
    assert recognition.recognise("trip", []) == []
