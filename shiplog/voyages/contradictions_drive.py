"""Actuators that drive the other way than the profile says, and which way the bow is.

The sense of the yaw rate and of the surge has to be confirmed first: else one fault is said twice.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from shiplog.logs.health_report import Finding
from shiplog.profile import Actuator
from shiplog.voyages import contradictions_actuators as actuators
from shiplog.voyages.contradictions_actuators import Driven
from shiplog.voyages.contradictions_evidence import ALONG_DEG, SPREAD, Evidence, Way, of_voyage
from shiplog.voyages.contradictions_track import Track
from shiplog.voyages.contradictions_words import offset_line, sign_line

DRIVES = 0.2  # of the largest thrust: the ship is driven
MOSTLY = 0.8  # of the time under way
BEAM_DEG = (60.0, 120.0)


def driven(t: Track, e: Evidence) -> list[Driven]:
    """What the actuators do; nothing where the motion itself is in doubt."""
    if "heading" in e.faulty or "velocity" in e.faulty:
        return []
    yaw_rate = t.yaw_rate
    if "yaw_rate" in e.faulty:
        yaw_rate = np.gradient(np.unwrap(t.heading), 0.1)
    return actuators.driven(t, yaw_rate)


def findings(t: Track, e: Evidence, found: Sequence[Driven]) -> Iterator[Finding]:
    """One a fault: of an actuator's sign, of two exchanged, or of the heading's zero."""
    astern = _bow(t, e, found)
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
        against = [one for one in ways if one.against]
        if not against or any(one.along for one in ways):
            continue
        yield _sign(t, e, actuator, against)


def _sign(t: Track, e: Evidence, actuator: Actuator, against: list[Driven]) -> Finding:
    sign = actuator.sign if isinstance(actuator.sign, float) else actuator.sign[0]
    line = f'sign = {-sign:.4g} on the actuator "{actuator.name}"'.replace("= -1 ", "= -1.0 ")
    line = line.replace("= 1 ", "= 1.0 ")
    if actuator.kind == "rudder":
        what = f"The bow turns to port where the rudder {actuator.name} is positive"
        sure = _sense(t, e)
        also = "" if sure else "; or heading and yaw rate are counted to port"
    else:
        ways = " and ".join(one.direction for one in against)
        what = (
            f"The {actuator.kind} {actuator.name} drives the other way than the profile has it "
            f"({ways})"
        )
        also = ""
    best = max(against, key=lambda one: one.explained)
    sentence = (
        f"{what}: {100.0 * best.explained:.0f} % of the change follow it with the sign turned "
        f"round, in {best.windows} windows{also}. Change: {line}."
    )
    return of_voyage(t, actuator.name, (-1.0, None, None), "1", "sign", sentence)


def _sense(t: Track, e: Evidence) -> bool:
    """Whether the way over ground confirms to which side the heading turns."""
    ways = (e.by_position, e.by_velocity)
    return any(w is not None and w.how == "as it is" and w.sense for w in ways)


def _exchanged(t: Track, by_name: dict[str, list[Driven]]) -> Finding | None:
    """Two thrusters on either side that drive ahead but turn the other way: they are each other."""
    pair = []
    for actuator in t.profile.actuators:
        ways = {one.direction: one for one in by_name.get(actuator.name, [])}
        surge, yaw = ways.get("surge"), ways.get("yaw rate")
        if yaw is not None and yaw.against and (surge is None or not surge.against):
            if surge is None or not surge.along or actuator.kind == "rudder":
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
    """A ship that is driven ahead and goes astern or abeam for the whole voyage, whatever its
    heading: the heading has another zero. Of a ship that can go sideways nothing is said."""
    way = e.by_position or e.by_velocity
    if way is None or way.how != "as it is" or actuators.can_push_sideways(t):
        return None
    if abs(way.angle) < ALONG_DEG + way.half or way.half > 15.0 or way.spread < SPREAD:
        return None
    thrusts = actuators.thrust(t)
    if not thrusts:
        return None
    ahead = np.nan_to_num(sum(part[0] for part in thrusts.values()))
    speed = np.abs(t.velocity)
    sails = speed > 0.5 * float(np.quantile(speed, 0.9))
    most = float(np.quantile(np.abs(ahead), 0.95))
    share = float(np.mean(ahead[sails] > DRIVES * most)) if most > 0 and sails.any() else 0.0
    steered = [one for one in found if one.direction == "yaw rate" and one.along]
    if share < MOSTLY:
        return None
    return _turned_bow(t, way, bool(steered))


def _turned_bow(t: Track, way: Way, steered: bool) -> Finding | None:
    reverse = abs(way.angle) > 180.0 - ALONG_DEG
    beam = BEAM_DEG[0] < abs(way.angle) < BEAM_DEG[1]
    if not (reverse or beam):
        return None
    p = t.profile
    shown = 180.0 if reverse else -way.angle
    line = offset_line(p, "heading", round(shown)) if p.sensors.kind("heading") == "angle" else (
        "the frame and the `kind` of [sensors.heading]"
    )  # fmt: skip
    propellers = [a.name for a in p.actuators if a.kind in ("propeller", "thruster")]
    signs = " and ".join(f'"{name}"' for name in propellers)
    if reverse:
        or_else = f", or the sign of {signs}"
        what = "goes astern"
    else:
        or_else, what = "", "goes sideways"
    if t.body:
        line = f"{line}, with {sign_line(p, 'velocity')}" if reverse else line
    sentence = (
        f"The ship is driven ahead and {what} by its heading, {abs(way.angle):.0f} deg off the bow "
        f"(within {way.half:.0f}) on all courses. Change: {line}{or_else}."
    )
    interval = shown, shown - way.half, shown + way.half
    reason = "sign" if reverse else "frame"
    return of_voyage(t, "heading", interval, "deg", reason, sentence)
