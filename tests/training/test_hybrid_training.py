"""The fit of a residual network, and how much of it held-out windows allow."""

import numpy as np
import pytest
from hybrid_ship import PHYSICS, SIZE, THETA, WIDTH, flat, sailed

from shiplog.models.mmg import MMG
from shiplog.simulation import jax_rollouts, sensitivities
from shiplog.simulation.window_series import WindowSeries
from shiplog.training.physics import hybrid_training
from shiplog.training.physics.output_error import Identified

PULL = 0.002  # m/s² to starboard a unit of thrust: the extra force that no physics know of


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
def pulled(physics, theta, data) -> WindowSeries:
    """The MMG and a known small force in addition, as if the thruster were slightly askew."""
    state = data.measured[:, 0].copy()
    path = [state]
    for i in range(SIZE - 1):
        at, blowing = data.actuator[:, i], data.wind[:, i]
        moved = np.array(jax_rollouts.rate(physics, theta, state, at, blowing))
        moved[:, 3] += PULL * at[:, 1]
        state = state + moved
        path.append(state)
    return data._replace(measured=np.stack(path, 1))


@pytest.fixture(scope="module")
def known(theta) -> Identified:
    """What the physics were identified as before: some of them sure to a per cent."""
    free = np.arange(len(theta)) % 2 == 0
    covariance = np.diag(np.where(free, (0.01 * theta) ** 2, 0.0))
    return Identified(theta, covariance, free, 1.0, (77.0, 55.0), 3, True, "converged")


def trained(physics, known, data, strength):
    rng = np.random.default_rng(3)
    return hybrid_training.fit(physics, known, data, width=WIDTH, strength=strength, rng=rng)


@pytest.fixture(scope="module")
def taught(physics, known, pulled):
    return trained(physics, known, pulled, 1.0)


def test_the_network_learns_a_small_force_and_leaves_the_physics_alone(
    taught, physics, known, theta, pulled
):
    model, done = taught
    count = len(theta)
    assert done.values[:count].tolist() == theta.tolist()
    assert (done.covariance[:count, :count] == known.covariance).all()
    assert not done.covariance[:count, count:].any()
    assert np.diag(done.covariance)[count:].all()
    assert done.free.tolist() == known.free.tolist() + [True] * model.residual.count
    before = sensitivities.losses(physics, theta, pulled).mean()
    assert done.loss == (
        77.0,
        pytest.approx(sensitivities.losses(model, done.values, pulled).mean()),
    )
    assert done.loss[1] < 0.2 * before


def test_what_it_learned_is_that_force(taught, pulled):
    """Across, PULL times the thrust of 0.6 in the mean; ahead and in yaw next to nothing."""
    model, done = taught
    added = np.asarray(model.added(done.values, *flat(pulled)))
    thrust = pulled.actuator.reshape(-1, 2)[:, 1]
    assert added.mean(0) == pytest.approx([0.0, PULL * thrust.mean(), 0.0], abs=0.15 * PULL)
    assert np.corrcoef(thrust, added[:, 1])[0, 1] > 0.5


def test_less_strength_says_less(taught, physics, known, pulled):
    _, done = trained(physics, known, pulled, 1e-6)
    model, strong = taught
    printed = [
        np.abs(np.asarray(model.added(d.values, *flat(pulled)))).max() for d in (done, strong)
    ]
    assert printed[0] < 0.05 * printed[1]
    assert done.loss[1] > strong.loss[1]


def judged(**gain: float) -> dict[float, np.ndarray]:
    """Made-up losses of 50 windows: s03=10 is a mean 10 below the physics, ± 20 a window."""
    rng = np.random.default_rng(6)
    physics = rng.gamma(2.0, 50.0, 50) + 200.0
    table = {"s0": 0.0, "s01": 0.1, "s03": 0.3, "s1": 1.0}
    losses = {0.0: physics}
    for name, less in gain.items():
        noise = rng.normal(size=50)
        losses[table[name]] = physics - less + 20.0 * (noise - noise.mean())
    return losses


@pytest.mark.parametrize(
    ("gain", "wanted"),
    [
        (dict(s01=0.5, s03=1.0, s1=0.2), 0.0),  # a gain of 1 ± 20/√50 = 2.8 is chance
        (dict(s01=5.0, s03=60.0, s1=20.0), 0.3),
        (dict(s01=59.0, s03=60.0, s1=20.0), 0.1),  # as good as the best, and less of it
        (dict(s01=45.0, s03=60.0, s1=20.0), 0.3),  # 15 ± 28/√50 = 4 is no chance
        (dict(s01=20.0, s03=59.0, s1=60.0), 0.3),
        (dict(s01=10.0, s03=20.0, s1=60.0), 1.0),
        (dict(s01=-50.0, s03=-60.0, s1=-70.0), 0.0),
    ],
)
def test_the_least_strength_within_one_standard_error_is_chosen(gain, wanted):
    assert hybrid_training.choose(judged(**gain)) == wanted


def test_windows_are_compared_in_pairs():
    """Windows differ by hundreds; a network that takes 5 from every one of them is no chance."""
    physics = np.linspace(100.0, 900.0, 40)
    better = physics - 5.0 + 0.1 * np.cos(np.arange(40.0))
    assert hybrid_training.choose({0.0: physics, 0.1: better}) == 0.1
