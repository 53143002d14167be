"""A model whose coefficients differ from row to row."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from shiplog.machine import trees
from shiplog.machine.arrays import Array


@trees.tree(data=["base"], fixed=["count"])
@dataclass(frozen=True)
class EachItsOwn:
    """A model whose `count` coefficients stand behind its actuators; θ is empty."""

    base: Any
    count: int

    @property
    def names(self) -> tuple[str, ...]:
        return ()

    @property
    def substeps(self) -> int:
        return self.base.substeps

    @property
    def smooth(self) -> float:
        return self.base.smooth

    def acceleration(self, theta: Array, state: Array, actuator: Array, true_wind: Array) -> Array:
        """ν̇ [3] of one sample; arguments as for MMG.acceleration."""
        at = actuator.shape[-1] - self.count
        return self.base.acceleration(actuator[at:], state, actuator[:at], true_wind)
