"""A model sails a recorded turn in the current and the wind of the record: against itself, since
a model that is the ship has the ship's path."""

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from shiplog.manoeuvres import measure, recognition, simulated
from shiplog.manoeuvres.track import Track
from shiplog.ship_profile import file as profiles
from shiplog.simulation.controls import Controls
from shiplog.simulation.helm import helm
from shiplog.simulation.sailing import Steps, Water, sail
from shiplog.simulation.schedules import Turn
from shiplog.training.runs.outside import Outside

PROFILE = profiles.load("esso-osaka")  # 3 m, one screw, one rudder, an anemometer
NAMES = PROFILE.actuator_names
LENGTH, SPEED, ROW = PROFILE.ship.length_m, 0.4, 0.1
TURN = Turn(math.radians(20.0), by=math.radians(640.0))
SIGN = np.array([1.0 if a.kind == "rudder" else 0.0 for a in PROFILE.actuators])
CONTROLS = Controls(
    NAMES, SIGN, 1.0 - SIGN, np.zeros(2), np.full(2, -1.0), np.full(2, 1.0), np.full(2, 1e9)
)


def rates(state, actuator, wind):
    """T ṙ + r = K δ u/U₀; a wind moves the ship along by a hundredth of itself."""
    c, s = np.cos(state[:, 4]), np.sin(state[:, 4])
    ahead, aside = wind[:, 0] * c + wind[:, 1] * s, wind[:, 1] * c - wind[:, 0] * s
    u, v, r = state[:, [1, 3, 5]].T
    return np.stack((
        0.1 * (SPEED - 0.01 * ahead - u), 0.1 * (-0.01 * aside - v),
        (0.15 * (actuator @ SIGN) * u / SPEED - r) / 5.0,
    ), axis=-1)  # fmt: skip


class Ship:
    profile, row = PROFILE, ROW

    def sail(self, manoeuvre, *, speed, water, members, seconds, motion, approach, positions):
        first = np.zeros((1, 6))
        first[:, [1, 4, 3, 5]] = speed, *motion  # through the water
        c, s = math.cos(motion[0]), math.sin(motion[0])
        north, east = water.current
        first[:, [1, 3]] += north * c + east * s, east * c - north * s
        steps = Steps(seconds, ROW, 1, np.full(3, 50.0))
        made = helm(manoeuvre, CONTROLS, first, LENGTH / speed)
        return sail(rates, made, CONTROLS, first, steps, water=water), Outside(0.0, 1.0, {})


def recorded(current, recorded_wind):
    """The ship's own turn as a record, from an approach along the heading 0.7 rad."""
    mean = recorded_wind.mean(0)
    water = Water(tuple(mean), current, recorded_wind)
    turned, _ = Ship().sail(
        TURN, speed=SPEED, water=water, members=1, seconds=400.0, motion=(0.7, 0.0, 0.0),
        approach=None, positions=None,
    )  # fmt: skip
    state, act = turned.state[0], turned.actuator[0]
    keep = np.isfinite(state).all(-1)
    before = np.repeat(state[:1], 200, axis=0)
    before[:, [0, 2]] += np.outer(
        np.arange(-200, 0) * ROW,
        [math.cos(0.7) * SPEED + current[0], math.sin(0.7) * SPEED + current[1]],
    )
    state = np.concatenate((before, state[keep]))
    act = np.concatenate((np.repeat(act[:1], 200, axis=0) * (1.0 - SIGN), act[keep]))
    time = np.arange(len(state)) * ROW
    track = Track(time, state, act @ SIGN, act @ (1.0 - SIGN), LENGTH)
    wind = np.concatenate((np.tile(mean, (200, 1)), recorded_wind))[: len(state)]
    wind = np.concatenate((wind, np.tile(mean, (len(state) - len(wind), 1))))
    record: Any = SimpleNamespace(time=time, true_wind=wind, actuator=act)
    return track, record


def again(found, record, moved) -> simulated.Simulated:
    ship: Any = Ship()
    sailed = simulated.as_recorded(ship, found, record, moved, 1)
    assert sailed is not None
    return sailed


def turn_of(track):
    return next(f for f in recognition.recognise("trip", [track]) if f.kind == "turn")


@pytest.mark.parametrize("current", [(0.0, 0.0), (0.06, -0.04), (-0.05, 0.05)])
def test_a_turn_in_a_current_is_sailed_in_it(current):
    """Over ground the approach is up to 0.07 m/s slower or faster, and to the side; the wind's own
    drift, 0.02 m/s, is no current."""
    track, record = recorded(current, np.tile([1.2, -1.6], (3000, 1)))
    found = turn_of(track)
    own = measure.measured(found, PROFILE, ROW)
    assert own.drift is not None
    sailed = again(found, record, own.drift)
    assert sailed.sailed.water.current == pytest.approx(current, abs=2e-3)
    for name in ("advance", "transfer", "tactical_diameter"):
        assert sailed.quantities[name].value == pytest.approx(
            own.quantities[name].value, rel=0.01
        ), name


def test_gusts_are_those_of_the_record():
    """A wind that turns round while the ship turns: its mean would move the ship elsewhere."""
    time = np.arange(3000) * ROW
    gusts = 3.0 * np.stack((np.cos(0.05 * time), np.sin(0.05 * time)), -1)
    track, record = recorded((0.0, 0.0), gusts)
    found = turn_of(track)
    own = measure.values(found, track)
    sailed = again(found, record, None)
    assert sailed.quantities["advance"].value == pytest.approx(own["advance"], rel=0.01)
    assert sailed.quantities["tactical_diameter"].value == pytest.approx(
        own["tactical_diameter"], rel=0.01
    )


def test_rows_end_where_the_record_has_a_gap():
    wind = np.array([[1.0, 0.0], [3.0, 0.0], [5.0, 2.0], [9.0, 9.0]])
    found = simulated._by_rows(wind, np.array([0.0, 0.5, 1.2, 3.1]), 1.0)
    assert found.tolist() == [[2.0, 0.0], [5.0, 2.0]]
