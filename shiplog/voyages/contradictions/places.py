"""Position and velocity: ratio, angle, mirror and unit of what should be one thing."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from shiplog.logs.health.health_report import Finding
from shiplog.ship_profile.profile_lines import (
    converted_twice,
    declared,
    offset_line,
    other_unit,
    sign_line,
    times,
    unit_line,
)
from shiplog.ship_profile.table_channels import TABLE_CHANNELS
from shiplog.voyages.contradictions import pairs
from shiplog.voyages.contradictions.evidence import (
    ALONG_DEG,
    APART,
    BETTER,
    CLEARLY,
    FASTEST_CURRENT,
    GUARD,
    JOINED,
    NEAR_DEG,
    NONE_OF_TWO,
    SURE_DEG,
    Evidence,
    angle_heading,
    ending,
    sense_line,
)
from shiplog.voyages.contradictions.pairs import Joined
from shiplog.voyages.contradictions.regression import Regression
from shiplog.voyages.contradictions.track import degrees

RATIO = math.log(1.25)  # of position and velocity; nearer ratios are for the fit
KNOWN_RATIO, KNOWN_HALF = math.log(1.1), 0.02  # of two known units, where the ratio is exact
ANGLE_DEG = 3.0  # between two that are both over ground
BODY_ANGLE_DEG = 20.0  # between position and velocity in body axes: less is a heading offset
MAGNETIC_DEG = 30.0  # variations at sea are smaller, nearly everywhere
STANDS = 0.02  # of the other's speed: it does not move
FOLLOWS = 0.15  # unexplained share, and more: a delay is looked for
DRIFTS = 0.5  # of the ship's speed: a larger current is not to explain a sign away
ABOUT = 1.5  # times what is left of the change: as good
NOTHING = 1e-4  # |z|, and less: the position does not move at all
TWO = ("velocity", "position")
HEADINGS = ("heading mirrored", "heading in radians")  # formulas that a faulty heading excuses


def position_and_velocity(e: Evidence) -> Iterator[Finding]:
    """How they are joined, and how they should not be."""
    j = e.joined
    if j is None or e.moved is None:
        return
    as_is = j.fits.get("as it is")
    slow = e.moved.slowest
    if (still := _stands(e, j, slow)) is not None:
        yield still
        return
    if as_is is None:
        return
    left = dict(j.left)
    geodetic = e.profile.sensors.kind("position") == "geodetic"
    if not geodetic or left.get("swapped", 1.0) > 0.5 * left.get("mirrored", 1.0):
        left.pop("swapped", None)
    best = min(left, key=lambda name: left[name])
    better = (
        left[best] < JOINED
        and as_is.left > BETTER * left[best]
        and as_is.left - left[best] > CLEARLY
    )
    if e.t.body and not pairs.natural(as_is) and _drift(j, as_is) > DRIFTS:
        plain = [name for name in left if name != "as it is" and _plain(j, name)]
        best = min(plain, key=lambda name: left[name], default="")
        if not best or left[best] > ABOUT * as_is.left + CLEARLY:
            return
        better = True
    if e.t.body and "heading" in e.faulty:
        if better and best in HEADINGS:
            yield from _ratio(e, j.fits[best])
    elif better:
        yield _other_formula(e, j, best)
        if best != "swapped":
            yield from _ratio(e, j.fits[best])
    elif as_is.left > FOLLOWS and (late := _late(e)) is not None:
        yield late
    elif as_is.left < JOINED:
        yield from _ratio(e, as_is)
        yield from _angle(e, as_is)
    elif min(left.values()) > APART and min(j.speeds) > slow:
        yield _nothing_in_common(e, j)


def _drift(j: Joined, fit: Regression) -> float:
    """Of a velocity in body axes: the current that the fit needs, over the ship's speed."""
    return float(np.hypot(*fit.theta[-2:])) / max(*j.speeds, 1e-6)


def _plain(j: Joined, name: str) -> bool:
    """Whether a formula needs no current, and no turn but by quarters."""
    if name == "swapped":
        return True
    size, angle, _, _ = j.fits[name].polar()
    quarter = abs(math.remainder(angle, 0.5 * math.pi)) < pairs.NATURAL
    return quarter and abs(math.log(size)) < pairs.NATURAL and _drift(j, j.fits[name]) < DRIFTS


