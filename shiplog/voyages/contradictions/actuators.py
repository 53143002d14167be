"""What the actuators drive, counted against what the ship does: signs only, with no model.

Over windows of T seconds, a velocity w (surge, sway or yaw rate) follows its forces F_j, each in
the direction that the profile states (after Nomoto 1957, any decay λ):

    w(t + T) - w(t) = -λ w(t) + Σ_j b_j F̄_j + d R̄ + c,     b_j > 0

    rudder      yaw    δ (U² + (nD/2)²)            while the ship goes ahead
    thrust      surge  n|n| cos α,  sway  n|n| sin α,  yaw  n|n| (x sin α - y cos α)

R is what a turn does by itself: r² of the surge, which it slows, and u r of the sway, to which it
goes round. A ship that turns while a screw turns fastest, or by a thruster at its bow, would else
seem to be driven the other way. The yaw rate has none.

b_j < 0 of one actuator alone and together with the others, by far more than its interval: its sign,
or its place, is another one than the profile says.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from shiplog.ship_profile.profile import Actuator
from shiplog.voyages.contradictions.regression import regress
from shiplog.voyages.contradictions.track import ROWS, STEP_S, Track, Windows
from shiplog.voyages.rows import moving

LENGTHS_S = (2, 4, 8, 16, 32, 64, 128)
AVERAGED = 0.5  # of a window: over so long a velocity is averaged at its ends, against noise
ASTERN = "yaw rate astern"  # of a rudder, where the ship only goes astern
SHIP_TIMES = 0.6  # L/U: a rudder is counted over no shorter windows, in which waves turn the ship
LEAST_TURN_RAD = math.radians(15.0)  # range of headings, and less: it keeps its course
FEWEST = 14  # windows in which an actuator works
SURE = 3.0  # half 90 % intervals that a coefficient is from zero: five standard deviations
PARTLY = 0.2  # least share of the change that an actuator explains by itself
LARGEST_RUDDER = math.radians(46.0)  # beyond it a rudder deflects a jet, and does not steer
AHEAD = 0.5  # cosine of the angle between the way and the bow, and more: the ship goes ahead
WORKS = 0.15  # of its largest value: an actuator that is moved at all
LATERAL = 0.5  # sine of a direction, and more: the thruster pushes sideways
HELD_RAD, HELD_LENGTHS = math.radians(5.0), 2.0  # a rudder that is put over, and for how long
CIRCLES_RAD, FEW_TURNS = math.pi, 0.1  # turned in all, and the share that may go the other way
OPPOSED = -0.9  # correlation of two rudders that always move against each other
LOOSE = 100.0  # prior of a coefficient, of the change: of two that are one nothing is known
TURNING_S = 2.0  # over which the heading's change is averaged, before its noise is squared
LEAST_ARM = 0.02  # lever, of the ship's length: less turns nothing


@dataclass(frozen=True)
class Driven:
    """How one actuator moves the ship in one direction: b alone, together with the others, and of
    the sum of all forces, each in half intervals from zero; explained: share of the change that it
    explains alone."""

    name: str
    direction: str  # surge, sway, yaw rate, or ASTERN
    alone: float
    together: float
    total: float
    explained: float
    windows: int
    opposed: bool  # it moves against one of its kind that drives the right way
    turned: tuple[float, float] = (0.0, 0.0)  # rad, with a rudder that is held, and against it

    @property
    def against(self) -> bool:
        """It drives the other way, beyond doubt. A rudder that is held in a steady turn changes
        nothing, but the turn is counted. Of two that always move together neither is known
        beside the other: then the sum of all has to say so, or that it moves against one that
        drives the right way."""
        along, against = self.turned
        if against > CIRCLES_RAD and along < FEW_TURNS * against:
            return True
        if self.alone > -SURE or self.explained < PARTLY:
            return False
        if self.opposed:
            return True
        return self.together < SURE and min(self.together, self.total) < -SURE

    @property
    def along(self) -> bool:
        along, against = self.turned
        if along > CIRCLES_RAD and against < FEW_TURNS * along:
            return True
        return self.alone > SURE and self.explained > PARTLY and self.together > -SURE


def paired(t: Track, actuator: Actuator) -> np.ndarray | None:
    """Direction [n] of a thruster's force from ahead to starboard, rad, where an azimuth at the
    same place turns it; None where it is fixed."""
    for other in t.profile.actuators:
        if other.kind == "azimuth" and other.position_m == actuator.position_m:
            return t.driven[other.name]
    return None


def can_push_sideways(t: Track) -> bool:
    """Whether the ship has a thruster or an azimuth that moves it athwart."""
    return any(
        a.kind == "azimuth"
        or (
            a.kind in ("thruster", "propeller")
            and abs(math.sin(math.radians(a.direction_deg))) > LATERAL
        )
        for a in t.profile.actuators
    )


def thrust(t: Track) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Propeller or thruster → ahead, starboard and turning part [n] of n|n|."""
    parts = {}
    for actuator in t.profile.actuators:
        if actuator.kind not in ("propeller", "thruster"):
            continue
        n = t.driven[actuator.name]
        angle = paired(t, actuator)
        angle = math.radians(actuator.direction_deg) if angle is None else angle
        size, (x, y) = n * np.abs(n), actuator.position_m
        ahead, side = size * np.cos(angle), size * np.sin(angle)
        parts[actuator.name] = ahead, side, x * side - y * ahead
    return parts


