"""Heading, yaw rate and the way over ground: ratio, sense and delay of their turning."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from shiplog.logs.health.health_report import Finding
from shiplog.ship_profile.profile_lines import (
    converted_twice,
    declared,
    other_unit,
    sign_line,
    times,
    unit_line,
    words,
)
from shiplog.voyages.contradictions import pairs
from shiplog.voyages.contradictions.actuators import can_push_sideways
from shiplog.voyages.contradictions.evidence import (
    GUARD,
    JOINED,
    NEAR_DEG,
    Evidence,
    angle_heading,
    ending,
    sense_line,
)
from shiplog.voyages.contradictions.regression import Regression
from shiplog.voyages.contradictions.track import ROWS, STEP_S

RATE_RATIO = math.log(1.4)  # of yaw rate and heading; nearer ratios are for the fit
TURNING, UNRELATED = 0.6, 0.3  # correlation of yaw rate and heading: together, and not at all
SLOPE_HALVES = 4.0  # half intervals from zero, for a ratio that is far from one
STANDS = 0.3  # slope of one that stands still over the other, at most
DRIFTS_RAD = math.radians(30.0)  # a gyro that drifts may add up to less in a voyage
TWO = ("yaw_rate", "heading")
STILL_S, STILL_WAY_DEG = 60.0, 25.0  # a heading that never changes for so long, while the way does
MIRRORED_WINDOWS, MIRRORED_LEFT = 20, 0.25  # of a heading that only the way speaks against


def heading_and_rate(e: Evidence) -> Iterator[Finding]:
    """The yaw rate over the heading's change; or one stands still; or they have nothing in
    common."""
    j = e.turned
    if j is None or len(j.fits) < 2:
        return
    rate, back = j.fits["rate by heading"], j.fits["heading by rate"]
    by_heading, by_rate = j.extra["by heading"], j.extra["by rate"]
    together = j.extra["correlation"]
    few, enough = pairs.FEWEST / 3, 0.7 * pairs.FEWEST
    if (late := _late(e)) is not None:
        yield late
    elif abs(together) >= TURNING:
        value, low, high = _hull(rate, back)
        if low <= 0 <= high:
            return
        ends = sorted(math.log(abs(one)) for one in (low, high))
        if low < 0 or ends[0] > RATE_RATIO or ends[1] < -RATE_RATIO:
            yield _ratio(e, value, low, high)
    elif by_heading <= few and by_rate >= enough and _is_well_known(back):
        value, low, high = (1.0 / one for one in back.interval(0))
        yield _ratio(e, value, *sorted((low, high)))
    elif by_heading <= few and by_rate >= enough:
        most = max(abs(one) for one in back.interval(0)[1:])
        if most < STANDS and (
            e.bent_by_rate is not None or np.ptp(e.t.turned_by_rate) > DRIFTS_RAD
        ):
            yield _stands(e, "heading", "yaw_rate", 1.0 / max(most, 1e-3))
    elif by_rate <= few and by_heading >= enough and _is_well_known(rate):
        yield _ratio(e, *rate.interval(0))
    elif by_rate <= few and by_heading >= enough:
        most = max(abs(one) for one in rate.interval(0)[1:])
        if most < STANDS:
            yield _stands(e, "yaw_rate", "heading", 1.0 / max(most, 1e-3))
    elif min(by_heading, by_rate) >= enough and abs(together) < UNRELATED:
        yield _unrelated(e, together)


def _is_well_known(slope: Regression) -> bool:
    """Whether a small slope is known well, and is not one of things that are alike."""
    value, low, high = slope.interval(0)
    return abs(value) > SLOPE_HALVES * 0.5 * (high - low) and abs(value) < STANDS


def _hull(rate: Regression, back: Regression) -> tuple[float, float, float]:
    """Yaw rate over the heading's change, by both ways of regressing one on the other."""
    value, low, high = rate.interval(0)
    k, k_low, k_high = back.interval(0)
    if k_low * k_high > 0:
        ends = sorted((1.0 / k_low, 1.0 / k_high))
        low, high = min(low, ends[0]), max(high, ends[1])
        value = math.copysign(math.sqrt(abs(value / k)), value)
    return value, low, high


