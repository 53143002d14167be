"""Ships that need finer steps, and segments in which a model diverges."""

from dataclasses import dataclass, replace

import closed
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from toy_ship import GRID, RECORD, ROWS, THETA, WIDE, Toy, nothing, path

from shiplog.diagnosis.linear import jax_paths, linearisation, segments
from shiplog.diagnosis.linear.linear_segments import Path
from shiplog.diagnosis.linear.segments import Cut
from shiplog.diagnosis.noise import likelihood
from shiplog.models import mmg
from shiplog.ship_profile import file as profiles


@jax.tree_util.register_static
@dataclass(frozen=True)
class Stiff:
    """ν̇ = -k ν, ten times as much where the first actuator is on; stable in training by
    `substeps` Euler steps a second."""

    substeps: int = 4
    names: tuple[str, ...] = ("k",)
    smooth: float = 0.0

    def acceleration(self, theta, state, actuator, true_wind):
        damping = theta[0] * (1.0 + 9.0 * actuator[..., :1])
        return -damping * state[..., jnp.array([1, 3, 5])]


def coasting(segments_on: tuple[int, ...] = ()) -> tuple[Cut, Path, np.ndarray]:
    """Four segments that begin with 1 m/s ahead and nothing else; measured as k = 7 has it."""
    cut = segments.cut(RECORD, ROWS)
    k, edges = 7.0, 2.0 * np.arange(GRID.bins + 1)
    x = lambda t: t / k - (1.0 - np.exp(-k * t)) / k**2  # noqa: E731  # ∫ of (1 - e^(-kt))/k
    y = np.zeros((4, GRID.bins, 6))
    y[..., 0] = np.diff(x(edges)) / 2.0
    y[..., 1] = np.diff((1.0 - np.exp(-k * edges)) / k) / 2.0
    driven = np.zeros_like(cut.driven)
    driven[list(segments_on), :, 0] = 1.0
    start = np.tile([0.0, 1.0, 0.0, 0.0, 0.0, 0.0], (4, 1))
    return replace(cut, y=y, driven=driven), Path(start, np.zeros((4, 3, GRID.nodes))), y


@pytest.mark.parametrize(("substeps", "many"), [(1, 1), (2, 1), (4, 2), (8, 4)])
def test_steps_between_nodes_follow_trainings(substeps, many):
    """Stable where training is: |λ| up to 2n a second there, up to one over the step here."""
    assert linearisation.stable_steps(Stiff(substeps), 0.2) == many
    assert 2.0 * substeps * 0.2 / many <= 1.0


def test_what_training_holds_is_held_here():
    """Damping of 7 1/s, stable with four Euler steps a second: u = e^(-7t). With the instants' step
    alone the speed would grow by half from step to step."""
    cut, at, y = coasting()
    found, columns, _ = linearisation.simulated(Stiff(4), np.array([7.0]), cut, at, GRID)
    assert found[:, 1:] == pytest.approx(y[:, 1:], abs=0.02)  # of the whole way, 1/7 m
    assert np.abs(columns[..., 1]).max() < 1.0
    wild, *_ = linearisation.simulated(Stiff(1), np.array([7.0]), cut, at, GRID)
    assert not np.isfinite(wild).all() or np.abs(wild).max() > 1e6


def test_columns_between_nodes_are_derivatives_of_what_was_simulated():
    cut, theta = segments.cut(RECORD, ROWS), THETA
    at, model = path(), Toy(substeps=4)
    none = nothing(cut)
    found = linearisation.linear(model, theta, cut, GRID, at, *none)

    def y(theta, at):
        return linearisation.simulated(model, theta, cut, at, GRID)[0]

    for i in range(4):
        h = 1e-5 * np.eye(4)[i]
        slope = (y(theta + h, at) - y(theta - h, at)) / 2e-5
        assert found.j[..., i] == pytest.approx(slope, rel=1e-5, abs=1e-4)
    for i, h in enumerate(1e-5 * np.eye(6)):
        more, less = (replace(at, start=at.start + s) for s in (h, -h))
        assert found.z[..., i] == pytest.approx((y(theta, more) - y(theta, less)) / 2e-5, abs=2e-6)
    h = np.zeros_like(at.acceleration)
    h[:, 1, 7] = 1e-5
    more, less = (replace(at, acceleration=at.acceleration + s) for s in (h, -h))
    slope = (y(theta, more) - y(theta, less)) / 2e-5
    assert found.z[..., 6 + GRID.nodes + 7] == pytest.approx(slope, abs=2e-5)


