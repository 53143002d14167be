"""Manoeuvres in ordinary logs: turns, zigzags of any angle, stops, pull-outs and spirals, and parts
of them.

Everything is in the ship's own time L/V. A manoeuvre is recognised by what was ordered and what the
heading did meanwhile; whether it is of a standard is `conditions`' to say.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.manoeuvres.holds import HELD, Hold, holds, ordered
from shiplog.manoeuvres.track import Track

TURNED = math.radians(4.0)  # of rudder, below which a course is kept
AMIDSHIPS = math.radians(2.0)
LEAST_TURN = math.radians(90.0)  # of heading: less gives no quantity of a circle
SAME_ANGLE, SAME_SHARE = math.radians(2.0), 0.2  # by which two orders of a zigzag may differ
SAME_HEADING, SAME_HEADING_SHARE = math.radians(2.5), 0.35  # and the headings of its reversals
LEAST_HEADING = math.radians(0.75)  # at which a zigzag is reversed; less is keeping a course
MOST_HEADING = math.radians(60.0)  # beyond, it is two turns
ON_THE_WAY = 2.0  # L/V that a rudder may take from one hold to the next
MARGIN = 4.0  # L/V before the order that are kept: its approach
STEADY_HOLD = 3.0  # L/V of a step of a spiral, or of a pull-out
SPIRAL_STEP = math.radians(12.0)  # between two angles of a spiral
SPIRAL_STEPS = 5  # of them, both sides among them
MOVING = 0.25  # of the voyage's nominal speed, below which nothing is a manoeuvre at speed
AT_SPEED = 0.5  # of the nominal speed, below which a stop is the end of one
MOST_GAIN = 0.5  # share by which the speed may change before a zigzag of one reversal
STOPPED_SCREW = 0.05  # of the approach's revolutions
LOST = 0.5  # of the speed, of a stop that is a part


@dataclass(frozen=True)
class Approach:
    """Of the last lengths before an order.

    speed    mean, m/s; `gained` over it, as a share
    yaw      mean r L/V; `rudder` mean of its moduli, rad
    screw    median of the revolutions, as recorded
    """

    speed: float
    yaw: float
    rudder: float
    gained: float
    screw: float

    @property
    def steady(self) -> bool:
        """Of course, as a standard wants it."""
        return abs(self.yaw) <= COURSE_RATE and self.rudder <= COURSE_RUDDER

    @property
    def straight(self) -> bool:
        """Near enough that what follows is the order's doing."""
        return abs(self.yaw) <= STRAIGHT_RATE


@dataclass(frozen=True)
class Found:
    """One manoeuvre of a voyage.

    kind     turn, zigzag, stop, pull_out or spiral
    begin    s into the voyage of the first order; `end` of the last sample that belongs to it
    side     1 to starboard, -1 to port, of its first order
    angle    of the rudder, rad, positive; heading  of a zigzag's reversals, rad
    orders   s of each order of the rudder
    track    from its approach on
    approach how steady the course was before it; None where the record does not show it
    part     why it is a part of a manoeuvre; empty where it is whole
    """

    voyage: str
    kind: str
    begin: float
    end: float
    side: float
    angle: float
    heading: float
    orders: tuple[float, ...]
    track: Track
    approach: Approach | None
    part: str = ""
    steps: tuple[tuple[float, float], ...] = ()

    @property
    def straight(self) -> bool:
        return went_straight(self.track, self.begin, self.approach)

    @property
    def name(self) -> str:
        """As a sheet has it: `turn 35 deg to starboard`, `zigzag 10/10`."""
        degrees = math.degrees(self.angle)
        where = "starboard" if self.side > 0 else "port"
        match self.kind:
            case "turn":
                return f"turn with {degrees:.0f} deg to {where}"
            case "zigzag":
                return f"zigzag {degrees:.0f}/{math.degrees(self.heading):.0f}, {where} first"
            case "pull_out":
                return f"pull-out after a turn to {where}"
        return self.kind


