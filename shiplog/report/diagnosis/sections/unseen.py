"""Dependence of the residual on inputs that the model does not have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from shiplog.diagnosis.residual.omitted_inputs import Dependence
from shiplog.exceptions import listed
from shiplog.nomenclature.channels import VELOCITY


@dataclass(frozen=True, slots=True)
class Omitted:
    """Dependence of the residual on inputs that the model does not have.

    variable     `heading`, `position`, `time` or `controls`
    r2           share of the variance of each channel on data left out; below 0: worse than none
    acts_on      channels that depend on it
    significant  whether one does
    left_out     what was left out in turn
    """

    variable: str
    r2: Mapping[str, float]
    acts_on: tuple[str, ...]
    significant: bool
    left_out: str
    sentence: str


def of(row: Dependence) -> Omitted:
    r2 = dict(zip((c.name for c in VELOCITY), row.r2, strict=True))
    text = ", ".join(f"{k.replace('_', ' ')} {v:.2f}" for k, v in r2.items())
    depends = f"acts on {listed(row.acts_on)}" if row.significant else "no dependence"
    return Omitted(
        row.variable, r2, tuple(row.acts_on), row.significant, row.folds,
        f"R² {text} ({row.folds} left out): {depends}",
    )  # fmt: skip


def markdown(unseen: Sequence[Omitted]) -> list[str]:
    if not unseen:
        return []
    return [
        "Dependence of the residual on inputs that the model does not have (cross-validated "
        "R²):", "",
        *[f"- {one.variable}: {one.sentence}" for one in unseen], "",
    ]  # fmt: skip
