"""The band of a model that knows its doubt, about each channel and each heading."""

import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from recordings import TURNING, entities, rows, views

from shiplog.report import viewer
from shiplog.report.viewer import (
    display,
    recording,
)


def with_band(simulated, model, **half):
    """The rollouts with a band of that half width about each channel, of one model only."""
    of = pl.when(pl.col("model") == model)
    ends = {
        name + end: of.then(pl.col(name) + sign * width)
        for name, width in half.items()
        for end, sign in (("_low", -1), ("_high", 1))
    }
    return simulated.with_columns(**ends)


def test_a_model_that_knows_its_doubt_is_drawn_with_its_band(compared, tmp_path):
    half = {"surge": 0.1, "yaw_rate": math.radians(2.0), "x0": 3.0}
    simulated = with_band(compared.simulated, "mmg", **half)
    # the displayed seed is 0: what the other one carries must not be drawn
    simulated = simulated.with_columns(
        surge_high=pl.when(pl.col("seed") == 0).then(pl.col("surge_high")).otherwise(9.0)
    )
    rrd = tmp_path / "band.rrd"
    viewer.save(replace(compared, simulated=simulated), rrd)
    surge = rows(rrd, "/state/harbour/surge/band/mmg", "Scalars:scalars")["Scalars:scalars"]
    assert len(surge) == 201 and np.isnan(surge[100].to_numpy()).all()  # between the windows
    assert surge[50].to_list() == pytest.approx([0.405, 0.605])  # 0.5 + 0.01/2, give or take 0.1
    turn = rows(rrd, "/state/harbour/yaw_rate/band/mmg", "Scalars:scalars")["Scalars:scalars"]
    assert turn[7].to_list() == pytest.approx([4.0, 8.0])  # deg/s
    north = rows(rrd, "/state/harbour/x0/band/mmg", "Scalars:scalars")["Scalars:scalars"]
    assert north[0].to_list() == pytest.approx([-3.0, 3.0])
    output = rows(rrd, "/state/harbour/surge/band/mmg", "SeriesLines:names")
    assert output["SeriesLines:names"][0].to_list() == ["90 % band"] * 2
    text = entities(rrd)
    assert "/state/harbour/surge/seeds/mmg" not in text
    for without in (
        r"surge/seeds/network\ fast", "sway/seeds/mmg",  # no columns: as without bands
    ):  # fmt: skip
        assert f"/state/harbour/{without}" in text, without
    assert r"band/network" not in text and "/error/harbour/position/seeds/mmg" in text


def test_without_bands_none_is_drawn(saved, compared):
    assert "/band/" not in entities(saved)
    titles = {view["name"] for view in views(recording.layout(display.drawn(compared)))}
    assert "surge u [m/s]" in titles
    banded = replace(compared, simulated=with_band(compared.simulated, "mmg", surge=0.1))
    titles = {view["name"] for view in views(recording.layout(display.drawn(banded)))}
    assert "surge u [m/s], pale lines: 90 % band of mmg" in titles and "surge u [m/s]" not in titles


@pytest.mark.parametrize("wrapped", [True, False], ids=["wrapped", "free-running"])
def test_a_band_of_headings_stays_about_its_heading(compared, wrapped):
    """Ten degrees on either side, although -180 is passed by each line at another time."""
    free = compared.simulated.with_columns(heading=TURNING * (pl.col("time") % 100))
    banded = with_band(free, "mmg", heading=math.radians(10.0))
    if wrapped:
        names = ("heading", "heading_low", "heading_high")
        banded = banded.with_columns(
            pl.arctan2(pl.col(name).sin(), pl.col(name).cos()).alias(name) for name in names
        )
    drawn = display.drawn(replace(compared, simulated=banded)).simulated
    mmg = drawn.filter(pl.col("model") == "mmg")
    assert (mmg["heading_high"] - mmg["heading"]).to_numpy() == pytest.approx(10.0)
    assert (mmg["heading"] - mmg["heading_low"]).to_numpy() == pytest.approx(10.0)
    assert drawn.filter(pl.col("model") != "mmg")["heading_low"].null_count() == 800
