"""What physics and diagnosis cost: the table, beside an older build of shiplog and beside CasADi.

    git worktree add ../older 6fd94d0
    python -m pipelines.experiments.benchmarks.diagnosis_cost --beside ../older --work cost

Rows take turns with the older build, which runs on its own sources with this interpreter and keeps
a cache of its own. Results are compared first; a row that is not equal has no ratio. Times are
processor seconds of one thread. Pin it to a core with `taskset -c 1`. Without --beside, what this
build takes.

Stored trials are those of the block `goals` of hidden effects: --block names a folder that was made
with --keep; else they are made in --work, once.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
from collections.abc import Iterator
from pathlib import Path

from pipelines.experiments.benchmarks.diagnosis_cost import cases, commands, kernels, many_voyages
from pipelines.experiments.benchmarks.diagnosis_cost.builds import LEVEL, ROOT, Build, Failed
from pipelines.experiments.benchmarks.diagnosis_cost.table import Row, lines
from pipelines.experiments.benchmarks.machine import processor

HALF = 0.5  # of each ratio is asked with AVX2 alone
ALL = 1000  # voyages of the fleet that is asked


def main() -> int:
    given = arguments()
    work = given.work.absolute()
    scratch = work / "scratch"
    scratch.mkdir(parents=True, exist_ok=True)
    level = {LEVEL: given.level} if given.level else {}
    ours = Build("this build", ROOT, work / "cache-ours", level)
    older = None
    if given.beside is not None:
        if not (given.beside / "shiplog").is_dir():
            sys.exit(
                f"{given.beside} has no shiplog: make it with `git worktree add FOLDER COMMIT`."
            )
        older = Build("older build", given.beside.absolute(), work / "cache-older")
    machine = {
        "processor": processor(), "system": platform.platform(),
        "python": platform.python_version(), "this_build": ours.commit,
        "other_build": older.commit if older else None,
        "level": given.level or "the processor's own", "threads": 1,
    }  # fmt: skip
    print(", ".join(f"{key.replace('_', ' ')}: {value}" for key, value in machine.items()))
    rows: list[Row] = []
    for row in measured(given, ours, older, work, scratch):
        rows.append(row)
        print("\n".join(lines([row])[2:]), file=sys.stderr, flush=True)
        if given.json is not None:
            content = {"machine": machine, "rows": [one.as_json() for one in rows]}
            given.json.write_text(json.dumps(content, indent=1), encoding="utf-8")
    print("\n".join(["", *lines(rows)]))
    for row in rows:
        for changed in row.facts.get("verdicts_that_differ", ()):
            print(f"another verdict: {changed}")
        for label, away in row.facts.get("numbers_apart", {}).items():
            print(f"{label}: the same verdict, its numbers at most {away:.1e} of an interval apart")
    return 1 if any(row.holds is False for row in rows) else 0


def measured(
    given: argparse.Namespace, ours: Build, older: Build | None, work: Path, scratch: Path
) -> Iterator[Row]:
    share = HALF if given.level == "avx2" else 1.0
    wanted = given.only
    if "kernels" in wanted:
        yield from tried("windows", kernels.windows(
            ours, older, scratch, given.windows, given.rounds, share))  # fmt: skip
    if {"passes", "trials"} & set(wanted):
        try:
            block = given.block or work / "block"
            made = cases.of_block(block, given.cases, older, work / "cases")
        except Failed as error:
            yield Row("stored trials", "s", reason=str(error))
            made = []
        if made and "passes" in wanted:
            yield from tried("passes", kernels.passes(
                ours, older, made[0], scratch, given.rounds, share))  # fmt: skip
        if made and "trials" in wanted:
            yield from tried("diagnose", commands.trials(
                ours, older, made, scratch, given.repeats, share))  # fmt: skip
    if given.given is not None:
        run, store = given.given
        try:
            case = cases.both(store, run, older, work / "given", "given", "given", ("*",))
            yield commands.given(ours, older, case, scratch, share)
        except Failed as error:
            yield Row("voyages against a given model", "s", reason=str(error))
    if given.voyages:
        yield from tried("many voyages", fleet(given, ours, work, scratch))


def fleet(given: argparse.Namespace, ours: Build, work: Path, scratch: Path) -> Iterator[Row]:
    counts = sorted(given.voyages)
    place = many_voyages.make(work / "many", counts[-1], given.hours, ours, scratch)
    found = []
    for count, used in commands.many(ours, place, counts, scratch):
        found.append((count, used))
        print(f"{count} voyages: {used.cpu_s:.1f} s, {used.peak_mb:.0f} MB", file=sys.stderr)
    yield from commands.of_many(given.hours, found, ALL)


def tried(what: str, rows: Iterator[Row]) -> Iterator[Row]:
    """The rows; of those that a process failed at, a row that says why."""
    try:
        yield from rows
    except Failed as error:
        yield Row(what, "s", reason=str(error))


PARTS = ("kernels", "passes", "trials")


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--beside", type=Path, help="sources of an older build")
    parser.add_argument("--work", type=Path, default=Path("cost"), help="folder for what is made")
    parser.add_argument(
        "--only", nargs="*", choices=PARTS, default=PARTS, help="parts of the table"
    )
    parser.add_argument("--windows", type=int, default=119, help="of 100 s")
    parser.add_argument("--rounds", type=int, default=9, help="of each function")
    parser.add_argument(
        "--block", type=Path, help="kept cases of hidden_effects; made unless given"
    )
    parser.add_argument("--cases", type=int, default=3, help="trials of 7000 s; 40 for the table")
    parser.add_argument("--repeats", type=int, default=1, help="of each later case")
    parser.add_argument("--given", nargs=2, type=Path, metavar=("RUN", "STORE"),
                        help="a given model and its voyages: slow")  # fmt: skip
    parser.add_argument("--voyages", nargs="*", type=int, default=[], metavar="N",
                        help="voyages of one ship, such as 10 30 100 1000: slow")  # fmt: skip
    parser.add_argument("--hours", type=float, default=2.0, help="length of such a voyage")
    parser.add_argument("--level", choices=("portable", "avx2", "avx512"),
                        help="instructions of this build; of avx2 half is asked")  # fmt: skip
    parser.add_argument("--json", type=Path, help="write all values as JSON")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
