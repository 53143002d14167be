"""A part's own numbers against dense Gaussians, and deviations learnt from drawn campaigns."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from shiplog.diagnosis.nominal import voyage_effects
from shiplog.diagnosis.nominal.voyage_effects import learn, reduced


def products(j: np.ndarray, e: np.ndarray) -> np.ndarray:
    both = np.concatenate((e[:, None], j), 1)
    return both.T @ both


@pytest.mark.parametrize("seed", range(4))
def test_integrating_a_parts_own_numbers_out_is_the_dense_marginal(seed):
    """log N(e; Jθ, I + J D Jᵀ) of any θ, its constant included: two numbers have no deviation."""
    rng = np.random.default_rng(seed)
    rows, columns = 9 + seed, 5
    j, e = rng.standard_normal((rows, columns)), rng.standard_normal(rows)
    deviation = rng.uniform(0.1, 2.0, columns)
    deviation[[1, 4]] = 0.0
    gram, logdet = reduced(products(j, e), deviation)
    covariance = np.eye(rows) + j @ np.diag(deviation**2) @ j.T
    assert logdet == pytest.approx(np.linalg.slogdet(covariance)[1], rel=1e-12)
    for theta in (np.zeros(columns), rng.standard_normal(columns)):
        towards = np.concatenate(([1.0], -theta))
        found = -0.5 * (towards @ gram @ towards + logdet + rows * np.log(2.0 * np.pi))
        wanted = multivariate_normal(j @ theta, covariance).logpdf(e)
        assert found == pytest.approx(wanted, rel=1e-10)


def test_no_deviation_changes_nothing():
    gram = products(np.arange(12.0).reshape(4, 3), np.ones(4))
    found, logdet = reduced(gram, np.zeros(3))
    assert (found == gram).all()
    assert logdet == 0.0


def test_numbers_that_differ_without_limit_are_lost():
    """A part tells nothing of a number that has any value of its own in it."""
    rng = np.random.default_rng(0)
    gram = products(rng.standard_normal((20, 3)), rng.standard_normal(20))
    found, _ = reduced(gram, np.array([1e5, 0.0, 0.0]))
    assert np.abs(found[1]).max() < 1e-7 * np.abs(gram[1]).max()
    kept = np.delete(np.delete(found, 1, 0), 1, 1)
    assert (np.linalg.eigvalsh(kept) > 0.1).all()


TRUE = np.array([0.5, 0.5, 0.5, 0.12, 0.12, 0.0])
GROUPS = (np.arange(3), np.arange(3, 5))


def campaign(parts: int, theta: np.ndarray, seed: int) -> list[np.ndarray]:
    """Products of parts, each with numbers θ + b of its own, b ~ N(0, TRUE²)."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(parts):
        j = rng.standard_normal((60, len(theta)))
        own = theta + TRUE * rng.standard_normal(len(theta))
        found.append(products(j, j @ own + rng.standard_normal(60)))
    return found


def test_deviations_are_found_again():
    """A standard deviation from n numbers that are known to σ is known to √(s² + σ²)²/s/√(2n):
    of 300 parts 0.012 of the three and 0.006 of the two; four of these on either side."""
    theta = np.array([1.0, -0.4, 0.2, 0.7, 0.0, 0.3])
    found = learn(campaign(300, theta, 1), np.ones(6), np.zeros(6), GROUPS)
    assert found.deviation[:3] == pytest.approx(np.full(3, 0.5), abs=0.05)
    assert found.deviation[3:5] == pytest.approx(np.full(2, 0.12), abs=0.024)
    assert len(set(found.deviation[:3])) == len(set(found.deviation[3:5])) == 1
    assert found.size == pytest.approx(np.ones(6))  # none was to be learnt


def test_numbers_of_every_part_are_found_again():
    """Of 60 observations of unit noise each is known to 0.13; 300 parts say that to 3 %. Those of
    no group are the same in all."""
    theta = np.array([1.0, -0.4, 0.2, 0.7, 0.0, 0.3])
    rng, each, true = np.random.default_rng(6), [], []
    for _ in range(300):
        j = rng.standard_normal((60, 6))
        true.append(theta + TRUE * rng.standard_normal(6))
        each.append(products(j, j @ true[-1] + rng.standard_normal(60)))
    found = learn(each, np.ones(6), np.zeros(6), GROUPS).numbers
    assert found is not None
    off = np.sqrt(np.mean((found - np.array(true)) ** 2, axis=0))
    # of the three 1/√(60 - 6 + 1/0.25), of the two less: they are held by their deviation of 0.12
    assert off[:3] == pytest.approx(np.full(3, 0.131), rel=0.12)
    assert off[3:5] == pytest.approx(np.full(2, (54.0 + 0.12**-2.0) ** -0.5), rel=0.12)
    assert np.ptp(found[:, 5]) == 0.0
    assert found[0, 5] == pytest.approx(0.3, abs=4.0 / np.sqrt(300 * 54))


