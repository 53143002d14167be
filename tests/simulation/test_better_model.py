"""P that one model is better than another, on voyages whose truth is known."""

import numpy as np
import pytest
from scipy.special import stdtr

from shiplog.simulation.better_model import DISCREPANCY, better

VOYAGES, WINDOWS = 8, 8


def losses(rng, mean, shift=(0.0, 0.0), voyages=VOYAGES):
    """ln L of two models [2, V, W]: a voyage's difficulty, its own for a model, and windows of
    which each resembles the one before."""
    found = np.empty((2, voyages, WINDOWS))
    for v in range(voyages):
        voyage, window = 0.4 * rng.normal(), correlated(rng, 0.6)
        for m in range(2):
            own = 0.2 * rng.normal() + correlated(rng, 0.3)
            found[m, v] = mean[m] + shift[m] + voyage + window + own
    return np.exp(found)


def correlated(rng, size, share=0.7):
    noise = size * rng.normal(size=WINDOWS)
    for i in range(1, WINDOWS):
        noise[i] = share * noise[i - 1] + np.sqrt(1.0 - share**2) * noise[i]
    return noise


def names(count=VOYAGES):
    return [f"trip_{v}" for v in range(count) for _ in range(WINDOWS)]


def asked(tested, expected=(None, None)):
    a, b = tested.reshape(2, -1)
    found = better(("a", "b"), (a, b), names(tested.shape[1]), expected)
    assert found is not None
    return found


def test_of_the_probabilities_said_nine_in_ten_are_right():
    rng = np.random.default_rng(3)
    said, right = [], []
    for _ in range(400):
        mean = (0.0, 0.4 * rng.normal())
        p = asked(losses(rng, mean)).probability
        said.append(max(p, 1.0 - p))
        right.append((p > 0.5) == (mean[1] > 0.0))
    said, right = np.array(said), np.array(right)
    for low, high in ((0.5, 0.75), (0.75, 0.9), (0.9, 1.0)):
        one = (said > low) & (said <= high)
        error = 3.0 * np.sqrt(0.25 / one.sum())
        assert right[one].mean() > said[one].mean() - error
    assert right[said > 0.9].mean() >= 0.9


def test_windows_that_resemble_each_other_count_once():
    """The same windows three times over are no more sure, if they are of the same voyages."""
    rng = np.random.default_rng(4)
    one = losses(rng, (0.0, 0.2))
    thrice = np.repeat(one, 3, axis=2)
    a, b = thrice.reshape(2, -1)
    more = better(("a", "b"), (a, b), [n for n in names() for _ in range(3)])
    assert more is not None and more.probability == pytest.approx(asked(one).probability)
    assert more.blocks == VOYAGES


def test_the_form_by_hand():
    """Voyages with differences 1, 2, 3, 4, 5 and no scatter within: mean 3, s² = 2.5."""
    a = np.repeat([10.0] * 5, 2)
    b = a + np.repeat([1.0, 2.0, 3.0, 4.0, 5.0], 2)
    trips = [f"trip_{i}" for i in range(5) for _ in range(2)]
    found = better(("a", "b"), (a, b), trips, (a, 2.0 * b))
    assert found is not None
    assert found.probability == pytest.approx(stdtr(4, 3.0 / np.sqrt(2.5 / 5)))
    assert found.share == pytest.approx(10.0 / 13.0)
    # ln L of a is as expected and of b ln 2 lower: h = -½ ln 2, and both are ½ ln 2 off
    half = 0.5 * np.log(2.0)
    apart = DISCREPANCY * half**2 * (10.0**2 + 13.0**2)
    assert found.elsewhere == pytest.approx(stdtr(4, 3.0 / np.sqrt(0.5 + apart)))


def test_both_ways_round_it_is_one_probability():
    rng = np.random.default_rng(5)
    a, b = losses(rng, (0.0, 0.3)).reshape(2, -1)
    one = better(("a", "b"), (a, b), names())
    other = better(("b", "a"), (b, a), names())
    assert one is not None and other is not None
    assert one.probability + other.probability == pytest.approx(1.0)
    assert one.low + other.high == pytest.approx(1.0)


def test_harder_voyages_for_both_are_no_discrepancy():
    rng = np.random.default_rng(6)
    tested, before = losses(rng, (0.0, 0.5)), losses(rng, (0.0, 0.5)).reshape(2, -1)
    calm = asked(tested, tuple(before)).elsewhere
    hard = asked(tested, tuple(0.1 * before)).elsewhere
    other = asked(tested, (before[0], 0.1 * before[1])).elsewhere
    assert calm is not None and other is not None
    assert hard == pytest.approx(calm) and other < calm


def test_two_windows_say_nothing():
    assert better(("a", "b"), (np.ones(2), np.ones(2)), ["x", "x"]) is None


def test_a_model_that_diverges_is_not_the_better_one():
    rng = np.random.default_rng(7)
    a, b = losses(rng, (0.0, 0.0)).reshape(2, -1)
    a[::5] = np.inf
    found = better(("a", "b"), (a, b), names())
    assert found is not None and found.probability < 0.05