def _stands(e: Evidence, j: Joined, slow: float) -> Finding | None:
    """One moves and the other not at all, or too little to say by how much."""
    as_is = j.fits.get("as it is")
    if as_is is not None and as_is.left < JOINED:
        size, _, half, _ = as_is.polar()
        if half < 0.3 and NOTHING < size < 1.0 / NOTHING:
            return None
    of_position, of_velocity = j.speeds
    constant = _constant(e.t.velocity) or _constant(e.t.place)  # no instrument is so quiet
    least = FASTEST_CURRENT if e.t.body and not constant else 2.0 * slow
    if of_position > least and of_velocity < STANDS * of_position:
        still, moves, ratio = "velocity", "position", of_position / max(of_velocity, 1e-3)
    elif of_velocity > least and of_position < STANDS * of_velocity:
        still, moves, ratio = "position", "velocity", of_velocity / max(of_position, 1e-3)
    else:
        return None
    e.faulty.add(still)
    bound = min(ratio, 1.0 / STANDS)
    sentence = (
        f"The {still} hardly moves while the {moves} goes {max(j.speeds):.2g} m/s: they differ by "
        f"more than {times(bound)} times. Look at topic, fields and units of [sensors.{still}]."
    )
    return e.finding(still, (bound, bound, None), "1", "none known", sentence)


def _constant(values: np.ndarray) -> bool:
    """To a micrometre, or a micrometre a second."""
    return float(np.max(np.abs(values - values[0]))) < 1e-6


def _ratio(e: Evidence, fit: Regression) -> Iterator[Finding]:
    size, _, half, _ = fit.polar()
    if not NOTHING < size < 1.0 / NOTHING:
        return
    log, p = -math.log(size), e.profile  # velocity over position
    ratio, low, high = (math.exp(one) for one in (log, log - half, log + half))
    of_velocity = other_unit(p, "velocity", ratio, low, high)
    of_position = other_unit(p, "position", 1.0 / ratio, 1.0 / high, 1.0 / low)
    known = (of_velocity or of_position) and half < KNOWN_HALF and abs(log) > KNOWN_RATIO
    if not (abs(log) - GUARD * half > RATIO or known):
        return
    geodetic = p.sensors.kind("position") == "geodetic"
    culprit = "velocity" if geodetic and (of_velocity or not of_position) else ""
    e.faulty |= {culprit} if culprit else set(TWO)
    lines = [
        f"{unit_line(p, channel, unit)}, the factor of {unit} read as {declared(p, channel)}"
        for channel, unit in (("velocity", of_velocity), ("position", of_position))
        if unit and culprit in ("", channel)
    ]
    if not lines and (twice := converted_twice(p, "velocity", ratio, low, high)):
        lines = [twice]
    why = "a position on Earth has its scale" if culprit else NONE_OF_TWO
    sentence = (
        f"The velocity is {times(ratio)} times ({times(low)} to {times(high)}) what the position "
        f"travels. {ending(culprit, why, lines, TWO)}"
    )
    reason = "unit" if lines else "none known"
    yield e.finding(culprit or "velocity", (ratio, low, high), "1", reason, sentence)


def _angle(e: Evidence, fit: Regression) -> Iterator[Finding]:
    _, angle, _, half = fit.polar()
    value, half = -degrees(angle), degrees(half)
    least = BODY_ANGLE_DEG if e.t.body else ANGLE_DEG
    if abs(value) - GUARD * half < least or half > SURE_DEG:
        return
    culprit, why = e.position_or_velocity(mirrored=False)
    if e.t.body and not culprit:
        culprit, why = _heading_of_body(e, value)
    reversed_ = abs(abs(value) - 180.0) < NEAR_DEG + half
    quarter = abs(abs(value) - 90.0) < NEAR_DEG + half
    if reversed_:
        reason, lines = "sign", _reversed_lines(e, culprit)
    else:
        magnetic = not e.t.body and abs(value) < MAGNETIC_DEG
        reason = "frame" if quarter or magnetic else "mounting"
        turned = math.copysign(90.0, value) if quarter else value
        lines = _turned_lines(e, culprit, turned, magnetic, quarter)
    e.faulty |= {culprit} if culprit else set(TWO)
    side = "" if reversed_ else f" to {'starboard' if value > 0 else 'port'}"
    sentence = (
        f"The velocity points {abs(value):.1f} deg ({abs(value) - half:.1f} to "
        f"{abs(value) + half:.1f}){side} of where the position goes. "
        + ending(culprit, why, lines, TWO)
    )
    interval = value, value - half, value + half
    yield e.finding(culprit or "velocity", interval, "deg", reason, sentence)


