"""Words of an alarm. When something began is a date only where the stamps are one."""

from __future__ import annotations

from datetime import UTC, datetime

from shiplog.live.alarm import Alarm, Suspect
from shiplog.live.events import as_json, sentence

SECOND = 10**9
DATED = 1_780_000_000  # s


def alarm(end: float, began: float, voyage: float | None) -> Alarm:
    suspects = (Suspect("current", 9.0, round(began * SECOND)),)
    first = None if voyage is None else round(voyage * SECOND)
    return Alarm(round(end * SECOND), 9.0, 8.0, suspects, False, False, first)


def test_a_recorder_with_a_clock_gives_a_date():
    said = sentence(alarm(DATED + 90, DATED + 30.04, DATED))
    date = datetime.fromtimestamp(DATED + 30, UTC).isoformat()[:19]
    assert f"since about {date}.0Z." in said


def test_a_recorder_without_a_clock_gives_the_second_of_the_voyage():
    """Stamps that count from when the recorder was switched on, 516 s before the voyage."""
    said = sentence(alarm(1206.1, 606.1, 516.1))
    assert "since about 90 s into the voyage." in said and "1970" not in said


def test_a_voyage_may_begin_at_the_zero_of_its_clock():
    assert "since about 30 s into the voyage." in sentence(alarm(480.0, 30.0, 0.0))


def test_without_a_beginning_of_the_voyage_the_recorders_own_seconds():
    assert "since about 606.1 s of the recorder's clock." in sentence(alarm(1206.1, 606.1, None))


def test_json_keeps_the_stamps_of_the_log():
    found = as_json(alarm(1206.1, 606.1, 516.1))
    assert found is not None
    assert found["time"] == "1970-01-01T00:20:06.1Z"
    assert found["suspects"][0]["began"] == "1970-01-01T00:10:06.1Z"
