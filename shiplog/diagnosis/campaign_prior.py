"""What a nominal campaign says of a trial's numbers: their prior.

The parts of a campaign have numbers of their own (`voyage_effects`). A trial is another campaign:
as a whole it may differ from the nominal one, by less or as much as parts of one campaign differ.
How much it differs, and how much of itself it counts, is what predicts each nominal voyage best
from the others.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from shiplog.diagnosis import nominal_reference
from shiplog.diagnosis.voyage_effects import VoyageEffects

APART = (0.0, 0.25, 0.5, 1.0)  # of a campaign, in deviations of its parts; each as likely
SHARES = (1.0, 0.5, 0.25, 0.12, 0.06, 0.03)


def prior(
    parts: Sequence[np.ndarray], known: np.ndarray, anchor: np.ndarray, deviation: np.ndarray,
    share: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Information [C, C] and pull [C] on a trial's numbers: the posterior of the nominal parts,
    which count for `share` of themselves, widened by one campaign's own `deviation` [C].

    parts   products [1 + C, 1 + C] of each part, its own numbers integrated out
    known   [C] information on the numbers before any data; `anchor` [C] what it pulls towards
    """
    total = share * sum(parts, np.zeros((len(known) + 1,) * 2))
    covariance = np.linalg.inv(total[1:, 1:] + np.diag(known))
    mean = covariance @ (total[1:, 0] + anchor)
    information = np.linalg.inv(covariance + np.diag(deviation**2))
    return information, information @ mean


def learn(
    parts: Sequence[np.ndarray], voyages: np.ndarray, effects: VoyageEffects, anchor: np.ndarray
) -> tuple[float, float]:
    """How far a campaign as a whole is from another, in deviations of its parts, and how much of
    itself a trial counts (a power posterior: Grünwald & van Ommen 2017).

    voyages   of each part. Every voyage is predicted from the others, as if it were a campaign. One
              voyage alone says nothing of this: all of `APART` stay as likely as before.
    """
    known = effects.size**-2.0
    names = np.unique(voyages)
    best, chosen = -np.inf, (float(np.sqrt(np.mean(np.square(APART)))), 1.0)
    for share in SHARES if len(names) > 1 else ():
        scores = np.zeros(len(APART))
        for name in names:
            left = sum(g for g, v in zip(parts, voyages, strict=True) if v == name)
            kept = [g for g, v in zip(parts, voyages, strict=True) if v != name]
            for i, apart in enumerate(APART):
                given = prior(kept, known, anchor, apart * effects.deviation, share)
                scores[i] += nominal_reference.marginal(left, *given)
        whole = float(logsumexp(scores))
        if whole < best:
            break
        weight = np.exp(scores - whole)
        best, chosen = whole, (float(np.sqrt(weight @ np.square(APART))), share)
    return chosen
