"""What the segments say of every hypothesis at once: algebra on one pass of sensitivities.

    e_s = Z_s z_s + J_s d + ε,  ε ~ N(0, R),  z = (start, acceleration at the knots)

The start is free, the acceleration is what no model of this ship explains: an Ornstein-Uhlenbeck
process whose size is learned where the model was made (Kennedy & O'Hagan 2001). Both are
eliminated segment by segment; what is left of all data is one small matrix over [e | J].
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from shiplog.segments import KNOT, Linear

LEAST = np.array([1e-3, 5e-4, 1e-3, 5e-4, 1e-4, 1e-4])  # of the noise: m, m/s, rad, rad/s


@dataclass(frozen=True)
class Unrest:
    """Sizes of what is random.

    noise   [6]  of one observation (2 s), channels.STATE
    push    [3]  of the acceleration that no model explains [m/s², m/s², rad/s²]
    time         s over which that stays
    start   [6]  how free the initial state is
    pulse   [3]  acceleration of one force that nobody records, and `pulse_time` [s]
    """

    noise: np.ndarray
    push: np.ndarray
    time: float
    start: np.ndarray
    pulse: np.ndarray | None = None
    pulse_time: float = 12.0

    def kernel(self, knots: int) -> np.ndarray:
        """Covariance [3J, 3J] of the acceleration at the knots, channel by channel."""
        whole = np.kron(np.diag(self.push**2), _decay(knots, self.time))
        if self.pulse is not None:
            whole += np.kron(np.outer(self.pulse, self.pulse), _decay(knots, self.pulse_time))
        return whole

    def louder(self, factor: float) -> Unrest:
        return replace(self, push=self.push * factor)

    def precision(self, knots: int) -> np.ndarray:
        """Of z [Z, Z]."""
        size = 6 + 3 * knots
        whole = np.zeros((size, size))
        whole[:6, :6] = np.diag(self.start**-2.0)
        whole[6:, 6:] = np.linalg.inv(self.kernel(knots))
        return whole


def _decay(knots: int, time: float) -> np.ndarray:
    """Correlation [J, J] of an Ornstein-Uhlenbeck process at the knots."""
    at = np.arange(knots) * KNOT
    return np.exp(-np.abs(at[:, None] - at) / time) + 1e-9 * np.eye(knots)


@dataclass(frozen=True)
class Weighed:
    """Products of one pass under one noise R; what depends on the push alone comes after.

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


