"""What a nominal campaign says of a trial's numbers: their prior.

Voyages of one ship differ, and parts of one voyage differ: each voyage has numbers θ + c and each
of its parts θ + c + b (nested random effects: Laird & Ware 1982). How far parts differ is estimated
in `voyage_effects`. Two more numbers predict each nominal voyage best from the others: how far
voyages differ in that unit, and the weight of a voyage. A trial is further voyages of the ship.
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
    """Information [C, C] and pull [C] on a trial's numbers: the posterior of the nominal parts,
    which count for `share` of themselves, widened by a `deviation` [C] of their own.

    parts   products [1 + C, 1 + C] of each part or voyage, its own numbers integrated out
    known   [C] information on the numbers before any data; `anchor` [C] what it pulls towards
    """
    total = share * sum(parts, np.zeros((len(known) + 1,) * 2))
    covariance = np.linalg.inv(total[1:, 1:] + np.diag(known))
    mean = covariance @ (total[1:, 0] + anchor)
    information = np.linalg.inv(covariance + np.diag(deviation**2))
    return information, information @ mean


def of_voyages(
    parts: Sequence[np.ndarray], voyages: np.ndarray, deviation: np.ndarray,
    within: np.ndarray | None = None,
) -> tuple[list[np.ndarray], list[float]]:  # fmt: skip
    """Products [1 + C, 1 + C] of each voyage, numbers of its own with that `deviation` [C]
    integrated out, and log|I + D^½ M D^½| of each.

    parts     products of each part; `voyages` of each
    within    [C] deviation of a part's own numbers, where they are not integrated out yet; their
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
    """How far voyages are from each other, in deviations of their parts, and how much of itself a
    voyage counts (a power posterior: Grünwald & van Ommen 2017).

    One voyage alone says nothing of this: all of `VOYAGE_SPREADS` stay as likely as before.
    """
    known = effects.size**-2.0
    count = len(np.unique(voyages))
    best, chosen = -np.inf, (float(np.sqrt(np.mean(np.square(VOYAGE_SPREADS)))), 1.0)
    tried = [of_voyages(parts, voyages, apart * effects.deviation) for apart in VOYAGE_SPREADS]
    for share in INFORMATION_SHARES if count > 1 else ():
        scores = np.zeros(len(VOYAGE_SPREADS))
        for i, (each, volumes) in enumerate(tried):
            for left, (gram, volume) in enumerate(zip(each, volumes, strict=True)):
                kept = [g for j, g in enumerate(each) if j != left]
                given = prior(kept, known, anchor, np.zeros(len(known)), share)
                scores[i] += marginal(gram, *given) - 0.5 * volume
        whole = float(np.logaddexp.reduce(scores))
        if whole < best:
            break
        weight = np.exp(scores - whole)
        best, chosen = whole, (float(np.sqrt(weight @ np.square(VOYAGE_SPREADS))), share)
    return chosen
