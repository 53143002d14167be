"""The time left of a sequence of stages, against clocks that are set by hand."""

import pytest

from pipelines.bars import Schedule

STAGES = {"nominal voyages": 60.0, "hypotheses": 30.0, "report": 10.0}


def test_stages_that_take_as_long_as_expected():
    schedule = Schedule(STAGES, now=100.0)
    assert schedule.at(115.0) == pytest.approx((0.15, 85.0))
    schedule.reach("hypotheses", now=160.0)
    assert schedule.at(175.0) == pytest.approx((0.75, 25.0))


def test_a_slower_machine_is_slower_in_what_is_left():
    """Twice as long for the first stage: 15 s of the second are a quarter of its 60."""
    schedule = Schedule(STAGES, now=0.0)
    schedule.reach("hypotheses", now=120.0)
    assert schedule.at(135.0) == pytest.approx((0.675, 2.0 * 32.5))


def test_what_was_in_the_cache_does_not_make_the_rest_as_fast():
    """The first stage took 3 s of 60. After 30 s of the second, 90 s of work took 33 s, so that the
    last 10 s take 3.7 s, and more as the second goes on; by the first alone they take 0.5 s."""
    schedule = Schedule(STAGES, now=0.0)
    schedule.reach("hypotheses", now=3.0)
    assert schedule.at(33.0) == pytest.approx((0.9, 10.0 * 33.0 / 90.0))
    assert schedule.at(93.0) == pytest.approx((0.9, 10.0 * 93.0 / 90.0))
    schedule.reach("report", now=93.0)
    assert schedule.at(93.0) == pytest.approx((0.9, 10.0 * 93.0 / 90.0))


def test_a_first_stage_that_takes_longer_tells_of_the_others():
    schedule = Schedule(STAGES, now=0.0)
    assert schedule.at(120.0) == pytest.approx((0.6, 80.0))
