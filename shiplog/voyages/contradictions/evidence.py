"""What the pairs of one voyage say, and which of two that differ a third one confirms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.channels import DEGREE
from shiplog.ship_profile.profile import Profile
from shiplog.ship_profile.profile_lines import offset_line, sign_line, words
from shiplog.voyages.contradictions import pairs
from shiplog.voyages.contradictions.pairs import Joined, UnderWay
from shiplog.voyages.contradictions.track import STEP_S, Track, degrees

AS_GOOD = 1.5  # times what another formula leaves
JOINED, APART = 0.4, 0.65  # unexplained share: less, and two go together; more, and they do not
BETTER, CLEARLY = 3.0, 0.02  # another formula leaves so many times less, and so much less
BETTER_OFF = 2.0  # the same where it goes ahead by the other formula, and athwart by this one
GUARD = 1.5  # half 90 % intervals between an estimate and what is no contradiction
# Share that the heading as it is leaves, and less: it is not another one. On a nearly straight
# course it may be all the same, where the ship goes ahead by the other one and not by this.
LEAST_MIRRORED = 0.1
ALONG_DEG = 45.0  # from the bow: the ship goes ahead
NEAR_DEG = 8.0  # of 90 or 180 deg
SURE_DEG = 12.0  # half interval of an angle that says anything
FASTEST_CURRENT = 4.0  # m/s: what a stream may do, and a log through the water not see
SPREAD = 0.15  # of the directions sailed: no straight line
LEAST_SPREAD = 0.03  # of a way that tells a mirror at all
BENT = (0.4, 2.5)  # the way's turning over the heading's: they turn together
NONE_OF_TWO = "no third channel tells which of the two"

Interval = tuple[float, float, float]


@dataclass(frozen=True)
class Way:
    """How the heading stands to the way over ground.

    how     "as it is", "mirrored", or "in radians": the formula that joins them
    angle   deg, of the way from the heading so read, to starboard; half: of its 90 % interval
    sense   whether to which side the heading turns is known: the mirrored one fits worse
    drift   whether a current explains the way as well, with the heading as it is
    fixed   whether the angle is known all the same
    """

    how: str
    angle: float
    half: float
    sense: bool
    spread: float
    left: float
    windows: int
    drift: bool
    fixed: bool

    @property
    def ahead(self) -> bool:
        return self.how == "as it is" and abs(self.angle) < ALONG_DEG and self.half < 30.0


@dataclass
class Evidence:
    """joined: position and velocity; turned: heading and yaw rate; by_position, by_velocity: the
    heading and the way of either; apart: the least share that any formula leaves of each way;
    bent_by_rate, bent_by_heading: the way's turning over theirs; faulty: channels that are, or may
    be, at fault."""

    t: Track
    moved: UnderWay | None
    joined: Joined | None
    turned: Joined | None
    by_position: Way | None
    by_velocity: Way | None
    apart: tuple[float, ...]
    bent_by_rate: Interval | None
    bent_by_heading: Interval | None
    faulty: set[str] = field(default_factory=set)

    @property
    def profile(self) -> Profile:
        return self.t.profile

    @property
    def ways(self) -> list[Way]:
        return [one for one in (self.by_position, self.by_velocity) if one is not None]

    def position_or_velocity(self, mirrored: bool) -> tuple[str, str]:
        """(channel at fault, why): that one which the heading does not confirm."""

        def confirms(way: Way | None) -> bool:
            if way is None or not way.ahead:
                return False
            return not mirrored or (way.sense and way.spread > LEAST_SPREAD)

        p, v = self.by_position, self.by_velocity
        if self.t.body:
            if confirms(p):
                return "velocity", "the position goes where the bow points"
            return "", NONE_OF_TWO
        if confirms(p) and not confirms(v):
            return "velocity", "the position goes where the bow points"
        if confirms(v) and not confirms(p):
            return "position", "the velocity goes where the bow points"
        if p is None or v is None or mirrored or not (confirms(p) and confirms(v)):
            return "", NONE_OF_TWO
        apart = abs(p.angle - v.angle) > 2.0 * (p.half + v.half)
        if apart and abs(p.angle) < 0.3 * abs(v.angle):
            return "velocity", "the position goes where the bow points"
        if apart and abs(v.angle) < 0.3 * abs(p.angle):
            return "position", "the velocity goes where the bow points"
        return "", NONE_OF_TWO

    def heading_or_rate(self, ratio: float) -> tuple[str, str]:
        """The same of heading and yaw rate, which differ by a ratio; the way is the third."""
        with_rate, with_heading = self.bent_by_rate, self.bent_by_heading
        by_rate = with_rate is not None and with_rate[1] > BENT[0] and with_rate[2] < BENT[1]
        by_heading = (
            with_heading is not None and with_heading[1] > BENT[0] and with_heading[2] < BENT[1]
        )
        by_heading |= any(w.how == "as it is" and w.sense for w in self.ways)
        if by_rate and not by_heading:
            return "heading", "the way over ground turns with the yaw rate"
        if by_heading and not by_rate:
            return "yaw_rate", "the way over ground turns with the heading"
        if any(w.how != "as it is" for w in self.ways):
            return "heading", "the way over ground turns otherwise than it"
        if ratio < 0 and with_rate is not None and with_rate[2] < 0:
            return "yaw_rate", "the way over ground turns against it"
        return "", NONE_OF_TWO

    def finding(
        self, channel: str, interval: Sequence[float | None], unit: str, reason: str, sentence: str
    ) -> Finding:
        """Of the whole voyage; interval: value, low, high."""
        return of_voyage(self.t, channel, interval, unit, reason, sentence)


def of_voyage(
    t: Track, channel: str, interval: Sequence[float | None], unit: str, reason: str, sentence: str
) -> Finding:
    """A contradiction from the first row to the last."""
    value, low, high = (None if one is None else float(f"{one:.5g}") for one in interval)
    end = round((len(t.heading) - 1) * STEP_S, 3)
    return Finding(
        "contradiction", channel, sentence, 0.0, end, value, low, high, unit, reason
    )  # fmt: skip


def ending(culprit: str, why: str, lines: Sequence[str], two: tuple[str, str]) -> str:
    """Which of the two it is, and the line of the profile to change."""
    if lines:
        change = f" Change: {' or '.join(lines)}."
    elif culprit:
        change = f" Look at [sensors.{culprit}]."
    else:
        change = f" Look at [sensors.{two[0]}] and [sensors.{two[1]}]."
    if culprit:
        return f"It is the {words(culprit)}: {why}.{change}"
    return f"It is the {words(two[0])} or the {words(two[1])}; {why}.{change}"


def gather(t: Track) -> Evidence:
    """All pairs of one voyage."""
    turned, moved = pairs.heading_and_yaw_rate(t), pairs.find_under_way(t)
    if moved is None:
        return Evidence(t, None, None, turned, None, None, (), None, None)
    by_rate = t.profile.sensors.yaw_rate is not None
    joined = list(pairs.heading_and_way(t, moved))
    ways = [_way(one) for one in joined]
    return Evidence(
        t,
        moved,
        None if t.derived else pairs.position_and_velocity(t, moved),
        turned,
        ways[0],
        None if t.body or t.derived else ways[1],
        tuple(_unexplained_share(one) for one in joined),
        pairs.bend(t, moved, t.turned_by_rate) if by_rate else None,
        pairs.bend(t, moved, t.turned),
    )


def _way(j: Joined) -> Way | None:
    """None where no formula joins heading and way, or several do: on one straight course, or where
    the ship goes ahead and astern by turns."""
    if "as it is" not in j.fits or "current" not in j.extra:
        return None
    left = j.left
    best = min(left, key=lambda name: left[name])
    in_radians = best == "in radians" and pairs.natural(j.fits[best])
    off = in_radians and not pairs.natural(j.fits["as it is"])
    if left["as it is"] < (BETTER_OFF if off else BETTER) * left[best]:
        best = "as it is"
    if left[best] > JOINED:
        return None
    by_turns = j.extra.get("by turns", math.inf)  # of no use where it cannot be regressed
    no_steady_way = left["as it is"] > max(LEAST_MIRRORED, BETTER * by_turns)
    if no_steady_way and (best == "as it is" or by_turns < BETTER * left[best]):
        return None
    ahead = pairs.natural(j.fits[best]) and (in_radians or not pairs.natural(j.fits["as it is"]))
    if best != "as it is" and left["as it is"] < LEAST_MIRRORED and not ahead:
        return None
    sense = left.get("mirrored", 1.0) > BETTER * left[best] if best != "mirrored" else True
    _, angle, _, half = j.fits[best].polar()
    drift = j.extra["current"] < FASTEST_CURRENT and j.extra["drifting"] < (
        left[best] * (BETTER if best != "as it is" else AS_GOOD)
    )
    fixed = j.extra["half"] < ALONG_DEG * DEGREE
    drift &= abs(j.extra["angle"]) < ALONG_DEG * DEGREE or not fixed
    return Way(
        best, degrees(angle), degrees(half), sense, j.spread, left[best], j.windows, drift, fixed
    )


def _unexplained_share(j: Joined) -> float:
    """The share that the best formula leaves; radians count where the ship goes ahead by them."""
    left = [fit.left for name, fit in j.fits.items() if name != "in radians" or pairs.natural(fit)]
    return min(left, default=0.0)


def angle_heading(profile: Profile) -> bool:
    """Whether the heading is an angle, and no quaternion."""
    return profile.sensors.kind("heading") == "angle"


def sense_line(profile: Profile, channel: str, zero: float = 0.0) -> str:
    """For a heading or yaw rate that is counted the other way, the former from `zero` deg."""
    if channel == "heading" and not angle_heading(profile):
        kind = profile.sensors.kind("heading")
        other = "quaternion_ned" if kind == "quaternion_enu" else "quaternion_enu"
        return f'kind = "{other}" on [sensors.heading]'
    line = sign_line(profile, channel)
    if zero and channel == "heading":
        line += f" with {offset_line(profile, 'heading', zero)}"
    return line
