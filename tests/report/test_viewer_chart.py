"""What stands about a track: arrows, a scale, coordinates; and how far a model is off."""

import math
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from recordings import entities, rows, scalars, views

from shiplog.nomenclature import frames
from shiplog.report import colours, viewer
from shiplog.report.viewer import chart, display, recording, surroundings, tracking, trajectory
from shiplog.report.viewer.comparison_data import Current

DATUM = (34.82, 135.52)


def sailing(heading, surge, wind_speed, wind_angle, sway=0.0):
    """Ten rows of a drawn voyage: degrees and m/s."""
    names = ("heading", "surge", "sway", "wind_speed", "wind_angle")
    values = (heading, surge, sway, wind_speed, wind_angle)
    return pl.DataFrame({n: [float(v)] * 10 for n, v in zip(names, values, strict=True)})


@pytest.mark.parametrize(
    ("ship", "speed", "comes_from"),
    [
        # eastwards at 3 m/s, 5 m/s from 53.13 deg to port of the bow: (3, -4) ahead and to
        # starboard, so the wind comes from port, which is north, with 4 m/s
        (sailing(90.0, 3.0, 5.0, -math.degrees(math.atan2(4.0, 3.0))), 4.0, 0.0),
        # northwards at 2 m/s, 5 m/s from right ahead: 3 m/s from the north
        (sailing(0.0, 2.0, 5.0, 0.0), 3.0, 0.0),
        # at rest, bow to the south, from starboard: from the west
        (sailing(180.0, 0.0, 6.0, 90.0), 6.0, 270.0),
        # westwards at 4 m/s before a wind as fast: no apparent wind, 4 m/s from the east
        (sailing(270.0, 4.0, 0.0, 0.0), 4.0, 90.0),
    ],
)
def test_the_true_wind_is_the_apparent_one_without_the_ships_motion(ship, speed, comes_from):
    wind = surroundings.mean_true_wind(ship)
    assert wind.speed == pytest.approx(speed)
    assert math.cos(wind.comes_from - math.radians(comes_from)) == pytest.approx(1.0)
    assert wind.steadiness == pytest.approx(1.0) and wind.steady


def test_a_wind_from_all_sides_has_no_arrow():
    ways = [sailing(0.0, 0.0, 5.0, angle) for angle in (0.0, 90.0, 180.0, 270.0)]
    wind = surroundings.mean_true_wind(pl.concat(ways))
    assert wind.steadiness == pytest.approx(0.0) and not wind.steady
    assert surroundings.mean_true_wind(sailing(0.0, 0.0, math.nan, 0.0)) is None


def test_arrows_point_to_where_wind_and_current_go(compared, tmp_path):
    """At rest with the bow north, 6 m/s from the starboard beam: the wind goes west. A current
    towards 180 deg goes south, which is down: Rerun's y points down."""
    still = compared.measured.with_columns(
        heading=pl.lit(0.0), surge=pl.lit(0.0), sway=pl.lit(0.0),
        wind_speed=pl.lit(6.0), wind_angle=pl.lit(math.radians(90.0)),
    )  # fmt: skip
    current = Current(0.25, math.radians(180.0))
    path = tmp_path / "arrows.rrd"
    viewer.save(replace(compared, measured=still, current=current), path)
    found = rows(path, "/track/harbour/arrows", "Arrows2D:vectors")
    north, wind, water = (np.array(v) for v in found["Arrows2D:vectors"][0].to_list())
    length = np.linalg.norm(north)
    assert north / length == pytest.approx((0.0, -1.0))
    assert wind / length == pytest.approx((-1.0, 0.0), abs=1e-6)
    assert water / length == pytest.approx((0.0, 1.0), abs=1e-6)
    labels = rows(path, "/track/harbour/arrows/labels", "Points2D:labels")["Points2D:labels"][0]
    assert labels.to_list()[:3] == ["N", "wind 6 m/s from 090°", "current 0.25 m/s to 180°"]
    assert found["Arrows2D:colors"][0].to_list() == [
        int.from_bytes(bytes(c)) for c in (colours.TEXT, colours.WIND, colours.CURRENT)
    ]


def test_the_scale_bar_is_as_long_as_it_says(saved):
    strips = rows(saved, "/track/harbour/scale", "LineStrips2D:strips")["LineStrips2D:strips"][0]
    labels = rows(saved, "/track/harbour/arrows/labels", "Points2D:labels")["Points2D:labels"][0]
    bar = np.array(strips[0].to_list())
    length, unit = labels.to_list()[-1].split()
    assert unit == "m" and float(length) == pytest.approx(np.ptp(bar[:, 0])) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("degrees", "letters", "digits", "said"),
    [
        (34.82, "NS", 3, "34°49.200'N"), (-0.5, "NS", 1, "0°30.0'S"),
        (-70.25, "EW", 2, "70°15.00'W"), (9.99999999, "EW", 2, "10°00.00'E"),
        (5.05, "EW", 0, "5°03'E"),
    ],
)  # fmt: skip
def test_coordinates_are_written_as_on_a_chart(degrees, letters, digits, said):
    assert chart.in_minutes(degrees, letters, digits) == said


