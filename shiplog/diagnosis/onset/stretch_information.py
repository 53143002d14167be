"""What each stretch of a trial says of a cause's numbers: y_b and M_bc, equation (17).

G_s = E_sᵀ C_s⁻¹ E_s of a segment, E = [r | J], is needed in the cause's q columns alone:
T_s = G_s[:, cause] [1 + C, q]. Deviations b_p of part p and c_v of its voyage v, and the nominal
numbers, are eliminated as in (4) and (10). With G_p the products of the part, and

    B_p = D^½ (I + D^½ M_p D^½)⁻¹ D^½                 covariance of b_p, given all else

    T̃_s = T_s - G_p B_p T_s,   G̃_v = Σ_p (G_p - G_p B_p G_p)
    T̄_s = T̃_s - G̃_v V T̃_s,   V as B, of the voyage's c_v from G̃_v
    M'_st = δ_st T_s[cause] - δ_pp' T_sᵀ B_p T_t - T̃_sᵀ V T̃_t        s, t of one voyage

A trial counts for a share c of itself, and H are the columns N of the hypothesis without the cause,
with A and the posterior mean m = A⁻¹ b of (6) and (7):

    y_s = c (T̄_s[0] - mᵀ T̄_s[N]),   M_st = c M'_st - c² T̄_s[N]ᵀ A⁻¹ T̄_t[N]

Segments of one stretch are added. Nothing is kept of a segment but T̄_s and M' of its voyage.

Several causes may be asked for together, their numbers one after another; and a voyage may have
been linearised at numbers of its own (`Piece`), J_s and r then being those there.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.hypotheses import evidence
from shiplog.diagnosis.linear.parameter_layout import Columns
from shiplog.diagnosis.noise import likelihood
from shiplog.diagnosis.noise.likelihood import InverseKernels
from shiplog.diagnosis.noise.remainder import NOMINAL, RAISED, Remainder
from shiplog.diagnosis.nominal.voyage_effects import inverse_and_volume
from shiplog.diagnosis.trial.fitted import Fit, Level, Point
from shiplog.diagnosis.trial.trial import Trial

MOST_STRETCHES = 400  # of a trial: M has their square, and all pairs of them are weighed


@dataclass(frozen=True)
class Stretches:
    """Information of B stretches on a cause's q numbers, in units of their realistic size.

    y       [B, q]        h_bᵀ S⁻¹ (r - H μ)
    M       [B, q, B, q]  h_bᵀ S⁻¹ h_c
    first   [B]           first segment of each stretch, among the trial's
    unit    [q]           SI
    """

    y: np.ndarray
    M: np.ndarray
    first: np.ndarray
    unit: np.ndarray


@dataclass(frozen=True)
class Piece:
    """Some voyages of a trial, linearised where their own numbers stand.

    trial    of their segments alone
    point    of these
    rows     [S] of them among the segments of the whole trial
    noise    λ of them
    """

    trial: Trial
    point: Point
    rows: np.ndarray
    noise: float


def of_cause(trial: Trial, fit: Fit, label: str) -> Stretches:
    """y and M of a cause of the hypothesis `fit`. Raises np.linalg.LinAlgError where a matrix is
    not positive definite."""
    return of_causes(trial, fit, (label,), first_of_stretches(trial))


def of_causes(
    trial: Trial, fit: Fit, labels: Sequence[str], first: np.ndarray, pieces: Sequence[Piece] = ()
) -> Stretches:
    """y and M of several causes, their numbers one after another. Raises as `of_cause`.

    first    of the stretches, among the segments of the trial; none crosses two voyages
    pieces   that the trial consists of, in its order; unless given, all of it where the fit stands
    """
    noise, ref = fit.estimate.noise_factor, trial.reference
    pieces = pieces or (Piece(trial, fit.point, np.arange(len(trial.rows)), noise),)
    columns = np.concatenate([ref.columns.indices[label] for label in labels])
    stands = [numbers_at(one.point.numbers, ref.columns, labels) for one in pieces]
    remainder = without_time(fit.remainder)
    of = [Asked(columns, present, remainder) for present in stands]
    level = _of_others(trial, fit, labels, [*zip(pieces, of, strict=True)])
    others = 1 + evidence.columns_of(trial, _without(fit, labels), remainder)
    c = ref.counts
    stretch = np.searchsorted(first, np.arange(len(trial.rows)), side="right") - 1
    y, across, own = [], [], []
    for piece, asked in zip(pieces, of, strict=True):
        for part in _each_voyage(piece, asked, stretch[piece.rows]):
            y.append(part.T[:, 0] - np.einsum("n,bnq->bq", level.mean, part.T[:, others]))
            across.append(part.T[:, others])
            own.append(part.M)
    T = np.concatenate(across)
    B, N, q = T.shape
    X = np.moveaxis(T, 1, 0).reshape(N, B * q)
    M = -(c**2) * X.T @ level.covariance @ X
    at = 0
    for block in own:  # voyages are independent but for the numbers that they share
        size = len(block)
        M[at : at + size, at : at + size] += c * block
        at += size
    unit = ref.columns.unit[columns]
    return Stretches(c * np.concatenate(y), M.reshape(B, q, B, q), first, unit)


def _of_others(
    trial: Trial, fit: Fit, labels: Sequence[str], pieces: Sequence[tuple[Piece, Asked]]
) -> Level:
    """Posterior of all numbers but those of the causes in question, which are absent."""
    total = sum(absent(_whole(piece, of), of.columns, of.present) for piece, of in pieces)
    assert isinstance(total, np.ndarray)
    return evidence.solve(
        trial, total, 0.0, fit.estimate.noise_factor, fit.point, _without(fit, labels),
        pieces[0][1].remainder,
    )  # fmt: skip


def _whole(piece: Piece, of: Asked) -> np.ndarray:
    """G [1 + C, 1 + C] of a piece."""
    trial = piece.trial
    return trial.products.total(piece.point, piece.noise, trial.weight, of.remainder).G


def _without(fit: Fit, labels: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for name in fit.included if name not in labels)


def numbers_at(
    numbers: Mapping[str, np.ndarray], columns: Columns, labels: Sequence[str]
) -> np.ndarray:
    """Numbers [q] of some causes, one after another, in units; zero of those without."""
    own = [columns.indices[label] for label in labels]
    return np.concatenate([
        np.asarray(numbers.get(label, np.zeros(len(at)))) / columns.unit[at]
        for label, at in zip(labels, own, strict=True)
    ])  # fmt: skip


def without_time(remainder: Remainder) -> Remainder:
    """The noise of a remainder. A force that depends on time would absorb what begins or ends."""
    if remainder.kind != "time":
        return remainder
    return replace(remainder, kind=RAISED if remainder.noisy else NOMINAL, noisy=False)


def absent(G: np.ndarray, columns: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Wᵀ G W of the residual r + J x where a cause is absent, x `present` [q] where the trial was
    linearised: W is the identity with x in the first column."""
    rows = 1 + columns
    found = G.copy()
    found[0] += present @ G[rows]
    found[:, 0] += found[:, rows] @ present
    return found


