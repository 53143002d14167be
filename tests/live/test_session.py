"""A watch that is killed, and goes on: the same segments and the same evidence as one that is not.

The products of a segment are here a function of its rows alone, so that no model is fitted; their
likelihood is tested in `test_change_evidence`.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from growing import written

from shiplog.diagnosis.linear import segments
from shiplog.live import finished_segments, kept, session
from shiplog.live.alarm import Thresholds, Watcher
from shiplog.live.events import RowsCame, SegmentDone
from shiplog.live.handling import Handling
from shiplog.live.health import Notice
from shiplog.live.segment_products import Directions
from shiplog.live.session import Watch
from shiplog.live.sources.mcap_file import McapFile
from shiplog.ship_profile import file as profiles
from shiplog.voyages.rows.timescale import Timescale
from shiplog.voyages.samples import fields_read

PROFILE = profiles.load("esso-vectwin")
WANTED = fields_read.wanted(PROFILE, {})
QUICK = Timescale(4.0, 0.4, 0.4)  # a segment of four seconds
NUMBERS = 4
CLOCK = 1_780_000_000_000_000_000
ACTUATORS = len(PROFILE.actuators)
USUAL = Handling(np.full(ACTUATORS, np.inf), np.full(ACTUATORS, np.inf))


@pytest.fixture(scope="module")
def content() -> bytes:
    return written("voyage_4", 630.0, 690.0)


@pytest.fixture(autouse=True)
def products_of_rows(monkeypatch):
    def grams(ref, grid, record, rows):
        found = []
        for at in rows:
            state = record.state[at : at + grid.rows : 10]
            E = np.concatenate((state[:, [1, 3, 5]] - state[:, [1, 3, 5]].mean(0),
                                np.sin(state[:, [0, 2]])), 1)  # fmt: skip
            found.append(E.T @ E + np.eye(NUMBERS + 1))
        return found

    monkeypatch.setattr(finished_segments.segment_products, "grams", grams)
    nothing = SimpleNamespace(look=lambda final, provisional: [])
    monkeypatch.setattr(session, "ErrorNow", lambda run: nothing)


def watch(path, out, at=None, handling=USUAL) -> Watch:
    grid = segments.grid(SimpleNamespace(timescale=QUICK, step=0.1))
    nominal = SimpleNamespace(
        grid=grid, timescale=QUICK, record=SimpleNamespace(profile=PROFILE),
        campaign=SimpleNamespace(reference=None), handling=handling,
    )  # fmt: skip
    causes = {"one": np.array([2]), "two": np.array([3])}
    directions = Directions(np.zeros(NUMBERS), np.eye(NUMBERS)[:, :1], np.eye(NUMBERS)[:, 1:2],
                            causes, 1.0)  # fmt: skip
    thresholds = Thresholds(math.inf, math.inf, False)
    run = SimpleNamespace(
        profile=PROFILE, models=dict, band=lambda: None, config=SimpleNamespace(window=25)
    )
    watcher = Watcher(directions, thresholds, 1.0)
    it = SimpleNamespace(identity="it")
    return Watch(run, McapFile(path, WANTED, at), nominal, it, watcher, out)


def sailed(made: Watch, steps: int) -> list:
    """Events of so many steps of ten seconds of messages."""
    return [event for n in range(steps) for event in made.step(CLOCK + n * 10**10)]


def done(events) -> list[SegmentDone]:
    return [event for event in events if isinstance(event, SegmentDone)]


@pytest.mark.long
def test_a_killed_watch_goes_on_as_if_it_had_not_been(tmp_path, content):
    path = tmp_path / "voyage.mcap"
    path.write_bytes(content)
    whole = watch(path, tmp_path / "whole")
    events = sailed(whole, 8)
    events += whole.finish(CLOCK)
    assert len(done(events)) >= 10
    ends = [event.time for event in done(events)]
    assert np.diff(ends).min() >= 4 * 10**9  # end to end, and none twice

    first = watch(path, tmp_path / "killed")
    before = sailed(first, 4)
    assert 0 < len(done(before)) < len(done(events))
    saved = kept.load(tmp_path / "killed")  # all that is left of it
    assert saved is not None
    after = watch(path, tmp_path / "killed", saved.facts["place"])
    assert after.resume(saved)
    later = sailed(after, 8)
    later += after.finish(CLOCK)
    assert [e.time for e in done(before)] + [e.time for e in done(later)] == ends
    assert done(later)[-1].statistic == pytest.approx(done(events)[-1].statistic, rel=1e-9)
    # rows are given once, and those of before the kill are not kept twice
    tables = kept.KeptRows(tmp_path / "killed" / kept.ROWS).table(0)
    assert tables is not None and tables["time"].n_unique() == tables.height


@pytest.mark.long
def test_a_state_of_another_run_is_not_taken(tmp_path, content):
    path = tmp_path / "voyage.mcap"
    path.write_bytes(content)
    first = watch(path, tmp_path / "out")
    sailed(first, 3)
    first.save()
    saved = kept.load(tmp_path / "out")
    assert saved is not None
    other = watch(path, tmp_path / "out")
    other.calibration = SimpleNamespace(identity="another")
    assert not other.resume(saved)
    assert other.watcher is not None and other.watcher.ends == []


@pytest.mark.long
def test_no_segment_counts_while_a_channel_is_silent(tmp_path, content):
    """Health comes first: the gyro's yaw rate stops, and no evidence is made of what follows."""
    path = tmp_path / "voyage.mcap"
    path.write_bytes(content)
    made = watch(path, None)
    look = made.source.look

    def without_wind(clock):
        arrived = look(clock)
        frames = dict(arrived.frames)
        if "/wind/apparent" in frames:
            wind = frames["/wind/apparent"]
            frames["/wind/apparent"] = wind[: wind.height // 2]
        return type(arrived)(frames, arrived.notes, arrived.metadata, arrived.topics,
                             arrived.anew, arrived.ended)  # fmt: skip

    made.source.look = without_wind
    events = [*sailed(made, 8), *made.finish(CLOCK)]
    said = [e.sentence for e in events if hasattr(e, "sentence")]
    assert any("wind is silent" in s for s in said)
    last = max(e.time for e in events if isinstance(e, RowsCame))
    assert done(events) and last - done(events)[-1].time > 20 * 10**9


def test_segments_that_are_handled_as_no_training_voyage_is_are_no_evidence(tmp_path, content):
    """Rudders of a training campaign that never went beyond 5 deg: they say nothing of what the
    model does at 35."""
    path = tmp_path / "voyage.mcap"
    path.write_bytes(content)
    usual = watch(path, tmp_path / "usual")
    all_of_them = done([*sailed(usual, 8), *usual.finish(CLOCK)])
    small = Handling(np.array([math.radians(5.0), math.radians(5.0), np.inf]), USUAL.pace)
    strict = watch(path, tmp_path / "strict", handling=small)
    events = [*sailed(strict, 8), *strict.finish(CLOCK)]
    assert len(done(events)) < len(all_of_them)
    said = [e for e in events if isinstance(e, Notice) and e.what == "handling" and not e.over]
    assert said and "as far as in any training voyage" in said[0].sentence
    lost = {e.time for e in all_of_them} - {e.time for e in done(events)}
    assert said[0].time in lost


@pytest.mark.long
def test_after_a_long_pause_another_voyage_begins(tmp_path, content):
    """Twenty minutes without a message: the rows before them are final, none bridges the pause."""
    path = tmp_path / "voyage.mcap"
    path.write_bytes(content)
    made = watch(path, None)
    look, pause = made.source.look, 1200 * 10**9

    def later(clock):
        arrived = look(clock)
        frames = {}
        for topic, frame in arrived.frames.items():
            half = pl.col("log_time") > int(frame["log_time"][frame.height // 2])
            moved = [pl.when(half).then(pl.col(n) + pause).otherwise(pl.col(n)).alias(n)
                     for n in ("log_time", "publish_time", "stamp")]  # fmt: skip
            frames[topic] = frame.with_columns(moved)
        return replace(arrived, frames=frames)

    made.source.look = later
    events = [*sailed(made, 10), *made.finish(CLOCK)]
    rows = pl.concat([e.final for e in events if isinstance(e, RowsCame) and e.final.height])
    steps = rows["time"].diff().drop_nulls().dt.total_milliseconds()
    assert sorted(set(steps.to_list()))[:1] == [100] and (steps > 1_000_000).sum() == 1
    assert rows.height > 500 and rows["x0"].null_count() < 20
