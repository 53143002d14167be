"""Samples under one stamp: spread again over the time in which they were measured."""

import numpy as np
import pytest

from shiplog.logs.conversion.bursts import spread

SECOND = 1_000_000_000
START = 1_717_236_000 * SECOND
T = np.arange(600) / 10.0  # s, 10 Hz for a minute


def ns(seconds):
    return START + np.rint(np.asarray(seconds) * SECOND).astype(np.int64)


def handed_over(t, every, late=0.01):
    """Stamps of samples that are handed over `every` so many, `late` after the last of them."""
    last = np.minimum((np.arange(len(t)) // every + 1) * every, len(t)) - 1
    return ns(t[last] + late)


@pytest.mark.parametrize("every", [2, 5, 10, 30])
def test_a_burst_is_spread_over_the_time_since_the_one_before(every):
    found = spread(handed_over(T, every), np.sin(T))
    assert found.time * 1e-9 - START * 1e-9 == pytest.approx(T + 0.01, abs=1e-6)
    assert (found.bursts, found.each_s) == (600 // every, pytest.approx(every / 10))
    assert found.unsure_s == pytest.approx(0.1)  # the last one may have waited for as long
    assert not found.again.any() and not found.foreign.any()


def test_ten_samples_within_twenty_milliseconds_are_a_burst():
    found = spread(handed_over(T, 10) + (np.arange(600) % 10) * 2_000_000)
    assert (found.time - ns(T)) * 1e-9 == pytest.approx(np.full(600, 0.028), abs=1e-6)
    assert found.moved == 540


@pytest.mark.parametrize("hz", [2, 5, 10, 50])
def test_stamps_cut_off_to_whole_seconds_are_spread_over_the_second_that_they_name(hz):
    t = np.arange(30 * hz) / hz + 0.5  # the first second is half a second long
    found = spread(ns(np.floor(t)), np.sin(t))
    assert (found.time - START) * 1e-9 == pytest.approx(t, abs=0.51 / hz)
    assert (found.cut_s, found.unsure_s) == (1.0, pytest.approx(1.0 / hz))


def test_day_numbers_of_five_decimals_are_cut_off_to_0_864_s():
    days = np.floor((START * 1e-9 + T) / 0.864) * 1e-5  # a double of 1e4 holds 2e-12 days
    found = spread(np.rint(days * 86_400e9).astype(np.int64), np.sin(T))
    assert found.cut_s == 0.864
    assert (found.time - START) * 1e-9 == pytest.approx(T, abs=0.13)  # 8 or 9 samples each


def test_after_a_silence_a_burst_has_its_usual_length():
    t = np.concatenate((T[:300], T[300:] + 40.0))
    found = spread(handed_over(t, 5))
    assert (found.time - ns(t)) * 1e-9 == pytest.approx(np.full(600, 0.01), abs=1e-6)


def test_a_few_samples_that_share_a_stamp_are_kept_as_well():
    stamps = ns(T)
    stamps[100], stamps[300] = stamps[101], stamps[301]  # handed over with the next one
    found = spread(stamps, np.sin(T))
    assert (found.time - START) * 1e-9 == pytest.approx(T, abs=1e-6)
    assert found.bursts == 2


@pytest.mark.parametrize("hz", [1, 2, 5, 10, 50])
@pytest.mark.parametrize("jitter", [0.0, 0.1, 0.3, 0.5], ids=lambda share: f"{share} periods")
def test_stamps_of_their_own_stay_as_they_are(hz, jitter):
    t = np.arange(2000) / hz + np.random.default_rng(hz).normal(0.0, jitter / hz, 2000)
    t[1000:] += 60.0  # a real pause
    found = spread(ns(t), np.sin(t))
    assert (found.time == ns(t)).all()
    assert (found.moved, found.bursts, found.unsure_s) == (0, 0, 0.0)


def test_a_sample_that_came_twice_is_one():
    twice = np.repeat(T, 2)
    found = spread(ns(twice), np.sin(twice))
    assert (found.again.sum(), found.moved) == (600, 0)
    assert (found.time == ns(twice)).all()


def test_a_heading_that_stands_still_within_a_burst_was_measured_all_the_same():
    """In whole degrees: half of the values of a burst are those before."""
    found = spread(handed_over(T, 5), np.floor(5.0 * T))
    assert not found.again.any()
    assert (found.time - ns(T)) * 1e-9 == pytest.approx(np.full(600, 0.01), abs=1e-6)


def test_two_instruments_under_one_name_are_no_burst():
    """Positions of two antennas 12 m apart, on one ship of 2 m/s."""
    at = np.repeat(2.0 * T, 2) + np.tile([0.0, 12.0], 600)
    found = spread(ns(np.repeat(T, 2)), at)
    assert (found.foreign.sum(), found.moved) == (600, 0)


def test_orders_that_come_in_flurries_are_no_bursts():
    rng = np.random.default_rng(0)
    steps = np.concatenate([[*rng.uniform(0.1, 0.4, rng.integers(2, 12)), 40.0] for _ in range(30)])
    found = spread(ns(np.cumsum(steps)))
    assert found.moved == 0
