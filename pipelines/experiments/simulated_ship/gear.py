"""The two rudders and the screw where they do not do what is recorded, and what pulls from outside.

A unit's order passes in turn through a dead zone (x less its part within ±d) or backlash (it holds
still until the order is more than b away, Nordin & Gutman 2002), a slow drive (first order, with a
largest rate), a share of the other rudder's order, a stop, and a stretch where it stands still.

A line pulls with k (d - l) beyond its length l, or with a winch's constant force; a tow with a
constant force whose bearing turns along the campaign; a fender pushes off the wall at `BANK_EAST`
with f (1 - gap/reach), and where it is flat the wall is `STIFF` times as stiff.
"""

from __future__ import annotations

import math
from collections import namedtuple
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

UNITS = ("rudder_port", "rudder_starboard", "propeller")
FAST = 0.12  # s, first order of a unit whose rate alone is limited
STIFF = 12.0
EASE = 0.4  # m beyond its length over which a winch takes up

Gear = namedtuple(
    "Gear", "wrong limit rate play dead stand since until share_on share stood begin slope"
)
External = namedtuple(
    "External",
    "any stiffness force length north east line_at tow towards turning tow_at fender reach",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Faulty:
    """One unit, by its name in `UNITS`; rad or rev/s. What is infinite or zero is not there."""

    unit: str
    limit: float = math.inf
    rate: float = math.inf
    play: float = 0.0
    dead: float = 0.0
    stand: float = 0.0
    since: float = math.inf  # share of the campaign
    until: float = math.inf
    share: float = 0.0  # of the other rudder's order, on top of its own


def merged(before: Any, value: Any) -> Any:
    """A field of the effects with what is hidden besides: two faulty units are both there."""
    if isinstance(before, tuple) and before and isinstance(before[0], Faulty):
        return (*before, *value)
    if before and isinstance(before, Mapping) and isinstance(value, Mapping):
        return {**before, **value}
    return value


def gear_of(faults: tuple[Faulty, ...], campaign: tuple[float, float], duration: float) -> Gear:
    limit, rate, since, until = (np.full(3, math.inf) for _ in range(4))
    play, dead, stand, stood = (np.zeros(3) for _ in range(4))
    on, share = -1, 0.0
    for one in faults:
        i = UNITS.index(one.unit)
        limit[i], rate[i] = min(limit[i], one.limit), min(rate[i], one.rate)
        play[i] += one.play
        dead[i] += one.dead
        if one.since < math.inf:
            stand[i], since[i], until[i] = one.stand, one.since, one.until
        if one.share:
            on, share = i, one.share
    slope = (campaign[1] - campaign[0]) / duration
    return Gear(
        bool(faults), limit, rate, play, dead, stand, since, until, on, share, stood, campaign[0],
        slope,
    )  # fmt: skip


def external_of(pulls: Mapping[str, float]) -> External:
    """Fields of `External` by name; those that are not given are zero."""
    given = dict.fromkeys(External._fields, 0.0) | {"reach": 1.0} | dict(pulls)
    return External(**{**given, "any": bool(pulls)})


@njit
def ordered(g, i, order):
    """What reaches unit i of its order."""
    x = order
    if g.dead[i] > 0.0:
        x -= min(max(x, -g.dead[i]), g.dead[i])
    if g.play[i] > 0.0:
        x = min(max(g.stood[i], x - g.play[i]), x + g.play[i])
    return x


@njit
def drive(g, i, order, stands, lag):
    """d/dt of a unit that stands at `stands`."""
    time = lag if lag > 0.0 else FAST
    return min(max((ordered(g, i, order) - stands) / time, -g.rate[i]), g.rate[i])


@njit
def stopped(g, i, value, time):
    value = min(max(value, -g.limit[i]), g.limit[i])
    if g.since[i] <= g.begin + g.slope * time < g.until[i]:
        return g.stand[i]
    return value


@njit
def past(track, last, state, column, steps):
    """`column` of the track at `steps` (may be a fraction) steps, linear in between."""
    if steps <= 0.0:
        return track[0, column]
    if steps >= last:  # within the present step: the stage itself is the newest we have
        return track[last, column] if steps == last else state[column]
    before = int(steps)
    part = steps - before
    return track[before, column] * (1.0 - part) + track[before + 1, column] * part


@njit
def acting(h, track, row, part, dt, state):
    """Rudder angles and revolutions that act where a unit does not do as recorded."""
    g, time = h.gear, (row + part) * dt
    port, starboard = (
        _of(h, g, 0, track, row, part, dt, state),
        _of(h, g, 1, track, row, part, dt, state),
    )
    if g.share_on == 0:
        port += g.share * state[7]
    elif g.share_on == 1:
        starboard += g.share * state[6]
    port, starboard = port + h.rudder_offset_port, starboard + h.rudder_offset_starboard
    if h.rudder_limit > 0.0:
        port = min(max(port, -h.rudder_limit), h.rudder_limit)
        starboard = min(max(starboard, -h.rudder_limit), h.rudder_limit)
    screw = state[11] if g.rate[2] < math.inf else ordered(g, 2, state[8])
    return (
        stopped(g, 0, port, time), stopped(g, 1, starboard, time), stopped(g, 2, screw, time)
    )  # fmt: skip


@njit
def _of(h, g, i, track, row, part, dt, state):
    """A rudder's angle after dead time, lag, rate and play. A dead time takes the lagged one."""
    if h.rudder_delay > 0.0:
        return past(track, row, state, 9 + i, row + part - h.rudder_delay / dt)
    slow = h.rudder_lag > 0.0 or g.rate[i] < math.inf
    return state[9 + i] if slow else ordered(g, i, state[6 + i])


@njit
def settle(g, port, starboard, screw):
    """At a step's end: where the units stand within their backlash."""
    for i in range(3):
        if g.play[i] > 0.0:
            order = port if i == 0 else (starboard if i == 1 else screw)
            g.stood[i] = ordered(g, i, order)


@njit
def pulls(e, wall, breadth, north, east, psi, campaign):
    """X, Y, N at midship of all that pulls or pushes from outside; `wall` [m] is its y₀."""
    cos, sin = math.cos(psi), math.sin(psi)
    x = y = n = 0.0
    if e.stiffness > 0.0 or e.force > 0.0:
        away_north, away_east = e.north - north - e.line_at * cos, e.east - east - e.line_at * sin
        far = math.hypot(away_north, away_east) + 1e-9
        over = far - e.length
        if over > 0.0:
            pull = (e.stiffness * over + e.force * min(over / EASE, 1.0)) / far
            side = pull * (away_east * cos - away_north * sin)
            x += pull * (away_north * cos + away_east * sin)
            y += side
            n += e.line_at * side
    if e.tow > 0.0:
        angle = e.towards + e.turning * campaign - psi
        x += e.tow * math.cos(angle)
        y += e.tow * math.sin(angle)
        n += e.tow_at * e.tow * math.sin(angle)
    if e.fender > 0.0:
        gap = wall - 0.5 * breadth - east
        push = e.fender * (max(1.0 - gap / e.reach, 0.0) + STIFF * max(-gap / e.reach, 0.0))
        x -= push * sin
        y -= push * cos
    return x, y, n
