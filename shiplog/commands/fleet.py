"""A list of ships to one table of verdicts: a diagnosis each, in processes of their own."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from shiplog.commands.bars import Bars, reported
from shiplog.commands.diagnose import STAGES, diagnose_run
from shiplog.diagnosis.decision_parts import ALL, Parts
from shiplog.diagnosis.trial import trial_voyages
from shiplog.machine import files
from shiplog.machine.paths import check_causes, check_diagnosis, check_run
from shiplog.models.causes import user
from shiplog.report.fleet import inputs, ship_list
from shiplog.report.fleet.fleet import NOT_DRAWN, Fleet, Row, died
from shiplog.report.fleet.ship_list import Ship
from shiplog.training.network.queue import Task, work
from shiplog.training.runs import load_model
from shiplog.voyages.store.store import Store

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Outcome:
    """What a child process says of a ship; the verdict is in its folder.

    kept      whether it was there already
    drawn     whether its pictures and its page could be drawn
    warnings  of the diagnosis
    """

    kept: bool = False
    drawn: bool = True
    warnings: tuple[str, ...] = ()


def diagnose_list(
    path: Path,
    out: Path,
    *,
    jobs: int | None = None,
    cause_files: Sequence[Path] = (),
    switches: Parts = ALL,
) -> Fleet:
    """Every ship of the list, `jobs` at a time, one a core unless given. What an earlier call has
    done from the same inputs is not done again; what fails costs its own row. Raises ShiplogError
    for a list, a cause or a folder that cannot be used."""
    check_diagnosis(out, None)
    check_causes(cause_files)
    user.load(cause_files)  # or say so once, and not in each row
    ships = ship_list.read(path)
    out.mkdir(parents=True, exist_ok=True)
    tasks = [Task(ship.folder, _ship, (ship, out, tuple(cause_files), switches)) for ship in ships]
    rows: dict[str, Row] = {}
    of = {ship.folder: ship for ship in ships}
    costs = {task.name: task.cost for task in tasks}
    with Bars(costs, "ship") as bars, closing(work(tasks, jobs)) as events:
        for event in events:
            bars.show(event.task.name, event.share, event.ended)
            if event.ended:
                row = _row(of[event.task.name], out, event.failure, event.result)
                rows[event.task.name] = row
                _say(row)
    done = Fleet(tuple(rows[ship.folder] for ship in ships), path, out)
    done.save()
    return done


def _row(ship: Ship, out: Path, failure: str, outcome: Outcome | None) -> Row:
    row = Row(ship.line, ship.run, ship.store, ship.voyages)
    verdict = inputs.verdict_of(out / ship.folder) if outcome is not None else None
    if outcome is None or verdict is None:
        return replace(row, error=died(failure))
    return replace(
        row, folder=ship.folder, verdict=verdict, kept=outcome.kept, drawn=outcome.drawn,
        error="" if outcome.drawn else NOT_DRAWN, warnings=outcome.warnings,
    )  # fmt: skip


def _say(row: Row) -> None:
    for warning in row.warnings:
        log.warning("line %d, %s: %s", row.line, row.run, warning)
    log.info("line %d, %s: %s%s", row.line, row.run, row.said, " (kept)" if row.kept else "")


def _ship(ship: Ship, out: Path, cause_files: tuple[Path, ...], switches: Parts, report) -> Outcome:
    """In a child process: one diagnosis, whole in its folder or not at all. Raises ShiplogError."""
    folder = out / ship.folder
    causes = user.load(cause_files)
    check_run(ship.run_path)
    run = load_model.load(ship.run_path, causes)
    store = Store(ship.store_path)
    names = trial_voyages.voyages_of(run, store, ship.patterns)
    made_from = inputs.inputs_of(run, store, names, cause_files)
    if inputs.kept(folder, made_from):
        return Outcome(kept=True)
    with files.whole_folder(folder) as new, reported(STAGES, report), _warnings() as warnings:
        done = diagnose_run(
            ship.run_path, store, names, new, cause_files=cause_files, switches=switches
        )
        if done.drawn:  # else it is done again by the next call
            inputs.keep(new, made_from)
        files.remove(folder)  # the verdict of other inputs stands until this one is whole
    return Outcome(drawn=done.drawn, warnings=tuple(warnings))


@contextmanager
def _warnings() -> Iterator[list[str]]:
    """What the block warns of: a child's stderr has no room for it, and does not say which ship."""
    found: list[str] = []

    class Kept(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            found.append(record.getMessage())

    above, handler = logging.getLogger("shiplog"), Kept(logging.WARNING)
    before = above.propagate
    above.addHandler(handler)
    above.propagate = False
    try:
        yield found
    finally:
        above.removeHandler(handler)
        above.propagate = before
