"""The pictures of a diagnosis hold what was found, in the units and colours that they say."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from recordings import entities, rows, scalars

from shiplog.nomenclature.channels import STATE
from shiplog.report import viewer
from shiplog.report.diagnosis import diagnosis_pictures
from shiplog.report.viewer import diagnosis, trajectory
from shiplog.report.viewer.comparison_data import MadeFast
from shiplog.report.viewer.diagnosis_data import (
    ACTING,
    AFTER,
    BEFORE,
    ERROR_COLUMNS,
    TRACKS,
    Exhibit,
)

BLUE, ORANGE, BLACK = 0x0072B2FF, 0xD55E00FF, 0x191919FF


def straight(voyage, speed):
    """North at a steady speed for 200 s; what is not reported is zero."""
    time = np.arange(0.0, 200.0)
    known = {"x0": speed * time, "surge": np.full(200, speed)}
    zero = {channel.name: np.zeros(200) for channel in STATE}
    return pl.DataFrame({"voyage": [voyage] * 200, "time": time, **(zero | known)})


def tracks(voyage, model, speed):
    """Two windows of 100 s, each from where the ship was; it went 0.5 m/s."""
    return straight(voyage, speed).select(
        pl.lit(model).alias("model"), "voyage", (pl.col("time") // 100).cast(pl.Int64)
        .alias("window"), "time",
        pl.col("x0") + (0.5 - speed) * (pl.col("time") // 100) * 100,
        *(c.name for c in STATE if c.name != "x0"),
    ).select(TRACKS.keys())  # fmt: skip


def forces(voyage, named=True):
    """Nodes of 2 s, except that nothing is known of 20 s to 40 s."""
    time = np.array([t for t in np.arange(0.0, 200.0, 2.0) if not 20 <= t <= 40])
    tables = [
        pl.DataFrame({"voyage": [voyage] * len(time), "time": time}).with_columns(
            channel=pl.lit(channel), force=pl.lit(force), sd=pl.lit(sd),
            named=pl.lit(known if named else None, pl.Float64),
        )
        for channel, force, sd, known in (
            ("surge", -3.0, 1.0, -2.5), ("sway", 8.0, 2.0, 7.5), ("yaw_rate", 0.5, 0.1, 0.25),
        )
    ]  # fmt: skip
    return pl.concat(tables)


@pytest.fixture(scope="module")
def exhibit():
    rows = [  # the second window of `out` fell most, by 9900 - 99
        ("home", 0, 0.0, 99.0, 396.0, 396.0), ("home", 1, 100.0, 99.0, 891.0, 99.0),
        ("out", 0, 0.0, 99.0, 2475.0, 99.0), ("out", 1, 100.0, 99.0, 9900.0, 99.0),
    ]  # fmt: skip
    both = ("home", "out")
    return Exhibit(
        title="a ship: home, out",
        ship_length=3.0,
        ship_breadth=0.5,
        measured=pl.concat([straight(v, 0.5) for v in both]),
        residual=pl.concat([forces(v) for v in both]),
        named=("current",),
        extended=("current", "heading_offset"),
        tracks=pl.concat(
            [tracks(v, model, u) for model, u in ((BEFORE, 0.8), (AFTER, 0.6)) for v in both]
        ),
        errors=pl.DataFrame(rows, schema=ERROR_COLUMNS, orient="row"),
        report="# Diagnosis\n\n    RᵀV of 0.1 m/s\n",
    )


@pytest.fixture(scope="module")
def saved(exhibit, tmp_path_factory):
    path = tmp_path_factory.mktemp("diagnosis") / "diagnosis.rrd"
    viewer.save_diagnosis(exhibit, path)
    return path


def column(path, entity, component):
    return rows(path, entity, component)[component]


def colour(path, entity):
    return column(path, entity, "SeriesLines:colors").explode()[0]


def views(containers):
    """Every view's name and origin, container by container."""
    for part in containers:
        if hasattr(part, "class_identifier"):
            yield part.name, part.origin
        else:
            yield from views(part.contents)


def test_the_window_that_improved_most_comes_first(exhibit):
    assert exhibit.telling.select("voyage", "window").rows() == [("out", 1), ("home", 1)]
    unnamed = exhibit.errors.with_columns(pl.lit(None, pl.Float64).alias(AFTER))
    telling = replace(exhibit, errors=unnamed).telling
    assert telling.select("voyage", "window").rows() == [("out", 1), ("home", 1)]  # the worst


def test_nothing_is_called_improved_that_is_not(exhibit):
    """After is larger than before in every window of `out`, and smaller in one at home."""
    worse = exhibit.errors.with_columns(
        after=pl.when(pl.col("voyage") == "out").then(pl.col(BEFORE) * 2.0).otherwise(pl.col(AFTER))
    )
    shown = replace(exhibit, errors=worse)
    assert shown.improved == {"home"}
    tabs = {tab.name: tab for tab in diagnosis.blueprint(diagnosis.pictured(shown))}
    assert [next(views([tabs[v]]))[0] for v in ("home", "out")] == [
        "Most improved, 100 to 199 s [m]", "Largest error, 100 to 199 s [m]",
    ]  # fmt: skip


