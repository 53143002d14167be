"""One log to one 10 Hz table at midship, with a mark on every row and a finding for every fault.

Value columns are SI, angles in (-π, π]; a value that was not measured is null. The marks are
`channels.Quality`; what they mean for the 1 Hz averages stands in `one_hertz`.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import polars as pl

from shiplog import channels, frames
from shiplog.channels import Quality
from shiplog.exceptions import LogUnreadable
from shiplog.logs.health_report import Finding, Instrument, VoyageReport
from shiplog.logs.read import Contents, Reading, read
from shiplog.logs.senders import Senders
from shiplog.profile import Actuator, Profile, Sensor, Source
from shiplog.voyages import (
    beside,
    clock_contradictions,
    clocks,
    empty_course,
    orientation,
    plausible_measures,
    required_topics,
    resampling,
    sample_faults,
    sampling_findings,
    status,
    time_line,
    two_sources,
)
from shiplog.voyages import one_hertz as tables
from shiplog.voyages import plausible_values as plausible
from shiplog.voyages.comparison import Comparison, compare
from shiplog.voyages.sensor_findings import Estimate
from shiplog.voyages.voyage_grid import VoyageGrid, mark_gaps, mark_holds, mark_jumps

RESOLVED = {  # of a sensor: the channel whose unit its resolution has
    "position": channels.X0, "velocity": channels.SURGE, "heading": channels.HEADING,
    "yaw_rate": channels.YAW_RATE, "wind": channels.WIND_SPEED,
}  # fmt: skip

# Memory goes with the rows of the grid: stamps so scattered that a sample stands for a thousand
# rows (100 s) are no voyage. A million rows, 28 hours, take 100 MB, whatever they hold.
LEAST_ROWS, MOST_ROWS = 1_000_000, 1_000
FARTHEST_DEG = (90.0, 360.0)  # latitude and longitude, whichever way the latter is counted
NO_FIX_DEG = (91.0, 181.0)  # what AIS sends of a position that it does not know
LARGEST = 1e12  # as the profile has it: what is beyond, as the largest float of all, is no value
NEAR_DEG = 1.0  # from the median position: (0, 0) before the first fix is further away than that

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Voyage:
    """A log as the store takes it."""

    name: str
    profile: Profile
    contents: Contents
    table: pl.DataFrame  # time, the profile's columns, quality
    report: VoyageReport
    datum: tuple[float, float] | None  # latitude, longitude [deg] of x0 = y0 = 0
    estimates: tuple[Estimate, ...]  # what the sensors say of each other
    corrected: tuple[Estimate, ...] | None = None  # of them, what was put right; None: not asked


def ingest(path, profile: Profile) -> Voyage:
    """Read one log through a profile. Raises LogUnreadable, ChannelMissing, ProfileError."""
    sent = two_sources.several(path, profile)
    return build(read(path, beside.wanted(profile, sent)), profile, sent)


def build(reading: Reading, profile: Profile, sent: Mapping[str, Senders] | None = None) -> Voyage:
    """Align, reduce to midship, mark. Raises ChannelMissing for a topic or field not there.

    sent  by topic, those who send on it, where there are several
    """
    aligned = _aligned(reading, profile, sent or {})
    table, grid = aligned.table, aligned.grid
    compared = _compared(aligned, profile)
    usable_s, windows = usable(table, profile)
    report = VoyageReport(
        name=reading.contents.path.stem,
        messages_read=reading.health.messages_read,
        messages_lost=reading.health.messages_lost,
        rows=table.height,
        seconds=round(grid.seconds, 3),
        findings=(
            *clock_contradictions.untold(reading.health.findings, aligned.left_out),
            *aligned.left_out,
            *grid.findings,
            *compared.findings,
        ),
        usable_s=usable_s,
        windows=windows,
        instruments=tuple(
            _instrument(*one) for one in aligned.samples if len(one[1].time) > 1 and not one[1].hold
        ),
        not_compared=compared.not_compared,
    )
    return Voyage(
        report.name, profile, reading.contents, table, report, aligned.datum, compared.estimates
    )


def usable(table: pl.DataFrame, profile: Profile) -> tuple[int, int]:
    """Seconds and windows of a voyage's 10 Hz rows, as `one_hertz.usable` counts them; no more
    seconds than lie between the first row and the last, although the first average and the last
    one are of half a second each."""
    named = table.lazy().with_columns(voyage=pl.lit(""))
    seconds, windows = tables.usable(tables.resample([named], profile.columns, profile.circular))
    return min(seconds, (table.height - 1) * resampling.STEP_NS // 1_000_000_000), windows


def consistency_of(reading: Reading, profile: Profile, sent: Mapping[str, Senders]) -> Comparison:
    """What the sensors of a log say of themselves and of each other. Raises as `build` does."""
    aligned = _aligned(reading, profile, sent)
    compared = _compared(aligned, profile)
    own = [f for f in aligned.left_out if f.kind in ("status", "two_sources", "contradiction")]
    return replace(compared, findings=(*own, *compared.findings))


def _compared(aligned: _Aligned, profile: Profile) -> Comparison:
    """Sensors against each other, and then against what ships and winds can do."""
    compared = compare(aligned.table, profile)
    implausible = plausible_measures.of_log(aligned.table, profile, compared.findings)
    return replace(compared, findings=(*compared.findings, *implausible))


@dataclass(frozen=True)
class _Aligned:
    """A log on its 10 Hz grid, reduced to midship and marked."""

    table: pl.DataFrame  # as a Voyage has it
    grid: VoyageGrid
    samples: list[tuple[str, resampling.Samples]]  # of each sensor and actuator
    left_out: list[Finding]
    datum: tuple[float, float] | None


def _aligned(reading: Reading, profile: Profile, sent: Mapping[str, Senders]) -> _Aligned:
    required_topics.require(reading, profile)
    reading, profile, shared = two_sources.told_apart(reading, profile, sent)
    timed = time_line.one(reading, profile)
    reading, moved = timed.reading, list(timed.findings)
    reading, refused = status.heeded(reading, profile)
    reading, screen = plausible.screened(reading, profile)
    moved += empty_course.findings_of(reading, profile, _raw)
    mounting = _mounting(reading, profile)
    sampled = {name: _samples(reading, profile, name) for name, _ in profile.sensors.items()}
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
            _actuator_samples(reading, actuator, longest), actuator, base
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
    grid = VoyageGrid(resampling.grid(start, end), explained=screen.explained)
    grid.findings += screen.findings(start)
    datum = _motion(grid, reading, profile, sampled)
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
    grid.findings = status.untold(grid, reading.health.findings, profile)
    grid.findings.sort(key=lambda f: (f.start_s is None, f.start_s or 0.0))
    table = pl.DataFrame(
        {"time": grid.times}
        | {name: grid.columns[name] for name in profile.columns}
        | {"quality": grid.marks}
    ).with_columns(
        pl.col("time").cast(pl.Datetime("ns", "UTC")),
        pl.col(profile.columns).fill_nan(None),
    )
    found = [*shared, *moved, *mounting, *status.said(grid, refused)]
    return _Aligned(table, grid, [*every.items()], found, datum)


def _instrument(name: str, samples: resampling.Samples) -> Instrument:
    channel = RESOLVED.get(name)
    factor = channel.to_display if channel else 0.0
    unit = channel.display_unit if channel else ""
    finest, sigma = (float(f"{v * factor:.3g}") for v in (samples.resolution, samples.noise))
    rate, unsure = round(1.0 / samples.period_s, 3), round(samples.unsure_s, 3)
    return Instrument(name, rate, finest, unit, sigma, unsure)


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


def _raw(reading: Reading, source: Source) -> tuple[np.ndarray, np.ndarray]:
    """Time [n] ns by the source's clock and SI values [n, k], NaN where there is none."""
    frame = reading.frames.get(source.topic)
    if frame is None or frame.height == 0:
        return np.zeros(0, np.int64), np.zeros((0, len(source.paths)))
    frame = two_sources.of_one(frame, source)
    times = frame[clocks.of(frame, source)[0]]
    values = [
        (_numbers(frame[path]) - offset) * factor
        for path, (offset, factor) in zip(source.paths, source.scale(), strict=True)
    ]
    known = times.is_not_null().to_numpy()
    return times.fill_null(0).to_numpy()[known], np.stack(values, axis=1)[known]


