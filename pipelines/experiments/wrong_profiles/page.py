"""The page of all wrong profiles: what is said of each, by `ingest` and by `diagnose`."""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path

from pipelines.experiments.wrong_profiles.diagnosed import Diagnosed
from pipelines.experiments.wrong_profiles.profiles import Wrong
from pipelines.experiments.wrong_profiles.seen import NAMED, WAYS, Seen, of_way
from shiplog.report.evaluation.text_table import table

HEAD = """# Profiles with one thing wrong

    python -m pipelines.experiments.wrong_profiles --diagnose \\
        --markdown docs/evidence/wrong_profiles.md

Each of these {count} profiles of the sample ship has one wrong unit, sign or place; the first 22
are those that a new user tried. The sample logs are read through it in three ways: both campaigns
(voyages 1 and 3, season 3), the trial only (season 3, in which nothing is hidden), one voyage
(voyage 2). Each belongs to one of three classes:

- *sensors*: the sensors contradict each other, whatever the ship.
- *plausibility*: the profile contradicts itself or the log, or no ship is like that.
- *undetermined*: the record is as likely with it as without. `ingest` lists it as "could not be
  compared", with the reason and what would show it, and blames no other part. Each has its proof, a
  copy: another ship or world whose record, read through the right profile, is this record read
  through the wrong one (`tests/experiments/test_wrong_profiles.py`).

The first two are named before any model is trained, with the key of the profile to change. The
class depends on the voyage: a ship that is fast compared with the gusts shows the unit of its wind,
the model ship of the sample logs does not. The machine: {cores} cores ({machine}).
"""
INGESTED = """
## What ingest says

{right}

{seen}

The undetermined ones. A wind is determined less sharply than the others: its copy is a wind whose
gusts go with the ship's motion, up to 1.4 times as gusty as the first (at 0.15 m/s in 2 m/s).

{left}
"""
DIAGNOSED = """
## What diagnose says

Season 3 is read through the wrong profile and judged by a model of the right one, identified from
voyages 1 to 4. `refused` is exit 1: voyages and model have two profiles of one ship that differ in
a size, a place or a lever arm. Where the voyages read a field with another unit, sign, zero or
order than those of the model, a note of the verdict says so.

{verdicts}
"""
LONG = 240  # characters of a sentence that a row has


def page(
    chosen: Sequence[Wrong], found: Mapping[str, Mapping[str, Seen]],
    verdicts: Mapping[str, Diagnosed],
) -> str:  # fmt: skip
    rows, left, right, named = [], [], 0, 0
    for wrong in chosen:
        of = found[wrong.name]
        classes = [of_way([of[voyage] for voyage in names]) for names in WAYS.values()]
        right += all(one == wrong.seen_by for one in classes)
        named += wrong.seen_by in NAMED and all(one in NAMED for one in classes)
        first = next(iter(of.values()))
        others = dict.fromkeys(other for one in of.values() for other in one.others)
        said = _short(first.said)
        rows.append((wrong.name, *_against(classes, wrong.seen_by), said,
                     first.key or "-", "; ".join(others) or "-"))  # fmt: skip
        if wrong.seen_by == "undetermined":
            left.append((wrong.name, first.said, wrong.copy))
    visible = sum(wrong.seen_by in NAMED for wrong in chosen)
    counted = (
        f"{right} of {len(chosen)} are in the class expected in all three ways. Of the {visible} "
        f"that can be seen, {named} are named in every voyage."
    )
    head = ("wrong", *WAYS, "what is said first", "key to change", "of other channels")
    text = HEAD.format(count=len(chosen), cores=os.cpu_count(), machine=_machine())
    text += INGESTED.format(
        right=counted, seen=table(head, rows),
        left=table(("wrong", "could not be compared", "the copy"), left),
    )  # fmt: skip
    if verdicts:
        text += DIAGNOSED.format(verdicts=_verdicts(chosen, verdicts))
    return text


def _verdicts(chosen: Sequence[Wrong], verdicts: Mapping[str, Diagnosed]) -> str:
    rows = []
    for wrong in chosen:
        if one := verdicts.get(wrong.name):
            rows.append((wrong.name, wrong.seen_by, one.verdict, ", ".join(one.causes) or "-",
                         _short(one.sentence)))  # fmt: skip
    return table(("wrong", "class", "verdict", "causes named", "first words"), rows)


def _against(classes: Sequence[str], expected: str) -> list[str]:
    """The class in each way, with the one expected where it is another one."""
    return [one if one == expected else f"{one} (expected: {expected})" for one in classes]


def _machine() -> str:
    """Type of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _short(text: str) -> str:
    return text if len(text) <= LONG else f"{text[:LONG].rsplit(' ', 1)[0]} ..."
