"""What acts on the ship from outside, an arrow each: the mean true wind, a named current."""

from __future__ import annotations

import numpy as np
import polars as pl

from shiplog.report.figures.wind import Wind, bearing, mean_wind, true_wind
from shiplog.report.viewer import display
from shiplog.report.viewer.comparison_data import Current


def said(current: Current) -> str:
    """As currents are named: by where they set."""
    return f"current {current.speed:.2g} m/s to {bearing(current.direction)}"


def mean_true_wind(rows: pl.DataFrame) -> Wind | None:
    """Of a drawn voyage's rows; None where no row has both wind and motion."""
    angle, heading = (np.radians(display.column(rows, n)) for n in ("wind_angle", "heading"))
    speed, surge, sway = (display.column(rows, n) for n in ("wind_speed", "surge", "sway"))
    return mean_wind(*true_wind(speed, angle, surge, sway, heading))
