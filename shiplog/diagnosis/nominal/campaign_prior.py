"""What a nominal campaign says of a trial's numbers: their prior.

Voyages of one ship differ, and parts of one voyage differ: each voyage has numbers x + c and each
of its parts x + c + b (nested random effects: Laird & Ware 1982), b ~ N(0, D), c ~ N(0, a² D). How
far parts differ, D, is estimated in `voyage_effects`. Two more numbers predict each nominal voyage
best from the others: how far voyages differ in that unit, a, and the weight of a voyage, κ. A trial
is further voyages of the ship, with c and b of their own and the same x:

    x ~ N(m, V + diag(δ²)),   V = (K + κ Σ_v M_v)⁻¹,   m = V (η + κ Σ_v g_v)

δ is the deviation of numbers of a trial that are not integrated out of its products.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shiplog.diagnosis.noise.campaign_parts import marginal
from shiplog.diagnosis.nominal.voyage_effects import VoyageEffects, reduced

VOYAGE_SPREADS = (0.0, 0.25, 0.5, 1.0)  # of voyages, in deviations of their parts; each as likely
INFORMATION_SHARES = (1.0, 0.5, 0.25, 0.12, 0.06, 0.03)


def prior(
    parts: Sequence[np.ndarray], known: np.ndarray, anchor: np.ndarray, deviation: np.ndarray,
    share: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Information Λ = (V + diag(δ²))⁻¹ [C, C] and pull Λ m [C] on a trial's numbers, with
    V = (K + κ Σ M)⁻¹ and m = V (η + κ Σ g): the posterior of the nominal parts, widened.

    parts      G [1 + C, 1 + C], of blocks g₀₀, g and M, of each part or voyage, its own numbers
               integrated out
    known      K [C], information on the numbers before any data; `anchor` η [C], its pull
    deviation  δ [C], standard deviation of a trial's own numbers
    share      κ, for which the parts count

    Raises np.linalg.LinAlgError where a matrix is singular.
    """
    G = share * sum(parts, np.zeros((len(known) + 1,) * 2))
    V = np.linalg.inv(G[1:, 1:] + np.diag(known))
    m = V @ (G[1:, 0] + anchor)
    Lambda = np.linalg.inv(V + np.diag(deviation**2))
    return Lambda, Lambda @ m


def reduce_voyages(
    parts: Sequence[np.ndarray], voyages: np.ndarray, deviation: np.ndarray,
    within: np.ndarray | None = None,
) -> tuple[list[np.ndarray], list[float]]:  # fmt: skip
    """G_v = Σ_i G_vi [1 + C, 1 + C] of each voyage, its own numbers c ~ N(0, diag(deviation²))
    integrated out (`voyage_effects.reduced`), and log|I + D^½ M D^½| of each.

    parts     G_vi, products of each part; `voyages` v of each
    deviation [C] of c
    within    [C] deviation of a part's own numbers b, where they are not integrated out yet; their
              volume is then in the voyage's
    """
    within = np.zeros_like(deviation) if within is None else within
    found, volumes = [], []
    for name in np.unique(voyages):
        own = [gram for gram, of in zip(parts, voyages, strict=True) if of == name]
        spread, volume = deviation, 0.0
        if len(own) == 1:  # both are of one part: their sum is a Gaussian, too
            spread = np.hypot(deviation, within)
        else:
            each = [reduced(gram, within) for gram in own]
            own, volume = [gram for gram, _ in each], sum(of for _, of in each)
        gram, more = reduced(sum(own[1:], own[0]), spread)
        found.append(gram)
        volumes.append(volume + more)
    return found, volumes


def learn(
    parts: Sequence[np.ndarray], voyages: np.ndarray, effects: VoyageEffects, anchor: np.ndarray
) -> tuple[float, float]:
    """a, how far voyages are from each other in deviations of their parts, and κ, how much of
    itself a voyage counts (a power posterior: Grünwald & van Ommen 2017).

        score(a, κ) = Σ_v log p(e_v | the other voyages; a, κ)      `marginal`, with `prior`
        κ = argmax log Σ_a exp score(a, κ),   a² = Σ_a p(a | κ) a²,  p(a | κ) ∝ exp score(a, κ)

    over VOYAGE_SPREADS and INFORMATION_SHARES, from κ = 1 down while the sum grows. One voyage
    alone says nothing of this: all of `VOYAGE_SPREADS` stay as likely as before.

    parts   G [1 + C, 1 + C] of each part, its own numbers integrated out; `voyages` v of each
    anchor  η [C]
    """
    K = effects.size**-2.0
    count = len(np.unique(voyages))
    best, chosen = -np.inf, (float(np.sqrt(np.mean(np.square(VOYAGE_SPREADS)))), 1.0)
    tried = [reduce_voyages(parts, voyages, apart * effects.deviation) for apart in VOYAGE_SPREADS]
    for share in INFORMATION_SHARES if count > 1 else ():
        scores = np.zeros(len(VOYAGE_SPREADS))
        for i, (each, volumes) in enumerate(tried):
            for left, (gram, volume) in enumerate(zip(each, volumes, strict=True)):
                kept = [g for j, g in enumerate(each) if j != left]
                given = prior(kept, K, anchor, np.zeros(len(K)), share)
                scores[i] += marginal(gram, *given) - 0.5 * volume
        whole = float(np.logaddexp.reduce(scores))
        if whole < best:
            break
        weight = np.exp(scores - whole)
        best, chosen = whole, (float(np.sqrt(weight @ np.square(VOYAGE_SPREADS))), share)
    return chosen
