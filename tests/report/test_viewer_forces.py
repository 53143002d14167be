"""Forces part by part: each a line, on a tab of their own, in units that suit the ship."""

import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from recordings import circle, entities, rows, scalars, views

from shiplog.report import viewer
from shiplog.report.viewer import (
    display,
    forces,
    recording,
)


def force(model, voyage, part, surge, sway=0.0, yaw=0.0):
    """A part whose force is steady for 100 s, except that nothing is known of 40 s to 49 s."""
    time = np.array([t for t in range(100) if not 40 <= t < 50], dtype=float)
    return pl.DataFrame({"time": time}).select(
        model=pl.lit(model), voyage=pl.lit(voyage), time="time", part=pl.lit(part),
        surge=pl.lit(surge), sway=pl.lit(sway), yaw=pl.lit(yaw),
    )  # fmt: skip


@pytest.fixture(scope="module")
def with_forces(compared):
    rows = [
        force("mmg", "open sea", "hull", -8.0, sway=1.5, yaw=-2.0),
        force("mmg", "open sea", "propeller", 10.0),
        force("mmg", "open sea", "total", 2.0, sway=1.5, yaw=-2.0),
        force("a model of no rollouts", "open sea", "network", 77.0),
    ]
    shuffled = pl.concat(rows).sample(fraction=1.0, shuffle=True, seed=0)
    return replace(compared, forces=shuffled)


def test_each_part_is_a_line_with_its_force(with_forces, tmp_path):
    rrd = tmp_path / "forces.rrd"
    viewer.save(with_forces, rrd)
    for path, value in (
        ("surge/terms/hull", -8.0), ("sway/terms/hull", 1.5), ("yaw/terms/hull", -2.0),
        ("surge/terms/propeller", 10.0), ("surge/sum/total", 2.0), ("yaw/sum/total", -2.0),
    ):  # fmt: skip
        values = scalars(rrd, rf"/force/open\ sea/{path}")
        assert len(values) == 90 + 1 and np.isnan(values[40])  # the gap is not bridged
        assert np.delete(values, 40) == pytest.approx(value)
    text = entities(rrd)
    assert "network" not in text.replace(r"network\ fast", "") and "/force/harbour" not in text
    for part, colour in (("terms/hull", 0x55739BFF), ("sum/total", 0x191919FF)):  # slate, dark
        table = rows(rrd, rf"/force/open\ sea/yaw/{part}", "SeriesLines:colors")
        assert table["SeriesLines:colors"][0].to_list() == [colour]


def test_forces_stand_on_a_tab_of_their_own(with_forces):
    displayed = views(recording.layout(display.drawn(with_forces)))
    plots = [view for view in displayed if view["origin"].startswith("/force/")]
    assert [view["name"] for view in plots] == [
        "surge force [N], positive ahead", "sway force [N], positive to starboard",
        "yaw moment [N m], positive bow to starboard",
    ]  # fmt: skip
    assert {view["in"][1:] for view in plots} == {("Forces, mmg", "open sea")}
    tabs = list(dict.fromkeys(view["in"][1] for view in displayed if len(view["in"]) > 1))
    assert tabs == ["harbour", "open sea", "Forces, mmg", "Coverage"]
    legends = [view["view"].properties["PlotLegend"].visible for view in plots]
    assert [legend.as_arrow_array().to_pylist() for legend in legends] == [[True], [False], [False]]


def test_without_forces_there_is_no_tab_of_them(saved, compared):
    assert "/force" not in entities(saved)
    drawn = display.drawn(compared)
    assert forces.blueprint(drawn, None) is None
    assert not [v for v in views(recording.layout(drawn)) if v["origin"].startswith("/force")]
    none = force("mmg", "harbour", "hull", 1.0).clear()
    assert forces.blueprint(display.drawn(replace(compared, forces=none)), None) is None


def test_more_voyages_than_tabs_fit_are_sent_but_have_no_tab(compared):
    names = [f"voyage {i}" for i in range(display.MOST_TABS + 2)]
    many = replace(
        compared,
        measured=pl.concat([circle(name) for name in names]),
        forces=pl.concat([force("mmg", name, "hull", 1.0) for name in names]),
    )
    tabs = forces.blueprint(display.drawn(many), None)
    assert [tab.name for tab in tabs.contents] == names[: display.MOST_TABS]


def test_a_spike_does_not_flatten_the_forces():
    steady = force("mmg", "harbour", "hull", -8.0)
    spiked = steady.with_columns(
        surge=pl.when(pl.col("time") == 7).then(1e6).otherwise(pl.col("surge"))
    )
    low, high = forces.readable_range(spiked, "surge")
    assert (low, high) == pytest.approx((-10 - 0.8, 0 + 0.8))  # to the next label; zero is in
    # a rudder among thirty times as many rows of hull is no spike
    kick = pl.concat([*[steady] * 30, force("mmg", "harbour", "rudder", 4.0)])
    assert forces.readable_range(kick, "surge")[1] > 4.0
    calm = forces.readable_range(force("mmg", "harbour", "hull", math.nan), "surge")
    assert calm[0] < 0.0 < calm[1]


@pytest.mark.parametrize(
    ("newton", "named", "drawn"), [(9e3, "N", 9e3), (2e6, "kN", 2e3), (3e7, "MN", 30.0)]
)
def test_the_forces_of_a_large_ship_are_in_kilonewtons(compared, tmp_path, newton, named, drawn):
    rows = force("mmg", "harbour", "hull", newton)
    large = replace(compared, forces=rows)
    (surge, *_) = [
        view["name"]
        for view in views(recording.layout(display.drawn(large)))
        if view["origin"].startswith("/force")
    ]
    assert surge == f"surge force [{named}], positive ahead"
    viewer.save(large, tmp_path / "large.rrd")
    sent = scalars(tmp_path / "large.rrd", "/force/harbour/surge/terms/hull")
    assert np.delete(sent, 40) == pytest.approx(drawn)
