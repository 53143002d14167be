"""The residual network: silent far from its training data, bounded near it, honest about forces."""

import math

import jax.numpy as jnp
import numpy as np
import polars as pl
import pytest
from hybrid_ship import COUNT, PHYSICS, PROFILE, SHIP, SIZE, THETA, WIDTH, flat, sailed

from shiplog.models.hybrid import Hybrid, anchored, first_weights, weight_spread
from shiplog.models.mmg import MMG, estimated, geometry_of
from shiplog.ship_profile import file as profiles
from shiplog.simulation import coverage, force_breakdown, sensitivities, window_series
from shiplog.simulation.sensitivities import Simulator
from shiplog.simulation.window_series import WindowSeries
from shiplog.training.physics import hybrid_training


@pytest.fixture(scope="module")
def physics() -> MMG:
    return PHYSICS


@pytest.fixture(scope="module")
def theta() -> np.ndarray:
    return THETA


@pytest.fixture(scope="module")
def data() -> WindowSeries:
    return sailed()


@pytest.fixture(scope="module")
def hybrid(physics, data) -> Hybrid:
    return Hybrid(physics, hybrid_training.residual(physics, data, WIDTH))


@pytest.fixture(scope="module")
def trained(hybrid, theta) -> np.ndarray:
    """The physics and weights of which every one says something."""
    weights = np.random.default_rng(1).normal(size=hybrid.residual.count)
    return np.concatenate((theta, weights))


def away(data: WindowSeries) -> WindowSeries:
    """The same windows with the azimuth half round: where no training second was."""
    return turned(data, math.pi)


def turned(data: WindowSeries, angle: float) -> WindowSeries:
    return data._replace(actuator=data.actuator + np.array([angle, 0.0]))


# ---------------------------------------------------------------- what it adds


def test_it_begins_as_pure_physics(hybrid, physics, theta, data):
    """The output layer is zero, whatever the hidden one is."""
    weights = first_weights(hybrid.residual, np.random.default_rng(0))
    assert weights.size == hybrid.residual.count == WIDTH * 7 + WIDTH + 3 * WIDTH + 3
    assert weights[: WIDTH * 8].all() and not weights[WIDTH * 8 :].any()
    whole = np.concatenate((theta, weights))
    assert len(hybrid.names) == len(whole) == len(set(hybrid.names))
    assert hybrid.names[: len(theta)] == physics.names
    assert hybrid.names[-1] == "network.c2_2"
    assert Hybrid(MMG(physics.geometry, 4), hybrid.residual).substeps == 4
    at = flat(data)
    assert (hybrid.acceleration(whole, *at) == physics.acceleration(theta, *at)).all()


def test_the_network_is_worked_by_hand(hybrid, trained, theta, data):
    """b tanh(W₂ tanh(W₁ z + c₁) + c₂), weights in the order of the shapes."""
    net, w = hybrid.residual, trained[len(theta) :]
    w1, c1 = w[: WIDTH * 7].reshape(WIDTH, 7), w[WIDTH * 7 : WIDTH * 8]
    w2, c2 = w[WIDTH * 8 : -3].reshape(3, WIDTH), w[-3:]
    z = np.asarray(hybrid.features(*flat(data)))[17]
    wanted = net.bound * np.tanh(w2 @ np.tanh(w1 @ z + c1) + c2)
    assert np.asarray(hybrid.network(trained, z)) == pytest.approx(wanted, rel=1e-12)
    assert hybrid.names[len(theta) + WIDTH * 7 + 1] == "network.c1_1"


def test_it_is_added_to_the_physics(hybrid, physics, trained, theta, data):
    at = flat(data)
    whole, alone = hybrid.acceleration(trained, *at), physics.acceleration(theta, *at)
    added = np.asarray(hybrid.added(trained, *at))
    assert np.asarray(whole - alone) == pytest.approx(added, abs=1e-12)
    net = hybrid.network(trained, hybrid.features(*at))
    assert added == pytest.approx(np.asarray(net), abs=1e-12)  # 1 · among its own data
    assert np.abs(added).max() > 1e-4


