"""Rows of whole commands: `diagnose` of stored trials, of a given model, of very many voyages."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from pipelines.experiments.benchmarks.diagnosis_cost.builds import (
    Build,
    Used,
    command,
    fresh,
)
from pipelines.experiments.benchmarks.diagnosis_cost.cases import TRIAL_S, Case
from pipelines.experiments.benchmarks.diagnosis_cost.table import Row

FIRST, LATER, WORST, GIVEN = 3.0, 4.0, 3.0, 6.0  # ratios that are asked
PEAK_GB = 0.8
FLEET_GB = 16.0


def diagnosed(build: Build, place: Path, voyages: Sequence[str], scratch: Path) -> Used:
    out = scratch / "diagnosis"
    shutil.rmtree(out, ignore_errors=True)
    chosen = [word for pattern in voyages for word in ("--voyages", pattern)]
    run, store = str(place / "run"), str(place / "store")
    return command(build, ["diagnose", run, *chosen, "--store", store, "--out", str(out)], scratch)


def trials(
    ours: Build,
    older: Build | None,
    cases: Sequence[Case],
    scratch: Path,
    rounds: int,
    share: float,
) -> Iterator[Row]:
    """Of each ship its first trial with nothing compiled, then all of them. The builds take turns,
    and which one begins."""
    first: list[list[Used]] = [[], []]
    later: list[list[Used]] = [[], []]
    changed: list[str] = []
    away: dict[str, float] = {}  # case → largest difference of a number of the same verdict
    builds = [build for build in (ours, older) if build is not None]

    def measure(case: Case, into: list[list[Used]], turn: int) -> None:
        found: dict[str, Used] = {}
        for build in builds if turn % 2 == 0 else builds[::-1]:
            place = case.ours if build is ours else case.theirs
            assert place is not None
            found[build.name] = diagnosed(build, place, case.voyages, scratch)
        for number, build in enumerate(builds):
            into[number].append(found[build.name])
        if len(builds) > 1:
            own, other = (found[build.name].answer for build in builds)
            if _verdict(own) != _verdict(other):
                changed.append(f"{case.label}: {weighed(other)} became {weighed(own)}")
            else:
                away[case.label] = apart(own, other)

    turn = 0
    for ship in dict.fromkeys(case.ship for case in cases):
        own = [case for case in cases if case.ship == ship]
        for build in builds:
            fresh(build)
        measure(own[0], first, turn)
        for case in own:
            for _ in range(rounds):
                turn += 1
                measure(case, later, turn)
        turn += 1
    what = f"diagnose, {TRIAL_S} s"
    facts = {
        "cases": [case.label for case in cases], "verdicts_that_differ": sorted(set(changed)),
        "numbers_apart": away,
    }  # fmt: skip

    def seconds(of: list[list[Used]]) -> tuple[list[float], list[float]]:
        return [one.cpu_s for one in of[0]], [one.cpu_s for one in of[1]]

    yield Row(f"{what}, later case, median of {len(cases)}", "s", *seconds(later),
              least=LATER * share, facts=facts)  # fmt: skip
    yield Row(f"{what}, later case, worst", "s", *seconds(later), least=WORST * share, worst=True)
    yield Row(f"{what}, first case, nothing compiled", "s", *seconds(first), least=FIRST * share)
    peaks = [[one.peak_mb / 1024.0 for one in (*a, *b)] for a, b in zip(later, first, strict=True)]
    yield Row(f"{what}, peak memory", "GB", peaks[0], peaks[1], most=PEAK_GB, worst=True)


def _verdict(answer: dict) -> str:
    causes = "+".join(sorted(cause["name"] for cause in answer["causes"]))
    return f"{answer['verdict']} {causes}".strip()


def weighed(answer: dict) -> str:
    """The verdict, with the log Bayes factor of each named cause and the likeliest answers."""
    nats = [
        f"{one['name']} {value:.1f} nats"
        for one in answer["causes"]
        if (value := one.get("evidence_nats")) is not None
    ]
    likely = [f"{one['name']} {one['probability']:.3f}" for one in answer["ranking"][:3]]
    return f"{_verdict(answer)} ({', '.join(nats + likely)})"


def apart(one: dict, other: dict) -> float:
    """Largest difference of a parameter of the named causes, of its 90 % interval, and of the gain
    by its own size."""

    def gain(of: dict) -> float:
        return of["gain"]["reduction"] if "gain" in of else 0.0

    found = [abs(gain(one) - gain(other)) / max(abs(gain(other)), 1e-3)]
    theirs = {cause["name"]: cause["parameters"] for cause in other["causes"]}
    for cause in one["causes"]:
        for name, own in cause["parameters"].items():
            known = theirs[cause["name"]][name]
            if isinstance(own["value"], str):
                found.append(0.0 if own["value"] == known["value"] else float("inf"))
                continue
            width = max(known["high"] - known["low"], 1e-12)
            found += [abs(own[key] - known[key]) / width for key in ("value", "low", "high")]
    return max(found)


def given(ours: Build, older: Build | None, case: Case, scratch: Path, share: float) -> Row:
    """All voyages of a store against a model as somebody gave it. One round: it takes long."""
    values: list[list[float]] = [[], []]
    said = []
    places = [(ours, case.ours)] + ([(older, case.theirs)] if older and case.theirs else [])
    for number, (build, place) in enumerate(places):
        found = diagnosed(build, place, case.voyages, scratch)
        values[number].append(found.cpu_s)
        said.append(f"{_verdict(found.answer)}, {found.peak_mb / 1024.0:.2f} GB")
    count = sum(1 for _ in (case.ours / "store").glob("voyage=*"))
    return Row(
        f"{count} voyages against a given model", "s", values[0], values[1], least=GIVEN * share,
        facts={"verdicts": said},
    )  # fmt: skip


def many(
    ours: Build, place: Path, counts: Sequence[int], scratch: Path
) -> Iterator[tuple[int, Used]]:
    """`diagnose` of so many made voyages of one ship; the nominal campaign is fitted before."""
    diagnosed(ours, place, ["trial_0000"], scratch)
    for count in counts:
        yield count, diagnosed(ours, place, [f"trial_{n:04d}" for n in range(count)], scratch)


def straight(counts: Sequence[int], values: Sequence[float]) -> tuple[float, float, float]:
    """Least squares: value at none, rise a voyage, and the largest deviation from the line as a
    share of the largest value."""
    rise, at_none = np.polyfit(counts, values, 1)
    off = np.abs(np.asarray(values) - (at_none + rise * np.asarray(counts))).max()
    return float(at_none), float(rise), float(off / max(values))


def of_many(hours: float, found: Sequence[tuple[int, Used]], asked: int) -> Iterator[Row]:
    """Rows of processor time and memory over the number of voyages, with the line through them."""
    counts = [count for count, _ in found]
    last = found[-1]
    what = f"{last[0]} voyages of {hours:g} h of one ship"
    for unit, values, most in (
        ("s", [one.cpu_s for _, one in found], None),
        ("GB", [one.peak_mb / 1024.0 for _, one in found], FLEET_GB),
    ):
        facts: dict = {"voyages": counts, "values": values}
        title = f"{what}: {'processor time' if unit == 's' else 'peak memory'}"
        if len(found) > 1:
            at_none, rise, off = straight(counts, values)
            facts |= {"at_none": at_none, "a_voyage": rise, "off_the_line": off}
            facts[f"at_{asked}"] = at_none + rise * asked
            title += f" ({at_none:.3g} + {rise:.3g} {unit} a voyage from {counts[0]} on, "
            title += f"{off:.0%} off the line; {at_none + rise * asked:.3g} {unit} at {asked})"
        yield Row(title, unit, [values[-1]], most=most, facts=facts)
