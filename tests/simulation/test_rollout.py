"""Rollouts against closed forms, and the order of the integrator."""

import math

import numpy as np
import polars as pl
import pytest

from shiplog.models.base import kinematics
from shiplog.simulation import baselines, scoring
from shiplog.simulation.rollout import rollout, simulate
from shiplog.voyages.windows.windows import Windows


def drag(state, actuator, wind):
    """u̇ = -u/T with T = 20 s, a turn at constant r."""
    acceleration = np.zeros_like(state[..., :3])
    acceleration[..., 0] = -state[..., 1] / 20.0
    return kinematics(state, acceleration)


def end(steps):
    start = np.array([[0.0, 1.0, 0.0, 0.0, 0.3, 0.02]])
    none = np.zeros((1, steps + 1, 0))
    dt = np.full((1, steps), 60.0 / steps)
    return rollout(drag, start, none, none, dt)[0, -1]


def test_halving_the_step_halves_eulers_error():
    exact = math.exp(-3.0)
    errors = [abs(end(n)[1] - exact) for n in (60, 120, 240)]
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.03)


def test_heading_counts_on_and_a_held_velocity_sails_a_circle():
    state = np.array([[0.0, 0.8, 0.0, 0.0, 3.0, 0.04]])
    none = np.zeros((1, 10001, 0))
    dt = np.full((1, 10000), 0.01)
    path = rollout(baselines.hold, state, none, none, dt)[0]
    heading = 3.0 + 0.04 * 100.0
    assert path[-1, 4] == pytest.approx(heading)
    assert path[-1, 0] == pytest.approx(20 * (math.sin(heading) - math.sin(3.0)), abs=0.01)
    assert path[-1, 2] == pytest.approx(-20 * (math.cos(heading) - math.cos(3.0)), abs=0.01)


def test_a_drifting_ship_moves_over_ground_by_its_turned_velocity():
    state = np.array([[1.0, 0.3, 2.0, 0.2, 0.7, 0.0]])
    none = np.zeros((1, 11, 0))
    path = rollout(baselines.hold, state, none, none, np.ones((1, 10)))[0, -1]
    c, s = math.cos(0.7), math.sin(0.7)
    assert path[0] == pytest.approx(1.0 + 10 * (0.3 * c - 0.2 * s))
    assert path[2] == pytest.approx(2.0 + 10 * (0.3 * s + 0.2 * c))


def one_window(simulated_offset):
    """Measured at rest at the origin; a model that stands still but starts elsewhere."""
    size = 11
    state = np.zeros((1, size, 6))
    state[0, 1:] = -np.array(simulated_offset)
    nothing = np.zeros((1, size, 0))
    plan = pl.DataFrame({"voyage": ["a"], "copy": [0]})
    return Windows(plan, state, nothing, nothing, np.ones((1, size - 1)))


def still(state, actuator, wind):
    return np.zeros_like(state)


def test_the_error_has_the_papers_weights_and_degrees():
    """0.01 m/s, 0.02 m/s and 0.1 deg/s off from 1 s on: d = 1 + 4 + 1, L = 6 (0.5 + 9)."""
    data = one_window([3.0, 0.01, 4.0, 0.02, 0.0, math.radians(0.1)])
    scores = scoring.score(still, data)
    assert scores.d[0, 0] == 0.0
    assert scores.d[0, 5] == pytest.approx(6.0)
    row = scores.errors.to_dicts()[0]
    assert row["loss"] == pytest.approx(6.0 * 9.5)
    assert row["end_position_m"] == pytest.approx(5.0)
    assert row["rmse_surge"] == pytest.approx(0.01 * math.sqrt(10 / 11))


