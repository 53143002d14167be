"""A named cause voyage by voyage: the season of a verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from shiplog.diagnosis.season.trends import OfVoyage
from shiplog.models.causes import ParameterEstimate
from shiplog.nomenclature.numbers import figure
from shiplog.report.evaluation.text_table import table


@dataclass(frozen=True, slots=True)
class InVoyage:
    """A named cause in one voyage, by partial pooling between the voyages.

    date               ISO 8601, of its middle; none where its recorder knows no date
    parameters         as of the cause
    calm_speed_change  of the model's steady speed at equal revolutions, %; of what wears
    """

    voyage: str
    date: str | None
    parameters: Mapping[str, ParameterEstimate]
    calm_speed_change: ParameterEstimate | None = None


def of(voyages: Sequence[OfVoyage]) -> tuple[InVoyage, ...] | None:
    """None of no voyages."""
    found = tuple(
        InVoyage(
            one.voyage, None if one.date is None else one.date.isoformat(), one.pooled, one.speed
        )
        for one in voyages
    )
    return found or None


def lines(voyages: Sequence[InVoyage] | None) -> list[str]:
    """A table of the report: a row a voyage and parameter."""
    if not voyages:
        return []
    rows = [
        (one.voyage, name, figure(size.value, 3),
         f"{figure(size.low, 3)} to {figure(size.high, 3)}", size.unit)
        for one in voyages for name, size in one.parameters.items()
    ]  # fmt: skip
    head = ("voyage", "parameter", "value", "90 % interval, pooled", "unit")
    return ["", table(head, rows, ("value",))]
