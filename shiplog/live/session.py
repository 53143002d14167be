"""One watch: a source, a run, and what is reported step by step.

A step looks at the source once, takes some seconds of messages, and gives the events that follow.
Nothing in it waits or asks for the time: whoever steps brings it. So a test drives a watch as fast
as it likes, and the same messages give the same events.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from shiplog.exceptions import ShiplogError, listed
from shiplog.live import evidence_file, kept, kept_voyage, messages
from shiplog.live.alarm import Alarm, Watcher
from shiplog.live.calibration import Calibration
from shiplog.live.causal_rows import CausalRows, Rows
from shiplog.live.clock_steps import ClockSteps
from shiplog.live.error_now import ErrorNow
from shiplog.live.events import Event, RowsCame, SegmentDone
from shiplog.live.finished_segments import FinishedSegments, Segment
from shiplog.live.health import Health, Notice
from shiplog.live.kept import KeptRows, Saved
from shiplog.live.messages import Frames, Inflow, Window
from shiplog.live.nominal import Nominal
from shiplog.live.sources.base import Source
from shiplog.nomenclature.units import SECOND_NS
from shiplog.training.runs.load_model import Run
from shiplog.voyages.store.store import Store

SAVED_S = 5.0  # s by this machine's clock between two writings of the state
KEEP_S = 600.0  # s of rows after an alarm began, with which a diagnosis is worth its time
SLICE_S = 10.0  # s of messages of one step, where more have come: as in a replay
BREAK_S = 600.0  # s without a message, after which another voyage begins


@dataclass
class Watch:
    """nominal, calibration, watcher   None where there can be no alarm
    out     its own folder; None where nothing is kept
    """

    run: Run
    source: Source
    nominal: Nominal | None = None
    calibration: Calibration | None = None
    watcher: Watcher | None = None
    out: Path | None = None
    window: Window = field(default_factory=lambda: Window(90.0))
    inflow: Inflow = field(default_factory=Inflow)
    steps: ClockSteps = field(default_factory=ClockSteps)
    health: Health = field(default_factory=Health)
    rows: CausalRows = field(init=False)
    errors: ErrorNow = field(init=False)
    segments: FinishedSegments | None = None
    kept_rows: KeptRows | None = None
    last_arrival: int | None = None
    resume_after: int = 0  # ns: final rows up to here were dealt with before a kill
    ended: bool = False
    _clock: int = 0
    _saved_at: int = 0
    alarmed: int | None = None  # ns, when what an alarm is about began; None once it is kept

    def __post_init__(self) -> None:
        self.rows = CausalRows(self.run.profile, self.source.name)
        self.errors = ErrorNow(self.run)
        if self.nominal is not None:
            self.segments = FinishedSegments(self.nominal)
        if self.out is not None:
            self.kept_rows = KeptRows(self.out / kept.ROWS)

    def step(self, clock: int) -> Iterator[Event]:
        """Look once, at this machine's time [ns]; the events that follow."""
        self._clock = clock
        waiting = bool(self.inflow)
        if not waiting:  # else what came before is dealt with first
            yield from self._arrive(clock)
        if self.inflow:
            yield from self._take(self.inflow.take(SLICE_S))
            yield from self._look(end=False)
        elif self.ended:
            yield from self._look(end=True)

    @property
    def done(self) -> bool:
        """Whether the source has ended and all of it was dealt with."""
        return self.ended and not self.inflow

    @property
    def busy(self) -> bool:
        """Whether there is more to deal with at once."""
        return bool(self.inflow)

    def _arrive(self, clock: int) -> Iterator[Event]:
        arrived = self.source.look(clock)
        for note in arrived.notes:
            yield from self.health.once("source", "source", note, clock)
        if arrived.anew:
            self.steps = ClockSteps()
            yield from self._begin_anew()
        self.window.metadata = {k: dict(v) for k, v in arrived.metadata.items()}
        self.window.topics |= arrived.topics
        frames = yield from self._ordered(arrived.frames, clock)
        self.inflow.add(frames)
        if arrived.count:
            self.last_arrival = clock
        if self.last_arrival is None:
            self.last_arrival = clock
        self.ended = arrived.ended
        if not arrived.ended:
            yield from self.health.arrivals(self.last_arrival, clock, self.source.name)
        if newest := messages.newest(frames):
            yield from self.health.clock(newest, clock, self.source.live)

    def _ordered(self, frames: Frames, clock: int) -> Generator[Event, None, Frames]:
        """Those of the messages whose log time can be one."""
        found = self.steps.order(frames, self.window.parts)
        for topic, ahead in found.left_out.items():
            yield from self.health.once(
                "clock", topic,
                f"A message of {topic} is logged {ahead:.0f} s ahead of those before and after it: "
                "it is left out.", clock,
            )  # fmt: skip
        if found.back_s:
            yield from self.health.once(
                "clock", "back",
                f"The recorder's clock was set back by {found.back_s:.0f} s: another voyage "
                "begins.", clock,
            )  # fmt: skip
            yield from self._begin_anew()
        return found.frames

    def _take(self, frames: Frames) -> Iterator[Event]:
        oldest = messages.oldest(frames)
        if self.window.newest and oldest - self.window.newest > BREAK_S * SECOND_NS:
            yield from self._begin_anew()
        self.window.add(frames)

    def _look(self, end: bool) -> Iterator[Event]:
        newest = self.window.newest
        if not newest:
            return
        try:
            rows = self.rows.look(self.window, end)
        except ShiplogError as error:
            yield from self.health.once("refused", "log", error.message, newest)
            return
        if rows is None:
            return
        yield from self._missing(newest)
        yield from self.health.channels(rows.heard, newest)
        yield from self.health.faults(rows.findings, rows.recent_s, newest)
        yield RowsCame(rows.final, rows.provisional, rows.revised, self.rows.delay_s)
        final = rows.final
        if self.resume_after:  # rows that were dealt with before; a segment may begin in them
            final = final.filter(final["time"].to_physical() > self.resume_after)
        if final.height or rows.provisional.height:
            yield from self.errors.look(final, rows.provisional)
        if self.kept_rows is not None:
            self.kept_rows.add(final)
        if self.segments is not None:
            yield from self._segments(rows, end)

    def _missing(self, time: int) -> Iterator[Event]:
        """Topics of the profile that the source does not have, and a log of another ship."""
        own, named = self.run.profile.ship.name, self.window.metadata.get("voyage", {}).get("ship")
        if named and named != own:
            yield from self.health.once(
                "source", "ship",
                f"{self.source.name} names its ship {named!r}, and the run is of {own!r}.", time,
            )  # fmt: skip
        for topic in sorted(set(self.run.profile.wanted()) - self.window.topics):
            there = listed(sorted(self.window.topics))
            yield from self.health.once(
                "missing", topic,
                f"{self.source.name} has no topic {topic!r} so far. Topics found: {there}.", time,
            )  # fmt: skip

    def _segments(self, rows: Rows, end: bool) -> Iterator[Event]:
        assert self.segments is not None
        final = rows.final
        if self.health.bad and final.height:
            times = final["time"].to_physical()
            self.segments.distrust(int(times[0]), int(times[-1]) + 1)
        if not final.height and not end:
            return
        finished = self.segments.add(final, end)
        for time, found in self.segments.unlike:
            yield from self.health.handling(found, time)
        for segment in finished:
            yield from self._segment(segment)
        # of all of them or none: what has been cut is not cut again
        if finished and self._clock - self._saved_at > SAVED_S * SECOND_NS:
            self.save()

    def _segment(self, segment: Segment) -> Iterator[Event]:
        watcher = self.watcher
        if watcher is None or not np.isfinite(segment.gram).all() or segment.gram[0, 0] <= 0.0:
            return
        alarm: Alarm | None = watcher.add(segment.gram, segment.end)
        assert watcher.latest is not None
        yield SegmentDone(
            segment.end, watcher.latest.total, watcher.thresholds.change, watcher.square,
            watcher.latest.suspects[0],
        )  # fmt: skip
        if alarm is not None:
            self._saved_at = 0
            if not alarm.again:
                began = [one.began for one in alarm.suspects[:1]]
                self.alarmed = min([*began, segment.start])
            yield replace(alarm, voyage=self.rows.anchor)

    def finish(self, clock: int) -> Iterator[Event]:
        """All that came is final, once the source is closed."""
        while self.inflow:
            yield from self._take(self.inflow.take(SLICE_S))
            yield from self._look(end=False)
        yield from self._look(end=True)
        if self.kept_rows is not None:
            self.kept_rows.flush()
        self.save()

    def keep_voyage(self, store: Store, last: bool) -> str:
        """Where an alarm has stood for KEEP_S, or the watch ends with one: the rows since the
        suspected beginning as a voyage of the store, once an alarm; its name, or nothing."""
        if self.alarmed is None or self.kept_rows is None or self.out is None:
            return ""
        since = self.alarmed
        table = self.kept_rows.table(since)
        if table is None or table.height < 2:
            return ""
        lasted = int(table["time"].to_physical()[-1]) - since
        if not last and lasted < KEEP_S * SECOND_NS:
            return ""
        self.alarmed = None
        return kept_voyage.add(store, table, self.run.profile, self.out, self.rows.datum)

    def _begin_anew(self) -> Iterator[Event]:
        """Another voyage: what is left of the one before is final."""
        if self.window.newest:
            yield from self._look(end=True)
        self.window.clear()
        self.rows = CausalRows(self.run.profile, self.source.name)
        self.errors = ErrorNow(self.run)
        if self.nominal is not None:
            self.segments = FinishedSegments(self.nominal)
        if self.watcher is not None:
            self.watcher.begin_voyage()
        self.resume_after = 0

    # --- to go on after the process has ended -------------------------------------------------

    def save(self) -> None:
        """What another process needs to go on, where there is a folder for it."""
        if self.out is None or self.watcher is None or self.calibration is None:
            return
        begin = self.segments.begin if self.segments is not None else 0
        facts = {
            "run": self.calibration.identity, "source": self.source.name,
            "place": self.source.place(), "begin": begin,
            "alarmed": self.alarmed, "done": self.rows.done, "anchor": self.rows.anchor,
            "datum": self.rows.datum,
        } | evidence_file.facts(self.watcher)  # fmt: skip
        if self.kept_rows is not None:
            self.kept_rows.flush_if_old()
        kept.save(self.out, Saved(facts, evidence_file.arrays(self.watcher)))
        self._saved_at = self._clock

    def resume(self, saved: Saved) -> bool:
        """Go on from there; False where it is of another run or source, and nothing is taken."""
        facts = saved.facts
        if self.watcher is None or self.calibration is None:
            return False
        if facts.get("run") != self.calibration.identity or facts["source"] != self.source.name:
            return False
        if not evidence_file.restore(self.watcher, saved.arrays, facts):
            return False
        begin = int(facts.get("begin") or 0)
        if self.segments is not None:
            self.segments.begin = begin
        self.resume_after = int(facts.get("done") or 0)
        self.alarmed = None if facts.get("alarmed") is None else int(facts["alarmed"])
        if facts.get("anchor") is not None:
            self.rows.anchor = int(facts["anchor"])
            datum = facts.get("datum")
            self.rows.datum = None if datum is None else (float(datum[0]), float(datum[1]))
        return True


def notices(events: list[Event]) -> list[Notice]:
    """Those of them."""
    return [event for event in events if isinstance(event, Notice)]
