"""How long a ship's segments are, in units of its own time: the length over the speed, L/U.

A segment is about 4 L/U (T' = U t/L, e.g. Yasukawa & Yoshimura 2015); bins and nodes are a
fifteenth of that.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SEGMENT_S = 30.0
BIN = 2.0  # s that one observation averages
NODE_STEP = 2.0  # s between nodes of the acceleration
STEP_ROWS = 2  # rows of the record to a step of an integration
SEGMENT_BINS = 15  # of a segment, whatever it lasts
SHIP_TIME = 7.1  # s, L/U for which the above are made: 5 to 10 s, of 3 m at 0.3 to 0.6 m/s
WORKING = 0.95  # quantile of the speed: a ship that waits at a berth is no slower for it
BIN_LENGTHS = (1.4, 2.0, 4.0, 8.0, 16.0)  # s; segments of 21 to 240 s, rows to a bin are even
CAMPAIGN_SEGMENTS = (
    48  # segments of the shorter campaign, fewer of which say too little of how parts differ
)


@dataclass(frozen=True)
class Timescale:
    """How long a ship's segments are [s], what one observation averages, and between nodes."""

    seconds: float = SEGMENT_S
    bin: float = BIN
    node_step: float = NODE_STEP

    @property
    def step_rows(self) -> int:
        """Rows of the record to a step of an integration, of which a bin has a whole number."""
        return STEP_ROWS * max(int(self.factor), 1)

    @property
    def factor(self) -> float:
        """Times that of a three-metre ship."""
        return self.seconds / SEGMENT_S


THREE_METRES = Timescale()  # as a model ship of three metres has it


def of_ship(length: float, speed: float, recorded: float = math.inf) -> Timescale:
    """The time scale of a ship.

    length    m
    speed     working speed: what 19 of 20 seconds of its nominal voyages do not exceed [m/s]
    recorded  s, of the shorter campaign: it is cut into `CAMPAIGN_SEGMENTS` segments at least

    In steps of two, so that a ship of the three-metre class keeps 30 s, 2 s and 2 s; not below
    21 s, where a segment tells little more than its initial state, nor above 240 s, where small
    errors of a model grow too far for a linearisation.
    """
    time = length / max(speed, 1e-6)
    step = math.floor(math.log2(max(time, 1e-6) / SHIP_TIME) + 0.5)
    at = min(max(step, -1), len(BIN_LENGTHS) - 2) + 1
    while at > 1 and SEGMENT_BINS * BIN_LENGTHS[at] * CAMPAIGN_SEGMENTS > recorded:
        at -= 1
    wide = BIN_LENGTHS[at]
    return Timescale(SEGMENT_BINS * wide, wide, wide)
