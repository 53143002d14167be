"""Rollouts of physical models and their derivatives: closed forms and central differences."""

import itertools
import math
from dataclasses import dataclass, replace
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
import pytest

from shiplog import profile_file as profiles
from shiplog.models.mmg import parameters
from shiplog.models.mmg.geometry import geometry_of
from shiplog.models.mmg.model import MMG
from shiplog.simulation import sensitivities
from shiplog.simulation.scoring import window_loss
from shiplog.simulation.sensitivities import WindowSeries
from shiplog.voyages.windows import Windows


@jax.tree_util.register_static
@dataclass(frozen=True)
class Damped:
    """ν̇ = -θ ν + input, each velocity by itself."""

    substeps: int = 1
    names: ClassVar = ("surge", "sway", "yaw")

    def acceleration(self, theta, state, actuator, true_wind):
        return -theta * state[..., jnp.array([1, 3, 5])] + actuator


@jax.tree_util.register_static
@dataclass(frozen=True)
class Coupled:
    """A ship in four numbers, everything acting on everything: drag, turn, push and wind."""

    substeps: int = 1
    names: ClassVar = ("drag", "turn", "push", "wind")

    def acceleration(self, theta, state, actuator, true_wind):
        drag, turn, push, wind = theta
        u, v, heading, r = state[..., 1], state[..., 3], state[..., 4], state[..., 5]
        c, s = jnp.cos(heading), jnp.sin(heading)
        north, east = true_wind[..., 0], true_wind[..., 1]
        return jnp.stack(
            (
                v * r - drag * u * jnp.abs(u) + push * actuator[..., 0] ** 2,
                -drag * v - turn * u * r - wind * (c * east - s * north),
                turn * (actuator[..., 1] * u - r) + 0.1 * v,
            ),
            axis=-1,
        )


COUPLED = np.array([0.05, 0.3, 0.02, 0.01])
SHIFT = 1e-5


def sailed(count: int, size: int, seed: int, actuators: tuple[float, ...]) -> WindowSeries:
    """Smooth motion that no model made, with steps between 0.5 and 1.5 s."""
    rng = np.random.default_rng(seed)
    t = np.arange(size) / size
    wave = np.sin(2.0 * (t + rng.random((count, 1, 6))[..., None, 0]))
    level = rng.normal(size=(count, 1, 6)) * (5.0, 0.06, 5.0, 0.03, 2.0, 0.02)
    state = level + (0.0, 0.25, 0.0, 0.0, 0.0, 0.0) + wave.transpose(0, 2, 1) * 0.01
    push = rng.normal(size=(count, 1, len(actuators))) * 0.2 + 1.0
    driven = (push + 0.2 * np.sin(6.0 * t)[None, :, None]) * actuators
    wind = rng.normal(size=(count, 1, 2)) * 2.0 + np.zeros((1, size, 1))
    dt = rng.uniform(0.5, 1.5, size=(count, size - 1))
    return WindowSeries(state, driven, wind, dt, np.ones(count))


def central(values, function, scale):
    """∂function/∂θ by central differences, on a new last axis."""
    columns = []
    for i, size in enumerate(scale):
        step = np.zeros_like(values)
        step[i] = SHIFT * size
        columns.append((function(values + step) - function(values - step)) / (2 * step[i]))
    return np.stack(columns, -1)


@pytest.fixture(scope="module")
def coupled():
    return Coupled(), COUPLED, sailed(5, 30, 0, (1.0, 0.2))


# ---------------------------------------------------------------- wind


def test_a_ship_at_rest_heading_north_has_an_east_wind_from_starboard():
    rest = np.zeros(6)
    found = sensitivities.true_wind(rest, np.array([5.0, math.pi / 2]))
    assert found == pytest.approx([0.0, 5.0], abs=1e-12)
    assert sensitivities.apparent_wind(rest, found) == pytest.approx([5.0, math.pi / 2])


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
    assert sensitivities.apparent_wind(state, true) == pytest.approx(apparent, abs=1e-12)
    assert sensitivities.true_wind(state, apparent) == pytest.approx(true, abs=1e-12)


def test_true_and_apparent_wind_are_inverses():
    rng = np.random.default_rng(0)
    state, true = rng.normal(size=(4, 7, 6)), rng.normal(size=(4, 7, 2)) * 3.0
    apparent = sensitivities.apparent_wind(state, true)
    assert apparent.shape == (4, 7, 2) and (np.abs(apparent[..., 1]) <= math.pi).all()
    assert sensitivities.true_wind(state, apparent) == pytest.approx(true, abs=1e-12)


# ---------------------------------------------------------------- series


def windows(data: WindowSeries, wind: np.ndarray | None = None) -> Windows:
    nothing = np.zeros((*data.measured.shape[:2], 0))
    plan = pl.DataFrame({"copy": [0] * len(data.measured)})
    blown = nothing if wind is None else wind
    return Windows(plan, data.measured, data.actuator, blown, data.dt)


def test_windows_become_a_series_over_ground(coupled):
    _, _, data = coupled
    apparent = sensitivities.apparent_wind(data.measured, data.wind)
    found = sensitivities.series(windows(data, apparent))
    for name in WindowSeries._fields:
        assert getattr(found, name) == pytest.approx(getattr(data, name), abs=1e-12), name
    calm = sensitivities.series(windows(data))  # no sensor
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
    whole = sensitivities.padded(data)
    for name in WindowSeries._fields:
        values = getattr(whole, name)
        assert len(values) == size
        assert (values[:count] == getattr(data, name)).all()
        assert np.isfinite(values).all()
    assert not whole.weight[count:].any()


def test_picked_windows_keep_all_that_is_theirs(coupled):
    data = coupled[2]
    some = sensitivities.pick(data, [3, 0])
    for name in WindowSeries._fields:
        assert (getattr(some, name) == getattr(data, name)[[3, 0]]).all()


# ---------------------------------------------------------------- rollout


def test_the_rate_turns_velocities_into_earth_axes():
    """Heading east: ahead is y₀, starboard is -x₀."""
    state = jnp.array([7.0, 2.0, 7.0, 0.5, math.pi / 2, 0.1])
    found = sensitivities.rate(Damped(), jnp.ones(3), state, jnp.zeros(3), jnp.zeros(2))
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
    assert sensitivities.rollout(model, theta, sensitivities.padded(data))[:5] == pytest.approx(
        together, rel=1e-12
    )
    alone = sensitivities.rollout(model, theta, sensitivities.pick(data, [4]))
    assert alone[0] == pytest.approx(together[4], rel=1e-12)


def test_simulated_windows_are_the_rollout(coupled):
    model, theta, data = coupled
    apparent = sensitivities.apparent_wind(data.measured, data.wind)
    simulator = sensitivities.Simulator(model, theta, np.zeros((4, 4)))
    found = simulator.simulate(windows(data, apparent))
    assert found.dtype == np.float64
    assert found == pytest.approx(sensitivities.rollout(model, theta, data), abs=1e-10)


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
    many = sensitivities.pick(data, [0, 1, 2, 3, 4] * 3)
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
    some = sensitivities.normal(model, theta, sensitivities.pick(data, [0, 2]))
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
    whole = sensitivities.normal(model, theta, data)
    monkeypatch.setattr(sensitivities, "WINDOWS_AT_A_TIME", 8)
    assert len(sensitivities.padded(data).weight) == 24
    parts = sensitivities.normal(model, theta, data)
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
