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

import itertools
import operator
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from shiplog.diagnosis.noise.campaign_parts import marginal
from shiplog.diagnosis.noise.part_products import Gram
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
    information, pull = G[1:, 1:] + np.diag(known), G[1:, 0] + anchor
    if not deviation.any():
        return information, pull
    V = np.linalg.inv(information)
    m = V @ pull
    Lambda = np.linalg.inv(V + np.diag(deviation**2))
    return Lambda, Lambda @ m


def each_voyage(
    parts: Iterable[Gram], voyages: np.ndarray, deviation: np.ndarray, within: np.ndarray
) -> Iterator[tuple[object, Gram]]:
    """v and G_v = Σ_i G_vi [1 + C, 1 + C] of one voyage after another, its parts' numbers
    b ~ N(0, diag(within²)) and its own c ~ N(0, diag(deviation²)) integrated out
    (`voyage_effects.reduced`); to the volumes of the parts each adds log|I + D^½ M D^½|.

    parts    G_vi, products of each part as they are made: one voyage's are held at a time
    voyages  v of each, those of one voyage after each other
    """
    of_parts = zip(voyages.tolist(), parts, strict=True)
    for name, grouped in itertools.groupby(of_parts, key=operator.itemgetter(0)):
        own = [one for _, one in grouped]
        spread, volume = deviation, sum(one.volume for one in own)
        if len(own) == 1:  # both are of one part: their sum is a Gaussian, too
            spread, total = np.hypot(deviation, within), own[0].G
        else:
            total = np.zeros_like(own[0].G)
            for one in own:
                gram, more = reduced(one.G, within)
                total += gram
                volume += more
        gram, more = reduced(total, spread)
        yield name, Gram(gram, volume + more)


def reduce_voyages(
    parts: Sequence[np.ndarray], voyages: np.ndarray, deviation: np.ndarray,
    within: np.ndarray | None = None,
) -> tuple[list[np.ndarray], list[float]]:  # fmt: skip
    """G_v [1 + C, 1 + C] of each voyage and log|I + D^½ M D^½| of each, as `each_voyage` has them,
    in the order of v.

    within   none where the parts' own numbers b are integrated out already
    """
    within = np.zeros_like(deviation) if within is None else within
    order = np.argsort(voyages, kind="stable")
    given = (Gram(parts[i], 0.0) for i in order)
    found = [one for _, one in each_voyage(given, voyages[order], deviation, within)]
    return [one.G for one in found], [one.volume for one in found]


def learn(
    parts: Sequence[np.ndarray], voyages: np.ndarray, effects: VoyageEffects, anchor: np.ndarray,
    shares: Sequence[float] = INFORMATION_SHARES,
) -> tuple[float, float]:  # fmt: skip
    """a, how far voyages are from each other in deviations of their parts, and κ, how much of
    itself a voyage counts (a power posterior: Grünwald & van Ommen 2017).

        score(a, κ) = Σ_v log p(e_v | the other voyages; a, κ)      `marginal`, with `prior`
        κ = argmax log Σ_a exp score(a, κ),   a² = Σ_a p(a | κ) a²,  p(a | κ) ∝ exp score(a, κ)

    over VOYAGE_SPREADS and `shares`, from the first on while the sum grows. The others are the
    total less one's own, so that it takes a time in proportion to the voyages. One voyage alone
    says nothing of this: all of `VOYAGE_SPREADS` stay as likely as before.

    parts   G [1 + C, 1 + C] of each part, its own numbers integrated out; `voyages` v of each
    anchor  η [C]
    """
    K = effects.size**-2.0
    count = len(np.unique(voyages))
    best, chosen = -np.inf, (float(np.sqrt(np.mean(np.square(VOYAGE_SPREADS)))), shares[0])
    tried = [reduce_voyages(parts, voyages, apart * effects.deviation) for apart in VOYAGE_SPREADS]
    for share in shares if count > 1 else ():
        scores = np.zeros(len(VOYAGE_SPREADS))
        for i, (each, volumes) in enumerate(tried):
            total = sum(each, np.zeros_like(each[0]))
            for gram, volume in zip(each, volumes, strict=True):
                given = prior([total - gram], K, anchor, np.zeros(len(K)), share)
                scores[i] += marginal(gram, *given) - 0.5 * volume
        whole = float(np.logaddexp.reduce(scores))
        if whole < best:
            break
        weight = np.exp(scores - whole)
        best, chosen = whole, (float(np.sqrt(weight @ np.square(VOYAGE_SPREADS))), share)
    return chosen
