"""Segments in units of the ship: how long, what a bin and a node are, and cut on a longer grid."""

from dataclasses import replace

import closed
import numpy as np
import pytest

from shiplog.diagnosis.linear import segments
from shiplog.diagnosis.trial import trial_voyages
from shiplog.ship_profile import file as profiles
from shiplog.voyages.rows import timescale
from shiplog.voyages.rows.timescale import STEP_ROWS, Timescale

RECORD = closed.record(profiles.load("esso-osaka"))  # 120 s


@pytest.mark.parametrize("speed", [0.31, 0.4, 0.5, 0.59])
def test_a_three_metre_ship_keeps_half_a_minute(speed):
    assert timescale.of_ship(3.0, speed) == Timescale(30.0, 2.0, 2.0) == Timescale()


@pytest.mark.parametrize(
    ("length", "speed", "seconds"),
    [
        (2.0, 0.80, 21.0),  # a catamaran of 2.5 s
        (3.0, 0.20, 60.0),  # 15 s
        (76.2, 1.0, 240.0),  # a supply vessel of 76 s: the longest
        (305.0, 3.4, 240.0),  # a tanker of 90 s
        (30.0, 1.0, 120.0),  # 30 s
        (3.0, 0.0, 240.0),  # at rest
    ],
)
def test_larger_and_slower_ships_have_longer_segments(length, speed, seconds):
    found = timescale.of_ship(length, speed)
    assert found.seconds == pytest.approx(seconds)
    assert found.bin == found.node_step == pytest.approx(seconds / 15)


@pytest.mark.parametrize("time", np.geomspace(1.0, 200.0, 25))
def test_every_scale_fits_the_rows(time):
    """Bins and nodes lie on nodes, of records at 10 Hz; 15 bins, 16 nodes; four ship times, within
    a factor of two where it is not at a bound."""
    found = timescale.of_ship(time, 1.0)
    g = segments.grid(replace(RECORD, timescale=found))
    assert (g.bins, g.nodes) == (15, 16)
    assert g.rows == round(found.seconds / 0.1) == 15 * round(found.bin / 0.1)
    assert (g.instants - 1) % 15 == 0 and g.rows % g.every == 0 and g.every % STEP_ROWS == 0
    assert g.weights.sum(1) == pytest.approx(1.0)  # hats add up to one everywhere
    if 21.0 < found.seconds < 240.0:
        assert 2.0 < found.seconds / time < 6.1


def test_the_grid_that_nobody_scales_is_todays():
    g = segments.grid(RECORD)
    assert (g.seconds, g.bin, g.node_step, g.instants, g.bins, g.nodes) == (
        30.0,
        2.0,
        2.0,
        151,
        15,
        16,
    )


def test_on_a_longer_grid_a_bin_is_a_longer_mean():
    """Of a ramp its middle: 4 s to a bin, 60 s to a segment, two of them in 120 s."""
    ramp = replace(closed.record(profiles.load("esso-osaka")), timescale=Timescale(60.0, 4.0, 4.0))
    g, rows = segments.grid(ramp), segments.begins(ramp)
    assert rows.tolist() == [0, 600]
    ramp.state[:] = ramp.time[:, None]
    cut = segments.cut(ramp, rows)
    middle = 60.0 * np.arange(2)[:, None] + 4.0 * np.arange(15) + 2.0
    assert cut.y == pytest.approx(np.repeat(middle[..., None], 6, -1), abs=1e-9)
    assert cut.driven.shape[1] == g.instants == 151


def test_a_short_campaign_has_shorter_segments():
    """A ship of 60 s would have segments of 240 s; 2000 s hold 48 of 30 s and not of 60 s."""
    assert timescale.of_ship(60.0, 1.0).seconds == 240.0
    assert timescale.of_ship(60.0, 1.0, 2000.0).seconds == 30.0
    assert timescale.of_ship(60.0, 1.0, 7000.0).seconds == 120.0
    assert timescale.of_ship(3.0, 0.4, 100.0).seconds == 30.0


def test_what_drives_a_node_is_the_mean_of_the_rows_about_it():
    """At a node of 0.8 s: the trapezium over four rows to either side, and no row twice."""
    ramp = replace(closed.record(profiles.load("esso-osaka")), timescale=Timescale(60.0, 4.0, 4.0))
    g, rows = segments.grid(ramp), segments.begins(ramp)
    values = np.random.default_rng(0).standard_normal((len(ramp), 2))
    found = segments.average_at_instants(ramp, rows, values)
    assert g.every == 4
    at = rows[1] + 7 * 4
    row = 0.5 * (values[at - 2] + values[at + 2]) + values[at - 1 : at + 2].sum(0)
    assert found[1, 7] == pytest.approx(row / 4.0)


@pytest.mark.parametrize("empty", ["trial", "nominal campaign"])
def test_without_a_row_there_is_no_speed_to_scale_by(empty):
    """The campaigns stay as they are; that they are too short for a verdict is reported later."""
    none = replace(RECORD, state=RECORD.state[:0], voyage=RECORD.voyage[:0], time=RECORD.time[:0])
    nominal, recorded = (RECORD, none) if empty == "trial" else (none, RECORD)
    given = trial_voyages.rescale_time(None, nominal, recorded)
    assert given[0] is nominal and given[1] is recorded
