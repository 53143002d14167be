"""Columns of segments whose slopes another program has worked out: JAX, of a network."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shiplog.simulation.kernel import kinds
from shiplog.simulation.kernel.kinds import aligned, contiguous, pointer
from shiplog.simulation.kernel.paths import begun_by, moving
from shiplog.simulation.kernel.segments import COUNTS, GIVEN, Segments
from shiplog.simulation.kernel.windows import STATES, Sizes


def columns(
    states: np.ndarray,
    slopes: Sequence[np.ndarray],
    hats: np.ndarray,
    step: float,
    bins: int,
    moved: tuple[np.ndarray, np.ndarray, int] | None,
) -> tuple[np.ndarray, np.ndarray]:
    """z [S, B, 6, 6 + 3J] and j [S, B, 6, C] of the path `states` [S, K, 6]; `slopes` are
    ∂f/∂x [S, K, 3, 6], ∂f/∂u [S, K, 3, D] and ∂f/∂θ [S, K, 3, C]; the others as in
    `paths.columns`."""
    by_state, by_driven, by_theta = slopes
    count, instants = states.shape[:2]
    nodes, of_j = hats.shape[1], by_theta.shape[-1]
    sizes = Sizes(by_driven.shape[-1], of_j, STATES + by_driven.shape[-1])

    def write(module):
        Segments(module, sizes).write_given("columns_of")

    kernel = kinds.plain(
        f"given slopes {sizes.driven} {of_j}", write,
        (("columns_of", "p" * len(GIVEN) + "i" * len(COUNTS) + "d"),),
    )  # fmt: skip
    heading = states[..., 4:5]
    whole = np.concatenate(
        (
            np.zeros((count, instants, 3)), np.cos(heading), np.sin(heading),
            np.concatenate((by_state, by_driven), -1).reshape(count, instants, -1),
            by_theta.reshape(count, instants, -1),
        ), -1,
    )  # fmt: skip
    pairs, series, causes = moving(moved, count, instants, sizes.driven, of_j)
    of_z = STATES + 3 * nodes
    z, j = np.empty((count, bins, STATES, of_z)), np.empty((count, bins, STATES, of_j))
    arrays = {
        "slopes": contiguous(whole), "states": contiguous(states), "hats": contiguous(hats),
        "begun": begun_by(hats), "moved": series, "pairs": pairs, "z": z, "j": j,
        "work": aligned(4 * STATES * (of_z + of_j) * kernel.lanes),
    }  # fmt: skip
    counts = {
        "S": count, "K": instants, "bins": bins, "per": (instants - 1) // bins, "J": nodes,
        "C": of_j, "Q": causes, "n": len(pairs),
    }  # fmt: skip
    if count:
        run = kernel.functions["columns_of"]
        run(*(pointer(arrays[n]) for n in GIVEN), *(counts[n] for n in COUNTS), step)
    return z, j
