"""Means and spreads of rows around each row, by scipy.ndimage."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from shiplog.voyages.rows import moving

COUNTS = (1, 2, 3, 4, 8, 11, 64, 101)


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("shape", [(40,), (200, 2)])
def test_means_are_those_of_scipy(count: int, shape: tuple[int, ...]) -> None:
    value = np.random.default_rng(count).normal(size=shape)
    expected = uniform_filter1d(value, count, axis=0, mode="nearest")
    np.testing.assert_allclose(moving.mean(value, count), expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("count", COUNTS)
def test_spreads_are_those_of_scipy(count: int) -> None:
    value = np.random.default_rng(count).normal(size=(200, 2))
    largest = maximum_filter1d(value, count, axis=0, mode="nearest")
    smallest = minimum_filter1d(value, count, axis=0, mode="nearest")
    np.testing.assert_array_equal(moving.spread(value, count), largest - smallest)
