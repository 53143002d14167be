"""One simulated ship: a training campaign as logs, its model, held-out trials, and the sheet.

All of a ship follows from its number. It is of another simulator (`other_families`), whose forces
have other forms than the model's; it is recorded by instruments with noise and clocks of their own.
"""

from __future__ import annotations

import json
import time
import traceback
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import shiplog
from pipelines.experiments.manoeuvre_coverage import trials
from pipelines.experiments.manoeuvre_coverage.coefficients import true_coefficients
from pipelines.experiments.other_families import cases
from pipelines.experiments.other_families.instruments import write_voyage
from pipelines.experiments.other_families.ship import Ship, stream
from shiplog.machine import files
from shiplog.manoeuvres import measure, recognition, simulated, stretches
from shiplog.models.mmg.estimate import particulars
from shiplog.training.runs import load_model, sailing_run, trust_file
from shiplog.voyages.store.store import Store

FAMILIES = ("abkowitz", "container", "naval_vessel", "shipmmg")  # in turn; all have rudders
CAMPAIGN = 100.0  # L/U of the training campaign, in five voyages
LEAST_CAMPAIGN = 2000.0  # s: 20 windows of 100 s
MEMBERS = 200
CHANGES = ("current", "fouling", "thrust_loss", "rudder_force")
CHANGED_CAMPAIGN = 50.0  # L/U after the change, that a diagnosis has
RESULT, TRUTH, CHANGED, PROFILE = "ship.json", "truth.json", "changed.json", "ship.toml"
MODELS = ("simulated", "extended")
FAILED = "failed.txt"


def campaign_seconds(ship: Ship, units: float) -> float:
    return max(units * ship.time_unit, LEAST_CAMPAIGN)


def one_ship(
    number: int, folder: Path, *, extended: bool = False, keep: bool = False, judge: bool = True
) -> dict[str, Any] | None:
    """What was found of a ship; kept in its folder, and read from there the next time.

    extended   something changes before the trials, a diagnosis names it from other voyages, and
               the extended model's intervals are judged as well
    keep       also stores and runs: without `ship.json` only the sheet is made anew
    judge      False: sailed and identified only, and the sheet is left to another call
    """
    kept = folder / RESULT
    if kept.exists():
        return json.loads(kept.read_text("utf-8"))
    case = _case(number, extended)
    truth = folder / (CHANGED if extended else TRUTH)  # other trials: nothing of them is kept
    if not truth.exists():
        files.remove(folder)
        (folder / "logs").mkdir(parents=True)
        (folder / PROFILE).write_text(cases.profile(case.ship), encoding="utf-8")
        for leg in (*case.nominal, *(case.trial if extended else ())):
            log = folder / "logs" / f"{leg.name}.mcap"
            write_voyage(log, cases.voyage(case, leg), seed=leg.seed, start=leg.start)
        files.write_json(truth, _trials(case, folder / "logs"))
    runs = _runs(case, folder, extended)
    files.remove(folder / "logs")
    if not judge:
        return None
    found = {
        "ship": number, "family": case.ship.family, "length": case.ship.length,
        "speed": case.ship.speed, "changed": "+".join(c.name for c in case.causes),
        "quantities": _quantities(json.loads(truth.read_text("utf-8")), runs, folder / "store"),
        "coefficients": _coefficients(case.ship, runs[0]),
    }  # fmt: skip
    files.write_json(kept, found)
    if not keep:
        for part in ("store", "diagnosis", "run", "extended"):
            files.remove(folder / part)
    return found


def done(number: int, out: Path, extended: bool, keep: bool, judge: bool) -> str:
    """One ship; a failure is kept in its folder, and the others go on."""
    folder, began = out / f"ship_{number}", time.process_time()
    try:
        one_ship(number, folder, extended=extended, keep=keep, judge=judge)
    except Exception:  # a bug of one ship, too: it is counted and listed, after hours of others
        folder.mkdir(parents=True, exist_ok=True)
        (folder / FAILED).write_text(traceback.format_exc(), encoding="utf-8")
        return f"ship {number}: failed, see {folder / FAILED}"
    return f"ship {number}: {time.process_time() - began:.0f} s of CPU"


def family_of(number: int) -> str:
    return FAMILIES[number % len(FAMILIES)]