def recognise(voyage: str, stretches: Sequence[Track]) -> list[Found]:
    """All of a voyage's unbroken stretches, by time."""
    speeds = np.concatenate([s.state[:, 1] for s in stretches]) if stretches else np.zeros(0)
    ahead = speeds[speeds > 0.0]
    if not len(ahead):
        return []
    nominal = float(np.quantile(ahead, 0.9))
    found: list[Found] = []
    for track in stretches:
        if len(track) < 3:
            continue
        found += _of_stretch(voyage, track, nominal)
    return sorted(found, key=lambda one: one.begin)


def _of_stretch(voyage: str, track: Track, nominal: float) -> list[Found]:
    length_time = track.length / nominal
    held = holds(track, length_time)
    found, taken = [], set()
    for first, last in _spirals(track, held, length_time):
        found.append(_spiral(voyage, track, held[first : last + 1]))
        taken |= set(range(first, last + 1))
    at = 0
    while at < len(held):
        if at in taken or abs(held[at].angle) < TURNED:
            at += 1
            continue
        chain = _chain(track, held, at, length_time)
        made = _zigzag(voyage, track, held, chain, nominal) if len(chain) > 1 else None
        if made is not None:
            found.append(made)
            taken |= set(chain)
            at = chain[-1] + 1
            continue
        turn = _turn(voyage, track, held, at, nominal)
        if turn is not None:
            found.append(turn)
            pulled = _pull_out(voyage, track, held, at, length_time)
            found += [pulled] if pulled is not None else []
        at += 1
    return found + _stops(voyage, track, nominal)


# --- the approach ----------------------------------------------------------------------------

BEFORE = 1.5  # L/V before the order that are its approach
COURSE_RUDDER = math.radians(5.0)  # that a helmsman needs to keep a course
COURSE_RATE = 0.1  # |r| L/V: 6 degrees in a length
STRAIGHT_RATE = 0.3  # |r| L/V beyond which a ship is in a turn: 35 deg of rudder give 0.3 to 0.8


def approach_of(track: Track, begin: float) -> Approach | None:
    """None where the record does not show half of it."""
    row = track.row(begin)
    length_time = track.length / max(float(track.speed[row]), 1e-3)
    before = track.between(begin - BEFORE * length_time, begin)
    if len(before) < 2 or before.time[-1] - before.time[0] < 0.5 * BEFORE * length_time:
        return None
    spent = float(before.time[-1] - before.time[0])
    turned = float(before.heading[-1] - before.heading[0])
    speed = before.speed
    return Approach(
        speed=float(speed.mean()),
        yaw=turned / spent * length_time,
        rudder=float(np.abs(before.rudder[: max(1, len(before) - 3)]).mean()),
        gained=float(speed[-1] - speed[0]) / max(float(speed.mean()), 1e-6),
        screw=float(np.median(before.screw)),
    )


def went_straight(track: Track, begin: float, before: Approach | None) -> bool:
    """Whether what follows an order is its doing; of a record that begins with it, by the yaw rate
    there."""
    if before is not None:
        return before.straight
    row = track.row(begin)
    length_time = track.length / max(float(track.speed[row]), 1e-3)
    return bool(abs(track.yaw_rate[row]) * length_time <= COURSE_RATE)


def _base(track: Track, before: Hold | None, hold: Hold, length_time: float) -> float:
    """Where the rudder was before it went to a hold: at the hold before, or on average."""
    if before is not None and hold.begin - before.end <= ON_THE_WAY * length_time:
        return before.angle
    rows = track.time[(track.time < hold.begin) & (track.time > hold.begin - length_time)]
    if not len(rows):
        return 0.0
    part = track.between(float(rows[0]), float(rows[-1]))
    return float(np.median(part.rudder))


def _order(track: Track, held: Sequence[Hold], at: int, length_time: float) -> float:
    before = held[at - 1] if at else None
    base = _base(track, before, held[at], length_time)
    # within its tolerance the hold before has gone a part of the way already
    earliest = before.begin if before is not None and base == before.angle else (
        held[at].begin - ON_THE_WAY * length_time
    )  # fmt: skip
    return ordered(track, earliest, held[at], base)


def _cut(track: Track, begin: float, end: float) -> Track:
    row = track.row(begin)
    length_time = track.length / max(float(track.speed[row]), 1e-3)
    return track.between(begin - MARGIN * length_time, end)