def first_of_stretches(trial: Trial) -> np.ndarray:
    """First segment of each stretch [B], of MOST_STRETCHES at most; none crosses two voyages."""
    voyage = trial.record.voyage[trial.rows]
    together = max(math.ceil(len(voyage) / MOST_STRETCHES), 1)
    first: list[np.ndarray] = []
    for name in dict.fromkeys(voyage.tolist()):
        first.append(np.flatnonzero(voyage == name)[::together])
    return np.concatenate(first)


@dataclass(frozen=True)
class _Voyage:
    """T̄ [b, 1 + C, q] of a voyage's stretches, and M' [b q, b q]."""

    T: np.ndarray
    M: np.ndarray


@dataclass(frozen=True)
class Asked:
    """Columns [q] of the causes in question, their numbers `present` [q] where the voyages were
    linearised, in units, and what remains together with them."""

    columns: np.ndarray
    present: np.ndarray
    remainder: Remainder


def _each_voyage(piece: Piece, of: Asked, stretch: np.ndarray) -> Iterator[_Voyage]:
    """One voyage after another, their own deviations and those of their parts integrated out.

    stretch   [S] of each segment of the piece
    """
    trial, point, noise, remainder = piece.trial, piece.point, piece.noise, of.remainder
    products = trial.products
    deviation = products.deviation(remainder)
    between = trial.campaign.apart * deviation
    prior = products.process_noise(point.linear.cut, noise, remainder).inverse_kernels(
        trial.grid.nodes
    )
    each = zip(
        trial.voyage.tolist(), trial.parts,
        products.each_part(point, noise, trial.weight, remainder), strict=True,
    )  # fmt: skip
    for _, grouped in itertools.groupby(each, key=lambda one: one[0]):
        own = list(grouped)
        alone = len(own) == 1  # both deviations are of one part: their sum is a Gaussian, too
        within = np.zeros_like(deviation) if alone else deviation
        spread = np.hypot(between, deviation) if alone else between
        G_v, of_parts = 0.0, []
        for _, rows, gram in own:
            G = absent(gram.G, of.columns, of.present)
            T = _segment_products(piece, rows, of, prior, len(G))
            T, M = _added(T, 1 + of.columns, stretch[rows])
            B = _covariance(G, within)
            BT = _times(B, T)
            of_parts.append((T - _times(G, BT), M - _between(T, BT)))
            G_v = G_v + G - G @ B @ G
        assert isinstance(G_v, np.ndarray)
        yield _of_voyage(G_v, spread, of_parts, [stretch[rows] for _, rows, _ in own])


