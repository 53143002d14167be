"""Measured against simulated as a Rerun recording, or as what the ending of a file says."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import polars as pl

from shiplog.commands.bars import reach, staged
from shiplog.commands.evaluate import STAGES, evaluate_runs, save, write_page
from shiplog.exceptions import ShiplogError, listed
from shiplog.nomenclature.contract import CONTRACT
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.report.result import Shown, Shows
from shiplog.report.viewer import saving
from shiplog.report.viewer.comparison_data import (
    ComparisonData,
    Current,
    DrawnActuator,
    Moment,
)
from shiplog.training.runs.load_model import Run
from shiplog.voyages.store import moments
from shiplog.voyages.store.store import Store

WINDOWS_SHOWN = 2.0  # windows about a moment: one before it and one after


def comparison(evaluation: Evaluation, title: str, moment: Moment | None = None) -> ComparisonData:
    """What the viewer shows of an evaluation, opened at that moment."""
    run = evaluation.runs[0]
    labels = {r.name: f"{r.name} ({r.config.legend})" for r in evaluation.runs}
    profile = run.profile
    return ComparisonData(
        title=title,
        ship_length=profile.ship.length_m,
        ship_breadth=profile.ship.breadth,
        ship_outline=profile.ship.outline or (),
        actuators=tuple(DrawnActuator(a.name, a.kind, a.si_unit) for a in profile.actuators),
        has_wind=profile.has_wind,
        measured=evaluation.rows.select(
            "voyage", pl.col("elapsed").alias("time"), *profile.columns
        ),
        simulated=evaluation.rollouts.with_columns(
            model=pl.col("run").replace_strict(labels, return_dtype=pl.String)
        ).drop("run"),
        training=run.training().select(profile.columns),
        summary=evaluation.text,
        extended=tuple(labels[r.name] for r in evaluation.runs if r.extension is not None),
        datums=evaluation.datums,
        current=_named_current(evaluation.runs),
        moment=moment,
        banks=profile.site.banks,
        trained=run.name if len(evaluation.runs) > 1 else "",
        forces=None
        if evaluation.forces is None
        else evaluation.forces.with_columns(
            model=pl.col("run").replace_strict(labels, return_dtype=pl.String)
        ).drop("run"),
    )


@dataclass(frozen=True, repr=False)
class Comparison(Shows):
    """`saved` is a Rerun file, or a picture, of measured and simulated voyages, `evaluation` what
    it shows.

    lost     what could not be written, and why. Without the file, `saved` is None and all else is
             there
    moment   what it is opened at
    """

    evaluation: Evaluation
    saved: Path | None
    lost: tuple[ShiplogError, ...] = ()
    moment: Moment | None = None

    @property
    def recording(self) -> Path | None:
        """The Rerun file; None where a picture was asked for, or it could not be written."""
        return self.saved if self.saved is None or self.saved.suffix.lower() == ".rrd" else None

    @property
    def shown(self) -> Shown | None:  # type: ignore[override]  # of the evaluation
        return self.evaluation.shown

    def __repr__(self) -> str:
        runs = ", ".join(run.name for run in self.evaluation.runs)
        on = listed(self.evaluation.voyages, most=3)
        return f"Comparison({runs} on {on}; recording {self.recording or 'none'})"

    @property
    def lines(self) -> list[str]:
        what = "Recording" if self.saved is None else saving.NAMES[self.saved.suffix.lower()]
        return [*self.evaluation.lines, "", f"{what}: {self.saved or 'none'}"]

    @property
    def json(self) -> dict:
        found = self.evaluation
        where = None if self.recording is None else str(self.recording)
        answers = {run.name: found.answer(run) for run in found.runs}
        answer = {"contract": CONTRACT, "recording": where, "runs": answers}
        if self.saved is not None and self.recording is None:
            answer["saved"] = str(self.saved)
        return answer

    def written(self) -> Path:
        """The file. Raises ShiplogError where it could not be written."""
        if self.saved is None:
            raise self.lost[-1]
        return self.saved


@staged("comparing", STAGES | {"recording": 2.0})
def compare_runs(
    paths: Sequence[Path],
    store: Store,
    voyages: Sequence[str],
    save_to: Path | None,
    cause_files: Sequence[Path] = (),
    at: str | None = None,
    simulators: Sequence[str] = (),
) -> Comparison:
    """Evaluate the runs on the same windows and record both sides; in the first run's folder
    unless a path is given, whose ending says what is written.

    at   VOYAGE:SECONDS that it is opened at; without `voyages`, that voyage alone is compared
    """
    if save_to is not None:
        saving.check(save_to)
    moment = None if at is None else moments.parse(at)
    if moment is not None:
        moments.check(store, *moment)
        voyages = moments.among(store, moment[0], voyages)
    found = evaluate_runs(paths, store, voyages, cause_files, simulators)
    opened = None
    if moment is not None:
        opened = Moment(*moment, WINDOWS_SHOWN * found.runs[0].config.window)
    reach("recording")
    lost = save(found)
    saved: Path | None = save_to or found.runs[0].path / "compare.rrd"
    title = f"{found.runs[0].profile.ship.name}: {listed(found.voyages, most=3)}"
    try:
        if saved.suffix.lower() == saving.PAGE:
            write_page(found, store, saved)
        else:
            saving.write(comparison(found, title, opened), saved)
    except ShiplogError as error:
        saved, lost = None, (*lost, error)
    return Comparison(found, saved, lost, opened)


def _named_current(runs: Sequence[Run]) -> Current | None:
    """Of the first run that a diagnosis extended by one."""
    for run in runs:
        if (water := run.extension_numbers().get("current")) is not None:
            north, east = (float(one) for one in water)
            return Current(math.hypot(north, east), math.atan2(east, north))
    return None