def test_positions_of_a_window_are_off_by_what_the_speed_is(saved):
    """0.8 m/s instead of 0.5: 0.3 m a second from the window's start, and 0.1 m with the causes."""
    before = scalars(saved, "/position_errors/out/before")
    assert np.isnan(before[100]) and len(before) == 201
    assert before[[0, 10, 99, 101, 200]] == pytest.approx([0.0, 3.0, 29.7, 0.0, 29.7])
    after = scalars(saved, r"/position_errors/out/with\ current\ and\ heading\ offset")
    assert after[[0, 10, 99]] == pytest.approx([0.0, 1.0, 9.9])


def test_a_window_in_which_the_model_diverges_is_not_the_one_that_improved_most():
    """It is in none of the figures: of three windows the second, whose L is 1e9."""
    size, loss = 5, np.array([[30.0, 0.0, 0.0], [1e9, 0.0, 0.0], [0.0, 20.0, 0.0]])
    cut = SimpleNamespace(
        plan=pl.DataFrame({"voyage": ["out"] * 3, "elapsed": [0.0, 5.0, 10.0]}),
        dt=np.ones((3, size - 1)), since=np.tile(np.arange(5.0), (3, 1)),
    )  # fmt: skip
    held = SimpleNamespace(
        cut=cut, states_before=np.zeros((3, size, 6)), parts=lambda _: loss,
        counted=np.array([True, False, True]),
    )  # fmt: skip
    done = SimpleNamespace(held=held, decision=True, after=None)
    tracks, errors = diagnosis_pictures._before_and_after(done)
    assert errors[BEFORE].to_list() == [30.0, None, 20.0] and tracks.height == 15
    nothing = SimpleNamespace(errors=errors)
    assert Exhibit.telling.fget(nothing)["window"].to_list() == [0]
    assert Exhibit.telling.fget(SimpleNamespace(errors=errors[1:2]))["window"].to_list() == [1]


@pytest.mark.parametrize(
    ("axis", "lacks", "sd", "named"),
    [("surge", -3.0, 1.0, -2.5), ("sway", 8.0, 2.0, 7.5), ("yaw", 0.5, 0.1, 0.25)],
)
def test_the_missing_force_is_drawn_with_the_named_force(saved, axis, lacks, sd, named):
    path = f"/unexplained/home/{axis}"
    values = scalars(saved, f"{path}/lacks")
    assert len(values) == 89 + 1 and np.isnan(values[10])  # the gap is not bridged
    assert np.delete(values, 10) == pytest.approx(lacks)
    assert np.delete(scalars(saved, f"{path}/named"), 10) == pytest.approx(named)
    low, high = column(saved, f"{path}/band", "Scalars:scalars")[0]
    assert (low, high) == pytest.approx((lacks - 1.645 * sd, lacks + 1.645 * sd))
    assert colour(saved, f"{path}/lacks") == BLACK
    assert colour(saved, f"{path}/named") == ORANGE


def test_errors_read_as_speeds(saved):
    """√(9900 / 99 s) = 10: the weights of L make 1 of 1 cm/s."""
    before = scalars(saved, "/errors/out/before")
    assert before[[0, 1, 3, 4]] == pytest.approx([5.0, 5.0, 10.0, 10.0]) and np.isnan(before[2])
    after = r"/errors/out/with\ current\ and\ heading\ offset"
    assert np.delete(scalars(saved, after), 2) == pytest.approx(1.0)
    assert (colour(saved, "/errors/out/before"), colour(saved, after)) == (BLUE, ORANGE)


def test_charts_show_the_telling_window_and_the_whole_voyage(saved):
    window = r"/track/out\,\ 100\ to\ 199\ s"
    of = "LineStrips2D:strips"
    (track,) = column(saved, f"{window}/simulated/before", of)[0]
    assert np.array(track.to_list())[[0, -1]].tolist() == [
        pytest.approx([0.0, -50.0]), pytest.approx([0.0, -129.2])  # 50 m + 99 s of 0.8 m/s
    ]  # fmt: skip
    (track,) = column(saved, f"{window}/measured", of)[0]
    assert track.to_list()[-1] == pytest.approx([0.0, -99.5])
    assert len(column(saved, "/track/out/simulated/before", of)[0]) == 2
    drawn = column(saved, f"{window}/simulated/before", "LineStrips2D:colors")
    assert drawn.explode()[0] == BLUE


def test_a_hull_lies_nowhere_before_its_window(saved):
    hull = rows(saved, r"/track/out\,\ 100\ to\ 199\ s/now/measured", "LineStrips2D:strips")
    assert hull["sim_time"].dt.total_seconds().to_list() == [100]


