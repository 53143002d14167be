"""Paths that measurements pull: onto known accelerations, and where they are expected."""

from dataclasses import replace

import numpy as np
import pytest
from toy_ship import GRID, RECORD, ROWS, SETTING, THETA, WIDE, Coasting, Toy, nothing, path

from shiplog.diagnosis.linear import linearisation, measurement_correction, segments
from shiplog.diagnosis.linear.linear_segments import Path
from shiplog.diagnosis.linear.segments import Cut
from shiplog.voyages.rows.timescale import NODE_STEP, Timescale


def simulated(at: Path, theta: np.ndarray = THETA) -> Cut:
    """Segments whose measurements are the toy's own."""
    cut = segments.cut(RECORD, ROWS)
    y, *_ = linearisation.simulated(Toy(), theta, cut, at, GRID)
    return replace(cut, y=y)


def test_nothing_is_left_of_what_the_model_made():
    at = replace(path(), acceleration=np.zeros((4, 3, GRID.nodes)))
    cut = simulated(at)
    none = nothing(cut)
    found = linearisation.linear(Toy(), THETA, cut, GRID, at, *none)
    assert np.array_equal(found.e, np.zeros_like(found.e))
    assert found.j.shape[-1] == 4
    picked = found.pick(np.array([False, True, True, False]))
    assert np.array_equal(picked.z, found.z[1:3]) and len(picked.cut) == 2


def test_slopes_of_a_smooth_model_go_straight_between_seconds(by_jax):
    """One in a second serves the toy, whose rudder goes slowly: what it bends by is within 1 % of
    what every node's slopes say, and what is constant stays exact."""
    at = replace(path(), acceleration=np.zeros((4, 3, GRID.nodes)))
    cut = simulated(at)
    none = nothing(cut)
    exact, found = (
        linearisation.linear(Toy(smooth=smooth), THETA, cut, GRID, at, *none)
        for smooth in (0.0, 1.0)
    )
    assert np.array_equal(found.e, exact.e)
    for one, other in ((found.z, exact.z), (found.j, exact.j)):
        size = np.abs(other).max((0, 1, 3), keepdims=True)
        assert 0.0 < np.abs((one - other) / size).max() < 0.01
    k = np.array([0.3])
    same = [
        linearisation.linear(Coasting(smooth=smooth), k, cut, GRID, at, *none).z
        for smooth in (0.0, 1.0)
    ]
    assert same[0] == pytest.approx(same[1], abs=1e-12)


def test_a_path_is_pulled_onto_a_known_acceleration():
    """Smooth accelerations of 0.02 m/s²: the path goes where they went, and finds them."""
    t = NODE_STEP * np.arange(GRID.nodes)
    acceleration = np.stack(
        (0.02 * np.sin(0.2 * t), 0.015 * np.cos(0.25 * t), 0.004 * np.sin(0.3 * t))
    )
    true = Path(RECORD.state[ROWS], np.tile(acceleration, (4, 1, 1)))
    cut = simulated(true)
    found = linearisation.fit_path(Toy(), THETA, cut, GRID, replace(WIDE, noise=0.01 * WIDE.noise))
    y, *_ = linearisation.simulated(Toy(), THETA, cut, found, GRID)
    assert y == pytest.approx(cut.y, abs=1e-4)
    assert found.start == pytest.approx(true.start, abs=2e-3)
    # within, where bins on both sides see a node
    assert found.acceleration[..., 1:-1] == pytest.approx(true.acceleration[..., 1:-1], abs=2e-3)


