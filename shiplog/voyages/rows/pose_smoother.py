"""Velocity from positions alone: a Kalman smoother of one coordinate, or of two alike.

A position p [m], or a heading [rad], has an acceleration that is a Wiener process: white jerk of
the spectral density q. This is the continuous Wiener process acceleration model (Bar-Shalom, Li &
Kirubarajan 2001, Sec. 6.2.3). With the state s = (p, ṗ, p̈) and samples y Δ apart

    sₖ₊₁ = F sₖ + wₖ,  wₖ ~ N(0, Q),   yₖ = pₖ + εₖ,  εₖ ~ N(0, σ²)

        ⎡1  Δ  Δ²/2⎤          ⎡Δ⁵/20  Δ⁴/8  Δ³/6⎤
    F = ⎢0  1  Δ   ⎥,   Q = q ⎢Δ⁴/8   Δ³/3  Δ²/2⎥
        ⎣0  0  1   ⎦          ⎣Δ³/6   Δ²/2  Δ   ⎦

Forwards it is the filter of Kalman (1960), backwards the smoother of Rauch, Tung & Striebel (1965):

    s⁻ = F s,  P⁻ = F P Fᵀ + Q,  S = P⁻₁₁ + σ²,  K = P⁻₁/S,  s = s⁻ + K (y - p⁻),  P = P⁻ - K Kᵀ S
    G = P Fᵀ (P⁻ₖ₊₁)⁻¹,  ŝ = s + G (ŝₖ₊₁ - s⁻ₖ₊₁),  P̂ = P + G (P̂ₖ₊₁ - P⁻ₖ₊₁) Gᵀ

q and σ are the most probable ones (Schweppe 1965): with ρ = q/σ², and S̃ = S/σ² of that ratio, the
log-likelihood's greatest value over σ is, but for a constant,

    log L(ρ) = -½ (n log σ̂² + Σ log S̃),   σ̂² = (1/n) Σ (y - p⁻)²/S̃

Between two samples the smoothed path is the polynomial of fifth degree through both states, which
is its mean given them. Time is in periods and the coordinate in σ inside, so that no matrix has
numbers of very different sizes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

RATIOS = (-12.0, 12.0)  # of log10 ρ, time in periods: from a straight line to every sample itself
FITTED = 6_000  # samples of which q and σ are estimated
PIECE = 600  # of them in a row: long against the time that a smoother remembers
FEWEST = 8  # samples of which a velocity is derived: a state has three numbers
FIRST = 3  # innovations of a piece that say where it begins, and not how it goes on
SETTLED = 1e-10  # relative change of a covariance from which it is taken to have settled
SAME_STEP = 1e-3  # of a period: steps so nearly alike leave a settled covariance as it is


@dataclass(frozen=True)
class Smoothed:
    """A path at its n samples.

    time      [n]     s
    state     [n, 3]  (p, ṗ, p̈); complex where two coordinates were smoothed together
    deviation [n, 2]  standard deviation of p and of ṗ, of one coordinate
    sigma     σ of one sample
    jerk      √q
    """

    time: np.ndarray
    state: np.ndarray
    deviation: np.ndarray
    sigma: float
    jerk: float

    def at(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Position, velocity and its standard deviation at `time` [m], s, within the samples."""
        right = np.clip(np.searchsorted(self.time, time), 1, len(self.time) - 1)
        left = right - 1
        span = self.time[right] - self.time[left]
        share = np.clip((time - self.time[left]) / span, 0.0, 1.0)
        p, v = _quintic(self.state[left], self.state[right], span, share)
        known = self.deviation[:, 1]
        return p, v, known[left] + share * (known[right] - known[left])


