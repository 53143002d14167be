"""Runs in a child process of either build: answers lines of JSON on stdin by lines on stdout.

It uses only what the standard library, numpy and `NAMES` have, so that one file serves both builds.
Times are processor seconds of this process, which has one thread.
"""

from __future__ import annotations

import dataclasses
import inspect
import json
import os
import shutil
import sys
import time
import traceback
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

SHIP = "esso-osaka"
FINE_NATS_STEP = 0.02  # in log λ, of the fine grid: a quarter of the step of the search
# What is used of shiplog → its modules, of the newer builds first.
NAMES = {
    "geometry_of": ("models.mmg.geometry",), "MMG": ("models.mmg.model",),
    "load": ("models.mmg.parameters",), "published_file": ("models.mmg.parameters",),
    "testable": ("models.causes",),
    "profile_file": ("ship_profile.file", "profile_file"),
    "sensitivities": ("simulation.sensitivities",),
    "identify": ("training.physics.output_error", "training.output_error"),
    "load_model": ("training.runs.load_model", "training.load_model"),
    "Store": ("voyages.store.store", "voyages.store"),
    "parts": ("voyages.store.parts", "voyages.parts"),
    "segments": ("diagnosis.linear.segments", "diagnosis.segments"),
    "linearisation": ("diagnosis.linear.linearisation", "diagnosis.linearisation"),
    "read": ("diagnosis.linear.measurement_correction", "diagnosis.measurement_correction"),
    "trial_voyages": ("diagnosis.trial.trial_voyages", "diagnosis.trial_voyages"),
    "setup": ("diagnosis.trial.setup", "diagnosis.setup"),
    "evidence": ("diagnosis.hypotheses.evidence", "diagnosis.evidence"),
    "health": ("logs.health.health_report", "logs.health_report"),
    "Profile": ("ship_profile.profile", "profile"),
}  # fmt: skip
MODULES = frozenset({  # of which the module itself is meant
    "profile_file", "sensitivities", "load_model", "parts", "segments", "linearisation",
    "trial_voyages", "setup", "evidence", "health",
})  # fmt: skip


def of(name: str) -> Any:
    """The module or its member, wherever this build has it."""
    for place in NAMES[name]:
        try:
            module = import_module(f"shiplog.{place}")
        except ModuleNotFoundError:
            continue
        return module if name in MODULES else getattr(module, name)
    raise LookupError(f"this build has no {name} in {' or '.join(NAMES[name])}")


# --- a store and a run as this build reads them


def readable(store, run, out):
    """Copies without what this build does not know, tables as they are; what was left out."""
    left = set()
    for folder in sorted(Path(store).glob("voyage=*")):
        new = Path(out) / "store" / folder.name
        new.mkdir(parents=True)
        shutil.copyfile(folder / "table.parquet", new / "table.parquet")
        facts = json.loads((folder / "voyage.json").read_text(encoding="utf-8"))
        report, health = facts["report"], of("health")
        for key, kind in (("instruments", health.Instrument), ("findings", health.Finding)):
            known = {one.name for one in dataclasses.fields(kind)}
            for one in report.get(key, ()):
                left |= {f"{key}.{name}" for name in set(one) - known}
            report[key] = [{n: v for n, v in one.items() if n in known} for one in report[key]]
        facts["profile"] = _known(of("Profile"), facts["profile"], left)
        (new / "voyage.json").write_text(json.dumps(facts), encoding="utf-8")
    new = Path(out) / "run"
    shutil.copytree(run, new, ignore=shutil.ignore_patterns("*.rrd", "evaluation"))
    profile = json.loads((new / "profile.json").read_text(encoding="utf-8"))
    (new / "profile.json").write_text(
        json.dumps(_known(of("Profile"), profile, left)), encoding="utf-8"
    )
    return {"left_out": sorted(left)}


def _known(model, content, left):
    """What a pydantic model accepts of this content: keys that it refuses are taken out."""
    from pydantic import ValidationError

    while True:
        try:
            model.model_validate(content)
            return content
        except ValidationError as error:
            extra = [one["loc"] for one in error.errors() if one["type"] == "extra_forbidden"]
            if not extra:
                raise
            for place in extra:
                holder = content
                for key in place[:-1]:
                    holder = holder[key] if not isinstance(holder, list) else holder[int(key)]
                holder.pop(place[-1], None)
                left.add("profile." + str(place[-1]))


# --- jobs


