"""A recording that is opened at a moment, and what `--save` writes."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from PIL import Image
from recordings import SECONDS, rows, scalars, views

from shiplog.exceptions import ShiplogError
from shiplog.machine import child
from shiplog.report import colours, viewer
from shiplog.report.viewer import control, display, native, recording, saving, still, timeline
from shiplog.report.viewer.comparison_data import Moment

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def at_60(compared):
    """The second voyage at 60 s, with 30 s on either side."""
    return replace(compared, moment=Moment("open sea", 60.0, 60.0))


def test_the_moments_voyage_is_in_front(at_60, compared):
    layouts = (recording.layout(display.drawn(of)) for of in (compared, at_60))
    assert [layout.root_container.active_tab for layout in layouts] == [0, 1]


def test_a_voyage_beyond_those_that_have_a_tab_gets_one(compared):
    names = [f"voyage {i}" for i in range(display.MOST_TABS + 2)]
    one = compared.measured.filter(pl.col("voyage") == "harbour")
    many = replace(
        compared,
        measured=pl.concat([one.with_columns(voyage=pl.lit(name)) for name in names]),
        moment=Moment(names[-1], 10.0, 20.0),
    )
    layout = recording.layout(display.drawn(many))
    tabs = list(dict.fromkeys(view["in"][1] for view in views(layout) if len(view["in"]) > 1))
    assert tabs[: display.MOST_TABS] == [names[-1], *names[: display.MOST_TABS - 1]]
    assert layout.root_container.active_tab == 0


def test_plots_are_about_the_moment_and_others_show_the_whole_voyage(at_60):
    drawn = display.drawn(at_60)

    def ends(voyage):
        span = timeline.time_axis(drawn, voyage, after=0.0).view_range
        (found,) = span.as_arrow_array().to_pylist()
        return found

    assert ends("open sea") == {"start": 30 * 10**9, "end": 90 * 10**9}
    assert ends("harbour") == {"start": -8 * 10**9, "end": 200 * 10**9}  # 0.04 of 200 s before


def test_the_moment_is_marked_on_the_chart_and_in_every_plot(at_60, tmp_path):
    """At 60 s the circle of 6 deg/s is closed: the ship is where it began."""
    path = tmp_path / "moment.rrd"
    viewer.save(at_60, path)
    table = rows(path, r"/track/open\ sea/moment", "Points2D:positions")
    assert np.array(table["Points2D:positions"][0].to_list())[0] == pytest.approx(
        [20.0, 0.0], abs=1e-4
    )
    assert table["Points2D:labels"][0].to_list() == ["60 s"]
    for of in ("state", "error"):
        name = "surge" if of == "state" else "position"
        mark = rows(path, rf"/{of}/open\ sea/{name}/moment", "Scalars:scalars")
        assert mark["sim_time"].dt.total_milliseconds().to_list() == [60_000, 60_001]
        low, high = scalars(path, rf"/{of}/open\ sea/{name}/moment")
        assert low < high
    with pytest.raises(AssertionError, match="has no"):
        rows(path, "/track/harbour/moment", "Points2D:positions")


@pytest.mark.long
@pytest.mark.viewer
def test_the_viewer_stands_at_the_moment(at_60, tmp_path, no_viewer):
    from shiplog.report.viewer.screenshot import screenshot

    path = tmp_path / "moment.rrd"
    viewer.save(at_60, path)
    try:
        state = screenshot(path, tmp_path / "moment.png", time_s=at_60.moment.seconds)
    except ShiplogError as error:
        no_viewer(f"no headless viewer here: {error.message}")
    times = [r.current_time for r in state.recordings if r.timelines]
    assert times == [60 * 10**9]
    assert not [report for view in state.views for report in view.reports]


@pytest.mark.viewer
def test_a_viewer_that_was_opened_is_told_where_to_stand(at_60, tmp_path, no_viewer):
    """As the one with a window is, which needs a display."""
    from rerun.experimental import ViewerClient

    path, port = tmp_path / "moment.rrd", native.free_port()
    viewer.save(at_60, path)
    with (tmp_path / "output").open("w+b") as output:
        process = native.start(["--headless", str(path), "--port", str(port)], output, True)
        try:
            native.wait_for(process, (port,), control.LOAD_TIMEOUT_S)
        except TimeoutError:
            no_viewer(f"no headless viewer here: {child.last_words(output)}")
        try:
            native._put_cursor(port, 60.0)
            state = ViewerClient(control.address(native.HOST, port)).get_state()
        finally:
            child.stop(process)
    assert [r.current_time for r in state.recordings if r.timelines] == [60 * 10**9]


def test_without_a_viewer_no_cursor_is_set_and_a_warning_says_so(caplog):
    native._put_cursor(native.free_port(), 60.0)
    assert "the viewer's cursor was not set to 60 s" in caplog.text


# --- what is written ------------------------------------------------------------------------------


def test_a_picture_is_a_picture(compared, tmp_path):
    saving.write(compared, tmp_path / "two circles.PNG")
    with Image.open(tmp_path / "two circles.PNG") as picture:
        assert picture.format == "PNG"
        wide, tall = picture.size
        assert wide == still.WIDTH * 150 and tall == (2 * still.ROW + 0.5) * 150
        found = {colour for _, colour in picture.convert("RGB").getcolors(wide * tall)}
    for colour in (*colours.colours(compared.models).values(), colours.MEASURED):
        assert colour[:3] in found  # two models, and what was measured


def test_a_drawing_says_what_it_shows_in_text(compared, tmp_path):
    path = tmp_path / "circles.svg"
    saving.write(compared, path)
    text = [element.text for element in ET.parse(path).iter(f"{SVG}text")]
    for wanted in (
        "two circles", "harbour, hull every 10 s", "open sea, hull every 10 s", "measured", "mmg",
        "network fast", "position error [m]", "heading error [deg]", "time [s]", "N",
    ):  # fmt: skip
        assert wanted in text, wanted


def test_of_a_moment_the_picture_shows_its_voyage_alone(at_60, tmp_path):
    path = tmp_path / "moment.svg"
    saving.write(at_60, path)
    text = [element.text for element in ET.parse(path).iter(f"{SVG}text")]
    assert "open sea, hull every 10 s" in text
    assert not [line for line in text if line and line.startswith("harbour")]


def test_names_of_strangers_are_drawn_as_they_are(compared, tmp_path):
    name = "$\\frac{a}{$ <script>alert(1)</script> 船"
    strange = replace(
        compared,
        title=name,
        measured=compared.measured.with_columns(voyage=pl.lit(name)),
        simulated=compared.simulated.with_columns(voyage=pl.lit(name), model=pl.lit(name)),
    )
    path = tmp_path / "strange.svg"
    saving.write(strange, path)
    tree = ET.parse(path)
    assert name in [element.text for element in tree.iter(f"{SVG}text")]
    assert not list(tree.iter(f"{SVG}script")) + list(tree.iter("script"))


@pytest.mark.parametrize("name", ["compare", "compare.pdf", "compare.rrd.gz"])
def test_another_ending_is_refused_before_the_work(name, compared, tmp_path):
    with pytest.raises(ShiplogError, match="says of no kind of file") as refused:
        saving.write(compared, tmp_path / name)
    assert ".rrd, .png, .svg, .html" in refused.value.hint
    assert not list(tmp_path.iterdir())


def test_a_picture_that_cannot_be_written_leaves_nothing(compared, tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(ShiplogError, match="could not be written"):
        saving.write(compared, blocked / "circles.png")


def test_thinning_keeps_what_breaks_a_line_and_its_ends():
    values = np.zeros(100_000)
    values[[777, 50_001]], values[60_000] = (9.0, -9.0), np.nan
    keep = still._kept(values)
    assert keep[[0, 777, 50_001, 60_000]].all()
    assert keep.sum() <= 1.5 * still.POINTS + 1
    assert still._kept(values[:SECONDS]).all()