def test_a_plane_and_the_globe_are_the_same_place():
    """A minute of latitude is a nautical mile, to its length there of 1849 m at 34.8 deg."""
    latitude, longitude = frames.geodetic(1849.0, 0.0, DATUM)
    assert (latitude - DATUM[0]) * 60.0 == pytest.approx(1.0, abs=1e-3)
    assert longitude == DATUM[1]
    again = frames.local_plane(*map(np.array, frames.geodetic(120.0, -340.0, DATUM)), DATUM)
    assert again == pytest.approx([120.0, -340.0], abs=1e-4)


def test_a_log_with_latitude_has_it_on_the_edges_and_asks_no_map(compared, tmp_path):
    path = tmp_path / "there.rrd"
    placed = replace(compared, datums={"harbour": DATUM})
    viewer.save(placed, path)
    found = rows(path, "/track/harbour/grid/coordinates", "Points2D:labels")
    labels, places = (found[f"Points2D:{n}"][0].to_list() for n in ("labels", "positions"))
    latitudes = {text: -y for text, (_, y) in zip(labels, places, strict=True) if "N" in text}
    assert latitudes["34°49.2000'N"] == pytest.approx(0.0)  # x₀ = 0 is the datum's
    assert "/track/open\\ sea/grid/coordinates" not in entities(path)
    kinds = {type(v["view"]).__name__ for v in views(recording.layout(display.drawn(placed)))}
    assert "MapView" not in kinds  # each of its providers asks a server elsewhere


def test_the_key_names_every_colour(saved, compared):
    labels = rows(saved, "/track/harbour/key/labels", "Points2D:labels")["Points2D:labels"][0]
    lines = rows(saved, "/track/harbour/key", "LineStrips2D:colors")["LineStrips2D:colors"][0]
    assert labels.to_list() == ["measured", "mmg", "network fast"]
    of = colours.colours(compared.models)
    for name, found in zip(labels, lines, strict=True):
        wanted = of.get(name, colours.MEASURED)
        assert found == int.from_bytes(bytes(wanted))


def test_errors_are_metres_and_degrees_the_short_way_round(compared):
    """3 m north and 4 m east of where it was is 5 m off; 350 deg for 10 deg is 20 deg to port."""
    measured = compared.measured.with_columns(heading=pl.lit(math.radians(10.0)))
    simulated = compared.simulated.with_columns(
        pl.col("x0") + 3.0, pl.col("y0") + 4.0, heading=pl.lit(math.radians(350.0))
    )
    drawn = display.drawn(replace(compared, measured=measured, simulated=simulated))
    errors = tracking.with_errors(drawn)
    assert errors[tracking.POSITION].to_numpy() == pytest.approx(5.0)
    assert errors[tracking.HEADING].to_numpy() == pytest.approx(-20.0)
    assert errors.height == compared.simulated.height
    assert tracking.heading_range(errors) == pytest.approx((-21.6, 21.6))


def test_an_error_where_nothing_was_measured_is_a_gap(compared):
    holes = compared.measured.filter(~pl.col("time").is_between(50, 80))
    errors = tracking.with_errors(display.drawn(replace(compared, measured=holes)))
    unknown = errors.filter(pl.col(tracking.POSITION).is_null())["time"].unique().sort()
    assert unknown.to_list() == list(range(50, 81))


def test_a_model_that_is_lost_does_not_flatten_the_errors():
    measured = pl.DataFrame({"x0": [0.0, 30.0], "y0": [0.0, 5.0]})
    errors = pl.DataFrame({tracking.POSITION: [0.1, 2.0, 1e9]})
    assert tracking.position_range(errors, measured) == pytest.approx((-1.2, 32.4))
    assert tracking.position_range(errors[:2], measured) == pytest.approx((-0.08, 2.16))


def test_the_error_of_the_median_seed_is_drawn_within_that_of_all(compared, tmp_path):
    """Seed 1 is a metre off, seed 0 nowhere."""
    off = compared.simulated.with_columns(pl.col("x0") + pl.col("seed"))
    path = tmp_path / "seeds.rrd"
    viewer.save(replace(compared, simulated=off), path)
    assert np.nanmax(scalars(path, "/error/harbour/position/simulated/mmg")) == pytest.approx(0.0)
    spread = rows(path, "/error/harbour/position/seeds/mmg", "Scalars:scalars")["Scalars:scalars"]
    assert spread[50].to_list() == pytest.approx([0.0, 1.0])


def test_no_title_is_cut_on_a_screen_of_1920_points(compared):
    """A plot of the narrower column is 0.26 of the screen; a letter is 7.5 points wide, and four
    buttons take 130."""
    placed = replace(compared, datums={"harbour": DATUM})
    for view in views(recording.layout(display.drawn(placed))):
        assert len(view["name"]) * 7.5 < 0.26 * 1920 - 130 + 60, view["name"]


def test_a_long_track_is_drawn_with_fewer_points_and_no_farther_off():
    """A circle of 1 m in 40,000 points, thinned to a 2000th of the 2 m that it is wide."""
    angle = np.linspace(0.0, 2.0 * np.pi, 40_000)
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    (line,) = trajectory._lines(circle, np.empty(0, dtype=np.intp))
    assert line[[0, -1]].tolist() == circle[[0, -1]].tolist()
    between = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert between.max() <= 2.0 * 2.0 / 2000.0 and 6000 < len(line) < 6400  # 2π m by 1 mm
    (short,) = trajectory._lines(circle[:20_000], np.empty(0, dtype=np.intp))
    assert len(short) == 20_000
