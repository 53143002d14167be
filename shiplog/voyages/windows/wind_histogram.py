"""How often the apparent wind was how strong and from where, in the bins of the paper's Fig. 4."""

from __future__ import annotations

import numpy as np
import polars as pl
from numpy.typing import NDArray

SPEED_BIN = 0.25  # m/s, the paper's
ANGLE_BIN = 20.0  # deg, the paper's
FASTEST = 100.0  # m/s: beyond is an instrument's fault, and would make the picture all empty


def wind_counts(table: pl.DataFrame, fastest: float) -> NDArray[np.int64]:
    """[direction, speed] rows in each bin of the paper's Fig.: 20 deg and 0.25 m/s.

    table     wind_speed [m/s] and wind_angle [deg]
    fastest   m/s, where the bins of the speed end
    """
    wind = table.select("wind_speed", "wind_angle").drop_nulls().drop_nans()
    direction = wind["wind_angle"].to_numpy() % 360.0
    directions = np.arange(0.0, 360.0 + ANGLE_BIN, ANGLE_BIN)
    speeds = np.arange(0.0, fastest + SPEED_BIN / 2.0, SPEED_BIN)
    count, _, _ = np.histogram2d(
        direction, wind["wind_speed"].to_numpy(), bins=(directions, speeds)
    )
    return count.astype(np.int64)
