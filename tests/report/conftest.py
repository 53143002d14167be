"""Two circles compared with two models, and their recording."""

import polars as pl
import pytest
from recordings import circle

from shiplog.report import viewer
from shiplog.report.viewer.comparison_data import ComparisonData, DrawnActuator


def rollouts(measured, model, seed):
    """Two windows of 100 s in which the surge drifts off by a speed that the seed decides."""
    starboard = 0.01 * (seed + 1)
    return measured.filter(pl.col("time") < 200).select(
        "voyage", "time", "x0", "y0", "sway", "heading", "yaw_rate",
        model=pl.lit(model),
        seed=pl.lit(seed),
        window=(pl.col("time") // 100).cast(pl.Int64),
        surge=pl.col("surge") + starboard * (pl.col("time") % 100) / 100,
        d=(starboard * (pl.col("time") % 100)) ** 2,
    )  # fmt: skip


@pytest.fixture(scope="module")
def compared():
    measured = pl.concat([circle("harbour"), circle("open sea", east=20.0)])
    simulated = [
        rollouts(measured, model, seed) for model in ("network fast", "mmg") for seed in (0, 1)
    ]
    return ComparisonData(
        title="two circles",
        ship_length=3.0,
        ship_breadth=0.5,
        actuators=(
            DrawnActuator("rudder_port", "rudder", "rad"),
            DrawnActuator("propeller", "propeller", "rev/s"),
        ),
        has_wind=True,
        measured=measured,
        simulated=pl.concat(simulated),
        training=measured.drop("voyage", "time").head(60).with_columns(wind_speed=pl.lit(2.0)),
        summary="| model | L |\n|---|---|\n| mmg | 1 |\n",
        banks=(((-10.0, -10.0), (-10.0, 40.0)),),
    )  # fmt: skip


@pytest.fixture(scope="module")
def saved(compared, tmp_path_factory):
    path = tmp_path_factory.mktemp("viewer") / "compare.rrd"
    viewer.save(compared, path)
    return path
