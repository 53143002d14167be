"""Answers before and after a change that is to change none: every number, to 1e-9.

    python -m pipelines.experiments.frozen_answers write OUT --data DATA --kept DIR [--source DIR]
    python -m pipelines.experiments.frozen_answers compare BEFORE AFTER [--exactly]

`write` runs the commands of the program in --source (this one unless given) on the sample logs, on
`other_ship` and three trials of the Esso Osaka in DATA, and on eight blind cases that a suite kept
in DIR. `compare` prints how many values each answer holds, how many differ, and the largest
difference. Sentences are counted by themselves: their words may change, not their numbers. With
--exactly a value differs in its last bit, and the files of stores and runs are compared as well:
tables, parameters, weights.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from pipelines.experiments import same_numbers
from shiplog.report.evaluation import tables

ROOT = Path(__file__).parents[2]
EQUAL = 1e-9  # relative, of numbers above one; else absolute
BLIND = 8
TRIALS = ("random_06-Aug-2020_16_24_25_4", "random_06-Aug-2020_16_24_25_6",
          "random_31-Jul-2020_12_48_39")  # fmt: skip
ELSEWHERE = {"recording", "report", "store", "created", "started", "ended", "seconds", "cpu_s"}


def write(out: Path, data: Path, kept: Path, source: Path) -> None:
    """Every answer as OUT/NAME.json; what is there already is not done again."""
    out.mkdir(parents=True, exist_ok=True)
    store = ("--store", out / "store")
    _run(source, "ingest", ROOT / "sample_logs", *store, "--json", out / "ingest.json")
    season1 = ("--voyages", "voyage_1", "--voyages", "voyage_2", "--voyages", "voyage_3")
    _train(source, out, "mmg", "--model", "mmg", *season1, *store)
    _train(source, out, "network", "--epochs", "3", "--width", "16", *season1, *store)
    for run in ("mmg", "network"):
        _run(source, "evaluate", out / run, "--voyages", "voyage_6", *store,
             "--json", out / f"evaluate-{run}.json")  # fmt: skip
    for season in ("season2_*", "season3_*"):
        _diagnose(source, out, season[:7], out / "mmg", season, out / "store")
    ship, own = data / "other_ship", out / "other"
    _run(source, "ingest", ship, "--profile", ship / "other_ship.toml", "--store", own / "store",
         "--json", out / "ingest-other.json")  # fmt: skip
    _train(source, out, "other/mmg", "--model", "mmg", "--voyages", "nominal_*",
           "--store", own / "store")  # fmt: skip
    _diagnose(source, out, "other", own / "mmg", "trial_*", own / "store")
    tables_of = [next((data / "frt-ds-esso").rglob(f"{name}*")) for name in TRIALS]
    esso = out / "esso"
    _run(source, "convert", *tables_of, "--profile", "esso-osaka", "--out", esso / "logs",
         "--json", out / "convert.json")  # fmt: skip
    _run(source, "ingest", esso / "logs", "--profile", "esso-osaka", "--store", esso / "store",
         "--json", out / "ingest-esso.json")  # fmt: skip
    _train(source, out, "esso/mmg", "--model", "mmg", "--no-fit", "--store", esso / "store")
    _diagnose(source, out, "esso", esso / "mmg", "*", esso / "store")
    cases = sorted((kept / "cases").iterdir())
    for case in cases[:: max(1, len(cases) // BLIND)][:BLIND]:
        own_base = case / "base"
        base = own_base if own_base.exists() else kept / "bases" / case.name.split("-")[0]
        _diagnose(source, out, f"blind-{case.name}", base, "trial_*", case / "store")


def _train(source: Path, out: Path, name: str, *options: object) -> None:
    if not (out / name).exists():
        answer = out / f"train-{name.replace('/', '-')}.json"
        _run(source, "train", *options, "--out", out / name, "--json", answer)


def _diagnose(source: Path, out: Path, name: str, run: Path, voyages: str, store: Path) -> None:
    _run(source, "diagnose", run, "--voyages", voyages, "--store", store,
         "--out", out / "reports" / name, "--json", out / f"diagnose-{name}.json")  # fmt: skip


def _run(source: Path, *command: object) -> None:
    words = [str(word) for word in command]
    answer = Path(words[words.index("--json") + 1])
    if answer.exists():
        return
    answer.parent.mkdir(parents=True, exist_ok=True)
    environment = os.environ | {"PYTHONPATH": str(source)}
    done = subprocess.run(
        [sys.executable, "-m", "shiplog.cli", *words], env=environment, cwd=source, check=False
    )
    print(f"{answer.stem}: exit code {done.returncode}", flush=True)


def compare(before: Path, after: Path, equal: float = EQUAL) -> str:
    """A row an answer: values, how many differ, sentences that differ, the largest difference."""
    rows = []
    for path in sorted(before.glob("*.json")):
        other = after / path.name
        if not other.exists():
            rows.append((path.stem, "-", "-", "-", "not there"))
            continue
        old, new = dict(_leaves(_read(path, before))), dict(_leaves(_read(other, after)))
        off = {at: _difference(old.get(at), new.get(at)) for at in old.keys() | new.keys()}
        differ = {at for at, by in off.items() if by > equal}
        sentences = {at for at in differ if _is_sentence(old.get(at)) and _is_sentence(new.get(at))}
        values = {at: by for at, by in off.items() if at not in sentences}
        worst = max(values, key=values.__getitem__, default="")
        rows.append((path.stem, len(old), len(differ - sentences), len(sentences),
                     f"{values.get(worst, 0.0):.1e} {worst}"))  # fmt: skip
    head = ("answer", "values", "differ", "sentences", "largest difference")
    return tables.table(head, rows)


def files_compared(before: Path, after: Path) -> str:
    """The files of stores and runs that differ in any bit, but for when and by what they were
    made. The answers at the top are the table's."""
    old, new = same_numbers.content(before), same_numbers.content(after)
    kept = [
        name for name in old
        if "/" in name and not name.startswith("reports/") and not name.endswith("provenance.json")
    ]  # fmt: skip
    differ = [name for name in kept if not _same(name, old[name], new.get(name))]
    return "\n".join((f"{len(kept)} files of stores and runs: {len(differ)} differ", *differ))