class Jobs:
    """What was loaded, and a function for each row of the table."""

    def __init__(self):
        self.jobs = {}
        self.facts = {}

    def windows(self, path):
        """Rollouts, derivatives and an identification on the windows of a file."""
        data = np.load(path)
        s, geometry = of("sensitivities"), of("geometry_of")(of("profile_file").load(SHIP))[0]
        model, known = of("MMG")(geometry), of("load")(of("published_file")(SHIP), geometry)
        given = s.WindowSeries(*(data[key] for key in s.WindowSeries._fields))
        noisy = given._replace(measured=data["noisy"])
        theta, bounds = known.values, (known.low, known.high)
        kept: list = []

        def derivatives():
            """In the memory of the call before, where the build can: CasADi keeps its own, too."""
            if "out" not in inspect.signature(s.linearised).parameters:
                return s.linearised(model, theta, given)[1]
            kept[:] = [s.linearised(model, theta, given, kept[0] if kept else None)]
            return kept[0][1]

        self.jobs |= {
            "rollout": lambda: s.rollout(model, theta, given),
            "derivatives": derivatives,
            "normal": lambda: _normal(s.normal(model, theta, noisy)),
            "identification": lambda: (
                of("identify")(model, theta, known.spread, noisy, bounds=bounds).values
            ),
        }
        self.facts |= {"coefficients": list(model.names)}

    def casadi(self, path, samples):
        """The same derivatives by CasADi, its step compiled by gcc."""
        from pipelines.experiments.benchmarks.casadi_mmg import Peer

        s, geometry = of("sensitivities"), of("geometry_of")(of("profile_file").load(SHIP))[0]
        model, known = of("MMG")(geometry), of("load")(of("published_file")(SHIP), geometry)
        data = np.load(path)
        given = s.WindowSeries(*(data[key] for key in s.WindowSeries._fields))
        peer = Peer(geometry, model.names, given, compiled=True).variational()
        self.jobs["casadi"] = lambda: peer(known.values).transpose(0, 1, 3, 2)

    def segments(self, store, run, voyages):
        """Passes of the diagnosis over the segments of some voyages: about the first path."""
        run, store, v = (
            of("load_model").load(Path(run)),
            of("Store")(Path(store)),
            of("trial_voyages"),
        )
        names = store.select(list(voyages))
        profile = store.profile(names)
        there = store.there(run.trained_on)
        nominal, recorded = v.record_of(store, there, profile), v.record_of(store, names, profile)
        scaled = getattr(v, "rescale_time", None) or v.in_ship_time
        self.records = run, *scaled(run, nominal, recorded)
        run, nominal, recorded = self.records
        setting = v.setting_of(run, nominal, recorded)
        causes, _ = of("testable")(setting)
        model, start = v.model_of(run, causes, setting)
        seg, lin = of("segments"), of("linearisation")
        grid, rows = seg.grid(recorded), seg.begins(recorded)
        cut, moved, _ = of("read")(model, setting, recorded, rows)
        numbers = sum(len(cause.sizes(setting)) for cause in causes)
        theta = np.concatenate((start.values, np.zeros(numbers)))
        path = lin.first_path(model, theta, cut, grid)
        self.jobs |= {
            "numbers": lambda: lin.simulated(model, theta, cut, path, grid, moved),
            "path": lambda: lin.simulated(model, theta, cut, path, grid),
        }
        labels = [cause.label for cause in causes]
        self.facts |= {"segments": len(rows), "numbers": len(theta), "causes": labels}

    def evidence(self):
        """Log evidence as the program reads it, and the greatest of a fine grid of λ about its
        own; of no cause, and of the cause that is ahead by itself."""
        run, nominal, recorded = self.records
        e = of("evidence")
        made = of("setup").trial_of(run, nominal, recorded, [])
        trial, point = e.begin(made.trial, run.extension_numbers())
        candidates = [c for c in trial.reference.model.causes if c.label not in trial.fixed]
        base, over = e.scan(trial, point, candidates, trial.fixed)
        weighed: list[tuple[str, tuple[str, ...], Any]] = [("no cause", trial.fixed, base)]
        for ahead in over[:1]:
            included = (*trial.fixed, ahead.name)
            weighed.append((ahead.name, included, e.scan(trial, point, (), included)[0]))
        found = []
        for label, included, read in weighed:
            near = np.log(getattr(read, "noise_factor", None) or read.noise)
            steps = FINE_NATS_STEP * np.arange(-8, 9)
            grid = [e.level(trial, point, float(np.exp(near + s)), included).value for s in steps]
            best = int(np.argmax(grid))
            found.append({"name": label, "read": float(read.evidence), "grid": float(max(grid)),
                          "inside": 0 < best < len(grid) - 1})  # fmt: skip
        return {"found": found}


def _normal(found):
    """Loss, gradient and JᵀJ in one array."""
    values = [np.ravel(getattr(found, one.name)) for one in dataclasses.fields(found)]
    return np.concatenate([np.asarray(v, float) for v in values if np.asarray(v).dtype.kind == "f"])


def arrays(result):
    """Results as arrays, for a file. A pass has y and its columns, which newer builds give as those
    of the path and those of the numbers."""
    every = result if isinstance(result, tuple) else (result,)
    first, *others = [np.asarray(one) for one in every if one is not None]
    joined = [np.concatenate(others, -1)] if others else []
    return {f"a{number}": one for number, one in enumerate([first, *joined])}


def make_windows(path, count, seed):
    """The synthetic windows of `benchmarks.rollouts`, and what noisy sensors of another ship say of
    them."""
    from pipelines.experiments.benchmarks import rollouts

    model = of("MMG")(of("geometry_of")(of("profile_file").load(SHIP))[0])
    known = of("load")(of("published_file")(SHIP), model.geometry)
    rng = np.random.default_rng(seed)
    data = rollouts.inputs(count, rng)
    _, noisy = rollouts.measurements(model, known, data, rng)
    every: dict[str, Any] = {"noisy": noisy.measured, **data._asdict()}
    np.savez(path, **every)
    return {"samples": rollouts.SAMPLES}


def main():
    jobs = Jobs()
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever libraries print is no answer
    actions = {
        "readable": readable, "make_windows": make_windows, "windows": jobs.windows,
        "casadi": jobs.casadi, "segments": jobs.segments, "evidence": jobs.evidence,
        "facts": lambda: jobs.facts,
    }  # fmt: skip
    for line in sys.stdin:
        asked = json.loads(line)
        action = asked.pop("do")
        try:
            began = time.process_time()
            if action == "time":
                jobs.jobs[asked["job"]]()
                found = None
            elif action == "save":
                results: dict[str, Any] = arrays(jobs.jobs[asked["job"]]())
                np.savez(asked["path"], **results)
                found = None
            else:
                found = actions[action](**asked)
            answer = {"seconds": time.process_time() - began, "found": found}
        except Exception as error:
            traceback.print_exc()
            answer = {"error": f"{type(error).__name__}: {error}"}
        print(json.dumps(answer), file=answers, flush=True)


if __name__ == "__main__":
    main()
