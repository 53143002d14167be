"""Lines of the rooms' equations, as their docstrings state them, against dense computations."""

from itertools import product

import numpy as np
import pytest
from scipy.stats import norm

from shiplog.diagnosis.linear import linearisation
from shiplog.diagnosis.linear.linear_segments import Linear, Path, Wide
from shiplog.diagnosis.linear.segments import Cut
from shiplog.diagnosis.noise.remainder import INTERMITTENT, RAISED, Remainder, noise_prior
from shiplog.diagnosis.nominal import voyage_effects
from shiplog.diagnosis.residual import omitted_inputs
from shiplog.training.physics import output_error

NODES = 3  # J


def test_a_step_towards_the_measurement_minimises_the_stated_sum():
    """Σ ((y - y* - H d - Z δz)/σ)² + Σ (δξ/σ₀)² + Σ ((a* + δa - ā)/σₐ)², each term a row."""
    rng = np.random.default_rng(5)
    segments, bins, columns = 2, 4, 2
    shape = (segments, bins, 6)
    used = np.ones(shape, dtype=bool)
    used[1, 2] = False
    cut = Cut(np.arange(segments), np.zeros(shape), used, np.zeros((segments, 1, 1)),
              np.zeros(segments, dtype=int), 0.2)  # fmt: skip
    path = Path(rng.standard_normal((segments, 6)), rng.standard_normal((segments, 3, NODES)))
    given = Linear(
        cut, path, rng.standard_normal(shape), rng.standard_normal((*shape, 6 + 3 * NODES)),
        rng.standard_normal((*shape, columns)),
    )  # fmt: skip
    wide = Wide(np.full(6, 0.3), np.arange(1.0, 7.0), np.array([0.5, 0.7, 0.9]))
    d, expected = np.array([0.4, -0.2]), rng.standard_normal((segments, 3 * NODES))
    found = linearisation.predict_path(given, d, wide, expected)
    a_wide = np.repeat(wide.acceleration, NODES)
    for s in range(segments):
        rows = used[s].ravel()
        z = given.z[s].reshape(-1, 6 + 3 * NODES)[rows]
        a = path.acceleration[s].ravel()
        gap = given.e[s].ravel()[rows] - given.j[s].reshape(-1, columns)[rows] @ d - z[:, 6:] @ a
        matrix = np.concatenate((z / 0.3, np.diag(1.0 / np.concatenate((wide.start, a_wide)))))
        right = np.concatenate((gap / 0.3, np.zeros(6), (expected[s] - a) / a_wide))
        step = np.linalg.lstsq(matrix, right, rcond=None)[0]
        assert found.start[s] == pytest.approx(path.start[s] + step[:6], abs=1e-9)
        assert found.acceleration[s].ravel() == pytest.approx(a + step[6:], abs=1e-9)


def test_a_step_of_expectation_maximisation_is_that_of_the_joint_posterior():
    """Of x and the b of two columns in each of three parts, one Gaussian of nine numbers."""
    rng = np.random.default_rng(4)
    free, groups, sized = np.array([0, 2]), [np.array([0]), np.array([2])], [np.array([1])]
    variance, known = np.array([0.3, 0.0, 0.7]), np.array([2.0, 1.0, 0.5])
    pull, size = np.array([0.4, 0.0, -0.2]), 0.8  # variance of x of the column that is `sized`
    known[1] = 1.0 / size
    precision, right = np.zeros((9, 9)), np.zeros(9)
    precision[:3, :3], right[:3] = np.diag(known), pull
    grams = []
    for part in range(3):
        rows, e = rng.standard_normal((6, 3)), rng.standard_normal(6)
        both = np.concatenate((e[:, None], rows), 1)
        grams.append(both.T @ both)
        columns = np.zeros((6, 9))
        own = slice(3 + 2 * part, 5 + 2 * part)
        columns[:, :3], columns[:, own] = rows, rows[:, free]
        precision[own, own] += np.diag(1.0 / variance[free])
        precision += columns.T @ columns
        right += columns.T @ e
    covariance = np.linalg.inv(precision)
    mean = covariance @ right
    squares = mean**2 + np.diagonal(covariance)
    least = voyage_effects.LEAST_DEVIATION**2
    wanted = [(squares[3 + c :: 2].sum() + least) / 4.0 for c in (0, 1)]
    wanted.append((squares[1] + least) / 2.0)
    problem = voyage_effects._EffectsProblem(
        [voyage_effects._Part.select(g, free) for g in grams], free, known, pull, groups, sized
    )
    found, numbers = problem.step(np.log([0.3, 0.7, size]))
    assert np.exp(found) == pytest.approx(wanted)
    for part, x_b in enumerate(numbers):
        own = np.array([mean[3 + 2 * part], 0.0, mean[4 + 2 * part]])
        assert x_b == pytest.approx(mean[:3] + own)


