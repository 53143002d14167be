"""The true wind of a voyage, and its mean as an arrow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shiplog.nomenclature import frames

STEADY = 0.5  # of its mean speed that the mean wind vector keeps: below, it has no one direction


@dataclass(frozen=True, slots=True)
class Wind:
    """The mean of the true wind over ground, as a vector.

    steadiness  length of the mean vector over the mean speed: 1 where it never turned
    """

    speed: float  # m/s, of the mean vector
    comes_from: float  # rad, clockwise from north
    steadiness: float

    @property
    def steady(self) -> bool:
        return self.steadiness >= STEADY

    @property
    def said(self) -> str:
        """As winds are named: by where they come from."""
        return f"wind {self.speed:.2g} m/s from {bearing(self.comes_from)}"


def bearing(angle: float) -> str:
    """Three figures, clockwise from north, as bearings are written: 005°. `angle`: rad."""
    return f"{round(math.degrees(angle)) % 360:03d}°"


def true_wind(
    speed: np.ndarray, angle: np.ndarray, surge: np.ndarray, sway: np.ndarray, heading: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(north, east) [n] of where the wind over ground comes from [m/s], of the apparent wind U_A
    [m/s], γ_A [rad, where it comes from, from the bow], the velocity (u, v) [m/s] and ψ [rad]:

        R(ψ) (U_A (cos γ_A, sin γ_A) - (u, v))
    """
    ahead, starboard = speed * np.cos(angle) - surge, speed * np.sin(angle) - sway
    return frames.in_earth_axes(ahead, starboard, np.cos(heading), np.sin(heading))


def mean_wind(north: np.ndarray, east: np.ndarray) -> Wind | None:
    """Of what `true_wind` gives; None where no row has both wind and motion."""
    known = np.isfinite(north + east)
    if not known.any():
        return None
    north, east = north[known], east[known]
    mean = float(np.mean(north)), float(np.mean(east))
    length, speeds = math.hypot(*mean), float(np.mean(np.hypot(north, east)))
    return Wind(length, math.atan2(mean[1], mean[0]), length / speeds if speeds > 0.0 else 0.0)
