"""A source's values as they stand in a log, and in a form that can be interpolated."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import polars as pl

from shiplog.exceptions import LogUnreadable
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.nomenclature import channels, frames
from shiplog.ship_profile.profile import Actuator, Profile, Sensor, Source
from shiplog.voyages.clocks import clocks
from shiplog.voyages.rows import resampling, sample_faults
from shiplog.voyages.samples import empty_course, orientation, two_sources

FARTHEST_DEG = (90.0, 360.0)  # latitude and longitude, whichever way the latter is counted
NO_FIX_DEG = (91.0, 181.0)  # what AIS sends of a position that it does not know
LARGEST = 1e12  # as the profile has it: what is beyond, as the largest float of all, is no value


def raw_values(reading: Reading, source: Source) -> tuple[np.ndarray, np.ndarray]:
    """Time [n] ns by the source's clock and SI values [n, k], NaN where there is none."""
    frame = reading.frames.get(source.topic)
    if frame is None or frame.height == 0:
        return np.zeros(0, np.int64), np.zeros((0, len(source.paths)))
    frame = two_sources.of_one(frame, source)
    times = frame[clocks.clock_columns(frame, source)[0]]
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


def of_sensor(reading: Reading, profile: Profile, name: str) -> resampling.Samples:
    """A sensor's samples in a form that can be interpolated, spikes marked.

    Position stays geodetic [deg] where it is so; angles are unwrapped; speed and direction become
    components, since halfway between 359° and 1° is 0°.
    """
    sensor, kind = getattr(profile.sensors, name), profile.sensors.kind(name)
    sensor = orientation.whole(reading, sensor) if kind in orientation.KINDS else sensor
    times, raw = raw_values(reading, sensor)
    value = raw
    if kind == "geodetic":
        value = value / channels.DEGREE  # `unit` made it radians; geodesy speaks degrees
        value = _on_earth(reading, sensor, value)
    elif kind in ("sog_cog", "from_bow"):
        value = empty_course.fill(value) if kind == "sog_cog" else value
        value = frames.earth_velocity(value[:, 0], value[:, 1])
    elif kind == "enu":
        value = value[:, ::-1]
    elif kind in orientation.KINDS:
        value = orientation.read_orientation(value, sensor, kind).heading[:, None]
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
    return sample_faults.judge(samples, _metric(samples.value, kind), raw, profile.sensors, name)


def of_actuator(reading: Reading, actuator: Actuator, longest: float) -> resampling.Samples:
    """An actuator's samples; an azimuth as (cos, sin), so that it can be interpolated."""
    times, value = raw_values(reading, actuator)
    if actuator.circular:
        value = np.concatenate((np.cos(value), np.sin(value)), axis=1)
    hold = actuator.between == "hold"
    return resampling.ordered(times, value, actuator.tolerance_s, hold, longest)


def mounting(reading: Reading, profile: Profile) -> list[Finding]:
    """What is to be said of how a heading's quaternion is mounted."""
    sensor, kind = profile.sensors.heading, profile.sensors.kind("heading")
    if kind not in orientation.KINDS:
        return []
    sensor = orientation.whole(reading, sensor)
    found = orientation.read_orientation(raw_values(reading, sensor)[1], sensor, kind)
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
