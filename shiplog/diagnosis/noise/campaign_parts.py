"""Parts of a campaign, the products G = Σ_s w_s G_s of their segments, and their evidence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis.noise.likelihood import Modes

ROBUST = 6.0  # medians of χ², from which on a segment counts less
PART = 20  # segments of one part of a campaign: 10 minutes of a three-metre ship
FEWEST_PARTS = 4  # parts that a campaign is cut into, where it has twice as many segments


def parts_of(voyage: np.ndarray, part: int = PART, fewest: int = FEWEST_PARTS) -> list[np.ndarray]:
    """Rows of contiguous segments that belong together: no part crosses two voyages.

    voyage   [S] of each segment, in order
    """
    while True:
        found: list[np.ndarray] = []
        for name in dict.fromkeys(voyage.tolist()):
            rows = np.flatnonzero(voyage == name)
            found += np.array_split(rows, max(round(len(rows) / part), 1))
        if len(found) >= fewest or part <= 2 or len(voyage) < 2 * fewest:
            return found
        part = part // 2


def picked(modes: Modes, rows: np.ndarray) -> Modes:
    """The segments `rows` of a pass; its volume is not theirs."""
    return replace(
        modes, dd=modes.dd[rows], md=modes.md[rows], felt=modes.felt[rows], axes=modes.axes[rows],
        accelerations=modes.accelerations[rows],
    )  # fmt: skip


def products(
    modes: Modes, parts: Sequence[np.ndarray], unit: np.ndarray,
    weight: np.ndarray | None = None, noise: float = 1.0,
) -> list[np.ndarray]:  # fmt: skip
    """G = diag(1, u) Σ_s w_s G_s(λ) diag(1, u) [1 + C, 1 + C] of each part, its segments s.

    unit     u [C]
    weight   w [S] of each segment; one unless given
    noise    λ, factor of the process noise
    """
    by = np.concatenate(([1.0], unit))
    scale = np.outer(by, by)
    weight = np.ones(len(modes.dd)) if weight is None else weight
    return [picked(modes, rows).total(weight[rows], noise) * scale for rows in parts]


def robust_weights(square: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """w_s = min(1, ROBUST · median(χ²)/χ²_s) [S] of segments with these squares χ² [S]: a few
    segments do not decide. Segments that are not `kept` [S] have none."""
    middle = float(np.median(square[kept])) if kept.any() else 1.0
    weight = np.minimum(1.0, ROBUST * middle / np.maximum(square, 1e-9))
    return np.where(kept, weight, 0.0)


def squares(modes: Modes, numbers: np.ndarray, noise: float = 1.0) -> np.ndarray:
    """χ²_s = (e - J x)ᵀ C_s⁻¹ (e - J x) [S] of numbers x = (d, w) [C + W], SI: of the pass's own
    columns, then of those of accelerations at the nodes. With v = (1, -d) and ψ = -Ψ w,

        χ² = vᵀ Eᵀ E v + Σ ψ (2 M v + f ψ) - Σ (M v + f ψ)² / (f + λ⁻²)

    noise   λ
    """
    x = np.concatenate(([1.0], -numbers))
    v, minus_w = x[: modes.dd.shape[-1]], x[modes.dd.shape[-1] :]
    psi = modes.accelerations @ minus_w
    Mv = modes.md @ v
    square = np.einsum("i,sij,j->s", v, modes.dd, v, optimize=True)
    square += ((2.0 * Mv + modes.felt * psi) * psi).sum(-1)
    return square - ((Mv + modes.felt * psi) ** 2 / (modes.felt + noise**-2.0)).sum(-1)


def marginal(gram: np.ndarray, information: np.ndarray, pull: np.ndarray) -> float:
    """Log evidence [nats] of e = J x + ε, x ~ N(Λ⁻¹ η, Λ⁻¹), ε ~ N(0, C), up to a constant:

        log p(e) = -½ (g₀₀ + ηᵀ Λ⁻¹ η - (g + η)ᵀ (M + Λ)⁻¹ (g + η) + log|M + Λ| - log|Λ|)

    gram          G [1 + C, 1 + C] = [e | J]ᵀ C⁻¹ [e | J], of blocks g₀₀, g = G₁₀ and M = G₁₁
    information   Λ [C, C]
    pull          η [C]

    Raises np.linalg.LinAlgError where a matrix is singular. log|C| is the caller's.
    """
    M_Lambda = gram[1:, 1:] + information
    g_eta = gram[1:, 0] + pull
    square = gram[0, 0] + pull @ np.linalg.solve(information, pull)
    square -= g_eta @ np.linalg.solve(M_Lambda, g_eta)
    return -0.5 * float(square + np.linalg.slogdet(M_Lambda)[1] - np.linalg.slogdet(information)[1])
