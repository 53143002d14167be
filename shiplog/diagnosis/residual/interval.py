"""An interval of a voyage that the verdict reports."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Interval:
    """An interval that the verdict lists by itself: external, gap or coverage."""

    voyage: str
    start_s: float
    end_s: float
    kind: str
    sentence: str

    def as_json(self) -> dict:
        return {
            "voyage": self.voyage, "start_s": self.start_s, "end_s": self.end_s,
            "kind": self.kind, "sentence": self.sentence,
        }  # fmt: skip
