"""The ship's outline, to scale, where it was."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

OUTLINE = np.array(  # (ahead, starboard) in ship lengths and breadths: a transom and a pointed bow
    [(0.5, 0.0), (0.28, 0.5), (-0.42, 0.5), (-0.5, 0.38), (-0.5, -0.38), (-0.42, -0.5),
     (0.28, -0.5), (0.5, 0.0)]
)  # fmt: skip
ROUND_S = (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600)  # s between hulls


def outline(length: float, breadth: float, own: Sequence[tuple[float, float]] = ()) -> np.ndarray:
    """[K, 2] (ahead, starboard) of midship [m], closed: the ship's own, or one like it."""
    if not own:
        return OUTLINE * (length, breadth)
    return np.array([*own, own[0]], dtype=float)


def placed(shape: np.ndarray, x0: np.ndarray, y0: np.ndarray, heading: np.ndarray) -> np.ndarray:
    """[n, K, 2] (east, north) of the outline [K, 2] at each place [n] with its heading ψ [rad]:

    north = x₀ + a cos ψ - s sin ψ,   east = y₀ + a sin ψ + s cos ψ
    """
    a, s = shape.T
    sin, cos = np.sin(heading)[:, None], np.cos(heading)[:, None]
    return np.stack((y0[:, None] + a * sin + s * cos, x0[:, None] + a * cos - s * sin), axis=-1)


def interval(seconds: float, sailed: float, length: float, most: int) -> float:
    """The round number of seconds between hulls: at most so many, and a length apart."""
    count = min(max(sailed / max(length, 1e-9), 1.0), most)
    least = seconds / count
    return float(next((c for c in ROUND_S if c >= least), 3600 * math.ceil(least / 3600)))
