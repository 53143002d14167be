"""The interval of a simulated quantity: the members about their median, moved to the value."""

import numpy as np
import pytest

from shiplog.manoeuvres import simulated

LEVELS = np.linspace(0.0, 1.0, 2001)


def interval(name, value, members):
    return simulated.intervals([{name: value}, *({name: float(x)} for x in members)])[name]


def test_a_disturbance_that_only_lengthens_is_not_added_to_the_value():
    """Members are e^(0.1 + 0.2 z) times as long as the model as it stands: e^(±0.2 · 1.645)."""
    from scipy.stats import norm

    members = 80.0 * np.exp(0.1 + 0.2 * norm.ppf(LEVELS[1:-1]))
    found = interval("period", 80.0, members)
    assert found.value == 80.0
    assert (found.low, found.high) == pytest.approx(
        (80.0 * np.exp(-0.2 * 1.6449), 80.0 * np.exp(0.2 * 1.6449)), rel=1e-3
    )


def test_a_length_stays_positive_and_what_may_be_negative_is_moved_by_a_difference():
    low = interval("first_overshoot", 0.5, 4.0 + 3.0 * (LEVELS - 0.5))
    assert 0.0 < low.low < 0.5 < low.high
    moved = interval("lateral_deviation", -1.0, 2.0 + (LEVELS - 0.5))
    assert (moved.low, moved.high) == pytest.approx((-1.45, -0.55))
    astride = interval("transfer", 0.2, LEVELS - 0.5)
    assert (astride.low, astride.high) == pytest.approx((-0.25, 0.65))


def test_of_too_few_members_there_is_none():
    assert "period" not in simulated.intervals([{"period": 80.0}, {"period": 81.0}, {}, {}])
