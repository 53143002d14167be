"""The result of `shiplog gate`: every limit with what became of it, as text and as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from shiplog.exceptions import listed
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation.text_table import one_line
from shiplog.report.gate.outcome import Outcome
from shiplog.report.result import Printed


@dataclass(frozen=True, repr=False)
class Gate(Printed):
    """Limits of the user against today's results.

    ship      name of the ship
    source    path of limits.toml
    seconds   length of the windows; None where no limit is on them
    windows   their number
    verdict   word and sentence of the diagnosis; empty where no limit is on one
    folder    of the diagnosis; empty where there is none, or it was not kept
    """

    run: str
    ship: str
    source: str
    voyages: tuple[str, ...]
    outcomes: tuple[Outcome, ...]
    seconds: int | None = None
    windows: int = 0
    verdict: str = ""
    sentence: str = ""
    folder: str = ""

    @property
    def broken(self) -> tuple[Outcome, ...]:
        """Limits that do not hold, those that were not assessed included."""
        return tuple(one for one in self.outcomes if one.state != "holds")

    @property
    def holds(self) -> bool:
        """Whether every limit holds."""
        return not self.broken

    @property
    def headline(self) -> str:
        """What was judged, and whether it may pass."""
        of = f"{self.run} on {listed(self.voyages, most=4)}"
        if self.seconds is not None:
            of += f", {counted(self.windows, 'window')} of {self.seconds} s"
        count, bad = len(self.outcomes), len(self.broken)
        if not bad:
            return f"{of}: {_all(count)}."
        lost = sum(one.state == "not assessed" for one in self.broken)
        text = f"{of}: {_broken(bad, count)}"
        if lost:
            text += f", {lost} of them because {_it(lost)} not assessed"
        return f"{text}."

    @property
    def lines(self) -> Sequence[str]:
        lines = [one_line(self.headline)]
        if self.verdict:
            lines.append(one_line(f"Diagnosis: {self.verdict}. {self.sentence}"))
        if self.folder:
            lines.append(f"Report: {self.folder}/report.md")
        return [*lines, "", *(one.line for one in self.outcomes)]

    @property
    def json(self) -> dict:
        return {
            "contract": CONTRACT, "run": self.run, "voyages": list(self.voyages),
            "holds": self.holds, "sentence": self.headline, "window_s": self.seconds,
            "windows": self.windows, "verdict": self.verdict or None,
            "limits": [one.as_json() for one in self.outcomes],
        }  # fmt: skip


def _all(count: int) -> str:
    return "the limit holds" if count == 1 else f"all {count} limits hold"


def _it(count: int) -> str:
    return "it was" if count == 1 else "they were"


def _broken(bad: int, count: int) -> str:
    if count == 1:
        return "the limit is broken"
    return f"{bad} of {count} limits {'is' if bad == 1 else 'are'} broken"
