"""Rows at 10 Hz while messages still come, by the rules of `ingest`.

A row of `ingest` is a function of the messages about it. So the same functions are asked again
with the last WINDOW_S of messages: what they give is the row as it would be if the log ended now.
It changes until the rules that look ahead have heard what they wait for, T_i being the period of
the slowest source:

    rule                                          looks ahead
    a value between two samples                   T_i
    a spike, and whether a channel is lively      NEIGHBOURS T_i
    a late message, or a lost one                 AROUND T_i
    a value that repeats: held, then frozen       FROZEN_S
    a jump against a rate of another clock        LATE_S

Until then a row is provisional. It is final SETTLED_S after the longest of these. What depends on a
whole record (how finely an instrument counts, how it scatters) is taken of the window, so that a
mark can differ from that of `ingest`; how often is measured in docs/use/watch.md.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.live.health import Heard
from shiplog.live.messages import Window
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Contents, Health, Reading, Topic
from shiplog.nomenclature.units import SECOND_NS
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.ingest import alignment
from shiplog.voyages.rows import fault_detection, resampling
from shiplog.voyages.rows.resampling import STEP_NS
from shiplog.voyages.samples import sampling
from shiplog.voyages.samples.sampling import Sampled

WINDOW_S = 60.0  # of messages that a row is worked out from, where sources are quicker than 1.6 Hz
WINDOW_PERIODS = 100  # of the slowest source, at least
SETTLED_S = 1.0  # beyond what the slowest rule waits for
QUICK_S = 12.0  # of messages from which a provisional row is worked out
EVERY_S = 5.0  # s of rows that are made final at once
FIRST_S = 8.0  # s of messages before the first row: that the sources begin together shows by then


@dataclass(frozen=True)
class Rows:
    """What a look at the messages changed.

    final        rows that no rule changes any more, those of earlier looks left out
    provisional  all rows behind the last final one
    revised      rows whose value or mark is another than the last look gave
    heard        source → when it was heard last, by the clock of its rows
    findings     of what `ingest` would say of the window; of now is what ends after `recent_s`
    """

    final: pl.DataFrame
    provisional: pl.DataFrame
    revised: int
    heard: Mapping[str, Heard] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    recent_s: float = 0.0


class CausalRows:
    """The rows of one voyage, look by look.

    anchor  ns, time of the first row; None before it is known
    done    ns, time of the last final row
    """

    def __init__(self, profile: Profile, name: str) -> None:
        self.profile, self.name = profile, name
        self.anchor: int | None = None
        self.done: int | None = None
        self.datum: tuple[float, float] | None = None
        self.delay_s = fault_detection.FROZEN_S + SETTLED_S
        self.window_s = WINDOW_S
        self._shown: pl.DataFrame | None = None  # the provisional rows of the last look

    def look(self, window: Window, end: bool = False) -> Rows | None:
        """The rows as they are now; None while there are too few messages. Raises ShiplogError as
        `ingest` does.

        end   nothing comes any more: all rows are final
        """
        if self.anchor is None:
            messages = window.frames()
            heard = [frame["log_time"] for frame in messages.values()]
            first = min((int(times[0]) for times in heard), default=window.newest)
            if window.newest - first < FIRST_S * SECOND_NS and not end:
                return None
        due = end or self.done is None or self._due(window)
        sampled = self._sampled(window, None if due else QUICK_S)
        if self.anchor is None:
            self.anchor, self.datum = sampled.start, sampled.datum
        table, findings = self._table(sampled)
        self._measure(sampled)
        window.seconds = max(window.seconds, self.window_s)
        until = sampled.end - (0 if end else round(self.delay_s * SECOND_NS))
        times = table["time"].to_physical()
        new = pl.lit(True) if self.done is None else times > self.done
        table = table.filter(new)
        times = table["time"].to_physical()
        final = table.filter(times <= until) if due else table.clear()
        provisional = table.filter(times > until) if due else table
        revised = self._revised(table)
        if final.height:
            self.done = int(final["time"].to_physical()[-1])
        self._shown = provisional
        heard = {name: Heard(int(one.time[-1]), one.period_s) for name, one in sampled.every.items()
                 if len(one.time) and not one.hold}  # fmt: skip
        recent = (sampled.end - sampled.start) * 1e-9 - self.delay_s - EVERY_S
        return Rows(final, provisional, revised, heard, findings, recent)

    def _due(self, window: Window) -> bool:
        assert self.done is not None
        return window.newest - self.done > (self.delay_s + EVERY_S) * SECOND_NS

    def _sampled(self, window: Window, seconds: float | None) -> Sampled:
        reading = as_reading(window, self.name, self.profile, seconds)
        with quietly():
            sampled = sampling.sampled(reading, self.profile, {})
        start = sampled.start
        if self.anchor is not None:
            steps = max(-(-(start - self.anchor) // STEP_NS), 0)
            start = self.anchor + steps * STEP_NS
            if self.datum is not None:
                sampled = replace(sampled, datum=self.datum)
        return replace(sampled, start=start, end=max(sampled.end, start))

    def _table(self, sampled: Sampled) -> tuple[pl.DataFrame, tuple[Finding, ...]]:
        with quietly():
            found = alignment.aligned(sampled)
        return found.table, (*found.left_out, *found.findings)

    def _measure(self, sampled: Sampled) -> None:
        """How long the slowest source makes a row wait, and how many messages say how it is."""
        periods = [one.period_s for one in sampled.every.values()
                   if len(one.time) > 2 and not one.hold]  # fmt: skip
        slowest = min(max(periods, default=0.1), sampled_longest(self.profile))
        waits = max(fault_detection.NEIGHBOURS, resampling.AROUND) * slowest
        self.delay_s = max(waits, fault_detection.FROZEN_S) + SETTLED_S
        self.window_s = max(WINDOW_S, WINDOW_PERIODS * slowest)

    def _revised(self, table: pl.DataFrame) -> int:
        before = self._shown
        if before is None or not before.height or not table.height:
            return 0
        both = table.join(before, on="time", suffix=":before", maintain_order="left")
        if not both.height:
            return 0
        changed = np.zeros(both.height, bool)
        for name in (*self.profile.columns, "quality"):
            now, was = both[name].to_numpy(), both[f"{name}:before"].to_numpy()
            changed |= ~np.isclose(now.astype(float), was.astype(float), equal_nan=True)
        return int(changed.sum())


def sampled_longest(profile: Profile) -> float:
    """s, between samples that this ship's motion can bear."""
    return resampling.longest_s(profile.ship.length_m)


def as_reading(
    window: Window, name: str, profile: Profile, seconds: float | None = None
) -> Reading:
    """The messages of the last seconds as those of a log. A topic of the profile that is silent
    just now is there all the same: its rows are a gap."""
    frames = window.frames(seconds)
    topics = {t: Topic(t, "", "", "", None) for t in {*window.topics, *profile.wanted()}}
    contents = Contents(Path(name), 0, topics, window.metadata, "", "")
    count = sum(frame.height for frame in frames.values())
    return Reading(contents, Health("salvage", count, 0, 0, 0, (), {}), frames)


@contextmanager
def quietly() -> Iterator[None]:
    """Without the words that are said once of a log, and would be said at each look."""
    loggers: Mapping[str, logging.Logger] = {
        name: one for name, one in logging.root.manager.loggerDict.items()
        if name.startswith(("shiplog.voyages", "shiplog.logs")) and isinstance(one, logging.Logger)
    }  # fmt: skip
    kept = {name: one.disabled for name, one in loggers.items()}
    for one in loggers.values():
        one.disabled = True
    try:
        yield
    finally:
        for name, one in loggers.items():
            one.disabled = kept[name]
