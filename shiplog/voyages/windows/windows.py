"""Windows of I samples: planned as rows (voyage, segment, start, copy), then cut to arrays.

A window never crosses a segment, so never a gap. The paper's reference set is slicing with the
step S = I; training adds noise to the velocities of its noisy copies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.exceptions import WindowError
from shiplog.nomenclature import channels

SIZE = channels.WINDOW


def seconds_since(dt: np.ndarray) -> np.ndarray:
    """[N, I] seconds since the first sample, of step lengths [N, I - 1]."""
    return np.pad(np.cumsum(dt, axis=1), ((0, 0), (1, 0)))


@dataclass(frozen=True)
class Windows:
    """N windows of I samples, row by row with their plan; float64.

    plan      [N]           voyage, segment, start, copy, elapsed (s into the voyage)
    state     [N, I, 6]     channels.STATE, SI; heading unwrapped within each window
    actuator  [N, I, A]     the profile's order, rad, rev/s or 1
    wind      [N, I, 0|2]   apparent wind speed [m/s] and angle [rad]
    dt        [N, I - 1]    step lengths, s
    """

    plan: pl.DataFrame
    state: np.ndarray
    actuator: np.ndarray
    wind: np.ndarray
    dt: np.ndarray

    def __len__(self) -> int:
        return self.state.shape[0]

    @property
    def velocity(self) -> np.ndarray:
        """[N, I, 3] surge, sway, yaw rate."""
        return np.take(self.state, channels.VELOCITY_IN_STATE, axis=-1)

    @property
    def since(self) -> np.ndarray:
        """[N, I] seconds since each window began."""
        return seconds_since(self.dt)

    def pick(self, rows: np.ndarray) -> Windows:
        """The windows at these row numbers."""
        return Windows(
            self.plan[rows], self.state[rows], self.actuator[rows], self.wind[rows], self.dt[rows]
        )


def plan(table: pl.LazyFrame, size: int, step: int, copies: int = 0) -> pl.LazyFrame:
    """One row per window: its voyage, segment, first row and noisy copy, Eqs. 14 and 18.

    `step == size` is the reference dataset (Eq. 12): cutting without overlap is slicing with
    S = I. `copies` keeps M noisy copies and not the clean original (Eq. 16); 0 is clean.
    """
    noisy = list(range(1, copies + 1)) or [0]
    last = pl.len().cast(pl.Int64) - size  # signed: a segment shorter than I has no window
    return (
        table.group_by("voyage", "segment", maintain_order=True)
        .agg(start=pl.int_range(0, last + 1, step))
        .explode("start")
        .drop_nulls("start")
        .join(pl.LazyFrame({"copy": noisy}), how="cross")
    )


def cut(
    seconds: pl.DataFrame,
    planned: pl.DataFrame,
    size: int,
    actuators: tuple[str, ...],
    wind: tuple[str, ...],
) -> Windows:
    """Gather planned windows from the sorted 1 Hz table (clean; training adds noise).

    Raises WindowError where nothing was planned, saying how long the longest segment is.
    """
    if planned.height == 0:
        raise WindowError(*_too_long(seconds, size))
    first = (
        seconds.with_row_index("row")
        .group_by("voyage", "segment", maintain_order=True)
        .agg(first=pl.col("row").first())
    )
    plan = planned.join(first, on=["voyage", "segment"], how="left", maintain_order="left")
    begin = (plan["first"].cast(pl.Int64) + plan["start"]).to_numpy()
    rows = begin[:, None] + np.arange(size)
    times = seconds["time"].to_physical().to_numpy()[rows]
    if "elapsed" in seconds.columns:
        elapsed = seconds["elapsed"].to_numpy()[rows[:, 0]]
    else:  # the rows of a run that has not kept it: from their first one
        departure = seconds.select(pl.col("time").min().over("voyage"))["time"].to_physical()
        elapsed = (times[:, 0] - departure.to_numpy()[rows[:, 0]]) * 1e-9

    def gather(names: tuple[str, ...]) -> np.ndarray:
        if not names:
            return np.zeros((*rows.shape, 0))
        return seconds.select(names).to_numpy()[rows].astype(np.float64)

    state = gather(tuple(c.name for c in channels.STATE))
    state[..., 4] = np.unwrap(state[..., 4], axis=1)
    return Windows(
        plan=planned.with_columns(elapsed=pl.Series(elapsed)),
        state=state,
        actuator=gather(actuators),
        wind=gather(wind),
        dt=np.diff(times, axis=1) * 1e-9,
    )


def _too_long(seconds: pl.DataFrame, size: int) -> tuple[str, str]:
    lengths = seconds.group_by("voyage", "segment").len().sort("len", descending=True)
    if lengths.height == 0:
        return (
            "No usable second is left in these voyages.",
            "ingest their logs again: `shiplog ingest` reports what makes rows unusable.",
        )
    voyage, _, longest = lengths.row(0)
    shorter = f"choose --window {max(longest // 2, channels.LEAST_WINDOW)} or shorter, or "
    return (
        f"A window of {size} samples is longer than every segment; the longest, of {voyage}, has "
        f"{longest} seconds without a gap.",
        f"{shorter if longest >= channels.LEAST_WINDOW else ''}ingest longer voyages.",
    )
