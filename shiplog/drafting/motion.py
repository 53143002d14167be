"""Units and signs that a draft finds by comparing a ship's channels with each other.

The way from position to position has a speed and a course; a heading that turns has a rate. What
states no unit is in the one in which it agrees with them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shiplog.nomenclature import frames, units

SPAN_S = 3.0  # s: a way shorter than that is noise, a longer one no straight line
SPAN_PERIODS = 3.0  # of the position, whichever is longer
FAST = 0.3  # of the 90 % quantile of the ways: shorter ones say little of a course
FEWEST = 10  # ways that are compared
SAME_UNIT = 0.12  # of a ratio: m/s, kn and km/h are a factor of 1.9 apart
SAME_TURN = 0.35  # likewise of a rate, of which noise takes away: deg/s and rad/s are 57 apart
SAME_COURSE = 0.85  # mean cosine: an angle of 32 deg, drift and current included
APART = 4.0  # times as much is the other unit's mean cosine less than 1: twice the angle
LEAST_APART = 0.05  # and so much at least, 18 deg
TURNS = 0.6  # correlation of a rate and a turn: with less, the sign is not shown
SPEEDS = ("m/s", "kn", "km/h", "cm/s", "mm/s")
TURNING = ("deg/s", "rad/s", "deg/min")
ANGLES = {"deg": 1.0, "rad": 1.0, "cdeg": 0.01}  # and the factor that goes with it

AHEAD = np.array([1.0, 0.0, 0.0])  # the sensor's axis that points to the bow


def quaternion_heading(raw: np.ndarray, kind: str) -> np.ndarray:
    """Heading [n] of a sensor that is mounted level, rad: raw [n, 4] (x, y, z, w) or [n, 2]."""
    level = np.zeros((len(raw), 4 - raw.shape[1]))  # of z and w alone
    ahead = frames.turned(np.concatenate((level, raw), axis=1), AHEAD)
    return frames.quaternion_heading(ahead, kind == "quaternion_enu")


@dataclass(frozen=True)
class Motion:
    """What is known of a ship's motion: where it was, and where it pointed.

    time [n] s, place [n, 2] m to the north and to the east; of the heading time [m] s and angle
    [m] rad. Either may be empty.
    """

    time: np.ndarray
    place: np.ndarray
    heading_time: np.ndarray
    heading: np.ndarray

    @cached_property
    def _ways(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Begin and end [k] s of the longer ways, and how far they go to north and east [k, 2]."""
        known = np.isfinite(self.place).all(axis=1) & np.isfinite(self.time)
        time, place = self.time[known], self.place[known]
        rising = np.concatenate(([True], np.diff(time) > 0))[: len(time)]
        time, place = time[rising], place[rising]
        nothing = np.zeros(0), np.zeros(0), np.zeros((0, 2))
        if len(time) < FEWEST:
            return nothing
        period = float(np.median(np.diff(time)))
        every = max(math.ceil(SPAN_S / period), round(SPAN_PERIODS), 1) if period > 0 else 1
        begin, end = time[:-every:every], time[every::every]
        way = place[every::every] - place[:-every:every]
        sound = (end > begin) & (end - begin < 2.0 * every * period)
        begin, end, way = begin[sound], end[sound], way[sound]
        far = np.linalg.norm(way, axis=1)
        if len(far) < FEWEST or not far.any():
            return nothing
        long = far > FAST * float(np.quantile(far, 0.9))
        return begin[long], end[long], way[long]

    def speed(self, time: np.ndarray, speed: np.ndarray) -> str | None:
        """The unit in which a speed [n] is that of the position's change; None where none is."""
        begin, end, way = self._ways
        mean = _mean(time, speed, begin, end)
        known = np.isfinite(mean) & (mean > 0)
        if known.sum() < FEWEST:
            return None
        ratio = np.linalg.norm(way[known], axis=1) / (end - begin)[known] / mean[known]
        ratio = float(np.median(ratio))
        unit = min(SPEEDS, key=lambda u: abs(math.log(ratio / units.factor(u))))
        return unit if abs(math.log(ratio / units.factor(unit))) < SAME_UNIT else None

    def angle(self, time: np.ndarray, angle: np.ndarray) -> tuple[str, float] | None:
        """(unit, factor) in which a course or heading [n] points along the way; None where none
        does, or two do."""
        begin, end, way = self._ways
        course = np.arctan2(way[:, 1], way[:, 0])
        alike = {}
        for name, factor in ANGLES.items():
            unit = "deg" if name == "cdeg" else name
            along = angle * factor * units.factor(unit)
            east, north = (_mean(time, g(along), begin, end) for g in (np.sin, np.cos))
            known = np.isfinite(east)
            if known.sum() < FEWEST:
                return None
            size = np.maximum(np.hypot(east, north), 1e-9)[known]
            inner = (north * np.cos(course) + east * np.sin(course))[known] / size
            alike[unit, factor] = float(np.mean(inner))
        best, second = sorted(alike, key=lambda one: -alike[one])[:2]
        off, other = 1.0 - alike[best], 1.0 - alike[second]
        return best if off < 1.0 - SAME_COURSE and max(APART * off, LEAST_APART) < other else None

    def turning(self, time: np.ndarray, rate: np.ndarray) -> tuple[str, float] | None:
        """(unit, sign) in which a rate [n] is that of the heading's change; None where they have
        little to do with each other."""
        known = np.isfinite(self.heading) & np.isfinite(self.heading_time)
        at, heading = self.heading_time[known], self.heading[known]
        rising = np.concatenate(([True], np.diff(at) > 0))[: len(at)]
        at, heading = at[rising], np.unwrap(heading[rising])
        if len(at) < FEWEST:
            return None
        period = float(np.median(np.diff(at)))
        every = max(math.ceil(1.0 / period), 1)
        begin, end = at[:-every:every], at[every::every]
        turned = (heading[every::every] - heading[:-every:every]) / (end - begin)
        mean = _mean(time, rate, begin, end)
        sound = np.isfinite(mean) & (end - begin < 2.0 * every * period)
        turned, mean = turned[sound], mean[sound]
        if len(mean) < FEWEST or not mean.any() or not turned.any():
            return None
        together = float(turned @ mean)
        alike = together / float(np.linalg.norm(turned) * np.linalg.norm(mean))
        if abs(alike) < TURNS:
            return None
        ratio = abs(together) / float(mean @ mean)
        unit = min(TURNING, key=lambda u: abs(math.log(ratio / units.factor(u))))
        if abs(math.log(ratio / units.factor(unit))) > SAME_TURN:
            return None
        return unit, math.copysign(1.0, together)


def _mean(time: np.ndarray, value: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Mean of a channel [n] in each span [k], by the trapezoidal rule; NaN where it has none."""
    known = np.isfinite(value) & np.isfinite(time)
    time, value = time[known], value[known]
    rising = np.concatenate(([True], np.diff(time) > 0))[: len(time)]
    time, value = time[rising], value[rising]
    if len(time) < 2 or len(begin) == 0:
        return np.full(len(begin), np.nan)
    total = np.concatenate(([0.0], np.cumsum(0.5 * (value[1:] + value[:-1]) * np.diff(time))))
    found = (np.interp(end, time, total) - np.interp(begin, time, total)) / (end - begin)
    return np.where((begin >= time[0]) & (end <= time[-1]), found, np.nan)
