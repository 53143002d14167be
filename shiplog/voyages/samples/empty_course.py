"""A speed without a course: receivers leave it out where they cannot tell it, near rest.

The velocity is then known all the same. Taken as zero, it is off by the speed itself, which is no
more than a receiver's own noise.
"""

from __future__ import annotations

import numpy as np

from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.ship_profile.profile import Profile

AT_REST = 0.26  # m/s, half a knot: from there on receivers that leave out the course state it


def fill(speed_course: np.ndarray) -> np.ndarray:
    """Speed and course [n, 2] (m/s, rad), the velocity zero where only a small speed is known."""
    blank = _without_course(speed_course)
    if not blank.any():
        return speed_course
    return np.where(blank[:, None], 0.0, speed_course)


def findings(speed_course: np.ndarray, topic: str) -> list[Finding]:
    """How many velocities [n, 2] have no course, and how large they are."""
    blank = _without_course(speed_course)
    if not blank.any():
        return []
    most = float(np.max(speed_course[blank, 0]))
    sentence = (
        f"{blank.sum()} of {len(blank)} messages on {topic} have a speed of {most:.2g} m/s or less "
        f"and no course: taken as at rest, which is off by {most:.2g} m/s at most."
    )
    return [Finding("not_available", "velocity", sentence, value=most, unit="m/s")]


def findings_of(reading: Reading, profile: Profile, raw) -> list[Finding]:
    """The same of a log. `raw(reading, source)` gives times and SI values."""
    velocity = profile.sensors.velocity
    if velocity is None or profile.sensors.kind("velocity") != "sog_cog":
        return []
    _, value = raw(reading, velocity)
    return findings(value, velocity.topic)


def _without_course(speed_course: np.ndarray) -> np.ndarray:
    speed, course = speed_course.T
    return ~np.isfinite(course) & (speed >= 0.0) & (speed <= AT_REST)
