"""Placebo: what each hypothesis explains of nominal voyages, held out in turn.

A cause that explains a nominal voyage, which nothing has changed, explains misfit. What it gains
there at most is subtracted from what it gains on the trial. With the prior N(Λ⁻¹ η, Λ⁻¹) of the
other voyages and a voyage's products G (g, M; rows a of a cause, of size s), its numbers added to
the nominal ones have

    A = M_aa - M_a (M + Λ)⁻¹ M_aᵀ,   t = g_a - M_a (M + Λ)⁻¹ (g + η)
    log Bayes factor = ½ s² tᵀ (s² A + I)⁻¹ t - ½ log|s² A + I|

A misfit that all voyages have alike is hardly seen in one of them, and a trial is several. Of all
voyages together, with one number for them, A and t are the sums of each one's.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shiplog.diagnosis.noise.remainder import CHANGE_SIZES
from shiplog.diagnosis.nominal.nominal_campaign import Campaign


def placebos(campaign: Campaign) -> Mapping[str, float]:
    """Label or family → max over nominal voyages, and all of them together, and over sizes s of its
    log Bayes factor ½ s² tᵀ (s² A + I)⁻¹ t - ½ log|s² A + I|, at least 0, in nats. A voyage counts
    as much of itself as a trial.
    """
    columns, share = campaign.reference.columns, campaign.reference.counts
    tested: dict[str, tuple[np.ndarray, tuple[float, ...]]]
    tested = {label: (at, (1.0,)) for label, at in columns.indices.items()}
    for family in (*campaign.discrepancy.families, *campaign.omitted.families):
        tested[family.name] = (family.columns, CHANGE_SIZES)
    most = dict.fromkeys(tested, 0.0)
    together = {name: (np.zeros((len(at),) * 2), np.zeros(len(at)))
                for name, (at, _) in tested.items()}  # fmt: skip
    for left_out, gram in enumerate(campaign.voyages):
        information, pull = campaign.prior_without(left_out)
        count = len(pull)
        gram = share * gram
        M_Lambda = gram[1 : 1 + count, 1 : 1 + count] + information
        V = np.linalg.inv(M_Lambda)
        x = V @ (gram[1 : 1 + count, 0] + pull)
        for name, (at, sizes) in tested.items():
            M_xa = gram[1 : 1 + count, 1 + at]
            t = gram[1 + at, 0] - M_xa.T @ x
            A = gram[np.ix_(1 + at, 1 + at)] - M_xa.T @ V @ M_xa
            most[name] = max(most[name], *(_log_bayes_factor(A, t, size) for size in sizes))
            together[name][0][:] += A
            together[name][1][:] += t
    for name, (A, t) in together.items():
        most[name] = max(most[name], *(_log_bayes_factor(A, t, s) for s in tested[name][1]))
    return most


def _log_bayes_factor(A: np.ndarray, t: np.ndarray, size: float) -> float:
    """½ s² tᵀ (s² A + I)⁻¹ t - ½ log|s² A + I|, nats: of numbers ~ N(0, s² I) over zero."""
    whole = size**2 * A + np.eye(len(A))
    explained = 0.5 * size**2 * float(t @ np.linalg.solve(whole, t))
    return explained - 0.5 * float(np.linalg.slogdet(whole)[1])
