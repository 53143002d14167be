"""Voyages of known motion through every reader: a few of the thousand of the experiment."""

from dataclasses import replace

import numpy as np
import pymap3d
import pytest

from pipelines.experiments.stored_values import changes, instruments, judge, motion, recorders
from pipelines.experiments.stored_values.judge import Draw

USUAL = instruments.SETS["usual"]
SECONDS = 240.0  # instead of 600


def drawn(kind, recorder, change=None, seed=3, seconds=SECONDS):
    rng = np.random.default_rng(seed)
    sailed = motion.sail(replace(motion.KINDS[kind], seconds=seconds), rng)
    seen, hz = instruments.recorded(sailed, USUAL, rng)
    how = {}
    chosen = next((c for c in changes.CHANGES if c.name == change), None)
    if chosen:
        chosen.act(seen, how, sailed, rng)
    return Draw(seed, sailed, USUAL, hz, recorders.RECORDERS[recorder], chosen, seen, how)


@pytest.mark.parametrize("recorder", recorders.RECORDERS)
def test_a_sound_voyage_is_stored_as_it_was_sailed(recorder):
    done = judge.judged(drawn("usv", recorder))
    assert done.right, done.wrong
    assert not done.wrongly_alarmed, done.findings


@pytest.mark.parametrize(
    ("change", "recorder"),
    [("speed: knots as m/s", "csv"), ("course reversed", "nmea"), ("yaw rate to port", "mcap"),
     ("heading anticlockwise", "ros 2 bag"), ("shaft: rps as rpm", "parquet"),
     ("north and east of the position exchanged", "european csv"),
     ("longitude counted to the west", "folder of tables"), ("rows twice", "csv"),
     ("32-bit microseconds wrap", "csv"), ("a field too many in some rows", "csv"),
     ("typographic minus", "csv"), ("GNSS in GPS time", "mcap")],
)  # fmt: skip
def test_what_is_changed_is_stored_right_or_named(change, recorder):
    done = judge.judged(drawn("usv", recorder, change))
    assert not done.wrong_and_unsaid, (done.wrong, done.findings)


# Voyages that were once stored wrong without a word, or alarmed, and why; one of each kind.
FOUND = {
    5135: "a heading reversed on a nearly straight course was blamed on the propeller",
    5170: "a heading in radians on a nearly straight course hardly changes",
    20744: "a heading anticlockwise on a nearly straight course was blamed on the propeller",
    7023: "the same of a large ship at dead slow, beside a position of 1e-6 deg",
    7046: "revolutions per minute of a ferry that sails stern first",
    7067: "latitude and longitude exchanged, far from the profile's datum",
    7218: "degrees read as radians of a fast boat at 2 Hz are no heading at all",
    7219: "a heading frozen for 200 s, and the way swings by 20 deg",
    9514: "a heading that is 90 deg off, of a ship whose course bends by a few tens of degrees",
    5033: "sound: a noisy heading in 0.1 deg comes to the same number twice",
    20263: "sound: a heading repeats for less than a course is averaged over",
    7070: "sound: the same without a gyro, beside a noisy position",
    5049: "sound: a delay of 4 s explained the noise of a second, and no way of a minute",
    9745: "sound: a velocity in steps of 0.05 m/s at anchor",
    7096: "sound: the same of a position at 1 Hz",
}


@pytest.mark.parametrize("seed", FOUND, ids=lambda seed: FOUND[seed])
def test_what_was_once_wrong_stays_right(seed):
    done = judge.judged(judge.draw(seed))
    assert not done.wrong_and_unsaid, (done.wrong, done.findings)
    assert not done.wrongly_alarmed, done.findings


def test_a_frozen_heading_is_found_beside_a_gyro_that_is_biased():
    """Turning by 8 deg in a stretch of 200 s is seen beside 0.15 deg/s of noise, whose bias is
    measured where the heading moves."""
    one = drawn("coaster", "mcap", "heading frozen for 200 s", seconds=600.0)
    one.seen.columns["yaw_rate"] = one.seen.columns["yaw_rate"] + 0.05
    assert any(text.startswith("held heading") for text in judge.judged(one).findings)


def test_a_rudder_to_port_is_named_on_a_large_ship_at_dead_slow():
    """Its yaw rate changes in minutes by less than a gyro's noise in a second."""
    one = drawn("vlcc at dead slow", "csv", "rudder to port", seed=21, seconds=3600.0)
    assert judge.judged(one).named


@pytest.mark.parametrize("datum", [(54.0, 10.0), (-33.0, 170.0), (0.5, -0.2)])
def test_degrees_are_those_of_the_ellipsoid(datum):
    sailed = motion.sail(motion.KINDS["usv"], np.random.default_rng(0))
    object.__setattr__(sailed, "datum", datum)
    north, east = np.array([0.0, 3000.0, -4000.0]), np.array([0.0, -5000.0, 2000.0])
    latitude, longitude = motion.degrees(sailed, north, east)
    n, e, _ = pymap3d.geodetic2ned(latitude, longitude, 0.0, *datum, 0.0)
    assert n == pytest.approx(north, abs=1e-3) and e == pytest.approx(east, abs=1e-3)


def test_a_ship_goes_as_fast_as_it_says():
    """The path has the speed of midship everywhere: the integral against the derivative."""
    sailed = motion.sail(motion.KINDS["coaster"], np.random.default_rng(1))
    gone = np.gradient(sailed.x0, sailed.t), np.gradient(sailed.y0, sailed.t)
    speed = np.hypot(sailed.surge, sailed.sway)
    assert np.abs(np.hypot(*gone) / speed - 1.0)[5:-5].max() < 1e-3


def test_there_are_thirty_kinds_of_changes():
    assert len({c.name for c in changes.CHANGES if c.seen_by != "undetermined"}) >= 30
    assert {c.family for c in changes.CHANGES} >= {"unit", "sign", "frame", "clock", "order"}