def _numbers(column: pl.Series) -> np.ndarray:
    """A field's values [n], NaN where there is none."""
    raw = column.cast(pl.Float64, strict=False).fill_null(np.nan).to_numpy()
    return np.where(np.abs(raw) <= LARGEST, raw, np.nan)


def _samples(reading: Reading, profile: Profile, name: str) -> resampling.Samples:
    """A sensor's samples in a form that can be interpolated, spikes marked.

    Position stays geodetic [deg] where it is so; angles are unwrapped; speed and direction become
    components, since halfway between 359° and 1° is 0°.
    """
    sensor, kind = getattr(profile.sensors, name), profile.sensors.kind(name)
    sensor = orientation.whole(reading, sensor) if kind in orientation.KINDS else sensor
    times, raw = _raw(reading, sensor)
    value = raw
    if kind == "geodetic":
        value = value / channels.DEGREE  # `unit` made it radians; geodesy speaks degrees
        value = _on_earth(reading, sensor, value)
    elif kind in ("sog_cog", "from_bow"):
        value = empty_course.known(value) if kind == "sog_cog" else value
        value = frames.earth_velocity(value[:, 0], value[:, 1])
    elif kind == "enu":
        value = value[:, ::-1]
    elif kind in orientation.KINDS:
        value = orientation.of(value, sensor, kind).heading[:, None]
    samples = resampling.ordered(
        times, value, sensor.tolerance_s, sensor.between == "hold",
        resampling.longest_s(profile.ship.length_m),
    )  # fmt: skip
    if name == "heading":
        samples = replace(samples, value=np.unwrap(samples.value, axis=0))
    elif kind == "geodetic":  # 179.99 and -179.99 deg are neighbours, not a way round the earth
        latitude, longitude = samples.value.T
        longitude = np.unwrap(longitude, period=360.0)
        samples = replace(samples, value=np.stack((latitude, longitude), axis=1))
    return sample_faults.judged(samples, _metric(samples.value, kind), raw, profile.sensors, name)


