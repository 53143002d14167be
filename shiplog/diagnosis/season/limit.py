"""When a trend passes a limit: the date at which μ_G + β t = x*, over draws of both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis.season.pooling import Pooled, Voyages

QUANTILES = (0.05, 0.5, 0.95)
NEVER_DAYS = 3652.5  # ten years: a date beyond is not said


@dataclass(frozen=True)
class Passing:
    """When the trend passes a limit, as days on the axis of `Voyages.days`.

    low, value, high   5, 50 and 95 % of the draws; None where the limit is not passed within
                       NEVER_DAYS of the last voyage
    passed             probability that it is passed at the last voyage already
    ever               probability that it is passed within NEVER_DAYS
    """

    low: float | None
    value: float | None
    high: float | None
    passed: float
    ever: float


def passing(of: Voyages, pooled: Pooled, limit: float) -> Passing:
    """Of the first number, in units: from the side of 0, where the cause is absent, to x* = `limit`
    and beyond.

        t* = (x* - μ_G)/β,   date = middle + t* span;   never where β goes away from the limit
    """
    way = -1.0 if limit < 0.0 else 1.0
    level, slope = way * pooled.levels[:, -1, 0], way * pooled.slope[:, 0]
    last = float(of.days.max())
    now = level + slope * (last - of.middle) / max(of.span, 1e-12)
    passed = now >= way * limit
    with np.errstate(divide="ignore", invalid="ignore"):
        date = of.middle + of.span * (way * limit - level) / slope
    date = np.where(slope > 0.0, date, np.inf)
    date = np.where(passed & ~np.isfinite(date), last, date)
    date[date > last + NEVER_DAYS] = np.inf
    # a quantile of which a part is never is never
    ends = np.quantile(date, QUANTILES, method="higher")
    low, value, high = (float(one) if np.isfinite(one) else None for one in ends)
    return Passing(low, value, high, float(passed.mean()), float(np.isfinite(date).mean()))
