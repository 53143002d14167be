"""The recording holds what was compared, in the units its axes say, and the viewer shows it."""

import math
import subprocess
import sys
import urllib.request
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import psutil
import pytest
from rerun.chunk import RrdReader

from shiplog.exceptions import ShiplogError
from shiplog.report import viewer
from shiplog.report.comparison_data import ComparisonData, DrawnActuator
from shiplog.report.viewer import (
    display,
    forces,
    histogram,
    native,
    recording,
    timeline,
    trajectory,
)

ROOT = Path(__file__).parents[2]
SECONDS = 201
TURNING = math.radians(6.0)  # rad/s: passes north every minute


def circle(voyage, east=0.0):
    """A steady turn to starboard at 0.5 m/s, of which everything is known in closed form."""
    time = np.arange(SECONDS, dtype=float)
    heading = TURNING * time
    radius = 0.5 / TURNING
    return pl.DataFrame(
        {
            "voyage": [voyage] * SECONDS,
            "time": time,
            "x0": radius * np.sin(heading),
            "surge": np.full(SECONDS, 0.5),
            "y0": east + radius * (1.0 - np.cos(heading)),
            "sway": np.full(SECONDS, -0.05),
            "heading": np.arctan2(np.sin(heading), np.cos(heading)),
            "yaw_rate": np.full(SECONDS, TURNING),
            "rudder_port": np.full(SECONDS, math.radians(-35.0)),
            "propeller": np.full(SECONDS, 10.0),
            "wind_speed": np.full(SECONDS, 3.1),
            "wind_angle": np.full(SECONDS, math.radians(-50.0)),
        }
    )


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


def column(path, entity, component):
    """The values of a component at an entity, rows in order of time."""
    chunks = RrdReader(path).stream().filter(content=entity)
    batches = [pl.DataFrame(pl.from_arrow(c.to_record_batch())) for c in chunks]
    tables = [t for t in batches if component in t.columns]
    assert tables, f"{entity} has no {component}"
    table = pl.concat(tables)
    return table.sort("sim_time") if "sim_time" in table.columns else table


def scalars(path, entity):
    table = column(path, entity, "Scalars:scalars")
    return table["Scalars:scalars"].explode().to_numpy()


def tensor(path, entity, component):
    """A tensor's values, which polars cannot hold."""
    (chunk,) = RrdReader(path).stream().filter(content=entity)
    (row,) = chunk.to_record_batch().to_pylist()
    (value,) = row[component]
    return np.array(value["buffer"]).reshape(value["shape"])


def test_the_line_of_a_bank_says_what_it_is(saved):
    table = column(saved, "/track/harbour/banks/labels", "Points2D:labels")
    assert table["Points2D:labels"].to_list() == [["bank"]]
    assert table["Points2D:positions"].to_list() == [[[15.0, 10.0]]]  # its middle, north up


