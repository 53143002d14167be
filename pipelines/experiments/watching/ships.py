"""The ships of the watch's measurements: logs of a nominal campaign, their store and their model.

    python -m pipelines.experiments.watching.ships SHIPS [--only home1 abkowitz]

SHIPS gets a folder a ship with `logs`, `store` and `base`. A campaign is that of a case of
`hidden_effects` in which nothing is hidden: about two hours of a small ship in five voyages. What
is there is not made again; a ship takes a minute or two.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from pipelines.experiments.hidden_effects import run
from pipelines.experiments.hidden_effects.plan import Planned
from pipelines.experiments.hidden_effects.run import Prepared, Settings
from pipelines.experiments.watching import sailing
from pipelines.experiments.watching.sailing import Ship

SHORTEST_TRIAL_S = 500  # of the home ship: its nominal campaign is whole all the same


def make(ship: Ship, ships: Path) -> str:
    """Logs, store and model of a ship; what went wrong, or nothing."""
    folder = (ships / ship.name).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    planned = Planned(ship.name, ship.seed, "none", None, SHORTEST_TRIAL_S, family=ship.family)
    there = Prepared(folder / "logs", folder / "store", folder / "base")
    key = (ships / "keys" / f"{ship.name}.json").resolve()
    steps = run.prepare(planned, Settings(), folder, there, key)
    if steps is None:
        raise KeyboardInterrupt
    return steps[-1]["stderr"] if run.failed(steps[-1]) else ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ships", type=Path)
    parser.add_argument("--only", nargs="*", default=[])
    given = parser.parse_args()
    for ship in sailing.SHIPS:
        if given.only and ship.name not in given.only:
            continue
        if (given.ships / ship.name / "base").exists():
            continue
        began = time.perf_counter()
        lost = make(ship, given.ships)
        print(
            f"{ship.name}: {lost or 'made'} after {time.perf_counter() - began:.0f} s", flush=True
        )


if __name__ == "__main__":
    main()
