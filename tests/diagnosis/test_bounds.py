"""Numbers between their bounds, and what the bounds are worth to a hypothesis."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from shiplog.diagnosis.noise.bounds import (
    bounded_mode,
    log_share,
    log_share_on_board,
    mode_on_board,
)


def test_a_number_held_at_a_bound_moves_the_others():
    """Two that go together by 0.6, of sizes that differ by a thousand: E[x | y = 0] is
    3 + 0.6 · 2 standard deviations. One that is within stays; a bound that another's move frees is
    let go: projected one by one it would stay at 0."""
    unit = np.array([1.0, 1e-3])
    covariance = np.array([[1.0, 0.6], [0.6, 1.0]]) * np.outer(unit, unit)
    low, high = np.zeros(2), np.full(2, np.inf)
    found = bounded_mode(np.array([3.0, -2e-3]), covariance, low, high)
    assert found == pytest.approx([4.2, 0.0], abs=1e-9)
    inside = np.array([3.0, 2e-3])
    assert bounded_mode(inside, covariance, low, high) is inside
    apart = np.array([[1.0, 0.9], [0.9, 1.0]])
    lost = np.array([np.nan, -1.0])
    assert bounded_mode(lost, covariance, low, high) is lost
    assert bounded_mode(mean := -np.ones(2), np.full((2, 2), np.inf), low, high) is mean
    freed = bounded_mode(np.array([-0.1, -2.0]), apart, low, high)
    assert freed == pytest.approx([-0.1 + 0.9 * 2.0, 0.0], abs=1e-9)


@pytest.mark.parametrize(("mean", "deviation"), [(-0.5, 0.1), (0.3, 0.1), (0.05, 0.1), (-3.0, 0.2)])
def test_bounds_are_worth_the_ratio_of_two_integrals(mean, deviation):
    """Likelihood times prior over the numbers allowed, the prior being of those numbers alone,
    over the same without bounds; a lag from 0 to 2 s with a prior of 1.6 s."""
    size, low, high = 1.6, 0.0, 2.0
    spread = (deviation**-2 - size**-2) ** -0.5  # of the likelihood
    centre = mean * spread**2 / deviation**2

    def both(p: float) -> float:
        return norm.pdf(centre, p, spread) * norm.pdf(p, 0.0, size)

    inside, _ = quad(both, low, high, points=[0.01, 0.3])
    inside /= norm.cdf(high / size) - norm.cdf(low / size)
    free = norm.pdf(centre, 0.0, math.hypot(spread, size))
    found = log_share(*(np.array([x]) for x in (mean, deviation, size, low, high)))
    assert found == pytest.approx(math.log(inside / free), rel=1e-6, abs=1e-6)


def test_bounds_far_off_are_worth_nothing_and_far_within_the_tail_no_digit_is_lost():
    off = np.array([np.inf])
    one = np.ones(1)
    assert log_share(0.2 * one, 0.1 * one, one, -off, off) == 0.0
    # Mills' ratio: Φ(-x) is φ(x)/x (1 - 1/x² + 3/x⁴)
    x = 40.0
    tail = -0.5 * x**2 - 0.5 * math.log(2.0 * math.pi) - math.log(x)
    tail += math.log1p(-(x**-2) + 3.0 * x**-4)
    assert log_share(-4.0 * one, 0.1 * one, one, 0.0 * one, off) == pytest.approx(
        tail - math.log(0.5), rel=1e-9
    )
    assert log_share(4.0 * one, 0.1 * one, one, -off, 0.0 * one) == pytest.approx(
        tail - math.log(0.5), rel=1e-9
    )


def test_a_load_beyond_the_ship_is_moved_onto_it():
    """The most probable point of the line second = 1.5 first, which another number follows."""
    mean = np.array([7.0, 1.0, 2.0])
    root = np.array([[1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [-0.2, 0.3, 0.6]])
    covariance = root @ root.T
    inverse = np.linalg.inv(covariance)

    def off(point):
        return float((point - mean) @ inverse @ (point - mean))

    found = mode_on_board(mean, covariance, 1.5, at=1)
    assert found[2] == pytest.approx(1.5 * found[1])
    for way in (np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 1.5])):
        assert off(found) < min(off(found + 0.01 * way), off(found - 0.01 * way))
    assert (mode_on_board(mean, covariance, 2.1, at=1) == mean).all()


def test_what_a_load_on_board_adds_is_the_share_of_draws_that_are():
    mean, size = np.array([1.0, 2.0]), np.array([2.0, 1.0])
    covariance = np.array([[1.0, 0.3], [0.3, 0.5]])
    rng = np.random.default_rng(0)

    def share(drawn):
        return float(np.mean(np.abs(drawn[:, 1]) <= 1.5 * np.abs(drawn[:, 0])))

    after = share(rng.multivariate_normal(mean, covariance, 200_000))
    before = share(size * rng.standard_normal((200_000, 2)))
    found = log_share_on_board(mean, covariance, size, 1.5)
    assert found == pytest.approx(np.log(after / before), abs=0.02)
    assert np.arctan(3.0) * 2.0 / np.pi == pytest.approx(before, abs=0.01)
    # far outside it is the tail beyond the nearer line: 23 of 1.5 · 4 ± 1.5
    far = log_share_on_board(np.array([4.0, 23.0]), np.diag([2.25, 1.0]), size, 1.5)
    lost = 0.5 * 17.0**2 / (1.0 + 2.25**2)
    assert -lost - 5.0 < far < -lost
