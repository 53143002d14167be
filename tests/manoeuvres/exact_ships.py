"""Ships whose manoeuvres have closed forms: a circle, and a first-order Nomoto ship in a zigzag.

T ṙ + r = K δ with a rudder that is over at once: between two orders r and ψ are exponentials, so
that the orders, the peaks and the period follow from scalar equations, to rounding.
"""

import math

import numpy as np
from scipy.optimize import brentq


class Nomoto:
    """At constant speed U ahead, without sway. Orders at ψ = ±heading, first to starboard."""

    def __init__(self, K, T, angle, heading, speed, orders=5):
        self.K, self.T, self.speed = K, T, speed
        self.parts = []  # (begin, ψ, r, δ)
        psi, r, begin = 0.0, 0.0, 0.0
        for k in range(orders + 1):
            delta = angle if k % 2 == 0 else -angle
            self.parts.append((begin, psi, r, delta))
            if k == orders:
                break
            side = 1.0 if k % 2 == 0 else -1.0
            t = self._when(psi, r, delta, side * heading, side)
            psi, r = self._psi(psi, r, delta, t), self._rate(r, delta, t)
            begin += t
        self.orders = [part[0] for part in self.parts]

    def _rate(self, r, delta, t):
        return self.K * delta + (r - self.K * delta) * np.exp(-t / self.T)

    def _psi(self, psi, r, delta, t):
        gone = (r - self.K * delta) * self.T * (1.0 - np.exp(-t / self.T))
        return psi + self.K * delta * t + gone

    def _when(self, psi, r, delta, wanted, side):
        """The heading first runs on, then turns back and passes what is wanted."""
        turns = 0.0
        if side * r < 0.0:
            turns = self.T * math.log((r - self.K * delta) / (-self.K * delta))
        return brentq(lambda t: self._psi(psi, r, delta, t) - wanted, turns, 1e4 * self.T,
                      xtol=1e-13)  # fmt: skip

    def peak(self, k):
        """Time and heading of the peak after the k-th order back, k = 1, 2, …"""
        begin, psi, r, delta = self.parts[k]
        t = self.T * math.log((r - self.K * delta) / (-self.K * delta))
        return begin + t, float(self._psi(psi, r, delta, t))

    def sampled(self, step, seconds):
        """Times and states [n, 6]: position by a fine quadrature of the exact heading."""
        time = np.arange(0.0, seconds, step)
        begins = np.array(self.orders)
        part = np.clip(np.searchsorted(begins, time, side="right") - 1, 0, None)
        rows = np.array(self.parts)[part]
        since = time - rows[:, 0]
        state = np.zeros((len(time), 6))
        state[:, 1] = self.speed
        state[:, 4] = self._psi(rows[:, 1], rows[:, 2], rows[:, 3], since)
        state[:, 5] = self._rate(rows[:, 2], rows[:, 3], since)
        for i, of in ((0, np.cos), (2, np.sin)):
            path = np.cumsum(0.5 * step * self.speed * (of(state[1:, 4]) + of(state[:-1, 4])))
            state[1:, i] = path
        return time, state, rows[:, 3]
