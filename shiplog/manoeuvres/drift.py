"""The current, from positions 360 degrees apart in a turn (IMO MSC/Circ.1053, 3.2.2).

    c = mean over ψ of (P(ψ + 2π) - P(ψ)) / (t(ψ + 2π) - t(ψ))

In a steady turn the ship comes back to where it was a circle ago, in the water. What moves it over
ground is the current, and what a steady wind adds to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shiplog.manoeuvres.track import Track

CIRCLE = 2.0 * math.pi
# Headings after which positions are compared: a turn is steady from 180 degrees on. Of one that
# is too short for that, from 90 on, where most of the speed is lost.
AFTER = (math.radians(180.0), math.radians(90.0))
LEAST = math.radians(30.0)  # of pairs: fewer are too alike
EVERY = math.radians(10.0)  # between two pairs
INDEPENDENT = math.radians(90.0)  # of a circle: pairs nearer than this err alike


@dataclass(frozen=True)
class Drift:
    """velocity    [2] along x₀ and y₀, m/s
    covariance  [2, 2] of it
    after       heading change from which positions were compared, rad
    """

    velocity: np.ndarray
    covariance: np.ndarray
    after: float

    @property
    def speed(self) -> float:
        return float(np.hypot(*self.velocity))

    @property
    def direction_deg(self) -> float:
        """Where it sets, clockwise from x₀."""
        return math.degrees(math.atan2(self.velocity[1], self.velocity[0])) % 360.0


def of_turn(track: Track, begin: float, side: float) -> Drift | None:
    """None where no two positions are a circle apart."""
    first = track.heading_at(begin)
    turned = side * (track.heading[-1] - first)
    for after in AFTER:
        if turned >= after + CIRCLE + LEAST:
            break
    else:
        return None
    late = track.time >= begin
    # the heading rises to its side all the time, but for its noise
    heading = np.maximum.accumulate(side * (track.heading[late] - first))
    angles = np.arange(after, turned - CIRCLE, EVERY)
    early, later = (np.interp(at, heading, track.time[late]) for at in (angles, angles + CIRCLE))
    gone = np.stack(
        [np.interp(later, track.time, x) - np.interp(early, track.time, x) for x in track.place.T],
        axis=-1,
    )
    pairs = gone / (later - early)[:, None]
    if len(pairs) < 2:
        return None
    independent = max(1.0, (len(pairs) - 1) * EVERY / INDEPENDENT)
    covariance = np.cov(pairs.T) / independent
    return Drift(pairs.mean(0), covariance, after)
