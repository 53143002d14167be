"""In the child: what a simulator is asked in addition to itself: whether it is odd, its slopes."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from shiplog.foreign.rows import Trouble


class Simulator(Protocol):
    """What a kind of simulator answers."""

    def rates(self, rows: np.ndarray) -> tuple[np.ndarray, list[Trouble]]: ...
    def exact(self, rows: np.ndarray) -> np.ndarray | None: ...
    def roll(
        self, start: np.ndarray, driven: np.ndarray, dt: np.ndarray, begin: np.ndarray
    ) -> tuple[np.ndarray, list[Trouble]]: ...


def checked(simulator: Simulator, rows: np.ndarray) -> dict[str, Any]:
    """Whether it is deterministic, and what its accelerations depend on besides velocities."""
    began = time.perf_counter()
    first, troubles = simulator.rates(rows)
    seconds = (time.perf_counter() - began) / max(len(rows), 1)
    again, _ = simulator.rates(rows)
    scale = np.nanmax(np.abs(first), axis=0, initial=0.0) + 1e-12

    def apart(other: np.ndarray) -> float:
        off = np.abs(other - first) / scale
        return float(np.nanmax(off, initial=0.0))

    def changed(columns: Sequence[int], by: float) -> np.ndarray:
        moved = rows.copy()
        moved[:, list(columns)] += by
        return simulator.rates(moved)[0]

    return {
        "seconds": seconds,
        "random": apart(again),
        "place": apart(changed((0, 2), 500.0)),
        "time": apart(changed((-1,), 1.0)),
        "troubles": [[t.row, t.second, t.words] for t in troubles],
        "sound": float(np.isfinite(first).all(1).mean()),
    }


def slopes(
    simulator: Simulator, rows: np.ndarray, steps: np.ndarray
) -> tuple[list[np.ndarray], list[Trouble]]:
    """ν̇ and ∂ν̇/∂x_i ≈ (ν̇(x + h_i e_i) - ν̇(x - h_i e_i)) / 2h_i, of columns with a step h_i; zero
    for the others. A simulator's own derivatives where it has them."""
    middle, troubles = simulator.rates(rows)
    exact = simulator.exact(rows)
    if exact is not None:
        return [middle, exact], troubles
    found = np.zeros((len(rows), 3, rows.shape[1] - 1))
    columns = np.flatnonzero(steps)
    many = np.repeat(rows[None], 2 * len(columns), axis=0)
    for at, column in enumerate(columns):
        many[2 * at, :, column] += steps[column]
        many[2 * at + 1, :, column] -= steps[column]
    values, more = simulator.rates(many.reshape(-1, rows.shape[1]))
    values = values.reshape(len(columns), 2, len(rows), 3)
    apart = (values[:, 0] - values[:, 1]) / (2.0 * steps[columns, None, None])
    found[..., columns] = np.moveaxis(apart, 0, -1)
    # of a difference that failed on one side, nothing is known: it is zero, and is said
    found[~np.isfinite(found)] = 0.0
    moved = [Trouble(t.row % len(rows), t.second, t.words) for t in more]
    return [middle, found], troubles + moved
