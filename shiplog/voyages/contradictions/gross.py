"""Sensors that contradict each other grossly, found before any fit; and what none can show.

A fit of small errors takes it that the two sides are of one thing. Whether they are is asked here,
by counting alone: `contradictions_pairs` says how two instruments are joined,
`contradictions_evidence` which of them a third one confirms.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import polars as pl

from shiplog.logs.health.health_report import Finding, NotCompared
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.contradictions import drive, places, turning, twins
from shiplog.voyages.contradictions.actuators import ASTERN, Driven
from shiplog.voyages.contradictions.evidence import Evidence, gather
from shiplog.voyages.contradictions.track import Track, track

MOVES = "a passage with turns to both sides, at a steady speed for some minutes"


@dataclass(frozen=True)
class Contradictions:
    """What excludes each other, and what was not, or never is, comparable.

    faulty   channels that a finding names, or may mean: no fit of small errors uses them
    """

    findings: tuple[Finding, ...]
    not_compared: tuple[NotCompared, ...]
    faulty: frozenset[str] = frozenset()

    @property
    def of_velocity(self) -> bool:
        """Whether position and velocity (with the heading, in body axes) agree enough to fit."""
        return not self.faulty & {"position", "velocity", "heading"}

    @property
    def of_yaw_rate(self) -> bool:
        """The same of yaw rate and heading."""
        return not self.faulty & {"yaw_rate", "heading"}


def find(table: pl.DataFrame, profile: Profile) -> Contradictions:
    """Of one voyage at 10 Hz, as ingest makes it."""
    t = track(table, profile)
    if t is None:
        nothing = NotCompared(
            "any two sensors", "too few rows hold all of them", "a log in which all of them run"
        )
        return Contradictions((), (nothing,))
    e = gather(t)
    of_motion = [
        *turning.heading_and_rate(e), *turning.heading_and_way(e), *places.position_and_velocity(e)
    ]  # fmt: skip
    counted = drive.driven(t, e)
    found = (*of_motion, *drive.findings(t, e, counted))
    faulty = e.faulty | {f.channel for f in found}
    return Contradictions(found, tuple(_not_compared(t, e, counted)), frozenset(faulty))


def _not_compared(t: Track, e: Evidence, counted: list[Driven]) -> Iterator[NotCompared]:
    p = t.profile
    little = "the ship hardly moves"
    if t.derived:
        yield NotCompared(
            "position with velocity", "the velocity is the position's own change",
            "speed and course of a receiver, or a log",
        )  # fmt: skip
    elif e.joined is None:
        yield NotCompared("position with velocity", little, MOVES)
    if p.sensors.yaw_rate is None:
        yield NotCompared(
            "yaw rate with heading", "the yaw rate is the heading's own derivative",
            "a rate gyro",
        )  # fmt: skip
    elif e.turned is None:
        yield NotCompared("yaw rate with heading", "the ship hardly turns", MOVES)
    if "heading" not in e.faulty:
        yield from _heading(t, e)
    if not t.body and t.arm == 0 and not t.derived:
        yield NotCompared(
            "place of the antenna", "position and velocity are of one receiver, and move alike "
            "wherever it stands", "a velocity measured in body axes, or by a second antenna",
        )  # fmt: skip
    if p.sensors.kind("position") == "local" and not t.derived:
        yield NotCompared(
            "the scale that position and velocity share", "a unit that both have wrong cancels",
            "a position in latitude and longitude",
        )  # fmt: skip
    yield from _actuators(t, e, counted)
    yield from twins.not_compared(t.profile, t.driven, counted)


def _heading(t: Track, e: Evidence) -> Iterator[NotCompared]:
    ways = (e.by_position, e.by_velocity)
    if not any(w is not None and w.how == "as it is" and w.sense for w in ways):
        yield NotCompared(
            "the heading's sense with the way over ground",
            "the ship does not go where it points, or hardly turns",
            MOVES,
        )
    if not t.body:
        yield NotCompared(
            "the heading's zero", "velocity over ground does not pass through the heading: drift "
            "and a compass that is misaligned look alike", "a log in body axes, or the same run on "
            "opposite headings without wind",
        )  # fmt: skip


def _actuators(t: Track, e: Evidence, counted: list[Driven]) -> Iterator[NotCompared]:
    sure = {o.name for o in counted if o.direction != ASTERN and (o.along or o.against)}
    left = [a.name for a in t.profile.actuators if a.name not in sure and a.kind != "azimuth"]
    if left:
        names = ", ".join(left)
        doubtful = e.faulty & {"heading", "velocity", "position"}
        why = "the motion contradicts itself" if doubtful else "too little of the motion follows it"
        yield NotCompared(
            f"the sign of {names}", why,
            "each actuator moved by itself to both sides, for some ship's lengths",
        )  # fmt: skip
