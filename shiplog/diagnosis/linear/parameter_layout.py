"""What the numbers of a diagnosis stand for, one after another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shiplog.models.causes import Cause

HELD_INFORMATION = 1e8  # information that leaves a number where it is


@dataclass(frozen=True)
class Columns:
    """The base's P coefficients, then each cause's own numbers, then weights of a network's misfit.

    unit [C]   plausible spread of a coefficient, realistic size of a cause's number; 1 of a weight
    misfit     number of weights
    """

    base: int
    causes: tuple[Cause, ...]
    unit: np.ndarray
    misfit: int = 0

    def with_misfit(self, count: int) -> Columns:
        return replace(self, unit=np.concatenate((self.unit, np.ones(count))), misfit=count)

    @property
    def linearised(self) -> int:
        """All but the misfit's."""
        return len(self.unit) - self.misfit

    @cached_property
    def of(self) -> dict[str, np.ndarray]:
        """Cause's label → its columns."""
        found, at = {}, self.base
        for cause in self.causes:
            found[cause.label] = np.arange(at, at + cause.count)
            at += cause.count
        return found

    @cached_property
    def known(self) -> np.ndarray:
        """[C] prior information of each number, in units. A cause that is an alias of coefficients
        or of another cause has no nominal size of its own."""
        whole = np.ones(len(self.unit))
        for cause in self.causes:
            if not cause.nominal:
                whole[self.of[cause.label]] = HELD_INFORMATION
        return whole

    def numbers(self, given: Mapping[str, np.ndarray]) -> np.ndarray:
        """Of all causes, with those of some, zero for the others."""
        whole = np.zeros(self.linearised)
        for label, values in given.items():
            whole[self.of[label]] = values
        return whole[self.base :]
