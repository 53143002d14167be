"""Stretches in which the rudder is held, and the instants at which it was ordered elsewhere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shiplog.manoeuvres.track import Track

HELD = math.radians(1.5)  # about its mean: a feedback counts in steps of up to half a degree
LEAST_HOLD = 0.15  # L/V: shorter than a sharp zigzag's swing, longer than a rudder's way over
# Of the way from one hold to the next, the part that is a straight line. A steering gear goes at
# its full rate first and slows down towards the angle ordered: of 10 deg at 4 deg/s and with a lag
# of 2 s, a line through 0.2 to 0.8 of the way is carried back to 0.7 s before the order.
RAMP = (0.1, 0.5)
ROUGHLY = (0.3, 0.5)  # where a helmsman may have been on the way already
MOST_LOOKS = 5  # at where it stood: of a record that begins with the order two or three
LEAST_WAY = 0.1  # of the way, between the samples of a line
STOOD = 1.0  # s before the way begins, in which the rudder shows where it stood


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

    The line through the first half of its way, back to where it stood: a gear turns a rudder at
    a constant rate first. Where it stood is its median over the second before it moved: a helmsman
    who keeps a course is off his mean angle.
    """
    rows = np.arange(int(np.searchsorted(track.time, before)), hold.first + 1)
    if not len(rows) or hold.angle == base:
        return hold.begin
    at, stood = _began(track, rows, base, hold.angle, ROUGHLY), math.nan
    for _ in range(MOST_LOOKS):  # a base that was on the way itself comes back step by step
        still = (track.time[rows] >= at - STOOD) & (track.time[rows] <= at)
        new = float(np.median(track.rudder[rows[still]])) if still.any() else base
        if new in (stood, hold.angle):
            break
        at, stood = _began(track, rows, new, hold.angle, RAMP), new
    return at


def _began(
    track: Track, rows: np.ndarray, stood: float, to: float, ramp: tuple[float, float]
) -> float:
    """When the line through that share of the way [rad] was at its beginning. Where there are less
    than two samples of it, the last one before them."""
    share = (track.rudder[rows] - stood) / (to - stood)
    over = np.flatnonzero(share >= ramp[1])
    end = int(over[0]) if len(over) else len(rows)
    early = np.flatnonzero(share[:end] <= ramp[0])
    last = int(early[-1]) if len(early) else 0
    middle = rows[last + 1 : end]
    x = share[last + 1 : end]
    if len(middle) < 2 or np.ptp(x) < LEAST_WAY:
        return float(track.time[rows[last]])
    slope, at = np.polyfit(x, track.time[middle], 1)
    if slope < 0.0:
        return float(track.time[rows[last]])
    return float(np.clip(at, track.time[rows[0]], track.time[middle[0]]))
