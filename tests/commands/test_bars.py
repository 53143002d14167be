"""The time left of stages and of queues, against clocks that are set by hand."""

import io
import re
import sys

import pytest

from shiplog.commands import bars, diagnose, evaluate, identify
from shiplog.commands.bars import Schedule

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


# --- a queue without a terminal


@pytest.fixture
def clock(monkeypatch):
    """What `time.monotonic` gives, in a list of one; and no terminal."""
    now = [0.0]
    monkeypatch.setattr(bars.time, "monotonic", lambda: now[0])
    monkeypatch.setattr(bars, "drawable", lambda: False)
    return now


def test_a_queue_leaves_a_line_twice_a_minute_from_the_beginning(clock, caplog):
    """The first hour of days, too: no time left is given then."""
    caplog.set_level("INFO")
    with bars.Bars({"a": 1.0, "b": 3.0}) as queue:
        for clock[0], share in ((10.0, 0.001), (31.0, 0.01), (50.0, 0.02), (70.0, 0.2)):
            queue.show("a", share, ended=False)
    assert [r.getMessage() for r in caplog.records] == [
        "0 of 2 trainings done, 0%", "0 of 2 trainings done, 5%; about 22 min left",
    ]  # fmt: skip


def test_what_an_interrupted_training_had_done_is_no_speed(clock, caplog):
    """It goes on from 80 %; 5 % more took 100 s, so that the other 15 % take 300 s."""
    caplog.set_level("INFO")
    with bars.Bars({"a": 1.0}) as queue:
        queue.show("a", 0.0, ended=False)
        queue.show("a", 0.8, ended=False)
        clock[0] = 100.0
        queue.show("a", 0.85, ended=False)
    assert [r.getMessage() for r in caplog.records] == [
        "0 of 1 trainings done, 85%; about 5 min left"
    ]


# --- in a narrow terminal


def terminal(monkeypatch):
    """Standard error as a terminal of 60 columns, kept as text."""
    stream = io.StringIO()
    stream.isatty = lambda: True  # type: ignore[method-assign]
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", stream)
    return stream


@pytest.mark.parametrize("stages", [diagnose.STAGES, identify.STAGES, evaluate.STAGES])
def test_a_bar_says_everything_at_60_columns(monkeypatch, stages):
    shown = terminal(monkeypatch)

    @bars.staged("diagnosing", stages)
    def work():
        for stage in stages:
            bars.reach(stage)
            bars._CURRENT.get().refresh()

    work()
    text = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", shown.getvalue()).replace("\r", "\n")
    lines = [line.rstrip() for line in text.splitlines()]
    assert "…" not in text and all(len(line) <= 60 for line in lines)
    for stage in stages:
        own = [line for line in lines if f"diagnosing: {stage}" in line]
        assert own and all("% " in line and line.endswith("left") for line in own), text


def test_items_are_gone_through_with_their_expected_seconds(monkeypatch):
    terminal(monkeypatch)
    seen = []
    for item in bars.through(["a", "bb"], "comparing", len):
        seen.append(item)
        assert bars._CURRENT.get().schedule._seconds == {"1 of 2": 1, "2 of 2": 2}
    assert seen == ["a", "bb"] and bars._CURRENT.get() is None
    assert list(bars.through([], "comparing", len)) == []


def test_a_file_gets_no_bar(capsys):
    assert list(bars.through(["a"], "comparing", len)) == ["a"]
    assert capsys.readouterr().err == ""
