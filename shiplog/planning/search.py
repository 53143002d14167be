"""The manoeuvre that says most, within the limits: orders of every actuator, optimised.

A manoeuvre is K orders of each actuator, held for T/K s each. The search is a cross-entropy method
(Rubinstein 1999): manoeuvres are drawn about a mean, the best ones are the next mean, and how far
they differ is the next spread. It begins with what seamen sail (zigzags, doublets, turns, stops),
each scaled to the limits. A manoeuvre that leaves them counts for less than any that does not.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shiplog.planning.information import Instrument, worth
from shiplog.planning.limits import ORDERS, Limits, NoRoom
from shiplog.simulation.helm import OfTables
from shiplog.simulation.sailing import STILL, Sailed, Steps, Water, sail
from shiplog.simulation.schedules import Schedule
from shiplog.training.runs.sailing_run import Sailor

MEMBERS = 32  # drawn in a round
ELITE = 6  # of them, that make the next round
ROUNDS = 160
SECONDS_OF_CPU = 35.0  # after which the search ends with the best it has
STEP_TIME = 0.1  # s before the next order, until which the last one holds
FIRST, LEAST = 0.5, 0.04  # spread of the first round, and the least, in half ranges
KEEP = 0.3  # of the mean and spread of the round before
BEYOND = 10.0  # worth of a manoeuvre beyond the limits is minus this, and minus its excess


@dataclass(frozen=True)
class Found:
    """orders    [K, A] SI, each held for `hold` s
    worth     ln of the factor by which intervals become narrower, in their geometric mean
    sailed    the manoeuvre by the model as it stands
    rounds    that the search took
    """

    orders: np.ndarray
    hold: float
    worth: float
    sailed: Sailed
    rounds: int

    def schedule(self, names: tuple[str, ...], seconds: float) -> Schedule:
        """For `simulate --schedule`, whose orders are joined by lines: each is given again just
        before the next."""
        begin = self.hold * np.arange(len(self.orders))
        times = np.stack((begin, begin + self.hold - STEP_TIME), 1).ravel()
        times[-1] = seconds
        twice = np.repeat(self.orders, 2, axis=0)
        columns = {n: tuple(twice[:, i].tolist()) for i, n in enumerate(names)}
        return Schedule(tuple(times.tolist()), columns, name="planned")


@dataclass(frozen=True)
class Search:
    """sailor      sails the run's model
    instrument  says what a manoeuvre is worth
    limits      within which
    water       wind and current that are expected
    seed        of the draws
    """

    sailor: Sailor
    instrument: Instrument
    limits: Limits
    water: Water = STILL
    seed: int = 0

    def run(self, progress: Callable[[float], None] = lambda share: None) -> Found:
        """Raises NoRoom where no manoeuvre stays within the limits."""
        rng, began = np.random.default_rng(self.seed), time.process_time()
        mean = np.zeros((ORDERS, len(self.limits.low)))
        spread = np.full(mean.shape, FIRST)
        drawn = self._familiar(rng)
        best, best_worth, rounds = drawn[0], -np.inf, 0
        for rounds in range(1, ROUNDS + 1):
            values = self.values(drawn)
            order = np.argsort(-values)
            if values[order[0]] > best_worth:
                best, best_worth = drawn[order[0]], float(values[order[0]])
            elite = drawn[order[:ELITE]]
            keep = KEEP if rounds > 1 else 0.0
            mean = keep * mean + (1.0 - keep) * elite.mean(0)
            spread = np.maximum(keep * spread + (1.0 - keep) * elite.std(0), LEAST)
            share = max(rounds / ROUNDS, (time.process_time() - began) / SECONDS_OF_CPU)
            progress(share)
            if share >= 1.0:
                break
            fresh = mean + spread * rng.standard_normal((MEMBERS - 1, *mean.shape))
            drawn = np.concatenate((best[None], np.clip(fresh, -1.0, 1.0)))
        if best_worth < -0.5 * BEYOND:
            raise NoRoom(
                "No manoeuvre was found that stays within the limits.",
                hint="give --water more room, --speed a wider range, or --seconds less.",
            )
        orders = self._readable(self._orders(best[None]))
        if (
            self.limits.excess((sailed := self._sail(orders)).state, self.sailor.length) > 0.0
        ).any():
            orders = self._orders(best[None])  # rounded, it would not stay within
            sailed = self._sail(orders)
        return Found(orders[0], self.limits.seconds / ORDERS, self.worth(sailed, 0), sailed, rounds)

    def values(self, drawn: np.ndarray) -> np.ndarray:
        """Worth [N] of manoeuvres [N, K, A] in half ranges of the actuators."""
        sailed = self._sail(self._orders(drawn))
        beyond = self.limits.excess(sailed.state, self.sailor.length)
        found = -BEYOND - beyond
        for i in np.flatnonzero(beyond == 0.0):
            found[i] = self.worth(sailed, int(i))
        return found

    def worth(self, sailed: Sailed, member: int) -> float:
        """Of what one member sailed."""
        data = self.data(sailed, member)
        before = np.sqrt(np.diag(np.linalg.inv(self.instrument.known)))
        with np.errstate(all="ignore"):
            gram = self.instrument.gram(data)
        if not np.isfinite(gram).all():
            return -BEYOND
        return float(worth(self.instrument.errors(gram), before))

    def data(self, sailed: Sailed, member: int = 0):
        keep = np.isfinite(sailed.state[member]).all(-1)
        return self.instrument.series(
            sailed.state[member][keep], sailed.actuator[member][keep], np.array(self.water.wind)
        )

    def _orders(self, drawn: np.ndarray) -> np.ndarray:
        """SI [N, K, A] of half ranges about the middle."""
        low, high = self.limits.low, self.limits.high
        return 0.5 * (low + high) + 0.5 * (high - low) * drawn

    def _readable(self, orders: np.ndarray) -> np.ndarray:
        """Orders [N, K, A] as a helmsman has them: angles in whole degrees, all else in fiftieths
        of its range."""
        steers = np.array([a.kind in ("rudder", "azimuth") for a in self.sailor.profile.actuators])
        wide = self.limits.high - self.limits.low
        step = np.where(steers, math.radians(1.0), np.where(wide > 0.0, wide / 50.0, 1.0))
        rounded = np.round(orders / step) * step
        return np.clip(rounded, self.limits.low, self.limits.high)

    def _sail(self, orders: np.ndarray) -> Sailed:
        """From a straight approach at the nominal speed; orders [N, K, A] SI are held, and the
        actuators follow as fast as they do."""
        own = self.sailor
        sticks = own.controls(own.speed)
        start = np.zeros((len(orders), 6))
        start[:, 1] = own.speed
        hold = self.limits.seconds / orders.shape[1]
        time = np.repeat(np.arange(orders.shape[1] + 1) * hold, 2)[1:-1]
        time[2::2] += 1e-6 * hold  # a step, by two instants that are all but one
        made = OfTables(time, np.repeat(orders, 2, axis=1), sticks, start, own.length / own.speed)
        steps = Steps(self.limits.seconds, own.row, own.substeps, own.limits)
        return sail(own.rates(1), made, sticks, start, steps, water=self.water, gear=own.gear())

    def _familiar(self, rng: np.random.Generator) -> np.ndarray:
        """The first round [N, K, A]: what is sailed anyway, at several sizes, and draws."""
        profile = self.sailor.profile
        steers = np.array([a.kind in ("rudder", "azimuth") for a in profile.actuators])
        k = np.arange(ORDERS)
        shapes = [
            (np.where(k % 2, -1.0, 1.0), np.ones(ORDERS)),  # doublets
            (np.where((k // 2) % 2, -1.0, 1.0), np.ones(ORDERS)),  # a zigzag
            (np.where(k < ORDERS // 2, 1.0, -1.0), np.ones(ORDERS)),  # a turn to either side
            (np.select([k % 4 == 1, k % 4 == 3], [1.0, -1.0]), np.where(k % 5 == 4, -1, 1)),  # both
            (np.where(k % 3 == 1, 1.0, -0.3), np.linspace(1.0, -0.2, ORDERS)),  # slower and slower
        ]  # fmt: skip
        found = []
        for steering, thrust in shapes:
            for size in (1.0, 0.6, 0.3):
                found.append(np.where(steers, size * steering[:, None], thrust[:, None]))
        more = rng.uniform(-1.0, 1.0, (MEMBERS - len(found), ORDERS, len(steers)))
        return np.concatenate((np.array(found), more))