def _nested(x: np.ndarray, y: np.ndarray, folds: np.ndarray) -> np.ndarray:
    """[3] Σ_f E_f(λ_f), by ridge regressions on rows."""

    def error(penalty: float, fitted: np.ndarray, judged: np.ndarray) -> np.ndarray:
        x_mean, y_mean = x[fitted].mean(0), y[fitted].mean(0)
        inside = x[fitted] - x_mean
        gram = inside.T @ inside + penalty * fitted.sum() * np.eye(x.shape[1])
        weights = np.linalg.solve(gram, inside.T @ (y[fitted] - y_mean))
        return ((y[judged] - y_mean - (x[judged] - x_mean) @ weights) ** 2).sum(0)

    count, total = folds.max() + 1, np.zeros(3)
    for f in range(count):
        inner = np.zeros((len(omitted_inputs.PENALTIES), 3))
        for (row, penalty), g in product(enumerate(omitted_inputs.PENALTIES), range(count)):
            if g != f:
                inner[row] += error(penalty, (folds != f) & (folds != g), folds == g)
        best = omitted_inputs.PENALTIES[inner.argmin(0)]
        total += [error(one, folds != f, folds == f)[c] for c, one in enumerate(best)]
    return total


def test_cross_validation_on_sums_is_that_on_rows():
    rng = np.random.default_rng(8)
    folds = np.repeat(np.arange(4), (20, 25, 30, 22))
    x = rng.standard_normal((len(folds), 3))
    y = x @ rng.standard_normal((3, 3)) * 0.4 + rng.standard_normal((len(folds), 3)) + 2.0
    nodes = omitted_inputs._Nodes(y, x, x, folds, folds)
    unit = x / np.sqrt((x**2).mean(0))
    assert omitted_inputs._cross_validation_error(nodes, x) == pytest.approx(
        _nested(unit, y, folds), rel=1e-9
    )


@pytest.mark.parametrize(
    "remainder",
    [
        Remainder(RAISED),
        Remainder(RAISED, channels=(1.2, 2.0, 0.7)),
        Remainder(RAISED, channels=(1.2, 2.0, 0.7), noise_lasts=1.7),
        Remainder(INTERMITTENT, channels=(1.0, 1.3, 1.3), intermittent=(0.0, 0.1, 0.2)),
    ],
    ids=["one factor", "a factor a channel", "and longer", "a force"],
)
def test_the_prior_of_raised_noise_is_a_ratio_of_gaussian_densities(remainder):
    """Each number's density over the greatest one of nominal noise, N(0; 0, σ²)."""
    noise, sigma = 1.8, 0.2
    if not remainder.shaped:
        numbers = [np.log(noise)]
    else:
        numbers = [*np.log(noise * np.array(remainder.channels))]
    if remainder.lasts != 1.0:
        numbers.append(np.log(remainder.lasts))
    wanted = sum(norm.logpdf(x) - norm.logpdf(0.0, scale=sigma) for x in numbers)
    assert noise_prior(noise, sigma, remainder) == pytest.approx(wanted)
    plain = norm.logpdf(np.log(noise), scale=sigma) - norm.logpdf(0.0, scale=sigma)
    assert noise_prior(noise, sigma, Remainder()) == pytest.approx(plain)


def test_a_root_stands_in_for_all_rows_of_the_output_error(monkeypatch):
    """JᵀJ = H + I, Jᵀr = q + x, rᵀr = c + |x|², of rows that are written out here."""
    rng = np.random.default_rng(2)
    rows, error = rng.standard_normal((4, 6, 3)), rng.standard_normal((4, 6))  # windows, samples
    rows[..., 2] = 0.0  # a parameter that the data do not touch
    weight, spread = np.array([1.0, 0.5, 2.0, 0.0]), np.array([0.5, 2.0, 3.0])
    noise, start, x = 0.7, np.array([1.0, 2.0, 3.0]), np.array([0.3, -0.2, 0.1])

    def normal(model, theta, data, free):
        assert theta == pytest.approx(start + spread * x)
        return output_error_normal

    output_error_normal = type("Normal", (), {
        "loss": (error**2).sum(1), "pull": np.einsum("wt,wtp->wp", error, rows),
        "gram": np.einsum("w,wtp,wtq->pq", weight, rows, rows),
    })  # fmt: skip
    monkeypatch.setattr(output_error, "normal", normal)
    data = type("Data", (), {"weight": weight})
    problem = output_error._Problem(None, start, spread, data, np.ones(3, dtype=bool), noise)
    jacobian, residual = problem.jacobian(x), problem.residual(x)
    scaled = (rows * spread * np.sqrt(weight / noise)[:, None, None]).reshape(-1, 3)
    left = (error * np.sqrt(weight / noise)[:, None]).ravel()
    assert jacobian.T @ jacobian == pytest.approx(scaled.T @ scaled + np.eye(3))
    assert jacobian.T @ residual == pytest.approx(scaled.T @ left + x)
    assert residual @ residual == pytest.approx(left @ left + x @ x)
