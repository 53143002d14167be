"""The schedule on which what was written sails against `simulate`, and how far they come apart.

600 s from the approach, in wind and current, in which every actuator moves: rudders and azimuths to
both sides, propellers up and down. Rate limits, gear and water are all in it. A consumer gets the
orders step by step; the greatest difference is over all instants that `simulate` keeps.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shiplog.export.ship import Ship
from shiplog.nomenclature.channels import STATE
from shiplog.simulation.sailing import Sailed, Water, from_direction
from shiplog.simulation.schedules import HOLD, Schedule
from shiplog.training.runs.sailing_run import Sailor

SECONDS = 600.0
NODE = 20.0  # s between two orders: a small ship turns by tens of degrees in it
STEERED = math.radians(15.0)  # to either side: no ship of any size leaves its model at that
SLOWER = (1.0, 1.1, 0.8, 1.0, 0.6)  # times the approach's revolutions, in turn
COMMAND = 0.3  # of a thruster that does not propel
WINDS = 0.8  # true wind over the approach speed: the wind's force is there and does not rule
CURRENTS = 0.15  # current over the approach speed
SAME = 1e-9  # m, m/s, rad, rad/s: where the form is the same only rounding differs


@dataclass(frozen=True)
class Trial:
    """schedule   orders, SI
    water      wind and current
    start      [6] over ground
    orders     [n, A] at each step's begin
    sailed     what `simulate` makes of it
    every      steps between two instants that are kept
    """

    schedule: Schedule
    water: Water
    start: np.ndarray
    orders: np.ndarray
    sailed: Sailed
    every: int

    @property
    def names(self) -> tuple[str, ...]:
        """Of the state's channels."""
        return tuple(c.name for c in STATE)

    @property
    def reference(self) -> np.ndarray:
        """[K, 6]"""
        return self.sailed.state[0]


@dataclass(frozen=True)
class Difference:
    """Greatest over the trial's instants, each channel in its SI unit.

    seconds   for which both sail; less than SECONDS where the model diverges
    """

    by_channel: dict[str, float]
    seconds: float

    @property
    def greatest(self) -> float:
        return max(self.by_channel.values())

    @property
    def same(self) -> bool:
        return self.greatest <= SAME


def of_ship(ship: Ship, sailor: Sailor) -> Trial:
    schedule = _schedule(ship)
    water = Water(
        from_direction(WINDS * ship.speed, 60.0), from_direction(CURRENTS * ship.speed, 130.0)
    )
    sailed, _ = sailor.sail(schedule, members=1, water=water, seconds=SECONDS)
    count = round(SECONDS / ship.step)
    time = np.arange(count) * ship.step
    at = schedule.at(time)
    orders = np.stack([at[one.name] for one in ship.inputs], 1)
    every = max(1, round(sailor.row / ship.step))
    return Trial(schedule, water, sailed.state[0, 0], orders, sailed, every)


def _schedule(ship: Ship) -> Schedule:
    time = tuple(np.arange(0.0, SECONDS, NODE).tolist())
    orders = {}
    for i, one in enumerate(ship.inputs):
        if one.kind in ("rudder", "azimuth"):
            # others of the ship a node later: two rudders are not always at one angle
            values = [STEERED * (0, 1, 1, -1, -1, 0.5)[(k + i) % 6] for k in range(len(time))]
        elif one.approach:
            values = [one.approach * SLOWER[(k // 4) % len(SLOWER)] for k in range(len(time))]
        else:
            most = COMMAND * (one.high if math.isfinite(one.high) else 1.0)
            values = [most * (0, 1, 0, -1)[(k // 2) % 4] for k in range(len(time))]
        orders[one.name] = tuple(float(np.clip(v, one.low, one.high)) for v in values)
    return Schedule(time, orders, HOLD, "trial", SECONDS)


def difference(trial: Trial, state: np.ndarray) -> Difference:
    """Of states [n, 6] at the end of each step from the trial's `simulate`."""
    kept = np.concatenate((trial.start[None], state[trial.every - 1 :: trial.every]))
    return difference_of_rows(trial, kept)


def difference_of_rows(trial: Trial, kept: np.ndarray) -> Difference:
    """Of states [K, 6] at the instants that `simulate` keeps."""
    count = min(len(kept), len(trial.reference))
    kept, reference = kept[:count], trial.reference[:count]
    there = np.isfinite(reference).all(1)
    apart = np.abs(kept[there] - reference[there])
    apart = np.where(np.isfinite(apart), apart, np.inf).max(0)
    seconds = float(trial.sailed.time[:count][there][-1])
    return Difference({c.name: float(apart[i]) for i, c in enumerate(STATE)}, seconds)
