"""The path of a ship during a manoeuvre, and values of it between its samples.

Between two samples heading and place are cubic Hermite polynomials of values and rates (heading
with yaw rate, place with velocity), so that an instant is found to h⁴/384 of the fourth derivative.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shiplog.nomenclature.frames import in_body_axes, in_earth_axes

MOST_STEPS = 60  # of a bisection: to the last bit
PEAK_ROOTS = 1e-12  # of a quadratic's leading coefficient, below which it is a line


@dataclass(frozen=True)
class Track:
    """K samples of one ship.

    time      [K]     s, rising
    state     [K, 6]  channels.STATE over ground, heading unwrapped
    rudder    [K]     mean angle of what steers, positive where it turns the bow to starboard, rad
    screw     [K]     revolutions as a share of the approach's: 1, 0 stopped, negative astern
    length    L, m
    """

    time: np.ndarray
    state: np.ndarray
    rudder: np.ndarray
    screw: np.ndarray
    length: float

    def __len__(self) -> int:
        return len(self.time)

    @property
    def heading(self) -> np.ndarray:
        return self.state[:, 4]

    @property
    def yaw_rate(self) -> np.ndarray:
        return self.state[:, 5]

    @property
    def speed(self) -> np.ndarray:
        return np.hypot(self.state[:, 1], self.state[:, 3])

    @cached_property
    def velocity(self) -> np.ndarray:
        """[K, 2] along x₀ and y₀."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.stack(in_earth_axes(self.state[:, 1], self.state[:, 3], c, s), -1)

    @property
    def place(self) -> np.ndarray:
        return self.state[:, [0, 2]]

    @cached_property
    def travelled(self) -> np.ndarray:
        """[K] m along the track, by the trapezoidal rule of the speed."""
        step = np.diff(self.time) * 0.5 * (self.speed[1:] + self.speed[:-1])
        return np.concatenate(([0.0], np.cumsum(step)))

    def between(self, begin: float, end: float) -> Track:
        """The samples of [begin, end]."""
        rows = slice(
            int(np.searchsorted(self.time, begin - 1e-9)),
            int(np.searchsorted(self.time, end + 1e-9)),
        )
        return replace(
            self, time=self.time[rows], state=self.state[rows], rudder=self.rudder[rows],
            screw=self.screw[rows],
        )  # fmt: skip

    def without(self, drift: np.ndarray) -> Track:
        """Through water that moves with `drift` [2] along x₀ and y₀, m/s."""
        state = self.state.copy()
        state[:, [0, 2]] -= drift * (self.time - self.time[0])[:, None]
        c, s = np.cos(self.heading), np.sin(self.heading)
        ahead, starboard = in_body_axes(drift[0], drift[1], c, s)
        state[:, 1] -= ahead
        state[:, 3] -= starboard
        return replace(self, state=state)

    # --- between samples ---

    def row(self, time: float) -> int:
        """The sample before, or at, an instant within the track."""
        return int(np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self) - 2))

    def heading_at(self, time: float) -> float:
        return float(self._cubic(self.heading, self.yaw_rate, time))

    def heading_before(self, time: float) -> float:
        """At an order: from the samples before it alone, since the order bends what follows.

        ψ(t) = ψₖ + ∫ r, r the parabola through the last three samples of the yaw rate
        """
        k = self.row(time)
        first = max(0, k - 2)
        late = time - float(self.time[k])
        at = self.time[first : k + 1] - self.time[k]
        rate = np.polynomial.Polynomial.fit(at, self.yaw_rate[first : k + 1], k - first, [-1, 1])
        return float(self.heading[k] + rate.integ()(late))

    def place_at(self, time: float) -> np.ndarray:
        """[2]"""
        return self._cubic(self.place, self.velocity, time)

    def travelled_at(self, time: float) -> float:
        return float(self._cubic(self.travelled, self.speed, time))

    def at(self, values: np.ndarray, time: float) -> float:
        """Linear, of what has no rate."""
        return float(np.interp(time, self.time, values))

    def _cubic(self, values: np.ndarray, rates: np.ndarray, time: float) -> np.ndarray:
        k = self.row(time)
        h = self.time[k + 1] - self.time[k]
        s = (time - self.time[k]) / h
        return (
            (1.0 + 2.0 * s) * (1.0 - s) ** 2 * values[k]
            + s * (1.0 - s) ** 2 * h * rates[k]
            + s * s * (3.0 - 2.0 * s) * values[k + 1]
            + s * s * (s - 1.0) * h * rates[k + 1]
        )

    def reaches(self, heading: float, side: float, after: float) -> float | None:
        """When the heading first passes `heading` to that side (1 starboard, -1 port); None where
        it never does."""
        above = side * (self.heading - heading) >= 0.0
        rows = np.flatnonzero(above & (self.time > after))
        if not len(rows):
            return None
        k = int(rows[0])
        if k == 0:
            return float(self.time[0])
        return self._crossing(k - 1, heading, max(float(self.time[k - 1]), after))

    def _crossing(self, k: int, heading: float, after: float) -> float:
        """Of the cubic between samples k and k + 1: Newton's steps, halved where they leave it."""
        h = float(self.time[k + 1] - self.time[k])
        y0, y1 = float(self.heading[k]) - heading, float(self.heading[k + 1]) - heading
        m0, m1 = h * float(self.yaw_rate[k]), h * float(self.yaw_rate[k + 1])
        c3, c2 = 2.0 * (y0 - y1) + m0 + m1, 3.0 * (y1 - y0) - 2.0 * m0 - m1
        low, high = min(max((after - float(self.time[k])) / h, 0.0), 1.0), 1.0
        sign = 1.0 if y1 >= 0.0 and y1 >= y0 else -1.0
        s = min(max(y0 / (y0 - y1), low), high) if y0 != y1 else high
        for _ in range(MOST_STEPS):
            value = ((c3 * s + c2) * s + m0) * s + y0
            low, high = (low, s) if sign * value >= 0.0 else (s, high)
            slope = (3.0 * c3 * s + 2.0 * c2) * s + m0
            after_ = s - value / slope if slope else low - 1.0
            new = after_ if low <= after_ <= high else 0.5 * (low + high)
            if abs(new - s) < 1e-14:
                break
            s = new
        return float(self.time[k]) + h * s

    def peak(self, side: float, begin: float, end: float) -> tuple[float, float] | None:
        """Time and heading of the extreme to that side within [begin, end]; None where the heading
        still goes on at the end.

        Of the cubic: ψ'(s) = 0 in the step in which the yaw rate changes its sign.
        """
        rows = np.flatnonzero((self.time >= begin) & (self.time <= end))
        if len(rows) < 2:
            return None
        rate = side * self.yaw_rate
        turns = [k for k in rows[:-1] if rate[k] > 0.0 >= rate[k + 1]]
        if not turns:
            return None
        found = max((self._extreme(k) for k in turns), key=lambda one: side * one[1])
        return found

    def _extreme(self, k: int) -> tuple[float, float]:
        h = self.time[k + 1] - self.time[k]
        y0, y1, m0, m1 = (
            self.heading[k], self.heading[k + 1], h * self.yaw_rate[k], h * self.yaw_rate[k + 1]
        )  # fmt: skip
        # ψ'(s) = a s² + b s + c of the Hermite cubic
        a, b, c = 6.0 * (y0 - y1) + 3.0 * (m0 + m1), -6.0 * (y0 - y1) - 4.0 * m0 - 2.0 * m1, m0
        if abs(a) < PEAK_ROOTS:
            roots = [-c / b] if b else [0.5]
        else:
            inner = b * b - 4.0 * a * c
            if inner < 0.0:
                roots = [m0 / (m0 - m1)]
            else:
                q = -0.5 * (b + math.copysign(math.sqrt(inner), b))
                roots = [q / a, *([c / q] if q else [])]
        inside = [s for s in roots if -1e-9 <= s <= 1.0 + 1e-9] or [m0 / (m0 - m1)]
        time = float(self.time[k] + h * min(max(inside[0], 0.0), 1.0))
        return time, self.heading_at(time)
