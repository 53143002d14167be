"""An operator who calls at the wall, leans on its fenders for a while, and sails on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pipelines.experiments.simulated_ship.helm import Operator, Settings, limited
from pipelines.experiments.simulated_ship.ship import BANK_EAST, Ship

BETWEEN, STAYS = (20.0, 60.0), (20.0, 50.0)  # s
LONGEST = 180.0  # s, of a call with the way there
ENDS = 20.0  # m, half of the wall that is used
STEEPEST = math.radians(30.0)
REVOLUTIONS = (10.0, 6.5)  # rev/s on the way, and alongside


@dataclass(slots=True)
class Berthing:
    """`lean` [m]: how far beyond its fenders' face he steers."""

    rng: np.random.Generator
    lean: float
    operator: Operator = field(init=False)
    until: float = 30.0
    calling: bool = False
    leaves: float = math.inf
    along: float = 0.0

    def __post_init__(self) -> None:
        self.operator = Operator(self.rng)

    def __call__(self, time: float, state: np.ndarray) -> Settings:
        north, _, east, _, heading, yaw_rate = state[:6]
        off = BANK_EAST - 0.5 * Ship().breadth - east
        if self.calling:
            if off < 2.0 and math.isinf(self.leaves):
                self.leaves = time + self.rng.uniform(*STAYS)
            outward = abs(north) > ENDS and north * math.cos(self.along) > 0.0
            if time >= min(self.until, self.leaves) or outward:
                self.calling, self.until = False, time + self.rng.uniform(*BETWEEN)
                self.operator.returning = True
                self.operator.settings = (0.0, 0.0, 10.0)
        elif time >= self.until:
            self.calling, self.until, self.leaves = True, time + LONGEST, math.inf
            self.along = math.pi if north > 0.0 else 0.0
        if not self.calling:
            return self.operator(time, state)
        slant = min(math.atan((off + self.lean) / 9.0), STEEPEST)
        course = self.along + (slant if self.along == 0.0 else -slant)
        error = math.degrees(math.atan2(math.sin(course - heading), math.cos(course - heading)))
        rudder = min(max(0.9 * error - 5.0 * math.degrees(yaw_rate), -35.0), 35.0)
        rudder = 5.0 * round(rudder / 5.0)
        return limited((rudder, rudder, REVOLUTIONS[0] if off > 3.0 else REVOLUTIONS[1]))