def _reversed_lines(e: Evidence, culprit: str) -> list[str]:
    p, lines = e.profile, []
    if culprit in ("", "velocity"):
        course = p.sensors.kind("velocity") == "sog_cog"
        lines.append(
            offset_line(p, "velocity", 180.0, 1) if course else sign_line(p, "velocity")
        )  # fmt: skip
    if culprit in ("", "position") and p.sensors.kind("position") == "local":
        lines.append(sign_line(p, "position"))
    if e.t.body and culprit in ("", "heading") and angle_heading(p):
        lines.append(offset_line(p, "heading", 180.0))
    return lines


def _turned_lines(
    e: Evidence, culprit: str, value: float, magnetic: bool, quarter: bool
) -> list[str]:
    p = e.profile
    if p.sensors.kind("velocity") == "sog_cog" and culprit in ("", "velocity"):
        also = ", as a magnetic course would be by the variation" if magnetic else ""
        return [offset_line(p, "velocity", round(value, 1), 1) + also]
    if e.t.body and culprit in ("", "heading") and angle_heading(p):
        return [offset_line(p, "heading", round(value, 1))]
    if quarter:
        return [f"the order and the `kind` of [sensors.{culprit or 'velocity'}]"]
    return []


def _heading_of_body(e: Evidence, value: float) -> tuple[str, str]:
    """The position goes as far off the bow as it does off the velocity: the ship's own log and
    the bow agree, and the heading has another zero."""
    p = e.by_position
    if p is None or p.how != "as it is" or p.half > SURE_DEG:
        return "", NONE_OF_TWO
    off = (p.angle + value + 180.0) % 360.0 - 180.0
    if abs(off) < ALONG_DEG:
        return "heading", "the ship's own log has it going ahead"
    return "", NONE_OF_TWO


def _other_formula(e: Evidence, j: Joined, name: str) -> Finding:
    p = e.profile
    if name in ("course in radians", "heading in radians"):
        channel, index = ("velocity", 1) if name.startswith("course") else ("heading", 0)
        e.faulty.add(channel)
        what = "course" if channel == "velocity" else "heading"
        sentence = (
            f"The {what} turns 57.3 times less than the position's way, as radians read as degrees "
            f"would. Change: {unit_line(p, channel, 'rad', index)}."
        )
        return e.finding(channel, (1.0 / pairs.RAD, None, None), "1", "unit", sentence)
    _, angle, _, half = j.fits[name].polar()
    turned, half = degrees(angle), degrees(half)
    if name == "sway mirrored":
        return _components(e, turned)
    return _mirrored(e, name, turned, half)


def _mirrored(e: Evidence, name: str, turned: float, half: float) -> Finding:
    """Position, velocity or heading is counted to the other side, from an axis `turned` deg off."""
    p = e.profile
    culprit, why = e.position_or_velocity(mirrored=True)
    if e.t.body and not culprit:
        rate_holds = e.turned is not None and "yaw_rate" not in e.faulty
        if not rate_holds and p.sensors.kind("position") == "geodetic" and name != "swapped":
            culprit, why = "heading", "latitude and longitude are seldom mirrored"
    quarter = name == "swapped" or abs(abs(turned) - 90.0) < NEAR_DEG + half
    lines = []
    if culprit in ("", "position"):
        lines += _position_lines(e, name, turned, quarter)
    if culprit in ("", "velocity") and not e.t.body and name != "swapped":
        lines += _velocity_lines(e, turned, quarter)
    if e.t.body and culprit in ("", "heading") and name != "swapped":
        lines.append(sense_line(p, "heading", 90.0 if quarter else 0.0))
    if e.t.body:
        e.faulty |= {culprit} if culprit else {"position", "heading"}
    else:
        e.faulty |= {culprit} if culprit else set(TWO)
    if name == "swapped":
        what = (
            "The position goes east where the velocity goes north, and north where it goes east, "
            "as latitude and longitude in each other's place would"
        )
        culprit, why = "position", "no other instrument is exchanged so"
        e.faulty = {*e.faulty, "position"}
    else:
        what = "The position turns to port where the velocity turns to starboard, and one of them "
        what += "is mirrored"
        what += ", or has its two components exchanged" if quarter else ""
    reason = "swapped" if quarter and culprit != "heading" else "frame" if quarter else "sign"
    if culprit == "velocity" and p.sensors.kind("velocity") == "sog_cog" and quarter:
        reason = "frame"
    two = ("heading", "position") if e.t.body else TWO
    sentence = f"{what}. {ending(culprit, why, lines, two)}"
    channel = culprit or ("position" if e.t.body else "velocity")
    return e.finding(channel, (-1.0, None, None), "1", reason, sentence)


