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

    def precision(self, knots: int) -> tuple[np.ndarray, float]:
        """Of z [Z, Z], and the log determinant of its knots' part."""
        kernel = self.kernel(knots)
        size = 6 + 3 * knots
        whole = np.zeros((size, size))
        whole[:6, :6] = np.diag(self.start**-2.0)
        whole[6:, 6:] = np.linalg.inv(kernel)
        logdet = -np.linalg.slogdet(kernel)[1]
        return whole, float(logdet)


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

    def beside(self, pushed: np.ndarray) -> Weighed:
        """With W columns more, of which each bends the observations as the acceleration `pushed`
        [S, 3J, W] at the knots does."""
        by_knots = self.zz[:, :, 6:] @ pushed
        across = np.swapaxes(self.zd[:, 6:], 1, 2) @ pushed
        own = np.swapaxes(pushed, 1, 2) @ by_knots[:, 6:]
        count = self.dd.shape[-1]
        dd = np.empty((len(own), count + own.shape[-1], count + own.shape[-1]))
        dd[:, :count, :count] = self.dd
        dd[:, :count, count:] = across
        dd[:, count:, :count] = np.swapaxes(across, 1, 2)
        dd[:, count:, count:] = own
        return replace(self, dd=dd, zd=np.concatenate((self.zd, by_knots), -1))


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


def gram(weighed: Weighed, unrest: Unrest) -> Gram:
    """Start and acceleration eliminated (Woodbury)."""
    prior, logdet = unrest.precision(weighed.knots)
    inner = weighed.zz + prior
    root = np.linalg.cholesky(inner)
    solved = np.linalg.solve(root, weighed.zd)
    each = weighed.dd - np.swapaxes(solved, 1, 2) @ solved
    return Gram(each, _volume(weighed, prior, logdet, root))


def total(weighed: Weighed, unrest: Unrest, weight: np.ndarray) -> np.ndarray:
    """[1 + C, 1 + C] sum of `gram`'s matrices, weighted [S], without making each of them."""
    prior, _ = unrest.precision(weighed.knots)
    root = np.linalg.cholesky(weighed.zz + prior)
    solved = np.linalg.solve(root, weighed.zd) * np.sqrt(weight)[:, None, None]
    flat = solved.reshape(-1, solved.shape[-1])
    return np.tensordot(weight, weighed.dd, 1) - flat.T @ flat


def log_volume(weighed: Weighed, unrest: Unrest) -> float:
    """log |C| of all segments, by itself."""
    prior, logdet = unrest.precision(weighed.knots)
    return _volume(weighed, prior, logdet, np.linalg.cholesky(weighed.zz + prior))


def _volume(weighed: Weighed, prior: np.ndarray, logdet: float, root: np.ndarray) -> float:
    # Restricted likelihood (Patterson & Thompson 1971): how far a model lets a start be felt is
    # no evidence, and a ship with less damping would be punished for it, segment by segment.
    of_inner = 2.0 * np.log(np.diagonal(root, axis1=1, axis2=2)).sum()
    of_inner -= np.linalg.slogdet(weighed.zz[:, :6, :6] + 1e-9 * prior[:6, :6])[1].sum()
    return weighed.logdet - logdet * len(weighed.zz) + float(of_inner)


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
        prior, _ = unrest.precision(knots)
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
    prior, _ = unrest.precision((size - 6) // 3)
    z = linear.z.reshape(count, -1, size)
    zt = np.swapaxes(z * weight, 1, 2)
    covariance = np.linalg.inv(zt @ z + prior)
    return (covariance @ (zt @ left))[..., 0], covariance
