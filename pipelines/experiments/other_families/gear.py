"""What stands between a recorded order and what acts, unit by unit. What is recorded is the order.

order → dead zone or backlash → rate → (lag, delay, offset) → limit → stuck

dead zone   y = x - min(max(x, -d), d): nothing below d, and d too little above it
backlash    the play operator: y stays until x leaves [y - b, y + b], and then y = x ∓ b
            (both: Tao & Kokotović 1996, *Adaptive control of systems with actuator and sensor
            nonlinearities*)
rate        ẏ = min(max((x - y)/τ, -ρ), ρ)
limit       y = min(max(x, -l), l)
stuck       y = s from one share of the campaign to another
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

NEVER = math.inf
QUICK = 0.2  # s, time constant of a unit whose rate alone is limited

# [A] each, rad or rev/s; `memory` is where the play of each unit stands, and changes as it sails
Gear = namedtuple("Gear", "limit rate play dead stuck stuck_from stuck_until memory wrong")


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong with one unit: number in the ship's list of actuators; rad or rev/s."""

    unit: int
    limit: float = NEVER
    rate: float = NEVER  # rad/s or rev/s²
    play: float = 0.0
    dead: float = 0.0
    stuck: float = 0.0
    stuck_from: float = NEVER  # share of the campaign
    stuck_until: float = NEVER


def gear_of(count: int, faults: Sequence[Fault]) -> Gear:
    """Of `count` actuators; what is not among the faults does as ordered."""
    columns = {name: np.zeros(count) for name in ("play", "dead", "stuck", "memory")}
    endless = ("limit", "rate", "stuck_from", "stuck_until")
    columns |= {name: np.full(count, NEVER) for name in endless}
    for fault in faults:
        for name in ("limit", "rate", "stuck_from", "stuck_until"):
            columns[name][fault.unit] = min(columns[name][fault.unit], getattr(fault, name))
        for name in ("play", "dead", "stuck"):
            columns[name][fault.unit] += getattr(fault, name)
    return Gear(**columns, wrong=bool(faults))


@njit
def sent(g, j, order):
    """What the order of unit j becomes in its dead zone and play. Within a step the order goes one
    way, so that the play's value at the step's start is memory enough."""
    x = order - min(max(order, -g.dead[j]), g.dead[j])
    if g.play[j] > 0.0:
        x = min(max(g.memory[j], x - g.play[j]), x + g.play[j])
    return x


@njit
def slew(g, j, wanted, lag):
    """Rate of unit j that is `wanted` away from what is ordered; `lag` [s], 0 is none."""
    time = lag if lag > 0.0 else QUICK
    return min(max(wanted / time, -g.rate[j]), g.rate[j])


@njit
def held(g, j, value, circular, campaign):
    """What acts, of what it would do: a stop, and a stretch where it is stuck."""
    if g.limit[j] < math.inf:
        if circular:
            value = math.atan2(math.sin(value), math.cos(value))
        value = min(max(value, -g.limit[j]), g.limit[j])
    if g.stuck_from[j] <= campaign < g.stuck_until[j]:
        value = g.stuck[j]
    return value


@njit
def remember(g, orders):
    """Take the play of all units to the end of a step."""
    for j in range(len(g.memory)):
        if g.play[j] > 0.0:
            g.memory[j] = sent(g, j, orders[j])
