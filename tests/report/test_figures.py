"""Pictures of a diagnosis: their tables by hand, and what is drawn of them."""

import math

import numpy as np
import page_content
import polars as pl
import pytest

from shiplog.report.figures import (
    changes,
    chart,
    conditions,
    errors,
    forces,
    hull,
    pictures,
    style,
    timeline,
    windows,
)
from shiplog.report.figures import picture_data as data_files
from shiplog.report.figures.content import Content
from shiplog.report.figures.picture_data import AFTER, BEFORE, MEASURED


@pytest.fixture(scope="module")
def content():
    return Content(page_content.verdict(), page_content.pictures())


def test_position_error_is_the_drift_times_the_time(content):
    table = errors.table(content, errors.POSITION)
    last = {r["model"]: r for r in table.filter(pl.col("elapsed") == 99.0).to_dicts()}
    assert last[BEFORE]["median"] == pytest.approx(9.9)
    assert last[AFTER]["median"] == pytest.approx(0.99)


def test_heading_error_is_the_short_way_round():
    data = page_content.pictures()
    turned = pl.when(pl.col("model") == BEFORE).then(math.radians(350.0)).otherwise(0.0)
    data = data_files.replace(data, tracks=data.tracks.with_columns(heading=turned))
    table = errors.table(Content(page_content.verdict(), data), errors.HEADING)
    assert table.filter(pl.col("model") == BEFORE)["median"].to_list() == pytest.approx(
        [10.0] * 100
    )


def test_words_say_the_numbers_of_the_picture(content):
    words = chart.closeup_words(chart.closeup_table(content), content)
    assert "mmg is 9.9 m (2 ship lengths)" in words
    assert "mmg, with it is 0.99 m (0.2 ship lengths)" in words
    assert "mean 800 of mmg, 200 of mmg, with it" in windows.words(windows.table(content), content)
    force = forces.words(forces.table(content, "sway"), content, "sway")
    assert "root mean square 3 N" in force and "Without the force of current: 1 N" in force


def test_the_closeup_is_the_window_whose_error_fell_most():
    data = page_content.pictures(windows=3)
    fell = pl.when((pl.col("model") == BEFORE) & (pl.col("window") == 1)).then(900.0)
    data = data_files.replace(data, errors=data.errors.with_columns(loss=fell.otherwise("loss")))
    assert chart.closeup_window(data) == (page_content.HOSTILE, 1)


def test_a_hull_that_heads_east_lies_along_east():
    shape = hull.outline(10.0, 2.0)
    east = hull.placed(shape, np.array([0.0]), np.array([0.0]), np.array([math.pi / 2]))[0]
    assert np.ptp(east[:, 0]) == pytest.approx(10.0)  # east
    assert np.ptp(east[:, 1]) == pytest.approx(2.0)  # north
    assert east[0] == pytest.approx((5.0, 0.0))  # the bow


@pytest.mark.parametrize("latitude", [34.8, -34.8, None])
def test_a_chart_has_coordinates_where_the_log_has_them(latitude):
    data = page_content.pictures(latitude=latitude)
    made = pictures.figure("track", Content(page_content.verdict(), data))
    made.draw_without_rendering()
    ticks = [t.get_text() for t in made.axes[0].get_yticklabels()]
    if latitude is None:
        assert made.axes[0].get_ylabel() == "x₀ [m], north"
    else:
        # 34.8 deg are 34°48'; a minute of latitude is 1855 m, so 100 m are 0.05'
        assert any(t.startswith("34°48.0") or t.startswith("34°47.9") for t in ticks)
        assert {t[-1] for t in ticks} == {"N" if latitude > 0 else "S"}


def test_arrows_blow_and_set_where_they_should(content):
    """Wind from the east blows to the west; the current sets to the south."""
    made = pictures.figure("track", content)
    arrows = [t for t in made.axes[0].texts if getattr(t, "arrow_patch", None) is not None]
    heads = [tuple(np.sign(np.round(-np.array(t.xyann), 6))) for t in arrows]
    assert heads == [(0.0, 1.0), (-1.0, -0.0), (0.0, -1.0)]  # north, wind, current