@pytest.mark.parametrize("size", [1e3, 1e9])
def test_the_largest_weights_stay_within_the_bound(hybrid, trained, theta, data, size):
    """A standard deviation of the measured accelerations, each axis its own."""
    velocity = data.measured[..., [1, 3, 5]]
    std = ((velocity[:, 5:] - velocity[:, :-5]) / 5.0).reshape(-1, 3).std(0)
    assert hybrid.residual.bound == pytest.approx(std)
    for at in (flat(data), flat(away(data))):
        huge = np.concatenate((theta, size * trained[len(theta) :]))
        added = np.abs(np.asarray(hybrid.added(huge, *at)))
        assert (added <= hybrid.residual.bound * (1 + 1e-12)).all()
    near = np.abs(np.asarray(hybrid.added(huge, *flat(data))))
    assert near.max(0) == pytest.approx(hybrid.residual.bound)  # and they reach it


# ---------------------------------------------------------------- where it is silent


def test_it_fades_from_the_training_data_to_nothing(hybrid, data):
    net = hybrid.residual
    assert np.asarray(hybrid.fade(net.anchors)) == pytest.approx(np.ones(len(net.anchors)))
    inside = np.asarray(hybrid.fade(hybrid.features(*flat(data))))
    assert inside == pytest.approx(np.ones_like(inside), abs=1e-12)
    far = net.anchors + 100.0
    assert np.asarray(hybrid.fade(far)).tolist() == [0.0] * len(far)


def test_the_fade_falls_smoothly_over_two_limits(hybrid):
    """1 to the radius, 0 from two limits beyond it; half way s = ½, s²(3 - 2s) = ½."""
    net = hybrid.residual
    outmost = net.anchors[np.argmax(net.anchors[:, 0])]  # ahead of it there is nothing
    distance = np.linspace(0.0, net.radius + 3.0 * net.limit, 400)
    along = np.asarray(hybrid.fade(outmost + np.outer(distance, np.eye(7)[0])))
    assert (np.diff(along) <= 1e-12).all()
    assert (along[distance < net.radius - 1e-6] == 1.0).all()
    assert (along[distance > net.radius + 2.0 * net.limit + 1e-6] == 0.0).all()
    for share, wanted in ((0.25, 0.84375), (0.5, 0.5), (0.75, 0.15625)):
        beyond = net.radius + share * 2.0 * net.limit
        at = outmost + beyond * np.eye(7)[0]
        assert float(hybrid.fade(at)) == pytest.approx(wanted, rel=1e-9)


def test_far_away_it_is_the_physics_to_the_last_digit(hybrid, physics, trained, theta, data):
    far = away(data)
    at = flat(far)
    assert (hybrid.acceleration(trained, *at) == physics.acceleration(theta, *at)).all()
    rolled = sensitivities.rollout(hybrid, trained, far)
    assert rolled == pytest.approx(sensitivities.rollout(physics, theta, far), abs=1e-12)
    near = sensitivities.rollout(hybrid, trained, data)
    assert np.abs(near - sensitivities.rollout(physics, theta, data)).max() > 0.01


# ---------------------------------------------------------------- what it sees


def test_an_azimuth_that_has_turned_round_stands_where_it_stood(hybrid, trained, data):
    """A record counts on past 180 deg; a training second has it between -180 and 180."""
    once = np.asarray(hybrid.added(trained, *flat(data)))
    again = np.asarray(hybrid.added(trained, *flat(turned(data, -4.0 * math.pi))))
    assert np.abs(once).max() > 1e-3
    assert again == pytest.approx(once, rel=1e-9, abs=1e-12)


