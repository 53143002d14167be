"""Likelihood of every hypothesis from one pass of sensitivities over the segments.

    e_s = J_s d + Z_s z_s + ε_s,  ε_s ~ N(0, R),  z_s = (δξ, a) ~ N(0, P),  P = diag(P₀, λ² Q)

The start is free. The acceleration is process noise: an Ornstein-Uhlenbeck process whose standard
deviation is estimated from the nominal campaign (Kennedy & O'Hagan 2001). Both are eliminated
segment by segment, which leaves one small matrix over [e | J]:

    G_s = [e | J]ᵀ C_s⁻¹ [e | J],   C_s = R + Z_s P Z_sᵀ

Instrument noise is correlated from one observation to the next. Treated as white, it would imitate
causes and make intervals too narrow. Symbols as in the room's opening; E stands for [e | J], Z₀ and
Zₐ for the columns of Z by the start and by the acceleration at the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.diagnosis.linear.linear_segments import Linear
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
        for channel in range(6):
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

    dd      [S, 1 + C, 1 + C]        Eᵀ R⁻¹ E,  E = [e | J]
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


def weighed(linear: Linear, process_noise: ProcessNoise) -> Weighed:
    """Eᵀ R⁻¹ E, Zᵀ R⁻¹ E, Zᵀ R⁻¹ Z of every segment, and log|R| (first elimination)."""
    white = Whitening(linear.cut.used, process_noise)
    E = white(np.concatenate((linear.e[..., None], linear.j), -1))
    Z = white(linear.z)
    Zt = np.swapaxes(Z, 1, 2)
    nodes = (Z.shape[-1] - 6) // 3
    return Weighed(np.swapaxes(E, 1, 2) @ E, Zt @ E, Zt @ Z, white.logdet, nodes)


@dataclass(frozen=True)
class Gram:
    """G_s = [e | J]ᵀ C_s⁻¹ [e | J] of every segment [S, 1 + C, 1 + C], and Σ log|C_s|, restricted
    to what no start explains."""

    each: np.ndarray
    logdet: float

    def scaled(self, unit: np.ndarray) -> Gram:
        """diag(1, u) G_s diag(1, u) of numbers in units u [C]: matrices of numbers that differ by
        1e6 do not invert."""
        by = np.concatenate(([1.0], unit))
        return Gram(self.each * np.outer(by, by), self.logdet)


@dataclass(frozen=True)
class Modes:
    """A pass without its starts, in axes that diagonalise prior and data information of the
    acceleration at the nodes. Any factor λ of the process noise is then a division.

    dd      [S, 1 + C, 1 + C]  Eᵀ E, white and the start eliminated; E = [e | J]
    md      [S, 3J, 1 + C]     M = Uᵀ Lᵀ Zₐᵀ E
    felt    [S, 3J]            f, data information of each mode over its prior information
    axes    [S, 3J, 3J]        Uᵀ L⁻¹, from accelerations at the nodes to modes
    logdet  log|R| + log|F + P₀⁻¹| - log|F|, of noise and start
    accelerations  [S, 3J, W]  Ψ = Uᵀ L⁻¹ Φ, modes of further columns that act as accelerations
    """

    dd: np.ndarray
    md: np.ndarray
    felt: np.ndarray
    axes: np.ndarray
    logdet: float
    accelerations: np.ndarray

    def joined(self, accelerations: np.ndarray) -> Modes:
        """With W columns more, Ψ = Uᵀ L⁻¹ Φ of accelerations Φ [S, 3J, W] at the nodes."""
        return replace(
            self, accelerations=np.concatenate((self.accelerations, self.axes @ accelerations), -1)
        )

    def first(self, columns: int) -> Modes:
        """With that many of its C + W columns, C at least."""
        more = columns + 1 - self.dd.shape[-1]
        return replace(self, accelerations=self.accelerations[..., :more])

    def total(self, weight: np.ndarray, noise_factor: float = 1.0) -> np.ndarray:
        """G = Σ_s w_s G_s(λ) [1 + C + W, 1 + C + W], without making each of `gram`'s matrices.

            G_EE = Σ_s w_s (Eᵀ E - Mᵀ D M),   D = diag(1 / (f + λ⁻²))
            G_ΨE = Σ_s w_s λ⁻² Ψᵀ D M,   G_ΨΨ = Σ_s w_s λ⁻² Ψᵀ D diag(f) Ψ

        weight         w [S] of each segment
        noise_factor   λ
        """
        root = np.sqrt(weight[:, None] / (self.felt + noise_factor**-2.0))[..., None]  # (w D)^½
        M = (self.md * root).reshape(-1, self.md.shape[-1])
        G = np.tensordot(weight, self.dd, 1) - M.T @ M
        if not self.accelerations.shape[-1]:
            return G
        # the effect of such a column, less the part that process noise explains
        Psi = (self.accelerations * root).reshape(-1, self.accelerations.shape[-1])
        across = noise_factor**-2.0 * (Psi.T @ M)
        Psi *= np.sqrt(self.felt).reshape(-1, 1) / noise_factor
        return np.block([[G, across.T], [across, Psi.T @ Psi]])

    def gram(self, noise_factor: float = 1.0) -> Gram:
        """G_s(λ) = E'ᵀ E' - M'ᵀ diag(1 / (f + λ⁻²)) M' of every segment, with the further columns:
        E'ᵀ E' = [[Eᵀ E, Mᵀ Ψ], [Ψᵀ M, Ψᵀ diag(f) Ψ]],  M' = [M | diag(f) Ψ]; and log|C|."""
        f_Psi = self.felt[..., None] * self.accelerations
        across = np.swapaxes(self.md, 1, 2) @ self.accelerations
        EtE = np.block([
            [self.dd, across],
            [np.swapaxes(across, 1, 2), np.swapaxes(self.accelerations, 1, 2) @ f_Psi],
        ])  # fmt: skip
        M = np.concatenate((self.md, f_Psi), -1)
        D_M = M / (self.felt + noise_factor**-2.0)[..., None]
        return Gram(EtE - np.swapaxes(M, 1, 2) @ D_M, self.log_volume(noise_factor))

    def log_volume(self, noise_factor: float = 1.0, weight: np.ndarray | None = None) -> float:
        """Σ_s log|C_s| = `logdet` + Σ_s w_s Σ log(1 + λ² f_s): log|C| of all segments; the part
        that the factor λ changes has each segment's weight w [S], one unless given."""
        each = np.log1p(noise_factor**2 * self.felt).sum(-1)
        return self.logdet + float(each.sum() if weight is None else weight @ each)


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
        """eᵀ C⁻¹ e of every segment [S], of a pass of e alone, and Σ log|C|.

        With A = Zₐᵀ C₀⁻¹ Zₐ + Q⁻¹ and b = Zₐᵀ C₀⁻¹ e, the last diagonal element of the Cholesky
        root of [[A, b], [bᵀ, eᵀ C₀⁻¹ e]] is (eᵀ C₀⁻¹ e - bᵀ A⁻¹ b)^½ = (eᵀ C⁻¹ e)^½; the others
        give log|A|, and log|C| = log|C₀| + log|Q| + log|A|. Raises np.linalg.LinAlgError where the
        matrix is not positive definite.
        """
        n = self.kk.shape[-1]  # 3J
        Q = process_noise.kernel(n // 3)
        bordered = np.empty((len(self.kk), n + 1, n + 1))
        bordered[:, :n, :n] = self.kk + np.linalg.inv(Q)
        bordered[:, :n, n:], bordered[:, n:, n:] = self.kd, self.dd
        bordered[:, n, :n] = self.kd[..., 0]
        root = np.diagonal(np.linalg.cholesky(bordered), axis1=1, axis2=2)
        each = np.broadcast_to(np.linalg.slogdet(Q)[1], len(self.kk))
        log_Q = float(each.sum())
        volume = log_Q + 2.0 * float(np.log(root[:, :n]).sum())
        return root[:, n] ** 2, self.logdet + volume


def startless(weighed: Weighed, process_noise: ProcessNoise) -> Startless:
    """Second elimination, of the start: X ← Xᵀ R⁻¹ X - Xᵀ R⁻¹ Z₀ (F + P₀⁻¹)⁻¹ Z₀ᵀ R⁻¹ X of
    X = (E | Zₐ), F = Z₀ᵀ R⁻¹ Z₀. Raises np.linalg.LinAlgError where the path diverged."""
    if not (np.isfinite(weighed.zz).all() and np.isfinite(weighed.dd).all()):
        raise np.linalg.LinAlgError("the path diverged: it has no products")
    P0_inverse = np.diag(process_noise.start**-2.0)
    A = weighed.zz[:, :6, :6] + P0_inverse  # F + P₀⁻¹
    # in units of each number of the start, or its columns are too unlike to invert
    unit = np.diagonal(A, axis1=1, axis2=2) ** -0.5
    A = A * unit[:, :, None] * unit[:, None, :]
    Z0_X = np.concatenate((weighed.zz[:, :6, 6:], weighed.zd[:, :6]), -1) * unit[..., None]
    A_Z0_X = np.linalg.solve(A, Z0_X)
    n = weighed.zz.shape[-1] - 6  # 3J
    Za_Z0, Z0_E = np.swapaxes(Z0_X[..., :n], 1, 2), Z0_X[..., n:]
    return Startless(
        weighed.dd - np.swapaxes(Z0_E, 1, 2) @ A_Z0_X[..., n:],
        weighed.zd[:, 6:] - Za_Z0 @ A_Z0_X[..., n:],
        weighed.zz[:, 6:, 6:] - Za_Z0 @ A_Z0_X[..., :n],
        weighed.logdet + _log_volume_of_start(weighed, P0_inverse),
    )


def modes(weighed: Weighed, process_noise: ProcessNoise) -> Modes:
    """Third elimination prepared: Q = L Lᵀ, Lᵀ (Zₐᵀ C₀⁻¹ Zₐ) L = U diag(f) Uᵀ (Woodbury), so that
    C⁻¹ = C₀⁻¹ - C₀⁻¹ Zₐ L U diag(1 / (f + λ⁻²)) Uᵀ Lᵀ Zₐᵀ C₀⁻¹ for every factor λ. Raises
    np.linalg.LinAlgError where the path diverged."""
    without_start = startless(weighed, process_noise)
    L = np.linalg.cholesky(process_noise.kernel(weighed.nodes))
    Lt = np.swapaxes(L, -1, -2)
    f, U = np.linalg.eigh(Lt @ without_start.kk @ L)
    Ut = np.swapaxes(U, 1, 2)
    return Modes(
        without_start.dd, Ut @ (Lt @ without_start.kd), np.maximum(f, 0.0),
        Ut @ np.linalg.inv(L), without_start.logdet, np.zeros((*f.shape, 0)),
    )  # fmt: skip


def _log_volume_of_start(weighed: Weighed, P0_inverse: np.ndarray) -> float:
    """Σ_s log|F + P₀⁻¹| - log|F|, F = Z₀ᵀ R⁻¹ Z₀ [S, 6, 6]; 10⁻⁹ P₀⁻¹ keeps F invertible."""
    # Restricted likelihood (Patterson & Thompson 1971): how far a model lets a start be felt is
    # no evidence, and a ship with less damping would be punished for it, segment by segment.
    F = weighed.zz[:, :6, :6]
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
