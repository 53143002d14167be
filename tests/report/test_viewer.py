"""The recording holds what was compared, in the units its axes say."""

import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from recordings import SECONDS, entities, rows, scalars
from rerun.chunk import RrdReader

from shiplog.report import viewer
from shiplog.report.viewer import (
    display,
    histogram,
    timeline,
    trajectory,
)


def tensor(path, entity, component):
    """A tensor's values, which polars cannot hold."""
    (chunk,) = RrdReader(path).stream().filter(content=entity)
    (row,) = chunk.to_record_batch().to_pylist()
    (value,) = row[component]
    return np.array(value["buffer"]).reshape(value["shape"])


def test_the_line_of_a_bank_says_what_it_is(saved):
    table = rows(saved, "/track/harbour/banks/labels", "Points2D:labels")
    assert table["Points2D:labels"].to_list() == [["bank"]]
    ((place,),) = table["Points2D:positions"].to_list()
    assert place[0] == 15.0 and 10.0 < place[1] < 11.0  # just below its middle, north up


def test_everything_compared_is_an_entity(saved):
    text = entities(saved)
    for path in (
        r"/track/harbour/measured", r"/track/harbour/simulated/network\ fast",
        r"/track/open\ sea/simulated/mmg", "/track/harbour/banks", "/state/harbour/surge/measured",
        "/state/harbour/yaw_rate/simulated/mmg", "/actuator/harbour/angle/rudder_port",
        "/actuator/harbour/revolutions/propeller", "/wind/harbour/wind_speed",
        "/error/harbour/position/simulated/mmg", "/error/harbour/heading/simulated/mmg",
        "/hist/surge/training", "/hist/surge/test", "/hist/propeller/test", "/hist/wind/training",
        "/hist/wind/test", "/report",
    ):  # fmt: skip
        assert path in text, path
    assert not list(saved.parent.glob("*.partial")) + list(saved.parent.glob(".*"))


def test_columns_are_whole_and_in_the_units_their_axes_say(saved):
    surge = scalars(saved, "/state/harbour/surge/measured")
    assert surge == pytest.approx(np.full(SECONDS, 0.5))
    assert scalars(saved, "/state/harbour/yaw_rate/measured") == pytest.approx(
        np.full(SECONDS, 6.0)
    )
    assert scalars(saved, "/actuator/harbour/angle/rudder_port")[0] == pytest.approx(-35.0)
    assert scalars(saved, "/wind/harbour/wind_angle")[0] == pytest.approx(310.0)


def test_a_heading_is_broken_where_it_passes_north(saved):
    """6 deg/s for 200 s: it is north at 60, 120 and 180 s, and south one time in between each."""
    heading = scalars(saved, "/state/harbour/heading/measured")
    breaks = np.flatnonzero(np.isnan(heading))
    assert len(heading) == SECONDS + 3 == SECONDS + len(breaks)
    assert np.nanmin(heading) >= 0.0 and np.nanmax(heading) <= 360.0
    assert np.abs(np.diff(heading))[np.isfinite(np.diff(heading))].max() == pytest.approx(6.0)
    assert np.delete(heading, breaks)[[0, 30, 59, 61]] == pytest.approx([0.0, 180.0, 354.0, 6.0])


def test_the_seam_lies_where_the_ship_does_not_pass(compared):
    """About north all the time: a heading of 350 to 10 deg is drawn as -10 to 10, in one line."""
    rows = compared.measured.with_columns(heading=0.17 * (pl.col("time") * 0.1).sin())
    drawn = display.drawn(replace(compared, measured=rows))
    assert timeline.compass_seam(drawn, "harbour") == 180.0
    south = display.drawn(replace(compared, measured=rows.with_columns(pl.col("heading") + 3.1)))
    assert timeline.compass_seam(south, "harbour") == 360.0


def test_windows_start_anew_and_break_at_the_seam(saved):
    table = rows(saved, "/state/harbour/heading/simulated/mmg", "Scalars:scalars")
    heading = table["Scalars:scalars"].explode().to_numpy()
    assert len(heading) == 204  # two windows of 100, the gap between them, and north three times
    assert np.isnan(heading).sum() == 4
    strips = rows(saved, "/track/harbour/simulated/mmg", "LineStrips2D:strips")
    assert len(strips["LineStrips2D:strips"][0]) == 2


def test_a_turn_to_starboard_turns_clockwise_on_the_chart():
    at = pl.DataFrame({"x0": [0.0, 0.0], "y0": [0.0, 100.0], "heading": [0.0, 90.0]})
    north, east = trajectory.hulls(at, trajectory.HULL * (4.0, 1.0))
    assert north[0] == pytest.approx((0.0, -2.0))  # bow up: Rerun's y points down
    assert east[0] == pytest.approx((102.0, 0.0))  # bow to the right
    assert north[1][0] == pytest.approx(0.5)  # starboard side to the right


def test_a_ship_with_an_outline_of_its_own_is_drawn_with_it(compared):
    ferry = ((2.0, 0.0), (0.0, 1.0), (-2.0, 0.0), (0.0, -1.0))
    drawn = display.drawn(replace(compared, ship_outline=ferry))
    at = pl.DataFrame({"x0": [10.0], "y0": [0.0], "heading": [90.0]})
    (hull,) = trajectory.hulls(at, trajectory.outline(drawn))
    assert hull[0] == pytest.approx((2.0, -10.0))  # bow to the east
    assert hull[-1] == pytest.approx(hull[0])  # closed
    assert hull[1] == pytest.approx((0.0, -9.0))  # starboard is south