FAST = ((10.0, 4.0), (8.0, 3.0), (13.0, 6.0))  # (x₀, y₀): the point, low ends, high ends


def test_a_line_s_point_is_a_cross_as_long_as_its_interval():
    """y₀ is across and x₀ up, as all of the chart; one that is too far off leaves it as it was."""
    data = page_content.pictures()
    made, beyond, plain = (
        pictures.figure("track", Content(page_content.verdict(), one)).axes[0]
        for one in (
            data_files.replace(data, made_fast=FAST),
            data_files.replace(data, made_fast=((9000.0, 4.0),) * 3),
            data,
        )
    )
    segments = [c.get_segments()[0].tolist() for c in made.collections if hasattr(
        c, "get_segments") and len(c.get_segments()) == 1]  # fmt: skip
    assert [[3.0, 10.0], [6.0, 10.0]] in segments and [[4.0, 8.0], [4.0, 13.0]] in segments
    assert chart.MADE_FAST in [t.get_text() for t in made.get_legend().get_texts()]
    assert chart.MADE_FAST not in [t.get_text() for t in beyond.get_legend().get_texts()]
    assert beyond.get_xlim() == plain.get_xlim() and beyond.get_ylim() == plain.get_ylim()
    content = Content(page_content.verdict(), data_files.replace(data, made_fast=FAST))
    words = chart.voyage_words(chart.voyage_table(content), content)
    assert "x0 10.0 m (8.0 to 13.0), y0 4.0 m (3.0 to 6.0)" in words


def test_stretches_of_the_whole_voyage_are_not_drawn():
    whole = {"voyage": page_content.HOSTILE, "start_s": 0.0, "end_s": 100.0, "kind": "held"}
    verdict = page_content.verdict()
    verdict["intervals"] = [*verdict["intervals"], whole]
    table = timeline.table(Content(verdict, page_content.pictures()))
    assert table["kind"].to_list() == ["sailed", "external"]


def test_thinning_keeps_every_extreme():
    rng = np.random.default_rng(0)
    time, value = np.arange(100_000.0), rng.normal(size=100_000)
    value[51_234], value[77_777] = 50.0, -40.0
    value[10_000:10_050] = np.nan
    thin_time, thin = style.thinned(time, value)
    assert len(thin_time) < 2000
    assert np.nanmax(thin) == 50.0 and np.nanmin(thin) == -40.0
    assert thin_time[np.nanargmax(thin)] == 51_234
    assert np.isnan(thin).any() and (np.diff(thin_time) > 0).all()


def test_a_hundred_thousand_seconds_stay_small():
    data = page_content.pictures(("long",), 1000)
    content = Content(page_content.verdict(voyages=("long",)), data)
    size = sum(len(style.svg(pictures.figure(name, content), name)) for name in pictures.PICTURES)
    assert size < 1e6


def test_ids_of_two_pictures_differ(content):
    one, other = (style.svg(pictures.figure("ranking", content), p) for p in "ab")
    assert one != other and one.replace("a-", "-") == other.replace("b-", "-")
    assert page_content.HOSTILE not in style.svg(pictures.figure("stretches", content), "s")


def test_files_of_every_picture(content, tmp_path):
    made = pictures.save(content, tmp_path)
    assert {p.suffix for p in made} == {".svg", ".pdf", ".png", ".parquet", ".csv", ".tex"}
    assert all(p.stat().st_size > 50 for p in made)
    table = pl.read_parquet(tmp_path / "ranking.parquet")
    assert table.rows() == [("current", 0.97), ("outside the catalogue (motion)", 0.03)]
    latex = (tmp_path / "stretches.tex").read_text(encoding="utf-8")
    assert r"\textbf{x}" not in latex and r"\textbackslash" in latex and r"\&" in latex
    assert pl.read_csv(tmp_path / "parameters.csv").rows() == [
        ("current", "speed", 0.1, 0.09, 0.11, "m/s")
    ]