def _of_voyage(
    G: np.ndarray, spread: np.ndarray, parts: Sequence[tuple[np.ndarray, np.ndarray]],
    stretches: Sequence[np.ndarray],
) -> _Voyage:  # fmt: skip
    """T̄ and M' of a voyage from T̃ and M' of its parts; a stretch may reach over two of them."""
    q = parts[0][0].shape[-1]
    T, M = np.concatenate([one for one, _ in parts]), _block_diagonal([one for _, one in parts])
    names = np.concatenate([np.unique(of) for of in stretches])
    of = np.unique(names)
    if len(of) < len(names):
        add = (of[:, None] == names).astype(float)
        T = np.einsum("ab,bnq->anq", add, T)
        both = np.kron(add, np.eye(q))
        M = both @ M @ both.T
    V = _covariance(G, spread)
    VT = _times(V, T)
    return _Voyage(T - _times(G, VT), M - _between(T, VT))


def _segment_products(
    piece: Piece, rows: np.ndarray, of: Asked, prior: InverseKernels, size: int
) -> np.ndarray:  # fmt: skip
    """T_s = w_s E_sᵀ C_s⁻¹ h_s [S, 1 + C, q] of a part's segments, E = [r | J | Zₐ Φ] where the
    cause is absent, by the three eliminations of `noise`; `size` is 1 + C."""
    trial, columns, present = piece.trial, of.columns, of.present
    ref = trial.reference
    own, w = piece.point.linear.pick(rows), trial.weight[rows]
    process_noise = ref.process_noise
    white = likelihood.Whitening(own.cut.used, process_noise)
    E = white(np.concatenate((own.e[..., None], own.j), -1))
    Z = white(own.z)
    Zt, h = np.swapaxes(Z, 1, 2), E[..., 1 + columns]
    weighed = likelihood.Weighed(
        np.swapaxes(E, 1, 2) @ h, Zt @ E, Zt @ Z, 0.0, trial.grid.nodes
    )  # fmt: skip
    kk, kd, Y = likelihood.start_of(weighed, process_noise)
    T = weighed.dd - np.swapaxes(Y, 1, 2) @ Y[..., 1 + columns]
    phi = trial.products.accelerations(own.cut)[..., : size - T.shape[1]]
    kd_h = kd[..., 1 + columns]
    T = np.concatenate((T, np.swapaxes(phi, 1, 2) @ kd_h), 1)
    across = np.concatenate((kd, kk @ phi), -1)
    T -= np.swapaxes(across, 1, 2) @ np.linalg.solve(kk + prior.of(rows), kd_h)
    unit = np.ones(size)
    unit[1 : 1 + len(ref.columns.unit)] = ref.columns.unit
    T *= w[:, None, None] * unit[:, None] * unit[1 + columns]
    T[:, 0] += np.einsum("p,spq->sq", present, T[:, 1 + columns])
    return T


def _added(
    T: np.ndarray, columns: np.ndarray, stretch: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """T [b, 1 + C, q] of stretches, and diag(T[cause]) [b q, b q]: segments of one stretch added.

    stretch   [S] of each segment, in order"""
    at = np.flatnonzero(np.diff(stretch, prepend=-1))
    T = np.add.reduceat(T, at, axis=0)
    return T, _block_diagonal(T[:, columns])


def _block_diagonal(blocks: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    sizes = [len(one) for one in blocks]
    found, at = np.zeros((sum(sizes),) * 2), 0
    for one, size in zip(blocks, sizes, strict=True):
        found[at : at + size, at : at + size] = one
        at += size
    return found


def _covariance(G: np.ndarray, deviation: np.ndarray) -> np.ndarray:
    """D^½ (I + D^½ M D^½)⁻¹ D^½ [1 + C, 1 + C], with a first row and column of zeros."""
    D_half = np.append(0.0, deviation)
    D_half = np.append(D_half, np.zeros(len(G) - len(D_half)))
    F = np.flatnonzero(D_half)
    found = np.zeros_like(G)
    if len(F):
        scale = np.outer(D_half[F], D_half[F])
        R, _ = inverse_and_volume(np.eye(len(F)) + scale * G[np.ix_(F, F)])
        found[np.ix_(F, F)] = scale * R
    return found


def _times(matrix: np.ndarray, T: np.ndarray) -> np.ndarray:
    """K T_b of each stretch [b, n, q]."""
    return np.einsum("nm,bmq->bnq", matrix, T, optimize=True)


def _between(T: np.ndarray, KT: np.ndarray) -> np.ndarray:
    """T_aᵀ K T_b [b q, b q]."""
    count, n, q = T.shape
    left, right = (np.moveaxis(one, 1, 0).reshape(n, count * q) for one in (T, KT))
    return left.T @ right
