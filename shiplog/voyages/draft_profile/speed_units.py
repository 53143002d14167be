"""The unit of a speed that states none: the one that fits how fast the position changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl

from shiplog import units
from shiplog.exceptions import ShiplogError
from shiplog.logs.conversion import cells, clock
from shiplog.voyages.draft_profile.column_names import UNIT_UNSTATED, FoundColumn

SPEEDS = ("m/s", "kn", "km/h", "mph", "cm/s")
CHORD_S = 10.0  # over which a position's own steps and noise do not count
LEAST_M_S = 0.3  # slower than that the noise of a position is motion, too
LEAST_ROWS = 20
FITS = 0.06  # of the ratio: mph and m/s are 13 % from the nearest other unit
METRE_PER_DEG = 111_195.0


def fitting_speed(
    speed: FoundColumn, place: list[FoundColumn], times: list[FoundColumn], rows: pl.DataFrame
) -> FoundColumn:
    """A column of speeds [n] with the unit in which they are those of the position.

    speed  v, in an unknown unit of f m/s; place  latitude, longitude or x0, y0 at times t

        f = median(|p(t + 10 s) - p(t)| / 10 s) / median(v)

    As it was where it states its unit, or where none fits.
    """
    if speed.unit_stated or not times or not rows[speed.column].dtype.is_numeric():
        return speed
    try:
        seconds = clock.instants(rows[times[0].column], times[0].unit).cast(pl.Float64) * 1e-9
    except ShiplogError:
        return speed
    t = seconds.to_numpy()
    v = rows[speed.column].cast(pl.Float64).to_numpy()
    p = _metres(place, rows)
    known = np.isfinite(t) & np.isfinite(v) & np.isfinite(p).all(axis=1)
    t, v, p = t[known], np.abs(v[known]), p[known]
    if len(t) < LEAST_ROWS or np.any(np.diff(t) < 0.0):
        return speed
    later = np.searchsorted(t, t + CHORD_S).clip(max=len(t) - 1)
    span = t[later] - t
    whole = (span > 0.5 * CHORD_S) & (span < 2.0 * CHORD_S)
    if whole.sum() < LEAST_ROWS:
        return speed
    moved = np.linalg.norm(p[later] - p, axis=1)[whole] / span[whole]
    fast = moved > LEAST_M_S
    if fast.sum() < LEAST_ROWS:
        return speed
    said = 0.5 * (v + v[later])[whole][fast]
    factor = float(np.median(moved[fast]) / np.median(said)) if np.median(said) > 0 else 0.0
    unit = min(SPEEDS, key=lambda one: abs(np.log(max(factor, 1e-9) / units.factor(one))))
    if abs(factor / units.factor(unit) - 1.0) > FITS:
        return speed
    doubts = tuple(doubt for doubt in speed.doubts if doubt != UNIT_UNSTATED)
    return replace(speed, unit=unit, doubts=(*doubts, "the unit fits how fast the position moves"))


def _metres(place: list[FoundColumn], rows: pl.DataFrame) -> np.ndarray:
    """Positions [n, 2] m, roughly."""
    values = []
    for one in place:
        column = rows[one.column]
        if column.dtype == pl.String and one.channel in cells.HEMISPHERES:
            letters, farthest = cells.HEMISPHERES[one.channel], cells.FARTHEST_DEG[one.channel]
            column = cells.coordinates(column, letters, farthest)
        elif not column.dtype.is_numeric():
            return np.full((rows.height, 2), np.nan)
        values.append(column.cast(pl.Float64).to_numpy() * one.sign)
    north, east = values
    if place[0].channel == "latitude":
        narrow = np.cos(np.radians(np.nanmedian(north))) if np.isfinite(north).any() else np.nan
        return METRE_PER_DEG * np.stack((north, east * narrow), axis=1)
    return np.stack(values, axis=1) * units.factor(place[0].unit or "m")
