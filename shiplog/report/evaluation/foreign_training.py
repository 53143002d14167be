"""The result of `shiplog train` of a simulator of one's own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.exceptions import listed
from shiplog.foreign.model import SAME
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted, figure
from shiplog.report.evaluation.judgement import BASELINES
from shiplog.report.result import Answer
from shiplog.simulation.foreign_model import Failure, sentences
from shiplog.training.runs.foreign_run import Kept
from shiplog.training.runs.load_model import Run

SLOW_S = 0.002  # s for an acceleration, from which on a diagnosis takes hours
OF_A_DIAGNOSIS = 4e6  # accelerations that a diagnosis of half an hour asks for, with differences
MOST = 5  # failures that are listed


@dataclass(frozen=True, repr=False)
class ForeignTraining:
    """A simulator that was tried on the voyages that it is good for.

    facts      what was found out by calling it
    losses     [N] L of each window; infinite where it failed or diverged
    kept       the stand-in
    why        why nothing stands in; empty where something does
    failures   where it failed
    """

    run: Run
    facts: Mapping[str, Any]
    losses: np.ndarray
    baselines: Mapping[str, float]
    kept: Kept
    why: str
    failures: tuple[Failure, ...]

    def answer(self, store: Path) -> Answer:
        name = self.run.config.foreign.name
        given = "" if self.facts["layout"] == "logged" else f"--simulator {name}"
        lines = [
            *self.lines, f"Next: shiplog evaluate {self.run.path} --store {store} {given}".rstrip()
        ]  # fmt: skip
        return Answer(lines, self.json, complete=not self.failures)

    @property
    def lines(self) -> list[str]:
        run, of = self.run, self.run.config.foreign
        sound = np.isfinite(self.losses)
        windows = f"{counted(len(self.losses), 'window')} of {run.config.window} s"
        baselines = ", ".join(f"{loss:.0f} {BASELINES[n]}" for n, loss in self.baselines.items())
        loss = f"L {self.losses[sound].mean():.0f}" if sound.any() else "It failed in every window"
        lost = ""
        if sound.any() and not sound.all():
            lost = f" on {int(sound.sum())} of them; in the others it failed"
        return [
            f"{of.name} in {run.path}, nothing fitted; {listed(run.config.split.training)}: "
            f"{windows}.",
            self._what,
            f"{loss}{lost}. Baselines on these windows: {baselines}.",
            f"Sensitivities: {of.derivatives}.",
            self._stand_in,
            *self.remarks,
        ]

    @property
    def _what(self) -> str:
        of = self.run.config.foreign
        if of.kind == "logged":
            return (
                "It is of states that were logged: each window begins where the ship was, with "
                "the velocities that the simulator had."
            )
        return (
            f"It gives the {of.returns}, of {self._how}; SHA-256 {of.sha256[:12]}. The run keeps "
            "no code of it."
        )

    @property
    def _how(self) -> str:
        layout = {"rows": "many rows at once", "columns": "many columns at once"}
        return layout.get(self.facts["layout"], "one row after another")

    @property
    def _stand_in(self) -> str:
        if self.why or not len(self.kept.values):
            return f"Causes that change the ship cannot be tested: {self.why}"
        left = ", ".join(
            f"{share:.0%} of {name}"
            for share, name in zip(self.kept.misfit, ("surge", "sway", "yaw"), strict=True)
        )
        return (
            "Causes that change the ship change an MMG that was fitted to its accelerations, and "
            f"leaves {left}."
        )

    @property
    def remarks(self) -> list[str]:
        """What is odd of it, in sentences."""
        name, facts, found = self.run.config.foreign.name, self.facts, []
        if facts["random"] > 0.0:
            found.append(
                f"{name} is not deterministic: the same state and inputs gave accelerations that "
                f"differ by {facts['random']:.2g} of the largest. All that follows is of one draw."
            )
        if facts["seconds"] > SLOW_S:
            hours = facts["seconds"] * OF_A_DIAGNOSIS / 3600.0
            found.append(
                f"{name} takes {figure(facts['seconds'])} s for an acceleration: a diagnosis of "
                f"half an hour would take about {figure(hours)} h."
            )
        if facts["sound"] < 1.0:
            words = facts["troubles"][0][2] if facts["troubles"] else "gave no number"
            found.append(
                f"{name} failed at {1.0 - facts['sound']:.0%} of the states at which it was "
                f"tried: it {words}."
            )
        if facts["changes"]:
            found.append(f"{name} changes its arguments; it was given copies.")
        if facts["time"] > SAME:
            found.append(
                f"{name} depends on the time: a diagnosis asks it at the beginning of a voyage."
            )
        if facts["place"] > SAME:
            found.append(f"{name} depends on where the ship is.")
        found += sentences(name, self.failures)[:MOST]
        return found

    @property
    def json(self) -> dict:
        of = self.run.config.foreign
        sound = np.isfinite(self.losses)
        return {
            "contract": CONTRACT,
            "run": str(self.run.path),
            "label": self.run.label,
            "simulator": of.model_dump(mode="json"),
            "windows": len(self.losses),
            "loss": float(self.losses[sound].mean()) if sound.any() else None,
            "failed_windows": int((~sound).sum()),
            "stand_in": {"misfit": self.kept.misfit.tolist(), "why": self.why},
            "remarks": self.remarks,
            "failures": [asdict(one) for one in self.failures],
            "split": self.run.config.split.model_dump(mode="json"),
        }