# --- zigzags ---------------------------------------------------------------------------------


def _chain(track: Track, held: Sequence[Hold], at: int, length_time: float) -> list[int]:
    """Holds from this one on to one side and the other in turn, by equal angles."""
    chain = [at]
    while chain[-1] + 1 < len(held):
        one, after = held[chain[-1]], held[chain[-1] + 1]
        apart = abs(abs(one.angle) - abs(after.angle))
        alike = apart <= max(SAME_ANGLE, SAME_SHARE * abs(one.angle))
        near = after.begin - one.end <= ON_THE_WAY * length_time
        if not (alike and near and one.angle * after.angle < 0.0):
            break
        chain.append(chain[-1] + 1)
    return chain


def _zigzag(
    voyage: str, track: Track, held: Sequence[Hold], chain: list[int], nominal: float
) -> Found | None:
    length_time = track.length / nominal
    orders = [_order(track, held, i, length_time) for i in chain]
    side = math.copysign(1.0, held[chain[0]].angle)
    begin, end = orders[0], held[chain[-1]].end
    if track.at(track.state[:, 1], begin) < MOVING * nominal:
        return None
    before = approach_of(track, begin)
    straight = went_straight(track, begin, before)
    at = np.array([track.heading_at(t) for t in orders])
    if not straight and len(at) < 4:
        return None  # few orders out of a turn are steering
    if (
        len(at) < 3
        and before is not None
        and not (before.steady and abs(before.gained) < MOST_GAIN)
    ):
        return None  # so are two that follow others
    first = at[0] if straight else 0.5 * (at[1] + at[2])
    sides = side * (-1.0) ** np.arange(len(at) - 1)
    reached = sides * (at[1:] - first)
    heading = float(np.median(reached))
    allowed = max(SAME_HEADING, SAME_HEADING_SHARE * heading)
    if not LEAST_HEADING <= heading <= MOST_HEADING or (np.abs(reached - heading) > allowed).any():
        return None
    end = _swing_end(track, end, held, chain)
    part = ""
    if not straight:
        part = "it begins out of a turn, and its first swing says nothing"
    elif len(orders) == 2:
        part = "one reversal: it has a first overshoot, and no second one and no period"
    elif len(orders) == 3:
        part = "two reversals: it has no third overshoot and no period"
    angle = float(np.mean([abs(held[i].angle) for i in chain]))
    return Found(
        voyage, "zigzag", begin, end, side, angle, heading, tuple(orders),
        _cut(track, begin, end), before, part,
    )  # fmt: skip


def _swing_end(track: Track, end: float, held: Sequence[Hold], chain: list[int]) -> float:
    """The last swing goes on until the rudder is moved again."""
    after = chain[-1] + 1
    return held[after].begin if after < len(held) else float(track.time[-1])


# --- turns -----------------------------------------------------------------------------------


def _turn(voyage: str, track: Track, held: Sequence[Hold], at: int, nominal: float) -> Found | None:
    hold, length_time = held[at], track.length / nominal
    side = math.copysign(1.0, hold.angle)
    begin = _order(track, held, at, length_time)
    if track.at(track.state[:, 1], begin) < MOVING * nominal:
        return None
    turned = side * (track.heading_at(hold.end) - track.heading_at(begin))
    if turned < LEAST_TURN:
        return None
    before = approach_of(track, begin)
    degrees = math.degrees(turned)
    part = ""
    if turned < 2.0 * LEAST_TURN:
        part = f"{degrees:.0f} deg: it has an advance and a transfer, and no tactical diameter"
    elif turned < 3.0 * LEAST_TURN:
        part = f"{degrees:.0f} deg: it has no steady turn"
    elif turned < math.radians(480.0):
        part = f"{degrees:.0f} deg: no two positions are 360 deg apart, and the current is unknown"
    if not went_straight(track, begin, before):
        part = "it begins out of another turn, and has neither advance nor diameter" + (
            f"; {part}" if part else ""
        )
    return Found(
        voyage, "turn", begin, hold.end, side, abs(hold.angle), 0.0, (begin,),
        _cut(track, begin, hold.end), before, part,
    )  # fmt: skip


