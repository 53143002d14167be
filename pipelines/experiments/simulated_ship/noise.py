"""What pushes a ship at random: coloured accelerations in surge, sway and yaw."""

from __future__ import annotations

import numpy as np
from numba import njit

from pipelines.experiments.simulated_ship.laws import Noise
from pipelines.experiments.simulated_ship.weather import GRID, ornstein_uhlenbeck

DAMPED = 0.7  # of what is slow, and of the intensity: no period of its own stands out


def process_noise(
    noise: Noise, duration: float, times: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """[K, 3] accelerations at `times` [s], in m/s², m/s², rad/s².

    Drawn on the weather's grid: a finer step meets the same. The intensity is one for all three,
    log-normal with a mean square of 1, so that `noise.sigma` holds with bursts as without.
    """
    count = int(np.ceil(duration / GRID)) + 2
    if noise.damping is None:
        columns = [
            ornstein_uhlenbeck(rng, count, GRID, time, sigma)
            for time, sigma in zip(noise.time, noise.sigma, strict=True)
        ]
    else:
        columns = _filtered(noise, noise.damping, count, rng)
    grid = GRID * np.arange(count)
    return np.column_stack([np.interp(times, grid, column) for column in columns])


def _filtered(
    noise: Noise, damping: tuple[float, float, float], count: int, rng: np.random.Generator
) -> list[np.ndarray]:
    quick, slow = np.sqrt(1.0 - noise.slow_share), np.sqrt(noise.slow_share)
    wave = oscillator(rng, count, GRID, noise.burst_time, DAMPED)
    intensity = np.exp(noise.burst * wave - noise.burst**2)
    return [
        sigma
        * (
            quick * intensity * oscillator(rng, count, GRID, time, ratio)
            + slow * oscillator(rng, count, GRID, noise.slow_time, DAMPED)
        )
        for sigma, time, ratio in zip(noise.sigma, noise.time, damping, strict=True)
    ]


def oscillator(
    rng: np.random.Generator, count: int, step: float, time: float, damping: float
) -> np.ndarray:
    """[count] of a damped oscillator's position in white noise, stationary, of variance 1.

    Its correlation is exp(-t/time) (cos ω_d t + sin(ω_d t)/(time ω_d)), with ω_d = ω √(1 - ζ²),
    ω = 1/(ζ time) and ζ the damping, below 1 (Crandall & Mark 1963); exact at any step.
    """
    natural = 1.0 / (damping * time)
    turning = natural * np.sqrt(1.0 - damping**2)
    cos, sin = np.cos(turning * step), np.sin(turning * step)
    ahead = np.exp(-step / time) * np.array(
        [
            [cos + sin / (time * turning), sin / turning],
            [-(natural**2) / turning * sin, cos - sin / (time * turning)],
        ]
    )
    stationary = np.diag([1.0, natural**2])
    added = np.linalg.cholesky(stationary - ahead @ stationary @ ahead.T)
    pushes = rng.standard_normal((count, 2)) @ added.T
    return _run(ahead, pushes, rng.standard_normal(2) * [1.0, natural])


@njit
def _run(ahead, pushes, state):
    position = np.empty(len(pushes))
    for i in range(len(pushes)):
        position[i] = state[0]
        state = ahead @ state + pushes[i]
    return position
