"""What is found of nothing, in units of what is expected."""

import numpy as np
import pytest

from pipelines.usual import square
from shiplog.hypotheses import Found


def test_the_square_is_that_of_the_data_alone():
    """Data say 3 ± 0.5 and -1 ± 2 of two numbers whose size, one unit each, holds them too: the
    square is (36 + 1/4) / 2, of the data and not of what they are shrunk to."""
    unit = np.array([1e-3, 20.0])
    data = np.diag([4.0, 0.25])
    covariance = np.linalg.inv(data + np.eye(2))
    value = covariance @ data @ np.array([3.0, -1.0])
    found = Found("x", 0.0, 1.0, {"x": value * unit}, covariance * np.outer(unit, unit))
    assert square(found, unit) == pytest.approx((36.0 + 0.25) / 2.0)
