"""In the child: rollouts of a simulator that gives accelerations, or its next state.

    x(t + h) = x + ½ h (k₁ + k₂),  k₁ = ẋ(x, u(t), t),  k₂ = ẋ(x + h k₁, u(t + h), t + h)

Heun (1900), SUBSTEPS steps to a measured one: a ship of a few metres has time constants of seconds,
and what the step adds is a thousandth of what it does. What drives goes straight between two
measurements. A simulator of its own step takes so many of these as fit.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shiplog.foreign.progress import NOW
from shiplog.foreign.rows import STATES, Trouble, rate, stacked

SUBSTEPS = 10

Rates = Callable[[np.ndarray], tuple[np.ndarray, list[Trouble]]]


class Failures:
    """The first trouble of each window: it has ended there."""

    def __init__(self) -> None:
        self.first: dict[int, Trouble] = {}

    def add(self, troubles: list[Trouble]) -> None:
        for one in troubles:
            self.first.setdefault(one.row, one)


def by_rates(
    rates: Rates, start: np.ndarray, driven: np.ndarray, dt: np.ndarray, begin: np.ndarray
) -> tuple[np.ndarray, list[Trouble]]:
    """States [N, I, 6] of windows; not a number after a failure.

    start [N, 6], driven [N, I, A + 2], dt [N, I - 1], begin [N] s into the voyage"""
    failures, states = Failures(), [start]

    def slope(x: np.ndarray, u: np.ndarray, time: np.ndarray) -> np.ndarray:
        rows = stacked(x, u, time)
        NOW.at(float(time[0]))
        found, troubles = rates(rows)
        failures.add(troubles)
        return rate(rows, found)

    x, time = start.copy(), begin.astype(float)
    with np.errstate(all="ignore"):
        for i in range(dt.shape[1]):
            h = dt[:, i, None] / SUBSTEPS
            for k in range(SUBSTEPS):
                now = _between(driven, i, k / SUBSTEPS)
                then = _between(driven, i, (k + 1) / SUBSTEPS)
                first = slope(x, now, time)
                time = time + h[:, 0]
                second = slope(x + h * first, then, time)
                x = x + 0.5 * h * (first + second)
            states.append(x)
    return np.stack(states, 1), list(failures.first.values())


def by_steps(
    step: Rates, length: float, start: np.ndarray, driven: np.ndarray, dt: np.ndarray,
    begin: np.ndarray,
) -> tuple[np.ndarray, list[Trouble]]:  # fmt: skip
    """The same of one that gives the next state [n, 6], `length` s later."""
    failures, states = Failures(), [start]
    x, time = start.copy(), begin.astype(float)
    with np.errstate(all="ignore"):
        for i in range(dt.shape[1]):
            count = max(1, round(float(np.median(dt[:, i])) / length))
            for k in range(count):
                NOW.at(float(time[0]))
                x, troubles = step(stacked(x, _between(driven, i, k / count), time))
                failures.add(troubles)
                time = time + length
            states.append(x)
    found = np.stack(states, 1)
    found[..., 4] = np.unwrap(np.where(np.isfinite(found[..., 4]), found[..., 4], 0.0), axis=1) + (
        np.where(np.isfinite(found[..., 4]), 0.0, np.nan)
    )
    return found[..., :STATES], list(failures.first.values())


def along(
    rates: Rates, start: np.ndarray, acceleration: np.ndarray, driven: np.ndarray, step: float
) -> tuple[np.ndarray, list[Trouble]]:
    """Paths of segments [S, K, 6]: two-step Adams-Bashforth, the first step by Euler, with
    accelerations [S, K, 3] added; see `diagnosis.linear.foreign_paths`."""
    failures, states, before = Failures(), [start], None
    x = start
    with np.errstate(all="ignore"):
        for k in range(driven.shape[1] - 1):
            rows = stacked(x, driven[:, k], 0.0)
            found, troubles = rates(rows)
            failures.add(troubles)
            now = rate(rows, found + acceleration[:, k])
            x = x + step * (now if before is None else 1.5 * now - 0.5 * before)
            before = now
            states.append(x)
    return np.stack(states, 1), list(failures.first.values())


def _between(driven: np.ndarray, i: int, part: float) -> np.ndarray:
    return driven[:, i] + part * (driven[:, i + 1] - driven[:, i])
