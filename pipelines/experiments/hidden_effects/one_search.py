"""The verdict as it is, and without each part that acts after the search, from one search.

A part that changes nothing in what is decided leaves the verdict as it is: it is then copied.
"""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

from pipelines.experiments.hidden_effects import plan as plans
from pipelines.experiments.hidden_effects import run
from shiplog.cli import process
from shiplog.diagnosis import thresholds
from shiplog.diagnosis.decision_parts import ALL, Parts
from shiplog.diagnosis.hypotheses.search import Search
from shiplog.diagnosis.noise.remainder import NOMINAL
from shiplog.diagnosis.trial import setup
from shiplog.diagnosis.verdict import decide, posterior, trial_decision

WITHOUT = "verdict-without-{}.json"


def diagnose(arguments: Sequence[str], parts: Mapping[str, Parts]) -> None:
    """`shiplog diagnose RUN ... --out OUT --json FILE`, and next to FILE the verdict without each
    part. A verdict that these data do not allow, as `coverage`, is the same without any part."""
    given = list(arguments)
    if not {"--out", "--json"} <= set(given):
        sys.exit("No --out or no --json was given: name both, the verdicts are written there.")
    out, file = (given.index(option) + 1 for option in ("--out", "--json"))
    verdict, folder = Path(given[file]), Path(given[out])
    kept = _Kept()
    with kept.searches():
        rc = process.run(given)
        as_it_is = _decided(kept)
        for name, part in parts.items():
            again = verdict.with_name(WITHOUT.format(name))
            kept.parts = part
            if _decided(kept) == as_it_is:
                shutil.copyfile(verdict, again)
                continue
            given[out], given[file] = str(folder.with_name(f"d-{name}")), str(again)
            process.run(given, part)
    sys.exit(rc)


def distribute(whole: Path, parts: Mapping[str, Path]) -> None:
    """The verdicts without each part, sealed, as answers of a test of its own."""
    planned = plans.load(whole)
    for name, out in parts.items():
        plans.save(out, planned)
        for one in planned.cases:
            source, folder = plans.case_folder(whole, one), plans.case_folder(out, one)
            if not (source / WITHOUT.format(name)).exists():
                continue
            folder.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source / WITHOUT.format(name), folder / "verdict.json")
            run.seal(folder, json.loads((source / "steps.json").read_text(encoding="utf-8")))
            shutil.copyfile(plans.key_path(whole, one), plans.key_path(out, one))


class _Kept:
    """The set-ups and searches of the first diagnosis, for those that follow; by the numbers of
    causes that each begins with, since a given model is searched twice."""

    def __init__(self) -> None:
        self.made: dict[tuple, setup.Setup] = {}
        self.found: dict[tuple, Any] = {}
        self.parts = ALL

    @contextmanager
    def searches(self) -> Iterator[None]:
        with ExitStack() as stack:
            for module, name, kept in (
                (setup, "trial_of", self.made), (trial_decision, "_searched", self.found)
            ):  # fmt: skip
                once = self._once(getattr(module, name), kept)
                stack.enter_context(patch.object(module, name, once))
            yield

    def _once(self, made: Callable, kept: dict[tuple, Any]) -> Callable:
        def once(*given, **named):
            numbers = given[-1] or {}
            key = tuple((label, *map(float, numbers[label])) for label in sorted(numbers))
            if key not in kept:
                kept[key] = made(*given, **named)
            self.take_back()
            return kept[key]

        return once

    def take_back(self) -> None:
        """Every search as before any name was refuted, to be decided with `parts`; further sets may
        have been weighed."""
        for found in self.found.values():
            found.search.table.banned.clear()
            found.search.table.parts = self.parts


def _decided(kept: _Kept) -> object:
    """All on which the verdict depends, but what held-out voyages say of it; like nothing else
    where a second search depends on the first one's decision."""
    if not kept.found:
        return None
    if len(kept.found) > 1:
        return object()
    kept.take_back()
    search: Search = next(iter(kept.found.values())).search
    decision, found = decide.decide(search)
    names = [one.cause.name for one in decision.named]
    slight = posterior.slight(search.table, posterior.best_with(found, names))
    remains = 1.0 - found.kinds.get(NOMINAL, 0.0) >= thresholds.STATED
    return (
        decision.verdict, tuple(one.cause.label for one in decision.named), decision.structure,
        decision.side_force is None, decision.one_of, decision.either, decision.why,
        decision.rejected, slight, remains, names and kept.parts.refutation,
    )  # fmt: skip
