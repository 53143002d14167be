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

from shiplog.diagnosis.linear_segments import Linear
from shiplog.voyages.timescale import BIN, KNOT

# Of the noise's variance, that may be coloured.
COLOURED_SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95)
FADES = (1.0, 2.0, 4.0, 8.0, 16.0)  # s, in which that may fade
INTERMITTENT_TIME_S = 12.0  # s, of an intermittent force on a three-metre ship: several bins
LEAP = 16.0  # steps at once, at most
ENOUGH_SEGMENTS = 8  # unbroken segments, fewer of which do not show it
LEAST_NOISE = np.array([1e-3, 5e-4, 1e-3, 5e-4, 1e-4, 1e-4])  # of the noise: m, m/s, rad, rad/s


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
    bin, knot    s of one observation, and between the nodes of the acceleration
    """

    noise: np.ndarray
    acceleration: np.ndarray
    time: float
    start: np.ndarray
    intermittent: np.ndarray | None = None
    intermittent_time: float = INTERMITTENT_TIME_S
    coloured: np.ndarray = field(default_factory=lambda: np.zeros(6))
    fade: np.ndarray = field(default_factory=lambda: np.ones(6))
    bin: float = BIN
    knot: float = KNOT

    def kernel(self, knots: int) -> np.ndarray:
        """Covariance [3J, 3J] of the acceleration at the knots, channel by channel."""
        apart = self.knot * np.arange(knots)
        whole = np.kron(np.diag(self.acceleration**2), _decay(apart, self.time))
        if self.intermittent is not None:
            whole += np.kron(
                np.outer(self.intermittent, self.intermittent),
                _decay(apart, self.intermittent_time),
            )
        return whole

    def times(self, factor: float) -> ProcessNoise:
        return replace(self, acceleration=self.acceleration * factor)

    def precision(self, knots: int) -> np.ndarray:
        """Of z [Z, Z]."""
        size = 6 + 3 * knots
        whole = np.zeros((size, size))
        whole[:6, :6] = np.diag(self.start**-2.0)
        whole[6:, 6:] = np.linalg.inv(self.kernel(knots))
        return whole


def _decay(at: np.ndarray, time: float) -> np.ndarray:
    """Correlation [J, J] of an Ornstein-Uhlenbeck process at knots at these times [J]."""
    return np.exp(-np.abs(at[:, None] - at) / time) + 1e-9 * np.eye(len(at))


def _correlation(share: float, fade: float, at: np.ndarray) -> np.ndarray:
    """[B, B] of noise at these times [B] of which a share lasts, as an Ornstein-Uhlenbeck process
    does."""
    apart = np.abs(np.subtract.outer(at, at))
    return (1.0 - share) * np.eye(len(at)) + share * np.exp(-apart / fade)


class _Whitening:
    """Observations in units in which their noise is white and of unit size."""

    def __init__(self, used: np.ndarray, process_noise: ProcessNoise) -> None:
        """used   [S, B, 6] bool: rows without a measurement do not count"""
        bins = used.shape[1]
        at = process_noise.bin * np.arange(bins)
        self.by: list[np.ndarray] = []  # [S, B, B] of each channel
        self.logdet = 2.0 * float((used * np.log(process_noise.noise)).sum())
        for channel in range(6):
            patterns, of = np.unique(used[..., channel], axis=0, return_inverse=True)
            correlation = _correlation(
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
    white = _Whitening(linear.cut.used, process_noise)
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
        of_kernel = len(self.kk) * np.linalg.slogdet(kernel)[1]
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
    felt, axes = np.linalg.eigh(root.T @ left.kk @ root)
    across = np.swapaxes(axes, 1, 2)
    return Modes(
        left.dd, across @ (root.T @ left.kd), np.maximum(felt, 0.0),
        across @ np.linalg.inv(root), left.logdet, np.zeros((*felt.shape, 0)),
    )  # fmt: skip


def _of_start(weighed: Weighed, known: np.ndarray) -> float:
    # Restricted likelihood (Patterson & Thompson 1971): how far a model lets a start be felt is
    # no evidence, and a ship with less damping would be punished for it, segment by segment.
    felt = weighed.zz[:, :6, :6]
    of = np.linalg.slogdet(felt + known)[1] - np.linalg.slogdet(felt + 1e-9 * known)[1]
    return float(of.sum())


def learnt(
    linear: Linear, d: np.ndarray, process_noise: ProcessNoise, rounds: int = 4
) -> ProcessNoise:
    """Instrument and process noise that fit the residuals of d, by expectation-maximisation
    (Dempster et al. 1977). Of three steps a round, the first two give the length of the third
    (SQUAREM, Varadhan & Roland 2008). The colour of the noise is estimated once, at the end.

    d   [C] the numbers of the columns
    """
    left = (linear.e - linear.j @ d)[..., None]
    products = _by_channel(linear, left, process_noise)
    counted = np.maximum(linear.cut.used.sum((0, 1)), 1)
    knots = (linear.z.shape[-1] - 6) // 3
    inverse = np.linalg.inv(_decay(process_noise.knot * np.arange(knots), process_noise.time))
    least = np.log(np.concatenate((LEAST_NOISE, np.full(3, 1e-12))))

    def at(sizes: np.ndarray) -> ProcessNoise:
        return replace(process_noise, noise=np.exp(sizes[:6]), acceleration=np.exp(sizes[6:]))

    def step(sizes: np.ndarray) -> np.ndarray:
        """Logarithms of instrument and process noise [9] after one step."""
        now = at(sizes)
        whole = np.tensordot(now.noise**-2.0, products, 1)
        covariance = np.linalg.inv(whole[:, 1:, 1:] + now.precision(knots))
        gap = covariance @ whole[:, 1:, :1]
        gap = np.concatenate((np.ones((len(gap), 1, 1)), -gap), 1)  # of [e | Z], what z leaves
        second = gap @ np.swapaxes(gap, 1, 2)
        second[:, 1:, 1:] += covariance
        noise = products.reshape(6, -1) @ second.reshape(-1) / counted
        accelerations = second[:, 7:, 7:].mean(0).reshape(3, knots, 3, knots)
        acceleration = np.einsum("ij,cicj->c", inverse, accelerations) / knots
        return np.maximum(0.5 * np.log(np.concatenate((noise, acceleration))), least)

    sizes = np.log(np.concatenate((process_noise.noise, process_noise.acceleration)))
    for _ in range(rounds):
        one = step(sizes)
        two = step(one)
        first, second = one - sizes, two - one
        bend = float(np.linalg.norm(second - first))
        leap = float(np.clip(np.linalg.norm(first) / max(bend, 1e-12), 1.0, LEAP))
        sizes = step(sizes + 2.0 * leap * first + leap**2 * (second - first))
    return _coloured(linear, left, at(sizes))


def _by_channel(linear: Linear, left: np.ndarray, process_noise: ProcessNoise) -> np.ndarray:
    """Products [6, S, 1 + Z, 1 + Z] of [error | Z] in each channel alone, were its noise of unit
    size: what its size is changes but their weight."""
    by = _Whitening(linear.cut.used, replace(process_noise, noise=np.ones(6))).by
    both = np.concatenate((left, linear.z), -1)
    white = (each @ both[:, :, channel] for channel, each in enumerate(by))
    return np.stack([np.swapaxes(values, 1, 2) @ values for values in white])


def _posterior(
    z: np.ndarray, left: np.ndarray, process_noise: ProcessNoise
) -> tuple[np.ndarray, np.ndarray]:
    """Mean [S, Z, 1] and covariance [S, Z, Z] of start and knots, of columns and error in white."""
    zt = np.swapaxes(z, 1, 2)
    covariance = np.linalg.inv(zt @ z + process_noise.precision((z.shape[-1] - 6) // 3))
    return covariance @ (zt @ left), covariance


def _coloured(linear: Linear, left: np.ndarray, process_noise: ProcessNoise) -> ProcessNoise:
    """With the most probable colour of each channel's noise, from the second moments of complete
    stretches; its standard deviation follows."""
    used = linear.cut.used
    whole = used.all((1, 2))
    if whole.sum() < ENOUGH_SEGMENTS:
        return process_noise
    z, error = linear.z[whole], left[whole]
    white = _Whitening(used[whole], process_noise)
    mean, covariance = _posterior(white(z), white(error), process_noise)
    bins = used.shape[1]
    noise, coloured, fade = (
        process_noise.noise.copy(),
        process_noise.coloured.copy(),
        process_noise.fade.copy(),
    )
    for channel in range(6):
        columns = z[:, :, channel]
        gap = error[:, :, channel] - columns @ mean
        second = gap[..., 0].T @ gap[..., 0]
        second += (columns @ covariance @ np.swapaxes(columns, 1, 2)).sum(0)
        best = np.inf
        for share in COLOURED_SHARES:
            for time in FADES if share > 0.0 else FADES[:1]:
                correlation = _correlation(share, time, process_noise.bin * np.arange(bins))
                variance = np.trace(np.linalg.solve(correlation, second)) / (bins * len(gap))
                cost = np.linalg.slogdet(correlation)[1] + bins * np.log(variance)
                if cost < best:
                    best, coloured[channel], fade[channel] = cost, share, time
                    noise[channel] = np.sqrt(variance)
    return replace(
        process_noise, noise=np.maximum(noise, LEAST_NOISE), coloured=coloured, fade=fade
    )


def starts_and_knots(
    linear: Linear, d: np.ndarray, process_noise: ProcessNoise
) -> tuple[np.ndarray, np.ndarray]:
    """z [S, Z] of every segment and its covariance [S, Z, Z], the numbers d [C] given."""
    white = _Whitening(linear.cut.used, process_noise)
    left = white((linear.e - linear.j @ d)[..., None])
    z, covariance = _posterior(white(linear.z), left, process_noise)
    return z[..., 0], covariance
