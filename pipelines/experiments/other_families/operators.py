"""Random harbour manoeuvres in units of the ship: telegraph, joystick, an eye on the edges."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pipelines.experiments.other_families.ship import Ship

Demand = tuple[float, float, float]  # surge, turn, side in [-1, 1]
Helm = Callable[[float, np.ndarray], np.ndarray]  # time [s], state [6 + ...] → orders [A]
TELEGRAPH = (0.3, 0.45, 0.6, 0.8, 1.0)
SHORTEST, LONGEST = 5.0, 300.0  # s, of one manoeuvre, whatever the ship
MIDDLE = -0.2  # of the radius: the bank makes the middle of the water lie west of the datum
AHEAD = 3.5  # L/U that the operator looks ahead
HAND = 0.1  # a hand turns the wheel in tenths


@dataclass(frozen=True, slots=True)
class Manoeuvre:
    """Drawn with `weight`; lasts `low` to `high` L/U. needs: what the ship must be able to."""

    name: str
    weight: float
    low: float
    high: float
    needs: str = ""


MANOEUVRES = (
    Manoeuvre("cruise", 0.14, 1.0, 4.0),
    Manoeuvre("turn", 0.25, 0.8, 4.0),
    Manoeuvre("straight", 0.16, 2.5, 6.0),
    Manoeuvre("stop", 0.10, 1.0, 4.0),
    Manoeuvre("zigzag", 0.08, 3.0, 6.0),
    Manoeuvre("astern", 0.13, 3.0, 7.0, "reverses"),
    Manoeuvre("hover", 0.07, 0.8, 3.0, "spins"),
    Manoeuvre("spin", 0.06, 0.6, 2.0, "spins"),
    Manoeuvre("crab", 0.09, 0.8, 3.0, "crabs"),
    Manoeuvre("joystick", 0.08, 0.4, 1.5),
)


@dataclass(slots=True)
class Operator:
    """Draws a manoeuvre, holds it for a while, and turns back when an edge of the basin is near.

    Sees the basin and the ship, never its instruments: a hidden sensor fault leaves the path alone.
    """

    ship: Ship
    rng: np.random.Generator
    until: float = 0.0
    demand: Demand = (0.0, 0.0, 0.0)
    course: float | None = None  # rad, held on straight runs
    kick: float = 0.0  # rad, of a zigzag
    own: np.ndarray | None = field(default=None)  # orders drawn actuator by actuator
    returning: bool = False

    def __call__(self, time: float, state: np.ndarray) -> np.ndarray:
        x, y, psi, u, v, r = state[:6]
        velocity = complex(u, v) * np.exp(1j * psi)
        look = complex(x, y) + AHEAD * self.ship.time_unit * velocity
        here = self._far(complex(x, y))
        soon = self._far(look)
        if self.returning and (here < 0.35 or (here < 0.7 and soon < 0.5)):
            self.returning, self.until = False, time
        elif not self.returning and here > 0.4 and max(here, soon) > 0.75:
            self.returning, self.own, self.course = True, None, None
            self.demand = (float(self.rng.choice(TELEGRAPH[1:])), 0.0, 0.0)
        if self.returning:
            surge = 1.0 if here > 0.9 else self.demand[0]
            to = complex(0.0, MIDDLE * self.ship.radius) - complex(x, y)
            return self.orders((surge, self.wheel(math.atan2(to.imag, to.real), psi, r), 0.0))
        if time >= self.until:
            self._draw(time, psi)
        if self.own is not None:
            return self.own
        surge, turn, side = self.demand
        if self.course is not None:
            turn = self.wheel(self.course, psi, r)
            if self.kick and abs(_wrap(self.course - psi)) < 0.2 * abs(self.kick):
                self.kick = -self.kick
                self.course += 2.0 * self.kick
        return self.orders((surge, turn, side))

    def _far(self, at: complex) -> float:
        """0 in the middle of the water, 1 at its edge: the circle, or the bank less one length."""
        radius, bank = self.ship.radius, self.ship.bank_east - self.ship.length
        middle = MIDDLE * radius
        return max(abs(at - 1j * middle) / (radius + middle), (at.imag - middle) / (bank - middle))

    def wheel(self, course: float, heading: float, rate: float) -> float:
        turn = 1.3 * _wrap(course - heading) - 1.2 * rate * self.ship.time_unit
        return HAND * round(min(max(turn, -1.0), 1.0) / HAND)

    def orders(self, demand: Demand) -> np.ndarray:
        order = self.ship.mixer(*demand)
        low, high = (
            np.array([getattr(a, k) for a in self.ship.actuators]) for k in ("low", "high")
        )
        free = np.array([a.kind == "azimuth" for a in self.ship.actuators])
        return np.where(free, order, np.clip(order, low, high))

    def _draw(self, time: float, heading: float) -> None:
        able = [m for m in MANOEUVRES if not m.needs or getattr(self.ship, m.needs)]
        weights = np.array([m.weight for m in able])
        chosen = able[self.rng.choice(len(able), p=weights / weights.sum())]
        length = self.rng.uniform(chosen.low, chosen.high) * self.ship.time_unit
        self.until = time + min(max(length, SHORTEST), LONGEST)
        self.own, self.course, self.kick = None, None, 0.0
        rng = self.rng
        power, sign = float(rng.choice(TELEGRAPH)), float(rng.choice((-1.0, 1.0)))
        some = float(rng.uniform(0.35, 1.0))
        small = float(rng.uniform(-0.2, 0.2))
        self.demand = {
            "cruise": (power, small, 0.0), "turn": (power, sign * some, 0.0),
            "straight": (power, 0.0, 0.0), "zigzag": (power, 0.0, 0.0), "stop": (0.0, 0.0, 0.0),
            "astern": (-max(power, 0.6), small * 3.0, 0.0), "hover": (0.5 * small, small, 0.0),
            "spin": (0.0, sign * some, 0.0), "crab": (small, small, sign * some),
            "joystick": (0.0, 0.0, 0.0),
        }[chosen.name]  # fmt: skip
        if chosen.name in ("straight", "zigzag"):
            self.course = float(rng.uniform(-math.pi, math.pi))
        if chosen.name == "zigzag":
            self.kick = math.radians(rng.uniform(10.0, 20.0)) * sign
            self.course = heading + self.kick
        if chosen.name == "joystick":
            share = rng.uniform(-0.7, 0.7, len(self.ship.actuators))
            self.own = np.array([
                (a.high if s > 0.0 else -a.low) * s
                for a, s in zip(self.ship.actuators, share, strict=True)
            ])  # fmt: skip


def _wrap(angle: float) -> float:
    return math.atan2(math.sin(angle), math.cos(angle))
