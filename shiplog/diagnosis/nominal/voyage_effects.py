"""How far the numbers that fit one part of a campaign are from those that fit the others.

A model whose equations are not the ship's has other best coefficients on every voyage. Each part of
a campaign therefore has numbers x + b of its own, b ~ N(0, D), and D is estimated from the nominal
campaign (random effects: Laird & Ware 1982). What all parts agree on stays known; what they
disagree on is loosened. A diagonal D has one variance a group of numbers.

    e_i = J_i (x + b_i) + ε_i,   G_i = [e | J]ᵀ C⁻¹ [e | J] [1 + C, 1 + C] = (g₀₀, gᵀ; g, M)

All arrays are in units of `Columns.unit`. F are the columns that have a b.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, get_lapack_funcs

EM_ROUNDS = 15  # of three steps of expectation-maximisation each, at most
CONVERGED = 0.1  # of the logarithm of a variance: a round that moves none by more is the last
LEAP = 16.0  # steps at once, at most
BOUNDS = (-20.0, 10.0)  # of the logarithm of a variance: 5e-5 to 150 plausible sizes
FIRST_DEVIATION = 0.1  # at which it begins, in units of a number's plausible size
LEAST_DEVIATION = 0.001  # of one pseudo-part, so that a variance cannot become zero
UNSEEN_DEVIATION = 0.02  # of numbers that the nominal campaign says nothing of

AT_ONCE = 64  # rows of a root that LAPACK inverts; a larger one by halves

_trtri, _lauum = get_lapack_funcs(("trtri", "lauum"), dtype=np.float64)


@dataclass(frozen=True)
class VoyageEffects:
    """deviation [C]: D^½, standard deviation of b. size [C]: K^-½, that of x itself before any
    data. numbers [V, C]: x + b of every part; none where nothing was estimated."""

    deviation: np.ndarray
    size: np.ndarray
    numbers: np.ndarray | None = None


def reduced(gram: np.ndarray, deviation: np.ndarray) -> tuple[np.ndarray, float]:
    """G - G_•F D^½ (I + D^½ M_FF D^½)⁻¹ D^½ G_F•, a part's products with its own b integrated out,
    and log|I + D^½ M_FF D^½|. One inverse gives it all: with H the rows that are not F, and

        R = (I + D^½ M_FF D^½)⁻¹:   FF  D^-½ (I - R) D^-½
                                    FH  D^-½ R D^½ G_FH
                                    HH  G_HH - G_HF D^½ R D^½ G_FH

    gram        G [1 + C, 1 + C]
    deviation   D^½ [C]; F where it is greater than zero

    Raises np.linalg.LinAlgError where the products are not those of a covariance.
    """
    D_half = np.append(0.0, deviation)
    if not D_half.any():
        return gram, 0.0
    count = int(np.flatnonzero(D_half)[-1]) + 1  # rows up to the last that has a b
    H = np.append(np.flatnonzero(D_half[:count] == 0.0), np.arange(count, len(gram)))
    D_half = D_half[:count]
    scale = D_half[:, None] * D_half
    A = gram[:count, :count] * scale  # rows of H are those of the identity, and R's are then too
    A[np.diag_indices(count)] += 1.0
    R, volume = inverse_and_volume(A)
    G_H = gram[:, H]
    D_G = D_half[:, None] * G_H[:count]
    R_D_G = R @ D_G
    HH = G_H[H] - D_G.T @ R_D_G
    found = np.empty_like(gram)
    F = D_half > 0.0
    np.divide(1.0, D_half, out=D_half, where=F)
    R[np.diag_indices(count)] -= 1.0
    np.multiply(R, -D_half[:, None] * D_half, out=found[:count, :count])
    FH = D_half[:, None] * R_D_G
    found[:count, H], found[H, :count] = FH, FH.T
    found[np.ix_(H, H)] = HH
    return found, volume


def own_numbers(gram: np.ndarray, common: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """b_F = (M_FF + D⁻¹)⁻¹ (g_F - M_F x) [C] of one part, most probable given x, and zero where it
    has none.

    gram       G [1 + C, 1 + C] of the part, or of more columns behind these
    common     x [C]
    deviation  D^½ [C] of b
    """
    b, F = np.zeros(len(common)), np.flatnonzero(deviation > 0.0)
    M_FF = gram[np.ix_(1 + F, 1 + F)] + np.diag(deviation[F] ** -2.0)
    left = gram[1 + F, 0] - gram[1 + F, 1 : 1 + len(common)] @ common
    b[F] = np.linalg.solve(M_FF, left)
    return b


def learn(
    each: Sequence[np.ndarray],
    known: np.ndarray,
    pull: np.ndarray,
    groups: Sequence[np.ndarray],
    sized: Sequence[np.ndarray] = (),
) -> VoyageEffects:
    """D by expectation-maximisation (Dempster, Laird & Rubin 1977), each round three steps of it of
    which the first two say how far the third may leap (SQUAREM, Varadhan & Roland 2008).

    each     G of every part
    known    K [C], information on x before any data; `pull` η [C], what it pulls towards
    groups   columns that share one variance of D; other columns have none
    sized    columns whose prior size K^-½ (the same in every part) is estimated too

    Raises np.linalg.LinAlgError where a matrix is singular.
    """
    free = np.sort(np.concatenate([np.zeros(0, int), *groups]))
    problem = _EffectsProblem(
        [_Part.select(gram, free) for gram in each], free, known, pull, list(groups), list(sized)
    )
    sizes = np.log(np.full(len(problem.groups) + len(problem.sized), FIRST_DEVIATION**2))
    for at, columns in enumerate(problem.sized, len(problem.groups)):
        sizes[at] = -math.log(known[columns[0]])
    for _ in range(EM_ROUNDS):
        one, _ = problem.step(sizes)
        two, _ = problem.step(one)
        first, second = one - sizes, two - one
        bend = float(np.linalg.norm(second - first))
        leap = float(np.clip(np.linalg.norm(first) / max(bend, 1e-12), 1.0, LEAP))
        before = sizes
        sizes, numbers = problem.step(sizes + 2.0 * leap * first + leap**2 * (second - first))
        if np.abs(sizes - before).max(initial=0.0) < CONVERGED:
            break
    variance, information = problem.spread(sizes)
    return VoyageEffects(np.sqrt(variance), information**-0.5, numbers)


@dataclass(frozen=True)
class _Part:
    """Blocks of a part's G: M_FF, M_Fo, M_oo, g_F and g_o; F have a b, o have none."""

    ff: np.ndarray
    fo: np.ndarray
    oo: np.ndarray
    g_f: np.ndarray
    g_o: np.ndarray

    @classmethod
    def select(cls, gram: np.ndarray, free: np.ndarray) -> _Part:
        """Of a part's products G [1 + C, 1 + C], F = `free`."""
        F, o = 1 + free, 1 + _others(free, len(gram) - 1)
        ff, fo, oo = gram[np.ix_(F, F)], gram[np.ix_(F, o)], gram[np.ix_(o, o)]
        return cls(ff, fo, oo, gram[F, 0], gram[o, 0])