def test_what_was_saved_is_read_again(tmp_path):
    data = data_files.replace(page_content.pictures(), made_fast=FAST)
    data_files.save(data, tmp_path / "p")
    again = data_files.load(tmp_path / "p")
    assert again.made_fast == FAST
    for name in data_files.SCHEMAS:
        assert getattr(again, name).equals(getattr(data, name)), name
    assert again.models == dict(data.models) and again.current == data.current


def test_a_picture_on_given_axes(content):
    from matplotlib.figure import Figure

    own = Figure()
    axes = own.add_subplot()
    assert pictures.figure("position_error", content, ax=axes) is own
    assert len(axes.lines) == 2


def test_the_same_model_has_the_same_colour_in_every_picture(content):
    from matplotlib.colors import to_hex

    label, colour = next((lab, c) for key, lab, c in chart.legend(content.data) if key == AFTER)
    seen = set()
    for name in ("closeup", "position_error", "windows"):
        axes = pictures.figure(name, content).axes[0]
        lines = [one for one in axes.get_lines() if one.get_label() == label]
        seen |= {to_hex(one.get_color()) for one in lines}
    assert seen == {colour}
    assert {key for key, *_ in chart.legend(content.data)} == {MEASURED, BEFORE, AFTER}


def test_a_long_ship_is_not_said_to_be_nothing_off(content):
    long = Content(content.verdict, data_files.replace(content.data, length=330.0))
    assert "9.9 m (0.03 ship lengths)" in chart.closeup_words(chart.closeup_table(long), long)


def test_an_error_of_a_hundred_degrees_is_written_out():
    data = page_content.pictures()
    turned = pl.when(pl.col("model") == BEFORE).then(math.radians(150.0)).otherwise(0.0)
    data = data_files.replace(data, tracks=data.tracks.with_columns(heading=turned))
    content = Content(page_content.verdict(), data)
    words = errors.words(errors.table(content, errors.HEADING), content, errors.HEADING)
    assert "mmg is 150 deg off (150 to 150)" in words


def test_the_axis_holds_nine_in_ten_windows_unless_a_model_diverges():
    rows = pl.DataFrame({"median": [2.2], "high": [18.0]})
    assert 18.0 < errors._top(rows) < 36.0
    assert errors._top(rows.with_columns(high=pl.lit(1e6))) < 40.0


def test_names_under_the_axis_do_not_overlap():
    names = ["00000220", "00000228", "00000235"]
    assert windows.ticks([0, 9], ["season2_1", "season2_2"], 18)[2]
    assert windows.ticks([0, 8, 10], names, 25) == ([0, 8, 10], names, False)
    assert windows.ticks([0, 40, 41], names, 100) == ([0, 40], names[:2], False)


def test_no_drift_angle_is_beyond_half_a_turn():
    data = page_content.pictures()
    astern = pl.Series("drift", [-math.pi, math.pi, 0.0])
    data = data_files.replace(data, conditions=data.conditions.with_columns(astern))
    cells = conditions.drift_table(Content(page_content.verdict(), data))["drift_deg"].abs()
    assert 160.0 < cells.to_numpy().max() < 180.0


def test_what_was_not_simulated_is_not_said_to_be():
    data = data_files.replace(page_content.pictures(), models={})
    content = Content(page_content.verdict(), data)
    words = chart.voyage_words(chart.voyage_table(content), content)
    assert "north up" in words and "simulated" not in words


