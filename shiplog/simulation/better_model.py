"""The probability that one model is better than another on new voyages, of their L on the same
tested windows: on voyages like these, and under other conditions.

    like these    P = T_{K-1}((R_B - R_A)/(s²/K)^½)
    elsewhere     P = T_{K-1}((R_B - R_A)/(s²/K + c (δ_A² + δ_B²))^½)

R_m is a model's mean L, T_{K-1} Student's distribution, and s² the variance of L_B - L_A between K
blocks: voyages, or stretches of windows where voyages are few. Neighbouring windows are alike, and
a block counts once. The 90 % interval of P is that of other voyages as these: of its statistic z,
z ± 1.645 (1 + z²/(2 (K - 1)))^½ (Johnson & Welch 1940).

Elsewhere has the form of the empirical model discrepancy of René & Longtin (2025): the risk of a
model on new data is uncertain by as much as its losses are distributed otherwise than the model
itself led to expect. q̂ is the quantile function of ln L on the tested windows, q̃ of that which the
model expected (of its held-out voyages), h how much harder both models found the tested voyages:

    h = ½ Σ_m (mean ln L_m - mean ln L̃_m),   δ_m = R_m ∫₀¹ |q̂_m - h - q̃_m| dΦ

Two campaigns of normal shifts lie E|Δ| = σ(2/π)^½ apart in the mean, so that σ² = c E|Δ|² with
c = π/2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy.special import stdtr, stdtrit

from shiplog.nomenclature.numbers import NINETY_SPREADS
from shiplog.simulation.error_reduction import BLOCK_WINDOWS, RUNAWAY

FEWEST_VOYAGES = 5  # from which a voyage is one block; of fewer, BLOCK_WINDOWS windows in a row are
FEWEST_BLOCKS = 3  # fewer say nothing of how blocks differ
DISCREPANCY = math.pi / 2.0  # c
QUANTILES = 200  # steps of Φ
LEAST_LOSS = 1e-9  # L of a window that a model fits exactly, for its logarithm


@dataclass(frozen=True, slots=True)
class Better:
    """P that run `a` has a smaller mean L than run `b` on new voyages like the tested ones.

    low, high    90 % interval of that probability
    elsewhere    P under conditions as far from the tested ones as these are from those that the
                 runs had been tested in before; None where a run does not say what L it expects
    share        R_a/R_b on the tested windows; share_low and share_high: 90 % on voyages like them
    """

    a: str
    b: str
    probability: float
    low: float
    high: float
    elsewhere: float | None
    share: float
    share_low: float
    share_high: float
    windows: int
    blocks: int

    def as_json(self) -> dict:
        return asdict(self)


def better(
    names: tuple[str, str],
    losses: tuple[np.ndarray, np.ndarray],
    voyages: Sequence[str],
    expected: tuple[np.ndarray | None, np.ndarray | None] = (None, None),
) -> Better | None:
    """P of L of both runs on the same windows [N]; None where these are fewer than FEWEST_BLOCKS
    blocks, or where no window ends with either.

    expected   L on windows that no fit has used, of each run
    """
    kept = np.isfinite(losses[0]) | np.isfinite(losses[1])
    a, b = (np.where(np.isfinite(loss), np.minimum(loss, RUNAWAY), RUNAWAY)[kept]
            for loss in losses)  # fmt: skip
    blocks = _blocks([v for v, keep in zip(voyages, kept, strict=True) if keep])
    if len(blocks) < FEWEST_BLOCKS:
        return None
    K = len(blocks)
    mean, squared = _difference(a, b, blocks)
    z, deviation = mean / math.sqrt(squared), math.sqrt(squared)
    error = math.sqrt(1.0 + z**2 / (2.0 * (K - 1)))
    low, probability, high = (
        float(stdtr(K - 1, z + side * NINETY_SPREADS * error)) for side in (-1.0, 0.0, 1.0)
    )
    expects = [e[np.isfinite(e)] for e in expected if e is not None]
    elsewhere = None
    if len(expects) == 2 and min(map(len, expects)) >= FEWEST_BLOCKS:
        apart = sum(d**2 for d in _discrepancies((a, b), (expects[0], expects[1])))
        elsewhere = float(stdtr(K - 1, mean / math.sqrt(squared + DISCREPANCY * apart)))
    whole = max(float(b.mean()), LEAST_LOSS)
    ratio, wide = float(a.mean()) / whole, float(stdtrit(K - 1, 0.95)) * deviation / whole
    return Better(
        *names, probability, low, high, elsewhere, ratio, max(ratio - wide, 0.0), ratio + wide,
        len(a), K,
    )  # fmt: skip


def _blocks(voyages: Sequence[str]) -> list[np.ndarray]:
    """Indices of the windows of each block; none joins two voyages."""
    of = [np.flatnonzero(np.array(voyages) == name) for name in dict.fromkeys(voyages)]
    if len(of) >= FEWEST_VOYAGES:
        return of
    return [one[i : i + BLOCK_WINDOWS] for one in of for i in range(0, len(one), BLOCK_WINDOWS)]


def _difference(a: np.ndarray, b: np.ndarray, blocks: Sequence[np.ndarray]) -> tuple[float, float]:
    """R_B - R_A over the blocks, and s²/K; each block weighs as its windows."""
    weights = np.array([len(one) for one in blocks], dtype=float)
    weights /= weights.sum()
    differences = np.array([(b[one] - a[one]).mean() for one in blocks])
    mean, K = float(weights @ differences), len(blocks)
    squared = float((weights**2 * (differences - mean) ** 2).sum()) * K / max(K - 1, 1)
    return mean, max(squared, LEAST_LOSS**2)


def _discrepancies(
    tested: tuple[np.ndarray, np.ndarray], expected: tuple[np.ndarray, np.ndarray]
) -> list[float]:
    """δ_m of both models."""
    logs = [(np.log(np.maximum(t, LEAST_LOSS)), np.log(np.maximum(e, LEAST_LOSS)))
            for t, e in zip(tested, expected, strict=True)]  # fmt: skip
    harder = float(np.mean([t.mean() - e.mean() for t, e in logs]))
    phi = (np.arange(QUANTILES) + 0.5) / QUANTILES
    return [
        float(loss.mean() * np.abs(np.quantile(t, phi) - harder - np.quantile(e, phi)).mean())
        for loss, (t, e) in zip(tested, logs, strict=True)
    ]
