"""Windows as a series over ground: winds, weights, padding, and rollouts in closed form."""

import itertools
import math
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import polars as pl
import pytest
from coupled_ships import Damped, sailed

from shiplog.simulation import jax_rollouts, sensitivities, window_series
from shiplog.simulation.window_series import WindowSeries
from shiplog.voyages.windows.windows import Windows

# ---------------------------------------------------------------- wind


def test_a_ship_at_rest_heading_north_has_an_east_wind_from_starboard():
    rest = np.zeros(6)
    found = window_series.true_wind(rest, np.array([5.0, math.pi / 2]))
    assert found == pytest.approx([0.0, 5.0], abs=1e-12)
    assert window_series.apparent_wind(rest, found) == pytest.approx([5.0, math.pi / 2])


@pytest.mark.parametrize(
    ("state", "true", "apparent"),
    [  # x0, u, y0, v, ψ, r; worked by hand
        ((0, 2, 0, 0, 0, 0), (0, 0), (2, 0)),  # its own speed comes from ahead
        ((0, 0, 0, 1, 0, 0), (0, 0), (1, math.pi / 2)),  # drifting to starboard, from starboard
        ((0, 0, 0, 0, math.pi / 2, 0), (3, 0), (3, -math.pi / 2)),  # heading east, north to port
        ((9, 4, 9, 0, math.pi, 0.1), (-1, -3), (math.hypot(5, 3), math.atan2(3, 5))),
        ((0, 2, 0, 0, 0, 0), (-2, 0), (0, 0)),  # running with the wind
    ],
)
def test_apparent_winds_worked_by_hand(state, true, apparent):
    state, true, apparent = (np.array(a, dtype=float) for a in (state, true, apparent))
    assert window_series.apparent_wind(state, true) == pytest.approx(apparent, abs=1e-12)
    assert window_series.true_wind(state, apparent) == pytest.approx(true, abs=1e-12)


def test_true_and_apparent_wind_are_inverses():
    rng = np.random.default_rng(0)
    state, true = rng.normal(size=(4, 7, 6)), rng.normal(size=(4, 7, 2)) * 3.0
    apparent = window_series.apparent_wind(state, true)
    assert apparent.shape == (4, 7, 2) and (np.abs(apparent[..., 1]) <= math.pi).all()
    assert window_series.true_wind(state, apparent) == pytest.approx(true, abs=1e-12)


# ---------------------------------------------------------------- series


def windows(data: WindowSeries, wind: np.ndarray | None = None) -> Windows:
    nothing = np.zeros((*data.measured.shape[:2], 0))
    plan = pl.DataFrame({"copy": [0] * len(data.measured)})
    blown = nothing if wind is None else wind
    return Windows(plan, data.measured, data.actuator, blown, data.dt)


def test_windows_become_a_series_over_ground(coupled):
    _, _, data = coupled
    apparent = window_series.apparent_wind(data.measured, data.wind)
    found = window_series.series(windows(data, apparent))
    for name in WindowSeries._fields:
        assert getattr(found, name) == pytest.approx(getattr(data, name), abs=1e-12), name
    calm = window_series.series(windows(data))  # no sensor
    assert calm.wind.shape == data.wind.shape and not calm.wind.any()


def test_samples_weigh_by_the_trapezoidal_rule(coupled):
    """dt 1, 3, 2: half of the neighbours' sum. The mean of a straight line is exact."""
    one = WindowSeries(np.zeros((1, 4, 6)), np.zeros((1, 4, 1)), np.zeros((1, 4, 2)),
                 np.array([[1.0, 3.0, 2.0]]), np.ones(1))  # fmt: skip
    assert one.steps.tolist() == [[0.5, 2.0, 2.5, 1.0]]
    data = coupled[2]
    assert data.steps.sum(1) == pytest.approx(data.dt.sum(1))


@pytest.mark.parametrize(("count", "size"), [(1, 8), (8, 8), (9, 16), (128, 128), (129, 256)])
def test_padding_reaches_the_next_size_with_windows_of_no_weight(count, size):
    data = sailed(count, 4, 1, (1.0,))
    whole = jax_rollouts.padded(data)
    for name in WindowSeries._fields:
        values = getattr(whole, name)
        assert len(values) == size
        assert (values[:count] == getattr(data, name)).all()
        assert np.isfinite(values).all()
    assert not whole.weight[count:].any()


def test_picked_windows_keep_all_that_is_theirs(coupled):
    data = coupled[2]
    some = window_series.pick(data, [3, 0])
    for name in WindowSeries._fields:
        assert (getattr(some, name) == getattr(data, name)[[3, 0]]).all()


