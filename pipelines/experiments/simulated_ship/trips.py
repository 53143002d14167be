"""One table of some trips, as a ship's logger would write it: for the tutorial."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import polars as pl

from pipelines.experiments.simulated_ship.sensors import Blemishes, measure
from pipelines.experiments.simulated_ship.ship import Effects
from pipelines.experiments.simulated_ship.voyage import sail
from pipelines.experiments.simulated_ship.weather import Wind

SEED = 77001
STEP_S = 0.2
KNOT = 1852.0 / 3600.0
HIDDEN = Effects(thrust_loss=0.22)  # of september's trips
TRIPS = {  # seconds, start, wind
    "june_1": (1200.0, datetime(2026, 6, 3, 6, 0, tzinfo=UTC), Wind(2.0, 1.2)),
    "june_2": (1200.0, datetime(2026, 6, 3, 7, 0, tzinfo=UTC), Wind(3.0, 2.6)),
    "june_3": (1200.0, datetime(2026, 6, 4, 6, 0, tzinfo=UTC), Wind(2.5, -1.0)),
    "september_1": (900.0, datetime(2026, 9, 8, 6, 0, tzinfo=UTC), Wind(2.2, 0.4)),
    "september_2": (900.0, datetime(2026, 9, 8, 7, 0, tzinfo=UTC), Wind(2.8, -2.0)),
}
COLUMNS = {  # of the table: topic, field, factor
    "Lat": ("/gnss/fix", "latitude", 1.0), "Lon": ("/gnss/fix", "longitude", 1.0),
    "SOG (kn)": ("/gnss/velocity", "sog_mps", 1.0 / KNOT),
    "COG (deg)": ("/gnss/velocity", "cog_deg", 1.0),
    "Heading (deg)": ("/gyro", "heading_deg", 1.0),
    "ROT (deg/min)": ("/gyro", "yaw_rate_degps", 60.0),
    "Wind speed (kn)": ("/wind/apparent", "speed_mps", 1.0 / KNOT),
    "Wind angle (deg)": ("/wind/apparent", "direction_deg", 1.0),
    "Rudder port (deg)": ("/rudder/port", "angle_deg", 1.0),
    "Rudder starboard (deg)": ("/rudder/starboard", "angle_deg", 1.0),
    "Shaft (rpm)": ("/propeller/main", "speed_rps", 60.0),
}  # fmt: skip
DIGITS = {"Lat": 8, "Lon": 8}
ROUND = ("COG (deg)", "Heading (deg)", "Wind angle (deg)")  # through 360 back to 0


def write_trips(path: str | Path) -> None:
    """Sail and write all trips into one table with semicolons. The same bytes every time."""
    tables = []
    for number, (name, (seconds, start, wind)) in enumerate(TRIPS.items()):
        effects = HIDDEN if name.startswith("september") else Effects()
        voyage = sail(seconds, seed=SEED + number, wind=wind, effects=effects)
        series = {
            one.topic: one
            for one in measure(voyage, seed=SEED + number, start=start, blemishes=Blemishes())
        }
        began = round(start.timestamp() * 1e9)
        ticks = np.arange(1.0, seconds - 1.0, STEP_S)
        columns = {}
        for column, (topic, field, factor) in COLUMNS.items():
            one = series[topic]
            at, values = (one.time - began) * 1e-9, factor * one.columns[field]
            if column in ROUND:
                values = np.rad2deg(np.unwrap(np.deg2rad(values)))
            columns[column] = np.interp(ticks, at, values)
            if column in ROUND:
                columns[column] %= 360.0
            columns[column] = columns[column].round(DIGITS.get(column, 3))
        times = [
            (start + timedelta(seconds=float(t))).isoformat(timespec="milliseconds") for t in ticks
        ]
        tables.append(pl.DataFrame({"Time": times, "Trip": [name] * len(ticks)} | columns))
    pl.concat(tables).write_csv(path, separator=";")