def _same(name: str, old: bytes | str, new: bytes | str | None) -> bool:
    """Whether two files hold the same; of JSON without what `ELSEWHERE` names."""
    if new is None or not name.endswith(".json"):
        return old == new
    one, other = (dict(_leaves(json.loads(text))) for text in (old, new))
    return one == other


def _is_sentence(value: object) -> bool:
    """Text of several words; a name or an enumeration value has one."""
    return isinstance(value, str) and " " in value


def _read(path: Path, folder: Path) -> object:
    """An answer; paths in it as seen from the folder of all answers."""
    return json.loads(path.read_text(encoding="utf-8").replace(str(folder.resolve()), ""))


def _leaves(value: object, at: str = "") -> Iterator[tuple[str, object]]:
    if isinstance(value, dict):
        for key, inner in value.items():
            if key not in ELSEWHERE:
                yield from _leaves(inner, f"{at}.{key}")
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from _leaves(inner, f"{at}[{i}]")
    else:
        yield at, value


def _difference(old: object, new: object) -> float:
    """Zero where both are the same word; infinite where one is not there."""
    if isinstance(old, float | int) and isinstance(new, float | int):
        return abs(old - new) / max(1.0, abs(old))
    return 0.0 if old == new else math.inf


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="what", required=True)
    writing = commands.add_parser("write")
    writing.add_argument("out", type=Path)
    writing.add_argument("--data", type=Path, required=True)
    writing.add_argument("--kept", type=Path, required=True)
    writing.add_argument("--source", type=Path, default=ROOT)
    comparing = commands.add_parser("compare")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    comparing.add_argument("--exactly", action="store_true")
    given = parser.parse_args()
    if given.what == "compare":
        print(compare(given.before, given.after, 0.0 if given.exactly else EQUAL))
        if given.exactly:
            print(files_compared(given.before, given.after))
        return
    places = (given.out, given.data, given.kept, given.source)
    write(*(path.resolve() for path in places))


if __name__ == "__main__":
    main()