def test_a_path_is_pulled_until_it_converges():
    """From a start that is far off, two rounds leave it far from where it ends."""
    true = replace(path(), acceleration=np.zeros((4, 3, GRID.nodes)))
    cut = simulated(true)
    start = true.start + np.array([30.0, 0.0, -30.0, 0.0, 2.0, 0.05])
    free = replace(WIDE, start=1e3 * WIDE.start)
    off = {}
    for rounds in (2, linearisation.MOST_PULLS):
        found = linearisation.fit_path(
            Toy(), THETA, cut, GRID, free, replace(true, start=start), rounds
        )
        y, *_ = linearisation.simulated(Toy(), THETA, cut, found, GRID)
        off[rounds] = np.abs(y - cut.y).max()
    assert off[linearisation.MOST_PULLS] < 1e-3 < 0.1 < off[2]


def test_a_path_held_firmly_follows_the_acceleration_that_is_expected_of_it():
    """Held to what is expected, it is the true path at once; held to none, it has no acceleration
    and is off. The same where a linearisation says where it will be."""
    t = NODE_STEP * np.arange(GRID.nodes)
    acceleration = np.stack(
        (0.02 * np.sin(0.2 * t), 0.015 * np.cos(0.25 * t), 0.004 * np.sin(0.3 * t))
    )
    true = Path(RECORD.state[ROWS], np.tile(acceleration, (4, 1, 1)))
    cut = simulated(true)
    about = true.acceleration.reshape(4, -1)
    firm = replace(WIDE, acceleration=1e-6 * WIDE.acceleration)
    found = linearisation.fit_path(Toy(), THETA, cut, GRID, firm, rounds=3, about=about)
    assert found.acceleration == pytest.approx(true.acceleration, abs=1e-5)
    assert linearisation.simulated(Toy(), THETA, cut, found, GRID)[0] == pytest.approx(
        cut.y, abs=1e-3
    )
    without = linearisation.fit_path(Toy(), THETA, cut, GRID, firm, rounds=3)
    assert without.acceleration == pytest.approx(0.0, abs=1e-5)
    off = linearisation.simulated(Toy(), THETA, cut, without, GRID)[0] - cut.y
    assert np.abs(off).max() > 0.02
    none = nothing(cut)
    linear = linearisation.linear(Toy(), THETA, cut, GRID, without, *none)
    ahead = linearisation.predict_path(linear, np.zeros(4), firm, about)
    assert ahead.acceleration == pytest.approx(true.acceleration, abs=1e-5)


def test_a_path_that_is_not_finite_is_lost_by_itself():
    """As of a model without an acceleration at a measured state: rows of zeros, and the other
    segments as they were."""
    true = replace(path(), acceleration=np.zeros((4, 3, GRID.nodes)))
    cut = simulated(true)
    broken = replace(true, acceleration=true.acceleration.copy())
    broken.acceleration[1, 0, 3] = np.nan
    away = np.arange(4) == 1
    pulled = linearisation.fit_path(Toy(), THETA, cut, GRID, WIDE, broken)
    assert np.array_equal(pulled.acceleration[1], broken.acceleration[1], equal_nan=True)
    assert pulled.start[~away] == pytest.approx(true.start[~away], abs=1e-6)
    none = nothing(cut)
    found = linearisation.linear(Toy(), THETA, cut, GRID, pulled, *none)
    assert np.array_equal(found.lost, away)
    assert not found.e[1].any() and not found.z[1].any() and not found.j[1].any()
    assert found.e[~away] == pytest.approx(0.0, abs=1e-6)


def test_a_path_is_pulled_on_a_longer_grid_too():
    """Segments of 60 s with nodes of 4 s: accelerations found from the record on."""
    viewed = replace(RECORD, timescale=Timescale(60.0, 4.0, 4.0))
    g, rows = segments.grid(viewed), segments.begins(viewed)
    t = g.node_step * np.arange(g.nodes)
    acceleration = np.stack(
        (0.02 * np.sin(0.1 * t), 0.015 * np.cos(0.12 * t), 0.002 * np.sin(0.15 * t))
    )
    true = Path(RECORD.state[rows], np.tile(acceleration, (2, 1, 1)))
    cut, moved, observed = measurement_correction.read(Toy(), SETTING, viewed, rows)
    assert cut.y.shape == observed.shape[:3] == (2, 15, 6) and moved.shape[1] == 151
    y, *_ = linearisation.simulated(Toy(), THETA, cut, true, g)
    cut = replace(cut, y=y)
    tight = replace(WIDE, noise=0.01 * WIDE.noise)
    found = linearisation.fit_path(Toy(), THETA, cut, g, tight, rounds=3)
    assert found.acceleration[..., 1:-1] == pytest.approx(true.acceleration[..., 1:-1], abs=2e-3)
    assert not linearisation.linear(Toy(), THETA, cut, g, found, moved, observed, WIDE).lost.any()


