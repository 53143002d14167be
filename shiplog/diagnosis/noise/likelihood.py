"""Likelihood of every hypothesis from one pass of sensitivities over the segments.

    e_s = J_s d + Z_s z_s + ε_s,  ε_s ~ N(0, R),  z_s = (δξ, a) ~ N(0, P),  P = diag(P₀, λ² Q)

The start is free. The acceleration is process noise: an Ornstein-Uhlenbeck process whose standard
deviation is estimated from the nominal campaign (Kennedy & O'Hagan 2001). Both are eliminated
segment by segment, the start here; the acceleration leaves one small matrix over [e | J]
(`part_products`):

    G_s = [e | J]ᵀ C_s⁻¹ [e | J],   C_s = R + Z_s P Z_sᵀ

Instrument noise is correlated from one observation to the next. Treated as white, it would imitate
causes and make intervals too narrow. Symbols as in the room's opening; E stands for [e | J], Z₀ and
Zₐ for the columns of Z by the start and by the acceleration at the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.simulation.kernel import bordered_roots
from shiplog.voyages.rows.timescale import BIN, NODE_STEP

INTERMITTENT_TIME_S = 12.0  # s, of an intermittent force on a three-metre ship: several bins


@dataclass(frozen=True)
class ProcessNoise:
    """Standard deviations and correlation times of instrument noise and process noise.

    noise   [6]  of one observation (a mean over `bin` s), channels.STATE; of its variance a share
                 `coloured` [6] lasts, and fades within `fade` [6] s
    acceleration   [3]  of the process noise [m/s², m/s², rad/s²]
    time         its correlation time, s
    start   [6]  of the initial state, before any data
    intermittent   [3]  acceleration of an intermittent force, of correlation time
                   `intermittent_time` [s]
    runs    [S, J, J]  of a force that is on or off: 1 where it is on at both nodes of a segment, in
                   one run, and 0 elsewhere; None where it may act at any time
    bin, node_step    s of one observation, and between the nodes of the acceleration
    """

    noise: np.ndarray
    acceleration: np.ndarray
    time: float
    start: np.ndarray
    intermittent: np.ndarray | None = None
    intermittent_time: float = INTERMITTENT_TIME_S
    runs: np.ndarray | None = None
    coloured: np.ndarray = field(default_factory=lambda: np.zeros(6))
    fade: np.ndarray = field(default_factory=lambda: np.ones(6))
    bin: float = BIN
    node_step: float = NODE_STEP

    def kernel(self, nodes: int) -> np.ndarray:
        """Q = diag(q²) ⊗ T(τ) + p pᵀ ⊗ (on ∘ T(τ_p)),  Tᵢⱼ(τ) = exp(-|tᵢ - tⱼ|/τ).

        Covariance [3J, 3J] of the acceleration at J = `nodes` nodes, channel by channel; with a
        force that is on or off [S, 3J, 3J].

        q   `acceleration` [3]   p   `intermittent` [3]   on   `runs` [S, J, J]
        """
        t = self.node_step * np.arange(nodes)
        Q = np.kron(np.diag(self.acceleration**2), decay(t, self.time))
        if self.intermittent is None:
            return Q
        ppT = np.outer(self.intermittent, self.intermittent)
        T = decay(t, self.intermittent_time)
        if self.runs is None:
            return Q + np.kron(ppT, T)
        each = np.einsum("ab,sij->saibj", ppT, self.runs * T)
        return Q + each.reshape(len(each), *Q.shape)

    def inverse_kernels(self, nodes: int) -> InverseKernels:
        """Q⁻¹ and log|Q|, once for all segments in which a force is on and off alike. Raises
        np.linalg.LinAlgError where Q is not positive definite."""
        alike, which = self, None
        if self.intermittent is not None and self.runs is not None:
            patterns = np.packbits(self.runs.reshape(len(self.runs), -1) != 0.0, axis=1)
            _, first, which = np.unique(patterns, axis=0, return_index=True, return_inverse=True)
            alike, which = replace(self, runs=self.runs[first]), which.reshape(-1)
        Q = alike.kernel(nodes)
        Q = Q if Q.ndim == 3 else Q[None]
        logdet = 2.0 * np.log(np.diagonal(np.linalg.cholesky(Q), axis1=1, axis2=2)).sum(1)
        return InverseKernels(np.linalg.inv(Q), logdet, which)

    def times(self, factor: float) -> ProcessNoise:
        """λ² Q: the same with standard deviations λ q."""
        return replace(self, acceleration=self.acceleration * factor)

    def precision(self, nodes: int) -> np.ndarray:
        """P⁻¹ = diag(P₀⁻¹, Q⁻¹) of z [6 + 3J, 6 + 3J]; with a force that is on or off one of each
        segment. Raises np.linalg.LinAlgError where Q is singular."""
        size, Q_inverse = 6 + 3 * nodes, np.linalg.inv(self.kernel(nodes))
        P_inverse = np.zeros((*Q_inverse.shape[:-2], size, size))
        P_inverse[..., :6, :6] = np.diag(self.start**-2.0)
        P_inverse[..., 6:, 6:] = Q_inverse
        return P_inverse


@dataclass(frozen=True)
class InverseKernels:
    """Q⁻¹ [U, 3J, 3J] of U different segments, log|Q| [U], and `which` [S] of them each segment
    has; None where all have the first."""

    inverse: np.ndarray
    volume: np.ndarray
    which: np.ndarray | None

    def of(self, rows: np.ndarray) -> np.ndarray:
        """Q⁻¹ of some segments [s, 3J, 3J], or of one for all [3J, 3J]."""
        return self.inverse[0] if self.which is None else self.inverse[self.which[rows]]

    def logdet(self, rows: np.ndarray) -> np.ndarray:
        """log|Q| of some segments [s]."""
        if self.which is None:
            return np.full(len(rows), self.volume[0])
        return self.volume[self.which[rows]]


def decay(at: np.ndarray, time: float) -> np.ndarray:
    """Tᵢⱼ = exp(-|tᵢ - tⱼ|/τ) + 10⁻⁹ δᵢⱼ [J, J]: correlation of an Ornstein-Uhlenbeck process at
    the times `at` [J] with the correlation time τ, both in s. The last term keeps T invertible."""
    return np.exp(-np.abs(at[:, None] - at) / time) + 1e-9 * np.eye(len(at))


def correlation_of_noise(share: float, fade: float, at: np.ndarray) -> np.ndarray:
    """Γᵢₖ = (1 - ρ) δᵢₖ + ρ exp(-|tᵢ - tₖ|/τ) [B, B]: correlation of instrument noise at the times
    `at` [B], s, of which a `share` ρ lasts and fades within `fade` τ, s."""
    apart = np.abs(np.subtract.outer(at, at))
    return (1.0 - share) * np.eye(len(at)) + share * np.exp(-apart / fade)


class Whitening:
    """R^-½: observations in units in which their noise is white and of unit size.

    In each channel c of a segment R = σ_c² Γ over the bins that were measured, Γ = L Lᵀ, and
    R^-½ = L⁻¹/σ_c; rows of bins without a measurement are zero. `logdet` is log|R| of all.
    """

    def __init__(self, used: np.ndarray, process_noise: ProcessNoise) -> None:
        """used   [S, B, 6] bool: rows without a measurement do not count"""
        bins = used.shape[1]
        at = process_noise.bin * np.arange(bins)
        self.by: list[np.ndarray] = []  # [S, B, B] of each channel
        self.logdet = 2.0 * float((used * np.log(process_noise.noise)).sum())
        alike = bool((used == used[..., :1]).all())  # what is measured is measured in all channels
        for channel in range(6):
            if channel == 0 or not alike:
                patterns, of = np.unique(used[..., channel], axis=0, return_inverse=True)
            correlation = correlation_of_noise(
                process_noise.coloured[channel], process_noise.fade[channel], at
            )
            roots = np.zeros((len(patterns), bins, bins))
            for root, pattern in zip(roots, patterns, strict=True):
                known = np.ix_(pattern, pattern)
                root[known] = np.linalg.inv(np.linalg.cholesky(correlation[known]))
            each = roots[of.reshape(-1)]
            diagonal = np.diagonal(each, axis1=1, axis2=2)[used[..., channel]]
            self.logdet -= 2.0 * float(np.log(diagonal).sum())
            self.by.append(each / process_noise.noise[channel])

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """R^-½ X of X [S, B, 6, n], as [S, 6 B, n], channel by channel."""
        return np.concatenate([by @ values[:, :, c] for c, by in enumerate(self.by)], axis=1)


@dataclass(frozen=True)
class Weighed:
    """Products of one pass under one instrument noise R, before the process noise is included.

    dd      [S, 1 + C, 1 + C]        Eᵀ R⁻¹ E,  E = [e | J]; of a sum Σ w Eᵀ R⁻¹ E [1 + C, 1 + C]
    zd      [S, 6 + 3J, 1 + C]       Zᵀ R⁻¹ E
    zz      [S, 6 + 3J, 6 + 3J]      Zᵀ R⁻¹ Z
    logdet  log|R|, over the observations used
    nodes   J, number of nodes
    """

    dd: np.ndarray
    zd: np.ndarray
    zz: np.ndarray
    logdet: float
    nodes: int


def weighed(
    linear: Linear, process_noise: ProcessNoise, weight: np.ndarray | None = None
) -> Weighed:
    """Eᵀ R⁻¹ E, Zᵀ R⁻¹ E, Zᵀ R⁻¹ Z of every segment, and log|R| (first elimination). With weights w
    [S], Σ_s w_s Eᵀ R⁻¹ E alone, without making each."""
    white = Whitening(linear.cut.used, process_noise)
    E = white(np.concatenate((linear.e[..., None], linear.j), -1))
    Z = white(linear.z)
    Zt = np.swapaxes(Z, 1, 2)
    zd, zz, nodes = Zt @ E, Zt @ Z, (Z.shape[-1] - 6) // 3
    if weight is None:
        dd = np.swapaxes(E, 1, 2) @ E
    else:
        E *= np.sqrt(weight)[:, None, None]
        rows = E.reshape(-1, E.shape[-1])
        dd = rows.T @ rows  # of a matrix and its own transpose numpy makes one half
    return Weighed(dd, zd, zz, white.logdet, nodes)


@dataclass(frozen=True)
class Startless:
    """A pass without its starts, whatever is known of the acceleration at the nodes: products in
    C₀⁻¹, C₀ = R + Z₀ P₀ Z₀ᵀ.

    dd      [S, 1 + C, 1 + C]  Eᵀ C₀⁻¹ E,  E = [e | J]
    kd      [S, 3J, 1 + C]     Zₐᵀ C₀⁻¹ E
    kk      [S, 3J, 3J]        Zₐᵀ C₀⁻¹ Zₐ
    logdet  log|R| + log|F + P₀⁻¹| - log|F|, of noise and start
    """

    dd: np.ndarray
    kd: np.ndarray
    kk: np.ndarray
    logdet: float

    def square(self, process_noise: ProcessNoise) -> tuple[np.ndarray, float]:
        """eᵀ C⁻¹ e of every segment [S], of a pass of e alone, and Σ log|C|, where
        log|C| = log|C₀| + log|Q| + log|A|, A = Zₐᵀ C₀⁻¹ Zₐ + Q⁻¹. Raises np.linalg.LinAlgError
        where a matrix is not positive definite."""
        prior = process_noise.inverse_kernels(self.kk.shape[-1] // 3)
        every = np.arange(len(self.kk))
        each, logs = bordered_roots.roots(self._packed, prior.inverse, prior.which)
        return each, self.logdet + float((logs + prior.logdet(every)).sum())

    @cached_property
    def _packed(self) -> bordered_roots.Packed:
        """What hundreds of evaluations of a noise have in common."""
        return bordered_roots.packed(self.kk, self.kd[..., 0], self.dd[:, 0, 0])


def startless(weighed: Weighed, process_noise: ProcessNoise) -> Startless:
    """Second elimination, of the start (`start_of`). Raises np.linalg.LinAlgError where the path
    diverged."""
    kk, kd, Y = start_of(weighed, process_noise)
    dd = weighed.dd - np.swapaxes(Y, 1, 2) @ Y
    logdet = weighed.logdet + log_volume_of_start(weighed, process_noise)
    return Startless(dd, kd, kk, logdet)


def start_of(
    weighed: Weighed, process_noise: ProcessNoise
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What eliminates the start: with F = Z₀ᵀ R⁻¹ Z₀ and F + P₀⁻¹ = L Lᵀ, of X = (E | Zₐ)

        Y = L⁻¹ Z₀ᵀ R⁻¹ X,   Xᵀ C₀⁻¹ X = Xᵀ R⁻¹ X - Yᵀ Y

    as Zₐᵀ C₀⁻¹ Zₐ [S, 3J, 3J], Zₐᵀ C₀⁻¹ E [S, 3J, 1 + C], and Y_E [S, 6, 1 + C]. Raises
    np.linalg.LinAlgError where the path diverged."""
    if not (np.isfinite(weighed.zz).all() and np.isfinite(weighed.dd).all()):
        raise np.linalg.LinAlgError("the path diverged: it has no products")
    A = weighed.zz[:, :6, :6] + np.diag(process_noise.start**-2.0)  # F + P₀⁻¹
    # in units of each number of the start, or its columns are too unlike to invert
    unit = np.diagonal(A, axis1=1, axis2=2) ** -0.5
    L = np.linalg.cholesky(A * unit[:, :, None] * unit[:, None, :])
    by = np.linalg.inv(L) * unit[:, None, :]
    Y_a, Y_E = by @ weighed.zz[:, :6, 6:], by @ weighed.zd[:, :6]
    Yt = np.swapaxes(Y_a, 1, 2)
    return weighed.zz[:, 6:, 6:] - Yt @ Y_a, weighed.zd[:, 6:] - Yt @ Y_E, Y_E