def test_the_loss_is_the_trapezoidal_integral_of_d_over_uneven_steps():
    """d = 0, 1, 4 (0.02 m/s of sway), 100 (1 deg/s): L = 1 · 0.5 + 3 · 2.5 + 2 · 52."""
    error, dt = np.zeros((1, 4, 6)), np.array([[1.0, 3.0, 2.0]])
    error[0, 1, 1], error[0, 2, 3], error[0, 3, 5] = 0.01, -0.02, math.radians(1.0)
    error[0, :, [0, 2, 4]] = 9.0  # positions and heading do not count
    assert scoring.prediction_error(error)[0] == pytest.approx([0.0, 1.0, 4.0, 100.0])
    assert scoring.trapezoid(dt).tolist() == [[0.5, 2.0, 2.5, 1.0]]
    assert scoring.window_loss(error, dt) == pytest.approx([112.0])
    shares = scoring.loss_shares(error, dt)[0]
    assert shares.sum(0) == pytest.approx([2.0, 10.0, 100.0])
    assert shares.sum(1) == pytest.approx([0.0, 2.0, 10.0, 100.0])
    error[0, 2, 3] = math.nan
    assert scoring.prediction_error(error)[0].tolist()[2] == math.inf
    assert scoring.window_loss(error, dt).tolist() == [math.inf]


@pytest.mark.parametrize("turns", [-2, 0, 1])
def test_the_heading_error_is_modulo_a_full_turn(turns):
    data = one_window([0, 0, 0, 0, math.radians(10.0) + 2 * math.pi * turns, 0])
    assert scoring.score(still, data).errors["end_heading_deg"][0] == pytest.approx(10.0)


def test_a_model_that_diverges_scores_infinity_and_not_nan():
    def explode(state, actuator, wind):
        return state**9 * 1e9 + 1e9

    def shake(state, actuator, wind):
        return -(1e300 * (state + 1.0))  # to and fro: infinity less infinity is no number

    for model in (explode, shake):
        scores = scoring.score(model, one_window([0] * 6))
        assert scores.errors.row(0) == (math.inf,) * len(scoring.ERRORS)
        assert scores.errors.columns == list(scoring.ERRORS)


def test_least_squares_goes_no_further_outside_its_range():
    """ν̇ = (1 - u/2, -1, 1) of a range of ±1: outwards it is zero, and u counts as ±1."""
    coefficients = np.zeros((25, 3))  # 1, z, and the ten products of two, twice; z = (u, v, r, n)
    coefficients[0], coefficients[1, 0] = (1.0, -1.0, 1.0), -0.5
    one = np.ones(3)
    fitted = baselines.LeastSquares(np.ones(25), -one, one, coefficients)
    state = np.zeros((2, 6))
    state[:, [1, 3, 5]] = [[2.0, -2.0, 2.0], [-2.0, 2.0, 0.0]]
    rate = fitted(state, np.zeros((2, 1)), np.zeros((2, 0)))[:, [1, 3, 5]]
    assert rate.tolist() == [[0.0, 0.0, 0.0], [1.5, -1.0, 1.0]]


def test_least_squares_finds_a_quadratic_ship_again():
    """Data of u̇ = 0.1 n² - 0.2 u|u| + 0.01 U² cos γ, integrated as the baseline is."""
    rng = np.random.default_rng(0)
    count, size = 12, 60
    actuator = (
        rng.uniform(0.0, 2.0, (count, 1, 1))
        * (1 + 0.5 * np.sin(np.arange(size) / 7.0))[None, :, None]
    )
    wind = rng.uniform(0.0, 3.0, (count, size, 2))
    state = np.zeros((count, size, 6))
    state[..., [3, 5]] = rng.normal(0.0, 0.01, (count, size, 2))
    state[:, 0, 1] = rng.uniform(size=count)
    for k in range(size - 1):
        u, n, speed, angle = (state[:, k, 1], actuator[:, k, 0], wind[:, k, 0], wind[:, k, 1])
        rate = 0.1 * n**2 - 0.2 * u * abs(u) + 0.01 * speed**2 * np.cos(angle)
        state[:, k + 1, 1] = u + rate
    plan = pl.DataFrame({"copy": [0] * count})
    data = Windows(plan, state, actuator, wind, np.ones((count, size - 1)))
    fitted = baselines.least_squares(data, ridge=1e-12)
    assert np.abs(simulate(fitted, data)[..., 1] - state[..., 1]).max() < 1e-3
