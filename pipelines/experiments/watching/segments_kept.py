"""Products H_s of every segment of a leg, kept in a file: the watch is then tried on them at will.

    python -m pipelines.experiments.watching.segments_kept SHIPS OUT --legs 20 [--first 0]

SHIPS holds a folder a ship with `store` and `base`, as `hidden_effects` makes them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from pipelines.experiments.watching import sailing
from shiplog.diagnosis.linear import segments
from shiplog.live import nominal, segment_products
from shiplog.live.nominal import Nominal
from shiplog.machine import files
from shiplog.training.runs import load_model
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store.store import Store


def campaign_of(folder: Path) -> Nominal:
    found = nominal.nominal(load_model.load(folder / "base"), Store(folder / "store"))
    assert found is not None
    return found


def products(of: Nominal, record: Record, directions: segment_products.Directions) -> np.ndarray:
    """H_s [S, N, N] of a record's segments."""
    record = nominal.as_campaign(record, of.timescale)
    rows = segments.begins(record)
    grams = segment_products.grams(of.campaign.reference, of.grid, record, rows)
    return np.stack([directions.products(one) for one in grams])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ships", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--legs", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--only", nargs="*", default=())
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    ships = [s for s in sailing.FIVE if not given.only or s.name in given.only]
    there = {s: campaign_of(given.ships / s.name) for s in ships if (given.ships / s.name).exists()}
    maps = {s: segment_products.directions(of.campaign) for s, of in there.items()}
    for number in range(given.first, given.first + given.legs):
        for ship, of in there.items():
            path = given.out / f"{ship.name}-{number:04d}.npy"
            if path.exists():
                continue
            profile = of.record.profile
            record = sailing.record_of(sailing.leg(ship, number), profile)
            with files.whole(path) as partial, partial.open("wb") as stream:
                np.save(stream, products(of, record, maps[ship]).astype(np.float32))


if __name__ == "__main__":
    main()