def _others(free: np.ndarray, count: int) -> np.ndarray:
    """Columns that are not free, of so many."""
    return np.setdiff1d(np.arange(count), free)


@dataclass(frozen=True)
class _EffectsProblem:
    """Parts with what is known of x (K, η), and which columns share one variance; `free` F are
    those of all groups."""

    parts: list[_Part]
    free: np.ndarray
    known: np.ndarray
    pull: np.ndarray
    groups: list[np.ndarray]
    sized: list[np.ndarray]

    def spread(self, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """D [C] and K [C], of the logarithms of all variances: groups first, then sizes."""
        variance, known = np.zeros(len(self.known)), self.known.copy()
        for columns, size in zip(self.groups, sizes, strict=False):
            variance[columns] = math.exp(size)
        for columns, size in zip(self.sized, sizes[len(self.groups) :], strict=True):
            known[columns] = math.exp(-size)
        return variance, known

    def step(self, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One step of expectation-maximisation: logarithms of the variances, and x + b [V, C].

            S_i = (D⁻¹ + M_FF)⁻¹,  T_i = S_i M_F        b_i | x ~ N(S_i g_F - T_i x, S_i)
            V = (K + Σ_i M - M_Fᵀ T_i)⁻¹,  x̂ = V (η + Σ_i g - T_iᵀ g_F)         x ~ N(x̂, V)
            E b_i² = (S_i g_F - T_i x̂)² + diag S_i + diag T_i V T_iᵀ,  E x² = x̂² + diag V

        As M_FF = S⁻¹ - D⁻¹, one inverse R = (I + D^½ M_FF D^½)⁻¹ of a part gives the rest, with
        S = D^½ R D^½ and, for the columns F of T, of M - M_Fᵀ T, and of g - Tᵀ g_F

            T_F = I - S D⁻¹,   D⁻¹ - D⁻¹ S D⁻¹,   D⁻¹ S g_F

        The new variance of a group is the mean of E b² over its columns and all parts, that of a
        size the mean of E x² over its columns.
        """
        D, K = self.spread(np.clip(sizes, *BOUNDS))
        F, o = self.free, _others(self.free, len(D))
        D_half, D_inverse = np.sqrt(D[F]), 1.0 / D[F]
        scale, identity = np.outer(D_half, D_half), np.eye(len(F))
        FF, Fo = np.zeros(scale.shape), np.zeros((len(F), len(o)))  # sums of M - M_Fᵀ T
        information, pull, of_parts = np.diag(K), self.pull.copy(), []
        for part in self.parts:
            S = inverse_and_volume(identity + scale * part.ff)[0]
            FF += identity
            FF -= S
            S *= scale
            T_o, S_g = S @ part.fo, S @ part.g_f
            Fo += T_o
            information[np.ix_(o, o)] += part.oo - part.fo.T @ T_o
            pull[F] += D_inverse * S_g
            pull[o] += part.g_o - T_o.T @ part.g_f
            of_parts.append((S, T_o, S_g))
        Fo *= D_inverse[:, None]
        information[np.ix_(F, F)] += FF / scale
        information[np.ix_(F, o)] += Fo
        information[np.ix_(o, F)] += Fo.T
        V, _ = inverse_and_volume(information)
        x = V @ pull
        order = np.concatenate((F, o))
        V_ordered, x_ordered = np.ascontiguousarray(V[np.ix_(order, order)]), x[order]
        b_squares = np.zeros(len(D))
        numbers = np.repeat(x[None], len(self.parts), axis=0)
        for x_b, (S, T_o, S_g) in zip(numbers, of_parts, strict=True):
            T = np.concatenate((identity - S * D_inverse, T_o), 1)
            b = S_g - T @ x_ordered
            x_b[F] += b
            b_squares[F] += b**2 + np.diagonal(S)
            b_squares[F] += np.einsum("ij,ij->i", T @ V_ordered, T)
        x_squares = x**2 + np.diagonal(V)
        count = len(self.parts)
        variances = [_mean(b_squares[c].sum(), count * len(c)) for c in self.groups]
        variances += [_mean(x_squares[c].sum(), len(c)) for c in self.sized]
        return np.log(np.array(variances)), numbers


def inverse_and_volume(matrix: np.ndarray) -> tuple[np.ndarray, float]:
    """A⁻¹ = L⁻ᵀ L⁻¹ and log|A|, A = L Lᵀ positive definite. Raises np.linalg.LinAlgError where it
    is not."""
    if not len(matrix):
        return matrix, 0.0
    L = cholesky(matrix, lower=True, check_finite=False)
    half, _ = _lauum(_inverse_root(L), lower=True, overwrite_c=True)
    whole = half + half.T  # above the diagonal of a root there are zeros
    whole[np.diag_indices(len(whole))] *= 0.5
    return whole, 2.0 * float(np.log(np.diagonal(L)).sum())


def _inverse_root(L: np.ndarray) -> np.ndarray:
    """L⁻¹ of a Cholesky root, by halves while it is large, as products of matrices are three times
    as fast as LAPACK's inverse:  [[A, 0], [B, C]]⁻¹ = [[A⁻¹, 0], [-C⁻¹ B A⁻¹, C⁻¹]]."""
    count = len(L)
    if count <= AT_ONCE:
        return _trtri(L, lower=True)[0]
    half = count // 2
    whole = np.zeros((count, count), order="F")
    first, second = _inverse_root(L[:half, :half]), _inverse_root(L[half:, half:])
    whole[:half, :half], whole[half:, half:] = first, second
    whole[half:, :half] = -second @ (L[half:, :half] @ first)
    return whole


def _mean(total: float, count: int) -> float:
    """(Σ b² + LEAST_DEVIATION²)/(n + 1): mean square, one pseudo-observation among the others."""
    return (total + LEAST_DEVIATION**2) / (count + 1.0)
