"""A model sails a manoeuvre, and what is measured of it: the same quantities by the same rules.

The interval is that of the members: draws of the coefficients (or the seeds of a network), each
with a draw of the discrepancy that held-out voyages have shown (`simulation.discrepancy`). The
value y is the model's as it stands, and the interval is that of the members over their median m,

    y q₀.₀₅/m  to  y q₀.₉₅/m        of what is positive: distances, times, overshoots
    y + q₀.₀₅ - m  to  y + q₀.₉₅ - m    of what may have either sign

An overshoot or a period is no linear function of a disturbance: whatever its sign, it makes a
period longer. The model was fitted to voyages in which the missing forces acted, so that what they
do on average is in its coefficients, and must not be added to its value again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.manoeuvres import drift, steadiness, stopping, turning, zigzags
from shiplog.manoeuvres.drift import Drift
from shiplog.manoeuvres.quantity import Estimate
from shiplog.manoeuvres.recognition import Found
from shiplog.manoeuvres.stretches import driving, steering
from shiplog.manoeuvres.track import Track
from shiplog.nomenclature.frames import in_body_axes
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.sailing import Sailed, Water
from shiplog.simulation.schedules import Manoeuvre, PullOut, Spiral, Stop, Turn, Zigzag
from shiplog.training.runs.sailing_run import MEMBERS, Outside, Sailor
from shiplog.voyages.rows.recording import Record

LOW, HIGH = 0.05, 0.95
# Of the members that have a quantity, below which its interval is not one: the others have
# diverged, or never came so far.
LEAST_SHARE = 0.8
OUTSIDE_NOTE = "outside the training data"
STEP_HOLD = 3.0  # L/V of a step of a spiral or pull-out
LEAST_APPROACH = 0.2  # of the speed over ground, that a current leaves through the water
LONGER = 1.5  # times the recorded manoeuvre's length, for which it is simulated


@dataclass(frozen=True)
class Simulated:
    """quantities   name → estimate; none of a model that diverged
    outside      where the model left its training data
    diverged     share of the members that did
    sailed       all members
    each         the quantities of each of them
    """

    quantities: Mapping[str, Estimate]
    outside: Outside
    diverged: float
    sailed: Sailed
    each: Sequence[Mapping[str, float]]

    @property
    def note(self) -> str:
        """What a reader has to know of it, in words; empty where there is nothing."""
        parts = []
        if np.isfinite(self.sailed.diverged[0]):
            parts.append(f"the model diverges after {self.sailed.diverged[0]:.0f} s")
        elif self.diverged:
            parts.append(f"{self.diverged:.0%} of the members diverge")
        if self.outside.sentence:
            parts.append(self.outside.sentence)
        return "; ".join(parts)


def track_of(sailed: Sailed, member: int, profile: Profile) -> Track:
    """A member's path, as one of a record."""
    keep = np.isfinite(sailed.state[member]).all(-1)
    actuator = sailed.actuator[member][keep]
    return Track(
        sailed.time[keep], sailed.state[member][keep], actuator @ steering(profile),
        actuator @ driving(profile), profile.ship.length_m,
    )  # fmt: skip


def measure(
    sailed: Sailed, member: int, manoeuvre: Manoeuvre, profile: Profile, moved: Drift | None = None
) -> dict[str, float]:
    """Quantities of one member; `moved`: what is taken out as a current."""
    track = track_of(sailed, member, profile)
    if len(track) < 3:
        return {}
    if moved is not None:
        track = track.without(moved.velocity)
    match manoeuvre:
        case Turn():
            return turning.quantities(track, 0.0, math.copysign(1.0, manoeuvre.angle))
        case Zigzag():
            return _of_zigzag(track, manoeuvre)
        case Stop():
            return stopping.quantities(track, 0.0)
        case PullOut():
            return _of_pull_out(track, manoeuvre)
        case Spiral():
            return steadiness.loop(
                [(a, steadiness.settled(track, end)) for a, end in _steps(track)]
            )
    return {}


