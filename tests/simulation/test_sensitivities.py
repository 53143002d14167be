"""Rollouts of physical models and their derivatives: closed forms and central differences."""

import math
from dataclasses import replace

import numpy as np
import pytest
from coupled_ships import COUPLED, Damped, sailed

from shiplog.models.mmg import parameters
from shiplog.models.mmg.geometry import geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.ship_profile import file as profiles
from shiplog.simulation import jax_rollouts, sensitivities, window_series
from shiplog.simulation.scoring import window_loss

SHIFT = 1e-5


def central(values, function, scale):
    """∂function/∂θ by central differences, on a new last axis."""
    columns = []
    for i, size in enumerate(scale):
        step = np.zeros_like(values)
        step[i] = SHIFT * size
        columns.append((function(values + step) - function(values - step)) / (2 * step[i]))
    return np.stack(columns, -1)


# ---------------------------------------------------------------- derivatives


def test_the_derivative_of_a_damped_motion_in_closed_form():
    """u_k = u₀ ∏ (1 - θ dt): ∂u/∂θ = -u Σ dt/(1 - θ dt); no other parameter moves it."""
    data = sailed(2, 12, 4, (0.0, 0.0, 0.0))
    theta = np.array([0.1, 0.3, 0.2])
    states, slopes = sensitivities.linearised(Damped(), theta, data)
    assert slopes.shape == (2, 12, 6, 3)
    for i, row in enumerate((1, 3, 5)):
        total = np.cumsum(data.dt / (1.0 - theta[i] * data.dt), axis=1)
        assert slopes[:, 1:, row, i] == pytest.approx(-states[:, 1:, row] * total, rel=1e-10)
        assert not np.delete(slopes[:, :, row], i, axis=-1).any()


def differ(model, theta, data, scale):
    """Slopes, central differences, and the size of each parameter's greatest effect a row."""
    states, slopes = sensitivities.linearised(model, theta, data)
    assert states == pytest.approx(sensitivities.rollout(model, theta, data), rel=1e-12)
    assert not slopes[:, 0].any()
    numeric = central(theta, lambda t: sensitivities.rollout(model, t, data), scale)
    return slopes, numeric, np.abs(numeric).max((0, 1), keepdims=True)


def test_derivatives_are_the_central_differences(coupled):
    slopes, numeric, size = differ(*coupled, scale=COUPLED)
    assert (size > 0).all()  # every parameter moves every state
    assert np.abs((slopes - numeric) / size).max() < 1e-7


def test_derivatives_of_the_mmg_are_the_central_differences():
    """Ahead, astern and backing, so that every coefficient has something to say; and from rest,
    in a calm, where roots and angles have no slope of their own."""
    g, _, _ = geometry_of(profiles.load("esso-osaka"))
    published = parameters.load(parameters.published_file("esso-osaka"), g)
    data = sailed(8, 12, 5, (0.3, 9.0))
    for window, ahead, n in ((1, 0.5, -1), (2, 1, -0.5), (3, -1, 1), (4, -1, -1)):
        data.measured[window, :, 1] *= ahead
        data.actuator[window, :, 1] *= n
    data.measured[5:], data.wind[5:], data.actuator[5:, :, 0] = 0.0, 0.0, 0.0
    data.actuator[5:, :, 1] = np.array([[8.0], [0.0], [-8.0]])
    scale = np.maximum(published.spread, 1e-3)
    slopes, numeric, size = differ(MMG(g), published.values, data, scale)
    moved = {n for n, s in zip(published.names, (size > 0).any((0, 1, 2)), strict=True) if s}
    assert set(published.names) - moved == {"propeller.c10"}  # a border between two branches
    assert np.isfinite(slopes).all()
    error = np.abs(slopes - numeric) / np.where(size > 1e-9, size, np.inf)
    assert error.max() < 1e-5
    assert not slopes[..., published.names.index("propeller.c10")].any()


def test_the_spread_of_one_uncertain_parameter_is_its_slope():
    """σ_u = σ_θ |∂u/∂θ|, the parameters that do not move it adding nothing."""
    data, theta = sailed(2, 12, 4, (0.0, 0.0, 0.0)), np.array([0.1, 0.3, 0.2])
    _, slopes = sensitivities.linearised(Damped(), theta, data)
    sigma = np.array([0.01, 0.02, 0.03])
    found = sensitivities.spread(Damped(), theta, np.diag(sigma**2), data)
    for i, row in enumerate((1, 3, 5)):
        assert found[..., row] == pytest.approx(sigma[i] * np.abs(slopes[..., row, i]))
    assert not found[:, 0].any()


def test_parameters_that_err_together_spread_by_their_sum(coupled, monkeypatch):
    """Fully correlated errors σ add up before they are squared: |Σ σ ∂x/∂θ|. Chunk by chunk."""
    model, theta, data = coupled
    _, slopes = sensitivities.linearised(model, theta, data)
    sigma = np.array([0.01, -0.02, 0.003, 0.001])
    monkeypatch.setattr(sensitivities, "WINDOWS_AT_A_TIME", 8)
    many = window_series.pick(data, [0, 1, 2, 3, 4] * 3)
    found = sensitivities.spread(model, theta, np.outer(sigma, sigma), many)
    assert found == pytest.approx(np.tile(np.abs(slopes @ sigma), (3, 1, 1)), abs=1e-7)


