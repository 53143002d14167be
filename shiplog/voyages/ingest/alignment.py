"""A log on its 10 Hz grid: every source between its samples, reduced to midship and marked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import polars as pl

from shiplog.logs.health.health_report import DerivedChannel, Finding, Instrument
from shiplog.nomenclature import channels, frames
from shiplog.nomenclature.channels import Quality
from shiplog.ship_profile.profile import Actuator, Sensor
from shiplog.voyages.ingest.voyage_grid import VoyageGrid, mark_gaps, mark_holds, mark_jumps
from shiplog.voyages.rows import left_out, resampling, sample_faults
from shiplog.voyages.samples import actuator_limits, derived_motion, status
from shiplog.voyages.samples.sampling import Sampled

RESOLVED = {  # of a sensor: the channel whose unit its resolution has
    "position": channels.X0, "velocity": channels.SURGE, "heading": channels.HEADING,
    "yaw_rate": channels.YAW_RATE, "wind": channels.WIND_SPEED,
}  # fmt: skip


@dataclass(frozen=True)
class Aligned:
    """A log on its 10 Hz grid, reduced to midship and marked."""

    table: pl.DataFrame  # as a Voyage has it
    seconds: float
    findings: list[Finding]  # of its rows
    instruments: tuple[Instrument, ...]
    left_out: list[Finding]
    datum: tuple[float, float] | None  # latitude, longitude [deg] of x0 = y0 = 0
    misplaced: Finding | None  # a datum that lies elsewhere
    derived: tuple[DerivedChannel, ...] = ()  # channels that no instrument measures


def aligned(sampled: Sampled) -> Aligned:
    """Every source between its samples, reduced to midship, and what does not fit marked."""
    profile = sampled.profile
    explained = left_out.times_of([*sampled.refused, *sampled.implausible])
    grid = VoyageGrid(resampling.grid(sampled.start, sampled.end), explained=explained)
    grid.findings += left_out.findings_of(sampled.implausible, sampled.start)
    derived = _motion(grid, sampled)
    if profile.sensors.wind is not None:
        _wind(grid, profile.sensors.wind, sampled.sensors["wind"])
    for actuator in profile.actuators:
        _actuator(grid, actuator, sampled.actuators[actuator.name])
    mark_gaps(grid)
    mark_holds(grid, profile, sampled.sensors)
    mark_jumps(grid, profile, sampled.sensors)
    if sampled.contradicted:
        grid.marks |= int(Quality.BLANK)
        grid.findings = [f for f in grid.findings if f.kind not in ("gap", "blank")]
    grid.findings = status.unreported(grid.findings, sampled.health, profile)
    grid.findings.sort(key=lambda f: (f.start_s is None, f.start_s or 0.0))
    table = pl.DataFrame(
        {"time": grid.times}
        | {name: grid.columns[name] for name in profile.columns}
        | {"quality": grid.marks}
    ).with_columns(
        pl.col("time").cast(pl.Datetime("ns", "UTC")),
        pl.col(profile.columns).fill_nan(None),
    )
    refused = left_out.findings_of(sampled.refused, sampled.start)
    found = [*sampled.shared, *sampled.moved, *refused]
    instruments = tuple(
        _instrument(name, one)
        for name, one in sampled.every.items()
        if len(one.time) > 1 and not one.hold
    )
    return Aligned(
        table, grid.seconds, grid.findings, instruments, found, sampled.datum, sampled.misplaced,
        derived,
    )  # fmt: skip


def _motion(grid: VoyageGrid, sampled: Sampled) -> tuple[DerivedChannel, ...]:
    """Position, heading, velocity and yaw rate at midship; what is said of the derived ones."""
    sensors, samples = sampled.profile.sensors, sampled.sensors
    heading = grid.place("heading", samples["heading"])[:, 0]
    yaw_rate = None
    if sensors.yaw_rate is not None:
        yaw_rate = grid.place("yaw_rate", samples["yaw_rate"])[:, 0]
    elif sensors.velocity is not None:
        turning = sample_faults.differentiated(samples["heading"])
        yaw_rate = resampling.interpolate_samples(grid.times, turning).value[:, 0]
    position = grid.place("position", samples["position"])
    if sampled.datum is not None:
        position = frames.local_plane(position[:, 0], position[:, 1], sampled.datum)
    position = frames.position_at_midship(position, heading, sensors.position.lever_arm_m)
    derived: tuple[DerivedChannel, ...] = ()
    if sensors.velocity is None:
        motion = derived_motion.derive(grid.times, samples, sampled.datum, sensors, yaw_rate)
        lost = grid.unknown["position"] | grid.unknown["heading"]
        velocity = np.where(lost[:, None], np.nan, motion.velocity)
        yaw_rate = np.where(lost, np.nan, motion.yaw_rate) if yaw_rate is None else yaw_rate
        derived = motion.channels
    else:
        assert yaw_rate is not None
        velocity = grid.place("velocity", samples["velocity"])
        if sensors.kind("velocity") != "body":
            velocity = frames.to_body(velocity, heading)
        velocity = frames.velocity_at_midship(velocity, yaw_rate, sensors.velocity_arm_m)
    grid.columns |= {
        "x0": position[:, 0], "y0": position[:, 1], "heading": frames.wrap(heading),
        "surge": velocity[:, 0], "sway": velocity[:, 1], "yaw_rate": yaw_rate,
    }  # fmt: skip
    return derived


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
    beyond = actuator_limits.exceeds(actuator, column)
    grid.note(beyond, Quality.LIMITS, "limits", actuator.name, "stands beyond its limits")


def _instrument(name: str, samples: resampling.Samples) -> Instrument:
    channel = RESOLVED.get(name)
    factor = channel.to_display if channel else 0.0
    unit = channel.display_unit if channel else ""
    finest, sigma = (float(f"{v * factor:.3g}") for v in (samples.resolution, samples.noise))
    rate, unsure = round(1.0 / samples.period_s, 3), round(samples.unsure_s, 3)
    return Instrument(name, rate, finest, unit, sigma, unsure)