def test_everything_compared_is_an_entity(saved):
    text = RrdReader(saved).store().summary()
    for path in (
        r"/track/harbour/measured", r"/track/harbour/simulated/network\ fast",
        r"/track/open\ sea/simulated/mmg", "/track/harbour/banks", "/state/harbour/surge/measured",
        "/state/harbour/yaw_rate/simulated/mmg", "/actuator/harbour/angle/rudder_port",
        "/actuator/harbour/revolutions/propeller", "/wind/harbour/wind_speed",
        "/error/harbour/simulated/mmg",
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
    heading = scalars(saved, "/state/harbour/heading/measured")
    assert heading == pytest.approx(6.0 * np.arange(SECONDS))  # 1200 deg, never back to -180


def test_windows_start_anew_and_keep_to_the_measured_turn(saved):
    table = column(saved, "/state/harbour/heading/simulated/mmg", "Scalars:scalars")
    heading = table["Scalars:scalars"].explode().to_numpy()
    assert len(heading) == 201  # two windows of 100, and the gap between them
    assert np.isnan(heading[100]) and np.isfinite(np.delete(heading, 100)).all()
    assert np.delete(heading, 100) == pytest.approx(6.0 * np.arange(200))
    strips = column(saved, "/track/harbour/simulated/mmg", "LineStrips2D:strips")
    assert len(strips["LineStrips2D:strips"][0]) == 2


def test_the_error_is_logarithmic_and_of_the_median_seed(saved, compared):
    assert display.drawn_seeds(compared) == {"network fast": 0, "mmg": 0}
    error = scalars(saved, "/error/harbour/simulated/mmg")
    assert error[99] == pytest.approx(math.log10(1.0 + 0.99**2))
    spread = column(saved, "/error/harbour/seeds/mmg", "Scalars:scalars")["Scalars:scalars"]
    lowest, highest = spread[99]
    assert (lowest, highest) == pytest.approx(
        (math.log10(1.0 + 0.99**2), math.log10(1.0 + 1.98**2))
    )


def test_a_turn_to_starboard_turns_clockwise_on_the_chart():
    at = pl.DataFrame({"x0": [0.0, 0.0], "y0": [0.0, 100.0], "heading": [0.0, 90.0]})
    north, east = trajectory.hulls(at, trajectory.HULL * (4.0, 1.0))
    assert north[0] == pytest.approx((0.0, -2.0))  # bow up: Rerun's y points down
    assert east[0] == pytest.approx((102.0, 0.0))  # bow to the right
    assert north[1][0] == pytest.approx(0.5)  # starboard side to the right


def with_band(simulated, model, **half):
    """The rollouts with a band of that half width about each channel, of one model only."""
    of = pl.when(pl.col("model") == model)
    ends = {
        name + end: of.then(pl.col(name) + sign * width)
        for name, width in half.items()
        for end, sign in (("_low", -1), ("_high", 1))
    }
    return simulated.with_columns(**ends)


def paths(path):
    return RrdReader(path).store().summary()


def test_a_model_that_knows_its_doubt_is_drawn_with_its_band(compared, tmp_path):
    half = {"surge": 0.1, "yaw_rate": math.radians(2.0), "x0": 3.0}
    simulated = with_band(compared.simulated, "mmg", **half)
    # the shown seed is 0: what the other one carries must not be drawn
    simulated = simulated.with_columns(
        surge_high=pl.when(pl.col("seed") == 0).then(pl.col("surge_high")).otherwise(9.0)
    )
    rrd = tmp_path / "band.rrd"
    viewer.save(replace(compared, simulated=simulated), rrd)
    surge = column(rrd, "/state/harbour/surge/band/mmg", "Scalars:scalars")["Scalars:scalars"]
    assert len(surge) == 201 and np.isnan(surge[100].to_numpy()).all()  # between the windows
    assert surge[50].to_list() == pytest.approx([0.405, 0.605])  # 0.5 + 0.01/2, give or take 0.1
    turn = column(rrd, "/state/harbour/yaw_rate/band/mmg", "Scalars:scalars")["Scalars:scalars"]
    assert turn[7].to_list() == pytest.approx([4.0, 8.0])  # deg/s
    north = column(rrd, "/state/harbour/x0/band/mmg", "Scalars:scalars")["Scalars:scalars"]
    assert north[0].to_list() == pytest.approx([-3.0, 3.0])
    output = column(rrd, "/state/harbour/surge/band/mmg", "SeriesLines:names")
    assert output["SeriesLines:names"][0].to_list() == ["90 % band"] * 2
    text = paths(rrd)
    assert "/state/harbour/surge/seeds/mmg" not in text
    for without in (
        r"surge/seeds/network\ fast", "sway/seeds/mmg",  # no columns: as without bands
    ):  # fmt: skip
        assert f"/state/harbour/{without}" in text, without
    assert r"band/network" not in text and "/error/harbour/seeds/mmg" in text


def test_without_bands_none_is_drawn(saved, compared):
    assert "/band/" not in paths(saved)
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


def views(blueprint):
    """Every view of a blueprint, container by container: its class, name, origin and parents."""

    def within(part, parents):
        if hasattr(part, "contents") and not hasattr(part, "class_identifier"):
            for child in part.contents:
                yield from within(child, (*parents, part.name))
        else:
            yield {"name": part.name, "origin": part.origin, "in": parents, "view": part}

    return list(within(blueprint.root_container, ()))


def pushed(model, voyage, part, surge, sway=0.0, yaw=0.0):
    """A part that pushes steadily for 100 s, except that nothing is known of 40 s to 49 s."""
    time = np.array([t for t in range(100) if not 40 <= t < 50], dtype=float)
    return pl.DataFrame({"time": time}).select(
        model=pl.lit(model), voyage=pl.lit(voyage), time="time", part=pl.lit(part),
        surge=pl.lit(surge), sway=pl.lit(sway), yaw=pl.lit(yaw),
    )  # fmt: skip


@pytest.fixture(scope="module")
def pushing(compared):
    rows = [
        pushed("mmg", "open sea", "hull", -8.0, sway=1.5, yaw=-2.0),
        pushed("mmg", "open sea", "propeller", 10.0),
        pushed("mmg", "open sea", "total", 2.0, sway=1.5, yaw=-2.0),
        pushed("a model of no rollouts", "open sea", "network", 77.0),
    ]
    shuffled = pl.concat(rows).sample(fraction=1.0, shuffle=True, seed=0)
    return replace(compared, forces=shuffled)


def test_each_part_is_a_line_with_its_force(pushing, tmp_path):
    rrd = tmp_path / "forces.rrd"
    viewer.save(pushing, rrd)
    for path, value in (
        ("surge/terms/hull", -8.0), ("sway/terms/hull", 1.5), ("yaw/terms/hull", -2.0),
        ("surge/terms/propeller", 10.0), ("surge/sum/total", 2.0), ("yaw/sum/total", -2.0),
    ):  # fmt: skip
        values = scalars(rrd, rf"/force/open\ sea/{path}")
        assert len(values) == 90 + 1 and np.isnan(values[40])  # the gap is not bridged
        assert np.delete(values, 40) == pytest.approx(value)
    text = paths(rrd)
    assert "network" not in text.replace(r"network\ fast", "") and "/force/harbour" not in text
    for part, colour in (("terms/hull", 0x0072B2FF), ("sum/total", 0x191919FF)):  # blue, dark
        table = column(rrd, rf"/force/open\ sea/yaw/{part}", "SeriesLines:colors")
        assert table["SeriesLines:colors"][0].to_list() == [colour]


def test_forces_stand_on_a_tab_of_their_own(pushing):
    displayed = views(recording.layout(display.drawn(pushing)))
    plots = [view for view in displayed if view["origin"].startswith("/force/")]
    assert [view["name"] for view in plots] == [
        "surge force [N], positive ahead", "sway force [N], positive to starboard",
        "yaw moment [N m], positive bow to starboard",
    ]  # fmt: skip
    assert {view["in"][1:] for view in plots} == {("Forces, mmg", "open sea")}
    tabs = list(dict.fromkeys(view["in"][1] for view in displayed if len(view["in"]) > 1))
    assert tabs == ["harbour", "open sea", "Forces, mmg", "Histograms"]
    legends = [view["view"].properties["PlotLegend"].visible for view in plots]
    assert [legend.as_arrow_array().to_pylist() for legend in legends] == [[True], [False], [False]]


def test_without_forces_there_is_no_tab_of_them(saved, compared):
    assert "/force" not in paths(saved)
    drawn = display.drawn(compared)
    assert forces.blueprint(drawn, None) is None
    assert not [v for v in views(recording.layout(drawn)) if v["origin"].startswith("/force")]
    none = pushed("mmg", "harbour", "hull", 1.0).clear()
    assert forces.blueprint(display.drawn(replace(compared, forces=none)), None) is None


def test_more_voyages_than_tabs_fit_are_sent_but_have_no_tab(compared):
    names = [f"voyage {i}" for i in range(display.MOST_TABS + 2)]
    many = replace(
        compared,
        measured=pl.concat([circle(name) for name in names]),
        forces=pl.concat([pushed("mmg", name, "hull", 1.0) for name in names]),
    )
    tabs = forces.blueprint(display.drawn(many), None)
    assert [tab.name for tab in tabs.contents] == names[: display.MOST_TABS]


def test_a_spike_does_not_flatten_the_forces():
    steady = pushed("mmg", "harbour", "hull", -8.0)
    spiked = steady.with_columns(
        surge=pl.when(pl.col("time") == 7).then(1e6).otherwise(pl.col("surge"))
    )
    low, high = forces.readable_range(spiked, "surge")
    assert (low, high) == pytest.approx((-10 - 0.8, 0 + 0.8))  # to the next label; zero is in
    # a rudder among thirty times as many rows of hull is no spike
    kick = pl.concat([*[steady] * 30, pushed("mmg", "harbour", "rudder", 4.0)])
    assert forces.readable_range(kick, "surge")[1] > 4.0
    calm = forces.readable_range(pushed("mmg", "harbour", "hull", math.nan), "surge")
    assert calm[0] < 0.0 < calm[1]


@pytest.mark.parametrize(
    ("newton", "named", "drawn"), [(9e3, "N", 9e3), (2e6, "kN", 2e3), (3e7, "MN", 30.0)]
)
def test_a_large_ship_is_pushed_in_kilonewtons(compared, tmp_path, newton, named, drawn):
    rows = pushed("mmg", "harbour", "hull", newton)
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
    assert unit == "kilometres" and far.ship_length == pytest.approx(0.003)
    assert far.measured["x0"].max() == pytest.approx(compared.measured["x0"].max())
    assert trajectory.in_chart_units(display.drawn(compared))[1] == "metres"


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
    text = RrdReader(tmp_path / "calm.rrd").store().summary()
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


def test_what_cannot_be_written_whole_is_not_there(compared, tmp_path, monkeypatch):
    def fails(recording, comparison):
        raise RuntimeError("the disk is full")

    monkeypatch.setattr(histogram, "send", fails)
    with pytest.raises(RuntimeError, match="disk"):
        viewer.save(compared, tmp_path / "compare.rrd")
    assert not list(tmp_path.iterdir())


def test_a_disk_that_is_full_is_reported_and_leaves_no_half_a_recording(compared, tmp_path):
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with pytest.raises(ShiplogError, match="could not be written"):
            viewer.save(compared, tmp_path / "compare.rrd")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert not list(tmp_path.iterdir())


def test_without_a_display_the_viewer_says_what_to_do(saved, monkeypatch):
    monkeypatch.setattr(native.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(ShiplogError, match="No display") as output:
        viewer.open_viewer(saved)
    assert "--save" in output.value.hint and "--web" in output.value.hint


def test_a_recording_that_is_not_there_is_named(tmp_path):
    with pytest.raises(ShiplogError, match=r"missing\.rrd"):
        viewer.serve(tmp_path / "missing.rrd")


@pytest.mark.parametrize("how", ["window", "web"])
def test_every_program_is_made_to_listen_on_this_machine_only(saved, monkeypatch, how):
    started = []

    class Program:
        def __init__(self, command, **_settings):
            started.append(command)
            raise OSError("not started")

    monkeypatch.setattr(native.subprocess, "Popen", Program)
    monkeypatch.setenv("DISPLAY", ":0")
    with pytest.raises(OSError, match="not started"):
        viewer.open_viewer(saved) if how == "window" else viewer.serve(saved, port=0)
    ((*_, option, address),) = started
    assert (option, address) == ("--bind", "127.0.0.1")


@pytest.mark.viewer
def test_the_web_viewer_listens_on_this_machine_only(saved):
    with viewer.serve(saved, port=0) as served:
        (server,) = psutil.Process(served.process.pid).children()
        listening = server.net_connections("inet")
        hosts = {c.laddr.ip for c in listening if c.status == psutil.CONN_LISTEN}
        assert hosts == {"127.0.0.1"}
        with urllib.request.urlopen(served.address, timeout=10) as page:
            assert page.status == 200 and b"<html" in page.read()[:2000]
    assert served.process.poll() is not None and not server.is_running()


@pytest.mark.viewer
def test_a_server_ends_with_the_command_whatever_ends_that(saved):
    program = (
        "import sys; from shiplog.report import viewer\n"
        "with viewer.serve(sys.argv[1], port=0) as served:\n"
        "    print('ready', flush=True); served.wait()\n"
    )
    command = subprocess.Popen(
        [sys.executable, "-c", program, str(saved)], stdout=subprocess.PIPE, cwd=ROOT
    )
    with command:
        assert command.stdout.readline() == b"ready\n"
        started = psutil.Process(command.pid).children(recursive=True)
        assert len(started) == 2  # the server and who watches over it
        command.kill()
    _, alive = psutil.wait_procs(started, timeout=30)
    assert alive == []


@pytest.mark.viewer
def test_the_viewer_shows_every_view_without_complaint(saved, tmp_path, no_viewer):
    from shiplog.report.viewer.screenshot import screenshot

    try:
        state = screenshot(saved, tmp_path / "seen.png", time_s=100.0)
    except ShiplogError as error:
        no_viewer(f"no headless viewer here: {error.message}")
    names = {view.name for view in state.views}
    for name in (
        "error: log10(1 + d), dots where a window starts", "surge u [m/s]", "sway v_m [m/s]",
        "yaw rate r [deg/s]", "heading ψ [deg]", "north x₀ [m]", "east y₀ [m]", "rudders [deg]",
        "propellers [rev/s]", "apparent wind speed U_A [m/s]", "Report",
        "Apparent wind, training [rows, log scale]", "Apparent wind, test [rows, log scale]",
        "surge u [m/s]: log10(1 + rows)",
    ):  # fmt: skip
        assert name in names, name
    assert any(name.startswith("Track, north up, metres") for name in names)
    assert not [report for view in state.views for report in view.reports]
    (recording,) = [r for r in state.recordings if r.timelines]
    (time,) = [t for t in recording.timelines if t.name == "sim_time"]
    assert (time.start, time.end) == (0, 200_000_000_000)
    assert (tmp_path / "seen.png").stat().st_size > 50_000
