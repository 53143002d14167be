"""Stretches in which the rudder is held, and the instants at which it was ordered elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shiplog.manoeuvres.track import Track

HELD = math.radians(1.5)  # about its mean: a feedback counts in steps of up to half a degree
LEAST_HOLD = 0.15  # L/V: shorter than a sharp zigzag's swing, longer than a rudder's way over
RAMP = (0.2, 0.8)  # of the way from one hold to the next: the part that is a straight line


@dataclass(frozen=True)
class Hold:
    """Rows first … last of a track, and the mean angle of the rudder there [rad]."""

    first: int
    last: int
    angle: float
    begin: float
    end: float

    @property
    def seconds(self) -> float:
        return self.end - self.begin


def holds(track: Track, length_time: float) -> list[Hold]:
    """In order; what is between two of them is the way from one to the other."""
    found: list[Hold] = []
    values, first, mean, count = track.rudder.tolist(), 0, 0.0, 0

    def close(last: int) -> None:
        begin, end = float(track.time[first]), float(track.time[last])
        if end - begin < LEAST_HOLD * length_time:
            return
        angle = float(np.mean(track.rudder[first : last + 1]))
        if found and abs(found[-1].angle - angle) <= HELD and begin - found[-1].end < 1.0:
            before = found.pop()
            weights = before.seconds, end - begin
            angle = (before.angle * weights[0] + angle * weights[1]) / max(sum(weights), 1e-9)
            found.append(Hold(before.first, last, angle, before.begin, end))
            return
        found.append(Hold(first, last, angle, begin, end))

    for k, value in enumerate(values):
        if count and abs(value - mean) <= HELD:
            count += 1
            mean += (value - mean) / count
            continue
        if count:
            close(k - 1)
        first, mean, count = k, value, 1
    if count:
        close(len(values) - 1)
    return found


def ordered(track: Track, before: float, hold: Hold, base: float) -> float:
    """When the rudder was ordered from `base` [rad] to a hold, not before that time [s].

    The line through the middle of its way, back to where it came from: a rudder turns at a
    constant rate. Where its way has less than two samples, the last one before it.
    """
    way = hold.angle - base
    rows = np.arange(int(np.searchsorted(track.time, before)), hold.first + 1)
    if not len(rows) or way == 0.0:
        return hold.begin
    share = (track.rudder[rows] - base) / way
    early = np.flatnonzero(share <= RAMP[0])
    last = int(early[-1]) if len(early) else 0
    middle = rows[last:][(share[last:] > RAMP[0]) & (share[last:] < RAMP[1])]
    x = (track.rudder[middle] - base) / way
    if len(middle) < 2 or np.ptp(x) < 0.1:
        return float(track.time[rows[last]])
    slope, at = np.polyfit(x, track.time[middle], 1)
    if slope < 0.0:
        return float(track.time[rows[last]])
    return float(np.clip(at, track.time[rows[0]], track.time[middle[0]]))
