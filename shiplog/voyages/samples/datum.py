"""Where x0 = y0 = 0 of a voyage lies, and whether what states it agrees with the positions."""

from __future__ import annotations

import logging

import numpy as np

from shiplog.exceptions import LogUnreadable
from shiplog.logs.health.health_report import Finding
from shiplog.logs.reading.read import Reading
from shiplog.ship_profile.profile import Profile
from shiplog.ship_profile.profile_lines import sign_line
from shiplog.voyages.rows import resampling

NEAR_DEG = 1.0  # from the median position: (0, 0) before the first fix is further away than that
# From a datum that log or profile state: a plane through it shortens the way by 1 - cos, 0.14 %,
# and what is compared with a velocity there has another scale.
FAR_DEG = 3.0
KM_PER_DEG = 111.2  # of a great circle

Place = tuple[float, float]  # latitude, longitude [deg]

log = logging.getLogger(__name__)


def choose(
    reading: Reading, profile: Profile, position: resampling.Samples
) -> tuple[Place, Finding | None]:
    """The log's own datum, else the profile's, else the first fix that lies near the others. One
    that lies far from all positions is not used: the finding says so."""
    stated, who = _stated(reading, profile)
    if stated is None:
        return _first(reading, profile, position), None
    if len(position.value) == 0:
        return stated, None
    middle = np.median(position.value, axis=0)
    away = _distance(middle, stated)
    if away < FAR_DEG:
        return stated, None
    first = _first(reading, profile, position)
    return first, _finding(profile, middle, stated, who, away)


def _stated(reading: Reading, profile: Profile) -> tuple[Place | None, str]:
    text = reading.contents.metadata.get("voyage", {}).get("datum", "")
    try:
        latitude, longitude = (float(part) for part in text.split(","))
        return (latitude, longitude), "the log"
    except ValueError:
        return profile.site.datum, "[site]"


def _distance(place: np.ndarray | Place, other: Place) -> float:
    """Degrees of a great circle, by its chord: √(Σ (e - e')²) = 2 sin(½ angle)."""
    chord = np.linalg.norm(_unit_vector(*place) - _unit_vector(*other))
    return float(np.degrees(2.0 * np.arcsin(min(0.5 * chord, 1.0))))


def _unit_vector(latitude: float, longitude: float) -> np.ndarray:
    phi, lam = np.radians(latitude), np.radians(longitude)
    return np.array([np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)])


def _finding(profile: Profile, middle: np.ndarray, stated: Place, who: str, away: float) -> Finding:
    """A sign or an order where that alone leads to the datum; else a question."""
    latitude, longitude = (float(one) for one in middle)
    shown = f"{stated[0]:.6g}, {stated[1]:.6g}"
    head = (
        f"The positions lie {KM_PER_DEG * away:.0f} km from the datum ({shown}) of {who}, at "
        f"{latitude:.6g}, {longitude:.6g}; x0 and y0 are counted from the first of them instead."
    )
    known = (
        ((-latitude, longitude), "sign", sign_line(profile, "position", 0)),
        ((latitude, -longitude), "sign", sign_line(profile, "position", 1)),
        ((-latitude, -longitude), "sign", sign_line(profile, "position")),
        ((longitude, latitude), "swapped", "the order of `fields` on [sensors.position]"),
    )
    for place, reason, line in known:
        if abs(place[0]) <= 90.0 and _distance(place, stated) < NEAR_DEG:
            return Finding(
                "contradiction", "position", f"{head} Change: {line}.", value=round(away, 3),
                unit="deg", reason=reason,
            )  # fmt: skip
    end = " Is that so? If not, look at the datum, or at [sensors.position]."
    return Finding("implausible", "position", head + end, value=round(away, 3), unit="deg")


def _first(reading: Reading, profile: Profile, position: resampling.Samples) -> Place:
    """The first fix that lies near the others."""
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
