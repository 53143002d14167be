"""Tests of residuals: their level on noise, and what each kind of missing force does to them."""

import numpy as np
import pytest
from scipy.signal import lfilter

from shiplog.simulation.residual_tests import LEVEL, residual_tests

N = 600
SHIPS = 150


def inputs(rng):
    """A rudder that is laid over every half minute, and a gusting wind."""
    rudder = np.repeat(rng.uniform(-0.6, 0.6, N // 30), 30)
    wind = lfilter([0.3], [1.0, -0.95], rng.normal(size=N))
    return {"rudder": rudder, "wind": wind}


def sensed(rng, force, noise=0.0):
    """e_t of white forces and of a velocity sensor's white noise, which enters twice."""
    sensor = noise * rng.normal(size=(N + 1, 3))
    return force + np.diff(sensor, axis=0)


def rejected(errors, given, stretches=None):
    found = residual_tests(errors, np.zeros(N) if stretches is None else stretches, given)
    return {(one.channel, one.against) for one in found if one.rejected}


@pytest.mark.parametrize("noise", [0.0, 1.0], ids=["process noise", "and a noisy sensor"])
def test_noise_is_called_noise_in_nineteen_of_twenty(noise):
    rng = np.random.default_rng(5)
    wrong = sum(
        bool(rejected(sensed(rng, rng.normal(size=(N, 3)), noise), inputs(rng)))
        for _ in range(SHIPS)
    )
    # LEVEL and three standard deviations of a count of that chance
    assert wrong / SHIPS < LEVEL + 3.0 * np.sqrt(LEVEL * (1.0 - LEVEL) / SHIPS)


def test_a_rudder_force_that_is_missing_is_found_by_its_name():
    rng = np.random.default_rng(6)
    given = inputs(rng)
    errors = sensed(rng, rng.normal(size=(N, 3)))
    errors[:, 2] += 0.8 * given["rudder"]
    found = rejected(errors, given)
    assert ("yaw_rate", "rudder") in found
    assert not [one for one in found if one[0] in ("surge", "sway")]


def test_a_slow_force_is_not_white():
    rng = np.random.default_rng(7)
    slow = lfilter([1.0], [1.0, -0.9], rng.normal(size=(N, 3)), axis=0)
    found = rejected(sensed(rng, slow), inputs(rng))
    assert {(c, "whiteness") for c in ("surge", "sway", "yaw_rate")} <= found


def test_the_statistic_is_ljungs_and_boxs():
    """With b on a fine grid, and ρ_k by hand."""
    rng = np.random.default_rng(8)
    white = rng.normal(size=(N, 3))
    found = residual_tests(white, np.zeros(N), {})[0]
    a = white[:, 0] - white[:, 0].mean()
    filtered = [np.asarray(lfilter([1.0], [1.0, b], a)) for b in np.linspace(-0.2, 0.0, 2001)]
    best = min(filtered, key=lambda x: float(x @ x))
    rho = np.array([best[k:] @ best[:-k] / (best @ best) for k in range(1, 21)])
    by_hand = N * (N + 2) * (rho**2 / (N - np.arange(1, 21))).sum()
    assert found.statistic == pytest.approx(by_hand, rel=1e-3) and found.freedom == 19


def test_stretches_are_not_joined():
    """A jump from one stretch to the next correlates nothing: alternating signs, one row each."""
    rng = np.random.default_rng(9)
    errors = np.repeat(rng.normal(size=(N // 2, 3)), 2, axis=0)  # pairs alike
    apart = np.arange(N)
    joined = residual_tests(errors, np.zeros(N), {})
    split = residual_tests(errors, apart, {})
    assert any(one.rejected for one in joined)
    assert all(one.correlation == 0.0 for one in split)


def test_too_little_says_nothing():
    assert residual_tests(np.zeros((50, 3)), np.zeros(50), {}) == ()
    assert residual_tests(np.full((N, 3), np.inf), np.zeros(N), {}) == ()