def _rudder_forces(t: Track) -> dict[str, np.ndarray]:
    """Rudder → δ (U² + (nD/2)²) [n]."""
    flow = np.abs(t.velocity) ** 2
    for actuator in t.profile.actuators:
        if actuator.kind == "propeller" and actuator.diameter_m and actuator.si_unit == "rev/s":
            n = np.nan_to_num(t.driven[actuator.name])
            flow = flow + (0.5 * actuator.diameter_m * n.clip(min=0.0)) ** 2
    return {
        a.name: t.driven[a.name] * flow for a in t.profile.actuators if a.kind == "rudder"
    }  # fmt: skip


def driven(t: Track, yaw_rate: np.ndarray) -> list[Driven]:
    """All that can be counted; yaw_rate [n] rad/s to starboard, as the heading has it."""
    body = t.velocity if t.body else t.velocity * t.ahead.conj()
    u, v, speed = np.real(body), np.imag(body), np.abs(body)
    thrusts = thrust(t)
    length = t.profile.ship.length_m
    found: list[Driven] = []
    rudders = _rudder_forces(t)
    if rudders:
        small = np.ones(len(speed), bool)
        for name in rudders:
            small &= np.abs(t.driven[name]) < LARGEST_RUDDER
        ahead, astern = u > AHEAD * speed, u < -AHEAD * speed
        least = SHIP_TIMES * length / max(float(np.median(speed)), 1e-6)
        turned = t.turned[t.usable]
        if len(turned) and np.ptp(np.quantile(turned, (0.05, 0.95))) > LEAST_TURN_RAD:
            mostly = (ahead & small).sum() >= (astern & small).sum()
            where = (ahead if mostly else astern) & small
            way = "yaw rate" if mostly else ASTERN
            counted = list(_counted(t, way, yaw_rate, rudders, where, least))
            found += counted
            if mostly and not can_push_sideways(t):
                sure = {one.name for one in counted if one.against or one.along}
                found += _steady_turns(
                    t, yaw_rate, [n for n in rudders if n not in sure], ahead & small
                )
    if thrusts:
        everywhere = np.ones(len(speed), bool)
        ahead = {name: part[0] for name, part in thrusts.items() if _acts(part[0], thrusts)}
        side = {name: part[1] for name, part in thrusts.items() if _acts(part[1], thrusts)}
        turning = {
            name: part[2] for name, part in thrusts.items()
            if _acts(part[2] / length, thrusts, LEAST_ARM)
        }  # fmt: skip
        r = _heading_rate(t)
        found += _counted(t, "surge", u, ahead, everywhere, turning_by=r**2)
        found += _counted(t, "sway", v, side, everywhere, turning_by=u * r)
        if len(turning) > 1 or not rudders:
            found += _counted(t, "yaw rate", yaw_rate, turning, everywhere)
    return found


def _heading_rate(t: Track) -> np.ndarray:
    """ψ̇ [n] rad/s, over TURNING_S: the sense of the heading is known, that of a gyro may not be."""
    change = np.angle(t.ahead[1:] * t.ahead[:-1].conj()) / STEP_S
    return moving.mean(np.nan_to_num(np.append(change, 0.0)), round(TURNING_S / STEP_S))


def _steady_turns(
    t: Track, yaw_rate: np.ndarray, names: list[str], where: np.ndarray
) -> Iterator[Driven]:
    """How far the bow turns with a rudder that is held to one side, and how far against it. The
    first two ship's lengths after it is put over are left out: the old turn ends in them."""
    speed = np.abs(t.velocity)
    typical = float(np.median(speed[where])) if where.any() else 0.0
    if typical <= 0.0:
        return
    wait = round(HELD_LENGTHS * t.profile.ship.length_m / typical / STEP_S)
    for name in names:
        rudder = np.nan_to_num(t.driven[name])
        held = where & t.measured & (np.abs(rudder) > HELD_RAD) & (speed > 0.5 * typical)
        side = np.where(held, np.sign(rudder), 0.0)
        at = np.arange(len(side))
        begun = np.maximum.accumulate(np.where(np.diff(side, prepend=0.0) != 0.0, at, 0))
        turned = STEP_S * (side * yaw_rate)[(side != 0.0) & (at - begun > wait)]
        both = float(turned[turned > 0].sum()), float(-turned[turned < 0].sum())
        yield Driven(name, "yaw rate", 0.0, 0.0, 0.0, 0.0, 0, False, both)