def _position_lines(e: Evidence, name: str, turned: float, quarter: bool) -> list[str]:
    p = e.profile
    if quarter:
        names = TABLE_CHANNELS["position", p.sensors.kind("position")]
        return [f"the order of `fields` on [sensors.position], {' and '.join(names)}"]
    return [sign_line(p, "position", 0 if abs(turned) > 90.0 else 1)]


def _velocity_lines(e: Evidence, turned: float, quarter: bool) -> list[str]:
    p, kind = e.profile, e.profile.sensors.kind("velocity")
    if kind == "sog_cog":
        line = sign_line(p, "velocity", 1)
        if abs(turned) > NEAR_DEG:
            line += f" with {offset_line(p, 'velocity', round(turned) % 360, 1)}"
        return [line]
    if quarter:
        return [f'kind = "{"enu" if kind == "ned" else "ned"}" on [sensors.velocity]']
    north = 0 if kind == "ned" else 1
    return [sign_line(p, "velocity", north if abs(turned) > 90.0 else 1 - north)]


def _components(e: Evidence, turned: float) -> Finding:
    """Of a velocity in body axes."""
    e.faulty.add("velocity")
    p = e.profile
    if abs(abs(turned) - 90.0) < 45.0:
        reason, what = "swapped", "Surge and sway stand in each other's place"
        line = "the order of `fields` on [sensors.velocity], surge and sway"
    elif abs(turned) > 135.0:
        reason, what = "sign", "The surge has the other sign"
        line = sign_line(p, "velocity", 0)
    else:
        reason, what = "sign", "The sway has the other sign: it is positive to port"
        line = sign_line(p, "velocity", 1)
    sentence = f"{what}, by where the position goes. Change: {line}."
    return e.finding("velocity", (-1.0, None, None), "1", reason, sentence)


def _nothing_in_common(e: Evidence, j: Joined) -> Finding:
    culprit, why = e.position_or_velocity(mirrored=True)
    p, lines = e.profile, []
    course = p.sensors.kind("velocity") == "sog_cog"
    if course and declared(p, "velocity", 1) == "rad" and culprit != "position":
        lines.append(f"{unit_line(p, 'velocity', 'deg', 1)}, if degrees are read as radians")
        culprit, why = "velocity", "the speeds agree and the directions do not"
    elif e.t.body and declared(p, "heading") == "rad" and angle_heading(p):
        lines.append(f"{unit_line(p, 'heading', 'deg')}, if degrees are read as radians")
        culprit, why = "heading", "the speeds agree and the directions do not"
    e.faulty |= {culprit} if culprit else set(TWO)
    ratio = j.speeds[1] / j.speeds[0]
    sentence = (
        "The velocity's direction and the way that the position goes have nothing in common (the "
        f"speeds' ratio is {times(ratio)}). {ending(culprit, why, lines, TWO)}"
    )
    reason = "unit" if lines else "none known"
    return e.finding(culprit or "velocity", (ratio, None, None), "1", reason, sentence)


def _late(e: Evidence) -> Finding | None:
    late, then, now = pairs.lag(np.diff(e.t.place), np.diff(e.t.sailed), e.t.usable)
    if not pairs.is_late(late, then, now):
        return None
    e.faulty |= set(TWO)
    when = "after" if late > 0 else "before"
    sentence = (
        f"The velocity comes {abs(late):.0f} s {when} the position's change. Change: another "
        "`clock` on [sensors.velocity] or [sensors.position]."
    )
    return e.finding("velocity", (late, late - 1.0, late + 1.0), "s", "clock", sentence)
