"""Who goes alongside the wall from time to time, leans on its fenders, and sails on.

Along the wall the course is that of a line of sight: ψ = ψ_w ± atan((e + lean)/Δ), e the distance
from the line and Δ two lengths (Fossen 2021, ch. 12). Without fenders he would be on the wall.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from pipelines.experiments.other_families.operators import Operator
from pipelines.experiments.other_families.ship import Ship

EVERY, STAY = (2.0, 6.0), (3.0, 6.0)  # L/U, between two calls; alongside
LONGEST = 25.0  # L/U, of a call with the way there
AHEAD = 3.0  # L, of the line of sight
STEEPEST = math.radians(30.0)  # to the wall
POWER = (0.45, 0.35)  # of full ahead: on the way, and alongside
ENDS = 0.75  # of the radius: the part of the wall that is used


@dataclass(slots=True)
class Berthing:
    """An `Operator` who sees a wall. `lean` [m] is how far beyond its fenders' face he steers."""

    ship: Ship
    rng: np.random.Generator
    lean: float
    operator: Operator = field(init=False)
    until: float = field(init=False)
    calling: bool = False
    stay: float = math.inf  # s, when it leaves; known once it is there
    along: float = 0.0  # rad, the course along the wall

    def __post_init__(self) -> None:
        self.operator = Operator(self.ship, self.rng)
        self.until = self._drawn(EVERY)

    def _drawn(self, range_: tuple[float, float]) -> float:
        return float(self.rng.uniform(*range_)) * self.ship.time_unit

    def __call__(self, time: float, state: np.ndarray) -> np.ndarray:
        x, y, psi, _, _, r = state[:6]
        off = self.ship.bank_east - 0.5 * self.ship.body.breadth - y
        if self.calling:
            if off < 0.7 * self.ship.length and math.isinf(self.stay):
                self.stay = time + self._drawn(STAY)
            far = abs(x) > ENDS * self.ship.radius and x * math.cos(self.along) > 0.0
            if time >= min(self.until, self.stay) or far:
                self.calling, self.until = False, time + self._drawn(EVERY)
                self.operator.returning, self.operator.own = True, None
                self.operator.demand = (POWER[0], 0.0, 0.0)
        elif time >= self.until:
            self.calling, self.until = True, time + LONGEST * self.ship.time_unit
            self.stay = math.inf
            self.along = math.pi if x > 0.0 else 0.0  # to where there is more of it
        if not self.calling:
            return self.operator(time, state)
        towards = math.atan((off + self.lean) / (AHEAD * self.ship.length))
        towards = min(towards, STEEPEST) * (1.0 if self.along == 0.0 else -1.0)
        power = POWER[0] if off > self.ship.length else POWER[1]
        turn = self.operator.wheel(self.along + towards, psi, r)
        return self.operator.orders((power, turn, 0.0))
