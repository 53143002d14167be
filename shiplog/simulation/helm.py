"""Helmsmen of the standard manoeuvres: what is ordered next, of many members at once.

A member's order depends on its own heading or yaw rate. When within the step that begins it will
be due is extrapolated, so that a step's length does not delay a reversal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from shiplog.simulation.controls import Controls
from shiplog.simulation.schedules import (
    STEADY_LENGTHS,
    Manoeuvre,
    PullOut,
    Schedule,
    Spiral,
    Stop,
    Turn,
    Zigzag,
)

STEADY = 0.002  # r L/V: a turn at 35 deg has 0.3 to 0.8, the narrowest spiral's steps 0.02
STEADY_AFTER = 4.0  # L/V: nothing is called steady before
COASTED = 0.1  # of the approach speed, to which a ship coasts that nothing stops
STEADY_MEAN = 2.0  # L/V over which the yaw rate is averaged for that


@dataclass(frozen=True)
class Order:
    """Of each member [N].

    actuators  [N, A] ordered in the step that begins
    after      [N] s into it at which that order is given
    done       [N] the manoeuvre is complete
    """

    actuators: np.ndarray
    after: np.ndarray
    done: np.ndarray


class Helm:
    """Orders of one manoeuvre. `order` is called once a step."""

    def __init__(self, controls: Controls, start: np.ndarray, length_time: float) -> None:
        self.controls, self.length_time = controls, length_time
        self.count = len(start)
        self.first = start[:, 4].copy()  # heading

    def order(self, time: float, step: float, state: np.ndarray) -> Order:
        raise NotImplementedError

    def _ordered(
        self, steering: np.ndarray, propulsion: float, after: np.ndarray, done: np.ndarray
    ) -> Order:
        ahead = np.full(self.count, propulsion)
        return Order(self.controls.actuators(steering, ahead), after, done)


class _OfSchedule(Helm):
    def __init__(self, schedule: Schedule, *given) -> None:
        super().__init__(*given)
        self.schedule = schedule

    def order(self, time: float, step: float, state: np.ndarray) -> Order:
        row = self.controls.approach.copy()
        for name, value in self.schedule.at(time).items():
            row[self.controls.names.index(name)] = value
        still = np.zeros(self.count)
        done = np.full(self.count, time >= self.schedule.seconds)
        return Order(np.tile(row, (self.count, 1)), still, done)


class OfTables(Helm):
    """Positions of all actuators that are known: times [K] and values [N, K, A], or [1, K, A] for
    all members."""

    def __init__(self, time: np.ndarray, values: np.ndarray, *given) -> None:
        super().__init__(*given)
        self.time, self.values = time, values

    def order(self, time: float, step: float, state: np.ndarray) -> Order:
        after = int(np.clip(np.searchsorted(self.time, time, side="right"), 1, len(self.time) - 1))
        if len(self.time) == 1:
            row = self.values[:, 0]
        else:
            begin, end = self.time[after - 1], self.time[after]
            part = float(np.clip((time - begin) / (end - begin), 0.0, 1.0))
            row = (1.0 - part) * self.values[:, after - 1] + part * self.values[:, after]
        done = np.full(self.count, time >= self.time[-1])
        whole = np.broadcast_to(row, (self.count, row.shape[-1]))
        return Order(np.array(whole), np.zeros(self.count), done)


class _OfZigzag(Helm):
    def __init__(self, of: Zigzag, *given) -> None:
        super().__init__(*given)
        self.of = of
        self.reversed = np.zeros(self.count, dtype=int)

    def _side(self) -> np.ndarray:
        first = math.copysign(1.0, self.of.angle)
        return first * np.where(self.reversed % 2 == 0, 1.0, -1.0)

    def order(self, time: float, step: float, state: np.ndarray) -> Order:
        side = self._side()
        turned, gone = side * (state[:, 4] - self.first), side * step * state[:, 5]
        reached = (turned + gone >= self.of.heading) & (self.reversed < self.of.reversals)
        with np.errstate(all="ignore"):
            share = (self.of.heading - turned) / np.where(gone > 0.0, gone, np.inf)
        after = np.where(reached, step * np.clip(share, 0.0, 1.0), 0.0)
        self.reversed = self.reversed + reached
        done = self.reversed >= self.of.reversals
        return self._ordered(self._side() * abs(self.of.angle), 1.0, after, done)


class _OfTurn(Helm):
    def __init__(self, of: Turn, *given) -> None:
        super().__init__(*given)
        self.of = of

    def order(self, time: float, step: float, state: np.ndarray) -> Order:
        done = np.abs(state[:, 4] - self.first) >= self.of.by
        return self._ordered(np.full(self.count, self.of.angle), 1.0, np.zeros(self.count), done)


class _OfStop(Helm):
    def __init__(self, *given) -> None:
        super().__init__(*given)
        start = given[1]
        coasts = not self.controls.astern.any()  # then it never stops altogether
        self.least = COASTED * start[:, 1] if coasts else np.zeros(self.count)

    def order(self, time: float, step: float, state: np.ndarray) -> Order:
        none = np.zeros(self.count)
        return self._ordered(none, -1.0, none, state[:, 1] <= self.least)


class _InTurn(Helm):
    """Angles [K] one after the other, each until the yaw rate is steady."""

    def __init__(self, angles: tuple[float, ...], longest: float, *given) -> None:
        super().__init__(*given)
        self.angles, self.longest = np.array(angles), longest * self.length_time
        self.at = np.zeros(self.count, dtype=int)
        self.since = np.zeros(self.count)
        self.mean = np.zeros(self.count)

    def order(self, time: float, step: float, state: np.ndarray) -> Order:
        rate = state[:, 5]
        self.mean += min(1.0, step / (STEADY_MEAN * self.length_time)) * (rate - self.mean)
        held = time - self.since
        steady = np.abs(rate - self.mean) * self.length_time < STEADY
        over = (steady & (held >= STEADY_AFTER * self.length_time)) | (held >= self.longest)
        self.at = self.at + over
        self.since = np.where(over, time, self.since)
        done = self.at >= len(self.angles)
        steering = self.angles[np.minimum(self.at, len(self.angles) - 1)]
        return self._ordered(steering, 1.0, np.zeros(self.count), done)


def helm(manoeuvre: Manoeuvre, controls: Controls, start: np.ndarray, length_time: float) -> Helm:
    """Who sails it: from states [N, 6], with L/V [s] as the ship's own time."""
    given = (controls, start, length_time)
    match manoeuvre:
        case Schedule():
            return _OfSchedule(manoeuvre, *given)
        case Zigzag():
            return _OfZigzag(manoeuvre, *given)
        case Turn():
            return _OfTurn(manoeuvre, *given)
        case Stop():
            return _OfStop(*given)
        case PullOut():
            angles = (manoeuvre.angle, 0.0, -manoeuvre.angle, 0.0)
            return _InTurn(angles, STEADY_LENGTHS, *given)
        case Spiral():
            return _InTurn(manoeuvre.angles, STEADY_LENGTHS, *given)
