"""Positions and headings that a lost motion capture, or a receiver, wrote in place of none.

Where velocities are derived from the positions no second instrument shows that a position stood
still. Motion capture that loses its markers writes zeros in every field, or the last pose again.
A pose of noisy numbers never repeats to the last digit: what does is no measurement, if the ship
has moved once the next one comes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import polars as pl

from shiplog.logs.reading.read import Reading
from shiplog.ship_profile.profile import Profile, Sensor
from shiplog.voyages.clocks import clocks
from shiplog.voyages.rows import fault_detection, noise_estimate
from shiplog.voyages.rows.left_out import LeftOut

ZERO, AGAIN = "zero in every field", "the pose before it again, to the last digit"
CAUGHT_UP = 1.5  # times the step after the next sample: a pose that stood still has more to go
LEAST = 0.5  # of the record's usual step: less is no motion
COUNTED = 2.5  # steps in which an instrument counts: rounding alone leaves one or two
MOST_ZEROS = 0.5  # of the messages: a source that is mostly zero holds nothing else


def blanked(reading: Reading, profile: Profile) -> tuple[Reading, list[LeftOut]]:
    """The log with blanks in place of such poses, and which they were. Only where velocities are
    derived: with a measured velocity `held_values` compares the two."""
    if profile.sensors.velocity is not None:
        return reading, []
    frames = dict(reading.frames)
    sources = [profile.sensors.position, profile.sensors.heading]
    parts = {
        name: _Part.of(frames[one.topic], one)
        for name, one in zip(("position", "heading"), sources, strict=True)
        if one.topic in frames and frames[one.topic].height
    }
    left: list[LeftOut] = []
    for names in _together(parts):
        raw = np.concatenate([parts[name].raw for name in names], axis=1)
        zero = _zeros(raw) if len(names) > 1 else np.zeros(len(raw), bool)
        again = _again(raw, zero)
        for name in names:
            part, topic = parts[name], parts[name].topic
            left += [
                _left_out(name, what, part.times[lost], len(raw))
                for what, lost in ((ZERO, zero), (AGAIN, again)) if lost.any()
            ]  # fmt: skip
            sound = pl.lit(~(zero | again))
            nothing = [pl.when(sound).then(pl.col(path)).alias(path) for path in part.paths]
            frames[topic] = frames[topic].with_columns(nothing)
    return replace(reading, frames=frames), left


@dataclass(frozen=True)
class _Part:
    """One source's numbers [n, k] as they were sent, and their times [n] ns."""

    topic: str
    paths: tuple[str, ...]
    times: np.ndarray
    raw: np.ndarray

    @classmethod
    def of(cls, frame: pl.DataFrame, source: Sensor) -> _Part:
        times = frame[clocks.clock_columns(frame, source)[0]].fill_null(0).to_numpy()
        return cls(source.topic, source.paths, times, _numbers(frame, source.paths))


def _together(parts: Mapping[str, _Part]) -> list[tuple[str, ...]]:
    """Sources that were written at once, by their stamps: one instrument's, and told together."""
    times = [part.times for part in parts.values()]
    if len(times) == 2 and np.array_equal(times[0], times[1]):
        return [tuple(parts)]
    return [(name,) for name in parts]


def _numbers(frame: pl.DataFrame, paths: Sequence[str]) -> np.ndarray:
    columns = [frame[p].cast(pl.Float64, strict=False).fill_null(np.nan) for p in paths]
    return np.stack([column.to_numpy() for column in columns], axis=1)


def _zeros(raw: np.ndarray) -> np.ndarray:
    """Messages [n] bool all of whose numbers are zero; none of a source that mostly is."""
    zero = (raw == 0.0).all(axis=1)
    return zero if zero.mean() < MOST_ZEROS else np.zeros(len(raw), bool)


def _again(raw: np.ndarray, blank: np.ndarray) -> np.ndarray:
    """Messages [n] bool that repeat the one before although the ship went on, of raw [n, k]; those
    that are `blank` already do not count. A log at a higher rate than the instrument's repeats each
    value as often as the one before."""
    found = np.zeros(len(raw), bool)
    rows = np.flatnonzero(np.isfinite(raw).all(axis=1) & ~blank)
    if len(rows) < noise_estimate.FEWEST:
        return found
    value = raw[rows]
    own = noise_estimate.own_samples(value)
    rows, value = rows[own], value[own]
    unit = np.array([fault_detection.resolution(column[:, None]) for column in value.T])
    usual = np.median(np.abs(np.diff(value, axis=0)), axis=0)
    usual = np.where(usual > 0.0, usual, np.inf)
    same = np.concatenate(([False], (np.diff(value, axis=0) == 0.0).all(axis=1)))
    runs = list(fault_detection.stretches(same))
    if (unit > 0.0).any():  # what is counted in steps repeats by chance
        runs = fault_detection.improbable(runs, len(value))
    for first, last in runs:
        if last + 2 >= len(value) or first < 2:
            continue
        before = np.abs(value[first - 1] - value[first - 2])
        caught_up = np.abs(value[last + 1] - value[last])
        after = np.abs(value[last + 2] - value[last + 1])
        moved = caught_up > CAUGHT_UP * np.maximum(before, after)
        if (moved & (caught_up > COUNTED * unit) & (caught_up > LEAST * usual)).any():
            found[rows[first] : rows[last] + 1] = True
    return found & np.isfinite(raw).all(axis=1) & ~blank


def _left_out(name: str, what: str, times: np.ndarray, count: int) -> LeftOut:
    share = 100.0 * len(times) / count
    return LeftOut(
        "not_available", name, times,
        f"{name}: {len(times)} of {count} messages ({share:.2g} %) are {what}, as of a motion "
        "capture that has lost its markers, the first at {first}. They are blank.",
        float(len(times)), "",
    )  # fmt: skip
