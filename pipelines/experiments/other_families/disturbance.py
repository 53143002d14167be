"""Gusts and process noise, drawn on a grid of their own. None is an Ornstein-Uhlenbeck process."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from pipelines.experiments.other_families.ship import Noise

GRID = 0.1  # s
LINES = 48  # sines of a spectrum; log-spaced with jitter, so that nothing repeats in a voyage


@dataclass(frozen=True, slots=True)
class Wind:
    """True wind of one voyage; angles say where it comes from, clockwise from north [rad]."""

    speed: float  # m/s
    direction: float
    turn: float = 0.0  # rad, over the voyage
    freshen: float = 0.0  # share, over the voyage
    gust: float = 0.15  # standard deviation over the mean
    veer: float = 0.12  # rad, standard deviation


CALM = Wind(0.0, 0.0, gust=0.0, veer=0.0)


def sines(
    rng: np.random.Generator, times: np.ndarray, low: float, high: float, density
) -> np.ndarray:
    """[N] of unit variance: `LINES` sines between `low` and `high` [Hz] with the spectral density
    `density(f)`, random phases."""
    edges = np.geomspace(low, high, LINES + 1)
    f = edges[:-1] + np.diff(edges) * rng.uniform(0.2, 0.8, LINES)
    power = density(f) * np.diff(edges)
    amplitude = np.sqrt(2.0 * power / power.sum())
    phase = rng.uniform(0.0, 2.0 * math.pi, LINES)
    total = np.zeros(len(times))
    for one in range(LINES):
        total += amplitude[one] * np.cos(2.0 * math.pi * f[one] * times + phase[one])
    return total


def sea(rng: np.random.Generator, times: np.ndarray, period: float) -> np.ndarray:
    """[N] of unit variance with the spectrum of Pierson & Moskowitz (1964), peak at `period`."""
    peak = 1.0 / period

    def density(f: np.ndarray) -> np.ndarray:
        return (f / peak) ** -5 * np.exp(-1.25 * (f / peak) ** -4)

    return sines(rng, times, 0.5 * peak, 4.0 * peak, density)


def bursts(rng: np.random.Generator, times: np.ndarray, noise: Noise) -> np.ndarray:
    """[N]: white noise through a resonator of the second order, in bursts of log-normal intensity.

    The intensity changes over some ten periods; the mean square stays one.
    """
    step = float(times[1] - times[0]) if len(times) > 1 else GRID
    omega = 2.0 * math.pi / noise.period
    pole = np.exp((-noise.damping + 1j * math.sqrt(1.0 - noise.damping**2)) * omega * step)
    warm = int(3.0 / (noise.damping * omega * step)) + 1
    white = rng.standard_normal(warm + len(times))
    value = np.asarray(lfilter([1.0], [1.0, -2.0 * pole.real, abs(pole) ** 2], white))
    # variance of an AR(2) process with these coefficients
    a1, a2 = 2.0 * pole.real, -(abs(pole) ** 2)
    variance = (1.0 - a2) / ((1.0 + a2) * ((1.0 - a2) ** 2 - a1**2))
    slow = sines(rng, times, 0.02 / noise.period, 0.2 / noise.period, lambda f: 1.0 / f)
    intensity = np.exp(noise.burst * slow - noise.burst**2)
    return value[warm:] / math.sqrt(variance) * intensity


def process_noise(
    rng: np.random.Generator, noise: Noise, times: np.ndarray, louder: float
) -> np.ndarray:
    """[N, 3] accelerations at `times` [s]: m/s², m/s², rad/s²; `louder` is 1 on a calm day."""
    grid = GRID * np.arange(int(np.ceil(times[-1] / GRID)) + 2)
    columns = []
    for sigma in noise.sigma:
        one = sea(rng, grid, noise.period) if noise.kind == "sea" else bursts(rng, grid, noise)
        columns.append(louder * sigma * np.interp(times, grid, one))
    return np.column_stack(columns)


def blow(wind: Wind, duration: float, times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """[N, 2] vector to where the true wind comes from, north and east [m/s].

    Gusts follow the spectrum of Kaimal et al. (1972), n S ∝ f/(1 + 1.5 f)^(5/3).
    """
    grid = GRID * np.arange(int(np.ceil(duration / GRID)) + 2)

    def kaimal(f: np.ndarray) -> np.ndarray:
        reduced = 33.0 * f * 10.0 / max(wind.speed, 1.0)  # 10 m above the water
        return 1.0 / (1.0 + 1.5 * reduced) ** (5.0 / 3.0)

    share = np.minimum(grid / duration, 1.0)
    gusts = sines(rng, grid, 0.002, 0.5, kaimal)
    speed = wind.speed * (1.0 + wind.freshen * share) * np.maximum(1.0 + wind.gust * gusts, 0.1)
    direction = (
        wind.direction + wind.turn * share + wind.veer * sines(rng, grid, 0.002, 0.3, kaimal)
    )
    north, east = speed * np.cos(direction), speed * np.sin(direction)
    return np.column_stack((np.interp(times, grid, north), np.interp(times, grid, east)))
