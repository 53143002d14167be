"""Parts of a campaign, weights of their segments, and the evidence of their products
(`part_products`)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.noise import likelihood
from shiplog.diagnosis.noise.likelihood import ProcessNoise

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


def robust_weights(square: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """w_s = min(1, ROBUST · median(χ²)/χ²_s) [S] of segments with these squares χ² [S]: a few
    segments do not decide. Segments that are not `kept` [S] have none."""
    middle = float(np.median(square[kept])) if kept.any() else 1.0
    weight = np.minimum(1.0, ROBUST * middle / np.maximum(square, 1e-9))
    return np.where(kept, weight, 0.0)


def squares(
    linear: Linear, nominal: ProcessNoise, process_noise: ProcessNoise | None = None
) -> np.ndarray:
    """χ²_s = eᵀ C_s⁻¹ e [S], of what is left of a pass: `Linear.less_numbers` for some.

    nominal        instruments and start; process_noise, where it is not the same
    """
    alone = replace(linear, j=linear.j[..., :0])
    passed = likelihood.startless(likelihood.weighed(alone, nominal), nominal)
    return passed.square(process_noise or nominal)[0]


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
