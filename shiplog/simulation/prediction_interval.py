"""How far off a simulation may be: a band that held-out errors have calibrated.

What a model's own uncertainty (its parameters', or the spread of its seeds) says is too little:
it knows nothing of missing forces. The errors on voyages that no fit has used give
the rest, second by second since the start, and one factor per channel makes nine in ten of them
fall inside.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

BAND_LEVEL = 0.9
# Of the held-out ratios, where voyages are too few for a conformal one
FEW_VOYAGES_QUANTILE = 0.95
SMOOTHED = 11  # s over which the growth of the error is averaged


@dataclass(frozen=True)
class Band:
    """Of rollouts of I samples.

    growth  [I, 6]  root mean square of what the model's own spread leaves unexplained
    factor  [6]     half-width over √(spread² + growth²)
    """

    growth: np.ndarray
    factor: np.ndarray

    def half_width(self, spread: np.ndarray) -> np.ndarray:
        """[N, I, 6] around each simulated state, of the model's own spread [N, I, 6]."""
        return self.factor * np.sqrt(spread**2 + self.growth**2)


def calibrate(
    error: np.ndarray, spread: np.ndarray, groups: int, level: float = BAND_LEVEL
) -> Band:
    """From errors [N, I, 6] of held-out rollouts and the model's own spread there.

    groups   voyages they are of. The quantile is that of a split conformal interval (Vovk et al.
             2005) with each voyage one observation, since the wind and water of a voyage
             affect all of its windows; with few voyages no further than FEW_VOYAGES_QUANTILE.

    Rollouts that diverged are left out: no band would hold them.
    """
    good = (np.abs(error) < 1e6).all((1, 2))
    if not good.any():
        return Band(np.full(error.shape[1:], np.inf), np.ones(error.shape[-1]))
    error, spread = error[good], spread[good]
    square = error**2
    excess = np.maximum((square - spread**2).mean(0), 0.05 * square.mean(0))
    kernel = np.ones(min(SMOOTHED, len(excess) - 1 + len(excess) % 2))  # odd, within the rollout
    norm = np.convolve(np.ones(len(excess)), kernel, "same")
    smooth = np.stack([np.convolve(c, kernel, "same") / norm for c in excess.T], 1)
    growth = np.sqrt(smooth)
    growth[0] = 0.0
    total = np.sqrt(spread[:, 1:] ** 2 + growth[1:] ** 2)
    ratio = np.abs(error[:, 1:]) / np.maximum(total, 1e-12)
    wanted = min(FEW_VOYAGES_QUANTILE, level * (1.0 + 1.0 / max(groups, 1)))
    return Band(growth, np.quantile(ratio.reshape(-1, ratio.shape[-1]), wanted, axis=0))


def coverage(error: np.ndarray, half_width: np.ndarray) -> np.ndarray:
    """Share of the samples [6] of errors [N, I, 6] that lie inside, first samples left out."""
    return (np.abs(error[:, 1:]) <= half_width[:, 1:]).mean((0, 1))


def seeds_spread(simulated: Sequence[np.ndarray]) -> np.ndarray:
    """Standard deviation [N, I, 6] over the seeds of a network; zero for one seed alone."""
    if len(simulated) < 2:
        return np.zeros_like(simulated[0])
    return np.nan_to_num(np.std(np.stack(simulated), axis=0, ddof=1), nan=np.inf)
