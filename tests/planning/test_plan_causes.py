"""Divergences of causes against closed forms of normal distributions."""

import numpy as np
import pytest

from shiplog.models.causes import CATALOGUE
from shiplog.planning.causes import SENSORS, divergence, divergences

A, B = np.array([0, 1]), np.array([2])


def information(seed=0):
    root = np.random.default_rng(seed).normal(size=(6, 3))
    return root.T @ root, root


def normal_divergence(one, other):
    """D(N(0, S₁) || N(0, S₂)), written out."""
    n = len(one)
    inner = np.trace(np.linalg.solve(other, one)) - n
    return 0.5 * (inner + np.linalg.slogdet(other)[1] - np.linalg.slogdet(one)[1])


def test_it_is_the_divergence_of_what_both_causes_predict():
    """y = Z x + noise of variance one: y | a ~ N(0, I + Z_a Z_aᵀ)."""
    whole, Z = information()
    a, b = (np.eye(6) + Z[:, c] @ Z[:, c].T for c in (A, B))
    assert divergence(whole, A, B) == pytest.approx(normal_divergence(a, b))
    assert divergence(whole, B, A) == pytest.approx(normal_divergence(b, a))
    nothing = np.zeros(0, int)
    assert divergence(whole, A, nothing) == pytest.approx(normal_divergence(a, np.eye(6)))


def test_twins_are_listed_first_and_a_sensor_tells_them_apart():
    """A current and a heading offset with the same column; payload shows by itself."""
    Z = np.zeros((5, 3))
    Z[0, :2], Z[1, 2] = 8.0, 8.0
    columns = {"current": np.array([0]), "heading_offset": np.array([1]), "payload": np.array([2])}
    found = divergences(Z.T @ Z, columns, {name: name for name in columns})
    worst = found.pairs[0]
    assert {worst.a, worst.b} == {"current", "heading_offset"} and worst.nats == 0.0
    assert found.twins == (worst,) and not found.unseen
    assert worst.sensor and worst.with_it > 5.0
    assert {"current", "heading_offset"} & set(SENSORS[worst.sensor])
    assert all(pair.nats > 5.0 and not pair.sensor for pair in found.pairs[1:])


def test_what_does_not_show_is_not_a_twin():
    Z = np.diag([8.0, 0.01])
    columns = {"current": np.array([0]), "bank": np.array([1])}
    found = divergences(Z.T @ Z, columns, {name: name for name in columns})
    assert found.unseen == ("bank",) and not found.twins


def test_every_sensor_measures_a_cause_of_the_catalogue():
    known = {cause.name for cause in CATALOGUE}
    for measures in SENSORS.values():
        assert set(measures) <= known
