"""Voyages as the pictures need them: where and when they began, and in what they sailed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.exceptions import ShiplogError
from shiplog.report.figures.picture_data import SCHEMAS, TRAINING, TRIAL
from shiplog.report.figures.wind import mean_wind, true_wind
from shiplog.ship_profile.profile import Profile
from shiplog.training.runs.load_model import Run
from shiplog.voyages.store.store import Store

MOST_CONDITIONS = 4000  # rows a campaign: more change no histogram
WIND = ("wind_speed", "wind_angle")  # apparent: m/s, rad where it comes from, from the bow


@dataclass(frozen=True)
class Seconds:
    """The judged voyages: their 1 Hz rows, and a row each as `PictureData.voyages`."""

    profile: Profile
    names: tuple[str, ...]
    rows: pl.DataFrame
    voyages: pl.DataFrame

    @staticmethod
    def of(store: Store, names: Sequence[str], profile: Profile) -> Seconds:
        rows = store.seconds(names, profile)
        return Seconds(profile, tuple(names), rows, voyages_of(store, names, rows, profile))


def voyages_of(
    store: Store, names: Sequence[str], rows: pl.DataFrame, profile: Profile
) -> pl.DataFrame:
    """A row a voyage, as `PictureData.voyages`, of their 1 Hz rows."""
    found = []
    for name in names:
        start, place = store.origin(name)
        own = rows.filter(pl.col("voyage") == name)
        wind = mean_wind(*_true_wind(own)) if profile.has_wind else None
        arrow = (wind.speed, wind.comes_from) if wind is not None and wind.steady else (None, None)
        seconds = float(own["elapsed"].to_numpy().max()) if len(own) else 0.0
        found.append((name, start, seconds, *(place or (None, None)), *arrow))
    return pl.DataFrame(found, SCHEMAS["voyages"], orient="row")


def _true_wind(rows: pl.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    columns = (*WIND, "surge", "sway", "heading")
    return true_wind(*(rows[k].cast(pl.Float64).to_numpy() for k in columns))


def conditions(run: Run | None, rows: pl.DataFrame, profile: Profile) -> pl.DataFrame:
    """Of training and trial; of a model that was trained on nothing, of the trial alone."""
    parts = [_condition(TRIAL, rows, profile)]
    try:
        trained = None if run is None or run.given else run.training()
    except ShiplogError:
        trained = None
    if trained is not None and len(trained):
        parts.append(_condition(TRAINING, trained, profile))
    return pl.concat(parts)


def _condition(campaign: str, rows: pl.DataFrame, profile: Profile) -> pl.DataFrame:
    rows = rows.gather_every(max(1, len(rows) // MOST_CONDITIONS))
    surge, sway, yaw_rate = (
        rows[k].cast(pl.Float64).to_numpy() for k in ("surge", "sway", "yaw_rate")
    )
    wind = dict.fromkeys(("wind_speed", "wind_from"))
    if profile.has_wind and set(WIND) <= set(rows.columns):
        north, east = _true_wind(rows)
        wind = {"wind_speed": np.hypot(north, east), "wind_from": np.arctan2(east, north)}
    found = {
        "speed": np.hypot(surge, sway), "drift": np.arctan2(-sway, surge), "yaw_rate": yaw_rate,
        **{k: v for k, v in wind.items() if v is not None},
    }  # fmt: skip
    table = pl.DataFrame(found).with_columns(
        pl.lit(campaign).alias("campaign"),
        *(pl.lit(None, pl.Float64).alias(k) for k, v in wind.items() if v is None),
    )
    return table.select(pl.col(k).cast(v) for k, v in SCHEMAS["conditions"].items())
