"""Numbers held at a bound move the others that go together with them."""

import numpy as np
import pytest

from shiplog.diagnosis.relinearisation import within


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
    freed = within(np.array([-0.1, -2.0]), apart, low, high)
    assert freed == pytest.approx([-0.1 + 0.9 * 2.0, 0.0], abs=1e-9)
