"""How far each simulation is from where the ship was, and how far its heading is off."""

from __future__ import annotations

import numpy as np
import polars as pl

from shiplog.report.viewer import display
from shiplog.report.viewer.display import Drawn

POSITION, HEADING = "position_error", "heading_error"  # m, deg
GAP = 1.5  # times the measured rows' step: between rows farther apart nothing was measured


def with_errors(drawn: Drawn) -> pl.DataFrame:
    """`drawn.simulated` with

    position_error  |p_sim - p| [m], p = (x₀, y₀); heading_error  ψ_sim - ψ in [-180, 180) [deg]

    where p and ψ are measured, between two rows on a straight line; null where nothing was.
    """
    tables = []
    for (voyage,), rollouts in drawn.simulated.group_by("voyage", maintain_order=True):
        measured = drawn.measured.filter(pl.col("voyage") == voyage)
        time = display.column(rollouts, "time")
        x0, y0, heading = _measured_at(measured, time)
        position = np.hypot(
            display.column(rollouts, "x0") - x0, display.column(rollouts, "y0") - y0
        )
        off = (display.column(rollouts, "heading") - heading + 180.0) % 360.0 - 180.0
        tables.append(
            rollouts.with_columns(
                pl.Series(POSITION, position, nan_to_null=True),
                pl.Series(HEADING, off, nan_to_null=True),
            )
        )
    if not tables:
        return drawn.simulated.with_columns(
            pl.lit(None, pl.Float64).alias(name) for name in (POSITION, HEADING)
        )
    return pl.concat(tables)


def _measured_at(measured: pl.DataFrame, time: np.ndarray) -> list[np.ndarray]:
    """x₀, y₀ and heading at these instants, NaN where nothing was measured."""
    at = display.column(measured, "time")
    if len(at) < 2:
        return [np.full(len(time), np.nan)] * 3
    after = np.clip(np.searchsorted(at, time), 1, len(at) - 1)
    step = at[after] - at[after - 1]
    exact = np.isin(time, at)
    known = (time >= at[0]) & (time <= at[-1])
    known &= exact | (step <= GAP * float(np.median(np.diff(at))))
    return [
        np.where(known, np.interp(time, at, display.column(measured, name)), np.nan)
        for name in ("x0", "y0", "heading")
    ]


def position_range(errors: pl.DataFrame, measured: pl.DataFrame) -> tuple[float, float]:
    """From zero to the largest error, but no farther than the measured track is wide: a model that
    is so far off is lost, and must not flatten the others."""
    return _up_to(display.column(errors, POSITION), _width(measured))


def heading_range(errors: pl.DataFrame) -> tuple[float, float]:
    """About zero, alike on either side."""
    values = np.abs(display.column(errors, HEADING))
    most = float(np.nanmax(values)) if np.isfinite(values).any() else 1.0
    most = 1.08 * max(most, 0.1)
    return -most, most


def _width(measured: pl.DataFrame) -> float:
    return max((float(np.ptp(v[np.isfinite(v)])) if np.isfinite(v).any() else 0.0)
               for v in (display.column(measured, n) for n in ("x0", "y0")))  # fmt: skip


def _up_to(values: np.ndarray, limit: float) -> tuple[float, float]:
    most = float(np.nanmax(values)) if np.isfinite(values).any() else 1.0
    most = max(min(most, limit) if limit > 0.0 else most, 1e-3)
    return -0.04 * most, 1.08 * most
