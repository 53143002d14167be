"""Information of a manoeuvre: closed forms of a ship in two numbers, and many noisy voyages."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from shiplog.nomenclature.channels import VELOCITY_WEIGHTS
from shiplog.planning.information import Instrument, worth
from shiplog.planning.noise import Noise, _variances
from shiplog.simulation.sensitivities import rollout
from shiplog.simulation.window_series import WindowSeries

STEP = 1.0
TRUE = np.array([0.05, 0.02])  # damping 1/s, thrust m/s² per unit
SPREAD = np.array([0.02, 0.01])


@jax.tree_util.register_static
@dataclass(frozen=True)
class Sled:
    """u̇ = -a u + b n: a ship that only goes ahead."""

    names = ("damping", "thrust")
    substeps = 1
    smooth = 1.0
    fixed = None

    def acceleration(self, theta, state, actuator, true_wind):
        ahead = -theta[0] * state[..., 1] + theta[1] * actuator[..., 0]
        return jnp.stack((ahead, 0.0 * ahead, 0.0 * ahead), -1)


def sailed(orders):
    """State [K, 6] and actuator [K, 1] of the sled by Euler, and u by hand."""
    count = len(orders)
    data = WindowSeries(
        np.zeros((1, count, 6)), np.asarray(orders, float).reshape(1, -1, 1),
        np.zeros((1, count, 2)), np.full((1, count - 1), STEP), np.ones(1),
    )  # fmt: skip
    return rollout(Sled(), TRUE, data)[0], data.actuator[0]


def instrument(variance=4.0, noise=None, window=40, **more):
    noise = noise or Noise(np.array([1e-6, 1e-9, 1e-9]), np.full(6, 1e-8))
    return Instrument(
        Sled(), TRUE, np.arange(2), SPREAD, np.eye(2), variance, window, STEP, noise, (1.0, 3.0),
        **more,
    )  # fmt: skip


def slopes_by_hand(orders, start):
    """∂u_t/∂(a, b) of u_{t+1} = u_t + Δt (-a u_t + b n_t)."""
    u, slope, found = start, np.zeros(2), []
    for n in orders:
        found.append(slope.copy())
        slope = slope + STEP * (np.array([-u, n]) - TRUE[0] * slope)
        u = u + STEP * (-TRUE[0] * u + TRUE[1] * n)
    return np.array(found)


ORDERS = np.where(np.arange(40) % 20 < 10, 1.0, -0.5)


def test_the_gram_is_that_of_the_recursion_by_hand():
    state, actuator = sailed(ORDERS)
    mine = instrument()
    data = mine.series(state, actuator, np.zeros(2))
    J = slopes_by_hand(ORDERS, 0.0) * SPREAD
    weights = np.full(40, STEP)
    weights[[0, -1]] = 0.5
    by_hand = VELOCITY_WEIGHTS[0] ** 2 / 4.0 * (J.T * weights) @ J
    np.testing.assert_allclose(mine.gram(data), by_hand, rtol=1e-9)
    H, _ = mine.products(data)
    np.testing.assert_allclose(H, by_hand, rtol=1e-9)
    errors = mine.errors(by_hand)
    np.testing.assert_allclose(errors, np.sqrt(np.diag(np.linalg.inv(by_hand + np.eye(2)))))


def test_the_scatter_of_the_gradient_is_what_noise_makes_it():
    """M against 3000 voyages with process noise and a noisy start: their gradients' covariance."""
    noise = Noise(np.array([4e-6, 1e-12, 1e-12]), np.array([0, 9e-6, 0, 1e-12, 0, 1e-12]))
    mine = instrument(noise=noise)
    state, actuator = sailed(ORDERS)
    _, M = mine.products(mine.series(state, actuator, np.zeros(2)))
    rng = np.random.default_rng(1)
    J = slopes_by_hand(ORDERS, 0.0) * SPREAD
    weights = np.full(40, STEP)
    weights[[0, -1]] = 0.5
    gradients = []
    for _ in range(3000):
        true = np.zeros(40)
        for t in range(39):
            push = np.sqrt(4e-6 * STEP) * rng.normal()
            true[t + 1] = true[t] + STEP * (-TRUE[0] * true[t] + TRUE[1] * ORDERS[t]) + push
        measured = true + np.sqrt(9e-6) * rng.normal(size=40)
        simulated = np.zeros(40)
        simulated[0] = measured[0]
        for t in range(39):
            change = -TRUE[0] * simulated[t] + TRUE[1] * ORDERS[t]
            simulated[t + 1] = simulated[t] + STEP * change
        gradients.append(VELOCITY_WEIGHTS[0] ** 2 / 4.0 * (J.T * weights) @ (simulated - measured))
    np.testing.assert_allclose(M, np.cov(np.array(gradients).T), rtol=0.12)


def test_scatter_is_such_that_the_run_is_as_sure_as_it_states():
    state, actuator = sailed(ORDERS)
    mine = instrument()
    data = mine.series(state, actuator, np.zeros(2))
    H, M = mine.products(data)
    inverse = np.linalg.inv(H + np.eye(2))
    stated = np.sqrt(np.diag(inverse @ (2.5 * M + np.eye(2)) @ inverse))
    assert mine.calibrated(data, stated).scatter == pytest.approx(2.5, rel=1e-2)
    assert mine.calibrated(data, 1e-3 * stated).scatter == 0.05  # surer than any noise lets it be


def test_what_turns_more_is_worth_more_and_nothing_is_worth_nothing():
    mine = instrument()
    before = np.ones(2)
    state, actuator = sailed(np.zeros(40))
    still = mine.gram(mine.series(state, actuator, np.zeros(2)))
    np.testing.assert_allclose(still, 0.0, atol=1e-12)
    assert worth(mine.errors(still), before) == pytest.approx(0.0)
    small, large = (
        worth(mine.errors(mine.gram(mine.series(*sailed(size * ORDERS), np.zeros(2)))), before)
        for size in (0.3, 1.0)
    )
    assert large > small > 0.0


def test_noise_is_told_apart_by_the_sign_of_its_neighbours():
    """e_t = w_t + v_{t+1} - v_t of known variances; and a slow force, which counts as process."""
    rng = np.random.default_rng(2)
    w, v = 0.02 * rng.normal(size=20000), 0.03 * rng.normal(size=20001)
    process, sensor = _variances([w + np.diff(v)])
    assert sensor == pytest.approx(9e-4, rel=0.05)
    assert process == pytest.approx(4e-4, rel=0.25)
    slow = np.repeat(0.02 * rng.normal(size=2000), 10)  # of 10 s: ten times the level
    assert _variances([slow])[0] == pytest.approx(10 * 4e-4, rel=0.25)
