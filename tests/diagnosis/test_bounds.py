"""Numbers between their bounds, and what the bounds are worth to a hypothesis."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm

from shiplog.diagnosis.bounds import log_share, within


def test_a_number_held_at_a_bound_moves_the_others():
    """Two that go together by 0.6, of sizes that differ by a thousand: E[x | y = 0] is
    3 + 0.6 · 2 standard deviations. One that is within stays; a bound that another's move frees is
    let go: projected one by one it would stay at 0."""
    unit = np.array([1.0, 1e-3])
    covariance = np.array([[1.0, 0.6], [0.6, 1.0]]) * np.outer(unit, unit)
    low, high = np.zeros(2), np.full(2, np.inf)
    found = within(np.array([3.0, -2e-3]), covariance, low, high)
    assert found == pytest.approx([4.2, 0.0], abs=1e-9)
    inside = np.array([3.0, 2e-3])
    assert within(inside, covariance, low, high) is inside
    apart = np.array([[1.0, 0.9], [0.9, 1.0]])
    lost = np.array([np.nan, -1.0])
    assert within(lost, covariance, low, high) is lost
    assert within(mean := -np.ones(2), np.full((2, 2), np.inf), low, high) is mean
    freed = within(np.array([-0.1, -2.0]), apart, low, high)
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
