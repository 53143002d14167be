"""An interval of a voyage that the verdict reports."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Interval:
    """Stretches of the trial that were left out, or are outside the training data.

    start_s   from the voyage's first row, s
    kind      `external` or `coverage`
    """

    voyage: str
    start_s: float
    end_s: float
    kind: str
    sentence: str