def log_volume_of_start(weighed: Weighed, process_noise: ProcessNoise) -> float:
    """Σ_s log|F + P₀⁻¹| - log|F|, F = Z₀ᵀ R⁻¹ Z₀ [S, 6, 6]; 10⁻⁹ P₀⁻¹ keeps F invertible."""
    # Restricted likelihood (Patterson & Thompson 1971): how far a model lets a start be felt is
    # no evidence, and a ship with less damping would be punished for it, segment by segment.
    F, P0_inverse = weighed.zz[:, :6, :6], np.diag(process_noise.start**-2.0)
    each = np.linalg.slogdet(F + P0_inverse)[1] - np.linalg.slogdet(F + 1e-9 * P0_inverse)[1]
    return float(each.sum())


def whitened_posterior(
    z: np.ndarray, left: np.ndarray, process_noise: ProcessNoise
) -> tuple[np.ndarray, np.ndarray]:
    """z | r ~ N(V Zᵀ r, V),  V = (Zᵀ Z + P⁻¹)⁻¹: mean [S, 6 + 3J, 1] and covariance of start and
    accelerations, of the columns Z [S, 6B, 6 + 3J] and the error r = `left` [S, 6B, 1], both white.
    Raises np.linalg.LinAlgError where the matrix is singular."""
    Zt = np.swapaxes(z, 1, 2)
    V = np.linalg.inv(Zt @ z + process_noise.precision((z.shape[-1] - 6) // 3))
    return V @ (Zt @ left), V


def starts_and_accelerations(
    linear: Linear, d: np.ndarray, process_noise: ProcessNoise
) -> tuple[np.ndarray, np.ndarray]:
    """z | e, d ~ N(V Zᵀ R⁻¹ (e - J d), V),  V = (Zᵀ R⁻¹ Z + P⁻¹)⁻¹: mean [S, 6 + 3J] and covariance
    of every segment, the numbers d [C], SI, given."""
    white = Whitening(linear.cut.used, process_noise)
    r = white((linear.e - linear.j @ d)[..., None])
    z, V = whitened_posterior(white(linear.z), r, process_noise)
    return z[..., 0], V