def table(data: WindowSeries) -> pl.DataFrame:
    """The samples as the 1 Hz table has them, the wind as it was felt on board."""
    state, actuator, wind = flat(data)
    felt = window_series.apparent_wind(state, wind)
    names = ("x0", "surge", "y0", "sway", "heading", "yaw_rate")
    columns = {name: state[:, i] for i, name in enumerate(names)}
    columns |= {"azimuth": actuator[:, 0], "thruster": actuator[:, 1]}
    columns |= {"wind_speed": felt[:, 0], "wind_angle": felt[:, 1]}
    index = {"voyage": ["a"] * len(state), "elapsed": np.arange(float(len(state)))}
    return pl.DataFrame(index | columns)


def test_it_sees_what_coverage_measures(hybrid, data):
    """The same columns in the same order, standardised alike, the same limit of distance."""
    observed = coverage.learn(table(data), PROFILE.actuator_names, has_wind=True)
    net = hybrid.residual
    assert observed.names == ("surge", "sway", "yaw_rate", "azimuth", "thruster",
                          "wind_ahead", "wind_starboard")  # fmt: skip
    assert net.mean == pytest.approx(observed.mean) and net.std == pytest.approx(observed.std)
    assert np.asarray(hybrid.features(*flat(data))) == pytest.approx(observed.tree.data, abs=1e-9)
    assert net.limit == pytest.approx(observed.limit)


def test_without_wind_it_has_five_inputs(data):
    calm = MMG(geometry_of(PROFILE, without=["wind"])[0])
    net = hybrid_training.residual(calm, data, WIDTH)
    assert len(net.mean) == net.anchors.shape[1] == 5
    z = Hybrid(calm, net).features(*flat(data))
    assert z.shape == (COUNT * SIZE, 5)
    assert np.asarray(z).std(0) == pytest.approx(np.ones(5))


def test_windows_of_no_weight_teach_it_nothing(physics, data):
    wrong = data.measured.copy()
    wrong[5:] = 99.0
    weight = np.where(np.arange(COUNT) < 5, 1.0, 0.0)
    some = hybrid_training.residual(physics, data._replace(measured=wrong, weight=weight), WIDTH)
    alone = hybrid_training.residual(physics, window_series.pick(data, slice(0, 5)), WIDTH)
    for name in ("mean", "std", "bound", "anchors", "radius", "limit"):
        assert getattr(some, name) == pytest.approx(getattr(alone, name)), name


def test_an_input_that_never_changes_does_not_divide_by_nothing(physics, data):
    steady = data._replace(actuator=np.full_like(data.actuator, 0.5))
    net = hybrid_training.residual(physics, steady, WIDTH)
    assert net.std[3:5].tolist() == [1.0, 1.0]
    assert np.isfinite(net.anchors).all()


@pytest.mark.parametrize("most", [1, 10, 200])
def test_anchors_are_samples_that_cover_all_of_them(most):
    samples = np.random.default_rng(2).normal(size=(400, 3))
    chosen, radius = anchored(samples, most)
    assert chosen.shape == (most, 3)
    apart = np.linalg.norm(samples[:, None] - chosen, axis=-1)
    assert (apart.min(0) == 0.0).all()  # each is one of them
    assert apart.min(1).max() == pytest.approx(radius)
    between = np.linalg.norm(chosen[:, None] - chosen, axis=-1)[~np.eye(most, dtype=bool)]
    assert most == 1 or between.min() >= radius - 1e-12  # what makes it twice the best at most


def test_few_samples_are_all_of_them_anchors():
    samples = np.array([[0.0], [1.0], [5.0], [1.0]])
    chosen, radius = anchored(samples)
    assert sorted(chosen.ravel().tolist()) == [0.0, 1.0, 5.0] and radius == 0.0
    assert chosen[0, 0] == 1.0  # the nearest to the middle, 1.75


# ---------------------------------------------------------------- forces


