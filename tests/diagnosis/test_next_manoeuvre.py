"""What a manoeuvre would tell: by hand, and where seamanship knows the answer."""

from types import SimpleNamespace

import numpy as np
import pytest

from shiplog.diagnosis import next_manoeuvre


def test_what_a_rival_imitates_does_not_count():
    """Columns: one coefficient, the cause, its rival. G = XᵀX of three made-up observations."""
    x = np.array([[1.0, 2.0, 1.0], [0.0, 1.0, 3.0], [2.0, 0.0, 1.0]])
    g = np.zeros((4, 4))
    g[1:, 1:] = x.T @ x
    known = np.diag([4.0, 1e9, 1e9])  # the causes' nominal sizes are as good as known
    columns = SimpleNamespace(
        of={"one": np.array([1]), "other": np.array([2])}, unit=np.array([1.0, 2.0, 1.0])
    )
    trial = SimpleNamespace(reference=SimpleNamespace(columns=columns, information=known))
    named = SimpleNamespace(cause=SimpleNamespace(label="one"), numbers=np.array([3.0]))
    # by hand: y = 1.5 x₁, where the coefficient is N(0, ¼) and the rival N(0, 1)
    y = 1.5 * x[:, 1]
    alone = np.eye(3) + 0.25 * np.outer(x[:, 0], x[:, 0])
    with_rival = alone + np.outer(x[:, 2], x[:, 2])
    expected = 0.5 * y @ np.linalg.inv(with_rival) @ y
    assert next_manoeuvre.apart(trial, g, named, "other") == pytest.approx(expected, rel=1e-6)


def test_each_manoeuvre_is_within_what_the_ship_did():
    kinds = ("rudder", "propeller", "azimuth", "thruster")
    profile = SimpleNamespace(actuators=[SimpleNamespace(kind=k) for k in kinds])
    rows = 200
    actuator = np.linspace(-1.0, 1.0, rows)[:, None] * np.array([0.5, 10.0, 3.0, 2.0])
    record = SimpleNamespace(profile=profile, actuator=actuator, measured=np.ones(rows, dtype=bool))
    time = np.arange(0.0, next_manoeuvre.MANOEUVRE_S, 0.5)
    for manoeuvre in next_manoeuvre.MANOEUVRES:
        driven = next_manoeuvre.driven(record, manoeuvre, time)
        assert driven.shape == (len(time), 4) and np.isfinite(driven).all()
        assert (np.abs(driven) <= [0.5, 10.0, next_manoeuvre.HARD, 2.0]).all()
        assert driven[:, [1, 3]].min() >= 0.0 and driven[:, 1].max() > 0.0
