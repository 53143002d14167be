"""Coefficients of a run as the diagnosis starts from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Start:
    """Coefficients of the base [P] as the run has them, how far off they may be, and their range.

    The run's own values hold them, and not what was known before any data: what these say nothing
    of stays, and all is linear about where the ship is.
    """

    values: np.ndarray
    spread: np.ndarray
    low: np.ndarray
    high: np.ndarray