@pytest.mark.long
def test_a_ship_that_needs_no_finer_steps_keeps_its_numbers():
    """The paper's ship at the nodes' own step, bit by bit, with one and with two Euler steps."""
    profile = profiles.load("esso-vectwin")
    ship, main, _ = mmg.geometry_of(profile)
    theta = mmg.estimated(ship, main).values
    record = closed.record(profile)
    rows = segments.begins(record)
    cut, at = segments.cut(record, rows), Path(record.state[rows], np.zeros((4, 3, GRID.nodes)))
    model = mmg.MMG(ship)
    # the last row of what drives is the share of the campaign, before the wind
    plain = replace(cut, driven=np.delete(cut.driven, 3, axis=-1))
    at_instants = at.interpolate(GRID)
    states = jax_paths.states_along(model, theta, at.start, at_instants, plain.driven, cut.step)
    pairs = 0.5 * (states[:, 1:] + states[:, :-1])
    wanted = pairs.reshape(4, GRID.bins, -1, 6).mean(2)
    one, two = (
        linearisation.simulated(replace(model, substeps=substeps), theta, plain, at, GRID)[0]
        for substeps in (1, 2)
    )
    assert one == pytest.approx(wanted, rel=1e-12, abs=1e-13)
    assert np.array_equal(one, two)


@pytest.mark.parametrize("wide", [None, WIDE], ids=("span", "wide"))
def test_a_segment_that_runs_away_is_left_out_and_counted(wide):
    """Where the actuator is on, damping is 70 1/s: no step holds that, and it says nothing."""
    cut, at, _ = coasting(segments_on=(2,))
    theta = np.array([7.0])
    found = linearisation.linear(Stiff(4), theta, cut, GRID, at, *nothing(cut), wide)
    assert found.lost.tolist() == [False, False, True, False]
    for values in (found.e, found.z, found.j):
        assert np.isfinite(values).all() and not values[2].any() and values[[0, 1, 3]].any()
    assert not found.cut.used[2].any() and found.cut.used[[0, 1, 3]].all()
    assert cut.used.all()  # what was cut stays as it was
    others = np.array([True, True, False, True])
    alone = linearisation.linear(
        Stiff(4), theta, cut.pick(others), GRID, Path(at.start[others], at.acceleration[others]),
        *nothing(cut.pick(others)), wide,
    )  # fmt: skip
    assert np.array_equal(found.pick(others).e, alone.e)
    assert not alone.lost.any()
    assert found.joined(alone).lost.tolist() == [False, False, True, *[False] * 4]


def test_what_was_left_out_carries_no_information():
    cut, at, _ = coasting(segments_on=(2,))
    found = linearisation.linear(Stiff(4), np.array([7.0]), cut, GRID, at, *nothing(cut))
    process_noise = likelihood.ProcessNoise(WIDE.noise, WIDE.acceleration, WIDE.start, 4.0)
    whole = likelihood.weighed(found, process_noise)
    part = likelihood.weighed(found.pick(np.array([True, True, False, True])), process_noise)
    assert not whole.dd[2].any() and not whole.zd[2].any() and not whole.zz[2].any()
    assert whole.dd.sum(0) == pytest.approx(part.dd.sum(0), rel=1e-12)
    assert whole.logdet == pytest.approx(part.logdet, rel=1e-12)


def test_numbers_of_each_segment_are_taken_off_it_alone():
    """Of columns of its own and of accelerations at the nodes; segments without numbers stay."""
    cut, at, _ = coasting()
    linear = linearisation.linear(Stiff(4), np.array([7.0]), cut, GRID, at, *nothing(cut))
    rng = np.random.default_rng(3)
    accelerations = rng.standard_normal((4, linear.z.shape[-1] - 6, 2))
    numbers = np.array([[0.4, 0.0, 0.0], [0.0, 1.0, -2.0], [0.0, 0.0, 0.0], [0.3, 0.5, 0.0]])
    left = linear.less_numbers(numbers, accelerations)
    for i, (own, one, two) in enumerate(numbers):
        acceleration = accelerations[i, :, 0] * one + accelerations[i, :, 1] * two
        wanted = linear.e[i] - linear.j[i, ..., 0] * own - linear.z[i, ..., 6:] @ acceleration
        assert left.e[i] == pytest.approx(wanted, abs=1e-12)
    assert np.array_equal(left.j, linear.j) and left.cut is linear.cut


def test_a_path_that_runs_away_does_not_move_and_leaves_the_others_alone():
    cut, at, _ = coasting(segments_on=(2,))
    theta = np.array([7.0])
    found = linearisation.fit_path(Stiff(4), theta, cut, GRID, WIDE, at)
    assert np.array_equal(found.start[2], at.start[2]) and np.isfinite(found.acceleration).all()
    free, _, _ = coasting()
    alone = linearisation.fit_path(Stiff(4), theta, free, GRID, WIDE, at)
    assert found.start[[0, 1, 3]] == pytest.approx(alone.start[[0, 1, 3]], abs=1e-12)
