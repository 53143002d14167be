"""How often a changed record is stored wrong without a word, and how often a sound one is alarmed.

    python -m pipelines.experiments.stored_values --voyages 1000 --jobs 2 --out OUT

OUT/outcomes.jsonl has a line a voyage; a run that was stopped goes on. `--one SEED` prints one,
`--markdown docs/evidence/stored_values.md` writes the page.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from dataclasses import asdict
from pathlib import Path

from pipelines.experiments.stored_values.judge import Outcome, outcome_of
from pipelines.experiments.stored_values.page import page

TITLE = """# Stored values: right, or a finding that says so

    {command}

A ship is sailed by a closed form, seen by instruments, written by a recorder and read as a user
would: `convert` where it is no MCAP, then `ingest`. The truth has its own dynamics, geodesy and
writers, and shares no code with shiplog. Nine kinds of ships under way (a VLCC at dead slow, a
ferry stern first, an azimuth ship sideways, a planing USV) and two at rest; fine, usual and coarse
instruments at 1 to 50 Hz; MCAP, CSV, Parquet, NMEA 0183, a folder of tables, a ROS 2 bag.

In two voyages of three one thing is changed: a unit, sign, frame, clock, order or value. The voyage
is right where no more than 1 % of its usable rows are beyond six standard deviations of the
instrument, and named where a finding, or the refusal, has the changed thing. Sound voyages are to
have no finding at all. Intervals are of 90 % (Clopper and Pearson, 1934).

"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--voyages", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0, help="of the first voyage")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("stored_values"))
    parser.add_argument("--one", type=int, help="print what becomes of the voyage of this seed")
    parser.add_argument("--markdown", type=Path, metavar="PATH", help="write the page there")
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
    if given.markdown is not None:
        command = (
            f"python -m pipelines.experiments.stored_values --voyages {given.voyages} "
            f"--seed {given.seed} --markdown docs/evidence/stored_values.md"
        )
        given.markdown.write_text(f"{TITLE.format(command=command)}{text}", encoding="utf-8")
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
