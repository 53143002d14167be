"""The course over ground and how it swings about the keel: what a frozen heading is held against.

A ship's drift angle changes within bounds, which the record itself shows where the heading moves:
a course that swings by more while the heading repeats one value says that it should have moved.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows import moving
from shiplog.voyages.rows.resampling import STEP_NS, Samples

STEP_S = STEP_NS * 1e-9
COURSE_S = 10.0  # s: a course is taken of the way in so many seconds, or of a velocity in fewer
COURSE_NOISE = math.radians(1.5)  # of a velocity's direction
KNOWN_S = 60.0  # s: a heading that moves for less does not show how a course swings about it
SWINGS = 1.5  # times what it swings elsewhere: more, and the heading should have moved
COURSE_NOISES = 20.0  # of the position: on a shorter way the course says little, 4 deg and more
COURSE_LENGTHS = 0.05  # of the ship: likewise, of a ship that is kept in its place
UNDER_WAY = 0.3  # of the 90 % quantile of the way: at a berth the wind and a current turn a course
ALONG = 0.7  # sine of the angle between course and keel, in the middle: a ship that makes way
SWING = math.radians(30.0)  # of the course beyond which a heading turns, too: drift of a hard turn


@dataclass(frozen=True)
class Course:
    """angle [m] rad, unwrapped, each taken of so many seconds; swing: how far it swings about the
    keel, rad."""

    angle: np.ndarray
    seconds: float
    swing: float


@dataclass(frozen=True)
class _Way:
    """Vectors [m, 2] along which a ship goes, each over so many seconds, and how short a one says
    little."""

    vectors: np.ndarray
    seconds: float
    least: float


def _of_velocity(samples: Samples, velocity: np.ndarray, profile: Profile) -> _Way | None:
    """Of a velocity over ground [m, 2] as it is measured, over as short a time as its noise allows:
    COURSE_NOISE rad. None of one in body axes, which the heading has turned."""
    if profile.sensors.kind("velocity") == "body":
        return None
    fast = float(np.quantile(np.linalg.norm(velocity, axis=1), 0.9))
    if fast <= 0.0:
        return None
    seconds = samples.period_s * math.ceil((samples.noise / (COURSE_NOISE * fast)) ** 2)
    rows = 2 * round(0.5 * seconds / STEP_S) + 1
    if seconds > COURSE_S or len(velocity) < rows:
        return None
    return _Way(moving.mean(velocity, rows), seconds, 0.0)


def _of_position(samples: Samples, position: np.ndarray, profile: Profile) -> _Way | None:
    """Of the positions [m, 2], over COURSE_S."""
    half = max(round(0.5 * COURSE_S / STEP_S), 1)
    if len(position) <= 2 * half:
        return None
    way = np.zeros_like(position)
    way[half:-half] = position[2 * half :] - position[: -2 * half]
    least = max(COURSE_NOISES * samples.noise, COURSE_LENGTHS * profile.ship.length_m)
    return _Way(way, COURSE_S, least)


def course(
    sampled: dict[str, Samples],
    velocity: np.ndarray,
    position: np.ndarray,
    heading: np.ndarray,
    profile: Profile,
) -> Course | None:
    """Of a velocity over ground [m, 2] in m/s, else of the positions [m, 2] in m; heading [m] rad,
    NaN where it is not to be compared. None of a ship that does not mostly go along its keel, ahead
    or astern."""
    measured = sampled.get("velocity")  # none where it is derived from the position
    way = None if measured is None else _of_velocity(measured, velocity, profile)
    way = way or _of_position(sampled["position"], position, profile)
    angle = None if way is None else _unwrapped(way, heading)
    if way is None or angle is None:
        return None
    return Course(angle, way.seconds, min(SWING, _swing(angle, heading)))


def _unwrapped(way: _Way, heading: np.ndarray) -> np.ndarray | None:
    """Course [m], rad, as it was last where the ship hardly moves."""
    far = np.linalg.norm(way.vectors, axis=1)
    known = far > max(way.least, UNDER_WAY * float(np.quantile(far, 0.9)))
    course = np.arctan2(way.vectors[:, 1], way.vectors[:, 0])
    across = np.abs(np.sin(course - heading))[known & np.isfinite(heading)]
    at = np.flatnonzero(known)
    if len(at) < 2 or (len(across) and float(np.median(across)) > ALONG):
        return None
    last = np.searchsorted(at, np.arange(len(far)), side="right") - 1
    return np.unwrap(course[at])[last.clip(0)]


def _swing(course: np.ndarray, keel: np.ndarray) -> float:
    """How far the course swings about the keel [m] where the heading is known to move, rad: nearly
    all of the angle between them; all round where that is seldom."""
    known = np.isfinite(keel)
    if known.sum() * STEP_S < KNOWN_S:
        return math.pi
    off = np.exp(1j * (course[known] - keel[known]))
    off = np.angle(off * np.mean(off).conj())
    low, high = np.quantile(off, (0.005, 0.995))
    return SWINGS * float(high - low)
