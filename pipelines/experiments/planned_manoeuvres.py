"""Does a planned manoeuvre say more than a zigzag? On simulated sister ships, expected and reached.

    python -m pipelines.experiments.planned_manoeuvres --ships 6 --out planned

A ship has sailed a zigzag 10/10 of five minutes, and its model is identified from that. `shiplog
plan` says what to sail next; the ship sails it, and a zigzag 20/20 of the same time in the same
wind and disturbance. Each is added to the first voyage, and the model identified again. The ship is
of another simulator, whose forces have other exponents and shares than the model's. One to two
minutes a ship.
"""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

import shiplog
from pipelines.experiments.simulated_ship import Effects, Wind, sail, varied, write_voyage
from pipelines.experiments.simulated_ship import laws as other_laws
from shiplog.planning import limits, noise, plan
from shiplog.simulation.sailing import Water
from shiplog.training.runs import load_model, sailing_run
from shiplog.training.runs.load_model import PhysicalRun

SECONDS = 294.0  # of each manoeuvre
WINDOW = 49  # s: six windows of each
START = datetime(2026, 5, 4, 9, tzinfo=UTC)
REVOLUTIONS = 10.0  # rev/s, of the zigzags
SETTLING = 12.0  # s, before the first order
Orders = tuple[float, float, float]


@dataclass(slots=True)
class ZigzagHelm:
    """Both rudders to `degrees` until the heading has changed by as much, then the other way."""

    degrees: float
    side: float = 1.0
    first: float | None = field(default=None)

    def __call__(self, time: float, state: np.ndarray) -> Orders:
        heading = float(state[4])
        if time < SETTLING:
            return 0.0, 0.0, REVOLUTIONS
        self.first = heading if self.first is None else self.first
        if self.side * (heading - self.first) >= math.radians(self.degrees):
            self.side = -self.side
        angle = self.side * math.radians(self.degrees)
        return angle, angle, REVOLUTIONS


@dataclass(slots=True)
class PlannedHelm:
    """The plan's orders, after a straight approach."""

    orders: np.ndarray
    hold: float

    def __call__(self, time: float, state: np.ndarray) -> Orders:
        if time < SETTLING:
            return 0.0, 0.0, REVOLUTIONS
        row = self.orders[min(int((time - SETTLING) / self.hold), len(self.orders) - 1)]
        return float(row[0]), float(row[1]), float(row[2])


def one_ship(seed: int, folder: Path) -> dict:
    """Ratios of the intervals after the zigzag over those after the plan, of the coefficients that
    either is expected to show: expected, and as both identifications state them."""
    rng = np.random.default_rng([seed, 77])
    ship, laws = varied(seed), other_laws.drawn(rng)
    wind = Wind(rng.uniform(1.0, 2.5), rng.uniform(-np.pi, np.pi))
    logs, store = folder / "logs", folder / "store"
    logs.mkdir(parents=True, exist_ok=True)

    def sailed(name: str, helm, number: int) -> None:
        voyage = sail(
            SETTLING + SECONDS, seed=1000 * seed + number, wind=wind, ship=ship,
            effects=Effects(turbulence=1.0), laws=laws, helm=helm,
            start=(0.0, 0.35, 0.0, 0.0, 0.0, 0.0),
        )  # fmt: skip
        when = START + timedelta(hours=number)
        write_voyage(logs / f"{name}.mcap", voyage, seed=1000 * seed + number, start=when)
        shiplog.ingest([logs / f"{name}.mcap"], store)

    sailed("first", ZigzagHelm(10.0), 1)
    shiplog.train(store, folder / "first_run", model="mmg", voyages=["first"], window=WINDOW)
    run = load_model.load(folder / "first_run")
    assert isinstance(run, PhysicalRun)
    sailor = sailing_run.of_run(run)
    within = limits.limits(sailor, seconds=SECONDS, speed=(-0.6, 0.6))
    made = plan.plan(run, sailor, within, water=Water(wind=noise.usual_wind(run)))
    sailed("zigzag", ZigzagHelm(20.0), 2)
    sailed("planned", PlannedHelm(made.found.orders, made.found.hold), 2)
    errors = {}
    for name in ("zigzag", "planned"):
        shiplog.train(
            store, folder / f"{name}_run", model="mmg", voyages=["first", name], window=WINDOW
        )
        known = load_model.load(folder / f"{name}_run").identified()
        errors[name] = dict(known.select("name", "standard_error").iter_rows())
    shown = [one for one in made.expected if one.shown]
    return {
        "ship": seed,
        "shown": len(shown),
        "expected": [one.zigzag / one.planned for one in shown],
        "reached": [errors["zigzag"][o.name] / errors["planned"][o.name] for o in shown],
        "of_all": [errors["zigzag"][o.name] / errors["planned"][o.name] for o in made.expected],
        "rounds": made.found.rounds,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ships", type=int, default=6)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("planned"))
    given = parser.parse_args()
    rows = []
    for seed in range(given.first, given.first + given.ships):
        rows.append(one_ship(seed, given.out / f"ship_{seed}"))
        (given.out / "planned.json").write_text(json.dumps(rows, indent=1), encoding="utf-8")
        last = rows[-1]
        print(
            f"ship {seed}: {last['shown']} coefficients shown, expected "
            f"{np.median(last['expected']):.2f}, reached {np.median(last['reached']):.2f} times "
            "narrower in the median",
            flush=True,
        )
    every = {key: np.concatenate([row[key] for row in rows]) for key in ("expected", "reached")}
    for key, ratios in every.items():
        low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75))
        print(f"{key}: median {middle:.2f}, quartiles {low:.2f} and {high:.2f}")


if __name__ == "__main__":
    main()