def test_two_numbers_that_differ_together_differ_by_neither():
    """40 parts move two numbers by one amount of 0.3, known to 11 %. A third one is their sum, held
    at a nominal value of zero as an alias is. Without its group each would seem to differ."""
    rng, each, known = np.random.default_rng(8), [], np.array([1.0, 1.0, 1e8])
    for _ in range(40):
        two = rng.standard_normal((400, 2))
        j = np.column_stack((two, two.sum(1)))
        own = np.array([0.5, -0.2]) + 0.3 * rng.standard_normal()
        each.append(products(j, two @ own + rng.standard_normal(400)))
    apart = [np.array([0]), np.array([1])]
    found = learn(each, known, np.zeros(3), [*apart, np.array([2])]).deviation
    assert found[2] == pytest.approx(0.3, rel=0.33)
    assert found[:2].max() < 0.05
    assert learn(each, known, np.zeros(3), apart).deviation[:2].min() > 0.1


def test_a_number_without_a_group_has_no_deviation():
    found = learn(campaign(40, np.zeros(6), 2), np.ones(6), np.zeros(6), GROUPS)
    assert found.deviation[5] == 0.0
    assert (found.deviation[:5] > 0.0).all()


def test_parts_that_agree_keep_little_deviation_and_no_more_than_assumed():
    """Data without any: the estimate falls from FIRST towards what the data cannot exclude."""
    rng = np.random.default_rng(3)
    theta, each = np.array([0.4, -1.0]), []
    for _ in range(60):
        j = rng.standard_normal((400, 2))
        each.append(products(j, j @ theta + rng.standard_normal(400)))
    found = learn(each, np.ones(2), np.zeros(2), (np.arange(2),))
    assert 0.0 < found.deviation[0] < 0.4 * voyage_effects.FIRST_DEVIATION


@pytest.mark.parametrize("true", (0.05, 3.0))
def test_sizes_of_numbers_are_found_again(true):
    """The root mean square of 60 numbers that the parts agree on is known to 1/√120 = 9 %."""
    rng = np.random.default_rng(4)
    theta = np.concatenate(([0.3], true * rng.standard_normal(60)))
    each = []
    for _ in range(5):
        j = rng.standard_normal((2000, 61))
        each.append(products(j, j @ theta + rng.standard_normal(2000)))
    found = learn(each, np.ones(61), np.zeros(61), (np.arange(1),), (np.arange(1, 61),))
    assert found.size[1:] == pytest.approx(np.full(60, true), rel=0.3)
    assert found.size[0] == 1.0


def test_learning_leaves_what_it_is_given():
    each, known, pull = campaign(3, np.zeros(6), 5), np.ones(6), np.zeros(6)
    before = [one.copy() for one in each]
    learn(each, known, pull, GROUPS, (np.arange(5, 6),))
    assert (known == 1.0).all() and (pull == 0.0).all()
    assert all((a == b).all() for a, b in zip(each, before, strict=True))


def test_a_small_deviation_of_what_repeats_well_is_found():
    """0.1 % of a plausible size. With the derivatives 1000 times as large it is distinguished from
    noise; 36 numbers say it to 12 %. A lower limit above it, as 2 % of the size, would hide it."""
    rng, each, true = np.random.default_rng(7), [], 0.001
    for _ in range(12):
        j = 1000.0 * rng.standard_normal((60, 3))
        own = np.array([0.4, -0.2, 0.1]) + true * rng.standard_normal(3)
        each.append(products(j, j @ own + rng.standard_normal(60)))
    found = learn(each, np.ones(3), np.zeros(3), (np.arange(3),))
    assert found.deviation == pytest.approx(np.full(3, true), rel=0.36)  # three of its deviations


@pytest.mark.parametrize("count", (1, 63, 150, 219))
def test_an_inverse_by_halves_of_its_root_is_the_inverse(count):
    """Of I + K, as `reduced` has it, where K has eigenvalues from nothing to a million."""
    rng = np.random.default_rng(count)
    turned, _ = np.linalg.qr(rng.standard_normal((count, count)))
    values = 1.0 + np.logspace(6.0, -4.0, count)
    matrix = (turned * values) @ turned.T
    matrix = 0.5 * (matrix + matrix.T)
    found, volume = voyage_effects.inverse_and_volume(matrix)
    wanted = (turned / values) @ turned.T
    assert found == pytest.approx(wanted, abs=1e-9)
    assert volume == pytest.approx(np.log(values).sum(), abs=1e-8)
    with pytest.raises(np.linalg.LinAlgError):
        voyage_effects.inverse_and_volume(matrix - 2.0 * values[0] * np.eye(count))


def test_columns_without_a_deviation_between_and_behind_the_others():
    """They keep what they say of themselves, less what the others explain: a Schur complement."""
    rng = np.random.default_rng(3)
    rows = rng.standard_normal((40, 9))
    gram, deviation = rows.T @ rows, np.array([0.3, 0.0, 1.2, 0.0, 0.7, 0.1, 0.0, 0.0])
    found, volume = reduced(gram, deviation)
    free = np.flatnonzero(deviation) + 1
    columns = rows[:, free] * deviation[free - 1]
    noise = np.eye(40) + columns @ columns.T
    assert found == pytest.approx(rows.T @ np.linalg.solve(noise, rows), rel=1e-9, abs=1e-9)
    assert volume == pytest.approx(np.linalg.slogdet(noise)[1], rel=1e-9)
