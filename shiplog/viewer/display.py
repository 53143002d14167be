"""The tables as they are drawn: display units, headings without jumps, one shown seed a model."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import polars as pl
from numpy.typing import NDArray

from shiplog import channels
from shiplog.comparison import Comparison

TURN = 2.0 * math.pi
ROLLOUT = ("model", "seed", "voyage", "window")  # what one rollout is known by


def unwrapped(angle: str, over: tuple[str, ...]) -> pl.Expr:
    """The angle [rad] counted on through ±π, from the first row of each group."""
    step = pl.col(angle).diff().fill_null(0.0)
    step = step - TURN * (step / TURN).round()
    return (pl.col(angle).drop_nulls().first() + step.cum_sum()).over(over)


class Drawn(Comparison):
    """A comparison whose tables are in display units, with headings that do not jump."""


def drawn(comparison: Comparison) -> Drawn:
    """The same comparison, ready to be drawn."""
    tables = {
        "measured": _measured(comparison),
        "simulated": _simulated(comparison),
        "training": _in_display_units(comparison.training, comparison.channels),
    }
    rest = {f.name: getattr(comparison, f.name) for f in fields(comparison)}
    return Drawn(**{**rest, **tables})


def _measured(comparison: Comparison) -> pl.DataFrame:
    """Heading free-running, wind from 0 to 360 deg."""
    table = comparison.measured.with_columns(heading=unwrapped("heading", ("voyage",)))
    if comparison.has_wind:
        table = table.with_columns(wind_angle=pl.col("wind_angle") % TURN)
    return _in_display_units(table, comparison.channels)


def _simulated(comparison: Comparison) -> pl.DataFrame:
    """Rollouts in order of time, heading in the turn that the measured one is in."""
    start = comparison.measured.select(
        "voyage", pl.col("time").cast(pl.Float64), there=unwrapped("heading", ("voyage",))
    ).sort("time")
    turns = ((pl.col("there") - pl.col("heading")) / TURN).round().first().over(ROLLOUT)
    table = (
        comparison.simulated.with_columns(
            pl.col("time").cast(pl.Float64), heading=unwrapped("heading", ROLLOUT)
        )
        .sort("time")
        .join_asof(start, on="time", by="voyage", strategy="nearest", check_sortedness=False)
        .sort(*ROLLOUT, "time", maintain_order=True)
        .with_columns(heading=pl.col("heading") + TURN * turns.fill_null(0.0))
        .drop("there")
    )
    return _in_display_units(table, channels.STATE)


def shown_seeds(comparison: Comparison) -> dict[str, int]:
    """For each model the seed that is drawn boldly: the one whose mean error is the median.

    It is a rollout that a trained model made, which a mean over seeds is not, and neither the
    luckiest nor the worst of them.
    """
    ranked = (
        comparison.simulated.group_by("model", "seed")
        .agg(pl.col("d").mean().fill_nan(math.inf).fill_null(math.inf))
        .sort("model", "d", "seed")
        .group_by("model")
        .agg("seed")
    )
    return {model: seeds[(len(seeds) - 1) // 2] for model, seeds in ranked.iter_rows()}


def column(table: pl.DataFrame, name: str) -> NDArray[np.float64]:
    """One column as floats; what is missing or has diverged is NaN, which draws as a gap."""
    values = table[name].cast(pl.Float64).fill_null(math.nan).to_numpy()
    return np.where(np.isfinite(values), values, np.nan)


def pieces(table: pl.DataFrame) -> NDArray[np.intp]:
    """The rows at which a new line begins: another window, or time that was not measured."""
    time = column(table, "time")
    if len(time) < 2:
        return np.empty(0, dtype=np.intp)
    step = np.diff(time)
    begins = np.abs(step) > 1.5 * np.nanmedian(np.abs(step))
    if "window" in table.columns:
        begins |= np.diff(table["window"].to_numpy()) != 0
    return np.flatnonzero(begins) + 1


def _in_display_units(table: pl.DataFrame, of: tuple[channels.Channel, ...]) -> pl.DataFrame:
    return table.with_columns(pl.col(c.name).cast(pl.Float64) * c.to_display for c in of)
