"""Products G = Σ_s w_s G_s of a part's segments, at any process noise, from one pass of them.

E_s = [e_s | J_s | Zₐ Φ_s] has N = 1 + C + W columns: the error, those of θ, and those of W weights
that act as accelerations Φ_s [3J, W] at the nodes. Without instruments and start (the first two
eliminations of this room: products in C₀⁻¹) a part keeps

    T = Σ_s w_s E_sᵀ C₀⁻¹ E_s [N, N],   B_s = √w_s Zₐᵀ C₀⁻¹ E_s [3J, N],   K_s = Zₐᵀ C₀⁻¹ Zₐ

of which the columns of Zₐ Φ follow from the others: Zₐᵀ C₀⁻¹ Zₐ Φ = K Φ. With the process noise
a_s ~ N(0, Q) the third elimination is a Cholesky root of each segment, whatever the shape of Q
(matrix inversion lemma: Woodbury 1950):

    A_s = K_s + Q⁻¹ = L_s L_sᵀ
    G = T - Σ_s (L_s⁻¹ B_s)ᵀ (L_s⁻¹ B_s)
    Σ_s w_s (log|C_s| - log|C₀|) = Σ_s w_s (log|Q| + log|A_s|)                          its volume

All is in units of the numbers. A part is small, so that a campaign may have any number of them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import get_blas_funcs

from shiplog.diagnosis.linear.linear_segments import AT_A_TIME, Accelerations, Linear
from shiplog.diagnosis.noise import likelihood
from shiplog.diagnosis.noise.likelihood import InverseKernels, ProcessNoise

_syrk, _trsm = get_blas_funcs(("syrk", "trsm"), dtype=np.float64)


@dataclass(frozen=True)
class PartPass:
    """A part's segments without their starts; those of no weight are left out.

    total   lower half of T [N, N], N = 1 + C + W; zeros above its diagonal
    across  [S, 3J, N]  B
    within  [S, 3J, 3J]  K
    weight  w [S]
    rows    [S] of these segments among all that were linearised
    logdet  log|C₀| of the part, restricted (`likelihood.Startless`), of every segment
    """

    total: np.ndarray
    across: np.ndarray
    within: np.ndarray
    weight: np.ndarray
    rows: np.ndarray
    logdet: float

    def of_columns(self, columns: np.ndarray) -> PartPass:
        """Some of its columns, in order."""
        total = self.total[np.ix_(columns, columns)]
        return replace(self, total=total, across=np.take(self.across, columns, axis=-1))

    def gram(self, prior: InverseKernels, first: int | None = None) -> Gram:
        """G, of the `first` columns or of all, and its volume; Q⁻¹ is the `prior` of all segments
        that were linearised. Raises np.linalg.LinAlgError where A is not positive definite."""
        columns = len(self.total) if first is None else first
        G = np.array(self.total[:columns, :columns], order="F")
        n = self.within.shape[-1]
        if not n or not len(self.rows):
            return Gram(_both_halves(G), 0.0)
        roots = np.linalg.cholesky(self.within + prior.of(self.rows))
        X = np.empty((len(self.rows) * n, columns))
        for s, root in enumerate(roots):
            x = X[s * n : (s + 1) * n]
            x[:] = self.across[s, :, :columns]
            _trsm(1.0, root.T, x.T, side=1, lower=0, overwrite_b=1)  # in place: x ← L⁻¹ x
        G = _syrk(-1.0, X.T, beta=1.0, c=G, lower=1, overwrite_c=1)
        of_A = 2.0 * np.log(np.diagonal(roots, axis1=1, axis2=2)).sum(1)
        return Gram(_both_halves(G), float(self.weight @ (of_A + prior.logdet(self.rows))))


@dataclass(frozen=True)
class Gram:
    """G [N, N] = Σ_s w_s E_sᵀ C_s⁻¹ E_s, and `volume` Σ_s w_s (log|C_s| - log|C₀|)."""

    G: np.ndarray
    volume: float


def _both_halves(lower: np.ndarray) -> np.ndarray:
    """A symmetric matrix from its lower half, with zeros above that."""
    whole = lower + lower.T
    whole[np.diag_indices(len(whole))] *= 0.5
    return whole


def part_pass(
    linear: Linear, process_noise: ProcessNoise, rows: np.ndarray, unit: np.ndarray,
    weight: np.ndarray, accelerations: Accelerations | None = None,
) -> PartPass:  # fmt: skip
    """One part: the segments `rows` of a campaign's or a trial's, with weights w [S] of them all.

    process_noise  instruments and start
    unit           of the numbers and weights [C + W]

    Raises np.linalg.LinAlgError where the path diverged.
    """
    own, w = linear.pick(rows), weight[rows]
    weighed = likelihood.weighed(own, process_noise, w)
    kk, kd, Y = likelihood.start_of(weighed, process_noise)
    logdet = weighed.logdet + likelihood.log_volume_of_start(weighed, process_noise)
    Y = (np.sqrt(w)[:, None, None] * Y).reshape(-1, Y.shape[-1])
    EtE = weighed.dd - Y.T @ Y  # Σ_s w_s Eᵀ C₀⁻¹ E
    kept = w > 0.0
    if not kept.all():
        rows, w, kk, kd = rows[kept], w[kept], kk[kept], kd[kept]
    phi = np.zeros((len(w), kk.shape[-1], 0))
    if accelerations is not None:
        phi = accelerations(own.cut)[kept] if callable(accelerations) else accelerations[rows]
    root = np.sqrt(w)[:, None, None]
    across = np.concatenate((kd, kk @ phi), -1)
    across *= root * np.concatenate(([1.0], unit))
    phi = root * unit[kd.shape[-1] - 1 :] * phi
    T = np.zeros((1 + len(unit),) * 2)
    size = len(EtE)
    by = np.concatenate(([1.0], unit[: size - 1]))
    T[:size, :size] = np.tril(EtE * np.outer(by, by))
    if size < len(T):
        T[size:] = np.tril(np.tensordot(phi, across, ((0, 1), (0, 1))), size)
    return PartPass(T, across, kk, w, rows, logdet)


def passes(
    linear: Linear, process_noise: ProcessNoise, parts: Sequence[np.ndarray], unit: np.ndarray,
    weight: np.ndarray | None = None, accelerations: Accelerations | None = None,
) -> Iterator[PartPass]:  # fmt: skip
    """`part_pass` of each part, one after the other; weights of one unless given."""
    weight = np.ones(len(linear.e)) if weight is None else weight
    for rows in parts:
        yield part_pass(linear, process_noise, rows, unit, weight, accelerations)


def whole(
    linear: Linear, process_noise: ProcessNoise, unit: np.ndarray,
    weight: np.ndarray | None = None, accelerations: Accelerations | None = None,
) -> Gram:  # fmt: skip
    """G of all segments, and the whole of Σ_s w_s log|C_s|, log|C₀| included. Added as they are
    made, AT_A_TIME segments."""
    count = len(linear.e)
    parts = np.array_split(np.arange(count), max(-(-count // AT_A_TIME), 1))
    prior = process_noise.inverse_kernels((linear.z.shape[-1] - 6) // 3)
    total, volume = np.zeros((1 + len(unit),) * 2), 0.0
    for one in passes(linear, process_noise, parts, unit, weight, accelerations):
        of = one.gram(prior)
        total += of.G
        volume += of.volume + one.logdet
    return Gram(total, volume)
