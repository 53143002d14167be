"""Sound voyages whose turns look like a fault: to one side alone, at the most revolutions, or with
a thruster at the bow. Each is integrated here from its equations, with no sign wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest
from known_motion import RUDDER_AND_PROPELLER, Noise, actuator, measured, profile, sailed, table

from shiplog.voyages.contradictions import gross as contradictions

R = math.radians
DT = 0.05


def over(seconds: float, f):
    """x(t) of x' = f(t, x), x(0) = 0, as a function of time."""
    t = DT * np.arange(round(seconds / DT) + 2)
    x = np.zeros(len(t))
    for i in range(len(t) - 1):
        x[i + 1] = x[i] + DT * f(t[i], x[i])
    return lambda at: np.interp(at, t, x)


def to_port_alone():
    """A long ship that turns once, to port, for two minutes, and a compass that wanders by half a
    degree meanwhile: of this turn by itself a ratio of the gyro is as well an offset of it."""

    def rate(t):
        inside = np.clip(np.minimum(t - 60.0, 180.0 - t) / 8.0, 0.0, 1.0)
        return -inside * (0.0066 + 0.0019 * np.sin(math.pi * (t - 60.0) / 120.0))

    return sailed(1300.0, rate, lambda t: 4.0 + 0 * t, lambda t: 0 * t,
                  drives={"rudder": lambda t: 0.25 * np.sign(rate(t)),
                          "propeller": lambda t: 1.2 + 0 * t})  # fmt: skip


def wanders(raw, time):
    """A compass that comes late where the turn is fastest."""
    off = 0.5 * np.sin(2.0 * math.pi * (time - 60.0) / 120.0) * ((time > 60.0) & (time < 180.0))
    return raw | {"heading": (raw["heading"] - off) % 360.0}


def fastest_in_the_turn():
    """u' = a n² - b u² - d r²: it works up for seven minutes and turns at full revolutions, which
    slows it: where the screw turns fastest the ship loses its way."""

    def shaft(t):
        return np.interp(t, [0, 20, 180, 200, 390, 420], [0.0, 0.58, 0.58, 0.77, 0.77, 0.97])

    def rate(t):
        return R(0.55) * np.interp(t, [400.0, 450.0], [0.0, 1.0])

    def slower(t, u):
        return 0.043 * shaft(t) ** 2 - 0.0009 * u * abs(u) - 330.0 * rate(t) ** 2

    return sailed(660.0, rate, over(660.0, slower), lambda t: -40.0 * rate(t),
                  drives={"rudder": lambda t: 0.5 * np.interp(t, [400, 410], [0, 1]),
                          "propeller": shaft})  # fmt: skip


def round_by_the_bow():
    """v' = b n|n| - u r - v/τ, r' = c n|n| - r/τ: the thruster pushes the bow to port, and the
    ship, which goes ahead, slides outwards, to starboard."""

    def bow(t):
        return -np.sqrt(np.interp(t, [0, 205, 225, 300], [0.05, 0.05, 5.3, 5.3]))

    def surge(t):
        return np.interp(t, [0, 100, 300], [0.5, 2.7, 2.4])

    rate = over(300.0, lambda t, r: -0.000085 * bow(t) ** 2 - r / 40.0)
    sway = over(300.0, lambda t, v: -0.0009 * bow(t) ** 2 - surge(t) * rate(t) - v / 60.0)
    return sailed(300.0, rate, surge, sway,
                  drives={"bow": bow, "screw": lambda t: 2.3 + 0 * t})  # fmt: skip


FINE = Noise(position=0.08, speed=0.02, heading=0.07, rate=0.026)
BOW = actuator("bow", "thruster", 29.0, 0.0, 90.0), actuator("screw", "thruster", -34.0)
SHIPS = {
    "to port alone": (to_port_alone, 230.0, RUDDER_AND_PROPELLER),
    "fastest in the turn": (fastest_in_the_turn, 226.0, RUDDER_AND_PROPELLER),
    "round by the bow": (round_by_the_bow, 76.0, BOW),
}


@pytest.mark.parametrize("name", list(SHIPS))
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_turn_is_nothing_wrong(name, seed):
    made, length, actuators = SHIPS[name]
    p = profile("ned", length=length, actuators=actuators)
    ship = made()
    raw = measured(ship, "ned", noise=FINE, seed=seed)
    if name == "to port alone":
        raw = wanders(raw, ship.time)
    said = contradictions.find(table(raw, p), p).findings
    assert [one.sentence for one in said] == []


@pytest.mark.parametrize(
    ("name", "channels"), [("fastest in the turn", {"yaw_rate"}), ("round by the bow", set())]
)
def test_a_gyro_of_the_wrong_sense_is_no_fault_of_the_screws(name, channels):
    """What a turn does by itself is taken of the heading; of the second one too little is seen to
    tell the sense of its gyro."""
    made, length, actuators = SHIPS[name]
    p = profile("ned", length=length, actuators=actuators)
    raw = measured(made(), "ned", noise=FINE)
    said = contradictions.find(table(raw | {"rate": -raw["rate"]}, p), p).findings
    assert {one.channel for one in said} == channels


@pytest.mark.parametrize(("off", "said"), [(65.0, False), (90.0, True)])
def test_a_ship_that_drifts_has_no_heading_from_another_axis(off, said):
    """It turns slowly, screw ahead, and goes 65 deg off its bow, as the wind sets it; 90 deg off is
    a heading counted from another axis."""
    made = sailed(
        900.0, lambda t: R(0.6) * np.sin(0.02 * t),
        lambda t: math.cos(R(off)) * (0.4 + 0.05 * np.sin(0.03 * t)),
        lambda t: math.sin(R(off)) * (0.4 + 0.05 * np.sin(0.03 * t)),
        drives={"rudder": lambda t: 0.1 * np.sin(0.02 * t), "propeller": lambda t: 1.5 + 0 * t},
    )  # fmt: skip
    p = profile("ned", length=3.0)
    found = contradictions.find(table(measured(made, "ned", noise=FINE), p), p).findings
    assert any("another axis" in one.sentence for one in found) == said
