"""Which cases a test consists of, and where everything of it lies.

OUT/keys/plan.json    the cases; in `goals` it says what is hidden, so it lies with the keys
OUT/keys/LABEL.json   a key, opened by `score` alone and only after the verdict is sealed
OUT/cases/LABEL/      logs, store, base, d (until the case is done); verdict.json,
                      verdict.sha256, steps.json (times, memory, last words; they stay);
                      with --rivals, rivals.json and rivals.sha256: what simpler methods say;
                      with --oracle, oracle.json: what the truth would gain
OUT/bases/SEED/       with --share, the model of a ship's nominal campaign
"""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from shiplog.exceptions import ShiplogError


def positive(word: str) -> int:
    """A count given on the command line. Raises argparse.ArgumentTypeError below 1."""
    if (number := int(word)) < 1:
        raise argparse.ArgumentTypeError(f"{word} is not positive")
    return number


@dataclass(frozen=True, slots=True)
class Planned:
    """One case. Its label, the folder's name, says nothing of what is hidden."""

    label: str
    seed: int
    cause: str | None  # as the simulator's command takes it; None: drawn by the seed
    size: float | None  # None: drawn by the seed
    seconds: int
    model: str = "mmg"  # of the nominal campaign; a network is trained on the trial itself
    family: str = ""  # of equations, where another simulator writes the logs; empty: the home ship

    @property
    def options(self) -> list[str]:
        """Of the simulator's command `case`, after seed, folder and key. A ship of another family
        has campaigns as long as its own time scale L/U asks for."""
        given = [] if not self.family else ["--family", self.family]
        given += [] if self.cause is None else ["--cause", self.cause]
        given += [] if self.size is None else ["--size", str(self.size)]
        return given if self.family else [*given, "--seconds", str(self.seconds)]


@dataclass(frozen=True, slots=True)
class Plan:
    suite: str
    first_seed: int
    cases: tuple[Planned, ...]


def case_folder(out: Path, planned: Planned) -> Path:
    return out / "cases" / planned.label


def key_path(out: Path, planned: Planned) -> Path:
    return out / "keys" / f"{planned.label}.json"


def load(out: Path) -> Plan:
    try:
        content = json.loads((out / "keys" / "plan.json").read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ShiplogError(
            f"{out} holds no test of hidden effects.",
            hint="give the folder that was --out, or run a suite into it first.",
        ) from error
    cases = tuple(Planned(**one) for one in content["cases"])
    return Plan(content["suite"], content["first_seed"], cases)


def save(out: Path, plan: Plan) -> Plan:
    """Write the plan. One that is there may grow; it must not become another."""
    if (out / "keys" / "plan.json").exists():
        before = load(out)
        if (before.suite, before.first_seed) != (plan.suite, plan.first_seed):
            raise ShiplogError(
                f"{out} holds {before.suite} from seed {before.first_seed}, "
                f"not {plan.suite} from {plan.first_seed}.",
                hint="choose another --out: one folder, one test.",
            )
        old = {planned.label: planned for planned in before.cases}
        if changed := [p.label for p in plan.cases if old.get(p.label, p) != p]:
            raise ShiplogError(
                f"Case {changed[0]} in {out} hides something else than it does now.",
                hint="the catalogue has changed since: choose another --out.",
            )
        plan = max(before, plan, key=lambda one: len(one.cases))
    (out / "keys").mkdir(parents=True, exist_ok=True)
    content = {
        "contract": 1,
        "suite": plan.suite,
        "first_seed": plan.first_seed,
        "cases": [asdict(planned) for planned in plan.cases],
    }
    (out / "keys" / "plan.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return plan
