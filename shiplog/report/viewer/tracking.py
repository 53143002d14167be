"""How far each simulation is from where the ship was, and how far its heading is off."""

from __future__ import annotations

import numpy as np
import polars as pl

from shiplog.report.viewer import display
from shiplog.report.viewer.display import Drawn

POSITION, HEADING = "position_error", "heading_error"  # m, deg
SAME_INSTANT = 1e-3  # s: a rollout stands on the measured rows


def with_errors(drawn: Drawn) -> pl.DataFrame:
    """`drawn.simulated` with

    position_error  |p_sim - p| [m], p = (x₀, y₀); heading_error  ψ_sim - ψ in (-180, 180] [deg]

    at the instants that were measured; elsewhere they are null.
    """
    columns = ("voyage", "time", "x0", "y0", "heading")
    measured = drawn.measured.select(columns).with_columns(pl.col("time").cast(pl.Float64))
    off = (pl.col("heading") - pl.col("heading_measured") + 180.0) % 360.0 - 180.0
    return (
        drawn.simulated.with_row_index("row")
        .sort("time", maintain_order=True)
        .join_asof(
            measured.sort("time"), on="time", by="voyage", strategy="nearest",
            tolerance=SAME_INSTANT, suffix="_measured", check_sortedness=False,
        )
        .sort("row")
        .with_columns(
            ((pl.col("x0") - pl.col("x0_measured")).pow(2)
             + (pl.col("y0") - pl.col("y0_measured")).pow(2)).sqrt().alias(POSITION),
            pl.when(off == -180.0).then(180.0).otherwise(off).alias(HEADING),
        )
        .select(*drawn.simulated.columns, POSITION, HEADING)
    )  # fmt: skip


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
