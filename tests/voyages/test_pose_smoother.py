"""The Kalman smoother of positions against dense Gaussian conditioning, and against known motions.

The answers are those of a Gaussian process: the covariance of a three times integrated white noise
in closed form (Wahba, 1978), conditioned on all samples at once. No filter is in it.
"""

from itertools import pairwise

import numpy as np
import pytest

from shiplog.voyages.rows import pose_smoother

LOOSE = 10.0  # prior standard deviation of the state at the beginning: nothing is known of it


def dense(time, value, wanted, jerk, sigma):
    """Mean and standard deviation of velocity at `wanted`, given every sample.

    p(t) = p₀ + v₀ t + ½ a₀ t² + √q ∫₀ᵗ ½ (t - s)² dW(s)
    """

    def shapes(t, order):  # ∂ᵒʳᵈᵉʳ/∂t of (1, t, t²/2)
        if order:
            return np.stack((np.zeros_like(t), np.ones_like(t), t), 1)
        return np.stack((np.ones_like(t), t, 0.5 * t**2), 1)

    def integral(s, t):  # ∫₀^min ½ (s - w)² ½ (t - w)² dw, s [n], t [m]
        s, t = np.meshgrid(s, t, indexing="ij")
        low, apart = np.minimum(s, t), np.abs(s - t)
        return low**5 / 20 + apart * low**4 / 8 + apart**2 * low**3 / 12

    def by_first(s, t):  # ∂/∂s of it: ∫₀^min (s - w) ½ (t - w)² dw
        s, t = np.meshgrid(s, t, indexing="ij")
        low = np.minimum(s, t)
        w = [low, low**2 / 2, low**3 / 3, low**4 / 4]
        return 0.5 * (s * t**2 * w[0] - (t**2 + 2 * s * t) * w[1] + (s + 2 * t) * w[2] - w[3])

    def by_both(s):  # ∂²/∂s∂t at s = t: ∫₀ˢ (s - w)² dw
        return s**3 / 3

    q, start = jerk**2, LOOSE**2
    H, G = shapes(time, 0), shapes(wanted, 1)
    K = q * integral(time, time) + start * H @ H.T + sigma**2 * np.eye(len(time))
    cross = q * by_first(wanted, time) + start * G @ H.T
    mean = cross @ np.linalg.solve(K, value)
    own = q * by_both(wanted) + start * (G * G).sum(1)
    return mean, np.sqrt(own - np.einsum("ij,ij->i", cross, np.linalg.solve(K, cross.T).T))


def sailed(rng, time, jerk, sigma):
    """Positions and velocities of a Wiener process acceleration, and noisy samples of the former:
    white jerk in fifty steps from sample to sample."""
    parts = [np.linspace(a, b, 50, endpoint=False) for a, b in pairwise(time)]
    fine = np.concatenate([*parts, time[-1:]])
    step = np.diff(fine)
    jerked = np.cumsum(jerk * np.sqrt(step) * rng.normal(size=len(step)))
    a = 0.02 + np.concatenate(([0.0], jerked))
    v = 0.3 + np.concatenate(([0.0], np.cumsum(0.5 * (a[1:] + a[:-1]) * step)))
    p = np.concatenate(([0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * step)))
    at = np.searchsorted(fine, time)
    return p[at], v[at], p[at] + sigma * rng.normal(size=len(time))


def jittered(rng, count, step=0.1):
    """Stamps as a receiver's, with a fifth of them lost."""
    time = step * np.arange(count) + 0.01 * rng.uniform(-1, 1, count)
    return time[np.sort(rng.choice(count, int(0.8 * count), replace=False))]


def one_piece(time):
    return np.arange(len(time)) == 0


def test_velocity_and_its_deviation_are_those_of_conditioning_on_all_samples():
    rng = np.random.default_rng(1)
    time = jittered(rng, 150)
    _, _, value = sailed(rng, time, 0.05, 0.02)
    (found,) = pose_smoother.smooth(time, value, one_piece(time))
    inside = time[15:-15]  # where the beginning, of which the prior differs, is forgotten
    between = 0.5 * (inside[1:] + inside[:-1])
    for wanted in (inside, between):
        mean, deviation = dense(time, value, wanted, found.jerk, found.sigma)
        _, velocity, known = found.at(wanted)
        np.testing.assert_allclose(velocity, mean, atol=0.02 * deviation.min())
        np.testing.assert_allclose(known, deviation, rtol=0.02)


def test_noise_and_jerk_are_estimated_and_errors_are_as_large_as_stated():
    rng = np.random.default_rng(2)
    time = jittered(rng, 2500)
    jerk, sigma = 0.03, 0.015
    _, velocity, value = sailed(rng, time, jerk, sigma)
    (found,) = pose_smoother.smooth(time, value, one_piece(time))
    assert found.sigma == pytest.approx(sigma, rel=0.05)
    assert found.jerk == pytest.approx(jerk, rel=0.3)
    off = (found.state[:, 1] - velocity) / found.deviation[:, 1]
    assert 0.85 < np.mean(np.abs(off) < 1.645) < 0.95


def test_two_coordinates_at_once_are_each_as_by_itself():
    rng = np.random.default_rng(3)
    time = jittered(rng, 400)
    north, east = (sailed(rng, time, 0.03, 0.01)[2] for _ in range(2))
    (both,) = pose_smoother.smooth(time, north + 1j * east, one_piece(time))
    (alone,) = pose_smoother.smooth(time, north + 1j * north, one_piece(time))
    assert both.sigma == pytest.approx(0.01, rel=0.1)
    np.testing.assert_allclose(alone.state.real, alone.state.imag, atol=1e-9)
    again = pose_smoother.smooth(time, (north + 1j * east) * 1j, one_piece(time))[0]
    np.testing.assert_allclose(again.state, both.state * 1j, atol=1e-6)  # turned axes


def test_pieces_do_not_reach_across_and_short_ones_have_no_velocity():
    time = 0.1 * np.arange(60)
    value = np.where(time < 3.0, 0.5 * time, 100.0 + 0.2 * time)
    value = value + 1e-3 * np.random.default_rng(4).normal(size=60)
    starts = one_piece(time) | (np.arange(60) == 30) | (np.arange(60) == 55)
    before, after = pose_smoother.smooth(time, value, starts)
    assert len(before.time) == 30
    assert len(after.time) == 25  # and five samples are too few
    assert np.median(before.state[:, 1]) == pytest.approx(0.5, abs=0.01)
    assert np.median(after.state[:, 1]) == pytest.approx(0.2, abs=0.01)
