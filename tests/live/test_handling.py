"""Segments whose actuators are moved as in no training voyage: closed forms of level and pace."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from shiplog.live.handling import Handling, moved
from shiplog.live.health import Health
from shiplog.voyages.rows.timescale import Timescale

STEP = 0.1  # s
SEGMENT = 40  # rows


class Rows(SimpleNamespace):
    def __len__(self) -> int:
        return len(self.starts)


def sailed(screw: np.ndarray, angle: np.ndarray) -> Rows:
    """A record of a screw and of an azimuth's angle."""
    each = [SimpleNamespace(name="screw", kind="propeller"),
            SimpleNamespace(name="azimuth", kind="azimuth")]  # fmt: skip
    return Rows(
        actuator=np.stack((screw, angle), 1), step=STEP, timescale=Timescale(4.0, 0.4, 0.4),
        starts=np.arange(len(screw)) == 0, profile=SimpleNamespace(actuators=each),
    )  # fmt: skip


def test_the_pace_of_a_sine_and_of_a_swing_are_their_closed_forms():
    """x = a sin 2πt/T changes over τ by 2a sin(πτ/T) cos(...), whose root mean square is
    √2 a |sin(πτ/T)|; a square wave of period 2 τ changes by 2a each τ."""
    a, T = 3.0, 8.0
    at = STEP * np.arange(round(T / STEP) * 10 + 10)
    sine = a * np.sin(2.0 * math.pi * at / T)
    swing = a * np.where(np.floor(at + 1e-9) % 2 == 0, 1.0, -1.0)
    level, pace = moved(np.stack((sine, swing), 1), sailed(sine, swing))
    assert pace[0] == pytest.approx(math.sqrt(2.0) * a * math.sin(math.pi / T), rel=1e-9)
    assert pace[1] == pytest.approx(2.0 * a, rel=1e-12)
    assert level[0] == pytest.approx(a, rel=1e-3)
    assert level[1] == 0.0  # an azimuth that goes round has no level


def test_what_is_a_quarter_beyond_the_training_voyages_is_unlike_them():
    at = STEP * np.arange(2 * SEGMENT + 1)
    slow = np.sin(2.0 * math.pi * at / 6.0)  # half a period: 3 s, the segment less τ
    known = Handling.of(sailed(10.0 * slow, 0.1 * slow))
    assert known.unlike(sailed(12.4 * slow, 0.124 * slow), 0) == []
    far = known.unlike(sailed(13.0 * slow, 0.0 * slow), 0)
    assert [(one.actuator, one.faster) for one in far] == [("screw", False), ("screw", True)]
    assert far[0].times == pytest.approx(1.3)
    assert far[0].sentence.startswith("screw goes 1.3 times as far as in any training voyage.")
    quick = np.sin(2.0 * math.pi * at / 3.0)  # to the same revolutions, twice as often
    (fast,) = known.unlike(sailed(10.0 * quick, 0.0 * slow), 0)
    assert fast.faster
    assert fast.times == pytest.approx(math.sqrt(3.0), rel=1e-2)
    # an azimuth far round, and held: its angle says nothing
    assert known.unlike(sailed(10.0 * slow, 0.1 * slow + 40.0), 0) == []


def test_an_actuator_that_no_training_voyage_moved_is_said_without_a_number():
    still, at = np.zeros(2 * SEGMENT + 1), STEP * np.arange(2 * SEGMENT + 1)
    known = Handling.of(sailed(np.sin(at), still))
    (one,) = known.unlike(sailed(np.sin(at), 0.2 * at), 0)
    assert one.sentence.startswith("azimuth changes and did in no training voyage.")


def test_it_is_said_once_and_when_it_is_over():
    at = STEP * np.arange(2 * SEGMENT + 1)
    known = Handling.of(sailed(np.sin(at), np.sin(at)))
    found = known.unlike(sailed(2.0 * np.sin(at), np.sin(at)), 0)
    health = Health()
    (notice,) = health.handling(found, 1)
    assert (notice.what, notice.channel, notice.over) == ("handling", "screw", False)
    assert "2.0 times as far" in notice.sentence
    assert health.handling(found, 2) == []
    assert health.bad == []  # the sensors are well
    (over,) = health.handling([], 3)
    assert over.over
    assert over.sentence == "screw is moved as in the training voyages again."
