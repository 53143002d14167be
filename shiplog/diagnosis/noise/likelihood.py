"""Likelihood of every hypothesis from one pass of sensitivities over the segments.

    e_s = Z_s z_s + J_s d + ε,  ε ~ N(0, R),  z = (start, acceleration at the nodes)

The start is free. The acceleration is process noise: an Ornstein-Uhlenbeck process whose standard
deviation is estimated from the nominal campaign (Kennedy & O'Hagan 2001). Both are eliminated
segment by segment, which leaves one small matrix over [e | J]. Instrument noise is correlated from
one observation to the next. Treated as white, it would imitate causes and make intervals too
narrow.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.voyages.rows.timescale import BIN, KNOT

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
    runs    [S, J, J]  of a force that is on or off: 1 where it is on at both knots of a segment, in
                   one run, and 0 elsewhere; None where it may act at any time
    bin, knot    s of one observation, and between the nodes of the acceleration
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
    knot: float = KNOT

    def kernel(self, knots: int) -> np.ndarray:
        """Covariance [3J, 3J] of the acceleration at the knots, channel by channel; with a force
        that is on or off [S, 3J, 3J]."""
        apart = self.knot * np.arange(knots)
        whole = np.kron(np.diag(self.acceleration**2), decay(apart, self.time))
        if self.intermittent is None:
            return whole
        force = np.outer(self.intermittent, self.intermittent)
        lasts = decay(apart, self.intermittent_time)
        if self.runs is None:
            return whole + np.kron(force, lasts)
        each = np.einsum("ab,sij->saibj", force, self.runs * lasts)
        return whole + each.reshape(len(each), *whole.shape)

    def times(self, factor: float) -> ProcessNoise:
        return replace(self, acceleration=self.acceleration * factor)

    def precision(self, knots: int) -> np.ndarray:
        """Of z [Z, Z]; with a force that is on or off [S, Z, Z]."""
        size, known = 6 + 3 * knots, np.linalg.inv(self.kernel(knots))
        whole = np.zeros((*known.shape[:-2], size, size))
        whole[..., :6, :6] = np.diag(self.start**-2.0)
        whole[..., 6:, 6:] = known
        return whole


def decay(at: np.ndarray, time: float) -> np.ndarray:
    """Correlation [J, J] of an Ornstein-Uhlenbeck process at these times [J], s, that fades within
    `time`, s."""
    return np.exp(-np.abs(at[:, None] - at) / time) + 1e-9 * np.eye(len(at))


def correlation_of_noise(share: float, fade: float, at: np.ndarray) -> np.ndarray:
    """[B, B] of noise at these times [B], s, of which a share lasts, as an Ornstein-Uhlenbeck
    process does, and fades within `fade`, s."""
    apart = np.abs(np.subtract.outer(at, at))
    return (1.0 - share) * np.eye(len(at)) + share * np.exp(-apart / fade)


class Whitening:
    """Observations in units in which their noise is white and of unit size."""

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
        """[S, B, 6, n] → [S, 6 B, n]"""
        return np.concatenate([by @ values[:, :, c] for c, by in enumerate(self.by)], axis=1)


@dataclass(frozen=True)
class Weighed:
    """Products of one pass under one instrument noise R, before the process noise is included.

    dd      [S, 1 + C, 1 + C]  of [e | J]
    zd      [S, Z, 1 + C]
    zz      [S, Z, Z]
    logdet  of R, over the observations used
    """

    dd: np.ndarray
    zd: np.ndarray
    zz: np.ndarray
    logdet: float
    knots: int


def weighed(linear: Linear, process_noise: ProcessNoise) -> Weighed:
    white = Whitening(linear.cut.used, process_noise)
    d = white(np.concatenate((linear.e[..., None], linear.j), -1))
    z = white(linear.z)
    zt = np.swapaxes(z, 1, 2)
    knots = (z.shape[-1] - 6) // 3
    return Weighed(np.swapaxes(d, 1, 2) @ d, zt @ d, zt @ z, white.logdet, knots)


@dataclass(frozen=True)
class Gram:
    """[e | J]ᵀ C⁻¹ [e | J] of every segment [S, 1 + C, 1 + C], and log |C| of all, restricted to
    what no start explains."""

    each: np.ndarray
    logdet: float

    def scaled(self, unit: np.ndarray) -> Gram:
        """Of numbers in these units [C]: matrices of numbers that differ by 1e6 do not invert."""
        by = np.concatenate(([1.0], unit))
        return Gram(self.each * np.outer(by, by), self.logdet)


@dataclass(frozen=True)
class Modes:
    """A pass without its starts, in axes that diagonalise prior and data information of the
    acceleration at the nodes. Any factor λ of the process noise is then a division.

    dd      [S, 1 + C, 1 + C]  of [e | J], the start eliminated
    md      [S, 3J, 1 + C]     of the modes with [e | J]
    felt    [S, 3J]            data information of each mode over its prior information
    axes    [S, 3J, 3J]        from accelerations at the nodes to modes
    logdet  of noise and start
    accelerations  [S, 3J, W]  modes of further columns that act as accelerations at the nodes
    """

    dd: np.ndarray
    md: np.ndarray
    felt: np.ndarray
    axes: np.ndarray
    logdet: float
    accelerations: np.ndarray

    def joined(self, accelerations: np.ndarray) -> Modes:
        """With W columns more, of accelerations [S, 3J, W] at the knots."""
        return replace(
            self, accelerations=np.concatenate((self.accelerations, self.axes @ accelerations), -1)
        )

    def first(self, columns: int) -> Modes:
        """With that many of its C + W columns, C at least."""
        more = columns + 1 - self.dd.shape[-1]
        return replace(self, accelerations=self.accelerations[..., :more])

    def total(self, weight: np.ndarray, noise_factor: float = 1.0) -> np.ndarray:
        """[1 + C + W, 1 + C + W] sum of `gram`'s matrices, weighted [S], without making each of
        them."""
        part = np.sqrt(weight[:, None] / (self.felt + noise_factor**-2.0))[..., None]
        flat = (self.md * part).reshape(-1, self.md.shape[-1])
        total = np.tensordot(weight, self.dd, 1) - flat.T @ flat
        if not self.accelerations.shape[-1]:
            return total
        # the effect of such a column, less the part that process noise explains
        more = (self.accelerations * part).reshape(-1, self.accelerations.shape[-1])
        across = noise_factor**-2.0 * (more.T @ flat)
        more *= np.sqrt(self.felt).reshape(-1, 1) / noise_factor
        return np.block([[total, across.T], [across, more.T @ more]])

    def gram(self, noise_factor: float = 1.0) -> Gram:
        bent = self.felt[..., None] * self.accelerations
        across = np.swapaxes(self.md, 1, 2) @ self.accelerations
        dd = np.block([
            [self.dd, across],
            [np.swapaxes(across, 1, 2), np.swapaxes(self.accelerations, 1, 2) @ bent],
        ])  # fmt: skip
        md = np.concatenate((self.md, bent), -1)
        part = md / (self.felt + noise_factor**-2.0)[..., None]
        return Gram(dd - np.swapaxes(md, 1, 2) @ part, self.log_volume(noise_factor))

    def log_volume(self, noise_factor: float = 1.0, weight: np.ndarray | None = None) -> float:
        """log |C| of all segments, by itself; of the noise that a factor changes, each segment with
        its weight [S]."""
        each = np.log1p(noise_factor**2 * self.felt).sum(-1)
        return self.logdet + float(each.sum() if weight is None else weight @ each)


@dataclass(frozen=True)
class Startless:
    """A pass without its starts, whatever is known of the acceleration at the knots.

    dd      [S, 1 + C, 1 + C]  of [e | J]
    kd      [S, 3J, 1 + C]
    kk      [S, 3J, 3J]
    logdet  of noise and start
    """

    dd: np.ndarray
    kd: np.ndarray
    kk: np.ndarray
    logdet: float

    def square(self, process_noise: ProcessNoise) -> tuple[np.ndarray, float]:
        """Of a pass of e alone eᵀ C⁻¹ e of every segment [S], and log |C| of all: a Cholesky root
        ends with the one, and the rest of its diagonal is the other."""
        knots = self.kk.shape[-1]
        kernel = process_noise.kernel(knots // 3)
        bordered = np.empty((len(self.kk), knots + 1, knots + 1))
        bordered[:, :knots, :knots] = self.kk + np.linalg.inv(kernel)
        bordered[:, :knots, knots:], bordered[:, knots:, knots:] = self.kd, self.dd
        bordered[:, knots, :knots] = self.kd[..., 0]
        root = np.diagonal(np.linalg.cholesky(bordered), axis1=1, axis2=2)
        each = np.broadcast_to(np.linalg.slogdet(kernel)[1], len(self.kk))
        of_kernel = float(each.sum())
        volume = of_kernel + 2.0 * float(np.log(root[:, :knots]).sum())
        return root[:, knots] ** 2, self.logdet + volume


def startless(weighed: Weighed, process_noise: ProcessNoise) -> Startless:
    """Start eliminated. Raises np.linalg.LinAlgError where the path diverged."""
    if not (np.isfinite(weighed.zz).all() and np.isfinite(weighed.dd).all()):
        raise np.linalg.LinAlgError("the path diverged: it has no products")
    known = np.diag(process_noise.start**-2.0)
    start = weighed.zz[:, :6, :6] + known
    # in units of each number of the start, or its columns are too unlike to invert
    unit = np.diagonal(start, axis1=1, axis2=2) ** -0.5
    start = start * unit[:, :, None] * unit[:, None, :]
    columns = np.concatenate((weighed.zz[:, :6, 6:], weighed.zd[:, :6]), -1) * unit[..., None]
    solved = np.linalg.solve(start, columns)
    count = weighed.zz.shape[-1] - 6
    by_knots, by_numbers = np.swapaxes(columns[..., :count], 1, 2), columns[..., count:]
    return Startless(
        weighed.dd - np.swapaxes(by_numbers, 1, 2) @ solved[..., count:],
        weighed.zd[:, 6:] - by_knots @ solved[..., count:],
        weighed.zz[:, 6:, 6:] - by_knots @ solved[..., :count],
        weighed.logdet + _of_start(weighed, known),
    )


def modes(weighed: Weighed, process_noise: ProcessNoise) -> Modes:
    """Start eliminated, acceleration along its principal axes (Woodbury). Raises
    np.linalg.LinAlgError where the path diverged."""
    left = startless(weighed, process_noise)
    root = np.linalg.cholesky(process_noise.kernel(weighed.knots))
    turned = np.swapaxes(root, -1, -2)
    felt, axes = np.linalg.eigh(turned @ left.kk @ root)
    across = np.swapaxes(axes, 1, 2)
    return Modes(
        left.dd, across @ (turned @ left.kd), np.maximum(felt, 0.0),
        across @ np.linalg.inv(root), left.logdet, np.zeros((*felt.shape, 0)),
    )  # fmt: skip


def _of_start(weighed: Weighed, known: np.ndarray) -> float:
    # Restricted likelihood (Patterson & Thompson 1971): how far a model lets a start be felt is
    # no evidence, and a ship with less damping would be punished for it, segment by segment.
    felt = weighed.zz[:, :6, :6]
    of = np.linalg.slogdet(felt + known)[1] - np.linalg.slogdet(felt + 1e-9 * known)[1]
    return float(of.sum())


def whitened_posterior(
    z: np.ndarray, left: np.ndarray, process_noise: ProcessNoise
) -> tuple[np.ndarray, np.ndarray]:
    """Mean [S, Z, 1] and covariance [S, Z, Z] of start and knots, of columns and error in white."""
    zt = np.swapaxes(z, 1, 2)
    covariance = np.linalg.inv(zt @ z + process_noise.precision((z.shape[-1] - 6) // 3))
    return covariance @ (zt @ left), covariance


def starts_and_knots(
    linear: Linear, d: np.ndarray, process_noise: ProcessNoise
) -> tuple[np.ndarray, np.ndarray]:
    """z [S, Z] of every segment and its covariance [S, Z, Z], the numbers d [C] given."""
    white = Whitening(linear.cut.used, process_noise)
    left = white((linear.e - linear.j @ d)[..., None])
    z, covariance = whitened_posterior(white(linear.z), left, process_noise)
    return z[..., 0], covariance