# ---------------------------------------------------------------- rollout


def test_the_rate_turns_velocities_into_earth_axes():
    """Heading east: ahead is y₀, starboard is -x₀."""
    state = jnp.array([7.0, 2.0, 7.0, 0.5, math.pi / 2, 0.1])
    found = jax_rollouts.rate(Damped(), jnp.ones(3), state, jnp.zeros(3), jnp.zeros(2))
    assert np.asarray(found) == pytest.approx([-0.5, -2.0, 2.0, -0.5, 0.1, -0.1], abs=1e-12)


@pytest.mark.parametrize("substeps", [1, 3])
def test_a_rollout_is_euler_in_closed_form_over_uneven_steps(substeps):
    """ν - a/θ shrinks by (1 - θ dt/k)^k a step, a held; the heading sums r dt."""
    data = sailed(3, 12, 2, (0.02, 0.01, 0.001))
    driven = np.repeat(data.actuator[:, :1], 12, axis=1)
    theta = np.array([0.1, 0.3, 0.2])
    found = sensitivities.rollout(Damped(substeps), theta, data._replace(actuator=driven))
    assert found.shape == data.measured.shape
    assert (found[:, 0] == data.measured[:, 0]).all()
    shrink = (1.0 - theta * data.dt[..., None] / substeps) ** substeps
    rest = driven[:, :1] / theta
    start = data.measured[:, :1, [1, 3, 5]]
    wanted = rest + (start - rest) * np.cumprod(shrink, axis=1)
    assert found[:, 1:, [1, 3, 5]] == pytest.approx(wanted, rel=1e-12)
    if substeps == 1:
        heading = data.measured[:, :1, 4] + np.cumsum(found[:, :-1, 5] * data.dt, axis=1)
        assert found[:, 1:, 4] == pytest.approx(heading, rel=1e-12)


def test_inputs_act_in_the_step_that_they_begin():
    data = sailed(1, 5, 3, (1.0, 1.0, 1.0))._replace(actuator=np.zeros((1, 5, 3)))
    data.actuator[0, 2, 0] = 1.0
    found = sensitivities.rollout(Damped(), np.zeros(3), data)[0, :, 1]
    assert np.diff(found) == pytest.approx([0.0, 0.0, data.dt[0, 2], 0.0], abs=1e-15)


def test_halving_the_step_halves_eulers_error():
    """Against ν = a/θ + (ν₀ - a/θ) e^(-θt)."""
    data = sailed(3, 12, 2, (0.02, 0.01, 0.001))
    driven = np.repeat(data.actuator[:, :1], 12, axis=1)
    theta = np.array([0.1, 0.3, 0.2])
    rest = driven[:, 0] / theta
    elapsed = data.dt.sum(1)[:, None]
    exact = rest + (data.measured[:, 0, [1, 3, 5]] - rest) * np.exp(-theta * elapsed)
    held = data._replace(actuator=driven)
    error = [
        sensitivities.rollout(Damped(k), theta, held)[:, -1, [1, 3, 5]] - exact for k in (2, 4, 8)
    ]
    for coarse, fine in itertools.pairwise(error):
        assert coarse / fine == pytest.approx(np.full_like(fine, 2.0), abs=0.2)
    assert error[1] / error[2] == pytest.approx(np.full_like(exact, 2.0), abs=0.1)


def test_a_turning_ships_path_converges_at_the_first_order_too(coupled):
    """Each halving changes the end half as much as the one before."""
    model, theta, data = coupled
    end = [sensitivities.rollout(replace(model, substeps=k), theta, data)[:, -1] for k in (2, 4, 8)]
    change = [np.linalg.norm(a - b) for a, b in itertools.pairwise(end)]
    assert change[0] / change[1] == pytest.approx(2.0, abs=0.1)


def test_padding_and_neighbours_change_no_rollout(coupled):
    model, theta, data = coupled
    together = sensitivities.rollout(model, theta, data)
    assert sensitivities.rollout(model, theta, jax_rollouts.padded(data))[:5] == pytest.approx(
        together, rel=1e-12
    )
    alone = sensitivities.rollout(model, theta, window_series.pick(data, [4]))
    assert alone[0] == pytest.approx(together[4], rel=1e-12)


def test_simulated_windows_are_the_rollout(coupled):
    model, theta, data = coupled
    apparent = window_series.apparent_wind(data.measured, data.wind)
    simulator = sensitivities.Simulator(model, theta, np.zeros((4, 4)))
    found = simulator.simulate(windows(data, apparent))
    assert found.dtype == np.float64
    assert found == pytest.approx(sensitivities.rollout(model, theta, data), abs=1e-10)