def test_a_chart_of_the_sea_is_in_kilometres(compared):
    at_sea = compared.measured.with_columns(pl.col("x0") * 1000.0)
    far, unit = trajectory.in_chart_units(display.drawn(replace(compared, measured=at_sea)))
    assert unit == "km" and far.ship_length == pytest.approx(0.003)
    assert far.measured["x0"].max() == pytest.approx(compared.measured["x0"].max())
    assert trajectory.in_chart_units(display.drawn(compared))[1] == "m"


def test_histograms_count_every_row(saved, compared):
    bars = tensor(saved, "/hist/surge/training", "BarChart:values")
    assert bars.max() == pytest.approx(math.log10(61.0)) == bars.sum()  # 60 rows of 0.5 m/s
    bars = tensor(saved, "/hist/surge/test", "BarChart:values")
    assert bars.max() == pytest.approx(math.log10(1.0 + 2 * SECONDS)) == bars.sum()
    winds = tensor(saved, "/hist/wind/test", "Tensor:data")
    assert winds.shape[0] == 18 and winds[15, 12] == pytest.approx(math.log10(1.0 + 2 * SECONDS))
    drawn = display.drawn(compared)
    counts = histogram.wind_counts(drawn.measured, fastest=4.0)
    assert counts.shape == (18, 16)  # 20 deg and 0.25 m/s
    assert counts[15, 12] == 2 * SECONDS == counts.sum()  # 310 deg, 3.1 m/s
    counts = histogram.wind_counts(drawn.training, fastest=4.0)
    assert counts[15, 8] == 60 == counts.sum()  # 2.0 m/s belongs to the bin it begins


@pytest.mark.parametrize(
    "values", [[0.0], [-1.0, 1.0], [3.0, 3.8], [1e-9, 2e-9], [-105.0, 35.0], [0.3, 0.3]]
)
def test_bins_are_round_few_and_hold_every_value(values):
    values = np.array(values)
    edges = histogram.bins(values)
    assert 1 <= len(edges) - 1 <= histogram.MOST_BINS + 1
    assert np.histogram(values, edges)[0].sum() == len(values)
    width = edges[1] - edges[0]
    assert width / 10.0 ** math.floor(math.log10(width) + 1e-9) == pytest.approx(
        round(width / 10.0 ** math.floor(math.log10(width) + 1e-9))
    )


def test_a_diverging_model_does_not_shrink_the_axis():
    measured = pl.DataFrame({"surge": [0.0, 1.0]})
    simulated = pl.DataFrame({"surge": [0.5, 1e9, math.inf]})
    low, high = timeline.readable_range(measured, simulated, ["surge"])
    assert low == pytest.approx(-0.08) and high == pytest.approx(1.68)


def test_an_axis_carries_two_labels():
    assert timeline.with_two_labels(0.17, 0.95) == (0.0, 1.0)
    assert timeline.with_two_labels(-0.2, 0.25) == (-0.2, 0.25)  # has 0.0, 0.1 and more
    assert timeline.with_two_labels(-3.0, 3.6) == (-3.0, 3.6)  # ten would flatten it


def test_without_wind_nothing_of_wind_is_displayed(compared, tmp_path):
    winds = ("wind_speed", "wind_angle")
    calm = replace(
        compared,
        has_wind=False,
        measured=compared.measured.drop(winds),
        training=compared.training.drop(winds),
    )
    viewer.save(calm, tmp_path / "calm.rrd")
    text = entities(tmp_path / "calm.rrd")
    assert "/wind/" not in text and "/hist/surge/test" in text


def test_gaps_and_a_voyage_no_model_saw_are_drawn_as_they_are(compared, tmp_path):
    holes = compared.measured.filter(~pl.col("time").is_between(50, 80)).with_columns(
        surge=pl.when(pl.col("time") == 10).then(None).otherwise(pl.col("surge"))
    )
    observed = compared.simulated.filter(pl.col("voyage") == "harbour")
    partly = replace(compared, measured=holes, simulated=observed)
    viewer.save(partly, tmp_path / "partly.rrd")
    surge = scalars(tmp_path / "partly.rrd", "/state/harbour/surge/measured")
    assert len(surge) == SECONDS - 31 + 1 and np.isnan(surge).sum() == 2


def test_a_track_between_two_grid_lines_has_a_chart(compared, tmp_path):
    """Due north at 5 m/s, 100 m to the east: its narrow side holds no round number of metres."""
    straight = compared.measured.filter(pl.col("voyage") == "harbour").with_columns(
        x0=5.0 * pl.col("time"), y0=pl.lit(100.0), heading=pl.lit(0.0)
    )
    none = compared.simulated.clear()
    path = tmp_path / "straight.rrd"
    viewer.save(replace(compared, measured=straight, simulated=none, banks=()), path)
    labels = rows(path, "/track/harbour/grid/labels", "Points2D:labels")["Points2D:labels"][0]
    lines = rows(path, "/track/harbour/grid", "LineStrips2D:strips")["LineStrips2D:strips"][0]
    assert [text for text in labels if text.startswith("x₀")]
    across = [strip for strip in lines if strip[0][0] == strip[1][0]]
    assert len(across) >= 4 and any(min(x[0] for x in strip) < 100.0 for strip in across)