# ---------------------------------------------------------------- normal equations


def test_losses_are_the_papers(coupled):
    model, theta, data = coupled
    wanted = window_loss(sensitivities.rollout(model, theta, data) - data.measured, data.dt)
    assert sensitivities.losses(model, theta, data) == pytest.approx(wanted, rel=1e-10)
    assert sensitivities.normal(model, theta, data).loss == pytest.approx(wanted, rel=1e-10)


def test_a_rollout_that_diverges_has_an_infinite_loss_of_its_own(coupled):
    model, theta, data = coupled
    wild = data._replace(actuator=data.actuator.copy())
    wild.actuator[1, :, 0] = np.inf
    found, before = (sensitivities.losses(model, theta, d) for d in (wild, data))
    assert found[1] == np.inf
    assert np.delete(found, 1) == pytest.approx(np.delete(before, 1))


def test_the_pull_is_half_the_gradient(coupled):
    model, theta, data = coupled
    found = sensitivities.normal(model, theta, data).pull
    numeric = central(theta, lambda t: sensitivities.losses(model, t, data), COUPLED)
    assert found == pytest.approx(0.5 * numeric, rel=1e-6)


def test_the_gram_is_the_sum_of_squared_weighted_slopes(coupled):
    """√dt of the trapezoidal rule, and 100, 100, 10 · 180/π: m/s, m/s, deg/s."""
    model, theta, data = coupled
    weight = np.array([1.0, 0.5, 2.0, 0.0, 1.0])
    _, slopes = sensitivities.linearised(model, theta, data)
    jacobian = slopes[:, :, [1, 3, 5]] * np.array([100.0, 100.0, 1800.0 / math.pi])[:, None]
    wanted = np.einsum("n,nk,nkip,nkiq->pq", weight, data.steps, jacobian, jacobian)
    found = sensitivities.normal(model, theta, data._replace(weight=weight))
    assert found.gram == pytest.approx(wanted, rel=1e-10)
    assert found.gram == pytest.approx(found.gram.T, rel=1e-12)
    plain = sensitivities.normal(model, theta, data)
    assert found.loss.tolist() == plain.loss.tolist()  # each window's own, whatever its weight
    assert found.pull.tolist() == plain.pull.tolist()


def test_windows_of_no_weight_are_left_out(coupled):
    model, theta, data = coupled
    some = sensitivities.normal(model, theta, window_series.pick(data, [0, 2]))
    weighed = sensitivities.normal(model, theta, data._replace(weight=np.array([1.0, 0, 1, 0, 0])))
    assert weighed.gram == pytest.approx(some.gram, rel=1e-10)
    assert weighed.loss[[0, 2]] == pytest.approx(some.loss, rel=1e-12)
    assert weighed.pull[[0, 2]] == pytest.approx(some.pull, rel=1e-10)


def test_a_gauss_newton_step_finds_the_parameters_again(coupled):
    """Half a percent off; one step of pull and gram leaves the square of that."""
    model, theta, data = coupled
    made = data._replace(measured=sensitivities.rollout(model, theta, data))
    off = theta * (1.0 + 0.005 * np.array([1, -1, 1, -1]))
    found = sensitivities.normal(model, off, made)
    better = off - np.linalg.solve(found.gram, found.pull.sum(0))
    assert better == pytest.approx(theta, rel=2e-4)


def test_derivatives_by_some_parameters_are_those_among_all(coupled):
    model, theta, data = coupled
    whole, some = (sensitivities.normal(model, theta, data, free) for free in (None, (1, 3)))
    assert some.loss == pytest.approx(whole.loss, rel=1e-12)
    assert some.pull == pytest.approx(whole.pull[:, [1, 3]], rel=1e-10)
    assert some.gram == pytest.approx(whole.gram[np.ix_([1, 3], [1, 3])], rel=1e-10)


def test_chunks_change_nothing(coupled, monkeypatch):
    model, theta, _ = coupled
    data = sailed(19, 30, 6, (1.0, 0.2))._replace(weight=np.linspace(0.0, 2.0, 19))
    whole = jax_rollouts.normal(model, theta, data)
    monkeypatch.setattr(jax_rollouts, "WINDOWS_AT_A_TIME", 8)
    assert len(jax_rollouts.padded(data).weight) == 24
    parts = jax_rollouts.normal(model, theta, data)
    assert parts.loss == pytest.approx(whole.loss, rel=1e-12)
    assert parts.pull == pytest.approx(whole.pull, rel=1e-10)
    assert parts.gram == pytest.approx(whole.gram, rel=1e-10)


def test_derivatives_hold_for_a_model_that_cuts_its_step(coupled):
    """Slopes of three Euler steps a second against central differences of the same rollout."""
    model, theta, data = coupled
    finer = replace(model, substeps=3)
    states, slopes = sensitivities.linearised(finer, theta, data)
    assert states == pytest.approx(sensitivities.rollout(finer, theta, data), abs=1e-12)
    for i in range(len(theta)):
        step = np.zeros(len(theta))
        step[i] = SHIFT
        up, down = (sensitivities.rollout(finer, theta + s * step, data) for s in (1.0, -1.0))
        assert slopes[..., i] == pytest.approx((up - down) / (2.0 * SHIFT), rel=1e-3, abs=1e-7)