def weighed(linear: Linear, noise: np.ndarray) -> Weighed:
    count, j = len(linear.e), linear.j
    weight = np.where(linear.cut.used, 1.0 / noise, 0.0)[..., None]
    d = (np.concatenate((linear.e[..., None], j), -1) * weight).reshape(count, -1, 1 + j.shape[-1])
    z = (linear.z * weight).reshape(count, -1, linear.z.shape[-1])
    zt = np.swapaxes(z, 1, 2)
    used = linear.cut.used
    logdet = 2.0 * float((used * np.log(noise)).sum())
    return Weighed(np.swapaxes(d, 1, 2) @ d, zt @ d, zt @ z, logdet, (z.shape[-1] - 6) // 3)


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
    """A pass without its starts, in axes in which the acceleration at the knots is independent by
    what was known of it and by what the data say: of any size λ of it, the rest is a division.

    dd      [S, 1 + C, 1 + C]  of [e | J], the start eliminated
    md      [S, 3J, 1 + C]     of the modes with [e | J]
    felt    [S, 3J]            what the data say of each mode, in units of what was known
    axes    [S, 3J, 3J]        from accelerations at the knots to modes
    logdet  of noise and start
    """

    dd: np.ndarray
    md: np.ndarray
    felt: np.ndarray
    axes: np.ndarray
    logdet: float

    def beside(self, pushed: np.ndarray) -> Modes:
        """With W columns more, of which each bends the observations as the acceleration `pushed`
        [S, 3J, W] at the knots does."""
        mode = self.axes @ pushed
        bent = self.felt[..., None] * mode
        across = np.swapaxes(self.md, 1, 2) @ mode
        count, more = self.dd.shape[-1], pushed.shape[-1]
        dd = np.empty((len(mode), count + more, count + more))
        dd[:, :count, :count] = self.dd
        dd[:, :count, count:] = across
        dd[:, count:, :count] = np.swapaxes(across, 1, 2)
        dd[:, count:, count:] = np.swapaxes(mode, 1, 2) @ bent
        return replace(self, dd=dd, md=np.concatenate((self.md, bent), -1))

    def total(self, weight: np.ndarray, louder: float = 1.0) -> np.ndarray:
        """[1 + C, 1 + C] sum of `gram`'s matrices, weighted [S], without making each of them."""
        part = np.sqrt(weight[:, None] / (self.felt + louder**-2.0))[..., None]
        flat = (self.md * part).reshape(-1, self.md.shape[-1])
        return np.tensordot(weight, self.dd, 1) - flat.T @ flat

    def gram(self, louder: float = 1.0) -> Gram:
        part = self.md / (self.felt + louder**-2.0)[..., None]
        each = self.dd - np.swapaxes(self.md, 1, 2) @ part
        return Gram(each, self.log_volume(louder))

    def log_volume(self, louder: float = 1.0) -> float:
        """log |C| of all segments, by itself."""
        return self.logdet + float(np.log1p(louder**2 * self.felt).sum())


def modes(weighed: Weighed, unrest: Unrest) -> Modes:
    """Start eliminated, acceleration along its principal axes (Woodbury)."""
    kernel = unrest.kernel(weighed.knots)
    known = np.diag(unrest.start**-2.0)
    start = weighed.zz[:, :6, :6] + known
    # in units of each number of the start, or its columns are too unlike to invert
    unit = np.diagonal(start, axis1=1, axis2=2) ** -0.5
    start = start * unit[:, :, None] * unit[:, None, :]
    columns = np.concatenate((weighed.zz[:, :6, 6:], weighed.zd[:, :6]), -1) * unit[..., None]
    solved = np.linalg.solve(start, columns)
    count = weighed.zz.shape[-1] - 6
    by_knots, by_numbers = np.swapaxes(columns[..., :count], 1, 2), columns[..., count:]
    root = np.linalg.cholesky(kernel)
    felt, axes = np.linalg.eigh(
        root.T @ (weighed.zz[:, 6:, 6:] - by_knots @ solved[..., :count]) @ root
    )
    across = np.swapaxes(axes, 1, 2)
    return Modes(
        weighed.dd - np.swapaxes(by_numbers, 1, 2) @ solved[..., count:],
        across @ (root.T @ (weighed.zd[:, 6:] - by_knots @ solved[..., count:])),
        np.maximum(felt, 0.0),
        across @ np.linalg.inv(root),
        weighed.logdet + _of_start(weighed, known),
    )


def _of_start(weighed: Weighed, known: np.ndarray) -> float:
    # Restricted likelihood (Patterson & Thompson 1971): how far a model lets a start be felt is
    # no evidence, and a ship with less damping would be punished for it, segment by segment.
    felt = weighed.zz[:, :6, :6]
    of = np.linalg.slogdet(felt + known)[1] - np.linalg.slogdet(felt + 1e-9 * known)[1]
    return float(of.sum())


def gram(weighed: Weighed, unrest: Unrest) -> Gram:
    """Start and acceleration eliminated."""
    return modes(weighed, unrest).gram()


def learnt(linear: Linear, d: np.ndarray, unrest: Unrest, rounds: int = 12) -> Unrest:
    """Noise and push that fit what d leaves: expectation-maximisation (Dempster et al. 1977).

    d   [C] the numbers of the columns
    """
    left = linear.e - linear.j @ d
    count, size = len(left), linear.z.shape[-1]
    knots = (size - 6) // 3
    used = linear.cut.used
    flat = linear.z.reshape(count, -1, size)
    for _ in range(rounds):
        weight = np.where(used, unrest.noise**-2.0, 0.0).reshape(count, -1)
        prior = unrest.precision(knots)
        zt = np.swapaxes(flat * weight[..., None], 1, 2)
        covariance = np.linalg.inv(zt @ flat + prior)
        z = (covariance @ (zt @ left.reshape(count, -1, 1)))[..., 0]
        gap = left - (flat @ z[..., None])[..., 0].reshape(left.shape)
        spread = ((flat @ covariance) * flat).sum(-1).reshape(left.shape)
        squares = np.where(used, gap**2 + spread, 0.0).sum((0, 1))
        noise = np.maximum(np.sqrt(squares / np.maximum(used.sum((0, 1)), 1)), LEAST)
        inverse = np.linalg.inv(_decay(knots, unrest.time))
        push = np.empty(3)
        for channel in range(3):
            part = slice(6 + channel * knots, 6 + (channel + 1) * knots)
            own = z[:, part]
            second = np.einsum("si,ij,sj->", own, inverse, own)
            second += np.einsum("ij,sji->", inverse, covariance[:, part, part])
            push[channel] = np.sqrt(second / (count * knots))
        unrest = replace(unrest, noise=noise, push=push)
    return unrest


def starts_and_knots(
    linear: Linear, d: np.ndarray, unrest: Unrest
) -> tuple[np.ndarray, np.ndarray]:
    """z [S, Z] of every segment and its covariance [S, Z, Z], the numbers d [C] given."""
    count, size = len(linear.e), linear.z.shape[-1]
    left = (linear.e - linear.j @ d).reshape(count, -1, 1)
    weight = np.where(linear.cut.used, unrest.noise**-2.0, 0.0).reshape(count, -1, 1)
    prior = unrest.precision((size - 6) // 3)
    z = linear.z.reshape(count, -1, size)
    zt = np.swapaxes(z * weight, 1, 2)
    covariance = np.linalg.inv(zt @ z + prior)
    return (covariance @ (zt @ left))[..., 0], covariance
