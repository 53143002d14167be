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
from pipelines.experiments.hidden_effects.run import Made, Settings
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
    base = run.base_to_make(out, planned, settings)
    made = Made(folder / "logs", folder / "store", base, key)
    seconds = 0.0
    for name, command in run.making(planned, settings, made).items():
        if name == "train" and not run.to_train(base, made.logs):
            continue
        done = run.step(name, command, folder, settings)
        if done["rc"] in run.STOPPED:
            return None
        if done["rc"] not in (run.DONE, run.LOST):
            _remove(folder)
            raise ShiplogError(f"{planned.label}: {name} ended with {done['rc']}: {done['stderr']}")
        if name == "logs" and key.read_bytes() != plans.key_path(out, planned).read_bytes():
            _remove(folder)
            raise ShiplogError(
                f"{planned.label} hides something else than when it was diagnosed.",
                hint="make it again with the program that its steps.json names.",
            )
        if name == "train" and settings.share:
            run.mark(base, made.logs)
        seconds += done["wall_s"]
    return f"made after {seconds:.0f} s"


def _remove(folder: Path) -> None:
    for name in run.LARGE:
        shutil.rmtree(folder / name, ignore_errors=True)
