"""A row of what a simulator is asked: state, actuators, wind over ground, time.

    (x₀, u, y₀, v, ψ, r | actuators, in the profile's order | W_N, W_E | t)

SI: m, m/s, rad, rad/s, rev/s or 1. The wind is where it comes from along x₀ and y₀. A simulator
feels the apparent one, at midship:

    (a, s) = Rᵀ(ψ) W + (u, v),   U_A = √(a² + s²),   γ_A = atan2(s, a)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.nomenclature.frames import in_body_axes

STATES = 6
VELOCITIES = (1, 3, 5)
HEADING = 4
PLACE = (0, 2)


@dataclass(frozen=True)
class Trouble:
    """Something that went wrong in one row.

    row      of the request
    second   of the voyage
    words    what, as a sentence goes on after the simulator's name
    """

    row: int
    second: float
    words: str


def apparent(rows: np.ndarray) -> np.ndarray:
    """Apparent wind speed [m/s] and angle [rad], [n, 2], of rows [n, 6 + A + 3]."""
    heading = rows[:, HEADING]
    ahead, starboard = in_body_axes(rows[:, -3], rows[:, -2], np.cos(heading), np.sin(heading))
    ahead, starboard = ahead + rows[:, 1], starboard + rows[:, 3]
    return np.stack((np.hypot(ahead, starboard), np.arctan2(starboard, ahead)), -1)


def stacked(state: np.ndarray, driven: np.ndarray, time: np.ndarray | float) -> np.ndarray:
    """Rows [n, 6 + A + 3] of states [n, 6], what drives [n, A + 2], and times [n]."""
    times = np.broadcast_to(np.asarray(time, dtype=float), (len(state),))
    return np.concatenate((state, driven, times[:, None]), 1)


def rate(rows: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """ẋ [n, 6] of rows and ν̇ [n, 3], Eq. 2."""
    c, s = np.cos(rows[:, HEADING]), np.sin(rows[:, HEADING])
    u, v, r = (rows[:, i] for i in VELOCITIES)
    north, east = c * u - s * v, s * u + c * v
    du, dv, dr = acceleration.T
    return np.stack((north, du, east, dv, r, dr), -1)
