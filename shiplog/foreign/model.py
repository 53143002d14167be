"""A simulator as a model without coefficients: what the rest of shiplog asks of it.

ν̇ = f(x, u, ω)          `accelerations`
∂f/∂x, ∂f/∂u, ∂f/∂ω     `slopes`: its own derivatives, else central differences
x(t), from x(0)         `roll`: as the simulator itself goes on
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from shiplog.foreign.bridge import Bridge
from shiplog.foreign.rows import Trouble, stacked

STEP = 1e-3  # of a difference, of the range of its channel: three digits are left of six
FEWEST = 1e-4  # least step, SI: of an input that never moved


@dataclass(frozen=True, eq=False)
class Foreign:
    """A simulator that answers, by the bridge that `opened` makes with the first request.

    steps   [6 + A + 2] of the differences, SI; 0 where accelerations do not depend on it
    name    of its file, for messages
    """

    name: str
    opened: Callable[[], Bridge]
    steps: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        return ()

    @property
    def substeps(self) -> int:
        return 1

    @property
    def smooth(self) -> float:
        return 1.0  # s: differences are asked for as often as a network's derivatives

    def accelerations(self, state: np.ndarray, driven: np.ndarray) -> np.ndarray:
        """ν̇ [n, 3] of states [n, 6] and what drives (actuators, wind over ground) [n, A + 2]."""
        return self.opened().rates(stacked(state, driven, 0.0))

    def slopes(
        self, state: np.ndarray, driven: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """ν̇ [n, 3], ∂ν̇/∂x [n, 3, 6] and ∂ν̇/∂(u, ω) [n, 3, A + 2]."""
        middle, by = self.opened().slopes(stacked(state, driven, 0.0), self.steps)
        return middle, by[..., :6], by[..., 6:]

    def roll(
        self, start: np.ndarray, driven: np.ndarray, dt: np.ndarray, begin: np.ndarray
    ) -> tuple[np.ndarray, list[Trouble]]:
        """States [N, I, 6] from `start` [N, 6], `begin` [N] s into their voyages."""
        return self.opened().roll(start, driven, dt, begin)

    def along(
        self, start: np.ndarray, acceleration: np.ndarray, driven: np.ndarray, step: float
    ) -> np.ndarray:
        """States [S, K, 6] from `start` [S, 6], with accelerations [S, K, 3] added, by two-step
        Adams-Bashforth."""
        return self.opened().along(start, acceleration, driven, np.array([step]))


def steps_of(rows: np.ndarray, places: bool) -> np.ndarray:
    """Steps [D - 1] of differences, from rows [n, D] of the ship's; `places`: whether the
    accelerations depend on where it is."""
    values = rows[:, :-1]
    low, high = np.quantile(values, (0.02, 0.98), axis=0)
    steps = np.maximum(STEP * (high - low), FEWEST)
    wind = values[:, -2:]
    if not wind.any():
        steps[-2:] = 0.0
    steps[4] = STEP if places or wind.any() else 0.0  # heading
    steps[[0, 2]] = STEP * 10.0 if places else 0.0
    return steps


# Relative change of accelerations that is no change: single precision leaves 1e-7 of each term, and
# a difference of terms loses two digits
SAME = 1e-5


def derivatives(facts: dict[str, Any]) -> str:
    """Which derivatives a diagnosis uses, in words."""
    if facts["differentiated"]:
        return "its own, by JAX" if facts["library"] == "jax" else "its own"
    return f"central differences, {STEP:g} of each input's range either way"


# Of one that was logged, and cannot be called
NOTHING_ODD = {
    "seconds": 0.0, "random": 0.0, "place": 0.0, "time": 0.0, "sound": 1.0, "changes": False,
    "layout": "logged", "troubles": [],
}  # fmt: skip
