"""How long a window is in a ship's own time, its length over its speed: L/U, T' = U t/L.

The paper's 100 s are 10 to 20 L/U of its ship, 3 m at 0.3 to 0.6 m/s. `--window auto` takes as much
of another ship's time, in steps of two as segments do.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from shiplog.nomenclature.channels import WINDOW
from shiplog.nomenclature.numbers import figure
from shiplog.voyages.rows import timescale

if TYPE_CHECKING:
    import polars as pl

FEWEST = 6  # windows: of fewer, no interval is given for an error
SENSIBLE = (0.5 * WINDOW / timescale.SHIP_TIME, 2.0 * WINDOW / timescale.SHIP_TIME)  # 7 to 28 L/U
AT_REST = 1e-3  # m/s: a ship that does not move has no time of its own


@dataclass(frozen=True)
class ShipTime:
    """A ship's length [m] and the working speed [m/s] of its voyages."""

    length: float
    speed: float

    @property
    def seconds(self) -> float:
        """L/U."""
        return self.length / self.speed if self.speed > AT_REST else math.inf

    def times(self, window: int) -> float:
        """T' of a window of so many seconds."""
        return window / self.seconds

    @property
    def window(self) -> int:
        """s, as long for this ship as 100 s are for one of three metres."""
        if not math.isfinite(self.seconds):
            return WINDOW
        return round(WINDOW * timescale.of_ship(self.length, self.speed).factor)

    def auto(self, count: Callable[[int], int]) -> int:
        """The same; half as long as often as it takes for `FEWEST` windows, but not below the
        paper's.

        count   seconds → windows of that length
        """
        seconds = self.window
        while seconds > WINDOW and count(seconds) < FEWEST:
            seconds //= 2
        return seconds

    def words(self, window: int) -> str:
        """Such as `14 ship times L/U`; empty of a ship at rest."""
        times = self.times(window)
        return f"{figure(times)} ship times L/U" if times > 0.0 else ""

    def advice(self, window: int) -> str:
        """A sentence where the window does not suit the ship; else empty."""
        times, other = self.times(window), self.window
        if times <= 0.0 or SENSIBLE[0] <= times <= SENSIBLE[1]:
            return ""
        little = times < SENSIBLE[0]
        if (other <= window) if little else (other >= window):  # nothing suits it better
            return ""
        why = "a manoeuvre takes longer" if little else "errors have long grown out of proportion"
        return (
            f"A window of {window} s is {figure(times)} times L/U of this ship, "
            f"{figure(self.length, 3)} m at {figure(self.speed)} m/s; {SENSIBLE[0]:.0f} to "
            f"{SENSIBLE[1]:.0f} suit it: {why}. A training with --window auto takes {other} s, if "
            "the voyages are long enough."
        )


def of(length: float, rows: pl.DataFrame) -> ShipTime:
    """Of a ship's 1 Hz rows.

    length   m
    rows     with surge and sway [m/s]
    """
    speeds = np.hypot(rows["surge"].to_numpy(), rows["sway"].to_numpy())
    working = float(np.quantile(speeds, timescale.WORKING)) if len(speeds) else 0.0
    return ShipTime(length, working)
