"""Exact data of a boat, and data on which a rollout soon diverges."""

import numpy as np
import pytest
from boats import COUNT, TRUE, Boat, Growing, driven, measured

from shiplog.simulation.window_series import WindowSeries


@pytest.fixture(scope="module")
def exact() -> WindowSeries:
    return measured(Boat(), TRUE, driven(1))


@pytest.fixture(scope="module")
def growing() -> WindowSeries:
    data = driven(1)
    data.measured[:, 0, 1] = np.linspace(0.5, 1.0, COUNT)
    return measured(Growing(), [0.02], data)
