"""Quantities of a stop (IMO MSC/Circ.1053, 3.3; ITTC 7.5-04-02-01), from the order to the instant
at which the ship is stopped in the water:

    track reach         along the track
    head reach          along the approach's course
    lateral deviation   across it
"""

from __future__ import annotations

import math

import numpy as np

from shiplog.manoeuvres.track import Track


def stopped(track: Track, begin: float) -> float | None:
    """The instant at which the surge has become zero; None where it has not."""
    rows = np.flatnonzero((track.state[:, 1] <= 0.0) & (track.time > begin))
    if not len(rows) or rows[0] == 0:
        return None
    k = int(rows[0])
    before, after = track.state[k - 1, 1], track.state[k, 1]
    share = before / (before - after) if before > after else 1.0
    return float(track.time[k - 1] + share * (track.time[k] - track.time[k - 1]))


def quantities(track: Track, begin: float) -> dict[str, float]:
    end = stopped(track, begin)
    if end is None:
        return {}
    course = track.velocity[track.row(begin)]
    angle = math.atan2(course[1], course[0])
    gone = (track.place_at(end) - track.place_at(begin)) / track.length
    return {
        "track_reach": (track.travelled_at(end) - track.travelled_at(begin)) / track.length,
        "head_reach": float(gone @ (math.cos(angle), math.sin(angle))),
        "lateral_deviation": abs(float(gone @ (-math.sin(angle), math.cos(angle)))),
    }