def _of_zigzag(track: Track, of: Zigzag) -> dict[str, float]:
    """The orders are where the heading passed what they were due at."""
    side, first = math.copysign(1.0, of.angle), track.heading_at(0.0)
    orders = [0.0]
    for k in range(of.reversals):
        to = side if k % 2 == 0 else -side
        reached = track.reaches(first + to * of.heading, to, orders[-1])
        if reached is None:
            break
        orders.append(reached)
    return zigzags.quantities(track, orders, side, of.angle)


def _steps(track: Track) -> list[tuple[float, float]]:
    """Rudder angles that were held, and when each hold ended."""
    same = np.abs(np.diff(track.rudder)) < 1e-9
    found, first = [], 0
    speed = max(float(np.median(track.speed)), 1e-6)
    for k in [*np.flatnonzero(~same), len(track) - 1]:
        if track.time[k] - track.time[first] >= STEP_HOLD * track.length / speed:
            found.append((float(track.rudder[k]), float(track.time[k])))
        first = k + 1
    return found


def _of_pull_out(track: Track, of: PullOut) -> dict[str, float]:
    """Amidships after the turn to starboard, then after that to port."""
    sides = (1.0, -1.0) if of.angle > 0.0 else (-1.0, 1.0)
    ends = [end for angle, end in _steps(track) if abs(angle) < 1e-6]
    return steadiness.residual(track, list(zip(sides, ends, strict=False)))


def of_members(
    sailed: Sailed, manoeuvre: Manoeuvre, profile: Profile, taken_out: bool = False
) -> list[dict[str, float]]:
    """Quantities of each member, the model as it stands first; none of a model that diverged."""
    if np.isfinite(sailed.diverged[0]):
        return [{}]

    def of(member: int) -> dict[str, float]:
        moved = None
        if taken_out and isinstance(manoeuvre, Turn):
            track = track_of(sailed, member, profile)
            moved = drift.of_turn(track, 0.0, math.copysign(1.0, manoeuvre.angle))
        return measure(sailed, member, manoeuvre, profile, moved)

    return [of(k) for k in range(len(sailed))]


def intervals(each: Sequence[Mapping[str, float]], note: str = "") -> dict[str, Estimate]:
    """Each quantity of the first member, with the middle 90 % of the others about their median."""
    best, *others = each
    found = {}
    for name, value in best.items():
        many = [one[name] for one in others if name in one]
        if not others:
            found[name] = Estimate(value, value, value, note)
        elif len(many) >= LEAST_SHARE * len(others):
            low, high = _about(value, *np.quantile(many, (LOW, 0.5, HIGH)).tolist())
            found[name] = Estimate(value, low, high, note)
    return found


def _about(value: float, low: float, middle: float, high: float) -> tuple[float, float]:
    """The quantiles, moved so that the median is the value."""
    if value > 0.0 and low > 0.0:
        return value * low / middle, value * high / middle
    return value + low - middle, value + high - middle


def of_sailed(
    sailed: Sailed, outside: Outside, manoeuvre: Manoeuvre, profile: Profile, taken_out: bool
) -> Simulated:
    each = of_members(sailed, manoeuvre, profile, taken_out)
    note = OUTSIDE_NOTE if outside.anywhere else ""
    lost = float(np.isfinite(sailed.diverged).mean())
    return Simulated(intervals(each, note), outside, lost, sailed, each)


def sail(sailor: Sailor, manoeuvre: Manoeuvre, members: int = MEMBERS, **how) -> Simulated:
    """A manoeuvre by the book; `how` as for `Sailor.sail`."""
    sailed, outside = sailor.sail(manoeuvre, members=members, **how)
    return of_sailed(sailed, outside, manoeuvre, sailor.profile, False)


