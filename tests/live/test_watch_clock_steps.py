"""Log times that cannot be: a message of tomorrow, a clock that is set, a topic that comes late."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from growing import written

from shiplog.live import session
from shiplog.live.clock_steps import ClockSteps
from shiplog.live.events import RowsCame
from shiplog.live.session import Watch
from shiplog.live.sources.base import Arrived
from shiplog.live.sources.mcap_file import McapFile
from shiplog.ship_profile import file as profiles
from shiplog.voyages.samples import fields_read

SECOND = 10**9
NOON = 1_780_000_000
TOPICS = ("/gyro", "/gnss/fix", "/wind", "/rudder")


def frame(*seconds: float) -> pl.DataFrame:
    return pl.DataFrame({"log_time": [NOON * SECOND + round(s * SECOND) for s in seconds]})


def seconds_of(frames) -> dict[str, list[float]]:
    return {t: [(n - NOON * SECOND) / SECOND for n in f["log_time"]] for t, f in frames.items()}


def after_ten_seconds() -> ClockSteps:
    steps = ClockSteps()
    steps.order({t: frame(*range(11)) for t in TOPICS}, ())
    return steps


def test_a_message_of_tomorrow_waits_and_is_left_out():
    steps = after_ten_seconds()
    first = steps.order({"/gyro": frame(86_400.0), "/wind": frame(11.0)}, TOPICS)
    assert seconds_of(first.frames) == {"/wind": [11.0]} and not first.left_out
    second = steps.order({"/gyro": frame(11.2, 11.3)}, TOPICS)
    assert seconds_of(second.frames) == {"/gyro": [11.2, 11.3]}
    assert second.left_out["/gyro"] == pytest.approx(86_389.0)  # ahead of the wind's 11 s
    assert second.back_s == 0.0 and steps.newest == NOON * SECOND + 11_300_000_000


def test_one_in_the_middle_of_a_file_is_left_out_at_once():
    found = ClockSteps().order({"/gyro": frame(1.0, 2.0, 5000.0, 3.0, 4.0)}, ())
    assert seconds_of(found.frames) == {"/gyro": [1.0, 2.0, 3.0, 4.0]}
    assert found.left_out["/gyro"] == pytest.approx(4998.0)


def test_after_a_pause_the_second_message_confirms_the_first():
    steps = after_ten_seconds()
    assert not steps.order({"/gyro": frame(1000.0)}, TOPICS).frames
    found = steps.order({"/gyro": frame(1000.1)}, TOPICS)
    assert seconds_of(found.frames) == {"/gyro": [1000.0, 1000.1]} and not found.left_out
    assert seconds_of(steps.order({"/wind": frame(1000.2)}, TOPICS).frames) == {"/wind": [1000.2]}


def test_a_slow_topic_does_not_wait_while_others_are_heard():
    steps = after_ten_seconds()
    for at in np.arange(11.0, 60.0):
        steps.order({"/gyro": frame(at)}, TOPICS)
    assert seconds_of(steps.order({"/rudder": frame(60.0)}, TOPICS).frames) == {"/rudder": [60.0]}


def test_a_clock_is_set_back_where_half_of_the_topics_say_so():
    steps = after_ten_seconds()
    one = steps.order({"/gyro": frame(-3590.0)}, TOPICS)  # it may be handed over late
    assert one.back_s == 0.0
    two = steps.order({"/wind": frame(-3589.9)}, TOPICS)
    assert two.back_s == pytest.approx(3599.9)
    assert steps.newest == NOON * SECOND - 3_589_900_000_000


def test_a_topic_that_is_handed_over_late_sets_no_clock_back():
    steps = after_ten_seconds()
    for at in (-100.0, -99.0, -98.0):
        assert steps.order({"/gnss/fix": frame(at)}, TOPICS).back_s == 0.0
        assert steps.order({"/gyro": frame(11.0 + at / 100.0)}, TOPICS).back_s == 0.0
        assert steps.order({"/wind": frame(-90.0), "/gyro": frame(12.0)}, TOPICS).back_s == 0.0


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """Half a minute of a sample log, and its profile."""
    path = tmp_path_factory.mktemp("logged") / "voyage.mcap"
    path.write_bytes(written("voyage_4", 640.0, 700.0))
    profile = profiles.load("esso-vectwin")
    return McapFile(path, fields_read.wanted(profile, {})).look(0), profile


def watched(logged, change) -> tuple[pl.DataFrame, list[str]]:
    """Final rows and what is said, where a look brings half a second of messages."""
    whole, profile = logged
    first = min(int(f["log_time"].to_numpy().min()) for f in whole.frames.values())
    looks = []
    for number in range(120):
        low, high = (first + round(s * SECOND) for s in (0.5 * number, 0.5 * number + 0.5))
        of = pl.col("log_time").is_between(low, high, "left")
        frames = {t: f.filter(of) for t, f in whole.frames.items()}
        frames = {t: f for t, f in frames.items() if f.height}
        looks.append(replace(whole, frames=change(0.5 * number, frames), ended=number == 119))
    source = SimpleNamespace(
        name="given", live=False, look=lambda clock: looks.pop(0) if looks else Arrived(ended=True)
    )
    run = SimpleNamespace(profile=profile)
    watch = Watch(run, source)  # pyright: ignore[reportArgumentType]
    events = []
    while not watch.done:
        events += watch.step(NOON * SECOND)
    events += watch.finish(NOON * SECOND)
    rows = [e.final for e in events if isinstance(e, RowsCame) and e.final.height]
    return pl.concat(rows), [e.sentence for e in events if hasattr(e, "sentence")]


@pytest.mark.long
def test_a_watch_goes_on_after_a_message_of_tomorrow_and_a_clock_set_back(logged, monkeypatch):
    nothing = SimpleNamespace(look=lambda final, provisional: [])
    monkeypatch.setattr(session, "ErrorNow", lambda run: nothing)
    times = ("log_time", "publish_time", "stamp")

    def tomorrow(at, frames):
        if at != 30.0:
            return frames
        first = pl.int_range(pl.len()) == 0
        later = [pl.col(c) + first.cast(pl.Int64) * 86_400 * SECOND for c in times]
        return frames | {"/gyro": frames["/gyro"].with_columns(later)}

    def set_back(at, frames):
        if at < 30.0:
            return frames
        return {t: f.with_columns(pl.col(c) - 3600 * SECOND for c in times)
                for t, f in frames.items()}  # fmt: skip

    plain, _ = watched(logged, lambda at, frames: frames)
    for change, words in ((tomorrow, "ahead of those before and after"), (set_back, "set back by")):
        rows, said = watched(logged, change)
        assert any(words in sentence for sentence in said)
        assert 0 <= plain.height - rows.height <= 6  # of six hundred