def _mounting(reading: Reading, profile: Profile) -> list[Finding]:
    """What is to be said of how a heading's quaternion is mounted."""
    sensor, kind = profile.sensors.heading, profile.sensors.kind("heading")
    if kind not in orientation.KINDS:
        return []
    sensor = orientation.whole(reading, sensor)
    found = orientation.of(_raw(reading, sensor)[1], sensor, kind)
    return orientation.findings(found, sensor, reading.contents.path.name)


def _on_earth(reading: Reading, sensor: Sensor, value: np.ndarray) -> np.ndarray:
    """Latitudes and longitudes [n, 2], deg; blank where they are of no place, as a receiver's are
    that has no fix. Raises LogUnreadable where most are: they are then something else."""
    known = np.isfinite(value).all(axis=1) & ~np.isclose(value, NO_FIX_DEG).all(axis=1)
    nowhere = known & (np.abs(value) > FARTHEST_DEG).any(axis=1)
    if 2 * nowhere.sum() > known.sum():
        latitude, longitude = value[np.flatnonzero(nowhere)[0]]
        raise LogUnreadable(
            f"{reading.contents.path.name} holds {nowhere.sum()} positions of {known.sum()} on "
            f"{sensor.topic} that are nowhere on Earth, such as latitude {latitude:.10g} and "
            f"longitude {longitude:.10g} deg.",
            hint="look at [sensors.position]: whether `fields` are latitude and longitude in this "
            'order, and at their unit: whole numbers of 1e-7 deg need unit = "deg" and sign = '
            "1e-7; degrees and minutes in one number, such as 4807.038, have to be converted.",
        )
    value = value.copy()
    value[nowhere | ~known] = np.nan
    return value


def _metric(value: np.ndarray, kind: str) -> np.ndarray:
    """Geodetic degrees in metres, roughly: enough to tell a spike from noise."""
    if kind != "geodetic" or len(value) == 0:
        return value
    metre = 111_320.0
    east = metre * math.cos(math.radians(float(value[0, 0])))
    return (value - value[0]) * np.array([metre, east])


