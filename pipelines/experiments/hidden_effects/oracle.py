"""What the truth would gain: the held-out error with exactly what was hidden in the model.

python -m pipelines.experiments.hidden_effects.oracle BASE --case FOLDER --key KEY
    --store STORE --json FILE

The key is opened here, and so only once the verdict is sealed. What was hidden enters as the
catalogue's own term with the key's numbers; where the simulator has it in another form, or it is
outside the catalogue, there is no oracle.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from pipelines.experiments.hidden_effects.parameters import OTHER_FORM
from pipelines.experiments.hidden_effects.score import open_key
from shiplog.diagnosis.trial.trial_voyages import record_of, setting_of, windows_of
from shiplog.diagnosis.verdict.held_out import Rollouts
from shiplog.exceptions import ShiplogError
from shiplog.models.causes import CATALOGUE, Cause, Setting, constants_of
from shiplog.training.runs import load_model
from shiplog.voyages.store.store import Store

Truth = Mapping[str, Any]  # a cause of a key: name, and parameters as the contract has them


def true_cause(truth: Truth, setting: Setting) -> tuple[Cause, np.ndarray] | None:
    """The catalogue's cause and the numbers that show what the key says; None where none does."""
    hidden = {k: p["value"] for k, p in truth["parameters"].items()}
    channel, unit = hidden.pop("channel", None), hidden.pop("unit", "")
    for one in CATALOGUE:
        if one.name != truth["name"] or getattr(one, "channel", None) != channel:
            continue
        if truth["name"] in OTHER_FORM or one.missing(setting):
            return None
        for cause in one.each(setting):  # of one unit alone, or of all together
            if getattr(cause, "actuator", "") == unit:
                return cause, numbers(cause, hidden, setting)
    return None


def numbers(cause: Cause, hidden: Mapping[str, float], setting: Setting) -> np.ndarray:
    """[count] whose `shown` equals the known values; every other number is zero."""
    size = cause.sizes(setting)

    def off(x: np.ndarray) -> np.ndarray:
        shown = cause.displayed(x * size)
        away = []
        for name, (value, unit) in shown.items():
            if name not in hidden:
                away.append(0.0)
            elif unit == "deg":  # on the circle, so that 359 is near 1
                apart = np.radians(float(value) - hidden[name])
                away += [np.sin(apart), 1.0 - np.cos(apart)]
            else:
                away.append(float(value) - hidden[name])
        return np.array(away)

    starts = [sign * np.ones(cause.count) for sign in (0.5, -0.5)]
    if cause.count == 2:  # a direction has four quarters
        starts += [np.array([0.5, -0.5]), np.array([-0.5, 0.5])]
    found = min((least_squares(off, at, xtol=1e-12) for at in starts), key=lambda f: f.cost)
    if found.cost > 1e-6:
        raise ShiplogError(f"No numbers of {cause.label} show {dict(hidden)}.")
    return found.x * size


def oracle(
    base: Path, store: Store, voyages: Sequence[str], hidden: Sequence[Truth]
) -> dict[str, float] | None:
    """L of the trial's windows before and with the truth, and the reduction."""
    run = load_model.load(base)
    names = store.select(list(voyages))
    profile = store.profile(names)
    recorded = record_of(store, names, profile)
    cut = windows_of(run, store, names, profile)
    setting = setting_of(run, recorded, recorded)
    true = [true_cause(one, setting) for one in hidden]
    known = [one for one in true if one is not None]
    if cut is None or not known or len(known) < len(true):
        return None
    held = Rollouts(cut, run.extended(run.config.seeds[0], recorded))
    causes = [cause for cause, _ in known]
    simulator = held.before.with_causes(
        causes, {cause.label: p for cause, p in known}, None, constants_of(causes, setting)
    )
    after = held.parts(simulator.states(cut, simulator.theta))
    found = held.gain_between(held.losses_before, after)
    return {"before": found.before, "after": found.after, "reduction": found.reduction}


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m pipelines.experiments.hidden_effects.oracle",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("base", type=Path)
    parser.add_argument("--case", type=Path, required=True, help="with its sealed verdict")
    parser.add_argument("--key", type=Path, required=True)
    parser.add_argument("--store", type=Path, required=True)
    parser.add_argument("--voyages", nargs="+", default=["trial_*"])
    parser.add_argument("--json", type=Path, required=True)
    given = parser.parse_args(arguments)
    try:
        _, key = open_key(given.case, given.key)
        hidden = key["causes"] if key["verdict"] == "named" else []
        found = oracle(given.base, Store(given.store), given.voyages, hidden) if hidden else None
    except ShiplogError as error:
        print(error, file=sys.stderr)
        return 1
    given.json.write_text(json.dumps({"oracle": found}) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
