"""Cases that were kept, diagnosed again by the program as it is now, into a folder of their own.

Logs, store and model stay those of the first run and are only read. A program that cannot read that
store or model starts from the logs, and makes its own. The keys are copied, unopened, once the new
verdicts are sealed; nothing of the first verdicts is used.
"""

from __future__ import annotations

import json
import logging
import shutil
from pathlib import Path

from pipelines.experiments.hidden_effects import plan as plans
from pipelines.experiments.hidden_effects import run
from pipelines.experiments.hidden_effects.plan import Plan, Planned
from pipelines.experiments.hidden_effects.program import identity, name
from pipelines.experiments.hidden_effects.run import Settings
from shiplog.exceptions import ShiplogError

log = logging.getLogger(__name__)

MADE = ("logs", "ingest", "train")  # steps of the first run that a replay stands on


def folder_of(source: Path) -> Path:
    """Where a replay of `source` goes unless told otherwise: next to it, named after the commit."""
    return source.with_name(f"{source.name}-{name(identity()).replace(' ', '-')}")


def replay(
    source: Path, out: Path, settings: Settings, every: int = 1, first: int | None = None,
    whole: bool = False,
) -> Plan:  # fmt: skip
    """The plan of what was replayed.

    every   one of so many of the kept cases, in addition to those that were asked before;
            `first`: so many of these
    whole   from the logs on: ingested and trained on as well

    Raises ShiplogError where no case of `source` was kept.
    """
    if source.resolve() == out.resolve():
        raise ShiplogError(
            f"{out} cannot hold its own replay.", hint="choose another folder with --out."
        )
    before = plans.load(source)
    kept = [one for one in before.cases if run.kept(source, one)]
    asked = {one.label for one in (*kept[::every][:first], *_asked_before(out))}
    cases = tuple(one for one in kept if one.label in asked)
    if not cases:
        raise ShiplogError(
            f"{source} has no case with store and base.", hint="run the suite with --keep first."
        )
    log.info("%d of %d cases are asked again", len(cases), len(before.cases))
    plan = plans.save(out, Plan(before.suite, before.first_seed, cases))

    if whole:
        _from_the_logs(source, out, plan, settings)
        return plan

    def again(planned: Planned) -> str | None:
        return _case(source, out, planned, settings)

    todo = [[one] for one in plan.cases if run.kept(source, one) and _left(out, one, settings)]
    run.in_turn(todo, again, settings.jobs)
    return plan


def _asked_before(out: Path) -> tuple[Planned, ...]:
    """The cases of this replay until now: a second one adds to them."""
    return plans.load(out).cases if (out / "keys" / "plan.json").exists() else ()


def _from_the_logs(source: Path, out: Path, plan: Plan, settings: Settings) -> None:
    """Each case the whole way, but that its logs are those of the first run."""

    def logs(planned: Planned) -> Path:
        return plans.case_folder(source, planned).resolve() / "logs"

    try:
        run.run(out, plan, settings, logs)
    finally:  # those that are done have a key, whatever ended the others
        for one in plan.cases:
            if (plans.case_folder(out, one) / "verdict.sha256").exists():
                shutil.copyfile(plans.key_path(source, one), plans.key_path(out, one))


def _left(out: Path, planned: Planned, settings: Settings) -> bool:
    folder = plans.case_folder(out, planned)
    asked = (folder / "rivals.sha256").exists() or not settings.rivals
    return not (run.finished(folder) and asked and plans.key_path(out, planned).exists())


def _case(source: Path, out: Path, planned: Planned, settings: Settings) -> str | None:
    """What was reported, for the log; None where somebody stopped it."""
    first = plans.case_folder(source, planned).resolve()
    folder = plans.case_folder(out, planned).resolve()
    store, base = first / "store", run.base_of(source, planned)
    reported = []
    if not run.finished(folder):
        number = run.attempts(folder) + 1
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        done = run.step("diagnose", run.diagnosing(settings, base, store, folder), folder, settings)
        if done["rc"] in run.STOPPED:
            return None
        done |= {"attempt": number}
        steps = json.loads((first / "steps.json").read_text(encoding="utf-8"))
        made = [one for one in steps if one["step"] in MADE]
        reported.append(f"{run.seal(folder, [*made, done])} after {done['wall_s']:.0f} s")
    shutil.copyfile(plans.key_path(source, planned), plans.key_path(out, planned))
    if settings.rivals and not (folder / "rivals.sha256").exists():
        reported.append(run.ask_rivals(folder, base, store, settings))
    if None in reported:
        return None
    if not settings.keep:
        shutil.rmtree(folder / "d", ignore_errors=True)
    return "; ".join(reported)
