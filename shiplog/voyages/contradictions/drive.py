"""Actuators that drive the other way than the profile says, and which way the bow is.

The sense of the yaw rate and of the surge has to be confirmed first: else one fault is said twice.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from shiplog.logs.health.health_report import Finding
from shiplog.ship_profile.profile import Actuator
from shiplog.ship_profile.profile_lines import declared, offset_line, sign_line, unit_line
from shiplog.voyages.contradictions import actuators
from shiplog.voyages.contradictions.actuators import ASTERN, Driven
from shiplog.voyages.contradictions.evidence import (
    ALONG_DEG,
    JOINED,
    LEAST_SPREAD,
    SPREAD,
    Evidence,
    Way,
    angle_heading,
    of_voyage,
)
from shiplog.voyages.contradictions.pairs import GRAVITY
from shiplog.voyages.contradictions.track import Track

DRIVES = 0.2  # of the largest thrust: the ship is driven
MOSTLY = 0.75  # of the time under way; the ship coasts for the rest
FAST_FROUDE = 0.15  # U/√(g L): a ship that goes so fast goes where its bow points, or astern
APART_WAY = 0.8  # share of the way that a heading leaves unexplained: they have nothing in common
FEWEST_WINDOWS = 20
# Of the way from the bow, of a heading that is counted from another axis: 90 deg, and what leeway
# or an antenna add to it. A ship that drifts may go 65 deg off its bow for a whole voyage.
BEAM_DEG = (75.0, 105.0)


def driven(t: Track, e: Evidence) -> list[Driven]:
    """What the actuators do; nothing where the motion itself is in doubt."""
    if "heading" in e.faulty or "velocity" in e.faulty:
        return []
    yaw_rate = t.yaw_rate
    if "yaw_rate" in e.faulty:
        yaw_rate = np.gradient(np.unwrap(t.heading), 0.1)
    found = actuators.driven(t, yaw_rate)
    if t.profile.sensors.yaw_rate is not None and e.turned is None:  # its sense is not known
        found = [one for one in found if one.direction in ("surge", "sway")]
    return found


def findings(t: Track, e: Evidence, found: Sequence[Driven]) -> Iterator[Finding]:
    """One a fault: of an actuator's sign, of two exchanged, or of the heading's zero."""
    if e.faulty & {"heading", "velocity", "position"}:
        return
    astern = _bow(t, e, found) or _nowhere(t, e)
    if astern is not None:
        yield astern
        return
    by_name: dict[str, list[Driven]] = {}
    for one in found:
        by_name.setdefault(one.name, []).append(one)
    exchanged = _exchanged(t, by_name)
    if exchanged is not None:
        yield exchanged
        return
    for actuator in t.profile.actuators:
        ways = by_name.get(actuator.name, [])
        against = [one for one in ways if one.against and one.direction != ASTERN]
        if not against or any(one.along or one.together > actuators.SURE for one in ways):
            continue
        yield _sign(t, e, actuator, against, _all_against(found, against))


def _all_against(found: Sequence[Driven], against: list[Driven]) -> bool:
    """Whether every actuator that tells anything in these directions drives the other way: it may
    then be the axes of the motion."""
    directions = {one.direction for one in against}
    told = [one for one in found if one.direction in directions and (one.along or one.against)]
    return len({one.name for one in told}) > 1 and not any(one.along for one in told)


def _sign(t: Track, e: Evidence, actuator: Actuator, against: list[Driven], whole: bool) -> Finding:
    line = _sign_line(actuator)
    directions = [one.direction for one in against]
    if actuator.kind == "rudder":
        what = f"The bow turns to port where {actuator.name} is positive"
    else:
        ways = " and ".join(directions)
        what = f"{actuator.name} drives the other way than the profile has it ({ways})"
    also = ""
    if "yaw rate" in directions and not _sense(e):
        also = "; or heading and yaw rate are counted to port"
    elif "yaw rate" not in directions and (whole or _astern(e)):
        why = "as the others do so too" if whole else "as the ship goes astern by it"
        also = f"; or, {why}, the heading is turned by 180 deg"
    best = max(against, key=lambda one: one.explained)
    along, turned = (math.degrees(one) for one in max(one.turned for one in against))
    shown = f"{turned:.0f} deg against it while it is held, {along:.0f} deg with it"
    if best.windows:
        share = f"{100.0 * best.explained:.0f} %"
        shown = (
            f"{share} of the change follow it with the sign turned round, in {best.windows} windows"
        )
    sentence = f"{what}: {shown}{also}. Change: {line}."
    return of_voyage(t, actuator.name, (-1.0, None, None), "1", "sign", sentence)


def _sense(e: Evidence) -> bool:
    """Whether the way over ground confirms to which side the heading turns."""
    return any(w.how == "as it is" and w.sense for w in e.ways)


def _astern(e: Evidence) -> bool:
    """Whether the way over ground leads astern by the heading."""
    return any(w.how == "as it is" and abs(w.angle) > 180.0 - ALONG_DEG for w in e.ways)


def _exchanged(t: Track, by_name: dict[str, list[Driven]]) -> Finding | None:
    """Two thrusters on either side that drive ahead but turn the other way: they are each other."""
    pair = []
    for actuator in t.profile.actuators:
        ways = {one.direction: one for one in by_name.get(actuator.name, [])}
        surge, yaw = ways.get("surge"), ways.get("yaw rate")
        if yaw is not None and yaw.against and (surge is None or not surge.against):
            if surge is None or not (surge.along or surge.together > actuators.SURE):
                continue
            pair.append(actuator)
    sides = {math.copysign(1.0, one.position_m[1]) for one in pair if one.position_m[1] != 0.0}
    if len(sides) < 2:
        return None
    names = " and ".join(one.name for one in pair)
    sentence = (
        f"{names} drive ahead, but turn the ship to the other side than their places say: port and "
        "starboard are exchanged. Change: `position_m` or `topic` of the two."
    )
    return of_voyage(t, pair[0].name, (-1.0, None, None), "1", "swapped", sentence)


def _bow(t: Track, e: Evidence, found: Sequence[Driven]) -> Finding | None:
    """A ship that is driven ahead and goes astern or abeam for the whole voyage, or is driven
    astern and goes ahead. Of a ship that can go sideways nothing is said, nor of one that a stream
    may set."""
    way = e.by_position or e.by_velocity
    thrusts = actuators.thrust(t)
    if way is None or way.how != "as it is" or not thrusts:
        return None
    straight = way.spread < LEAST_SPREAD and not way.sense
    if way.half > 15.0 or straight or actuators.can_push_sideways(t):
        return None
    share = _driven_share(t, [part[0] for part in thrusts.values()])
    if way.ahead and way.fixed and share < -MOSTLY:
        return _driven_astern(t, way)
    if share < MOSTLY or way.drift:
        return None
    if abs(way.angle) > 180.0 - ALONG_DEG:
        return _reversed(t, way, found)
    turns = way.spread > SPREAD or (way.sense and _fast(e))
    if BEAM_DEG[0] < abs(way.angle) < BEAM_DEG[1] and turns:
        return _abeam(t, way)
    return None


def _nowhere(t: Track, e: Evidence) -> Finding | None:
    """A ship that is driven ahead at speed, and whose heading has nothing to do with where it goes.
    A slow one may be turned by its rudders and pushed sideways by them."""
    parts = [part[0] for part in actuators.thrust(t).values()]
    if e.moved is None or not parts or actuators.can_push_sideways(t):
        return None
    together = e.joined is not None and e.joined.left.get("as it is", 1.0) < JOINED
    if not (_fast(e) and together and min(e.apart, default=0.0) > APART_WAY):
        return None
    if _driven_share(t, parts) < MOSTLY or len(e.moved.by_velocity) < FEWEST_WINDOWS:
        return None
    e.faulty.add("heading")
    lines = "Look at topic, field, unit and sign of [sensors.heading]."
    reason = "none known"
    if angle_heading(t.profile) and declared(t.profile, "heading") == "rad":
        reason, line = "unit", unit_line(t.profile, "heading", "deg")
        lines = f"Change: {line}, if degrees are read as radians."
    left, speed = min(e.apart), _speed(e)
    sentence = (
        f"The heading has nothing in common with the way over ground of a ship that {_names(t)} "
        f"drives ahead at {speed:.2g} m/s: it leaves {100 * left:.0f} % of the way unexplained, "
        f"and position and velocity agree. {lines}"
    )
    return of_voyage(t, "heading", (left, None, None), "1", reason, sentence)


def _speed(e: Evidence) -> float:
    """Of the windows under way, m/s."""
    if e.moved is None:
        return 0.0
    return float(np.median(np.abs(e.moved.by_velocity))) / e.moved.windows.seconds


def _fast(e: Evidence) -> bool:
    return _speed(e) > FAST_FROUDE * math.sqrt(GRAVITY * e.profile.ship.length_m)


def _driven_share(t: Track, forces: list[np.ndarray]) -> float:
    """Of the time under way, how much the ship is driven ahead; negative for astern."""
    force = np.nan_to_num(sum(forces))
    speed = np.abs(t.velocity)
    sails = speed > 0.5 * float(np.quantile(speed, 0.9))
    most = float(np.quantile(np.abs(force), 0.95))
    if most <= 0.0 or not sails.any():
        return 0.0
    ahead = float(np.mean(force[sails] > DRIVES * most))
    astern = float(np.mean(force[sails] < -DRIVES * most))
    return ahead if ahead > astern else -astern


def _propellers(t: Track) -> list[Actuator]:
    return [a for a in t.profile.actuators if a.kind in ("propeller", "thruster")]


def _heading_line(t: Track, zero: float) -> str:
    if t.profile.sensors.kind("heading") != "angle":
        return "the frame and the `kind` of [sensors.heading]"
    return offset_line(t.profile, "heading", round(zero))


def _driven_astern(t: Track, way: Way) -> Finding:
    one = _propellers(t)[0]
    sentence = (
        f"The ship is driven astern by {_names(t)} and goes ahead, within {way.half:.0f} deg of "
        f"the bow, nearly all the time. Change: {_sign_line(one)}, or the heading by 180 deg."
    )
    return of_voyage(t, one.name, (-1.0, None, None), "1", "sign", sentence)


def _names(t: Track) -> str:
    return " and ".join(one.name for one in _propellers(t))


def _reversed(t: Track, way: Way, found: Sequence[Driven]) -> Finding:
    """Ahead by the propeller and astern by the heading: a rudder that steers as it does ahead says
    that it is the heading."""
    steered = any(one.direction == ASTERN and one.along for one in found)
    lines = _heading_line(t, 180.0)
    if t.body:
        lines += f" with {sign_line(t.profile, 'velocity')}"
    who = (
        "It is the heading: the rudder steers as it does on a ship that goes ahead. Change: "
        if steered else f"It is the heading, or the sign of {_names(t)}. Change: "
    )  # fmt: skip
    if not steered:
        lines += f" or {_sign_line(_propellers(t)[0])}"
    sentence = (
        f"The ship is driven ahead by {_names(t)} and goes astern by its heading, "
        f"{abs(way.angle):.0f} deg off the bow (within {way.half:.0f}), nearly all the time. "
        f"{who}{lines}."
    )
    interval = 180.0, 180.0 - way.half, 180.0 + way.half
    return of_voyage(t, "heading", interval, "deg", "sign", sentence)


def _abeam(t: Track, way: Way) -> Finding:
    shown = -way.angle
    quarter = math.copysign(90.0, shown)
    sentence = (
        f"The ship is driven ahead by {_names(t)} and goes sideways by its heading, "
        f"{abs(way.angle):.0f} deg off the bow (within {way.half:.0f}) on all courses. It is the "
        f"heading, counted from another axis. Change: {_heading_line(t, quarter)}."
    )
    interval = shown, shown - way.half, shown + way.half
    return of_voyage(t, "heading", interval, "deg", "frame", sentence)


def _sign_line(actuator: Actuator) -> str:
    sign = actuator.sign[0] if isinstance(actuator.sign, tuple) else actuator.sign
    text = f"{-sign:.1f}" if abs(sign) == 1.0 else f"{-sign:g}"
    return f'sign = {text} on the actuator "{actuator.name}"'
