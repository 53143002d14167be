"""Rollouts against closed forms, and the order of the integrator."""

import math

import polars as pl
import pytest
import torch

from shiplog.models.base import kinematics
from shiplog.simulation import baselines, scoring
from shiplog.simulation.rollout import rollout, simulate
from shiplog.voyages.windows import Windows


def drag(state, actuator, wind):
    """u̇ = -u/T with T = 20 s, a turn at constant r."""
    acceleration = torch.zeros_like(state[..., :3])
    acceleration[..., 0] = -state[..., 1] / 20.0
    return kinematics(state, acceleration)


def end(steps):
    start = torch.tensor([[0.0, 1.0, 0.0, 0.0, 0.3, 0.02]], dtype=torch.float64)
    none = torch.zeros(1, steps + 1, 0, dtype=torch.float64)
    dt = torch.full((1, steps), 60.0 / steps, dtype=torch.float64)
    return rollout(drag, start, none, none, dt)[0, -1]


def test_halving_the_step_halves_eulers_error():
    exact = math.exp(-3.0)
    errors = [abs(end(n)[1].item() - exact) for n in (60, 120, 240)]
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(2.0, rel=0.03)


def test_heading_counts_on_and_a_held_velocity_sails_a_circle():
    state = torch.tensor([[0.0, 0.8, 0.0, 0.0, 3.0, 0.04]], dtype=torch.float64)
    none = torch.zeros(1, 10001, 0, dtype=torch.float64)
    dt = torch.full((1, 10000), 0.01, dtype=torch.float64)
    path = rollout(baselines.hold, state, none, none, dt)[0]
    heading = 3.0 + 0.04 * 100.0
    assert path[-1, 4].item() == pytest.approx(heading)
    assert path[-1, 0].item() == pytest.approx(20 * (math.sin(heading) - math.sin(3.0)), abs=0.01)
    assert path[-1, 2].item() == pytest.approx(-20 * (math.cos(heading) - math.cos(3.0)), abs=0.01)


def test_a_drifting_ship_moves_over_ground_by_its_turned_velocity():
    state = torch.tensor([[1.0, 0.3, 2.0, 0.2, 0.7, 0.0]], dtype=torch.float64)
    none = torch.zeros(1, 11, 0, dtype=torch.float64)
    path = rollout(baselines.hold, state, none, none, torch.ones(1, 10, dtype=torch.float64))[0, -1]
    c, s = math.cos(0.7), math.sin(0.7)
    assert path[0].item() == pytest.approx(1.0 + 10 * (0.3 * c - 0.2 * s))
    assert path[2].item() == pytest.approx(2.0 + 10 * (0.3 * s + 0.2 * c))


def one_window(simulated_offset):
    """Measured at rest at the origin; a model that stands still but starts elsewhere."""
    size = 11
    state = torch.zeros(1, size, 6, dtype=torch.float64)
    state[0, 1:] = -torch.tensor(simulated_offset, dtype=torch.float64)
    nothing = torch.zeros(1, size, 0, dtype=torch.float64)
    plan = pl.DataFrame({"voyage": ["a"], "copy": [0]})
    return Windows(plan, state, nothing, nothing, torch.ones(1, size - 1, dtype=torch.float64))


def still(state, actuator, wind):
    return torch.zeros_like(state)


def test_the_error_has_the_papers_weights_and_degrees():
    """0.01 m/s, 0.02 m/s and 0.1 deg/s off from 1 s on: d = 1 + 4 + 1, L = 6 (0.5 + 9)."""
    data = one_window([3.0, 0.01, 4.0, 0.02, 0.0, math.radians(0.1)])
    scores = scoring.score(still, data)
    assert scores.d[0, 0] == 0.0
    assert scores.d[0, 5].item() == pytest.approx(6.0)
    row = scores.errors.to_dicts()[0]
    assert row["loss"] == pytest.approx(6.0 * 9.5)
    assert row["end_position_m"] == pytest.approx(5.0)
    assert row["rmse_surge"] == pytest.approx(0.01 * math.sqrt(10 / 11))


@pytest.mark.parametrize("turns", [-2, 0, 1])
def test_the_heading_error_is_modulo_a_full_turn(turns):
    data = one_window([0, 0, 0, 0, math.radians(10.0) + 2 * math.pi * turns, 0])
    assert scoring.score(still, data).errors["end_heading_deg"][0] == pytest.approx(10.0)


def test_a_model_that_diverges_scores_infinity_and_not_nan():
    def explode(state, actuator, wind):
        return state**9 * 1e9 + 1e9

    scores = scoring.score(explode, one_window([0] * 6))
    assert scores.errors["loss"][0] == math.inf


def test_least_squares_finds_a_quadratic_ship_again():
    """Data of u̇ = 0.1 n² - 0.2 u|u| + 0.01 U² cos γ, integrated as the floor integrates."""
    g = torch.Generator().manual_seed(0)
    count, size = 12, 60
    actuator = torch.rand(count, 1, 1, generator=g, dtype=torch.float64).expand(-1, size, -1) * 2
    actuator = actuator * (1 + 0.5 * torch.sin(torch.arange(size) / 7.0))[None, :, None]
    wind = torch.rand(count, size, 2, generator=g, dtype=torch.float64) * 3
    other = torch.randn(count, size, 2, generator=g, dtype=torch.float64) * 0.01
    state = torch.zeros(count, size, 6, dtype=torch.float64)
    state[..., 3], state[..., 5] = other[..., 0], other[..., 1]
    state[:, 0, 1] = torch.rand(count, generator=g, dtype=torch.float64)
    for k in range(size - 1):
        u, n, speed, angle = (state[:, k, 1], actuator[:, k, 0], wind[:, k, 0], wind[:, k, 1])
        rate = 0.1 * n**2 - 0.2 * u * u.abs() + 0.01 * speed**2 * torch.cos(angle)
        state[:, k + 1, 1] = u + rate
    plan = pl.DataFrame({"copy": [0] * count})
    data = Windows(plan, state, actuator, wind, torch.ones(count, size - 1, dtype=torch.float64))
    fitted = baselines.least_squares(data, ridge=1e-12)
    assert (simulate(fitted, data)[..., 1] - state[..., 1]).abs().max() < 1e-3
