"""The result of `shiplog diagnose`: the verdict, and the objects behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl

from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.onset.onsets import Course
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict.held_out import HeldOut
from shiplog.diagnosis.verdict.result import Decision
from shiplog.report.diagnosis import page
from shiplog.report.diagnosis.sections.causes import Estimate
from shiplog.report.diagnosis.verdict import Verdict
from shiplog.report.result import Shown, Shows
from shiplog.simulation.error_reduction import Gain
from shiplog.simulation.extended_simulator import ExtendedSimulator
from shiplog.training.runs.load_model import Run

RECORDING, PAGE = "diagnosis.rrd", "report.html"  # in the folder of a diagnosis


@dataclass(frozen=True, repr=False)
class Diagnosis(Shows):
    """What the simulation gets wrong, and why.

    verdict    named, none, undecided, unknown, coverage or external, with its sentence
    folder     of report, verdict and recording
    simulated  trial and decision of the simulated model; of a network, not those of its MMG
    whole      that trial, linearised on overlapping segments
    held       the held-out windows; None where no stretch is long enough for one
    after      the extended model; None without a named cause
    drawn      whether the pictures could be drawn
    shown      its pictures and its page
    extended   the run with the causes in it, where one was asked for and a cause is named
    courses    label of each named cause → since when it acts
    datums     voyage → latitude and longitude [deg] of its x₀ = y₀ = 0, where its log had them
    """

    verdict: Verdict
    folder: Path
    decision: Decision | None = None
    trial: Trial | None = None
    simulated: tuple[Trial, Decision] | None = None
    whole: Linear | None = None
    held: HeldOut | None = None
    after: ExtendedSimulator | None = None
    drawn: bool = True
    extended: Run | None = None
    shown: Shown | None = None
    datums: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    courses: Mapping[str, Course] = field(default_factory=dict)

    def __repr__(self) -> str:
        named = ", ".join(self.named) or "no cause"
        return f"Diagnosis({self.verdict.run}: {self.verdict.verdict}, {named}; {self.folder})"

    @property
    def sentence(self) -> str:
        """The answer in words."""
        return self.verdict.sentence

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the causes, the most certain first; none where no cause is named."""
        return tuple(cause.name for cause in self.verdict.causes)

    @property
    def parameters(self) -> dict[str, dict[str, Estimate]]:
        """Cause → parameter → value, low, high (90 % interval), unit:
        `found.parameters["current"]["speed"].value`."""
        return {cause.name: dict(cause.parameters) for cause in self.verdict.causes}

    @property
    def gain(self) -> Gain | None:
        """L before and after on held-out windows, and its reduction with a 90 % interval; None
        where nothing was held out."""
        return self.verdict.gain

    @property
    def explained(self) -> float:
        """Share of the held-out error that the named causes take away, 0 to 1."""
        return self.verdict.explained

    @property
    def markdown(self) -> Path:
        """Path of the report in Markdown."""
        return self.folder / "report.md"

    @property
    def recording(self) -> Path | None:
        """Path of the Rerun recording; None where nothing was compared, or could be drawn."""
        return self.folder / RECORDING if self.decision is not None and self.drawn else None

    @property
    def page(self) -> Path | None:
        """Path of the page with pictures; None where it could not be drawn."""
        return self.folder / PAGE if self.drawn else None

    @property
    def causes(self) -> pl.DataFrame:
        """One row per named cause: name, probability and sentence."""
        schema = {"name": pl.String, "probability": pl.Float64, "sentence": pl.String}
        rows = [tuple(getattr(cause, key) for key in schema) for cause in self.verdict.causes]
        return pl.DataFrame(rows, schema, orient="row")

    @property
    def ranking(self) -> pl.DataFrame:
        """One row per answer: name and probability."""
        schema = {"name": pl.String, "probability": pl.Float64}
        rows = [tuple(getattr(answer, key) for key in schema) for answer in self.verdict.ranking]
        return pl.DataFrame(rows, schema, orient="row")

    @property
    def lines(self) -> list[str]:
        """The page, and where the files are."""
        lines = [*page.lines(self.verdict), f"Report: {self.markdown}"]
        if self.page is not None:
            lines.append(f"Page: {self.page}")
        if self.recording is not None:
            lines.append(f"Recording: {self.recording}")
        elif not self.drawn:
            lines.append("Recording: none, it could not be made.")
        if self.extended is not None:
            lines.append(f"Extended model: {self.extended.path}")
        return lines

    @property
    def json(self) -> dict:
        found = self.verdict.as_json()
        return found if self.recording is None else found | {"recording": str(self.recording)}
