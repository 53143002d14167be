"""Differences of two clocks: where they step for good, and what is a delay or a drift."""

import numpy as np
import pytest

from shiplog.voyages.clocks.clock_steps import steps_of

T = np.arange(0.0, 300.0, 1.0)  # s
NOISE = np.random.default_rng(1)


@pytest.mark.parametrize("scatter", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("size", [-3600.0, -2.5, -0.6, 0.6, 3.0, 2_592_005.0])
def test_a_clock_that_is_set_steps_once_by_that_size(size, scatter):
    late = np.where(T < 123.0, 0.0, size) + scatter * NOISE.normal(size=len(T))
    ((cut, found),) = steps_of(late)
    assert cut == 123
    assert found == pytest.approx(size, abs=4.0 * scatter + 1e-9)


def test_a_clock_that_is_set_twice_steps_twice():
    late = np.where(T < 60.0, -4.0, np.where(T < 200.0, 0.0, 5.0))
    assert steps_of(late) == [(60, pytest.approx(4.0)), (200, pytest.approx(5.0))]


@pytest.mark.parametrize(
    "late",
    [
        0.0 * T,
        0.2 * NOISE.normal(size=len(T)),
        NOISE.uniform(0.2, 0.9, len(T)),
        0.01 * T - 1.0,
        np.where(T == 123.0, 5.0, 0.0),
        3.0 * np.exp(-(((T - 123.0) / 3.0) ** 2)),
        np.where(T < 123.0, 0.0, 0.2),
    ],
    ids=["none", "noise", "latency that scatters", "drift", "one value", "a delay", "small"],
)
def test_what_is_no_step_has_none(late):
    assert steps_of(late) == []


def test_a_few_values_say_nothing():
    assert steps_of(np.array([0.0, 0.0, 5.0, 5.0])) == []
