"""Every source of a log as samples on one time line, before any grid: what was left out of them,
where the voyage begins and ends, and where x0 = y0 = 0 lies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from shiplog.exceptions import LogUnreadable
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.logs.reading.senders import Senders
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.clocks import clocks, time_line
from shiplog.voyages.rows import resampling
from shiplog.voyages.rows.left_out import LeftOut
from shiplog.voyages.rows.resampling import Samples
from shiplog.voyages.samples import (
    datum,
    empty_course,
    lost_pose,
    required_topics,
    sampling_findings,
    source_samples,
    status,
    two_sources,
)
from shiplog.voyages.samples import plausible_values as plausible

# Memory goes with the rows of the grid: stamps so scattered that a sample stands for a thousand
# rows (100 s) are no voyage. A million rows, 28 hours, take 100 MB, whatever they hold.
LEAST_ROWS, MOST_ROWS = 1_000_000, 1_000


@dataclass(frozen=True)
class Sampled:
    """The samples of one log; start and end [ns] are the first row and the last.

    profile       as the log has it: of two receivers on one topic, the one that is read
    shared, moved findings of two sources, and of clocks, courses and sampling, in that order
    refused       values whose status says that they are none
    implausible   values that cannot be, or stand for none
    contradicted  topics whose clock is not that of the others: then no row can be used
    """

    profile: Profile
    sensors: dict[str, Samples]
    actuators: dict[str, Samples]
    start: int
    end: int
    shared: list[Finding]
    moved: list[Finding]
    refused: list[LeftOut]
    implausible: list[LeftOut]
    contradicted: frozenset[str]
    datum: datum.Place | None
    misplaced: Finding | None  # a datum that lies elsewhere
    health: tuple[Finding, ...]

    @property
    def every(self) -> dict[str, Samples]:
        return self.sensors | self.actuators


def sampled(reading: Reading, profile: Profile, sent: Mapping[str, Senders]) -> Sampled:
    """Raises ChannelMissing, LogUnreadable.

    sent  by topic, those who send on it, where there are several
    """
    required_topics.require(reading, profile)
    reading, profile, shared = two_sources.told_apart(reading, profile, sent)
    timed = time_line.one(reading, profile)
    reading, moved = timed.reading, list(timed.findings)
    reading, refused = status.heeded(reading, profile)
    reading, lost = lost_pose.blanked(reading, profile)
    reading, screen = plausible.screened(reading, profile)
    moved += empty_course.findings_of(reading, profile, source_samples.raw_values)
    mounting = source_samples.mounting(reading, profile)
    sensors = {
        name: source_samples.of_sensor(reading, profile, name)
        for name, _ in profile.sensors.items()
    }
    base = sensors["heading"].time
    if len(base) < 2:
        raise LogUnreadable(
            f"{reading.contents.path.name} holds {len(base)} usable heading sample(s) on "
            f"{profile.sensors.heading.topic}.",
            hint="check topic, field and `clock` of the heading in the profile; `shiplog profile "
            "LOG` drafts one from the topics of the log.",
        )
    longest = resampling.longest_s(profile.ship.length_m)
    driven = {
        actuator.name: sampling_findings.order_of(
            source_samples.of_actuator(reading, actuator, longest), actuator, base
        )
        for actuator in profile.actuators
    }
    every = {**sensors, **driven}
    moved += sampling_findings.findings(every, frozenset(driven))
    start, end = _span(base, [one for one in every.values() if not one.hold])
    if not timed.contradicted:
        moved += clocks.no_common_time(every, start, end)
    if (end - start) // resampling.STEP_NS > max(LEAST_ROWS, MOST_ROWS * len(base)):
        raise LogUnreadable(
            f"{reading.contents.path.name} holds {len(base)} heading samples whose stamps lie "
            f"{(end - start) * 1e-9 / resampling.DAY_S:.1f} days apart.",
            hint="set another `clock` for the heading in the profile, or record the log again "
            "with a clock that runs.",
        )
    origin, misplaced = None, None
    if profile.sensors.kind("position") == "geodetic":
        origin, misplaced = datum.choose(reading, profile, sensors["position"])
    return Sampled(
        profile, sensors, driven, start, end, [*shared], [*moved, *mounting], [*refused],
        [*lost, *screen.left_out], frozenset(timed.contradicted), origin, misplaced,
        tuple(reading.health.findings),
    )  # fmt: skip


def _span(base: np.ndarray, sampled: list[resampling.Samples]) -> tuple[int, int]:
    """First and last grid time: the heading's, less the moment the instruments take to start.

    Instruments that begin within a second of each other are not late; a voyage without its first
    tenth has no gap. One that begins later than that does have one.
    """
    moment = 1_000_000_000
    started = [int(s.time[0]) for s in sampled if len(s.time) and s.time[0] - base[0] <= moment]
    stopped = [int(s.time[-1]) for s in sampled if len(s.time) and base[-1] - s.time[-1] <= moment]
    inside = base[(base >= max(started)) & (base <= min(stopped))]
    return (int(inside[0]), int(inside[-1])) if len(inside) > 1 else (int(base[0]), int(base[-1]))
