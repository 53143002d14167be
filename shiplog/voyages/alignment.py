"""A log on its 10 Hz grid: every source between its samples, reduced to midship and marked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog import frames
from shiplog.channels import Quality
from shiplog.exceptions import LogUnreadable
from shiplog.logs.health_report import Finding
from shiplog.logs.read import Reading
from shiplog.logs.senders import Senders
from shiplog.profile import Actuator, Profile, Sensor
from shiplog.voyages import (
    actuator_limits,
    clocks,
    datum,
    empty_course,
    left_out,
    required_topics,
    resampling,
    sample_faults,
    sampling_findings,
    source_samples,
    status,
    time_line,
    two_sources,
)
from shiplog.voyages import plausible_values as plausible
from shiplog.voyages.voyage_grid import VoyageGrid, mark_gaps, mark_holds, mark_jumps

# Memory goes with the rows of the grid: stamps so scattered that a sample stands for a thousand
# rows (100 s) are no voyage. A million rows, 28 hours, take 100 MB, whatever they hold.
LEAST_ROWS, MOST_ROWS = 1_000_000, 1_000


@dataclass(frozen=True)
class Aligned:
    """A log on its 10 Hz grid, reduced to midship and marked."""

    table: pl.DataFrame  # as a Voyage has it
    grid: VoyageGrid
    samples: list[tuple[str, resampling.Samples]]  # of each sensor and actuator
    left_out: list[Finding]
    datum: datum.Place | None
    misplaced: Finding | None  # a datum that lies elsewhere


def aligned(reading: Reading, profile: Profile, sent: Mapping[str, Senders]) -> Aligned:
    required_topics.require(reading, profile)
    reading, profile, shared = two_sources.told_apart(reading, profile, sent)
    timed = time_line.one(reading, profile)
    reading, moved = timed.reading, list(timed.findings)
    reading, refused = status.heeded(reading, profile)
    reading, screen = plausible.screened(reading, profile)
    moved += empty_course.findings_of(reading, profile, source_samples.raw_values)
    mounting = source_samples.mounting(reading, profile)
    sampled = {
        name: source_samples.of_sensor(reading, profile, name)
        for name, _ in profile.sensors.items()
    }
    base = sampled["heading"].time
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
    every = {**sampled, **driven}
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
    explained = left_out.times_of([*refused, *screen.left_out])
    grid = VoyageGrid(resampling.grid(start, end), explained=explained)
    grid.findings += left_out.findings_of(screen.left_out, start)
    origin, misplaced = _motion(grid, reading, profile, sampled)
    if profile.sensors.wind is not None:
        _wind(grid, profile.sensors.wind, sampled["wind"])
    for actuator in profile.actuators:
        _actuator(grid, actuator, driven[actuator.name])
    mark_gaps(grid)
    mark_holds(grid, profile, sampled)
    mark_jumps(grid, profile, sampled)
    if timed.contradicted:
        grid.marks |= int(Quality.BLANK)
        grid.findings = [f for f in grid.findings if f.kind not in ("gap", "blank")]
    grid.findings = status.unreported(grid.findings, reading.health.findings, profile)
    grid.findings.sort(key=lambda f: (f.start_s is None, f.start_s or 0.0))
    table = pl.DataFrame(
        {"time": grid.times}
        | {name: grid.columns[name] for name in profile.columns}
        | {"quality": grid.marks}
    ).with_columns(
        pl.col("time").cast(pl.Datetime("ns", "UTC")),
        pl.col(profile.columns).fill_nan(None),
    )
    found = [*shared, *moved, *mounting, *left_out.findings_of(refused, start)]
    return Aligned(table, grid, [*every.items()], found, origin, misplaced)


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


def _motion(
    grid: VoyageGrid, reading: Reading, profile: Profile, sampled: dict[str, resampling.Samples]
) -> tuple[datum.Place | None, Finding | None]:
    """Position, heading, velocity and yaw rate at midship. Returns the datum, if geodetic, and what
    is to be said of it."""
    sensors, kind = profile.sensors, profile.sensors.kind
    heading = grid.place("heading", sampled["heading"])[:, 0]
    if sensors.yaw_rate is not None:
        yaw_rate = grid.place("yaw_rate", sampled["yaw_rate"])[:, 0]
    else:
        turning = sample_faults.differentiated(sampled["heading"])
        yaw_rate = resampling.onto(grid.times, turning).value[:, 0]
    position = grid.place("position", sampled["position"])
    origin, said = None, None
    if kind("position") == "geodetic":
        origin, said = datum.of(reading, profile, sampled["position"])
        position = frames.local_plane(position[:, 0], position[:, 1], origin)
    position = frames.position_at_midship(position, heading, sensors.position.lever_arm_m)
    velocity = grid.place("velocity", sampled["velocity"])
    if kind("velocity") != "body":
        velocity = frames.to_body(velocity, heading)
    velocity = frames.velocity_at_midship(velocity, yaw_rate, sensors.velocity.lever_arm_m)
    grid.columns |= {
        "x0": position[:, 0], "y0": position[:, 1], "heading": frames.wrap(heading),
        "surge": velocity[:, 0], "sway": velocity[:, 1], "yaw_rate": yaw_rate,
    }  # fmt: skip
    return origin, said


def _wind(grid: VoyageGrid, sensor: Sensor, samples: resampling.Samples) -> None:
    """Apparent wind at midship: the anemometer's own motion about midship taken out."""
    components = grid.place("wind", samples)  # ahead and starboard part of "where from"
    ahead, starboard = sensor.lever_arm_m
    r = grid.columns["yaw_rate"]
    moved = components + np.stack((r * starboard, -r * ahead), axis=-1)
    grid.columns["wind_speed"] = np.linalg.norm(moved, axis=1)
    grid.columns["wind_angle"] = np.arctan2(moved[:, 1], moved[:, 0])


def _actuator(grid: VoyageGrid, actuator: Actuator, samples: resampling.Samples) -> None:
    """One actuator's column; beyond the profile's limits it is marked, not clipped."""
    placed = grid.place(actuator.name, samples)
    column = np.arctan2(placed[:, 1], placed[:, 0]) if actuator.circular else placed[:, 0]
    grid.columns[actuator.name] = column
    beyond = actuator_limits.beyond(actuator, column)
    grid.note(beyond, Quality.LIMITS, "limits", actuator.name, "stands beyond its limits")
