"""Stretches that were left out, or are outside the training data."""

from __future__ import annotations

from collections.abc import Sequence

from shiplog.diagnosis.residual.interval import Interval
from shiplog.report.diagnosis.sections.written import bullets


def markdown(intervals: Sequence[Interval]) -> list[str]:
    return bullets(
        "Stretches left out, or outside the training data",
        [
            f"{i.voyage}, {i.start_s:.0f} to {i.end_s:.0f} s ({i.kind}): {i.sentence}"
            for i in intervals
        ],
    )
