"""Where the model was trained and where it is judged: wind, drift angle and yaw rate."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from shiplog.report import colours
from shiplog.report.figures.content import Content, Picture
from shiplog.report.figures.picture_data import TRAINING, TRIAL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SECTORS = 16  # of a wind rose
BINS = 24  # a side, of drift angle against yaw rate
HALF_TURN = 180.0  # deg
SPAN = (0.005, 0.995)  # of the rows, that the axes show
CAMPAIGNS = {TRAINING: colours.TRAINING, TRIAL: colours.VERMILLION}
STYLE = {TRAINING: "training voyages", TRIAL: "these voyages"}


def wind_table(content: Content) -> pl.DataFrame:
    """campaign, from_deg (the middle of a sector), speed [m/s, mean], share of the rows."""
    rows = content.data.conditions.drop_nulls(["wind_speed", "wind_from"])
    width = 360.0 / SECTORS
    sector = ((pl.col("wind_from").degrees() / width).round() % SECTORS).cast(pl.Int64)
    return (
        rows.with_columns(sector=sector)
        .group_by("campaign", "sector")
        .agg(speed=pl.col("wind_speed").mean(), rows=pl.len())
        .with_columns(share=pl.col("rows") / pl.col("rows").sum().over("campaign"))
        .select("campaign", from_deg=pl.col("sector") * width, speed="speed", share="share")
        .sort("campaign", "from_deg")
    )


def draw_wind(axes: Axes, rows: pl.DataFrame, content: Content) -> None:
    """Each sector as long as the mean speed of the wind from there."""
    from matplotlib.projections.polar import PolarAxes

    assert isinstance(axes, PolarAxes)
    axes.set_theta_zero_location("N")
    axes.set_theta_direction(-1)
    for campaign, colour in CAMPAIGNS.items():
        own = rows.filter(pl.col("campaign") == campaign)
        if own.is_empty():
            continue
        outlined = campaign == TRIAL
        axes.bar(
            np.radians(own["from_deg"].to_numpy()), own["speed"].to_numpy(),
            width=(0.95 if not outlined else 0.6) * 2.0 * math.pi / SECTORS,
            color="none" if outlined else colours.web(colour), edgecolor=colours.web(colour),
            linewidth=1.4 if outlined else 0.0, label=STYLE[campaign],
        )  # fmt: skip
    axes.set_xticks(np.radians([0, 90, 180, 270]), ["N", "E", "S", "W"])
    axes.yaxis.set_major_formatter(lambda v, _: f"{v:g} m/s")
    axes.tick_params(labelsize=7.0)
    axes.legend(loc="upper left", bbox_to_anchor=(-0.42, 1.14))


def wind_words(rows: pl.DataFrame, content: Content) -> str:
    if rows.is_empty():
        return "No wind is recorded."
    found = []
    for campaign in CAMPAIGNS:
        own = rows.filter(pl.col("campaign") == campaign).sort("share", descending=True)
        if len(own):
            found.append(
                f"{STYLE[campaign]} mostly from {own['from_deg'][0]:.0f} deg "
                f"({own['speed'][0]:.1f} m/s), from {len(own)} of {SECTORS} sectors"
            )
    return f"True wind, where it comes from: {'; '.join(found)}."


def drift_table(content: Content) -> pl.DataFrame:
    """campaign, drift_deg, yaw_rate_degps: the middles of bins in which the ship was, and share of
    the rows there."""
    rows = content.data.conditions.drop_nulls(["drift", "yaw_rate"]).with_columns(
        pl.col("drift").degrees(), pl.col("yaw_rate").degrees()
    )
    schema = {"campaign": pl.String, "drift_deg": pl.Float64, "yaw_rate_degps": pl.Float64,
              "share": pl.Float64}  # fmt: skip
    if rows.is_empty():
        return pl.DataFrame(schema=schema)
    edges = []
    for name in ("drift", "yaw_rate"):
        low, high = np.quantile(rows[name].to_numpy(), SPAN)
        half = 0.5 * max(high - low, 1e-6)
        most = HALF_TURN if name == "drift" else math.inf  # no bin beyond what an angle can be
        edges.append(
            np.linspace(max(low - 0.1 * half, -most), min(high + 0.1 * half, most), BINS + 1)
        )
    found = []
    for campaign in CAMPAIGNS:
        own = rows.filter(pl.col("campaign") == campaign)
        count, *_ = np.histogram2d(own["drift"].to_numpy(), own["yaw_rate"].to_numpy(), edges)
        for i, j in zip(*np.nonzero(count), strict=True):
            middle = [0.5 * (e[k] + e[k + 1]) for e, k in zip(edges, (i, j), strict=True)]
            found.append((campaign, *middle, count[i, j] / len(own)))
    return pl.DataFrame(found, schema, orient="row")


def draw_drift(axes: Axes, rows: pl.DataFrame, content: Content) -> None:
    for campaign, colour in CAMPAIGNS.items():
        own = rows.filter(pl.col("campaign") == campaign)
        if own.is_empty():
            continue
        inside = campaign == TRIAL
        axes.plot(
            own["drift_deg"].to_numpy(), own["yaw_rate_degps"].to_numpy(), "o" if inside else "s",
            color=colours.web(colour), markersize=2.6 if inside else 5.0,
            markeredgewidth=0.0, label=STYLE[campaign],
        )  # fmt: skip
    axes.set_xlabel("drift angle β = atan2(-v, u) [deg]")
    axes.set_ylabel("yaw rate [deg/s]")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.18), ncols=2)


def drift_words(rows: pl.DataFrame, content: Content) -> str:
    cells = {
        c: set(rows.filter(pl.col("campaign") == c).select("drift_deg", "yaw_rate_degps").rows())
        for c in CAMPAIGNS
    }
    if not cells[TRIAL]:
        return "No motion is recorded."
    if not cells[TRAINING]:
        return f"Drift angle and yaw rate of these voyages, in {len(cells[TRIAL])} cells."
    both = len(cells[TRIAL] & cells[TRAINING])
    return (
        "Drift angle against yaw rate: the training voyages were in "
        f"{both} of the {len(cells[TRIAL])} cells in which these voyages are."
    )


WIND = Picture("Wind in training and trial", wind_table, draw_wind, wind_words, polar=True)
DRIFT = Picture("Drift angle and yaw rate", drift_table, draw_drift, drift_words)
