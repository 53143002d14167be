"""Limits of the user against today's results of a run: what holds, what is broken."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from shiplog.commands.diagnose import STAGES, diagnose_run
from shiplog.commands.evaluate import evaluate_runs
from shiplog.exceptions import ShiplogError, WindowError, listed
from shiplog.machine import files
from shiplog.machine.paths import check_diagnosis, check_file, refuse_taken
from shiplog.models.causes import Cause, user
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation.evaluation import Evaluation
from shiplog.report.gate import diagnosed, diagnosis_folder, golden, judging, junit, limits_file
from shiplog.report.gate.diagnosed import Diagnosed
from shiplog.report.gate.gate import Gate
from shiplog.report.gate.limits_file import Limits
from shiplog.report.page.diagnosis.source import GATE
from shiplog.report.result import Answer
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import Run
from shiplog.training.runs.voyages_to_test import held_back
from shiplog.voyages.store.store import Store

log = logging.getLogger(__name__)

# Seconds of nominal and of trial voyages in the diagnosis whose stages `STAGES` has.
NOMINAL_S, TRIAL_S = 3500.0, 1800.0


@dataclass(frozen=True)
class Judged:
    """A run, the voyages that it is judged on, and its diagnosis where there is one already."""

    run: Run
    store: Store
    names: tuple[str, ...]
    own: tuple[Cause, ...]
    cause_files: tuple[Path, ...]
    kept: Diagnosed | None
    folder: Path | None
    simulators: tuple[str, ...] = ()

    @property
    def windless(self) -> bool:
        """Whether the model has no wind force, although wind is recorded."""
        return self.run.profile.has_wind and "wind" in self.run.config.physics.without

    def evaluated(self) -> Evaluation:
        """Raises WindowError where no voyage is long enough for a window."""
        return evaluate_runs(
            [self.run.path], self.store, self.names, self.cause_files, self.simulators
        )

    def diagnosed(self) -> Diagnosed:
        """The verdict of the folder, else one of today, which is kept where there is a folder."""
        if self.kept is not None:
            return self.kept
        trial = sum(e.seconds for e in self.store.entries() if e.name in self.names)
        minutes = _expected_s(self.run, trial) / 60.0
        log.info(
            "limits on a verdict need a diagnosis of %s: up to %.0f min%s.",
            listed(self.names, most=4), max(minutes, 1.0),
            "" if self.folder else "; --diagnosis FOLDER keeps it, or gives one that is there",
        )  # fmt: skip
        if self.folder is not None:
            return self._made(self.folder)
        with files.temporary_folder() as folder:
            return self._made(folder / "diagnosis")

    def _made(self, folder: Path) -> Diagnosed:
        done = diagnose_run(
            self.run.path,
            self.store,
            self.names,
            folder,
            cause_files=self.cause_files,
            simulators=self.simulators,
        )
        return diagnosed.of(files.finite(done.verdict.as_json()))


def gate_run(
    run_path: Path,
    store: Store,
    limits_path: Path,
    voyages: Sequence[str] = (),
    *,
    diagnosis: Path | None = None,
    cause_files: Sequence[Path] = (),
    simulators: Sequence[str] = (),
) -> Gate:
    """Hold a run against limits.toml. Raises ShiplogError where it cannot be judged.

    voyages      unless given: those of the diagnosis, else those that `evaluate` takes
    diagnosis    a folder of `diagnose`; where there is none yet, the diagnosis is made there
    cause_files  Python files of the causes of the user's own, which are executed
    simulators   files of simulators of the user's own: the run may be one of these
    """
    limits = limits_file.load(limits_path)
    of = _judged(run_path, store, voyages, diagnosis, cause_files, simulators)
    _check(limits, str(limits_path), of)
    found, lacking = None, ""
    if limits.of_windows:
        try:
            found = of.evaluated()
        except WindowError as error:
            lacking = error.message
    outcomes = judging.of_windows(limits, of.names, found, lacking)
    verdict = of.diagnosed() if limits.of_verdict else None
    if verdict is not None:
        outcomes += judging.of_verdict(limits, verdict, of.own, of.windless)
    done = Gate(
        of.run.name,
        of.run.profile.ship.name,
        str(limits_path),
        of.names,
        tuple(outcomes),
        limits.window_s if limits.of_windows else None,
        0 if found is None else found.answer(found.runs[0])["windows"],
        "" if verdict is None else verdict.verdict,
        "" if verdict is None else verdict.sentence,
        str(of.folder) if verdict is not None and of.folder else "",
    )
    if verdict is not None and of.folder:  # for the page of that verdict
        files.write_json(of.folder / GATE, done.json | {"limits_file": limits_path.name})
    return done


def gate_command(
    run_path: Path,
    store: Store,
    limits_path: Path,
    voyages: Sequence[str] = (),
    *,
    diagnosis: Path | None = None,
    cause_files: Sequence[Path] = (),
    junit_to: Path | None = None,
    simulators: Sequence[str] = (),
) -> Gate:
    """As `gate_run`, with the result as JUnit XML; that of a run that cannot be judged is an error.
    Raises ShiplogError."""
    try:
        done = gate_run(
            run_path,
            store,
            limits_path,
            voyages,
            diagnosis=diagnosis,
            cause_files=cause_files,
            simulators=simulators,
        )
    except ShiplogError as error:
        if junit_to is not None:
            files.write_answer(junit_to, junit.of_error(run_path.name, error))
        raise
    if junit_to is not None:
        files.write_answer(junit_to, junit.of_gate(done))
    return done


def write_limits(
    run_path: Path,
    store: Store,
    limits_path: Path,
    voyages: Sequence[str] = (),
    *,
    diagnosis: Path | None = None,
    cause_files: Sequence[Path] = (),
    simulators: Sequence[str] = (),
) -> Answer:
    """A new limits.toml from today's results: a golden run. Limits on a verdict are in it where
    `diagnosis` is given. Raises ShiplogError, also where the file is there already."""
    check_file(limits_path, "--limits")
    refuse_taken(limits_path, "--limits")
    of = _judged(run_path, store, voyages, diagnosis, cause_files, simulators)
    found = of.evaluated()
    verdict = of.diagnosed() if diagnosis is not None else None
    count = golden.write(limits_path, golden.text(found, verdict, of.own, of.windless))
    lines = [
        f"{limits_path}: {counted(count, 'limit')} from {of.run.name} on "
        f"{listed(of.names, most=4)}."
    ]
    if verdict is None:
        lines.append("None is on a verdict: give --diagnosis FOLDER for those.")
    return Answer(lines, {"contract": CONTRACT, "written": str(limits_path), "limits": count})


def _judged(
    run_path: Path,
    store: Store,
    voyages: Sequence[str],
    diagnosis: Path | None,
    cause_files: Sequence[Path],
    simulators: Sequence[str],
) -> Judged:
    own = user.load(cause_files)
    run = load_model.load(run_path, own, simulators)
    if diagnosis is None or not diagnosis.exists():
        names = store.select(list(voyages)) if voyages else held_back([run], store)
        kept = None
        if diagnosis is not None:
            check_diagnosis(diagnosis, None)
    else:
        folder = diagnosis_folder.load(diagnosis)
        names = store.select(list(voyages) if voyages else folder.voyages)
        diagnosis_folder.check(folder, run, names, store.hashes(names))
        kept = folder.verdict
    return Judged(
        run, store, tuple(names), own, tuple(cause_files), kept, diagnosis, tuple(simulators)
    )


def _check(limits: Limits, source: str, of: Judged) -> None:
    """Raises LimitsError for limits that are about nothing here."""
    limits_file.check_names(limits, source, of.own, of.run.profile.actuator_names)
    limits_file.check_window(limits, source, of.run.name, of.run.config.window)
    unknown = [p for p in limits.voyages if not judging.voyages_of(p, of.names)]
    limits_file.refuse_other_voyages(source, unknown, of.names)


def _expected_s(run: Run, trial_s: float) -> float:
    """How long a diagnosis takes: the stages' times on the sample logs, by the lengths here."""
    nominal_s = float(run.training().height + run.validation().height)
    of_nominal = STAGES["nominal voyages"]
    others = sum(STAGES.values()) - of_nominal
    return of_nominal * nominal_s / NOMINAL_S + others * trial_s / TRIAL_S
