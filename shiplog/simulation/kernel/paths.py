"""Segments of a diagnosis by the kernel of their kind of ship: arrays in, arrays out."""

from __future__ import annotations

from typing import Any

import numpy as np

from shiplog.simulation.kernel import kinds
from shiplog.simulation.kernel.kinds import Purpose, aligned, contiguous, pointer
from shiplog.simulation.kernel.segments import COUNTS, POINTERS, Segments
from shiplog.simulation.kernel.windows import STATES


def _write(module: Any, sizes: Any) -> None:
    Segments(module, sizes["along"]).write("paths_of", "along", numbers=False)
    Segments(module, sizes["around"]).write("columns_of", "around", numbers=True)


_LETTERS = "p" * len(POINTERS) + "i" * len(COUNTS) + "d"
SEGMENTS = Purpose(
    "segments",
    _write,
    (("along", "state"), ("around", "all")),
    (("paths_of", _LETTERS), ("columns_of", _LETTERS)),
)


def columns(
    model: Any,
    theta: np.ndarray,
    start: np.ndarray,
    acceleration: np.ndarray,
    driven: np.ndarray,
    hats: np.ndarray,
    step: float,
    bins: int,
    moved: tuple[np.ndarray, np.ndarray, int] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None] | None:
    """Means of the path over bins y [S, B, 6], and of its derivatives by start and nodes
    z [S, B, 6, 6 + 3J] and, where `moved` is given, by θ j [S, B, 6, C]. None where JAX has to do
    it.

    start         [S, 6]
    acceleration  [S, K, 3]  added at each instant, m/s² and rad/s²
    driven        [S, K, D]  actuators, share of the campaign, true wind
    hats          [K, J]     of the nodes, in the order in which they begin
    step          s between instants
    moved         pairs [n, 2] of what drives d and number q, ∂u_d/∂q as series [S, n, K], and how
                  many numbers Q: the last of θ
    """
    kernel = kinds.kernel(model, SEGMENTS, driven.shape[2], len(theta))
    if kernel is None:
        return None
    count, instants, nodes = len(start), len(hats), hats.shape[1]
    pairs, series, causes = moving(moved, count, instants, driven.shape[2], len(theta))
    of_z, of_j = STATES + 3 * nodes, len(theta) if moved is not None else 0
    y, z = np.empty((count, bins, STATES)), np.empty((count, bins, STATES, of_z))
    j = np.empty((count, bins, STATES, of_j))
    arrays = {
        "c": kernel.prepared(model, theta), "start": contiguous(start, count, STATES),
        "acceleration": contiguous(acceleration, count, instants, 3),
        "driven": contiguous(driven, count, instants, driven.shape[2]),
        "hats": contiguous(hats), "begun": begun_by(hats), "moved": series, "pairs": pairs,
        "y": y, "z": z, "j": j,
        "work": aligned(4 * STATES * (of_z + of_j) * kernel.lanes),
    }  # fmt: skip
    counts = {
        "S": count, "K": instants, "bins": bins, "per": (instants - 1) // bins, "J": nodes,
        "C": of_j, "Q": causes, "n": len(pairs),
    }  # fmt: skip
    if count:
        run = kernel.functions["paths_of" if moved is None else "columns_of"]
        run(*(pointer(arrays[n]) for n in POINTERS), *(counts[n] for n in COUNTS), step)
    return y, z, j if moved is not None else None


def moving(
    moved: tuple[np.ndarray, np.ndarray, int] | None,
    count: int,
    instants: int,
    driving: int,
    coefficients: int,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Pairs, series and Q as the loops take them; none of them for None. Raises ValueError for
    pairs of what does not drive or is no number, and for series of other segments."""
    if moved is None:
        return np.zeros((0, 2), np.int64), np.zeros((count, 0, instants)), 0
    pairs, causes = np.ascontiguousarray(moved[0], dtype=np.int64).reshape(-1, 2), moved[2]
    known = (pairs >= 0) & (pairs < (driving, causes))
    if not known.all() or not 0 <= causes <= coefficients:
        raise ValueError(f"pairs go beyond {driving} inputs or {causes} numbers")
    return pairs, contiguous(moved[1], count, len(pairs), instants), causes


def begun_by(hats: np.ndarray) -> np.ndarray:
    """How many nodes have begun at each instant [K]."""
    count = hats.shape[1]
    last = ((hats != 0.0) * np.arange(1, count + 1)).max(1, initial=0)
    return np.maximum.accumulate(last).astype(np.int64)
