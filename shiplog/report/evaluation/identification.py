"""The result of `shiplog train` of a physical model: the lines that matter, the page with the rest.

<run>/training.md has every sentence and coefficient.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from shiplog.exceptions import listed
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted, figure
from shiplog.report.evaluation import derived, tables
from shiplog.report.evaluation import trust as trusted
from shiplog.report.evaluation.judgement import BASELINES
from shiplog.report.result import Answer
from shiplog.training.physics.identifiability import SILENT
from shiplog.training.physics.trust import CoefficientTrust
from shiplog.training.runs.load_model import Run

PAGE = "training.md"  # in the run folder
WORST = 4  # coefficients that are named of those that the data determine worst


@dataclass(frozen=True, repr=False)
class Identification:
    """An identified run, and what there is to say of it.

    errors      L before and after, in one sentence; or that nothing was fitted
    notes       all sentences, in the order in which they were found
    doubts      those of them that ask for a look: limits, convergence, what no ship has
    baselines   mean L of each on the training windows
    window      how long the windows are in ship times; what would suit the ship better, if anything
    trust       what may be believed of each coefficient
    """

    run: Run
    errors: str
    notes: tuple[str, ...]
    doubts: tuple[str, ...]
    baselines: Mapping[str, float]
    window: tuple[str, str] = ("", "")
    trust: tuple[CoefficientTrust, ...] = ()

    def __repr__(self) -> str:
        return f"Identification({self.run!r})"

    def answer(self, store: Path) -> Answer:
        """What `train` prints: the lines that matter, and the next command."""
        lines = [*self.lines, f"All coefficients, and what correlates: {self.run.path / PAGE}"]
        lines.append(f"Next: shiplog evaluate {self.run.path} --store {store}")
        return Answer(lines, self.json)

    @property
    def lines(self) -> list[str]:
        run, (times, advice) = self.run, self.window
        voyages = listed(run.config.split.training)
        windows = counted(run.windows().height, "window")
        fitted = "nothing fitted; " if run.given else "fitted to "
        long = f"{run.config.window} s ({times})" if times else f"{run.config.window} s"
        baselines = ", ".join(f"{loss:.0f} {BASELINES[n]}" for n, loss in self.baselines.items())
        return [
            f"{run.label} in {run.path}, {fitted}{voyages}: {windows} of {long}.",
            *([advice] if advice else []),
            *([said] if (said := derived.of_profile(run.profile)) else []),
            self.errors,
            f"Baselines on these windows: {baselines}.",
            *([] if run.given else [self._worst]),
            self._doubts,
        ]

    @property
    def _worst(self) -> str:
        """Which coefficients the data determine worst, by standard error over plausible spread."""
        free = self.run.identified(self.run.config.seeds[0]).filter(pl.col("free"))
        ratio = pl.col("standard_error") / pl.col("spread")
        ranked = free.with_columns(ratio=ratio).sort("ratio", descending=True)
        quiet = ranked.filter(pl.col("ratio") > SILENT).height
        named = ", ".join(
            f"{r['name']} {figure(r['value'], 3)} ± {figure(r['standard_error'])}"
            for r in ranked.head(WORST).to_dicts()
        )
        silent = f"{quiet} of {counted(free.height, 'coefficient')} stand where they started"
        if self.trust:
            silent = f"Of {counted(len(self.trust), 'coefficient')} {trusted.counts(self.trust)}"
        return f"Worst determined: {named}. {silent}."

    @property
    def _doubts(self) -> str:
        """The first thing to look at, and how many more there are."""
        if not self.doubts and self.run.given:
            return "Nothing is implausible."
        if not self.doubts:
            return "No coefficient is at a limit of its physical range, and nothing is implausible."
        first, *more = self.doubts
        return f"{first} And {counted(len(more), 'more doubt')} in the page." if more else first

    @property
    def page(self) -> str:
        """Markdown: every sentence, and the table of all coefficients that were free."""
        lines = [f"# {self.run.label}", "", *(f"{line}\n" for line in self.lines), "## Notes", ""]
        lines += [f"- {note}" for note in self.notes]
        if not self.run.given:
            lines += [
                "",
                *self._trusted,
                "## Coefficients",
                "",
                tables.parameters_table(self.run.identified()),
            ]
        return "\n".join([*lines, ""])

    @property
    def _trusted(self) -> list[str]:
        if not self.trust:
            return []
        head = ["## What may be trusted", "", trusted.sources(self.trust), ""]
        return [*head, trusted.coefficients_table(self.trust), ""]

    @property
    def json(self) -> dict:
        run = self.run
        return {
            "contract": CONTRACT,
            "run": str(run.path),
            "label": run.label,
            "windows": run.windows().height,
            "notes": list(self.notes),
            "parameters": run.identified().to_dicts(),
            "trust": [one.as_json() for one in self.trust],
            "split": run.config.split.model_dump(mode="json"),
        }
