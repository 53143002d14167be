"""The MMG as a simulator of somebody else's: all that is asked of it is what the kernels give."""

import numpy as np
import pytest
from cause_ships import BY, TWIN, extended
from in_process import Here

from shiplog.diagnosis.linear import foreign_paths
from shiplog.models.causes.environment import Current
from shiplog.models.causes.ship import Fouling
from shiplog.simulation import foreign_model
from shiplog.simulation.kernel import paths, rollouts
from shiplog.simulation.window_series import WindowSeries

CAUSES = (Current(), Fouling())
NUMBERS = np.array([0.1, -0.06, 0.4])  # m/s towards, share of the resistance
S, K, J, BINS, STEP = 5, 21, 3, 5, 0.25  # segments, instants, nodes, bins, s


@pytest.fixture(scope="module")
def both():
    """Native and foreign, with the same causes, and their θ."""
    native, theta = extended(CAUSES)
    foreign, none = extended(CAUSES, base=Here(native.base, theta))
    return native, np.concatenate((theta, NUMBERS)), foreign, np.concatenate((none, NUMBERS))


def driven(count, instants=K):
    rng = np.random.default_rng(1)
    acts = rng.uniform((-0.4, -0.4, 4.0), (0.4, 0.4, 10.0), (count, 1, 3))
    change = rng.uniform(-0.02, 0.02, (count, 1, 3)) * np.arange(instants)[None, :, None]
    wind = np.broadcast_to(rng.normal(size=(count, 1, 2)), (count, instants, 2))
    return np.concatenate((acts + change, np.full((count, instants, 1), 0.5), wind), 2)


def states(count):
    return np.random.default_rng(2).normal(size=(count, 6)) * (5.0, 0.2, 5.0, 0.1, 2.0, 0.05) + (
        0.0, 0.6, 0.0, 0.0, 0.0, 0.0
    )  # fmt: skip


def test_accelerations_with_causes_are_the_native_ones(both):
    native, theta, foreign, q = both
    rows = np.concatenate((states(7), driven(7)[:, 0]), 1)
    expected = np.asarray(native.acceleration(theta, rows[:, :6], rows[:, 6:-2], rows[:, -2:]))
    assert foreign_model.values(foreign, q, rows) == pytest.approx(expected, abs=1e-12)


@pytest.mark.long
def test_slopes_with_causes_are_the_native_ones(both):
    native, theta, foreign, q = both
    state, inputs = states(7), driven(7)[:, 0]
    kernel = rollouts.row_slopes(native, theta, np.concatenate((state, inputs), 1))
    assert kernel is not None
    found = foreign_model.slopes(foreign, q, state, inputs)
    for one, expected in zip(found[:3], kernel[:3], strict=True):
        assert one == pytest.approx(expected, abs=1e-6)
    assert found[3] == pytest.approx(kernel[3][..., -len(NUMBERS) :], abs=1e-6)


def test_a_current_alone_needs_no_kernel(both):
    """∂ν̇/∂V by the chain rule against differences."""
    _, _, foreign, q = both
    q = q * (1.0, 1.0, 0.0)
    state, inputs = states(4), driven(4)[:, 0]
    rows, h = np.concatenate((state, inputs), 1), 1e-5

    def moved(column):
        up, down = rows.copy(), rows.copy()
        up[:, column] += h
        down[:, column] -= h
        return (
            foreign_model.values(foreign, q, up) - foreign_model.values(foreign, q, down)
        ) / (2.0 * h)  # fmt: skip

    _, by_state, by_driven, _ = foreign_model.slopes(foreign, q, state, inputs)
    for column in range(6):
        assert by_state[..., column] == pytest.approx(moved(column), abs=1e-6)
    for column in range(inputs.shape[1]):
        assert by_driven[..., column] == pytest.approx(moved(6 + column), abs=1e-6)


@pytest.mark.long
@pytest.mark.parametrize("fouled", [0.0, 0.4], ids=["current alone", "a cause that pushes"])
def test_segments_are_the_native_ones(both, fouled):
    native, theta, foreign, q = both
    theta, q = theta.copy(), q.copy()
    theta[-1] = q[-1] = fouled
    at = np.arange(K) * STEP
    hats = np.maximum(0.0, 1.0 - np.abs(at[:, None] / at[-1] * (J - 1) - np.arange(J)))
    push = np.random.default_rng(5).normal(size=(S, K, 3)) * (0.01, 0.01, 0.003)
    moved = (np.array([[0, 2]]), np.full((S, 1, K), 0.3), 3)
    given = (states(S), push, driven(S), hats, STEP, BINS, moved)
    expected = paths.columns(native, theta, *given)
    assert expected is not None and expected[2] is not None
    y, z, j = foreign_paths.columns(foreign, q, *given)
    assert j is not None
    assert y == pytest.approx(expected[0], abs=2e-4)
    scale = np.abs(expected[1]).max((0, 1), keepdims=True) + 1e-9
    assert (z - expected[1]) / scale == pytest.approx(0.0, abs=2e-3)
    own = expected[2][..., -len(NUMBERS) :]
    scale = np.abs(own).max((0, 1), keepdims=True) + 1e-9
    assert (j - own) / scale == pytest.approx(0.0, abs=4e-3)


def test_a_rollout_in_a_current_is_one_in_water_that_moves(both):
    """Heun's rule over ground, of the same equations, step by step."""
    _, _, foreign, q = both
    q = q * (1.0, 1.0, 0.0)
    many = driven(3, 8)
    data = WindowSeries(
        np.repeat(states(3)[:, None], 8, 1), many[..., :-2], many[..., -2:], np.ones((3, 7)),
        np.ones(3),
    )  # fmt: skip
    in_water = foreign_model.rollout(foreign, q, data)
    assert in_water == pytest.approx(foreign_model._by_heun(foreign, q, data), abs=3e-3)
    assert in_water[:, 0] == pytest.approx(data.measured[:, 0])


def test_a_cause_with_numbers_of_zero_pushes_nothing(both):
    _, _, foreign, q = both
    assert foreign_model._pushed(foreign, q)
    assert not foreign_model._pushed(foreign, q * (1.0, 1.0, 0.0))
    assert foreign_model.simulator_of(foreign) is foreign.base
    assert foreign_model.simulator_of(extended((BY["current"],), TWIN)[0]) is None
