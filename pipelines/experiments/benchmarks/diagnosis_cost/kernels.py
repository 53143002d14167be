"""Rows of one process each: rollouts, derivatives, an identification, passes of the diagnosis.

Both builds have the same arrays. Their results are compared before anything is timed; then they
take turns, call by call.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from pipelines.experiments.benchmarks.diagnosis_cost.builds import Build, Failed, Worker
from pipelines.experiments.benchmarks.diagnosis_cost.cases import Case
from pipelines.experiments.benchmarks.diagnosis_cost.table import Row

SEED = 0
ALIKE = 1e-6  # of the largest value
# Older builds work the columns of a pass out in single precision, whose rounding adds up.
ALIKE_SINGLE = 1e-4
ALIKE_SPREADS = 1e-3  # of the largest coefficient: where two identifications end
EVIDENCE_NATS = 0.1


@dataclass(frozen=True)
class Asked:
    """A row: the job's name in `served`, the ratio that is asked, and how equal it has to be."""

    job: str
    what: str
    least: float | None
    alike: float
    slow: bool = False  # fewer rounds


WINDOWS = (
    Asked("derivatives", "derivatives by all coefficients", 20.0, ALIKE),
    Asked("normal", "loss, gradient, JᵀJ", 25.0, ALIKE),
    Asked("rollout", "rollout", 6.0, ALIKE),
    Asked("identification", "identification of all coefficients", 15.0, ALIKE_SPREADS, slow=True),
)
PASSES = (
    Asked("numbers", "a pass of the diagnosis, with numbers", 8.0, ALIKE_SINGLE),
    Asked("path", "a pass of the diagnosis, path only", 14.0, ALIKE_SINGLE),
)
CASADI = 4.0  # times as fast as its compiled step


def windows(
    ours: Build, older: Build | None, scratch: Path, count: int, rounds: int, share: float
) -> Iterator[Row]:
    """Rows on synthetic windows of 100 s; `share` of each ratio is asked."""
    path = scratch / "windows.npz"
    workers = [Worker(build, scratch) for build in (ours, older) if build is not None]
    try:
        workers[0].ask("make_windows", path=path, count=count, seed=SEED)
        for worker in workers:
            worker.ask("windows", path=path)
        named = [worker.ask("facts")["coefficients"] for worker in workers]
        what = f"{count} windows x 100 s: "
        for asked in WINDOWS:
            if named.count(named[0]) != len(named):
                yield Row(
                    what + asked.what, "s", reason="the builds' models have other coefficients"
                )
            else:
                yield timed(asked, what, workers, scratch, rounds, share)
        yield casadi(ours, workers[0], path, scratch, rounds, share, what)
    finally:
        for worker in workers:
            worker.close()


def passes(
    ours: Build, older: Build | None, case: Case, scratch: Path, rounds: int, share: float
) -> Iterator[Row]:
    """Rows on the segments of a stored trial, as each build reads it."""
    places = [(ours, case.ours)] + ([(older, case.theirs)] if older and case.theirs else [])
    workers: list[Worker] = []
    try:
        for build, place in places:
            workers.append(Worker(build, scratch))
            workers[-1].ask(
                "segments", store=place / "store", run=place / "run", voyages=list(case.voyages)
            )
        facts = [worker.ask("facts") for worker in workers]
        what = f"{facts[0]['segments']} segments, {facts[0]['numbers']} numbers: "
        alike = all(one == facts[0] for one in facts)
        for asked in PASSES:
            if alike:
                yield timed(asked, what, workers, scratch, rounds, share)
            else:
                yield Row(what + asked.what, "s", reason=_apart(facts))
        yield from evidence(workers, what)
    finally:
        for worker in workers:
            worker.close()


def _apart(facts: Sequence[dict]) -> str:
    differ = [key for key in facts[0] if any(one.get(key) != facts[0][key] for one in facts)]
    return f"the builds differ in {', '.join(differ)}"


