"""Which causes the sensors exclude by themselves: what a voyage has, and what its motion shows."""

import pytest
from body_velocities import BODY, in_body_axes

from shiplog.diagnosis.verdict.excluded_causes import excluded_causes


def excluded(*campaigns):
    return excluded_causes([{"one": table} for table in campaigns], BODY)


@pytest.fixture(scope="module")
def sound():
    return in_body_axes(11, seconds=1800.0)


def test_sound_sensors_exclude_faults_and_say_by_how_much(sound):
    found = excluded(sound)
    assert set(found) >= {"heading_offset"}
    why = found["heading_offset"]
    assert why.startswith("the sensors alone exclude it: heading ")
    assert why.endswith(" deg")


@pytest.mark.parametrize("degrees", [2.0, -0.5])
def test_a_compass_that_is_misaligned_is_not_excluded(degrees):
    found = excluded(in_body_axes(12, heading_offset=degrees, seconds=1800.0))
    assert "heading_offset" not in found


def test_a_fault_of_the_nominal_voyages_is_a_change_all_the_same(sound):
    before = in_body_axes(13, heading_offset=2.0, seconds=1800.0)
    assert "heading_offset" not in excluded(sound, before)


def test_a_velocity_that_the_recorder_turns_excludes_no_compass_that_turned_it(sound):
    """Of `heading_offset:gnss` position and velocity say nothing: both are over ground."""
    assert not any(label.endswith((":gnss", "_turned")) for label in excluded(sound))


def test_a_short_voyage_excludes_nothing():
    assert excluded(in_body_axes(14, seconds=60.0)) == {}


def test_without_voyages_nothing_is_excluded():
    assert excluded_causes([{}, {}], BODY) == {}
