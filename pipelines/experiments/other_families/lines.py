"""Lines, tows and a wall's fenders: forces that come from outside and are nowhere recorded.

    line      F = k max(d - l, 0) towards a point at distance d, or a winch's constant F beyond l
    tow       F constant, its direction turns slowly: θ = θ₀ + θ̇ s, s the share of the campaign
    contact   F = f max(1 - g/e, 0) off the wall, g the gap between ship's side and wall; where the
              fender is flat, g < 0, the quay itself is stiffer

Each acts where it is made fast, `ahead` of midship, and so turns the ship: N = `ahead` · Y. Linear
stiffness: OCIMF (2018), Mooring Equipment Guidelines 4, of synthetic lines below half of their
breaking load; fenders: PIANC (2002), of air block fenders in the first half of their deflection.
"""

from __future__ import annotations

import math
from collections import namedtuple
from dataclasses import dataclass

from numba import njit

WALL = 12.0  # the quay is so many times stiffer than its fenders

External = namedtuple(
    "External",
    "stiffness constant slack north east line_at tow tow_bearing tow_turn tow_at "
    "contact reach wall_east any",
)


@dataclass(frozen=True, slots=True)
class Line:
    """To a fixed point. Either `stiffness` or `constant` is zero."""

    north: float  # m
    east: float
    slack: float  # m, its own length
    stiffness: float = 0.0  # N/m
    constant: float = 0.0  # N
    ahead: float = 0.0  # m, of midship, where it is made fast on board


@dataclass(frozen=True, slots=True)
class Tow:
    force: float  # N
    bearing: float  # rad, where it pulls at the campaign's start
    turn: float  # rad, over the campaign
    ahead: float = 0.0  # m


@dataclass(frozen=True, slots=True)
class Contact:
    force: float  # N, of a fender that is pressed flat
    reach: float  # m, its thickness


def external(
    line: Line | None, tow: Tow | None, contact: Contact | None, wall_east: float
) -> External:
    one, two, three = line or Line(0.0, 0.0, 0.0), tow or Tow(0.0, 0.0, 0.0), contact
    return External(
        one.stiffness, one.constant, one.slack, one.north, one.east, one.ahead, two.force,
        two.bearing, two.turn, two.ahead, three.force if three else 0.0,
        three.reach if three else 1.0, wall_east, bool(line or tow or contact),
    )  # fmt: skip


@njit
def pull_of(x, distance):
    """N, of a line whose end is `distance` away."""
    over = distance - x.slack
    if over <= 0.0:
        return 0.0
    # a winch takes up over the first tenth of its slack: no jerk from nothing to all of it
    return x.stiffness * over + x.constant * min(over / (0.1 * x.slack + 1e-9), 1.0)


@njit
def add_external(x, north, east, psi, breadth, campaign, out):
    """Add X, Y, N at midship to `out`, of a ship at (north, east) with heading ψ."""
    cos, sin = math.cos(psi), math.sin(psi)
    if x.stiffness > 0.0 or x.constant > 0.0:
        to_north = x.north - north - x.line_at * cos
        to_east = x.east - east - x.line_at * sin
        far = math.sqrt(to_north * to_north + to_east * to_east) + 1e-9
        share = pull_of(x, far) / far
        side = share * (-to_north * sin + to_east * cos)
        out[0] += share * (to_north * cos + to_east * sin)
        out[1] += side
        out[2] += x.line_at * side
    if x.tow > 0.0:
        angle = x.tow_bearing + x.tow_turn * campaign - psi
        out[0] += x.tow * math.cos(angle)
        out[1] += x.tow * math.sin(angle)
        out[2] += x.tow_at * x.tow * math.sin(angle)
    if x.contact > 0.0:
        gap = x.wall_east - 0.5 * breadth - east
        off = x.contact * max(1.0 - gap / x.reach, 0.0)
        off += WALL * x.contact * max(-gap / x.reach, 0.0)
        out[0] -= off * sin
        out[1] -= off * cos
