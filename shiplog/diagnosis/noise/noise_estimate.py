"""Instrument and process noise, estimated from residuals by expectation-maximisation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.noise.likelihood import (
    ProcessNoise,
    Whitening,
    correlation_of_noise,
    decay,
    whitened_posterior,
)

# Of the noise's variance, that may be coloured.
COLOURED_SHARES = (0.0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95)
FADES = (1.0, 2.0, 4.0, 8.0, 16.0)  # s, in which that may fade
LEAP = 16.0  # steps at once, at most
ENOUGH_SEGMENTS = 8  # unbroken segments, fewer of which do not show it
LEAST_NOISE = np.array([1e-3, 5e-4, 1e-3, 5e-4, 1e-4, 1e-4])  # of the noise: m, m/s, rad, rad/s


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
    inverse = np.linalg.inv(decay(process_noise.knot * np.arange(knots), process_noise.time))
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
    by = Whitening(linear.cut.used, replace(process_noise, noise=np.ones(6))).by
    both = np.concatenate((left, linear.z), -1)
    white = (each @ both[:, :, channel] for channel, each in enumerate(by))
    return np.stack([np.swapaxes(values, 1, 2) @ values for values in white])


def _coloured(linear: Linear, left: np.ndarray, process_noise: ProcessNoise) -> ProcessNoise:
    """With the most probable colour of each channel's noise, from the second moments of complete
    stretches; its standard deviation follows."""
    used = linear.cut.used
    whole = used.all((1, 2))
    if whole.sum() < ENOUGH_SEGMENTS:
        return process_noise
    z, error = linear.z[whole], left[whole]
    white = Whitening(used[whole], process_noise)
    mean, covariance = whitened_posterior(white(z), white(error), process_noise)
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
                correlation = correlation_of_noise(share, time, process_noise.bin * np.arange(bins))
                variance = np.trace(np.linalg.solve(correlation, second)) / (bins * len(gap))
                cost = np.linalg.slogdet(correlation)[1] + bins * np.log(variance)
                if cost < best:
                    best, coloured[channel], fade[channel] = cost, share, time
                    noise[channel] = np.sqrt(variance)
    return replace(
        process_noise, noise=np.maximum(noise, LEAST_NOISE), coloured=coloured, fade=fade
    )
