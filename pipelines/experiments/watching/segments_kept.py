"""Products H_s of every segment of a leg, kept in a file: the watch is then tried on them at will.

    python -m pipelines.experiments.watching.segments_kept SHIPS OUT --legs 20 [--first 0]
    python -m pipelines.experiments.watching.segments_kept SHIPS OUT --half-way 60 [--first 0]
    python -m pipelines.experiments.watching.segments_kept SHIPS OUT --calibrate

SHIPS holds a folder a ship with `store` and `base`, as `hidden_effects` makes them.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from pipelines.experiments.watching import sailing
from shiplog.diagnosis.linear import segments
from shiplog.live import calibration, nominal, segment_products
from shiplog.live.alarm import places
from shiplog.live.nominal import Nominal
from shiplog.logs.conversion.write import Series
from shiplog.machine import files
from shiplog.training.runs import load_model
from shiplog.voyages.rows.recording import Record
from shiplog.voyages.store.store import Store


def campaign_of(folder: Path) -> Nominal:
    found = nominal.nominal(load_model.load(folder / "base"), Store(folder / "store"))
    assert found is not None
    return found


def timed_products(
    of: Nominal, record: Record, directions: segment_products.Directions
) -> tuple[np.ndarray, np.ndarray]:
    """The ends of a record's segments [S], s into it, and H_s [S, N, N]; without those that are
    handled as no training voyage is."""
    record = nominal.as_campaign(record, of.timescale)
    rows = np.array(
        [at for at in segments.begins(record) if not of.handling.unlike(record, at)], int
    )
    grams = segment_products.grams(of.campaign.reference, of.grid, record, rows)
    return record.time[rows + of.grid.rows], np.stack([directions.products(one) for one in grams])


def products(of: Nominal, record: Record, directions: segment_products.Directions) -> np.ndarray:
    """H_s [S, N, N] of a record's segments."""
    return timed_products(of, record, directions)[1]


def keep_calibrations(there: dict[sailing.Ship, Nominal], maps: dict, out: Path) -> None:
    """What the nominal campaign of each ship says of its alarm, as `shiplog watch` learns it."""
    for ship, of in there.items():
        causes: dict[str, Any] = {
            f"cause {label}": at for label, at in places(maps[ship].causes).items()
        }
        np.savez(
            out / f"calibration-{ship.name}.npz", segment_s=of.grid.seconds,
            widths=maps[ship].widths, counts=maps[ship].counts,
            **calibration.watched(of, maps[ship]), **causes,
        )  # fmt: skip


@dataclass(frozen=True)
class HalfWay:
    """A voyage in whose middle a cause begins. size: of its realistic one."""

    number: int
    ship: sailing.Ship
    cause: str
    size: float

    def seconds(self, of: Nominal) -> float:
        """How long it lasts: a ship with longer segments sails longer."""
        return sailing.LEG_S * max(1.0, of.grid.seconds / 30.0)

    def series(self, seconds: float) -> tuple[list[Series], float]:
        """Its messages, and when it begins [s]."""
        return sailing.half_way(self.ship, 5000 + self.number, self.cause, self.size, seconds)

    def write(self, stream: IO[bytes], H: np.ndarray, times: np.ndarray, begins: float) -> None:
        """H_s, the ends of its segments, and the answer."""
        np.savez(
            stream, H=H.astype(np.float32), times=times, begins=begins, size=self.size,
            cause=np.array(self.cause), ship=np.array(self.ship.name),
        )  # fmt: skip


def half_ways(there: dict[sailing.Ship, Nominal], count: int, first: int) -> list[HalfWay]:
    """So many voyages of the ships that are there; causes are drawn of the ship's bank, sizes of
    0.25 to 1 of the realistic one. `first`, of their numbers, is part of the seeds."""
    rng, sizes = np.random.default_rng([68, first]), np.random.default_rng([69, first])
    found = []
    for number in range(count):
        ship = sailing.FIVE[number % len(sailing.FIVE)]
        offered = sailing.offered(ship)
        if ship in there:
            known = {c.name for c in there[ship].campaign.reference.model.causes}
            offered = [name for name in offered if name in known]
        cause, size = str(rng.choice(offered)), float(0.25 ** sizes.uniform(0.0, 1.0))
        if ship in there:
            found.append(HalfWay(first + number, ship, cause, size))
    return found


def keep_half_ways(
    there: dict[sailing.Ship, Nominal], maps: dict, out: Path, count: int, first: int
) -> None:
    """H_s of each such voyage, the ends of its segments, and what was hidden from when on."""
    for voyage in half_ways(there, count, first):
        path = out / f"half-{voyage.number:03d}.npz"
        if path.exists():
            continue
        of = there[voyage.ship]
        series, begins = voyage.series(voyage.seconds(of))
        record = sailing.record_of(series, of.record.profile)
        times, H = timed_products(of, record, maps[voyage.ship])
        with files.whole(path) as partial, partial.open("wb") as stream:
            voyage.write(stream, H, times, begins)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ships", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--legs", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--half-way", type=int, default=0)
    parser.add_argument("--calibrate", action="store_true")
    parser.add_argument("--only", nargs="*", default=())
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    ships = [s for s in sailing.SHIPS if not given.only or s.name in given.only]
    there = {s: campaign_of(given.ships / s.name) for s in ships if (given.ships / s.name).exists()}
    maps = {s: segment_products.directions(of.campaign) for s, of in there.items()}
    if given.calibrate:
        keep_calibrations(there, maps, given.out)
        return
    if given.half_way:
        keep_half_ways(there, maps, given.out, given.half_way, given.first)
        return
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
