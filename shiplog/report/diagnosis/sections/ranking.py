"""Every answer with its probability."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from shiplog.report.evaluation.text_table import table

LEAST_SHARE = 0.01  # probability, below which an answer is not listed


@dataclass(frozen=True, slots=True)
class Ranked:
    """Every answer with a probability of at least 0.01, likeliest first.

    name         of a cause, `none`, or such as `unknown:motion`, a remainder that depends on motion
    probability  0 to 1
    """

    name: str
    probability: float


def of(ranking: Mapping[str, float]) -> tuple[Ranked, ...]:
    """Of all answers, name → probability."""
    kept = [Ranked(name, min(p, 1.0)) for name, p in ranking.items() if p >= LEAST_SHARE]
    return tuple(sorted(kept, key=lambda one: -ranking[one.name]))


def markdown(ranking: Sequence[Ranked]) -> list[str]:
    if not ranking:
        return []
    rows = [(one.name, f"{one.probability:.3f}") for one in ranking]
    return ["## Ranking", "", table(("answer", "probability"), rows, ("probability",)), ""]
