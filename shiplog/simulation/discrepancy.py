"""What a model gets wrong beyond the spread of its coefficients, as a random acceleration.

    d' = -d/τ + s √(2/τ) w,   d(0) ~ N(0, s²)

an Ornstein-Uhlenbeck process of each of u̇, v̇ and ṙ (Uhlenbeck & Ornstein 1930). Its sizes s are
such that the rollouts of the run err as much, in the mean square, as they did on voyages that no
fit has used: the growth of the run's band (`prediction_interval`). The band's factor is not used.
It makes up for windows that err unlike others, and for few voyages; the mean square has both, and
over simulated ships the factor made the intervals of manoeuvres wider than their errors
(docs/evidence/manoeuvres.md). A missing force stays while the motion does, so τ is long, and
grows with the dynamic pressure at hull and rudder: s is that of the training data, times

    q/q_training,   q = U² + ½ (n D)²

of the mean revolutions n and diameter D of its screws, whose slipstream the rudders stand in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from shiplog.nomenclature.channels import VELOCITY_IN_STATE
from shiplog.simulation.members import Rates
from shiplog.simulation.prediction_interval import Band

MEMORY = 10.0  # τ in L/V: a third of a circle, or a swing of a zigzag
SLIPSTREAM = 0.5  # of (n D)²: the mean of the slipstream's speed squared behind a loaded screw
STARTS = 64  # seconds of the training data from which the response is measured
PROBE = 0.02  # of V²/L, and V²/L² of the yaw rate: small, so that the response is linear


@dataclass(frozen=True)
class Discrepancy:
    """size    [3] s, m/s² and rad/s²
    memory  τ, s
    pressure  q of the training data, mean, m²/s²
    slip      [A] D of what is a screw, divided by their number; zero of other actuators"""

    size: np.ndarray
    memory: float
    pressure: float
    slip: np.ndarray

    def scale(self, state: np.ndarray, actuator: np.ndarray) -> np.ndarray:
        """q/q_training of states [N, 6] and actuators [N, A]: [N, 1]."""
        return (pressure(state, actuator, self.slip) / self.pressure)[:, None]

    def process(self, count: int, rng: np.random.Generator, wider: float = 1.0) -> Process:
        """Of so many members, the first of which has none; `wider` times as large."""
        return Process(self, count, rng, wider)


def pressure(state: np.ndarray, actuator: np.ndarray, slip: np.ndarray) -> np.ndarray:
    """q [N] of states [N, 6] and actuators [N, A]."""
    return state[:, 1] ** 2 + state[:, 3] ** 2 + SLIPSTREAM * (actuator @ slip) ** 2


class Process:
    """d of each member [N, 3], step by step, exact for any step."""

    def __init__(self, of: Discrepancy, count: int, rng: np.random.Generator, wider: float) -> None:
        self._of, self._size, self._memory, self._rng = of, wider * of.size, of.memory, rng
        self._now = self._size * rng.standard_normal((count, 3))
        self._now[:1] = 0.0

    def __call__(self, state: np.ndarray, actuator: np.ndarray, step: float) -> np.ndarray:
        found, keep = self._now, math.exp(-step / self._memory)
        drawn = self._rng.standard_normal(found.shape)
        drawn[:1] = 0.0
        self._now = keep * found + math.sqrt(1.0 - keep * keep) * self._size * drawn
        return found * self._of.scale(state, actuator)


def calibrated(
    rates: Rates,
    band: Band,
    state: np.ndarray,
    actuator: np.ndarray,
    wind: np.ndarray,
    step: float,
    substeps: int,
    length: float,
    slip: np.ndarray,
) -> Discrepancy:
    """From a run's band, and how its own rollouts respond.

    state, actuator, wind   [n, ...] seconds of the training data, true wind; the response is the
                            mean over the second half of the band's length, with both held
    step                    s between the band's samples

    The variances solve G s² = e², s² ≥ 0 by least squares, each row in units of e²: G [3, 3] is the
    variance of u, v, r that a unit of each gives, e² what the band adds to the coefficients'.
    """
    from scipy.optimize import nnls

    speed = max(float(np.sqrt(np.mean(state[:, 1] ** 2 + state[:, 3] ** 2))), 1e-3)
    memory = MEMORY * length / speed
    mean = float(pressure(state, actuator, slip).mean())
    plain = Discrepancy(np.zeros(3), memory, max(mean, 1e-9), slip)
    unit = PROBE * speed**2 / length * np.array([1.0, 1.0, 1.0 / length])
    rng = np.random.default_rng(0)
    rows = rng.choice(len(state), min(STARTS, len(state)), replace=False)
    count, steps = len(rows), len(band.growth) - 1
    chosen = [np.tile(part[rows], (4, 1)) for part in (state, actuator, wind)]
    size = np.zeros((4 * count, 3))
    for i in range(3):
        size[(i + 1) * count : (i + 2) * count, i] = unit[i]
    velocity = list(VELOCITY_IN_STATE)
    now, h = chosen[0].copy(), step / substeps
    push, keep = size * rng.standard_normal(size.shape), math.exp(-h / memory)
    squares, taken = np.zeros((3, 3)), 0
    with np.errstate(all="ignore"):
        for k in range(steps * substeps):
            rate = rates(now, chosen[1], chosen[2]) + push * plain.scale(now, chosen[1])
            now[:, velocity] += h * rate
            now[:, 4] += h * now[:, 5]
            push = keep * push + math.sqrt(1.0 - keep * keep) * size * rng.standard_normal(
                size.shape
            )
            if k >= steps * substeps // 2:
                moved = now[:, velocity].reshape(4, count, 3)
                apart = moved[1:] - moved[0]
                good = np.isfinite(apart).all((0, 2))
                squares += (apart[:, good] ** 2).mean(1).T
                taken += 1
    G = squares / max(taken, 1)  # [of u v r, by u v r]
    late = band.growth[len(band.growth) // 2 :, velocity]
    known = np.isfinite(late).all()
    error = (late**2).mean(0)
    if not known or not np.isfinite(G).all() or not (error > 0.0).all():
        return plain
    found, _ = nnls(G / error[:, None], np.ones(3))
    return replace(plain, size=unit * np.sqrt(found))
