"""Roots of bordered matrices: c - bᵀ A⁻¹ b and log|A|, against numpy in double precision."""

import numpy as np
import pytest

from shiplog.simulation.kernel import bordered_roots


def drawn(count, n):
    rng = np.random.default_rng(5)
    root = rng.standard_normal((count, n, 2 * n))
    kk = root @ np.swapaxes(root, 1, 2)
    return kk, rng.standard_normal((count, n)), np.full(count, 50.0)


@pytest.mark.parametrize(("count", "n"), [(1, 3), (9, 6), (17, 15)])
def test_each_is_what_numpy_solves(count, n):
    kk, b, c = drawn(count, n)
    inverse = np.eye(n)[None] * 0.5
    squares, logs = bordered_roots.roots(bordered_roots.packed(kk, b, c), inverse, None)
    A = kk + inverse
    assert squares == pytest.approx(
        c - np.einsum("si,si->s", b, np.linalg.solve(A, b[..., None])[..., 0])
    )
    assert logs == pytest.approx(np.linalg.slogdet(A)[1])


def test_what_rounding_makes_negative_is_zero():
    """Two errors of 1e9 and 2e9 that a noise explains wholly: c - bᵀ A⁻¹ b is nought, and less than
    nothing by rounding, since c has sixteen digits and no more."""
    A, b = np.array([[1.0, 0.3], [0.3, 1.0]]), np.array([1e9, 2e9])
    c = float(b @ np.linalg.solve(A, b)) * (1.0 - 1e-15)
    packed = bordered_roots.packed(A[None] - 0.1 * np.eye(2), b[None], np.array([c]))
    squares, logs = bordered_roots.roots(packed, 0.1 * np.eye(2)[None], None)
    assert squares.tolist() == [0.0]
    assert logs == pytest.approx([np.log(0.91)])


@pytest.mark.parametrize("where", ["b", "c"])
@pytest.mark.parametrize("value", [np.inf, np.nan])
def test_what_is_not_finite_is_not_taken_for_rounding(where, value):
    b, c = np.zeros((1, 3)), np.ones(1)
    (b if where == "b" else c).flat[0] = value
    packed = bordered_roots.packed(np.eye(3)[None], b, c)
    with pytest.raises(np.linalg.LinAlgError):
        bordered_roots.roots(packed, np.zeros((1, 3, 3)), None)


def test_a_matrix_that_is_not_positive_definite_has_no_root():
    packed = bordered_roots.packed(-np.eye(3)[None], np.zeros((1, 3)), np.ones(1))
    with pytest.raises(np.linalg.LinAlgError):
        bordered_roots.roots(packed, np.zeros((1, 3, 3)), None)
