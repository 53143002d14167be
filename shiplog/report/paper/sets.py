"""The eight window sets as tables: their sizes (Table 3), what their data cover (Figs. 3, 4)."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np
import polars as pl

from shiplog.nomenclature import channels
from shiplog.voyages.windows.augmentation import AUGMENTATIONS
from shiplog.voyages.windows.wind_histogram import ANGLE_BIN, FASTEST, SPEED_BIN, wind_counts

HISTOGRAM_BINS = 30  # of a histogram of one channel


def sizes(
    plans: Mapping[str, pl.DataFrame], voyages: Mapping[str, Sequence[str]], size: int
) -> pl.DataFrame:
    """set, voyages, step and copies of Table 3, windows, samples: one row a set.

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
    turning = {*angles, channels.YAW_RATE.name}
    found = []
    for column in columns:
        factor = 1.0 / channels.DEGREE if column in turning else 1.0
        values = {name: frame[column].drop_nulls().to_numpy() * factor
                  for name, frame in rows.items()}  # fmt: skip
        every = np.concatenate(list(values.values()))
        edges = np.histogram_bin_edges(every, HISTOGRAM_BINS)
        for name, own in values.items():
            counts, _ = np.histogram(own, edges)
            found.append(pl.DataFrame({
                "set": name, "channel": column, "low": edges[:-1], "high": edges[1:],
                "seconds": counts,
            }))  # fmt: skip
    return pl.concat(found)


def wind(rows: Mapping[str, pl.DataFrame]) -> pl.DataFrame:
    """set, speed [m/s] and angle [deg, 0 to 360 from the bow] of a bin's lower corner, seconds, and
    speed_bin [m/s]: the apparent wind; bins without a second are left out.

    rows     the 1 Hz rows of each set, wind_angle in rad
    """
    frames = {name: frame.with_columns(pl.col("wind_angle") / channels.DEGREE)
             for name, frame in rows.items()}  # fmt: skip
    speeds = np.concatenate([f["wind_speed"].drop_nulls().to_numpy() for f in frames.values()])
    fastest = SPEED_BIN * (math.floor(float(speeds.max(initial=0.0)) / SPEED_BIN) + 1)
    fastest = min(fastest, FASTEST)
    found = []
    for name, frame in frames.items():
        counts = wind_counts(frame, fastest).T
        speed, angle = np.nonzero(counts)
        found.append(pl.DataFrame({
            "set": [name] * len(speed), "speed": speed * SPEED_BIN, "angle": angle * ANGLE_BIN,
            "seconds": counts[speed, angle],
        }, schema_overrides={"set": pl.String}))  # fmt: skip
    return pl.concat(found).with_columns(speed_bin=pl.lit(SPEED_BIN))
