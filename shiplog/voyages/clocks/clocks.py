"""Which clock says when a sensor measured, and what is done where it cannot be believed.

Single stamps that cannot be of a voyage are left out. A clock that is wrong as a whole, since it
was never set, is moved as a whole: what it counts from one message to the next is as measured.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import polars as pl

from shiplog.exceptions import listed
from shiplog.logs.health import dates
from shiplog.logs.health.faults import LATEST_S, of_publishers
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.nomenclature.units import SECOND_NS
from shiplog.ship_profile.profile import Profile, Source
from shiplog.voyages.rows import resampling

RECORDER = "log_time"
COLUMNS = {  # of a source: the column of its clock, and the one that it is held against
    "message": ("stamp", RECORDER), "log": (RECORDER, "publish_time"),
    "publish": ("publish_time", RECORDER),
}  # fmt: skip

# Topics of one clock are recorded with delays that differ by less; and a clock whose distance from
# the recorder's scatters by more says nothing of another clock's.
ONE_CLOCK_NS = 1.0 * SECOND_NS
EARLY_S = 0.05  # as much before 0 is rounding of the stamps, not a clock


def is_latency(late: float) -> bool:
    """Whether a message that is logged so long [s] after its stamp may simply have come late."""
    return -EARLY_S <= late <= LATEST_S


def clock_columns(frame: pl.DataFrame, source: Source) -> tuple[str, str]:
    """The column that says when a source measured, and the one to hold it against."""
    if source.clock == "message" and frame["stamp"].null_count() == frame.height:
        return COLUMNS["log"]  # the message carries no time: the recorder's is all there is
    return COLUMNS[source.clock]


def without_strays(reading: Reading, profile: Profile) -> tuple[Reading, list[Finding]]:
    """The log without the messages whose stamps cannot be of this voyage, and what they are."""
    frames, findings = dict(reading.frames), []
    for source in sources_of(profile):
        frame = frames.get(source.topic)
        if frame is None or frame.height == 0:
            continue
        clock, other = clock_columns(frame, source)
        known = frame.filter(pl.col(clock).is_not_null())
        times = known[clock].to_numpy()
        if other == "publish_time" and not of_publishers(known):
            other = clock  # the time of writing confirms nothing
        stray = resampling.strays(times, known[other].to_numpy())
        if not stray.any():
            continue
        frames[source.topic] = known.filter(~stray)
        off = np.median(times[~stray]) - times[stray].astype(float)
        far = float(np.abs(off).max())
        sentence = (
            f"{stray.sum()} of {len(times)} messages on {source.topic} are left out: their times "
            f"cannot be of this voyage, being up to {dates.how_far(far)} away by "
            f"{dates.CLOCKS[clock]}."
        )
        value = round(far / SECOND_NS, 3)
        findings.append(Finding("jump", source.topic, sentence, value=value, unit="s"))
    return replace(reading, frames=frames), findings


@dataclass(frozen=True)
class Clock:
    """One topic by one clock: its date [ns], and how far it is ahead of the recorder's [ns]."""

    topic: str
    column: str
    date: float
    ahead: float  # median; 5 % and 95 % of the messages are less, or more
    low: float
    high: float


def on_one_date(reading: Reading, profile: Profile) -> tuple[Reading, list[Finding]]:
    """The log with the clocks moved that are wrong as a whole, and by how much each was.

    Clocks more than a day apart cannot be of one voyage. The latest date that can be right is
    believed: a clock that was not set stands in the past. If no clock of the profile can be right,
    all are moved onto the recorder's, if that can be, or stay where they are.
    """
    frames, findings = dict(reading.frames), []
    clocks = each(reading, profile)
    if not clocks:
        return reading, []
    groups = groups_of(clocks)
    dated = [group for group in groups if dates.possible(date_of(group))]
    reference = max(dated, key=date_of) if dated else max(groups, key=len)
    recorded = float(np.median([clock.date - clock.ahead for clock in clocks]))
    onto_recorder = -ahead_of(reference) if not dated and dates.possible(recorded) else 0.0
    for group in groups:
        apart = ahead_of(group) - ahead_of(reference)
        tied = steady(group) and steady(reference) and abs(apart) > dates.DAY_NS
        shift = round(onto_recorder - (apart if tied else 0.0))
        if shift == 0:
            continue
        for clock in group:
            moved = (pl.col(clock.column) + shift).alias(clock.column)
            frames[clock.topic] = frames[clock.topic].with_columns(moved)
        other = "the recorder's clock" if onto_recorder else f"those on {_topics(reference)}"
        findings.append(_moved(group, shift, other))
    return replace(reading, frames=frames), findings


