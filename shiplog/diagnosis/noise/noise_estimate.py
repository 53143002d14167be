"""Instrument and process noise, estimated from residuals by expectation-maximisation.

Of r_s = e_s - J_s d = Z_s z_s + ε_s, with z_s missing (Dempster, Laird & Rubin 1977):

    E   z_s | r_s ~ N(ẑ_s, V_s),  V_s = (Zᵀ R⁻¹ Z + P⁻¹)⁻¹,  ẑ_s = V_s Zᵀ R⁻¹ r_s
    M   σ_c² = (1/n_c) Σ_s E|Γ^-½ (r_s - Z_s z_s)|²   over channel c's n_c observations
        q_c² = (1/SJ) Σ_s E(aᵀ T⁻¹ a)                 over the accelerations a of channel c, S
                                                      segments and J nodes; T = exp(-|tᵢ - tⱼ|/τ)

The colour of a channel's noise maximises the likelihood of the second moments that z_s leaves.
"""

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


def estimate(
    linear: Linear, d: np.ndarray, process_noise: ProcessNoise, rounds: int = 4
) -> ProcessNoise:
    """Instrument and process noise that fit the residuals of d, by expectation-maximisation
    (Dempster et al. 1977). Of three steps a round, the first two give the length of the third
    (SQUAREM, Varadhan & Roland 2008): with x the logarithms of (σ, q) and F a step,

        r = F(x) - x,   v = F(F(x)) - F(x) - r,   α = |r| / |v| in [1, LEAP]
        x ← F(x + 2 α r + α² v)

    The colour of the noise is estimated once, at the end.

    d   [C] the numbers of the columns, SI
    """
    left = (linear.e - linear.j @ d)[..., None]
    products = _channel_products(linear, left, process_noise)
    counted = linear.cut.used.sum((0, 1))
    nodes = (linear.z.shape[-1] - 6) // 3
    T_inverse = np.linalg.inv(decay(process_noise.node_step * np.arange(nodes), process_noise.time))
    least = np.log(np.concatenate((LEAST_NOISE, np.full(3, 1e-12))))

    def sized(sizes: np.ndarray) -> ProcessNoise:
        return replace(process_noise, noise=np.exp(sizes[:6]), acceleration=np.exp(sizes[6:]))

    def step(sizes: np.ndarray) -> np.ndarray:
        """(log σ, log q) [9] after one step: with products S_c of [r | Z] in channel c and second
        moments E = (1, -ẑ)(1, -ẑ)ᵀ + diag(0, V) [1 + 6 + 3J, 1 + 6 + 3J],

            σ_c² = Σ_s tr(S_c E)/n_c,   q_c² = mean_s tr(T⁻¹ E_aa)/J
        """
        now = sized(sizes)
        S = np.tensordot(now.noise**-2.0, products, 1)
        V = np.linalg.inv(S[:, 1:, 1:] + now.precision(nodes))
        z = V @ S[:, 1:, :1]
        one_less_z = np.concatenate((np.ones((len(z), 1, 1)), -z), 1)  # of [r | Z], what z leaves
        E = one_less_z @ np.swapaxes(one_less_z, 1, 2)
        E[:, 1:, 1:] += V
        noise = products.reshape(6, -1) @ E.reshape(-1) / np.maximum(counted, 1)
        noise = np.where(counted > 0, noise, now.noise**2)  # nobody measures it: as it was
        E_aa = E[:, 7:, 7:].mean(0).reshape(3, nodes, 3, nodes)
        acceleration = np.einsum("ij,cicj->c", T_inverse, E_aa) / nodes
        return np.maximum(0.5 * np.log(np.concatenate((noise, acceleration))), least)

    sizes = np.log(np.concatenate((process_noise.noise, process_noise.acceleration)))
    for _ in range(rounds):
        one = step(sizes)
        two = step(one)
        first, second = one - sizes, two - one
        bend = float(np.linalg.norm(second - first))
        leap = float(np.clip(np.linalg.norm(first) / max(bend, 1e-12), 1.0, LEAP))
        sizes = step(sizes + 2.0 * leap * first + leap**2 * (second - first))
    return _coloured(linear, left, sized(sizes))


def _channel_products(linear: Linear, left: np.ndarray, process_noise: ProcessNoise) -> np.ndarray:
    """S_c = [r | Z]ᵀ Γ⁻¹ [r | Z] [6, S, 1 + 6 + 3J, 1 + 6 + 3J] in each channel c alone, were its
    noise of unit size: what its size is changes but their weight, 1/σ_c²."""
    by = Whitening(linear.cut.used, replace(process_noise, noise=np.ones(6))).by
    both = np.concatenate((left, linear.z), -1)
    white = (each @ both[:, :, channel] for channel, each in enumerate(by))
    return np.stack([np.swapaxes(values, 1, 2) @ values for values in white])


def _coloured(linear: Linear, left: np.ndarray, process_noise: ProcessNoise) -> ProcessNoise:
    """With the most probable colour (ρ, τ) of each channel's noise, from the second moments of
    complete segments; its standard deviation follows.

        E = Σ_s (r - Z ẑ)(r - Z ẑ)ᵀ + Z V Zᵀ [B, B],   σ² = tr(Γ⁻¹ E)/(B n),
        cost(ρ, τ) = log|Γ| + B log σ²,   n segments of B bins
    """
    used = linear.cut.used
    there = used.any((0, 1))  # a channel that nobody measures has no noise
    whole = used[..., there].all((1, 2))
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
    for channel in np.flatnonzero(there):
        Z = z[:, :, channel]
        gap = error[:, :, channel] - Z @ mean
        E = gap[..., 0].T @ gap[..., 0]
        E += (Z @ covariance @ np.swapaxes(Z, 1, 2)).sum(0)
        best = np.inf
        for share in COLOURED_SHARES:
            for time in FADES if share > 0.0 else FADES[:1]:
                Gamma = correlation_of_noise(share, time, process_noise.bin * np.arange(bins))
                variance = np.trace(np.linalg.solve(Gamma, E)) / (bins * len(gap))
                cost = np.linalg.slogdet(Gamma)[1] + bins * np.log(variance)
                if cost < best:
                    best, coloured[channel], fade[channel] = cost, share, time
                    noise[channel] = np.sqrt(variance)
    return replace(
        process_noise, noise=np.maximum(noise, LEAST_NOISE), coloured=coloured, fade=fade
    )