def test_each_voyage_has_its_tab_with_units_and_colours_reported(exhibit):
    tabs = diagnosis.blueprint(diagnosis.pictured(exhibit))
    assert [tab.name for tab in tabs] == ["out", "home"]
    assert [name for name, _ in views(tabs[:1])] == [
        "Most improved, 100 to 199 s [m]",
        "Whole voyage", "Report", "surge force [N], positive ahead",
        "sway force [N], positive to starboard", "yaw moment [N m], positive bow to starboard",
        "position error in each held-out window [m]",
        "velocity error of each held-out window, root mean square [cm/s, or 0.1 deg/s]",
    ]  # fmt: skip


def test_a_line_s_point_is_a_cross_on_every_chart(exhibit, tmp_path):
    """East and south are the axes of a chart: (y₀, -x₀). The view reaches as far as the point."""
    fast = MadeFast((130.0, 8.0), (125.0, 6.0), (140.0, 11.0))
    path = tmp_path / "line.rrd"
    viewer.save_diagnosis(replace(exhibit, made_fast=fast), path)
    for voyage in ("home", "out"):
        lines = column(path, f"/track/{voyage}/made_fast", "LineStrips2D:strips").to_list()[0]
        assert [[list(p) for p in line] for line in lines] == [
            [[8.0, -125.0], [8.0, -140.0]], [[6.0, -130.0], [11.0, -130.0]],
        ]  # fmt: skip
    drawn = diagnosis.pictured(replace(exhibit, made_fast=fast)).tracks
    (_, east), (_, north) = trajectory.extent(drawn, "out")
    assert east > 8.0 and north > 130.0


def test_a_verdict_that_names_nothing_shows_what_is_left(exhibit, tmp_path):
    nothing = replace(
        exhibit,
        residual=forces("out", named=False),
        named=(),
        extended=(),
        tracks=exhibit.tracks.filter(pl.col("model") == BEFORE),
        errors=exhibit.errors.with_columns(pl.lit(None, pl.Float64).alias(AFTER)),
    )
    viewer.save_diagnosis(nothing, tmp_path / "nothing.rrd")
    text = entities(tmp_path / "nothing.rrd")
    assert "/unexplained/out/surge/lacks" in text and "/named" not in text
    assert r"/errors/out/the\ model" in text and r"/with\ " not in text
    names = [name for name, _ in views(diagnosis.blueprint(diagnosis.pictured(nothing)))]
    assert names[0] == "Largest error, 100 to 199 s [m]"
    assert names.count("surge force [N], positive ahead") == 1  # nothing is known at home


def test_too_short_for_a_window_no_panel_is_empty(exhibit, tmp_path):
    short = replace(
        exhibit,
        tracks=pl.DataFrame(schema=TRACKS),
        errors=pl.DataFrame(schema=ERROR_COLUMNS),
        extended=(),
    )
    viewer.save_diagnosis(short, tmp_path / "short.rrd")
    names = [name for name, _ in views(diagnosis.blueprint(diagnosis.pictured(short)))]
    assert names == [
        "Whole voyage", "Report", "surge force [N], positive ahead",
        "sway force [N], positive to starboard", "yaw moment [N m], positive bow to starboard",
    ] * 2  # fmt: skip


def test_a_rollout_that_ran_away_does_not_flatten_the_errors(exhibit):
    errors = diagnosis.pictured(exhibit).errors  # before: 2, 3, 5, 10
    assert diagnosis.error_range(errors) == pytest.approx((-0.4, 10.8))
    ran = errors.with_columns(pl.col(AFTER).replace(1.0, 3e4))
    assert diagnosis.error_range(ran)[1] == pytest.approx(1.08 * 4.0 * 4.0)
    assert math.isfinite(diagnosis.error_range(ran)[0])


def test_the_report_is_written_in_letters_that_rerun_has(saved):
    (output,) = column(saved, "/report", "TextDocument:text").explode()
    assert output == "# Diagnosis\n\n    R'V of 0.1 m/s\n"


def test_the_probability_that_a_cause_acts_is_level_over_each_stretch(exhibit, tmp_path):
    """Off for a minute, then on: lines at 0 and at 1, in a view of the voyage's tab."""
    acting = pl.DataFrame(
        [("heading_offset", "out", t, p) for t, p in ((0.0, 0), (60.0, 0), (60.0, 1), (200.0, 1))],
        ACTING, orient="row",
    )  # fmt: skip
    dated = replace(exhibit, acting=acting)
    path = tmp_path / "diagnosis.rrd"
    viewer.save_diagnosis(dated, path)
    assert scalars(path, "/acting/out/heading_offset").tolist() == [0.0, 0.0, 1.0, 1.0]
    tabs = {tab.name: tab for tab in diagnosis.blueprint(diagnosis.pictured(dated))}
    name = "probability that each named cause acts"
    assert name in [view for view, _ in views([tabs["out"]])]
    assert name not in [view for view, _ in views([tabs["home"]])]
