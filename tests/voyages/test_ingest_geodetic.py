"""Positions on the ellipsoid: across its meridians, and those that are nowhere on it."""

from dataclasses import replace

import numpy as np
import pytest
import sailing
from test_ingest import kept

from shiplog.exceptions import LogUnreadable
from shiplog.voyages.ingest.ingest import ingest


@pytest.fixture
def voyage(tmp_path):
    def build(parts, text):
        return ingest(sailing.write(tmp_path / "turn.mcap", parts), sailing.profile(text))

    return build


def geodetic(latitude, longitude):
    """The circle about a point on the ellipsoid's equator or near it, and the profile for it."""
    parts = sailing.series()
    x, y = parts["/position"].columns.values()
    north, east = 6_335_439.0, 6_378_137.0  # m, radii of curvature on the equator
    fix = {
        "lat": latitude + np.degrees(x / north),
        "lon": (longitude + np.degrees(y / east) + 180.0) % 360.0 - 180.0,
    }
    text = sailing.PROFILE.replace('"local"', '"geodetic"').replace('"x_m", "y_m"', '"lat", "lon"')
    parts["/position"] = replace(parts["/position"], columns=fix)
    return parts, text.replace('unit = "m"', 'unit = "deg"', 1)


def test_a_circle_across_the_180_degree_meridian_is_a_circle(voyage):
    parts, text = geodetic(0.0, 180.0)
    third = np.arange(len(parts["/position"].time)) % 3 == 0  # the rest is interpolated
    table = voyage(kept(parts, "/position", third), text).table
    t = (table["time"].to_physical().to_numpy() - sailing.START) * 1e-9
    for name, truth in (("x0", np.sin(3.0 + 0.04 * t)), ("y0", -np.cos(3.0 + 0.04 * t))):
        found = table[name].to_numpy()
        assert found - found.mean() == pytest.approx(20.0 * (truth - truth.mean()), abs=1e-3)
    assert (table["quality"] == 0).all()


def test_the_datum_is_no_position_before_the_first_fix(voyage):
    parts, text = geodetic(0.0, 135.0)
    fix = parts["/position"].columns
    fourth = fix["lat"][3], fix["lon"][3]
    fix["lat"][:3], fix["lon"][:3] = 0.0, 0.0
    done = voyage(parts, text)
    assert done.datum == pytest.approx(fourth, abs=1e-12)
    assert done.table["x0"].to_numpy()[10:] == pytest.approx(0.0, abs=50.0)
    (unfixed,) = [f for f in done.report.findings if f.kind == "not_available"]
    assert "3 of 600" in unfixed.sentence and "without a fix" in unfixed.sentence
    assert not (np.abs(done.table["x0"].to_numpy()) > 50.0).any()


def test_the_datum_is_no_position_that_wanders_before_the_first_fix(voyage):
    parts, text = geodetic(0.0, 135.0)
    fix = parts["/position"].columns
    fourth = fix["lat"][3], fix["lon"][3]
    fix["lat"][:3], fix["lon"][:3] = 1e-5 * np.arange(3), 0.0
    done = voyage(parts, text)
    assert done.datum == pytest.approx(fourth, abs=1e-12)
    (far,) = [f for f in done.report.findings if f.channel == "position"]
    assert far.kind in ("implausible", "not_available") and "3 of 600" in far.sentence


@pytest.mark.parametrize(
    ("nowhere", "kind"), [((91.0, 181.0), "not_available"), ((12.0, 4000.0), "implausible")],
    ids=["no fix", "damaged"],
)  # fmt: skip
def test_a_position_of_no_place_is_blank(voyage, nowhere, kind):
    parts, text = geodetic(0.0, 135.0)
    clean = voyage(parts, text)
    fix = parts["/position"].columns
    fix["lat"][300:320], fix["lon"][300:320] = nowhere
    done = voyage(parts, text)
    (blank,) = [f for f in done.report.findings if f.channel == "position"]
    assert blank.kind == kind and blank.end_s - blank.start_s == pytest.approx(2.0, abs=0.11)
    x0 = done.table["x0"]
    assert x0[290:330].null_count() == 20
    assert (x0 - clean.table["x0"]).drop_nulls().abs().max() < 1e-6


@pytest.mark.parametrize(
    "other",
    [lambda lat, lon: (lat * 1e7, lon * 1e7), lambda lat, lon: (lon, lat),
     lambda lat, lon: (4807.038 + lat, lon)],
    ids=["1e-7 deg", "the other way round", "degrees and minutes"],
)  # fmt: skip
def test_positions_that_are_no_degrees_are_refused_with_what_to_look_at(voyage, other):
    parts, text = geodetic(34.8, 135.5)
    fix = parts["/position"].columns
    moved = dict(zip(fix, other(fix["lat"], fix["lon"]), strict=True))
    parts["/position"] = replace(parts["/position"], columns=moved)
    with pytest.raises(LogUnreadable, match=r"600 positions of 600 on /position") as refused:
        voyage(parts, text)
    assert "sign = 1e-7" in str(refused.value)


def test_a_log_that_is_mostly_without_a_fix_keeps_what_it_has(voyage):
    parts, text = geodetic(0.0, 135.0)
    fix = parts["/position"].columns
    fix["lat"][:400], fix["lon"][:400] = 91.0, 181.0
    assert voyage(parts, text).table["x0"].null_count() == 399  # the table begins with the wind
    fix["lat"][:], fix["lon"][:] = 91.0, 181.0
    with pytest.raises(LogUnreadable, match="no usable position"):
        voyage(parts, text)
