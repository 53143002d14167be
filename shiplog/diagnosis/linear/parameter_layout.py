"""The vector of a diagnosis, θ [C] and w [W]: what its numbers stand for, one after another.

All algebra is in units: number = unit · x, with x of about one, so that information matrices can
be inverted. A column of J is multiplied by its unit; a Gaussian on x has information K.
"""

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
        """With `count` weights w behind θ, of unit one."""
        return replace(self, unit=np.concatenate((self.unit, np.ones(count))), misfit=count)

    @property
    def linearised(self) -> int:
        """All but the misfit's."""
        return len(self.unit) - self.misfit

    @cached_property
    def indices(self) -> dict[str, np.ndarray]:
        """Cause's label → its columns."""
        found, at = {}, self.base
        for cause in self.causes:
            found[cause.label] = np.arange(at, at + cause.count)
            at += cause.count
        return found

    @cached_property
    def prior_information(self) -> np.ndarray:
        """K [C], the diagonal of the prior information on x: 1, a standard deviation of one unit;
        HELD_INFORMATION of a cause that has no nominal size of its own, as it is an alias of
        coefficients or of another cause."""
        whole = np.ones(len(self.unit))
        for cause in self.causes:
            if not cause.nominal:
                whole[self.indices[cause.label]] = HELD_INFORMATION
        return whole

    def numbers(self, given: Mapping[str, np.ndarray]) -> np.ndarray:
        """q of all causes, SI, from those of some (label → q); zero for the others."""
        whole = np.zeros(self.linearised)
        for label, values in given.items():
            whole[self.indices[label]] = values
        return whole[self.base :]
