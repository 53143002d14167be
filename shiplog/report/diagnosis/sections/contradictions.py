"""Contradictions in the reports of the voyages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from shiplog.voyages.store.contradicted import Contradicted


@dataclass(frozen=True, slots=True)
class Contradiction:
    """Each contradiction in the reports of the trial and nominal voyages; while one stands, the
    verdict is `undecided`.

    reason  as of a finding `contradiction`
    """

    voyage: str
    channel: str
    reason: str
    sentence: str


def of(found: Sequence[Contradicted]) -> tuple[Contradiction, ...]:
    return tuple(Contradiction(**one.as_json()) for one in found)
