"""The tables as they are drawn: display units, headings without jumps, one drawn seed a model."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import numpy as np
import polars as pl
from numpy.typing import NDArray

from shiplog.nomenclature import channels
from shiplog.report.viewer.comparison_data import BAND, ComparisonData

TURN = 2.0 * math.pi
ROLLOUT = ("model", "seed", "voyage", "window")  # what one rollout is known by
MOST_TABS = 6  # voyages beyond are in the entity tree: more tabs than fit are not found either


def unwrapped(angle: str, over: tuple[str, ...]) -> pl.Expr:
    """The angle [rad] counted on through ±π, from the first row of each group."""
    step = pl.col(angle).diff().fill_null(0.0)
    step = step - TURN * (step / TURN).round()
    return (pl.col(angle).drop_nulls().first() + step.cum_sum()).over(over)


class Drawn(ComparisonData):
    """A comparison whose tables are in display units, with headings that do not jump."""


def drawn(comparison: ComparisonData) -> Drawn:
    """The same comparison, ready to be drawn."""
    tables = {
        "measured": _measured(comparison),
        "simulated": _simulated(comparison),
        "training": _in_display_units(comparison.training, comparison.channels),
        "forces": _forces(comparison.forces),
    }
    rest = {f.name: getattr(comparison, f.name) for f in fields(comparison)}
    return Drawn(**{**rest, **tables})


def _measured(comparison: ComparisonData) -> pl.DataFrame:
    """Heading free-running, wind from 0 to 360 deg."""
    table = comparison.measured.with_columns(heading=unwrapped("heading", ("voyage",)))
    if comparison.has_wind:
        table = table.with_columns(wind_angle=pl.col("wind_angle") % TURN)
    return _in_display_units(table, comparison.channels)


def _simulated(comparison: ComparisonData) -> pl.DataFrame:
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
    for end in BAND:
        if f"heading{end}" in table.columns:
            table = _with_band_of_heading(table, f"heading{end}")
        ends = (replace(c, name=c.name + end) for c in channels.STATE)
        table = _in_display_units(table, tuple(c for c in ends if c.name in table.columns))
    return _in_display_units(table, channels.STATE)


def _with_band_of_heading(table: pl.DataFrame, name: str) -> pl.DataFrame:
    """An end of the band counted on, from the turn that the rollout's own heading starts in."""
    given = pl.col(name).is_not_null()
    turns = ((pl.col("heading") - pl.col("free")) / TURN).round()
    return (
        table.with_columns(free=unwrapped(name, ROLLOUT))
        .with_columns(turns=pl.when(given).then(turns).drop_nulls().first().over(ROLLOUT))
        .with_columns(pl.when(given).then(pl.col("free") + TURN * pl.col("turns")).alias(name))
        .drop("free", "turns")
    )


def has_band(rollouts: pl.DataFrame, name: str) -> bool:
    """Whether these rollouts of one model carry a band of that state."""
    ends = [name + end for end in BAND]
    return all(e in rollouts.columns and np.isfinite(column(rollouts, e)).any() for e in ends)


def _forces(forces: pl.DataFrame | None) -> pl.DataFrame | None:
    """In order of time, still in N and N m: whether an axis needs kilo, its view decides."""
    if forces is None:
        return None
    return forces.with_columns(pl.col("time", "surge", "sway", "yaw").cast(pl.Float64)).sort(
        "time", maintain_order=True
    )


def drawn_seeds(comparison: ComparisonData) -> dict[str, int]:
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