def timed(
    asked: Asked, what: str, workers: Sequence[Worker], scratch: Path, rounds: int, share: float
) -> Row:
    """One row: what each gives, then their times in turn. The first call of each, which may
    compile, is that whose result is compared."""
    title = what + asked.what
    least = None if asked.least is None else asked.least * share
    try:
        results = []
        for number, worker in enumerate(workers):
            to = scratch / f"{asked.job}-{number}.npz"
            worker.ask("save", job=asked.job, path=to)
            with np.load(to) as found:
                results.append([found[key] for key in sorted(found.files)])
            to.unlink()
        apart = None
        if len(results) > 1:
            pairs = zip(results[0], results[1], strict=True)
            apart = max(difference(one, other) for one, other in pairs)
        values: list[list[float]] = [[] for _ in workers]
        for _ in range(max(1, rounds // 3) if asked.slow else rounds):
            for worker, own in zip(workers, values, strict=True):
                own.append(worker.seconds(asked.job))
    except (Failed, ValueError) as error:
        return Row(title, "s", reason=str(error))
    theirs = values[1] if len(values) > 1 else ()
    return Row(title, "s", values[0], theirs, least=least, apart=apart, alike=asked.alike)


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference, of the largest value of a column (the last axis); infinite where the
    shapes differ, or what is finite."""
    if one.shape != other.shape or not np.array_equal(np.isfinite(one), np.isfinite(other)):
        return float("inf")
    one, other = np.nan_to_num(one, posinf=0, neginf=0), np.nan_to_num(other, posinf=0, neginf=0)
    axes = tuple(range(one.ndim - 1)) if one.ndim > 1 else None
    largest = np.abs(other).max(axes, initial=0.0)
    return float((np.abs(one - other).max(axes, initial=0.0) / np.maximum(largest, 1e-300)).max())


def casadi(
    ours: Build, worker: Worker, path: Path, scratch: Path, rounds: int, share: float, what: str
) -> Row:
    """Derivatives beside CasADi, whose step gcc has compiled."""
    title = f"{what}derivatives, beside CasADi"
    if find_spec("casadi") is None:
        return Row(title, "s", reason="casadi is not installed: pip install casadi")
    if shutil.which("gcc") is None:
        return Row(title, "s", reason="there is no gcc to compile its step")
    peer = Worker(ours, scratch)
    try:
        peer.ask("casadi", path=path, samples=0)
        results = []
        for number, (one, job) in enumerate(((worker, "derivatives"), (peer, "casadi"))):
            to = scratch / f"casadi-{number}.npz"
            one.ask("save", job=job, path=to)
            with np.load(to) as found:
                results.append(found["a0"])
        own, theirs = results[0][:, 1:, [1, 3, 5]], results[1][:, :, [1, 3, 5]]
        # a window in which one of them diverges says nothing of the equations
        finite = np.isfinite(own).all((1, 2, 3)) & np.isfinite(theirs).all((1, 2, 3))
        apart = difference(own[finite], theirs[finite])
        values: tuple[list[float], list[float]] = ([], [])
        for _ in range(rounds):
            values[0].append(worker.seconds("derivatives"))
            values[1].append(peer.seconds("casadi"))
    except Failed as error:
        return Row(title, "s", reason=str(error))
    finally:
        peer.close()
    return Row(
        title, "s", *values, peer="CasADi, gcc -O3", least=CASADI * share, apart=apart, alike=ALIKE
    )


def evidence(workers: Sequence[Worker], what: str) -> Iterator[Row]:
    """How far the evidence as it is read is below the greatest of a fine grid of noise levels."""
    found = []
    for worker in workers:
        try:
            found.append({one["name"]: one for one in worker.ask("evidence")["found"]})
        except Failed as error:
            found.append({})
            if worker is workers[0]:
                yield Row(f"{what}evidence", "nats", reason=str(error))
    for name, one in found[0].items():
        other = found[1].get(name) if len(found) > 1 else None
        facts = {"read": one["read"], "inside_grid": one["inside"]}
        if other is not None:
            facts["theirs_read"] = other["read"]
        yield Row(
            f"{what}evidence of {name}, off a fine grid of noise levels", "nats",
            [abs(one["grid"] - one["read"])],
            [] if other is None else [abs(other["grid"] - other["read"])],
            most=EVIDENCE_NATS, facts=facts,
        )  # fmt: skip
