"""Turns of simulated ships in a current that their models never met: measured and predicted.

    python -m pipelines.experiments.manoeuvre_coverage --ships 16 --out coverage --prepare
    python -m pipelines.experiments.manoeuvre_coverage.in_a_current --ships 16 --out coverage

Each ship sails a turn with 35 deg of rudder in a current of 15 % of its speed, in any direction,
and the wind of its trials. Its model, in `coverage`, was identified without a current. 5 s of CPU
a ship.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

import shiplog
from pipelines.experiments.manoeuvre_coverage import tables, trials
from pipelines.experiments.manoeuvre_coverage.one_ship import MEMBERS, PROFILE, nominal_case
from pipelines.experiments.other_families import cases
from pipelines.experiments.other_families.instruments import write_voyage
from pipelines.experiments.other_families.ship import stream
from shiplog.manoeuvres import measure, recognition, simulated, stretches
from shiplog.training.runs import load_model, sailing_run
from shiplog.voyages.store.store import Store

SHARE = 0.15  # of the ship's speed: a knot for a ship of seven
NAMED = ("advance", "transfer", "tactical_diameter")


def turned(number: int, folder: Path) -> list[dict[str, Any]]:
    """A row a quantity of the ship's turn; none where the turn was not recognised."""
    case = nominal_case(number)
    rng = stream(case.seed, "with a current")
    trial, leg = trials.drawn(rng)[0], case.trial[0]
    seed, way = int(rng.integers(2**62)), float(rng.uniform(-math.pi, math.pi))
    speed = SHARE * case.ship.speed
    flow = replace(
        case.effects, current_north=speed * math.cos(way), current_east=speed * math.sin(way)
    )
    wind = replace(leg.wind, turn=0.2 * leg.wind.turn, freshen=0.2 * leg.wind.freshen)
    one = trials.sailed(case.ship, trial, seed=seed, wind=wind, effects=flow)
    sailor = sailing_run.of_run(load_model.load(folder / "run"))
    with tempfile.TemporaryDirectory() as place:
        log, store = Path(place) / f"{trial.name}.mcap", Path(place) / "store"
        write_voyage(log, one.voyage, seed=seed, start=cases.NOMINAL_DAY + timedelta(days=60))
        shiplog.ingest([log], store, profile=folder / PROFILE)
        record = stretches.read(Store(store), trial.name, sailor.profile)
    everything = recognition.recognise(trial.name, stretches.tracks(record))
    found = next((f for f in everything if f.kind == "turn"), None)
    if found is None:
        return []
    own = measure.measured(found, sailor.profile, record.step)
    sailed = simulated.as_recorded(sailor, found, record, own.drift, MEMBERS)
    true = trials.true_quantities(one)
    columns = {"measured": own.quantities, "simulated": {} if sailed is None else sailed.quantities}
    rows = []
    for what, quantities in columns.items():
        for name in NAMED:
            if name in quantities and name in true:
                e, t = quantities[name], true[name]
                rows.append({
                    "ship": number, "what": what, "quantity": name, "inside": e.low <= t <= e.high,
                    "width": (e.high - e.low) / t, "error": e.value / t - 1.0,
                })  # fmt: skip
    if sailed is not None:
        off = np.hypot(*np.subtract(sailed.sailed.water.current, (flow.current_north,
                                                                 flow.current_east)))  # fmt: skip
        print(f"ship {number}: current off by {off / speed:.0%}", flush=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--ships", type=int, default=16)
    parser.add_argument("--out", type=Path, default=Path("coverage"))
    given = parser.parse_args()
    rows = []
    for number in range(given.first, given.first + given.ships):
        folder = given.out / f"ship_{number}"
        if (folder / "run").exists():
            rows += turned(number, folder)
    print(tables.by(pl.DataFrame(rows), "what", "quantity") if rows else f"{given.out} has no run.")


if __name__ == "__main__":
    main()