def _ratio(e: Evidence, value: float, low: float, high: float) -> Finding:
    culprit, why = e.heading_or_rate(value)
    e.faulty |= {culprit} if culprit else set(TWO)
    p, mirrored = e.profile, value < 0
    size = sorted((abs(low), abs(high)))
    range_ = f"({times(size[0])} to {times(size[1])})"
    near_one = abs(math.log(abs(value))) < RATE_RATIO
    if mirrored:
        sentence = (
            "The yaw rate turns to the other side than the heading: it is "
            f"-{times(abs(value))} times {range_} the heading's change."
        )
    else:
        sentence = f"The yaw rate is {times(value)} times {range_} the heading's change."
    lines, reason = [], "none known"
    if near_one:
        reason = "sign"
        for channel in TWO if not culprit else (culprit,):
            zero = _zero_of_mirrored(e) if channel == "heading" else 0.0
            reason = "frame" if zero else reason
            lines.append(sense_line(p, channel, zero))
    else:
        lines = _unit_lines(e, culprit, abs(value), size)
        reason = "unit" if lines else reason
        if mirrored and lines:
            lines = [f"{line}; and the sign" for line in lines]
    text = f"{sentence} {ending(culprit, why, lines, TWO)}"
    return e.finding(culprit or "yaw_rate", (value, low, high), "1", reason, text)


def _unit_lines(e: Evidence, culprit: str, ratio: float, size: list[float]) -> list[str]:
    """What to change where the ratio is that of two units."""
    p = e.profile
    found = {"yaw_rate": other_unit(p, "yaw_rate", ratio, size[0], size[1])}
    if angle_heading(p):
        found["heading"] = other_unit(p, "heading", 1.0 / ratio, 1.0 / size[1], 1.0 / size[0])
    return [
        f"{unit_line(p, channel, unit)}, the factor of {unit} read as {declared(p, channel)}"
        for channel, unit in found.items()
        if unit and culprit in ("", channel)
    ] or [twice for twice in (_twice(e, culprit, ratio, size),) if twice]


def _twice(e: Evidence, culprit: str, ratio: float, size: list[float]) -> str | None:
    if culprit == "heading":
        return None
    return converted_twice(e.profile, "yaw_rate", ratio, size[0], size[1])


def _zero_of_mirrored(e: Evidence) -> float:
    """90 where a mirrored heading is counted from east, else 0."""
    way = next((one for one in e.ways if one.how == "mirrored"), None)
    return 90.0 if way is not None and abs(abs(way.angle) - 90.0) < 45.0 else 0.0


def _stands(e: Evidence, still: str, moves: str, more: float) -> Finding:
    e.faulty.add(still)
    sentence = (
        f"The {words(still)} stands still while the {words(moves)} turns: the {words(moves)} shows "
        f"more than {times(more)} times as much. Look at topic, field and unit of "
        f"[sensors.{still}]; a value that nobody fills in is no measurement."
    )
    return e.finding(still, (more, more, None), "1", "none known", sentence)


def _late(e: Evidence) -> Finding | None:
    late, then, now = pairs.lag(np.diff(e.t.turned), np.diff(e.t.turned_by_rate), e.t.usable)
    if not pairs.is_late(late, then, now):
        return None
    e.faulty |= set(TWO)
    when = "after" if late > 0 else "before"
    sentence = (
        f"The yaw rate comes {abs(late):.0f} s {when} the heading's change. Change: another "
        "`clock` on [sensors.yaw_rate] or [sensors.heading]."
    )
    return e.finding("yaw_rate", (late, late - 1.0, late + 1.0), "s", "clock", sentence)


def _unrelated(e: Evidence, together: float) -> Finding:
    culprit, why = e.heading_or_rate(1.0)
    e.faulty |= {culprit} if culprit else set(TWO)
    sentence = (
        "The yaw rate and the heading's change have nothing in common (correlation "
        f"{together:.2f}), though both turn. {ending(culprit, why, [], TWO)}"
    )
    return e.finding(culprit or "yaw_rate", (together, None, None), "1", "none known", sentence)


def heading_and_way(e: Evidence) -> Iterator[Finding]:
    """A heading that turns against the way, or by another unit; or that never changes. Where
    nothing but the way speaks against it, it has to do so all the time, since a ship may sail
    sideways."""
    if "heading" in e.faulty:
        return
    if (still := _never_changes(e)) is not None:
        yield still
        return
    if (large := _in_degrees(e)) is not None:
        yield large
        return
    wrong = [one for one in e.ways if one.how != "as it is"]
    needed = 1 if e.t.body or e.t.derived else 2  # one way, if velocity is derived
    if len(wrong) < needed or len(wrong) < len(e.ways):
        return
    way = max(wrong, key=lambda one: one.left)
    if way.windows < MIRRORED_WINDOWS or way.left > MIRRORED_LEFT or way.drift:
        return
    if can_push_sideways(e.t):
        return
    if e.t.body and _mirrored_position(e):
        return
    e.faulty.add("heading")
    yield _radians(e) if way.how == "in radians" else _mirrored(e, way.angle, way.half)


