"""Every data set at hand, from its files to a verdict: docs/evidence/measured_ships.md.

    python -m pipelines.experiments.measured_ships DATA --out measured [--only NAME ...]
        [--markdown PATH]

DATA holds a folder for each data set; none is shipped. Interrupted, give the same command again.
Exit code 1: a command ended in a traceback.
"""

from __future__ import annotations

import argparse
import logging
import sys
from pathlib import Path

from pipelines.experiments.measured_ships import page, way
from pipelines.experiments.measured_ships.ships import DATA_SETS


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("data", type=Path, metavar="DATA")
    parser.add_argument("--out", type=Path, required=True, help="logs, stores, runs, reports")
    parser.add_argument("--only", nargs="+", choices=DATA_SETS, default=list(DATA_SETS))
    parser.add_argument(
        "--markdown",
        type=Path,
        metavar="PATH",
        help="write the table there, the ships in its folder",
    )
    given = parser.parse_args()
    logging.basicConfig(format="%(message)s", level=logging.INFO)
    ways = [way.go(name, DATA_SETS[name], given.data, given.out) for name in given.only]
    if given.markdown is None:
        print(page.text(ways), *(page.answers([one]) for one in ways), sep="\n\n")
    else:
        page.write(given.markdown, ways)
    return int(any(one.traceback for one in ways))


if __name__ == "__main__":
    sys.exit(main())