@pytest.mark.parametrize(
    ("name", "spans", "says"),
    [
        ("direction", [(355.0, 364.0), (2.0, 6.0)], "no"),
        ("direction", [(350.0, 358.0), (2.0, 6.0)], "yes"),
        ("angle", [(355.0, 364.0), (2.0, 6.0)], "yes"),
    ],
)
def test_directions_either_side_of_north_may_be_alike(name, spans, says):
    rows = pl.DataFrame(
        [(str(i), "current", name, "deg", sum(s) / 2, *s) for i, s in enumerate(spans)],
        changes.SCHEMA, orient="row",
    )  # fmt: skip
    assert changes.verdict(rows, ["0", "1"]).startswith(says)


def test_a_long_name_beside_the_axis_keeps_its_ends():
    assert timeline.short("season2_1") == "season2_1"
    assert timeline.short("random_06-Aug-2020_16_24_25_6") == "random_06…020_16_24_25_6"


def test_a_short_stretch_of_a_long_voyage_can_be_seen():
    from matplotlib.figure import Figure

    rows = pl.DataFrame(
        [("long", "sailed", 0.0, 1e5), ("long", "external", 10.0, 30.0)],
        timeline.SCHEMA, orient="row",
    )  # fmt: skip
    axes = Figure().add_subplot()
    timeline.draw(axes, rows, Content(page_content.verdict(), page_content.pictures()))
    assert [bar.get_width() for bar in axes.patches] == pytest.approx([1e5, 500.0])


def test_the_scale_bar_is_below_the_lowest_track(content):
    from matplotlib.figure import Figure

    axes = Figure(figsize=(4.0, 3.7)).add_subplot()
    far = Content(content.verdict, data_files.replace(content.data, length=0.5))
    table = chart.closeup_table(far)
    chart.draw_closeup(axes, table, far)
    bars = [line.get_ydata() for line in axes.lines if line.get_linewidth() == 2.5]
    assert max(bars[-1]) < table["x0"].min()


@pytest.mark.parametrize("name", ["a$\\frac$b", "一号船", 'id="1.2345"'])
def test_a_name_is_drawn_as_it_is(name):
    """What would be a formula, a letter that the font lacks, and what looks like an attribute."""
    content = Content(page_content.verdict(voyages=(name,)), page_content.pictures((name,)))
    for picture in pictures.PICTURES:
        drawn = style.svg(pictures.figure(picture, content), picture)  # warnings are errors
        if picture in ("stretches", "windows"):
            assert f">{name}</text>" in drawn


def test_a_chart_has_the_coordinates_of_the_ellipsoid():
    """At 60°N a minute of latitude is 1857 m, and one of longitude 930 m (WGS 84)."""
    data = page_content.pictures(windows=19, latitude=60.0)  # 1900 m to the north
    axes = pictures.figure("track", Content(page_content.verdict(), data)).axes[0]
    latitude, longitude = (a.get_major_formatter() for a in (axes.yaxis, axes.xaxis))
    assert (latitude(0.0, 0), latitude(1856.9, 0)) == ("60°00.0'N", "60°01.0'N")
    assert (longitude(0.0, 0), longitude(930.0, 0)) == ("135°30.0'E", "135°31.0'E")


@pytest.mark.parametrize(
    ("least", "most", "labels"),
    [(600.0, 900.0, {"600", "700", "800", "900"}), (150.0, 900.0, {"200", "500"}),
     (90.0, 9000.0, {"100", "1000"})],
)  # fmt: skip
def test_a_logarithmic_axis_has_labels_whatever_it_spans(least, most, labels):
    data = page_content.pictures(windows=2)
    loss = pl.when(pl.col("window") == 0).then(least).otherwise(most)
    data = data_files.replace(data, errors=data.errors.with_columns(loss=loss))
    made = pictures.figure("windows", Content(page_content.verdict(), data))
    made.draw_without_rendering()
    axis = made.axes[0].yaxis
    low, high = axis.get_view_interval()
    both = zip(axis.get_ticklocs(), axis.get_majorticklabels(), strict=True)
    minor = zip(axis.get_minorticklocs(), axis.get_minorticklabels(), strict=True)
    shown = {text.get_text() for at, text in (*both, *minor) if low <= at <= high}
    assert labels <= shown - {""}
