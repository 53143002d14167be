"""The eight window sets as tables: their sizes (Table 4), what their data cover (Figs. 6, 7)."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np
import polars as pl

from shiplog.channels import VELOCITY
from shiplog.config import AUGMENTATIONS

SETS = tuple(AUGMENTATIONS)
BINS = 30  # of a histogram of one channel
WIND_SPEED_BIN = 0.25  # m/s, the paper's
WIND_ANGLE_BIN = 20.0  # deg, the paper's
MOST_SPEED_BINS = 40  # in stronger winds bins are wider
DEGREE = 180.0 / math.pi


def sizes(plans: Mapping[str, pl.DataFrame], voyages: Mapping[str, Sequence[str]], size: int):
    """set, voyages, step and copies of Table 4, windows, samples: one row a set.

    plans    the planned windows of each set, a row a window
    voyages  which each set is cut from
    size     samples of a window; steps are of windows of 100 and scale with it
    """
    rows = []
    for name, plan in plans.items():
        augmentation = AUGMENTATIONS[name]
        step = max(1, augmentation.step * size // 100)
        rows.append({
            "set": name, "voyages": ", ".join(voyages[name]), "step": step,
            "copies": augmentation.copies, "windows": plan.height, "samples": plan.height * size,
        })  # fmt: skip
    return pl.DataFrame(rows)


def histograms(
    rows: Mapping[str, pl.DataFrame], columns: Sequence[str], angles: Collection[str] = ()
) -> pl.DataFrame:
    """set, channel, low, high, seconds: how often each velocity and actuator was where.

    rows     the 1 Hz rows of each set
    columns  of them; all sets share a channel's bins
    angles   those in rad, which become degrees as the yaw rate does
    """
    turning = {*angles, *(c.name for c in VELOCITY if c.unit == "rad/s")}
    found = []
    for column in columns:
        factor = DEGREE if column in turning else 1.0
        values = {name: frame[column].drop_nulls().to_numpy() * factor
                  for name, frame in rows.items()}  # fmt: skip
        every = np.concatenate(list(values.values()))
        edges = np.histogram_bin_edges(every, BINS)
        for name, own in values.items():
            counts, _ = np.histogram(own, edges)
            found.append(pl.DataFrame({
                "set": name, "channel": column, "low": edges[:-1], "high": edges[1:],
                "seconds": counts,
            }))  # fmt: skip
    return pl.concat(found)


def wind(rows: Mapping[str, pl.DataFrame]) -> pl.DataFrame:
    """set, speed [m/s] and angle [deg, 0 to 360 from the bow] of a bin's lower corner, speed_bin,
    seconds: the apparent wind; bins without a second are left out."""
    fastest = max(float(np.nanmax(f["wind_speed"].to_numpy(), initial=0.0)) for f in rows.values())
    width = WIND_SPEED_BIN * max(1, math.ceil(fastest / WIND_SPEED_BIN / MOST_SPEED_BINS))
    found = []
    for name, frame in rows.items():
        own = frame.select("wind_speed", "wind_angle").drop_nulls()
        angle = (pl.col("wind_angle") * DEGREE) % 360.0
        found.append(
            own.select(
                set=pl.lit(name),
                speed=(pl.col("wind_speed") / width).floor() * width,
                angle=(angle / WIND_ANGLE_BIN).floor() * WIND_ANGLE_BIN,
            )
            .group_by("set", "speed", "angle")
            .agg(seconds=pl.len().cast(pl.Int64))
            .sort("speed", "angle")
        )
    return pl.concat(found).with_columns(speed_bin=pl.lit(width))
