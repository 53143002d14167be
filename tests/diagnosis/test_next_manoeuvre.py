"""What a manoeuvre would tell: by hand, and where seamanship knows the answer."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import closed
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_ship import PROFILE

from shiplog.diagnosis.residual import next_manoeuvre
from shiplog.voyages.rows.timescale import Timescale


@pytest.mark.parametrize("counts", [1.0, 0.25])
def test_what_a_rival_imitates_does_not_count(counts):
    """Columns: one coefficient, the cause, its rival. G = XᵀX of three made-up observations of
    variance 1. Where a trial counts a quarter of itself, their variance is four times as large."""
    x = np.array([[1.0, 2.0, 1.0], [0.0, 1.0, 3.0], [2.0, 0.0, 1.0]])
    g = np.zeros((4, 4))
    g[1:, 1:] = x.T @ x
    known = np.diag([4.0, 1e9, 1e9])  # the causes' nominal sizes are as good as known
    columns = SimpleNamespace(
        indices={"one": np.array([1]), "other": np.array([2])}, unit=np.array([1.0, 2.0, 1.0])
    )
    trial = SimpleNamespace(
        reference=SimpleNamespace(columns=columns, information=known, counts=counts)
    )
    named = SimpleNamespace(cause=SimpleNamespace(label="one"), numbers=np.array([3.0]))
    # by hand: y = 1.5 x₁, where the coefficient is N(0, ¼) and the rival N(0, 1)
    y = 1.5 * x[:, 1]
    alone = np.eye(3) / counts + 0.25 * np.outer(x[:, 0], x[:, 0])
    with_rival = alone + np.outer(x[:, 2], x[:, 2])
    expected = 0.5 * y @ np.linalg.inv(with_rival) @ y
    assert next_manoeuvre.separation(trial, g, named, "other") == pytest.approx(expected, rel=1e-6)


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


@jax.tree_util.register_static
@dataclass(frozen=True)
class Driven:
    """u̇ = (θ n - u)/20 s, straight ahead: it goes on at θ n."""

    names: tuple[str, ...] = ("speed",)
    substeps: int = 1

    def acceleration(self, theta, state, actuator, true_wind):
        ahead = (theta[0] * actuator[..., 1] - state[..., 1]) / 20.0
        return jnp.stack((ahead, -state[..., 3], -state[..., 5]), -1)


@pytest.mark.parametrize(("speed", "kept"), [(5.0, True), (500.0, False)])
def test_a_large_ship_goes_farther_than_a_model_of_it(speed, kept):
    """100 m at 5 m/s: 20 minutes of a manoeuvre at 0.7 of full power are 0.7 · 5 · (1200 - 20) m,
    41 ship lengths and no divergence; at 500 m/s they are 4130."""
    record = replace(closed.record(PROFILE), timescale=Timescale(120.0, 8.0, 8.0))
    record = replace(record, actuator=np.ones_like(record.actuator))
    reference = SimpleNamespace(
        model=Driven(), setting=SimpleNamespace(scale={"length": 100.0, "speed": 5.0})
    )
    trial = SimpleNamespace(record=record, reference=reference)
    sailed, within = next_manoeuvre.simulated(trial, np.array([speed]))
    out = [m.words for m in next_manoeuvre.MANOEUVRES].index("the same course out and back")
    assert within[out] == kept
    far = sailed.state[sailed.voyage == out][-1, 0]
    assert far == pytest.approx(0.7 * speed * 1180.0 if kept else 0.0, rel=2e-3)
    north, east = closed.TRUE_WIND  # felt by a ship that heads north
    assert sailed.wind[-1] == pytest.approx([north + sailed.state[-1, 1], east])