def no_common_time(sampled: dict[str, resampling.Samples], start: int, end: int) -> list[Finding]:
    """Sources that were measured at another time than the heading, which is from start to end."""
    findings = []
    for name, samples in sampled.items():
        if len(samples.time) == 0 or (samples.time[-1] >= start and samples.time[0] <= end):
            continue
        if samples.hold and samples.time[0] <= end:
            continue  # the last order before the voyage holds in it
        far = float(max(start - samples.time[-1], samples.time[0] - end))
        sentence = (
            f"{name} has no time in common with the heading: it is {dates.how_far(far)} away. Set "
            "another `clock` for it in the profile, or record the log again with clocks that are "
            "set."
        )
        value = round(far / SECOND_NS, 3)
        findings.append(Finding("clock_offset", name, sentence, value=value, unit="s"))
    return findings


def sources_of(profile: Profile) -> list[Source]:
    """The sensors and the actuators."""
    return [*(sensor for _, sensor in profile.sensors.items()), *profile.actuators]


def each(reading: Reading, profile: Profile) -> list[Clock]:
    """The clocks of a profile's sources, by topic and column."""
    found: dict[tuple[str, str], Clock] = {}
    for source in sources_of(profile):
        frame = reading.frames.get(source.topic)
        if frame is None or frame.height == 0:
            continue
        column, _ = clock_columns(frame, source)
        both = frame.select(column, RECORDER).drop_nulls() if column != RECORDER else frame
        if both.height == 0:
            continue
        times = both[column].to_numpy().astype(float)
        ahead = times - both[RECORDER].to_numpy()
        low, median, high = np.quantile(ahead, (0.05, 0.5, 0.95))
        found[source.topic, column] = Clock(
            source.topic, column, float(np.median(times)), float(median), float(low), float(high)
        )
    return list(found.values())


def groups_of(clocks: list[Clock]) -> list[list[Clock]]:
    """Those of one clock each: their distances from the recorder's overlap."""
    groups: list[list[Clock]] = []
    most = -np.inf
    for clock in sorted(clocks, key=lambda c: c.low):
        if clock.low > most + ONE_CLOCK_NS:
            groups.append([])
        groups[-1].append(clock)
        most = max(most, clock.high)
    return groups


def date_of(group: list[Clock]) -> float:
    return float(np.median([clock.date for clock in group]))


def ahead_of(group: list[Clock]) -> float:
    return float(np.median([clock.ahead for clock in group]))


def steady(group: list[Clock]) -> bool:
    return all(clock.high - clock.low <= ONE_CLOCK_NS for clock in group)


def _moved(group: list[Clock], shift: int, other: str) -> Finding:
    side = "behind" if shift > 0 else "ahead of"
    sentence = (
        f"The times on {_topics(group)} are {dates.how_far(abs(shift))} {side} {other}. They were "
        "moved as a whole; the time from one message to the next is as measured."
    )
    topics = {clock.topic for clock in group}
    channel = topics.pop() if len(topics) == 1 else "log"
    value = round(-shift / SECOND_NS, 3)
    return Finding("clock_offset", channel, sentence, value=value, unit="s")


def _topics(group: list[Clock]) -> str:
    return listed({clock.topic for clock in group}, most=dates.MOST_TOPICS)
