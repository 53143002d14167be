"""What acts on the ship from outside, an arrow each: the mean true wind, a named current."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.nomenclature import frames
from shiplog.report.viewer import display
from shiplog.report.viewer.comparison_data import Current

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


def said(current: Current) -> str:
    """As currents are named: by where they set."""
    return f"current {current.speed:.2g} m/s to {bearing(current.direction)}"


def bearing(angle: float) -> str:
    """Three figures, clockwise from north, as bearings are written: 005°."""
    return f"{round(math.degrees(angle)) % 360:03d}°"


def mean_true_wind(rows: pl.DataFrame) -> Wind | None:
    """Of a drawn voyage's rows; None where no row has both wind and motion.

    The apparent wind's vector, towards where it comes from, is the true wind's plus the ship's
    velocity: w = U_A (cos γ_A, sin γ_A) - (u, v), turned by the heading into north and east.
    """
    angle, heading = (np.radians(display.column(rows, n)) for n in ("wind_angle", "heading"))
    speed = display.column(rows, "wind_speed")
    ahead = speed * np.cos(angle) - display.column(rows, "surge")
    starboard = speed * np.sin(angle) - display.column(rows, "sway")
    north, east = frames.in_earth_axes(ahead, starboard, np.cos(heading), np.sin(heading))
    known = np.isfinite(north + east)
    if not known.any():
        return None
    north, east = north[known], east[known]
    mean = float(np.mean(north)), float(np.mean(east))
    length, speeds = math.hypot(*mean), float(np.mean(np.hypot(north, east)))
    return Wind(length, math.atan2(mean[1], mean[0]), length / speeds if speeds > 0.0 else 0.0)
