"""Logs, stores and models of cases of which only the sealed answers are here, made once more.

Seeds draw all that is in a case. So answers that were unpacked become a test that can be asked
again: by rivals, by another program, without a part of the decision. Each key that is written on
the way has to be the one that the answers were scored with.
"""

from __future__ import annotations

import logging
import shutil
from pathlib import Path

from pipelines.experiments.hidden_effects import plan as plans
from pipelines.experiments.hidden_effects import run
from pipelines.experiments.hidden_effects.plan import Plan, Planned
from pipelines.experiments.hidden_effects.run import Prepared, Settings
from shiplog.exceptions import ShiplogError

log = logging.getLogger(__name__)

AGAIN = "keys-again"  # in the test's folder: the keys that are compared with those in keys/


def remake(out: Path, settings: Settings) -> Plan:
    """The plan of the test. A case whose logs, store and model are there is left alone.

    Raises ShiplogError where a step fails or a key is another than before; what was made of that
    case is then removed.
    """
    plan = plans.load(out)
    ships: dict[int, list[Planned]] = {}
    for planned in plan.cases:
        if run.finished(plans.case_folder(out, planned)) and not run.kept(out, planned):
            ships.setdefault(planned.seed, []).append(planned)
    log.info("%d of %d cases to make", sum(map(len, ships.values())), len(plan.cases))
    run.in_turn(list(ships.values()), lambda one: _case(out, one, settings), settings.jobs)
    return plan


def _case(out: Path, planned: Planned, settings: Settings) -> str | None:
    """How long it took, for the log; None where somebody stopped it."""
    folder = plans.case_folder(out, planned).resolve()
    key = (out / AGAIN / f"{planned.label}.json").resolve()
    key.parent.mkdir(exist_ok=True)
    _remove(folder)
    prepared = Prepared(folder / "logs", folder / "store", run.base_to_make(out, planned, settings))
    steps = run.prepare(planned, settings, folder, prepared, key)
    if steps is None:
        return None
    if run.failed(last := steps[-1]):
        _remove(folder)
        raise ShiplogError(
            f"{planned.label}: {last['step']} ended with {last['rc']}: {last['stderr']}"
        )
    if key.read_bytes() != plans.key_path(out, planned).read_bytes():
        _remove(folder)
        raise ShiplogError(
            f"{planned.label} hides something else than when it was diagnosed.",
            hint="make it again with the program that its steps.json names.",
        )
    return f"made after {sum(done['wall_s'] for done in steps):.0f} s"


def _remove(folder: Path) -> None:
    for name in run.LARGE:
        shutil.rmtree(folder / name, ignore_errors=True)
