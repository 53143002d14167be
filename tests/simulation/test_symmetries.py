"""A rollout does not know where north is, nor which side is port."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shiplog.models.base import kinematics
from shiplog.simulation.rollout import rollout

FEW = settings(max_examples=30, deadline=None)
MIRRORED = np.array([1.0, 1.0, -1.0, -1.0, -1.0, -1.0])  # of x0, u, y0, v, heading, yaw rate
START = st.tuples(*[st.floats(-1.0, 1.0)] * 6).map(lambda s: np.array([s]))


def ship(state, actuator, wind):
    """Drag, drift, a rudder and a wind: even in surge, odd in sway and yaw."""
    u, v, r = (state[..., i] for i in (1, 3, 5))
    ahead, across = wind[..., 0] * np.cos(wind[..., 1]), wind[..., 0] * np.sin(wind[..., 1])
    rate = (
        -0.1 * u * np.abs(u) + 0.3 * v * r - 0.01 * ahead,
        -0.2 * v - 0.4 * u * r + 0.05 * actuator[..., 0] - 0.02 * across,
        -0.3 * r + 0.2 * u * actuator[..., 0] - 0.01 * across + 0.05 * u * v,
    )
    return kinematics(state, np.stack(rate, axis=-1))


def inputs(side=1.0):
    time = np.arange(60.0)
    actuator = side * 0.5 * np.sin(0.2 * time)[None, :, None]
    wind = np.stack((np.full(60, 2.0), side * (0.4 + 0.01 * time)), axis=-1)[None]
    return actuator, wind, np.full((1, 59), 0.5)


@given(start=START, angle=st.floats(-7.0, 7.0))
@FEW
def test_a_path_that_starts_turned_is_the_turned_path(start, angle):
    path = rollout(ship, start, *inputs())
    turned = start.copy()
    place = complex(start[0, 0], start[0, 2]) * np.exp(1j * angle)
    turned[0, 0], turned[0, 2], turned[0, 4] = place.real, place.imag, start[0, 4] + angle
    other = rollout(ship, turned, *inputs())
    places = (path[..., 0] + 1j * path[..., 2]) * np.exp(1j * angle)
    assert other[..., 0] + 1j * other[..., 2] == pytest.approx(places, abs=1e-9)
    assert other[..., 4] == pytest.approx(path[..., 4] + angle, abs=1e-9)
    for column in (1, 3, 5):
        assert other[..., column] == pytest.approx(path[..., column], abs=1e-9)


@given(start=START)
@FEW
def test_a_mirrored_ship_sails_the_mirrored_path(start):
    path = rollout(ship, start, *inputs())
    other = rollout(ship, start * MIRRORED, *inputs(side=-1.0))
    assert other == pytest.approx(path * MIRRORED, abs=1e-9)
