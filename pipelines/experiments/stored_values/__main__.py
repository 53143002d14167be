"""How often a changed record is stored wrong without a word, and how often a sound one is alarmed.

    python -m pipelines.experiments.stored_values --voyages 1000 --jobs 2 --out OUT

OUT/outcomes.jsonl has a line a voyage; a run that was stopped goes on. `--one SEED` prints one.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from dataclasses import asdict
from pathlib import Path

from pipelines.experiments.stored_values.judge import Outcome, outcome_of
from pipelines.experiments.stored_values.page import page


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--voyages", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0, help="of the first voyage")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("stored_values"))
    parser.add_argument("--one", type=int, help="print what becomes of the voyage of this seed")
    given = parser.parse_args()
    if given.one is not None:
        for key, value in asdict(outcome_of(given.one)).items():
            print(f"{key}: {value}")
        return
    given.out.mkdir(parents=True, exist_ok=True)
    path = given.out / "outcomes.jsonl"
    done = _read(path)
    seeds = [s for s in range(given.seed, given.seed + given.voyages) if s not in done]
    context = multiprocessing.get_context("spawn")
    with context.Pool(given.jobs) as pool, path.open("a", encoding="utf-8") as lines:
        for outcome in pool.imap_unordered(outcome_of, seeds, chunksize=1):
            lines.write(json.dumps(asdict(outcome)) + "\n")
            lines.flush()
            done[outcome.seed] = outcome
    chosen = [done[s] for s in range(given.seed, given.seed + given.voyages)]
    text = page(chosen)
    (given.out / "page.md").write_text(text, encoding="utf-8")
    print(text)


def _read(path: Path) -> dict[int, Outcome]:
    if not path.exists():
        return {}
    found = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        content = json.loads(line)
        content["findings"], content["wrong"] = tuple(content["findings"]), tuple(content["wrong"])
        found[content["seed"]] = Outcome(**content)
    return found


if __name__ == "__main__":
    main()
