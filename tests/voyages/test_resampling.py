"""Alignment by measurement time: exact on straight lines, and never a stale value."""

import numpy as np
import pytest

from shiplog.voyages.rows import resampling

S = 1_000_000_000


def samples(time_s, value, tolerance=None):
    time = np.round(np.asarray(time_s) * 1e9).astype(np.int64)
    return resampling.ordered(time, np.asarray(value, float).reshape(len(time), -1), tolerance)


def test_a_straight_line_is_exact_whatever_the_phase():
    time = np.arange(0.0, 10.0, 0.1) + 0.037
    placed = resampling.interpolate_samples(
        resampling.grid(S, 9 * S), samples(time, 3.0 - 2.0 * time)
    )
    assert not placed.gap.any()
    assert placed.value[:, 0] == pytest.approx(3.0 - 2.0 * np.arange(1.0, 9.05, 0.1), abs=1e-9)


def test_a_sample_on_the_grid_is_passed_through():
    time = np.arange(0.0, 2.0, 0.1)
    value = np.random.default_rng(0).normal(size=20)
    placed = resampling.interpolate_samples(resampling.grid(0, int(1.9 * S)), samples(time, value))
    assert placed.value[:, 0].tolist() == value.tolist()


def test_a_missing_sample_is_a_gap_and_not_the_last_value():
    time = np.delete(np.arange(0.0, 5.0, 0.1), [20, 21, 22])
    placed = resampling.interpolate_samples(resampling.grid(0, int(4.9 * S)), samples(time, time))
    assert np.flatnonzero(placed.gap).tolist() == [20, 21, 22]
    assert np.isnan(placed.value[20:23]).all()


def test_a_slow_instrument_is_interpolated_within_its_own_period():
    time = np.arange(0.0, 10.1, 0.5)
    placed = resampling.interpolate_samples(resampling.grid(0, 10 * S), samples(time, time**1))
    assert not placed.gap.any()
    assert placed.value[3, 0] == pytest.approx(0.3)


def test_outside_the_samples_there_is_nothing():
    placed = resampling.interpolate_samples(
        resampling.grid(0, 3 * S), samples([1.0, 1.1, 1.2], [1, 2, 3])
    )
    assert np.flatnonzero(~placed.gap).tolist() == [10, 11, 12]


def test_nan_is_blank_not_a_gap():
    time = np.arange(0.0, 2.0, 0.1)
    value = np.ones(20)
    value[7] = np.nan
    placed = resampling.interpolate_samples(resampling.grid(0, int(1.9 * S)), samples(time, value))
    assert placed.blank[7] and not placed.gap[7]
    assert np.isnan(placed.value[7, 0])
    assert not placed.blank[[5, 9]].any()


def test_order_of_arrival_does_not_matter_and_a_repeated_stamp_keeps_the_first():
    ordered = samples([0.2, 0.0, 0.1, 0.1], [2.0, 0.0, 1.0, 99.0])
    assert ordered.time.tolist() == [0, S // 10, S // 5]
    assert ordered.value[:, 0].tolist() == [0.0, 1.0, 2.0]
    assert ordered.tolerance_s == pytest.approx(0.15)


def test_of_two_rows_of_one_time_what_one_of_them_measured_counts():
    """A table with a row for each instrument: the other's row is blank, and often the first."""
    time = np.repeat(np.arange(0.0, 1.0, 0.1), 2)
    value = np.where(np.arange(20) % 2, np.arange(20) // 2, np.nan)
    found = samples(time, value)
    assert found.value[:, 0].tolist() == list(range(10))
    assert not len(found.blank)
    found = samples([0.0, 0.1, 0.1, 0.2], [0.0, np.nan, np.nan, 2.0])
    assert found.blank.tolist() == [S // 10]
