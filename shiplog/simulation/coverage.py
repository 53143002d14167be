"""Where the training data never went: the paper's histograms (Figs. 3 and 4) made into numbers.

A network interpolates. For each test window this says which share of its seconds lies inside the
data it was trained on, and on which channel it leaves them, so that "it fails here because it never
saw this wind" can be read off a table.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl
from scipy.spatial import KDTree

from shiplog.nomenclature.channels import VELOCITY
from shiplog.voyages.windows.wind_histogram import ANGLE_BIN, SPEED_BIN

QUANTILE = 0.95  # of the distances that training seconds have from other voyages' or blocks'
BLOCK_ROWS = 100  # rows; neighbours within one block are one manoeuvre, not independent data
WIND_ANGLE_BIN = math.radians(ANGLE_BIN)
BINS_PER_STD = 4.0
OUTSIDE = 0.25  # share of a window outside the histogram above which a channel is named


@dataclass(frozen=True)
class Coverage:
    """The training data as something a sample can be inside of.

    Distance is Euclidean over the standardised (ν, u, ω), wind as components; `limit` is the
    distance that all but 5 % of the training seconds have from the other half of the blocks.
    """

    names: tuple[str, ...]
    mean: np.ndarray
    std: np.ndarray
    tree: KDTree
    limit: float
    bins: dict[str, set[int]]
    wind_bins: set[tuple[int, int]]
    actuators: tuple[str, ...]
    has_wind: bool

    def distance(self, seconds: pl.DataFrame) -> np.ndarray:
        """Distance of each 1 Hz row [n] to the nearest training second, in units of the limit."""
        features = (_features(seconds, self.names) - self.mean) / self.std
        return np.asarray(self.tree.query(features)[0]) / self.limit

    def mark_outside(self, seconds: pl.DataFrame) -> dict[str, np.ndarray]:
        """Per channel, which rows [n] fall into histogram bins that training left empty."""
        result = {}
        for j, name in enumerate((*(c.name for c in VELOCITY), *self.actuators)):
            bins = _bins(seconds[name].to_numpy(), self.std[j])
            result[name] = np.array([b not in self.bins[name] for b in bins.tolist()])
        if self.has_wind:
            pairs = zip(*_wind_bins(seconds), strict=True)
            result["wind"] = np.array([p not in self.wind_bins for p in pairs])
        return result

    def table(self, seconds: pl.DataFrame, windows: pl.DataFrame, size: int) -> pl.DataFrame:
        """One row per planned window: coverage (share of its seconds inside), outside_<channel>.

        seconds is the sorted 1 Hz table that the plan (voyage, segment, start) was made from.
        """
        inside = self.distance(seconds) <= 1.0
        outside = self.mark_outside(seconds)
        first = seconds.with_row_index("row").group_by("voyage", "segment").agg(pl.col("row").min())
        plan = windows.join(first, on=["voyage", "segment"], how="left", maintain_order="left")
        begin = (plan["row"].cast(pl.Int64) + plan["start"]).to_numpy()
        rows = begin[:, None] + np.arange(size)
        shares = {f"outside_{name}": mask[rows].mean(1) for name, mask in outside.items()}
        return pl.DataFrame({"coverage": inside[rows].mean(1), **shares})


def learn(training: pl.DataFrame, actuators: Sequence[str], has_wind: bool) -> Coverage:
    """Learn where the training seconds [n] are. Columns: velocities, actuators, wind."""
    wind = ("wind_ahead", "wind_starboard") if has_wind else ()
    names = (*(c.name for c in VELOCITY), *actuators, *wind)
    values = _features(training, names)
    mean, std = values.mean(0), values.std(0)
    std = np.where(std > 1e-9, std, 1.0)
    features = (values - mean) / std
    limit = independent_distance(features)
    bins = {
        name: set(_bins(training[name].to_numpy(), std[j]).tolist())
        for j, name in enumerate(names)
        if name not in wind
    }
    visited = set(zip(*_wind_bins(training), strict=True)) if has_wind else set()
    return Coverage(
        names, mean, std, KDTree(features), limit, bins, visited, tuple(actuators), has_wind
    )


def independent_distance(features: np.ndarray) -> float:
    """How far all but 5 % of samples [n, Z] lie from the nearest of another stretch of time."""
    even = (np.arange(len(features)) // BLOCK_ROWS) % 2 == 0
    if even.all():  # less than two blocks: nothing to compare with but itself
        even = np.arange(len(features)) % 2 == 0
    apart = np.concatenate(
        (
            KDTree(features[even]).query(features[~even])[0],
            KDTree(features[~even]).query(features[even])[0],
        )
    )
    return max(float(np.quantile(apart, QUANTILE)), 1e-9)


def reason(row: dict, seconds: pl.DataFrame) -> str:
    """Which channels of one window left the training data, in words; empty where none did.

    row: one of `table`; seconds: the 1 Hz rows of that window.
    """
    parts = []
    shares = {k: v for k, v in row.items() if k.startswith("outside_") and v >= OUTSIDE}
    for key, share in sorted(shares.items(), key=lambda item: -item[1]):
        name = key.removeprefix("outside_")
        if name == "wind":
            speed = float(seconds["wind_speed"].mean() or 0.0)  # type: ignore[arg-type]
            angle = seconds["wind_angle"].to_numpy()
            mean = math.degrees(math.atan2(np.sin(angle).mean(), np.cos(angle).mean())) % 360.0
            parts.append(f"wind around {speed:.1f} m/s from {mean:.0f} deg ({share:.0%})")
        else:
            parts.append(f"{name.replace('_', ' ')} ({share:.0%})")
    return "not in the training data: " + ", ".join(parts) if parts else ""


def _features(seconds: pl.DataFrame, names: Sequence[str]) -> np.ndarray:
    if "wind_ahead" in names:
        seconds = seconds.with_columns(
            wind_ahead=pl.col("wind_speed") * pl.col("wind_angle").cos(),
            wind_starboard=pl.col("wind_speed") * pl.col("wind_angle").sin(),
        )
    return seconds.select(names).to_numpy()


def _bins(values: np.ndarray, std: float) -> np.ndarray:
    return np.floor(values * BINS_PER_STD / std).astype(int)


def _wind_bins(seconds: pl.DataFrame) -> tuple[list[int], list[int]]:
    speed = np.floor(seconds["wind_speed"].to_numpy() / SPEED_BIN).astype(int)
    angle = np.floor((seconds["wind_angle"].to_numpy() % (2 * np.pi)) / WIND_ANGLE_BIN).astype(int)
    return speed.tolist(), angle.tolist()