def as_recorded(
    sailor: Sailor,
    found: Found,
    record: Record,
    moved: Drift | None,
    members: int = MEMBERS,
    revolutions: bool = True,
) -> Simulated | None:
    """The same manoeuvre as a recorded one: its angles, its approach, its wind, its revolutions,
    and its current.

    moved        what was taken out of the record as a current: a current c, and what the wind added
    revolutions  those of the record; else what keeps the model at that speed

    A turn is sailed in c = moved - m, m the model's own drift in the recorded wind and still water:
    an approach over ground is then one through the water. What moves the model is taken out again.

    None of a kind that is not sailed by itself, or where the ship was not under way.
    """
    manoeuvre = of_found(found)
    if manoeuvre is None:
        return None
    row = found.track.row(found.begin)
    state = found.track.state[row]
    speed = found.approach.speed if found.approach else float(state[1])
    own = float(state[1]) if state[1] > 0.0 else speed
    wind, recorded = (0.0, 0.0), None
    during = (record.time >= found.begin) & (record.time <= found.end)
    if sailor.profile.has_wind and during.any():
        north, east = record.true_wind[during].mean(0)
        wind = (float(north), float(east))
        recorded = _by_rows(record.true_wind[during], record.time[during] - found.begin, sailor.row)
    seconds = LONGER * (found.end - found.begin)
    driven = record.actuator[during] if during.any() else record.actuator[:1]
    approach = np.median(driven, axis=0) if revolutions else None
    positions = None
    if found.kind == "stop" and during.any():  # an engine's orders are its own: as recorded
        positions = record.time[during] - found.begin, driven
        if len(driven) < 2 or positions[0][-1] <= 0.0:
            return None
        last = np.append(positions[0], max(seconds, positions[0][-1] + 1.0))
        positions = last, np.concatenate((driven, driven[-1:]))

    heading, sway, rate = float(state[4]), float(state[3]), float(state[5])

    def sail_in(north: float, east: float, count: int) -> tuple[Sailed, Outside]:
        """From a speed and a sway over ground, in a current."""
        c, s = math.cos(heading), math.sin(heading)
        ahead, starboard = in_body_axes(north, east, c, s)
        return sailor.sail(
            manoeuvre, speed=max(own - ahead, LEAST_APPROACH * own), members=count, seconds=seconds,
            water=Water(wind, (north, east), recorded), approach=approach, positions=positions,
            motion=(heading, sway - starboard, rate),
        )  # fmt: skip

    north, east = 0.0, 0.0
    if moved is not None:
        still = track_of(sail_in(north, east, 1)[0], 0, sailor.profile)
        drifts = drift.of_turn(still, 0.0, found.side) if len(still) > 2 else None
        if drifts is not None:
            north, east = (moved.velocity - drifts.velocity).tolist()
    sailed, outside = sail_in(north, east, members)
    return of_sailed(sailed, outside, manoeuvre, sailor.profile, moved is not None)


def _by_rows(wind: np.ndarray, time: np.ndarray, row: float) -> np.ndarray:
    """Its mean in each row [K, 2] from the order on, as long as there is one in every row."""
    at = np.floor(time / row + 1e-9).astype(int)
    count = np.bincount(at)
    whole = int(np.argmin(count > 0)) if (count == 0).any() else len(count)
    sums = np.stack([np.bincount(at, weights=wind[:, i]) for i in (0, 1)], axis=-1)
    return sums[:whole] / count[:whole, None]


def of_found(found: Found) -> Manoeuvre | None:
    """The orders of a recorded manoeuvre."""
    match found.kind:
        case "turn":
            turned = abs(found.track.heading[-1] - found.track.heading_at(found.begin))
            return Turn(found.side * found.angle, by=float(turned))
        case "zigzag":
            return Zigzag(found.side * found.angle, found.heading, len(found.orders))
        case "stop":
            return Stop()
    return None


STANDARD: Sequence[Manoeuvre] = (
    Turn(math.radians(35.0)), Turn(math.radians(-35.0)),
    Zigzag(math.radians(10.0), math.radians(10.0)),
    Zigzag(math.radians(-10.0), math.radians(10.0)),
    Zigzag(math.radians(20.0), math.radians(20.0)),
    Zigzag(math.radians(-20.0), math.radians(20.0)),
    Stop(), PullOut(), Spiral(),
)  # fmt: skip
