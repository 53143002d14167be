"""The result of `shiplog train --trial-sheet`: the sheet's numbers beside the model's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from shiplog.manoeuvres.quantity import QUANTITIES
from shiplog.manoeuvres.sheet_fit import Reached, described
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted, figure
from shiplog.report.evaluation import tables
from shiplog.report.evaluation import trust as trusted
from shiplog.report.evaluation.text_table import table
from shiplog.report.result import Answer
from shiplog.training.physics.trust import CoefficientTrust
from shiplog.training.runs.load_model import Run

PAGE = "training.md"  # in the run folder
FAR = 2.0  # standard deviations: a number of the sheet that the model misses by more is named
UNTESTED = (
    "Nothing was held out: no voyage has tested this model, and it has no band. "
    "`shiplog evaluate` on a recorded voyage does."
)


@dataclass(frozen=True, repr=False)
class SheetIdentification:
    """A run from a trial sheet, and what there is to say of it.

    source   of the sheet, in its own words
    """

    run: Run
    source: str
    reached: tuple[Reached, ...]
    trust: tuple[CoefficientTrust, ...]
    notes: tuple[str, ...]

    def answer(self) -> Answer:
        lines = [
            *self.lines,
            "",
            reached_table(self.reached),
            "",
            f"All coefficients: {self.run.path / PAGE}",
            f"Next: shiplog evaluate {self.run.path} --store STORE",
        ]
        return Answer(lines, self.json)

    @property
    def lines(self) -> list[str]:
        manoeuvres = len({one.manoeuvre for one in self.reached})
        far = [one for one in self.reached if abs(one.off) > FAR]
        missed = (
            f"It misses {', '.join(f'{one.name} of {one.manoeuvre}' for one in far)} by more than "
            f"{FAR:g} of their spreads."
            if far
            else f"It is within {FAR:g} spreads of every number."
        )
        return [
            f"{self.run.label} in {self.run.path}, from {counted(len(self.reached), 'number')} of "
            f"{counted(manoeuvres, 'manoeuvre')} ({self.source}). {missed}",
            *trusted.coefficient_lines(self.run.name, self.trust, "by the sheet"),
            *self.notes,
        ]

    @property
    def page(self) -> str:
        """Markdown: the sheet, every sentence, and the table of all coefficients."""
        lines = [f"# {self.run.label}", "", *(f"{line}\n" for line in self.lines)]
        lines += ["## The sheet's numbers", "", reached_table(self.reached), ""]
        lines += ["## What may be trusted", "", trusted.sources(self.trust), ""]
        lines += [trusted.coefficients_table(self.trust), ""]
        lines += ["## Coefficients", "", tables.parameters_table(self.run.identified())]
        return "\n".join([*lines, ""])

    @property
    def json(self) -> dict:
        return {
            "contract": CONTRACT,
            "run": str(self.run.path),
            "label": self.run.label,
            "notes": list(self.notes),
            "quantities": described(self.reached),
            "parameters": self.run.identified().to_dicts(),
            "trust": [one.as_json() for one in self.trust],
        }


def reached_table(reached: Sequence[Reached]) -> str:
    """The sheet's numbers beside the model's before and after the fit."""
    head = ("manoeuvre", "quantity", "unit", "sheet", "spread", "before", "fitted", "off (spreads)")
    rows = [
        (r.manoeuvre, QUANTITIES[r.name].words, QUANTITIES[r.name].unit, figure(r.value, 3),
         figure(r.spread), figure(r.start, 3), figure(r.fitted, 3), f"{r.off:+.1f}")
        for r in reached
    ]  # fmt: skip
    return table(head, rows, head[3:])
