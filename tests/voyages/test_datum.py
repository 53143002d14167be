"""A datum and the positions that are counted from it."""

import numpy as np
import pytest
import sailing
from test_ingest_geodetic import geodetic

from shiplog.voyages.ingest.ingest import ingest


def read(tmp_path, latitude, longitude, datum, sign=""):
    """A circle at a place, read through a profile with a datum."""
    parts, text = geodetic(latitude, longitude)
    text = text.replace('unit = "deg"', f'unit = "deg"{sign}', 1)
    text += f"\n[site]\ndatum = [{datum[0]}, {datum[1]}]\n"
    return ingest(sailing.write(tmp_path / "turn.mcap", parts), sailing.profile(text))


def said(voyage):
    return [f for f in voyage.report.findings if f.channel in ("position", "velocity")]


@pytest.mark.parametrize(
    ("datum", "reason", "key"),
    [
        ((0.5, -135.0), "sign", "sign = [1.0, -1.0] on [sensors.position]"),
        ((-20.0, 135.0), "", "look at the datum"),
    ],
    ids=["longitude counted to the west", "another place"],
)
def test_a_datum_that_is_far_from_all_positions_is_said_and_not_used(tmp_path, datum, reason, key):
    """The circle of 20 m turns too little in a minute for sensors to contradict each other."""
    voyage = read(tmp_path, 0.0, 135.0, datum)
    assert np.abs(voyage.table["x0"].to_numpy()).max() < 50.0
    assert voyage.datum == pytest.approx((0.0, 135.0), abs=1e-3)
    (found,) = said(voyage)
    assert (found.kind == "contradiction") is bool(reason)
    assert found.reason == reason and key in found.sentence and "[site]" in found.sentence


def test_a_datum_a_hundred_kilometres_away_is_that_of_the_voyage(tmp_path):
    voyage = read(tmp_path, 0.0, 135.0, (0.9, 135.0))
    assert voyage.datum == (0.9, 135.0) and said(voyage) == []
    assert voyage.table["x0"][0] == pytest.approx(-0.9 * 110_570.0, rel=1e-3)


def test_across_the_180_degree_meridian_a_datum_is_near(tmp_path):
    voyage = read(tmp_path, 0.0, 180.0, (0.0, -179.9))
    assert voyage.datum == (0.0, -179.9) and said(voyage) == []
