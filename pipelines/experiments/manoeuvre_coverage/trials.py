"""Turns and zigzags of a simulated ship, and what they truly were: from its own path.

The quantities are those of IMO MSC/Circ.1053 and ITTC 7.5-04-02-01, worked out here from the path
at 10 Hz without an instrument and from the instants at which the helm gave its orders. Nothing of
`shiplog.manoeuvres` is used: a sheet must not be judged by its own arithmetic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from pipelines.experiments.other_families.disturbance import Wind
from pipelines.experiments.other_families.effects import Effects
from pipelines.experiments.other_families.ship import Ship
from pipelines.experiments.other_families.voyage import Voyage, sail

APPROACH = 10.0  # L/U of a straight course before the first order
LONGEST = {"turn": 50.0, "zigzag": 45.0}  # L/U after it, at most
AFTER = 0.5  # L/U of the record beyond the end
CIRCLES = math.radians(560.0)  # heading change of a turn: a circle and a half, and a little
REVERSALS = 4  # of a zigzag: the peaks of three overshoots and a period
FULL = 2.0 * math.pi


@dataclass(frozen=True)
class Trial:
    """kind turn or zigzag; angle of the rudder, positive to starboard first, and heading, rad;
    power is the share of full revolutions."""

    name: str
    kind: str
    angle: float
    heading: float
    power: float


@dataclass(slots=True)
class Helm:
    """A straight approach by hand, then the trial's orders. `orders` are the instants [s] at which
    the rudder was ordered over; `done` when the trial was over."""

    ship: Ship
    trial: Trial
    course: float
    orders: list[float] = field(default_factory=list)
    first: float = 0.0
    done: float = math.inf

    def __call__(self, time: float, state: np.ndarray) -> np.ndarray:
        unit = self.ship.time_unit
        heading, rate = float(state[2]), float(state[5])
        if time < APPROACH * unit:
            off = math.remainder(self.course - heading, FULL)
            wheel = min(max(1.3 * off - 1.2 * rate * unit, -0.25), 0.25)
            return self._rudders(wheel * math.radians(35.0))
        side = math.copysign(1.0, self.trial.angle)
        if not self.orders:
            self.first = heading
            self.orders.append(time)
        turned = side * (heading - self.first)
        if self.trial.kind == "turn":
            if turned >= CIRCLES:
                self.done = min(self.done, time)
            return self._rudders(self.trial.angle)
        given = len(self.orders)
        to = 1.0 if given % 2 else -1.0
        if given <= REVERSALS and to * turned >= self.trial.heading:
            self.orders.append(time)
            to = -to
        elif given > REVERSALS and to * turned >= self.trial.heading:
            self.done = min(self.done, time)
        return self._rudders(to * self.trial.angle)

    def _rudders(self, angle: float) -> np.ndarray:
        order = np.array(self.ship.mixer(self.trial.power, 0.0, 0.0), float)
        order[list(self.ship.rudders)] = angle
        return order


def drawn(rng: np.random.Generator) -> tuple[Trial, ...]:
    """A turn with 35 deg of rudder to either side, and zigzags 10/10 and 20/20."""
    side = float(rng.choice((-1.0, 1.0)))
    power = float(rng.choice((0.6, 0.8)))
    deg = math.radians

    def turn(degrees: float) -> Trial:
        where = "starboard" if degrees > 0.0 else "port"
        return Trial(f"turn_{abs(degrees):.0f}_{where}", "turn", deg(degrees), 0.0, power)

    def zigzag(degrees: float) -> Trial:
        name = f"zigzag_{abs(degrees):.0f}"
        return Trial(name, "zigzag", deg(degrees), deg(abs(degrees)), power)

    return turn(35.0 * side), zigzag(10.0 * side), zigzag(-20.0 * side)


@dataclass(frozen=True)
class Sailed:
    """A voyage cut where its trial was over, and the orders of its helm."""

    trial: Trial
    voyage: Voyage
    orders: tuple[float, ...]


def sailed(
    ship: Ship, trial: Trial, *, seed: int, wind: Wind, effects: Effects, quiet: bool = False
) -> Sailed:
    """`quiet`: no process noise and an even wind, otherwise the same."""
    rng = np.random.default_rng([seed, 7])
    course = float(rng.uniform(-math.pi, math.pi))
    helm = Helm(ship, trial, course)
    unit = ship.time_unit
    start = (0.0, 0.0, course, ship.speed, 0.0, 0.0)
    even = replace(wind, gust=0.0, veer=0.0)
    whole = sail(
        ship, round((APPROACH + LONGEST[trial.kind]) * unit, 1), seed=seed,
        wind=even if quiet else wind, effects=effects, helm=helm, start=start, quiet=quiet,
    )  # fmt: skip
    end = min(helm.done + AFTER * unit, whole.duration)
    return Sailed(trial, cut(whole, end), tuple(helm.orders))


def cut(voyage: Voyage, end: float) -> Voyage:
    """The first `end` seconds."""
    rows = int(np.searchsorted(voyage.time, end + 1e-9))
    fields = ("time", "x0", "y0", "heading", "surge", "sway", "yaw_rate", "actuators", "from_ahead",
              "from_starboard")  # fmt: skip
    short = {name: getattr(voyage, name)[:rows] for name in fields}
    heel = voyage.heel[:rows] if len(voyage.heel) else voyage.heel
    return replace(voyage, duration=float(short["time"][-1]), heel=heel, **short)


def true_quantities(one: Sailed) -> dict[str, float]:
    """In L, deg, s and 1; what the path is too short for is left out."""
    if not one.orders:
        return {}
    side = math.copysign(1.0, one.trial.angle)
    if one.trial.kind == "turn":
        return _of_turn(one.voyage, one.orders[0], side)
    return _of_zigzag(one.voyage, one.orders, side, one.trial)


def _when(time: np.ndarray, turned: np.ndarray, angle: float, after: float) -> float:
    """The instant at which the heading change first passes an angle; not a number if never."""
    rows = np.flatnonzero((turned >= angle) & (time > after))
    if not len(rows) or rows[0] == 0:
        return math.nan
    k = rows[0]
    share = (angle - turned[k - 1]) / (turned[k] - turned[k - 1])
    return float(time[k - 1] + share * (time[k] - time[k - 1]))


def _of_turn(v: Voyage, begin: float, side: float) -> dict[str, float]:
    t, length = v.time, v.ship.length
    turned = side * (v.heading - np.interp(begin, t, v.heading))
    first = float(np.interp(begin, t, v.heading))
    x, y, u, w = v.x0, v.y0, v.surge, v.sway
    steps = np.arange(math.pi, turned[-1] - FULL, math.radians(10.0))
    if len(steps) > 1 and turned[-1] >= math.radians(570.0) - math.radians(30.0):
        pairs = [(_when(t, turned, a, begin), _when(t, turned, a + FULL, begin)) for a in steps]
        moved = np.mean(
            [[(np.interp(b, t, p) - np.interp(a, t, p)) / (b - a) for p in (x, y)]
             for a, b in pairs], axis=0,
        )  # fmt: skip
        x, y = x - moved[0] * t, y - moved[1] * t
        c, s = np.cos(v.heading), np.sin(v.heading)
        u, w = u - moved[0] * c - moved[1] * s, w + moved[0] * s - moved[1] * c
    ahead, aside = (math.cos(first), math.sin(first)), (-math.sin(first), math.cos(first))

    def gone(when: float, along: tuple[float, float]) -> float:
        dx, dy = (np.interp(when, t, p) - np.interp(begin, t, p) for p in (x, y))
        return float(dx * along[0] + dy * along[1]) / length

    quarter, half = (_when(t, turned, math.radians(a), begin) for a in (90.0, 180.0))
    found = {
        "advance": gone(quarter, ahead), "transfer": side * gone(quarter, aside),
        "tactical_diameter": side * gone(half, aside),
    }  # fmt: skip
    circle = (turned >= turned[-1] - FULL) & (turned >= math.pi) & (t > begin)
    if turned[-1] >= math.pi + FULL:
        rows = np.flatnonzero(circle)
        spent = t[rows[-1]] - t[rows[0]]
        speed = np.hypot(u, w)
        mean = float(np.trapezoid(speed[rows], t[rows]) / spent)
        rate = (turned[rows[-1]] - turned[rows[0]]) / spent
        ahead_, aside_ = (np.trapezoid(p[rows], t[rows]) for p in (u, w))
        found |= {
            "steady_diameter": 2.0 * mean / float(rate) / length,
            "drift_angle": math.degrees(math.atan2(-side * aside_, ahead_)),
            "speed_loss": 1.0 - mean / float(np.interp(begin, t, speed)),
        }
    return {name: value for name, value in found.items() if math.isfinite(value)}


def _of_zigzag(v: Voyage, orders: tuple[float, ...], side: float, trial: Trial) -> dict[str, float]:
    t = v.time
    turned = side * (v.heading - np.interp(orders[0], t, v.heading))
    found: dict[str, float] = {}
    if abs(trial.heading - math.radians(10.0)) < 1e-6:
        when = _when(t, turned, math.radians(10.0), orders[0])
        speed = np.hypot(v.surge, v.sway)
        way = np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(t))))
        gone = np.interp(when, t, way) - np.interp(orders[0], t, way)
        found["initial_turning"] = float(gone) / v.ship.length
    peaks = []
    for k, back in enumerate(orders[1:]):
        to = 1.0 if k % 2 == 0 else -1.0
        until = orders[k + 2] if k + 2 < len(orders) else t[-1]
        rows = np.flatnonzero((t >= back) & (t <= until))
        if len(rows) < 3 or np.argmax(to * turned[rows]) == len(rows) - 1:
            break
        peak = rows[int(np.argmax(to * turned[rows]))]
        peaks.append(float(t[peak]))
        over = to * (turned[peak] - np.interp(back, t, turned))
        if k < 3:
            found[f"{('first', 'second', 'third')[k]}_overshoot"] = math.degrees(float(over))
    if peaks:
        found["check_time"] = peaks[0] - orders[1]
    if len(peaks) >= 3:
        found["period"] = peaks[2] - peaks[0]
    return {name: value for name, value in found.items() if math.isfinite(value)}
