"""Quantities of a turning circle (IMO MSC/Circ.1053, 3.1; ITTC 7.5-04-02-01).

From the instant t₀ at which the rudder is ordered over, along the approach's heading ψ₀ and across:

    advance             along, at |ψ - ψ₀| = 90°
    transfer            across, at 90°
    tactical diameter   across, at 180°
    steady diameter     2 U/|r| of the steady turn
    drift angle         atan2(-v, u) there, positive where the bow points into the circle
    loss of speed       1 - U/U₀
"""

from __future__ import annotations

import math

import numpy as np

from shiplog.manoeuvres.track import Track

QUARTER, HALF = math.radians(90.0), math.radians(180.0)
STEADY_AFTER = math.radians(180.0)  # a turn is steady from here on, of hulls of all kinds (ITTC)
STEADY_SPAN = math.radians(90.0)  # the least of a steady turn that is averaged
STEADY_SPEED = 0.1  # share by which the speed may change in that; more is no steady turn yet


def quantities(track: Track, begin: float, side: float) -> dict[str, float]:
    """Of a track in still water, with the order at `begin` to that side. In L, deg and 1.

    ψ₀ is the heading, U₀ the speed at the order. What the turn is too short for is left out.
    """
    first, start = track.heading_at(begin), track.place_at(begin)
    speed = track.at(track.speed, begin)
    along = np.array([math.cos(first), math.sin(first)])
    across = side * np.array([-math.sin(first), math.cos(first)])
    found: dict[str, float] = {}
    quarter = track.reaches(first + side * QUARTER, side, begin)
    half = track.reaches(first + side * HALF, side, begin)
    if quarter is not None:
        gone = (track.place_at(quarter) - start) / track.length
        found["advance"] = float(gone @ along)
        found["transfer"] = float(gone @ across)
    if half is not None:
        gone = (track.place_at(half) - start) / track.length
        found["tactical_diameter"] = float(gone @ across)
    return found | steady(track, first, side, begin, speed)


def steady(track: Track, first: float, side: float, begin: float, speed: float) -> dict[str, float]:
    """Of the part beyond STEADY_AFTER, averaged over whole circles where there is one."""
    turned = side * (track.heading - first)
    late = (turned >= STEADY_AFTER) & (track.time > begin)
    if not late.any() or turned[late].max() - STEADY_AFTER < STEADY_SPAN:
        return {}
    circle = 2.0 * math.pi
    circles = (turned[late].max() - STEADY_AFTER) // circle
    if circles >= 1:  # the wind's and a current's effect averages out
        late &= turned >= turned[late].max() - circles * circle
    else:
        late &= turned >= turned[late].max() - STEADY_SPAN
    rows = np.flatnonzero(late)
    ends = track.speed[rows[[0, -1]]]
    if circles < 1 and abs(ends[1] - ends[0]) > STEADY_SPEED * ends.mean():
        return {}
    time = track.time[rows]
    spent = float(time[-1] - time[0])
    rate = abs(float(track.heading[rows[-1]] - track.heading[rows[0]])) / spent
    u, v = (float(np.trapezoid(track.state[rows, i], time)) / spent for i in (1, 3))
    mean = float(np.trapezoid(track.speed[rows], time)) / spent
    return {
        "steady_diameter": 2.0 * mean / rate / track.length,
        "drift_angle": math.degrees(math.atan2(-side * v, u)),
        "speed_loss": 1.0 - mean / speed if speed > 0.0 else math.nan,
    }
