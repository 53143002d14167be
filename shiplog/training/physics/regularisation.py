"""How firmly the ridge holds: chosen on voyages that no fit has used, where there are any.

A network learns until its error on the validation voyages rises. An identification has no epochs;
what keeps it from learning its own voyages by heart is the ridge, and its firmness is chosen on
the same voyages: φ of the ridge Σ_i ((θ_i - θ₀_i)/(φ s_i))².
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from shiplog.training.physics.cross_validation import as_good
from shiplog.training.physics.output_error import Identified

PLAUSIBLE = 1.0  # the spreads as they are published or estimated


def ladder(
    fit: Callable[[float, np.ndarray | None], Identified], factors: Sequence[float]
) -> dict[float, Identified]:
    """θ̂(φ): an identification for each factor φ on the spreads, the plausible ones among them.

    fit   gets the factor and where to begin: each begins where its neighbour nearer to 1 ended
    """
    found = {PLAUSIBLE: fit(PLAUSIBLE, None)}
    looser = sorted(f for f in factors if f > PLAUSIBLE)
    firmer = sorted((f for f in factors if f < PLAUSIBLE), reverse=True)
    for side in (looser, firmer):
        begin = found[PLAUSIBLE].values
        for factor in side:
            found[factor] = fit(factor, begin)
            begin = found[factor].values
    return dict(sorted(found.items()))


def choose(judged: dict[float, np.ndarray]) -> float:
    """argmin |log φ| of the factors that are not worse than the best by more than chance.

    judged   factor → L of each validation window [N]; 1 where fewer than two can be judged

    The plausible spreads say something before any voyage does. A few windows, often of one voyage,
    overrule them only where they are sure of it; of two as near, the firmer one.
    """
    good = as_good(judged) or [PLAUSIBLE]
    return min(good, key=lambda factor: (round(abs(math.log(factor)), 9), factor))
