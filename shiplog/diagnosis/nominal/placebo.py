"""Placebo: what each hypothesis explains of nominal voyages, held out in turn.

A cause that explains a nominal voyage, which nothing has changed, explains misfit. What it gains
there at most is subtracted from what it gains on the trial.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shiplog.diagnosis.noise.remainder import CHANGE_SIZES
from shiplog.diagnosis.nominal.nominal_campaign import Campaign


def placebos(campaign: Campaign) -> Mapping[str, float]:
    """Label or family → its largest log Bayes factor on one nominal voyage, at least 0, in nats."""
    columns, share = campaign.reference.columns, campaign.reference.counts
    tested: dict[str, tuple[np.ndarray, tuple[float, ...]]]
    tested = {label: (at, (1.0,)) for label, at in columns.of.items()}
    for family in (*campaign.discrepancy.families, *campaign.unseen.families):
        tested[family.name] = (family.columns, CHANGE_SIZES)
    most = dict.fromkeys(tested, 0.0)
    for left_out, gram in enumerate(campaign.voyages):
        information, pull = campaign.prior_without(left_out)
        count = len(pull)
        gram = share * gram
        both = gram[1 : 1 + count, 1 : 1 + count] + information
        inverse = np.linalg.inv(both)
        solution = inverse @ (gram[1 : 1 + count, 0] + pull)
        for name, (at, sizes) in tested.items():
            joined = gram[1 : 1 + count, 1 + at]
            towards = gram[1 + at, 0] - joined.T @ solution
            own = gram[np.ix_(1 + at, 1 + at)] - joined.T @ inverse @ joined
            gained = max(_gained(own, towards, size) for size in sizes)
            most[name] = max(most[name], gained)
    return most


def _gained(own: np.ndarray, towards: np.ndarray, size: float) -> float:
    whole = size**2 * own + np.eye(len(own))
    gained = 0.5 * size**2 * float(towards @ np.linalg.solve(whole, towards))
    return gained - 0.5 * float(np.linalg.slogdet(whole)[1])