def test_what_was_not_used_does_not_pull():
    true = replace(path(), acceleration=np.zeros((4, 3, GRID.nodes)))
    cut = simulated(true)
    used = cut.used.copy()
    used[:, 6:8] = False
    wrong = np.where(used, cut.y, 1e3)
    bad = replace(cut, y=wrong, used=used)
    found = linearisation.fit_path(Toy(), THETA, bad, GRID, WIDE, true)
    y, *_ = linearisation.simulated(Toy(), THETA, bad, found, GRID)
    assert y == pytest.approx(cut.y, abs=1e-6)


def test_a_path_that_is_predicted_from_too_far_is_far_from_that_of_its_numbers():
    """A rudder that turns the ship four times as much, predicted from the true one: turned about,
    the ship's sway and surge are none of what the derivative says. A tenth more is near enough."""
    true = replace(path(), acceleration=np.zeros((4, 3, GRID.nodes)))
    cut = simulated(true)
    firm = replace(WIDE, acceleration=0.02 * WIDE.acceleration, start=0.1 * WIDE.start)
    linear = linearisation.linear(Toy(), THETA, cut, GRID, true, *nothing(cut))
    left = {}
    for factor in (1.1, 4.0):
        other = THETA * np.array([1.0, factor, 1.0, 1.0])
        found = linearisation.predict_path(linear, other - THETA, firm)
        there = linearisation.linear(Toy(), other, cut, GRID, found, *nothing(cut))
        left[factor] = linearisation.left_to_pull(there, firm)
        fitted = linearisation.fit_path(Toy(), other, cut, GRID, firm, found)
        after = linearisation.linear(Toy(), other, cut, GRID, fitted, *nothing(cut))
        assert linearisation.left_to_pull(after, firm) < linearisation.PULLED_NATS
    assert left[1.1] < linearisation.FAR_NATS < left[4.0]


def test_a_linearisation_expects_where_its_path_will_be_pulled():
    """There is no acceleration but the rudder's, a tenth less than the model's: pulled, the path
    has one that makes up for it. Once the model has it right there is none, and what is expected
    before that is linearised there is off by what is not linear: a tenth of the tenth."""
    true = replace(path(), acceleration=np.zeros((4, 3, GRID.nodes)))
    cut = simulated(true)
    wrong, tight = THETA * np.array([1.0, 1.1, 1.0, 1.0]), replace(WIDE, noise=0.01 * WIDE.noise)
    stood = linearisation.fit_path(Toy(), wrong, cut, GRID, tight)
    size = np.abs(stood.acceleration[:, 2]).max()
    assert size > 1e-4
    linear = linearisation.linear(Toy(), wrong, cut, GRID, stood, *nothing(cut))
    found = linearisation.predict_path(linear, THETA - wrong, tight)
    assert np.abs(found.acceleration[:, 2]).max() < 0.1 * size
    assert found.start == pytest.approx(true.start, abs=1e-3)
    stays = linearisation.predict_path(linear, np.zeros(4), tight)
    assert stays.acceleration == pytest.approx(stood.acceleration, abs=0.1 * size)
    firm = linearisation.predict_path(
        linear, np.zeros(4), replace(tight, acceleration=1e-6 * WIDE.acceleration)
    )
    assert (
        np.abs(firm.acceleration[:, 2]).max() < 0.1 * size
    )  # held about none, not about where it stood
