"""Causes that are present, but too small to matter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from shiplog.diagnosis.verdict.result import Named
from shiplog.report.diagnosis.sections.causes import Estimate, parameters
from shiplog.report.diagnosis.sections.written import bullets


@dataclass(frozen=True, slots=True)
class Trace:
    """Causes that are present, but below their practical size.

    parameters  as of `causes`
    """

    name: str
    parameters: Mapping[str, Estimate]
    sentence: str


def of(named: Sequence[Named]) -> tuple[Trace, ...]:
    return tuple(
        Trace(
            one.cause.name,
            parameters(one),
            f"Present, but below practical size: {one.cause.sentence(one.estimates)}",
        )
        for one in named
    )


def markdown(traces: Sequence[Trace]) -> list[str]:
    return bullets("Traces", [f"{one.name}: {one.sentence}" for one in traces])