def _quintic(
    a: np.ndarray, b: np.ndarray, span: np.ndarray, share: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity [m] on p(τ) = p₀ + v₀ T τ + ½ a₀ T² τ² + c₃ τ³ + c₄ τ⁴ + c₅ τ⁵, which
    has the states a [m, 3] at τ = 0 and b [m, 3] at τ = 1, T = `span` later."""
    v0, v1 = a[:, 1] * span, b[:, 1] * span
    a0, a1 = a[:, 2] * span**2, b[:, 2] * span**2
    gone = b[:, 0] - a[:, 0]
    c3 = 10.0 * gone - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * gone + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * gone - 3.0 * (v0 + v1) - 0.5 * (a0 - a1)
    t = share
    p = a[:, 0] + t * (v0 + t * (0.5 * a0 + t * (c3 + t * (c4 + t * c5))))
    v = (v0 + t * (a0 + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))) / span
    return p, v


def smooth(time: np.ndarray, value: np.ndarray, starts: np.ndarray) -> list[Smoothed]:
    """Each unbroken piece, smoothed with one q and σ; no piece of fewer than FEWEST samples.

    time    [n]  s, increasing
    value   [n]  one coordinate, or two as one complex number
    starts  [n]  bool: nothing joins this sample to the one before it
    """
    edges = np.append(np.flatnonzero(starts), len(time))
    pieces = [(a, b) for a, b in pairwise(edges) if b - a >= FEWEST]
    if not pieces:
        return []
    period = float(np.median(np.concatenate([np.diff(time[a:b]) for a, b in pieces])))
    scaled = [(np.diff(time[a:b]) / period, value[a:b]) for a, b in pieces]
    ratio, sigma = most_probable(scaled)
    found = []
    unit = sigma / np.array([1.0, period, period**2])
    for (a, b), (steps, values) in zip(pieces, scaled, strict=True):
        about = values[0]
        state, deviation = _smoothed(steps, (values - about) / sigma, ratio)
        state = state * unit
        state[:, 0] += about
        jerk = math.sqrt(ratio / period**5) * sigma
        found.append(Smoothed(time[a:b], state, deviation * unit[:2], sigma, jerk))
    return found


def most_probable(pieces: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[float, float]:
    """ρ, time in periods, and σ that maximise the likelihood of some of the samples.

    pieces  steps [n - 1] in periods and values [n], complex where they are two coordinates
    """
    from scipy.optimize import minimize_scalar

    chosen = _chosen(pieces)

    def cost(exponent: float) -> float:
        return _misfit(chosen, 10.0**exponent)[0]

    coarse = np.linspace(*RATIOS, 13)
    best = int(np.argmin([cost(one) for one in coarse]))
    low, high = coarse[max(best - 1, 0)], coarse[min(best + 1, len(coarse) - 1)]
    found: Any = minimize_scalar(
        cost, bounds=(low, high), method="bounded", options={"xatol": 0.05}
    )
    ratio = 10.0 ** float(found.x)
    return ratio, max(_misfit(chosen, ratio)[1], 1e-12)


def _chosen(
    pieces: Sequence[tuple[np.ndarray, np.ndarray]],
) -> list[tuple[np.ndarray, np.ndarray]]:
    """At most FITTED samples, in pieces of PIECE that are spread evenly over the record."""
    parts = []
    for steps, values in pieces:
        for at in range(0, len(values), PIECE):
            if len(values) - at >= min(PIECE, len(values)):
                parts.append((steps[at : at + PIECE - 1], values[at : at + PIECE]))
    most = max(FITTED // PIECE, 1)
    if len(parts) <= most:
        return parts
    at = np.unique(np.linspace(0, len(parts) - 1, most).round().astype(int))
    return [parts[i] for i in at]


def _misfit(pieces: Sequence[tuple[np.ndarray, np.ndarray]], ratio: float) -> tuple[float, float]:
    """-2 log L(ρ)/n + constant, and σ̂."""
    squares = logs = 0.0
    count = 0
    for steps, values in pieces:
        forward = _filtered(steps, values - values[0], ratio)
        off, spread = forward.innovation[FIRST:], forward.spread[FIRST:]
        axes = 2 if np.iscomplexobj(values) else 1
        squares += float((np.abs(off) ** 2 / spread).sum()) / axes
        logs += float(np.log(spread).sum())
        count += len(off)
    variance = squares / max(count, 1)
    return math.log(max(variance, 1e-300)) + logs / max(count, 1), math.sqrt(variance)


@dataclass(frozen=True)
class _Forward:
    """Of the filter, for each of n samples: mean [n, 3] and covariance [n, 6] after it, the same
    before it, innovation y - p⁻ and its variance S [n], σ = 1. A covariance is its upper triangle,
    row by row."""

    mean: np.ndarray
    covariance: np.ndarray
    mean_before: np.ndarray
    covariance_before: np.ndarray
    innovation: np.ndarray
    spread: np.ndarray


def _filtered(steps: np.ndarray, values: np.ndarray, ratio: float) -> _Forward:
    """Plain numbers rather than arrays: matrices of three rows are too small for numpy, which takes
    ten times as long. Once the covariance has settled, at equal steps, it is not computed again."""
    count = len(values)
    y = values.tolist()
    slope, bend = _begin(steps, values)
    p, v, a = y[0], 0.0 * y[0], 0.0 * y[0]
    A, B, C, D, E, H = 1.0, 0.0, 0.0, slope**2, 0.0, bend**2  # P: pp, pv, pa, vv, va, aa
    means, before = [(p, v, a)], [(p, v, a)]
    covariances, covariances_before = [(A, B, C, D, E, H)], [(A, B, C, D, E, H)]
    off, spread = [0.0 * y[0]], [2.0]
    last, settled = -1.0, False
    k1 = k2 = k3 = s = 0.0
    prior = covariances[0]
    for k, t in enumerate(steps.tolist(), 1):
        if not (settled and abs(t - last) <= SAME_STEP):
            h = 0.5 * t * t
            # F P Fᵀ + Q
            pa = C + t * E + h * H
            va = E + t * H
            pv = B + t * D + h * E + t * pa
            vv = D + t * E + t * va
            pp = A + t * B + h * C + t * (B + t * D + h * E) + h * pa
            q = ratio * t
            prior = (
                pp + q * t**4 / 20.0, pv + q * t**3 / 8.0, pa + q * t * t / 6.0,
                vv + q * t * t / 3.0, va + q * t / 2.0, H + q,
            )  # fmt: skip
            s = prior[0] + 1.0
            k1, k2, k3 = prior[0] / s, prior[1] / s, prior[2] / s
            old = D
            A, B, C = k1, k2, k3  # P⁻₁ σ²/S, σ = 1
            D = prior[3] - k2 * prior[1]
            E = prior[4] - k2 * prior[2]
            H = prior[5] - k3 * prior[2]
            settled = abs(t - last) <= SAME_STEP and abs(D - old) <= SETTLED * D
            last = t
        p, v = p + t * v + 0.5 * t * t * a, v + t * a
        before.append((p, v, a))
        e = y[k] - p
        off.append(e)
        spread.append(s)
        p, v, a = p + k1 * e, v + k2 * e, a + k3 * e
        means.append((p, v, a))
        covariances.append((A, B, C, D, E, H))
        covariances_before.append(prior)
    assert len(means) == count
    return _Forward(
        *(np.array(of) for of in (means, covariances, before, covariances_before, off, spread))
    )


def _begin(steps: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Standard deviations of velocity and acceleration before any sample, in periods: three times
    what the record has, so that its beginning is as free as its middle."""
    few = min(10, len(values) - 1)
    went = np.abs(values[few:] - values[:-few])
    slope = 3.0 * (math.sqrt(float((went**2).mean())) / few + 1.0)
    return slope, slope / few * 2.0 + 1.0


def _symmetric(upper: np.ndarray) -> np.ndarray:
    """Matrices [n, 3, 3] of their upper triangles [n, 6]."""
    return upper[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)


def _smoothed(steps: np.ndarray, values: np.ndarray, ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """ŝ [n, 3], and the standard deviations of its first two numbers [n, 2]; σ = 1."""
    forward = _filtered(steps, values, ratio)
    P, P_before = _symmetric(forward.covariance), _symmetric(forward.covariance_before)
    F = np.zeros((len(steps), 3, 3))
    F[:, 0, 0] = F[:, 1, 1] = F[:, 2, 2] = 1.0
    F[:, 0, 1] = F[:, 1, 2] = steps
    F[:, 0, 2] = 0.5 * steps**2
    G = np.swapaxes(np.linalg.solve(P_before[1:], F @ P[:-1]), 1, 2)
    state, P_hat = forward.mean.copy(), np.empty_like(P)
    P_hat[-1] = P[-1]
    later, P_later = state[-1], P[-1]
    steady = (np.diff(forward.covariance, axis=0) == 0.0).all(1)  # the filter had settled
    settled = False
    for k in range(len(steps) - 1, -1, -1):
        g = G[k]
        later = forward.mean[k] + g @ (later - forward.mean_before[k + 1])
        state[k] = later
        if not (settled and steady[k]):
            now = P[k] + g @ (P_later - P_before[k + 1]) @ g.T
            settled = bool(steady[k]) and abs(now[1, 1] - P_later[1, 1]) <= SETTLED * now[1, 1]
            P_later = now
        P_hat[k] = P_later
    deviation = np.sqrt(np.maximum(np.stack((P_hat[:, 0, 0], P_hat[:, 1, 1]), 1), 0.0))
    return state, deviation
