"""How far parts of the data disagree, against jackknives that are known in closed form."""

import numpy as np
import pytest

from shiplog.simulation.window_series import Normal, WindowSeries
from shiplog.training.physics import agreement
from shiplog.training.physics.agreement import Group


def test_of_a_mean_it_is_the_squared_standard_error():
    """θ̂ the mean of K group means m_k, each of information h: D → Σ (m_k - θ̂)²/(K (K - 1))."""
    means, h = np.array([1.0, 2.0, 4.0, 9.0]), 1e9  # so sure that the prior says nothing
    pulls = [np.array([h * (means.mean() - m)]) for m in means]
    D = agreement.jackknife([np.array([[h]])] * 4, pulls)
    assert D[0] == pytest.approx(means.var(ddof=1) / 4.0)


def test_the_prior_holds_what_a_group_says_alone():
    """Two groups; without the first, one of information h₂ and the prior's 1 are left."""
    h, g = (3.0, 5.0), (0.6, -0.6)
    D = agreement.jackknife([np.array([[x]]) for x in h], [np.array([x]) for x in g])
    assert D[0] == pytest.approx(0.5 * ((0.6 / 6.0) ** 2 + (0.6 / 4.0) ** 2))


def windows(speed, turning, samples=5):
    """Windows [N] of one speed and one yaw rate each."""
    measured = np.zeros((len(speed), samples, 6))
    measured[..., 1] = np.asarray(speed)[:, None]
    measured[..., 5] = np.asarray(turning)[:, None]
    nothing = np.zeros((len(speed), samples, 2))
    return WindowSeries(
        measured, nothing, nothing, np.ones((len(speed), samples - 1)), np.ones(len(speed))
    )


def test_windows_are_cut_by_voyage_by_speed_and_by_the_curvature_of_their_path():
    data = windows([1, 1, 1, 1, 4, 3, 2, 2], [0.1, -0.2, 0.3, -0.4, 0.1, 0.2, 1.6, -0.8])
    found = agreement.partitions(data, ["b"] * 5 + ["a"] * 3)
    assert found[agreement.VOYAGES].tolist() == [0] * 5 + [1] * 3
    assert found[agreement.SPEED].tolist() == [0, 0, 1, 1, 3, 3, 2, 2]
    assert found[agreement.TURNING].tolist() == [1, 1, 2, 2, 0, 0, 3, 3]
    few = agreement.partitions(windows([1, 2], [0, 0]), ["one", "two"])
    assert list(few) == [agreement.VOYAGES]
    assert agreement.partitions(windows([1], [0]), ["one"]) == {}


def test_a_cubic_law_that_a_line_is_fitted_to():
    """y = x + ½ x³, θ̂ = 1 + ½ Σ x⁴/Σ x²: voyages alike in x agree on it, and gentle and hard turns
    do not. Their D is that of four lines, each through the data without a quarter."""
    x = np.tile(np.linspace(0.2, 1.0, 8), 4)
    value = 1.0 + 0.5 * (x**4).sum() / (x**2).sum()
    weight = 1e6  # of a datum: no noise to speak of
    own = np.stack((weight * x**2, weight * x * (value * x - x - 0.5 * x**3)), -1)
    data = windows(np.ones(32), x)
    data = data._replace(actuator=np.repeat(own[:, None, :], 5, axis=1))

    def normal(part):
        H, g = part.actuator[:, 0].T
        return Normal(np.zeros(len(H)), g[:, None], np.array([[H.sum()]]))

    cut = agreement.partitions(data, [f"voyage {k // 8}" for k in range(32)])
    parts = agreement.groups(data, cut, normal)
    assert [len(one) for one in parts.values()] == [4, 4, 4]
    one, free = np.ones(1), np.ones(1, dtype=bool)
    alike = agreement.agreement({agreement.VOYAGES: parts[agreement.VOYAGES]}, 1.0, one, free)
    assert alike.apart == pytest.approx([0.0], abs=1e-9)
    found = agreement.agreement(parts, 1.0, one, free)
    assert found.worst == (agreement.TURNING,)
    quarter = cut[agreement.TURNING]
    kept = [x[quarter != k] for k in range(4)]
    lines = np.array([1.0 + 0.5 * (some**4).sum() / (some**2).sum() for some in kept])
    assert found.apart == pytest.approx([(0.75 * ((lines - value) ** 2).sum()) ** 0.5], rel=1e-4)


def test_what_was_held_and_what_has_no_parts_is_not_apart():
    group = Group(np.diag([4.0, 4.0]), np.array([1.0, -1.0]))
    other = Group(np.diag([4.0, 4.0]), np.array([-1.0, 1.0]))
    free = np.array([True, False])
    found = agreement.agreement({"voyages": [group, other]}, 2.0, np.array([0.5, 1.0]), free)
    # H_k = 4·¼/2, g_k = ±½/2, left of either: (½ + 1)⁻¹ · ¼
    assert found.apart == pytest.approx([(0.5 * 2.0 * (0.25 / 1.5) ** 2) ** 0.5, 0.0])
    assert found.worst == ("voyages", "")
    assert agreement.agreement({}, 1.0, np.ones(2), free).apart.tolist() == [0.0, 0.0]
