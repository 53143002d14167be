"""Quantities of a zigzag A/B (IMO MSC/Circ.1053, 3.2; ITTC 7.5-04-02-01).

overshoot k        |ψ| at its k-th peak, minus |ψ| at which the rudder was ordered back for the
                   k-th time
time to check yaw  from the first order back to the first peak
period             between the first and the third peak: one whole swing
initial turning    along the track from the first order to |ψ - ψ₀| = 10°, with 10° of rudder
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from shiplog.manoeuvres.track import Track

INITIAL = math.radians(10.0)  # heading and rudder of the initial turning ability
INITIAL_RUDDER = math.radians(1.0)  # how far off 10 deg the rudder may be for it
ORDINALS = ("first", "second", "third")


def quantities(
    track: Track, orders: Sequence[float], side: float, angle: float
) -> dict[str, float]:
    """Of orders at these instants: the first one over to that side, then each one back [s].

    angle   of the rudder, rad

    What the record is too short for is left out.
    """
    first = track.heading_at(orders[0])
    found: dict[str, float] = {}
    if abs(abs(angle) - INITIAL) <= INITIAL_RUDDER:
        reached = track.reaches(first + side * INITIAL, side, orders[0])
        if reached is not None and (len(orders) < 2 or reached <= orders[1] + 1e-6):
            gone = track.travelled_at(reached) - track.travelled_at(orders[0])
            found["initial_turning"] = gone / track.length
    peaks = []
    for k, back in enumerate(orders[1:]):
        to = side if k % 2 == 0 else -side
        until = orders[k + 2] if k + 2 < len(orders) else float(track.time[-1])
        peak = track.peak(to, back, until)
        if peak is None:
            break
        peaks.append(peak[0])
        if k < len(ORDINALS):
            over = to * (peak[1] - track.heading_before(back))
            found[f"{ORDINALS[k]}_overshoot"] = math.degrees(over)
        if k == 0:
            found["check_time"] = peak[0] - back
    if len(peaks) >= 3:
        found["period"] = peaks[2] - peaks[0]
    return found
