"""Clocks of one voyage that contradict each other by more than a second.

Each topic's stamps are held against the recorder's clock, which is the same for all of them. Two
topics whose stamps differ from it by more than a second from each other were not stamped by one
clock, and what was measured at one time stands at two. A difference that is one of two time scales
to 0.3 s is that one, and is taken out. Any other may be a zone, a clock that was not set, or a
delay that nothing states: then no row can be used until somebody says which.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import polars as pl

from shiplog.exceptions import listed
from shiplog.logs.health import dates, leap_seconds
from shiplog.logs.health.faults import LATEST_S
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.nomenclature.units import SECOND_NS
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.clocks import clocks
from shiplog.voyages.clocks.clocks import EARLY_S, RECORDER, Clock

HOUR_S, DAY_S = 3600.0, 86_400.0
ONE_OFFSET_S = 0.3  # two statements of one clock's offset differ by what it jitters
PACE = 0.1  # of a voyage's length: a recorder whose clock ran otherwise wrote a replay


@dataclass(frozen=True)
class Agreed:
    """A log with its clocks on one time scale, as far as that is certain.

    findings      what was taken out, and what contradicts
    contradicted  topics whose clock is not that of the others: no row of them all can be used
    """

    reading: Reading
    findings: list[Finding] = field(default_factory=list)
    contradicted: frozenset[str] = frozenset()


def agreed(reading: Reading, profile: Profile) -> Agreed:
    """The log with known differences of time scales taken out, and the others said."""
    found = clocks.each(reading, profile)
    groups = clocks.groups_of(found)
    if len(groups) < 2 or not _keeps_pace(reading, profile):
        return Agreed(reading)
    near = [group for group in groups if abs(clocks.ahead_of(group)) <= clocks.ONE_CLOCK_NS]
    reference = max(near or groups, key=len)
    frames, findings = dict(reading.frames), []
    contradicted: set[str] = set()
    for group in groups:
        apart = (clocks.ahead_of(group) - clocks.ahead_of(reference)) / SECOND_NS
        if group is reference or abs(apart) * SECOND_NS > dates.DAY_NS:
            continue  # more than a day: `clocks.on_one_date` moved it, or said that it cannot
        if _both_late(group, reference):
            continue
        known, scale = leap_seconds.known_difference(apart, clocks.date_of(group))
        if known and clocks.steady(group):
            for clock in group:
                moved = (pl.col(clock.column) - leap_seconds.of_ns(known)).alias(clock.column)
                frames[clock.topic] = frames[clock.topic].with_columns(moved)
            findings.append(_moved(group, reference, known, scale))
        else:
            contradicted |= {clock.topic for clock in group}
            findings.append(_contradiction(group, reference, apart, profile))
    return Agreed(replace(reading, frames=frames), findings, frozenset(contradicted))


def unreported(health: Sequence[Finding], own: Sequence[Finding]) -> list[Finding]:
    """What a log's reader found, but for differences of clocks of which ingest says more: that they
    were taken out, or that they contradict each other. Of days apart the reader says the dates."""
    sizes = [
        abs(one.value) for one in own
        if one.value is not None and abs(one.value) < DAY_S
        and (one.kind == "clock_offset" or one.reason == "clock")
    ]  # fmt: skip
    return [
        one for one in health
        if one.kind != "clock_offset" or one.value is None
        or not any(abs(abs(one.value) - size) <= ONE_OFFSET_S for size in sizes)
    ]  # fmt: skip


def _keeps_pace(reading: Reading, profile: Profile) -> bool:
    """Whether the recorder's clock ran as the heading's stamps do."""
    frame = reading.frames.get(profile.sensors.heading.topic)
    if frame is None or frame.height < 2:
        return False
    column, _ = clocks.clock_columns(frame, profile.sensors.heading)
    spans = [float(np.ptp(frame[name].drop_nulls().to_numpy())) for name in (column, RECORDER)]
    return abs(spans[0] - spans[1]) <= PACE * spans[0]


def _both_late(group: list[Clock], reference: list[Clock]) -> bool:
    """Whether stamps of both groups are before the recorder's by no more than a receiver's latency:
    then they are of one clock, and the messages of one group came later."""
    ahead = [clocks.ahead_of(one) / SECOND_NS for one in (group, reference)]
    return all(-LATEST_S <= one <= EARLY_S for one in ahead)


def _named(group: list[Clock]) -> str:
    return listed({clock.topic for clock in group}, most=dates.MOST_TOPICS)


def _channel(group: list[Clock]) -> str:
    topics = {clock.topic for clock in group}
    return topics.pop() if len(topics) == 1 else "log"


def _moved(group: list[Clock], reference: list[Clock], known: float, scale: str) -> Finding:
    side = "ahead of" if known > 0 else "behind"
    sentence = (
        f"The times on {_named(group)} are {abs(known):g} s {side} those on {_named(reference)}: "
        f"{scale}. They were put onto the others' scale."
    )
    return Finding("clock_offset", _channel(group), sentence, value=known, unit="s")


def _contradiction(
    group: list[Clock], reference: list[Clock], apart: float, profile: Profile
) -> Finding:
    hours = round(apart / HOUR_S)
    zone = bool(hours) and abs(apart - HOUR_S * hours) <= LATEST_S
    why = f", {abs(hours)} whole hour{'s' * (abs(hours) > 1)} as of a time zone" if zone else ""
    side = "ahead of" if apart > 0 else "behind"
    keys = [
        *(f"[sensors.{name}]" for name, sensor in profile.sensors.items()
          if sensor.topic in {clock.topic for clock in group}),
        *(f"[[actuators]] of {one.name}" for one in profile.actuators
          if one.topic in {clock.topic for clock in group}),
    ]  # fmt: skip
    by_recorder = all(clock.column == RECORDER for clock in group)
    how = 'clock = "message"' if by_recorder else 'clock = "log", the recorder\'s,'
    sentence = (
        f"The times on {_named(group)} are {dates.how_far(abs(apart) * SECOND_NS)} {side} those on "
        f"{_named(reference)}{why}: they are not of one clock, and no row can be used. Set {how} "
        f"in {listed(keys)}, if that one is right, or record again with clocks that are set."
    )
    low = min(clock.low for clock in group) - clocks.ahead_of(reference)
    high = max(clock.high for clock in group) - clocks.ahead_of(reference)
    return Finding(
        "contradiction", _channel(group), sentence, value=round(apart, 3),
        low=round(low / SECOND_NS, 3), high=round(high / SECOND_NS, 3), unit="s", reason="clock",
    )  # fmt: skip