def _radians(e: Evidence) -> Finding:
    sentence = (
        "The heading turns 57.3 times less than the way over ground, as radians read as degrees "
        f"would. Change: {unit_line(e.profile, 'heading', 'rad')}."
    )
    return e.finding("heading", (1.0 / pairs.RAD, None, None), "1", "unit", sentence)


def _mirrored(e: Evidence, angle: float, half: float) -> Finding:
    p = e.profile
    with_rate = e.turned is not None and "yaw_rate" not in e.faulty
    also = ", and the yaw rate with it," if with_rate else ""
    east = abs(abs(angle) - 90.0) < NEAR_DEG + half
    line = sense_line(p, "heading", 90.0 if east else 0.0)
    if with_rate:
        line += f" and {sign_line(p, 'yaw_rate')}"
    counted = "anticlockwise from east" if east else "anticlockwise"
    other = " (or the position is mirrored)" if e.t.body or e.t.derived else ""
    if e.t.derived and p.sensors.kind("position") == "local":
        order = "the order of `fields` on [sensors.position]"
        line += f", or {order if east else sign_line(p, 'position', 1)}"
    sentence = (
        f"The heading{also} turns against the way over ground{other}, as one that is counted "
        f"{counted} would. Change: {line}."
    )
    if with_rate:
        e.faulty.add("yaw_rate")
    reason = "frame" if east else "sign"
    return e.finding("heading", (-1.0, None, None), "1", reason, sentence)


def _mirrored_position(e: Evidence) -> bool:
    """Of body axes: whether a mirrored position explains more than a mirrored heading."""
    if e.joined is None:
        return False
    left = e.joined.left
    position = min(left.get("mirrored", 1.0), left.get("swapped", 1.0))
    return position < left.get("heading mirrored", 1.0) / GUARD and position < JOINED


def _in_degrees(e: Evidence) -> Finding | None:
    """A heading that turns 57.3 times more than the way, and no yaw rate beside it."""
    bent = e.bent_by_heading
    if bent is None or e.profile.sensors.yaw_rate is not None:
        return None
    value, low, high = (pairs.RAD * one for one in bent)
    if not (0.8 < value < 1.25 and low > 0.6 and high < 1.6):
        return None
    e.faulty.add("heading")
    ratio = 1.0 / bent[0]
    line = unit_line(e.profile, "heading", "deg")
    sentence = (
        f"The heading turns {times(ratio)} times more than the way over ground, as degrees read "
        f"as radians would. Change: {line}."
    )
    return e.finding("heading", (ratio, 1.0 / bent[2], 1.0 / bent[1]), "1", "unit", sentence)


def _never_changes(e: Evidence) -> Finding | None:
    """A heading of exactly one value for a minute and more while the way over ground turns. Of a
    ship that can go sideways it may be held, in whole degrees."""
    t = e.t
    if any(a.kind == "azimuth" for a in t.profile.actuators):
        return None
    count = t.bins * ROWS
    same = np.concatenate(([0], (np.abs(np.diff(t.heading[:count])) < 1e-9).astype(np.int8), [0]))
    edges = np.flatnonzero(np.diff(same))
    if len(edges) == 0:
        return None
    firsts, lasts = edges[::2], edges[1::2]
    longest = int(np.argmax(lasts - firsts))
    a, b = int(firsts[longest]) // ROWS, int(lasts[longest]) // ROWS
    if (b - a) < STILL_S:
        return None
    step = 8
    places = t.place[a:b:step]
    moves = np.diff(places)
    moves = moves[np.abs(moves) > pairs.slowest(t) * step]
    if len(moves) < STILL_S / step:
        return None
    way = np.degrees(np.unwrap(np.angle(moves)))
    swing = float(np.quantile(way, 0.9) - np.quantile(way, 0.1))
    if swing < STILL_WAY_DEG:
        return None
    e.faulty.add("heading")
    start, end = float(firsts[longest]) * STEP_S, float(lasts[longest]) * STEP_S
    sentence = (
        f"The heading never changes for {end - start:.0f} s from {start:.1f} s while the way over "
        f"ground turns by {swing:.0f} deg. Look at topic and field of [sensors.heading]; a value "
        "that nobody fills in is no measurement."
    )
    return e.finding("heading", (swing, swing, None), "deg", "none known", sentence)