def _motion(
    grid: VoyageGrid, reading: Reading, profile: Profile, sampled: dict[str, resampling.Samples]
) -> tuple[float, float] | None:
    """Position, heading, velocity and yaw rate at midship. Returns the datum, if geodetic."""
    sensors, kind = profile.sensors, profile.sensors.kind
    heading = grid.place("heading", sampled["heading"])[:, 0]
    if sensors.yaw_rate is not None:
        yaw_rate = grid.place("yaw_rate", sampled["yaw_rate"])[:, 0]
    else:
        turning = sample_faults.differentiated(sampled["heading"])
        yaw_rate = resampling.onto(grid.times, turning).value[:, 0]
    position = grid.place("position", sampled["position"])
    datum = None
    if kind("position") == "geodetic":
        datum = _datum(reading, profile, sampled["position"])
        position = frames.local_plane(position[:, 0], position[:, 1], datum)
    position = frames.position_at_midship(position, heading, sensors.position.lever_arm_m)
    velocity = grid.place("velocity", sampled["velocity"])
    if kind("velocity") != "body":
        velocity = frames.to_body(velocity, heading)
    velocity = frames.velocity_at_midship(velocity, yaw_rate, sensors.velocity.lever_arm_m)
    grid.columns |= {
        "x0": position[:, 0], "y0": position[:, 1], "heading": frames.wrap(heading),
        "surge": velocity[:, 0], "sway": velocity[:, 1], "yaw_rate": yaw_rate,
    }  # fmt: skip
    return datum


def _datum(reading: Reading, profile: Profile, position: resampling.Samples) -> tuple[float, float]:
    """The log's own datum, else the profile's, else the first fix that lies near the others."""
    text = reading.contents.metadata.get("voyage", {}).get("datum", "")
    try:
        latitude, longitude = (float(part) for part in text.split(","))
        return latitude, longitude
    except ValueError:
        pass
    if profile.site.datum is not None:
        return profile.site.datum
    if len(position.value) == 0:
        raise LogUnreadable(
            f"{reading.contents.path.name} holds no usable position on "
            f"{profile.sensors.position.topic}.",
            hint="check topic and fields of the position in the profile; `shiplog profile LOG` "
            "drafts one from the topics of the log.",
        )
    away = np.abs(position.value - np.median(position.value, axis=0)).max(axis=1)
    first = int(np.argmax(away < NEAR_DEG))  # 0 where none is near
    if first:
        log.warning(
            "%s: the datum is position %d, not the first, which lies %.0f degrees from the median "
            "of all, as of a receiver before its first fix",
            reading.contents.path.name, first + 1, away[0],
        )  # fmt: skip
    latitude, longitude = map(float, position.value[first])
    return latitude, longitude - 360.0 * round(longitude / 360.0)


def _wind(grid: VoyageGrid, sensor: Sensor, samples: resampling.Samples) -> None:
    """Apparent wind at midship: the anemometer's own motion about midship taken out."""
    components = grid.place("wind", samples)  # ahead and starboard part of "where from"
    ahead, starboard = sensor.lever_arm_m
    r = grid.columns["yaw_rate"]
    moved = components + np.stack((r * starboard, -r * ahead), axis=-1)
    grid.columns["wind_speed"] = np.linalg.norm(moved, axis=1)
    grid.columns["wind_angle"] = np.arctan2(moved[:, 1], moved[:, 0])


def _actuator_samples(reading: Reading, actuator: Actuator, longest: float) -> resampling.Samples:
    """An actuator's samples; an azimuth as (cos, sin), so that it can be interpolated."""
    times, value = _raw(reading, actuator)
    if actuator.circular:
        value = np.concatenate((np.cos(value), np.sin(value)), axis=1)
    hold = actuator.between == "hold"
    return resampling.ordered(times, value, actuator.tolerance_s, hold, longest)


def _actuator(grid: VoyageGrid, actuator: Actuator, samples: resampling.Samples) -> None:
    """One actuator's column; beyond the profile's limits it is marked, not clipped."""
    placed = grid.place(actuator.name, samples)
    column = np.arctan2(placed[:, 1], placed[:, 0]) if actuator.circular else placed[:, 0]
    grid.columns[actuator.name] = column
    if actuator.limits is None:
        return
    offset, factor = actuator.scale()[0]
    low, high = sorted((limit - offset) * factor for limit in actuator.limits)
    slack = 1e-3 * (high - low)
    if actuator.circular:  # limits of 0 to 360 deg are all there is, wherever the angle is cut
        beyond = np.mod(column - low + slack, 2.0 * np.pi) > high - low + 2.0 * slack
    else:
        beyond = (column < low - slack) | (column > high + slack)
    grid.note(beyond, Quality.LIMITS, "limits", actuator.name, "stands beyond its limits")
