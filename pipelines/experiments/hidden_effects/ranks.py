"""Where the truth stands within the intervals that are reported: rank histograms, and coverage at
several levels.

An interval is taken as the 90 % interval of a Gaussian on each side of its value. A verdict may
mean Student's, whose degrees of freedom it does not say: 50 % of a Gaussian are then a little more
than 50 % of what was meant.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from scipy.special import chdtrc, ndtr, ndtri

from pipelines.experiments.hidden_effects.goals import cell, percent
from pipelines.experiments.hidden_effects.parameters import OTHER_FORM
from pipelines.experiments.hidden_effects.score import Answer
from shiplog.report.evaluation import tables

RANKS = 10
LEVELS = (0.5, 0.8, 0.9, 0.95)


def standings(answers: Iterable[Answer]) -> list[float]:
    """(truth - value) in standard deviations, of every interval of a cause that is hidden and
    named; those whose form differs in the simulator are left out, as in the goals."""
    compared = (pair for answer in answers for pair in answer.compared.items())
    return [z for name, one in compared if name not in OTHER_FORM for z in one.standings]


def histogram(standing: Sequence[float]) -> np.ndarray:
    """[RANKS] counts of the truth's rank, floor(RANKS Φ(z)).

    Simulation-based calibration (Talts et al. 2018): where the intervals are right, every rank is
    equally likely. A valley in the middle says that intervals are narrow, a hill that they are
    wide, a slope that values are biased. An interval of another channel has no rank.
    """
    finite = np.array([z for z in standing if math.isfinite(z)])
    ranks = np.minimum((RANKS * ndtr(finite)).astype(int), RANKS - 1)
    return np.bincount(ranks, minlength=RANKS)


def uniform(counts: np.ndarray) -> float:
    """Probability of counts at least as uneven, were every rank as likely (Pearson's χ²)."""
    expected = counts.sum() / len(counts)
    return float(chdtrc(len(counts) - 1, ((counts - expected) ** 2 / expected).sum()))


def within(standing: Sequence[float], level: float) -> list[bool]:
    """For every interval, whether it would hold the truth if it were reported for this level."""
    reach = float(ndtri(0.5 * (1.0 + level))) + 1e-9  # a truth on the edge is within
    return [abs(z) <= reach for z in standing]


def coverage_table(places: dict[str, list[float]]) -> str:
    rows = [
        (percent(level), *(cell(within(found, level)) for found in places.values()))
        for level in LEVELS
    ]
    return tables.table(("level", *places), rows)


def rank_table(places: dict[str, list[float]]) -> str:
    """Ranks from the truth far below the value to far above it, and how likely so uneven."""
    counts = {place: histogram(found) for place, found in places.items()}
    rows = []
    for rank in range(RANKS):
        ends = f"{rank / RANKS:.1f} to {(rank + 1) / RANKS:.1f}"
        rows.append((ends, *(_bar(c[rank]) for c in counts.values())))
    expected = [f"{c.sum() / RANKS:.1f}" for c in counts.values()]
    p = [f"{uniform(c):.2f}" if c.sum() else "" for c in counts.values()]
    last = [("expected of each", *expected), ("p of so uneven a histogram", *p)]
    return tables.table(("rank of the truth", *places), [*rows, *last])


def _bar(count: int) -> str:
    return f"{count} {'█' * int(count)}".strip()