def _pull_out(
    voyage: str, track: Track, held: Sequence[Hold], at: int, length_time: float
) -> Found | None:
    if at + 1 >= len(held):
        return None
    turn, after = held[at], held[at + 1]
    near = after.begin - turn.end <= ON_THE_WAY * length_time
    if not near or abs(after.angle) > AMIDSHIPS or after.seconds < STEADY_HOLD * length_time:
        return None
    begin = _order(track, held, at + 1, length_time)
    side = math.copysign(1.0, turn.angle)
    return Found(
        voyage, "pull_out", begin, after.end, side, abs(turn.angle), 0.0, (begin,),
        _cut(track, begin, after.end), approach_of(track, begin),
    )  # fmt: skip


# --- spirals ---------------------------------------------------------------------------------


def _spirals(track: Track, held: Sequence[Hold], length_time: float) -> list[tuple[int, int]]:
    """First and last hold of each: steady ones, in small steps to the other side, and back."""
    found, at = [], 0
    long = [h.seconds >= STEADY_HOLD * length_time for h in held]
    while at < len(held):
        last, turns, way = at, 0, 0.0
        while last + 1 < len(held) and long[last] and long[last + 1]:
            step = held[last + 1].angle - held[last].angle
            if not HELD * 0.5 < abs(step) <= SPIRAL_STEP:
                break
            turns += way * step < 0.0
            if turns > 1:
                break
            way, last = step, last + 1
        angles = [h.angle for h in held[at : last + 1]]
        if len(angles) >= SPIRAL_STEPS and min(angles) < -HELD and max(angles) > HELD:
            found.append((at, last))
        at = max(last, at + 1)
    return found


def _spiral(voyage: str, track: Track, held: Sequence[Hold]) -> Found:
    from shiplog.manoeuvres.steadiness import settled

    steps = tuple((h.angle, settled(track, h.end)) for h in held)
    angles = [a for a, _ in steps]
    back = angles[0] > min(angles) < angles[-1] or angles[0] < max(angles) > angles[-1]
    begin, end = held[0].begin, held[-1].end
    return Found(
        voyage, "spiral", begin, end, math.copysign(1.0, angles[0]), max(map(abs, angles)), 0.0,
        tuple(h.begin for h in held), _cut(track, begin, end), approach_of(track, begin),
        "" if back else "one way only: it has no loop", steps,
    )  # fmt: skip


# --- stops -----------------------------------------------------------------------------------


def _stops(voyage: str, track: Track, nominal: float) -> list[Found]:
    """The screw stopped or reversed at speed, until the ship has stopped or goes ahead again."""
    driven = track.screw
    if not len(driven) or not (driven > 0.0).any():
        return []
    length_time = track.length / nominal
    off = driven <= STOPPED_SCREW * float(np.quantile(driven[driven > 0.0], 0.9))
    edges = np.flatnonzero(np.diff(off.astype(int)) == 1)
    found = []
    for k in edges:
        begin = float(track.time[k])
        speed = float(track.state[k, 1])
        before = track.between(begin - length_time, begin)
        if speed < AT_SPEED * nominal or not len(before) or (before.screw <= 0.0).all():
            continue
        ahead = np.flatnonzero(~off[k + 1 :])
        last = k + int(ahead[0]) if len(ahead) else len(track) - 1
        slow = np.flatnonzero(track.state[k : last + 1, 1] <= 0.0)
        whole = bool(len(slow))
        last = k + int(slow[0]) if whole else last
        if last <= k + 1 or (not whole and track.state[last, 1] > LOST * speed):
            continue
        reversed_ = bool((driven[k : last + 1] < -STOPPED_SCREW).any())
        part = (
            ""
            if whole
            else f"it is not stopped: {track.state[last, 1] / speed:.0%} of its speed remain"
        )
        if not reversed_:
            part = "the propeller is stopped, and never astern" + (f"; {part}" if part else "")
        end = float(track.time[min(last + 1, len(track) - 1)])
        found.append(Found(
            voyage, "stop", begin, end, 1.0, 0.0, 0.0, (begin,), _cut(track, begin, end),
            approach_of(track, begin), part,
        ))  # fmt: skip
    return found