def _case(number: int, extended: bool) -> cases.Case:
    family = family_of(number)
    drawn = cases.FAMILIES[family](number)
    cause = str(stream(number, "what changes").choice(CHANGES)) if extended else "none"
    return cases.draw(
        number, family=family, cause=cause, size=1.0,
        seconds=campaign_seconds(drawn, CHANGED_CAMPAIGN),
        nominal_seconds=campaign_seconds(drawn, CAMPAIGN),
    )  # fmt: skip


def nominal_case(number: int) -> cases.Case:
    """A ship of which nothing changes."""
    return _case(number, False)


def _runs(case: cases.Case, folder: Path, extended: bool) -> list[Path]:
    """The model, and where a diagnosis names something, the extended one."""
    store, run, more = folder / "store", folder / "run", folder / "extended"
    if not store.exists():
        shiplog.ingest([folder / "logs"], store, profile=folder / PROFILE)
    if not run.exists():
        shiplog.train(store, run, model="mmg", voyages=[leg.name for leg in case.nominal])
    if extended and not (folder / "diagnosis").exists():
        names = [leg.name for leg in case.trial]
        shiplog.diagnose(run, store, names, out=folder / "diagnosis", extend=more)
    return [run, more] if more.exists() else [run]


def _trials(case: cases.Case, logs: Path) -> list[dict[str, Any]]:
    """Each trial as a log, and what it truly was: as sailed, and without gusts or process noise."""
    rng = stream(case.seed, "manoeuvre coverage")
    found = []
    for i, trial in enumerate(trials.drawn(rng)):
        leg = case.trial[i % len(case.trial)]
        seed = int(rng.integers(2**62))
        # the wind of a leg veers by up to a radian over half an hour: a trial is shorter
        wind = replace(leg.wind, turn=0.2 * leg.wind.turn, freshen=0.2 * leg.wind.freshen)
        one, calm = (
            trials.sailed(
                case.ship, trial, seed=seed, wind=wind, effects=case.effects, quiet=quiet
            )
            for quiet in (False, True)
        )  # fmt: skip
        when = cases.NOMINAL_DAY + timedelta(days=60, hours=3 * i)
        write_voyage(logs / f"{trial.name}.mcap", one.voyage, seed=seed, start=when)
        found.append({
            "trial": trial.name, "kind": trial.kind, "true": trials.true_quantities(one),
            "calm": trials.true_quantities(calm),
        })  # fmt: skip
    return found


def _quantities(truth: list[dict[str, Any]], runs: list[Path], store: Path) -> list[dict[str, Any]]:
    """A row a quantity of a trial: true, calm, and [value, low, high, note] of each interval."""
    sailors = [sailing_run.of_run(load_model.load(run)) for run in runs]
    profile = sailors[0].profile
    rows = []
    for one in truth:
        record = stretches.read(Store(store), one["trial"], profile)
        everything = recognition.recognise(one["trial"], stretches.tracks(record))
        found = next((f for f in everything if f.kind == one["kind"]), None)
        columns: dict[str, Any] = {}
        if found is not None:
            own = measure.measured(found, profile, record.step)
            columns["measured"] = own.quantities
            for label, sailor in zip(MODELS, sailors, strict=False):
                sailed = simulated.as_recorded(sailor, found, record, own.drift, MEMBERS)
                columns[label] = {} if sailed is None else sailed.quantities
        for name, value in one["true"].items():
            row = {
                "trial": one["trial"], "quantity": name, "true": value,
                "calm": one["calm"].get(name),
            }  # fmt: skip
            for label, quantities in columns.items():
                if name in quantities:
                    e = quantities[name]
                    row[label] = [e.value, e.low, e.high, e.note]
            rows.append(row)
    return rows


def _coefficients(ship: Ship, run: Path) -> list[dict[str, Any]]:
    loaded = load_model.load(run)
    true = true_coefficients(ship, particulars(loaded.profile)[0].density)
    return [
        {
            "name": one.name, "kind": true[one.name][1], "true": true[one.name][0],
            "value": one.value, "low": one.low, "high": one.high, "typical": list(one.typical),
            "verdict": one.verdict, "between": one.between,
        }
        for one in trust_file.of_run(loaded)
        if one.name in true
    ]  # fmt: skip
