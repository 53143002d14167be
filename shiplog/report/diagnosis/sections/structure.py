"""The remainder of a verdict: a dependence without a named cause."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from shiplog.diagnosis.verdict.result import Decision

DEPENDS = {  # family → inputs; of `controls`, the ship's actuators
    "position": ("x0", "y0"),
    "heading": ("heading",),
    "time": ("time",),
    "motion": ("surge", "sway", "yaw_rate"),
    "wind": ("wind_speed", "wind_angle"),
    "stochastic": (),
    "intermittent": ("time",),
}


@dataclass(frozen=True, slots=True)
class Structure:
    """Of a verdict `unknown`: what acts that is not in the catalogue.

    family         `position`, `heading`, `time`, `motion`, `controls`, `wind`, `stochastic` or
                   `intermittent`
    acts_on        `surge`, `sway`, `yaw_rate`
    depends_on     inputs of the family
    evidence_nats  log Bayes factor
    """

    family: str
    acts_on: tuple[str, ...]
    depends_on: tuple[str, ...]
    evidence_nats: float


def of(decision: Decision, actuators: Sequence[str]) -> Structure | None:
    found = decision.structure
    if found is None:
        return None
    depends = tuple(actuators) if found.family == "controls" else DEPENDS[found.family]
    return Structure(found.family, tuple(found.acts_on), depends, found.evidence)