def _acts(part: np.ndarray, thrusts: dict, share: float = 0.2) -> bool:
    """Whether a part of the force is not merely the rounding of an angle."""
    most = max(
        float(np.nanmax(np.abs(np.hypot(a, s)), initial=0.0)) for a, s, _ in thrusts.values()
    )
    return float(np.nanmax(np.abs(part), initial=0.0)) > share * max(most, 1e-12)


def _counted(
    t: Track, direction: str, moved: np.ndarray, forces: dict[str, np.ndarray], where: np.ndarray,
    least: float = 0.0, turning_by: np.ndarray | None = None,
) -> Iterator[Driven]:  # fmt: skip
    """Each force against the change of one velocity, at the length of window that tells most, of
    those from `least` [s] on. turning_by   R [n]"""
    if not forces:
        return
    known = t.measured & where
    for one in forces.values():
        known &= np.isfinite(one)
    inside = np.concatenate(([0], np.cumsum(known[: t.bins * ROWS])))
    means = {name: t.integral(np.nan_to_num(one)) for name, one in forces.items()}
    velocity = t.binned(moved)
    turns = None if turning_by is None else t.integral(np.nan_to_num(turning_by))
    best: dict[str, Driven] = {}
    for seconds in LENGTHS_S:
        if seconds < least and seconds != LENGTHS_S[-1]:
            continue
        w = t.windows(seconds)
        rows = inside[(w.last + 1) * ROWS] - inside[w.first * ROWS]
        w = w.chosen(rows >= 0.9 * ROWS * (seconds + 1))
        if len(w.first) < FEWEST:
            continue
        averaged, R = _averaged(velocity, seconds), None if turns is None else w.change(turns)
        for one in _drive_at_length(w, direction, averaged, means, least > 0.0, R):
            before = best.get(one.name)
            if before is None or one.explained > before.explained:
                best[one.name] = one
    yield from best.values()


def _averaged(velocity: np.ndarray, seconds: int) -> np.ndarray:
    """Velocity [B], each second the mean of those around it, over a share of a window."""
    return moving.mean(velocity, max(round(AVERAGED * seconds), 1))


def _drive_at_length(
    w: Windows, direction: str, velocity: np.ndarray, means: dict[str, np.ndarray], steers: bool,
    R: np.ndarray | None = None,
) -> Iterator[Driven]:  # fmt: skip
    """At one length of window; steers: the forces are those of rudders."""
    y, start = w.change(velocity), velocity[w.first]
    if not np.std(start) > 0 or not np.std(y) > 0:
        return
    still = [start / np.std(start), np.ones(len(y))]
    if R is not None and np.std(R) > 0.0:
        still.append(R / np.std(R))
    scaled = {}
    for name, total in means.items():
        force = w.change(total)
        largest = float(np.max(np.abs(force), initial=0.0))
        moves = np.abs(force - np.median(force)) > WORKS * largest
        if largest > 0 and moves.sum() >= FEWEST // 2:
            scaled[name] = force / np.std(force)
    if not scaled:
        return
    free = [np.inf] * (1 + len(still))
    without = regress(y, still, w.block, free[1:])
    loose = [LOOSE * float(np.std(y))] * len(scaled)
    together = regress(y, [*scaled.values(), *still], w.block, [*loose, *free[1:]])
    if without is None or together is None:
        return
    left = _spread_left(y, still, without.theta)
    total = np.sum([w.change(means[name]) for name in scaled], axis=0)
    total = total / max(float(np.std(total)), 1e-12)
    summed = regress(y, [total, *still], w.block, free)
    of_all = 0.0 if summed is None else _halves(summed, 0)
    found = []
    for index, (name, force) in enumerate(scaled.items()):
        alone = regress(y, [force, *still], w.block, free)
        if alone is None:
            continue
        after = _spread_left(y, [force, *still], alone.theta)
        explained = 1.0 - (after / left) ** 2 if left > 0 else 0.0
        found.append(
            Driven(name, direction, _halves(alone, 0), _halves(together, index), of_all, explained,
                   len(y), opposed=False)
        )  # fmt: skip
    right = [scaled[one.name] for one in found if one.along and one.alone > SURE]
    for one in found:
        against = any(np.corrcoef(scaled[one.name], other)[0, 1] < OPPOSED for other in right)
        yield replace(one, opposed=steers and against)


def _halves(fit, index: int) -> float:
    value, low, high = fit.interval(index)
    return value / max(0.5 * (high - low), 1e-12)


def _spread_left(y: np.ndarray, columns: list[np.ndarray], theta: np.ndarray) -> float:
    """Robust spread of what is left."""
    return float(np.mean(np.abs(y - np.stack(columns, axis=1) @ theta)))