@pytest.mark.parametrize("part", ["mmg", "hybrid"])
def test_the_parts_of_the_force_move_the_ship(part, physics, hybrid, theta, trained, data):
    """Their sum is what the equations of motion, written out, need for the acceleration."""
    model, numbers = {"mmg": (physics, theta), "hybrid": (hybrid, trained)}[part]
    seconds = table(data)[::7]
    simulator = Simulator(model, numbers, np.zeros((len(numbers),) * 2))
    found = force_breakdown.break_down(simulator, seconds, PROFILE)
    assert found.columns == ["voyage", "time", "part", "surge", "sway", "yaw"]
    named = ["hull", "thruster", "wind", *(["network"] if part == "hybrid" else []), "total"]
    order = found["part"].unique(maintain_order=True).to_list()
    assert sorted(order[:-1]) == sorted(named[:-1]) and order[-1] == "total"
    by = {
        name: found.filter(pl.col("part") == name).select("surge", "sway", "yaw").to_numpy()
        for name in named
    }
    total = by.pop("total")
    assert sum(by.values()) == pytest.approx(total, rel=1e-12, abs=1e-12)
    assert found.filter(pl.col("part") == "hull")["time"].to_list() == seconds["elapsed"].to_list()

    g, p = physics.geometry, dict(zip(physics.names, theta, strict=True))
    unit = 0.5 * g.density * 16.0 * 0.3
    m, x_g = 700.0, 0.1
    m_x, m_y, yaw = p["body.m_x"] * unit, p["body.m_y"] * unit, p["body.i_j"] * unit * 16.0
    state, actuator, wind = (a[::7] for a in flat(data))
    moved = np.asarray(model.acceleration(jnp.array(numbers), state, actuator, wind))
    (du, dv, dr), (u, v, r) = moved.T, state[:, [1, 3, 5]].T
    x = (m + m_x) * du - (m + m_y) * v * r - x_g * m * r**2
    y = (m + m_y) * dv + (m + m_x) * u * r + x_g * m * dr
    n = (yaw + x_g**2 * m) * dr + x_g * m * (dv + u * r)
    assert total == pytest.approx(np.stack((x, y, n), -1), rel=1e-9, abs=1e-9)
    if part == "hybrid":
        du, dv, dr = np.asarray(hybrid.added(trained, state, actuator, wind)).T
        extra = ((m + m_x) * du, (m + m_y) * dv + x_g * m * dr,
                 x_g * m * dv + (yaw + x_g**2 * m) * dr)  # fmt: skip
        assert by["network"] == pytest.approx(np.stack(extra, -1), rel=1e-9, abs=1e-9)
        assert np.abs(by["network"]).max() > 0.1


def test_the_forces_of_a_ship_without_wind_sensor_are_those_of_a_calm(data):
    text = SHIP.replace('[sensors.wind]\ntopic = "/w"\nfields = ["speed", "angle"]\n', "")
    ship = profiles.parse(text, "calm.toml")
    g, main, _ = geometry_of(ship)
    numbers = estimated(g, main).values
    seconds = table(data).drop("wind_speed", "wind_angle")[:9]
    found = force_breakdown.break_down(Simulator(MMG(g), numbers, np.zeros((2, 2))), seconds, ship)
    assert found["part"].unique(maintain_order=True).to_list() == ["hull", "thruster", "total"]
    assert found.height == 3 * 9


# ---------------------------------------------------------------- the fit


def test_the_spread_of_a_weight_is_its_layers(hybrid):
    spread = weight_spread(hybrid.residual, 0.3)
    assert spread[: WIDTH * 7] == pytest.approx(np.full(WIDTH * 7, 1 / math.sqrt(7)))
    assert spread[WIDTH * 7 : WIDTH * 8].tolist() == [1.0] * WIDTH
    assert spread[WIDTH * 8 : -3] == pytest.approx(np.full(3 * WIDTH, 0.3 / math.sqrt(WIDTH)))
    assert spread[-3:].tolist() == [0.3] * 3
