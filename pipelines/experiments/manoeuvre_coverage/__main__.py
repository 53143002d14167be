"""How often the manoeuvre sheet's 90 % intervals, and those of coefficients, hold the truth.

    python -m pipelines.experiments.manoeuvre_coverage --ships 200 --jobs 2 --out coverage
    python -m pipelines.experiments.manoeuvre_coverage --ships 200 --out coverage --report

Ships are numbered from --first. Numbers from 1000 on are for development: a change of the intervals
is tried there, and reported on the ships from 0. Each ship has a folder, and one that has its
`ship.json` is not done again: the same command goes on where it was stopped. --report writes
the tables of what is there. Every ninth ship changes before its trials, and a diagnosis extends its
model. 10 to 40 s of CPU a ship. The family shipmmg needs the extra `experiments`.
"""

from __future__ import annotations

import argparse
import concurrent.futures
import json
import multiprocessing
from pathlib import Path

from pipelines.experiments.manoeuvre_coverage import page
from pipelines.experiments.manoeuvre_coverage.one_ship import FAMILIES, RESULT, done, family_of

EXTENDED = 9  # every ninth: of every family


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--ships", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("coverage"))
    parser.add_argument("--family", choices=FAMILIES, help="only ships of this one")
    parser.add_argument("--extended", type=int, default=EXTENDED, help="every so many; 0 is none")
    parser.add_argument("--keep", action="store_true", help="stores and runs as well")
    parser.add_argument("--prepare", action="store_true", help="sail and identify; judge later")
    parser.add_argument("--report", action="store_true", help="tables of what is there")
    given = parser.parse_args()
    numbers = [
        number
        for number in range(given.first, given.first + given.ships)
        if given.family in (None, family_of(number))
    ]
    if not given.report:
        given.out.mkdir(parents=True, exist_ok=True)
        context = multiprocessing.get_context("spawn")
        with concurrent.futures.ProcessPoolExecutor(given.jobs, mp_context=context) as pool:
            each = [
                pool.submit(
                    done, number, given.out, bool(given.extended) and number % given.extended == 2,
                    given.keep or given.prepare, not given.prepare,
                )
                for number in numbers
            ]  # fmt: skip
            for one in concurrent.futures.as_completed(each):
                print(one.result(), flush=True)
    paths = [given.out / f"ship_{number}" / RESULT for number in numbers]
    ships = [json.loads(path.read_text("utf-8")) for path in paths if path.exists()]
    print(page.text(ships) if ships else f"{given.out} has no ship yet.")


if __name__ == "__main__":
    main()
