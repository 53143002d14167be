"""Course stability: what a pull-out leaves, and the loop of a spiral (IMO MSC/Circ.1053, 3.4 to
3.6; Dieudonné 1953).

    residual yaw rate   half the difference of the yaw rates that remain amidships after a turn to
                        starboard and one to port; after one turn alone, what remains of its own
    loop width          between the rudder angles at which the steady yaw rate passes zero, on the
                        way to port and on the way back; zero where both ways are one
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from shiplog.manoeuvres.track import Track

LAST = 1.0  # L/V at the end of a hold over which the yaw rate is averaged


def settled(track: Track, end: float) -> float:
    """The yaw rate at the end of a hold [rad/s], averaged over LAST L/V."""
    speed = max(float(np.median(track.speed)), 1e-6)
    rows = (track.time <= end + 1e-9) & (track.time >= end - LAST * track.length / speed)
    return float(track.yaw_rate[rows].mean())


def residual(track: Track, holds: Sequence[tuple[float, float]]) -> dict[str, float]:
    """Of the amidships holds after a turn: the side of that turn, and when the hold ends."""
    if not holds:
        return {}
    left = {side: settled(track, end) for side, end in holds}
    if len(left) == 2:
        value = 0.5 * (left[1.0] - left[-1.0])
    else:
        ((side, rate),) = left.items()
        value = side * rate
    return {"residual_yaw_rate": math.degrees(value)}


def loop(steps: Sequence[tuple[float, float]]) -> dict[str, float]:
    """Of steady (rudder, yaw rate) [rad, rad/s], in the order in which they were held, to port and
    back or the other way round.

    Each way's rudder angle at zero yaw rate is interpolated. Where the yaw rate jumps across zero
    between two angles, that of an unstable ship, it is the angle at which it had not yet jumped.
    """
    if len(steps) < 4:
        return {}
    angles = [angle for angle, _ in steps]
    turn = int(np.argmin(angles)) if angles[0] > min(angles) else int(np.argmax(angles))
    ways = [steps[: turn + 1], steps[turn:]]
    zeros = [_zero(way) for way in ways]
    if any(zero is None for zero in zeros):
        return {}
    return {"loop_width": math.degrees(abs(zeros[1] - zeros[0]))}  # type: ignore[operator]


def _zero(way: Sequence[tuple[float, float]]) -> float | None:
    for (a, ra), (b, rb) in itertools.pairwise(way):
        if ra == 0.0:
            return a
        if (ra > 0.0) != (rb > 0.0):
            return a + (b - a) * ra / (ra - rb)
    return None
