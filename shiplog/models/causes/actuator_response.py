"""What acts of what was recorded: one model of an actuator, from its order to its deflection.

    u₁(t) = u(t - τ) + u₀                    delay τ, offset u₀ of the zero
    u₂ = min(max(u₁, -L), L)                 limit L: it turns, or pushes, no farther
    u₃ = play(u₂, b)  or  zone(u₂, b)        backlash of a gear, or dead zone of a drive, b wide
    |u̇₄| ≤ R,  u₄ → u₃                       rate R
    T u̇₅ = u₄ - u₅                           lag T of the first order

Backlash and dead zone: Tao & Kokotović 1996; rate and limit of a steering machine: van Amerongen
1982; lag: Fossen 2011, Sec. 9.5. Absent is τ = u₀ = b = T = 0 and 1/L = 1/R = 0: the recorded
values act. The causes of this room change one of these numbers each.

Values are [n, k], a column a unit, that go straight from row to row (`Record.step` apart) and begin
anew where a stretch begins (`Record.starts`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from shiplog.voyages.rows.recording import Record


def limited(values: np.ndarray, inverse: float) -> np.ndarray:
    """min(max(u, -L), L), L = 1/`inverse`; without a limit where that is not positive."""
    if inverse <= 0.0:
        return values
    return np.clip(values, -1.0 / inverse, 1.0 / inverse)


def dead_zone(values: np.ndarray, width: float) -> np.ndarray:
    """u - min(max(u, -b/2), b/2): nothing acts within b/2 of zero. A negative width is the inverse
    but at zero: it steps there."""
    half = 0.5 * width
    if half >= 0.0:
        return values - np.clip(values, -half, half)
    return values - np.sign(values) * half


def play(record: Record, values: np.ndarray, width: float) -> np.ndarray:
    """Backlash b: y₁ = min(max(y₀, u₁ - b/2), u₁ + b/2), in the middle where a stretch begins."""
    if width <= 0.0:
        return values
    half = 0.5 * width

    def walk(orders: list[float]) -> list[float]:
        y, found = orders[0], []
        for u in orders:
            if u - y > half:
                y = u - half
            elif y - u > half:
                y = u + half
            found.append(y)
        return found

    return _walked(record, values, walk)


def rate_limited(record: Record, values: np.ndarray, slowness: float) -> np.ndarray:
    """y₁ = min(max(u₁, y₀ - R h), y₀ + R h) with steps of h and R = 1/`slowness`; unlimited where
    that is not positive."""
    if slowness <= 0.0:
        return values
    most = record.step / slowness

    def walk(orders: list[float]) -> list[float]:
        y, found = orders[0], []
        for u in orders:
            if u - y > most:
                y += most
            elif y - u > most:
                y -= most
            else:
                y = u
            found.append(y)
        return found

    return _walked(record, values, walk)


def _walked(
    record: Record, values: np.ndarray, walk: Callable[[list[float]], list[float]]
) -> np.ndarray:
    """Each column of each stretch by itself, row after row: as lists, which Python walks ten times
    as fast as arrays."""
    found = np.empty_like(values)
    edges = np.append(np.flatnonzero(record.starts), len(values))
    for first, end in itertools.pairwise(edges):
        for column in range(values.shape[1]):
            found[first:end, column] = walk(values[first:end, column].tolist())
    return found


def delayed(record: Record, values: np.ndarray, time: float) -> np.ndarray:
    """u(t - τ)."""
    return record.later(values, -time)


def lagged(record: Record, values: np.ndarray, time: float) -> np.ndarray:
    """T ẏ = u - y, exactly for u that goes straight from row to row:

        y₁ = a y₀ + b₀ u₀ + b₁ u₁,  a = e^(-h/T),  b₁ = 1 - T/h (1 - a),  b₀ = 1 - a - b₁

    A negative time is the lead u + |T| u̇, its inverse."""
    rate = np.gradient(values, record.step, axis=0)
    starts = record.starts
    rate[starts] = 0.0
    if time <= 0.0:
        return values - time * rate
    decay = np.exp(-record.step / time)
    b1 = 1.0 - time / record.step * (1.0 - decay)
    b0 = 1.0 - decay - b1
    return _filtered(values, starts, decay, b0, b1)


def _filtered(x: np.ndarray, starts: np.ndarray, decay: float, b0: float, b1: float) -> np.ndarray:
    """y₁ = decay y₀ + b₀ x₀ + b₁ x₁; a stretch begins in balance with its first row. All rows at
    once, as the lower bidiagonal system y₁ - decay y₀ = b₀ x₀ + b₁ x₁."""
    from scipy.linalg import solve_banded  # 0.1 s to load

    moving = np.logical_not(starts)
    moving[:1] = False
    right = x.copy()
    right[moving] = (b0 * np.roll(x, 1, axis=0) + b1 * x)[moving]
    bands = np.ones((2, len(x)))
    bands[1] = -decay * np.roll(moving, -1)
    return solve_banded((1, 0), bands, right)
