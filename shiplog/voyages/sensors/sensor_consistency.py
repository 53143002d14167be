"""Sensors against each other, without dynamics: what one measures, another must confirm.

The heading is the clock and the reference. With ψ the heading, P the position of the antenna at
the lever arm l, V the velocity of the point at the lever arm m, each as measured,

    r(t + τ_r)            = (1 + s) dψ/dt + b
    d/dt P(t + τ_p)       = R(ψ - δ) V(t + τ_v) / (1 + k) + d/dt [R(ψ - δ) (l - m + a)] + c

hold at every instant of every manoeuvre. All parameters are fitted at once, since a late velocity
looks like an antenna in another place; c is a nuisance (a log that counts through the water).

Velocity over ground (sog_cog, ned, enu) does not pass through the heading: R V is measured then,
δ is not observable, τ_p and τ_v only by their difference, and a only as far as position and
velocity are not of one antenna. What ingest did with the heading is undone first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, fields
from functools import lru_cache

import numpy as np
import polars as pl

from shiplog.logs.health.health_report import NotCompared
from shiplog.nomenclature import channels, frames
from shiplog.nomenclature.channels import DEGREE, Quality
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows.fault_detection import stretches
from shiplog.voyages.rows.resampling import RATE_HZ
from shiplog.voyages.sensors import velocity_filter
from shiplog.voyages.sensors.robust_regression import Problem, RobustFit, bins, shifted
from shiplog.voyages.sensors.sensor_findings import MOST_SCALE, SURE_HALF_INTERVALS, Estimate
from shiplog.voyages.sensors.sensor_findings import findings as findings
from shiplog.voyages.sensors.sensor_solution import solved

STEP_S = 1.0 / RATE_HZ
VOYAGE_ROWS = 36_000  # of a long voyage the liveliest hour says it all
CHUNK_ROWS = 1_200  # rows that are kept or left out together
HELD_ROWS = 3  # an instrument that repeats itself this often breaks a stretch
POINTS_KEPT = 4  # most derivatives of a point change one side of an equation, or neither

# practical sizes: less is no fault of an instrument that anyone would correct
CLOCK_S, HEADING_DEG, BIAS_DEGPS, SCALE = 0.05, 0.3, 0.02, 0.005
ANTENNA_M, ANTENNA_LENGTHS = 0.03, 0.01
# Over which the two sides are compared with and without a delay, s. A gyro drifts in half a minute.
RATE_SLOW_S, WAY_SLOW_S = (8,), (32, 128)
CANCEL, TOGETHER = 0.3, 0.9  # a delay and an antenna that undo each other: share left, correlation

TAU_R, RATE_SCALE, RATE_BIAS = range(3)
TAU_P, TAU_V, OFFSET, SPEED_SCALE, AHEAD, STARBOARD, DRIFT_X, DRIFT_Y = range(8)


@dataclass(frozen=True)
class Motion:
    """Unbroken stretches of rows [n] as the instruments measured them, SI; heading unwrapped."""

    starts: np.ndarray  # bool: begins a stretch
    heading: np.ndarray
    yaw_rate: np.ndarray
    position: np.ndarray  # [n, 2], of the antenna
    velocity: np.ndarray  # [n, 2], in body axes or over ground, of its own lever arm

    def beginning(self, rows: int) -> Motion:
        return Motion(*(getattr(self, f.name)[:rows] for f in fields(self)))


@dataclass(frozen=True)
class Compared:
    """estimates: all that the manoeuvres let be estimated, notable or not; not_compared: what the
    fits did not find, and why."""

    estimates: tuple[Estimate, ...]
    not_compared: tuple[NotCompared, ...] = ()


def compared(
    table: pl.DataFrame, profile: Profile, of_yaw_rate: bool = True, of_velocity: bool = True
) -> Compared:
    """One voyage at 10 Hz. What contradicts itself grossly is not to be fitted: a wrong sign is
    not also a clock that is late."""
    return of_motion(measured(table, profile), profile, of_yaw_rate, of_velocity)


def estimates(table: pl.DataFrame, profile: Profile) -> list[Estimate]:
    """The estimates alone."""
    return list(compared(table, profile).estimates)


def of_motion(
    motion: Motion, profile: Profile, of_yaw_rate: bool = True, of_velocity: bool = True
) -> Compared:
    """The same of rows that are chosen already, such as those of a campaign."""
    found: list[Estimate | NotCompared] = []
    if of_yaw_rate:
        found += _of_yaw_rate(motion, profile)
    if of_velocity:
        found += _of_velocity(motion, profile)
    return Compared(
        tuple(one for one in found if isinstance(one, Estimate)),
        tuple(one for one in found if isinstance(one, NotCompared)),
    )


def _unfound(names: str, why: str) -> NotCompared:
    return NotCompared(
        f"small errors of {names}", why, "turns to both sides and changes of speed, for minutes"
    )


def measured(table: pl.DataFrame, profile: Profile) -> Motion:
    """The rows to use, and ingest's way to midship undone."""
    mark = table["quality"].to_numpy()
    columns = [c.name for c in channels.STATE]
    values = {name: table[name].fill_null(np.nan).to_numpy() for name in columns}
    good = (mark & int(channels.UNUSABLE)) == 0
    for a, b in stretches((mark & int(Quality.HELD)) != 0):
        good[a : b + 1] &= b - a + 1 < HELD_ROWS
    for column in values.values():
        good &= np.isfinite(column)
    rows = np.flatnonzero(good)
    if len(rows) > VOYAGE_ROWS:
        rows = _liveliest(rows, values["yaw_rate"], len(good))
    starts = np.diff(rows, prepend=-2) != 1
    starts |= (mark[rows] & int(Quality.JUMP)) != 0
    used = {name: column[rows] for name, column in values.items()}
    heading, yaw_rate = np.unwrap(used["heading"]), used["yaw_rate"]
    position = np.stack((used["x0"], used["y0"]), axis=1)
    velocity = np.stack((used["surge"], used["sway"]), axis=1)
    of_position, of_velocity = _arms(profile)
    position = frames.position_at_midship(position, heading, (-of_position[0], -of_position[1]))
    velocity = frames.velocity_at_midship(velocity, yaw_rate, (-of_velocity[0], -of_velocity[1]))
    if not _in_body_axes(profile):
        velocity = frames.to_body(velocity, -heading)
    return (
        Motion(starts, heading, yaw_rate, position - position.mean(0), velocity)
        if len(rows)
        else Motion(starts, heading, yaw_rate, position, velocity)
    )


def _liveliest(rows: np.ndarray, yaw_rate: np.ndarray, count: int) -> np.ndarray:
    """Of usable rows, those of the chunks of time in which the ship turns most."""
    chunk = rows // CHUNK_ROWS
    weight = np.bincount(chunk, yaw_rate[rows] ** 2, count // CHUNK_ROWS + 1)
    kept = np.argsort(weight)[-(VOYAGE_ROWS // CHUNK_ROWS) :]
    return rows[np.isin(chunk, kept)]


def _arms(profile: Profile) -> tuple[tuple[float, float], tuple[float, float]]:
    return profile.sensors.position.lever_arm_m, profile.sensors.velocity_arm_m


def _in_body_axes(profile: Profile) -> bool:
    return profile.sensors.kind("velocity") == "body"


def _separable(profile: Profile) -> bool:
    """Whether position and velocity each have a delay of their own against the heading."""
    of_position, of_velocity = _arms(profile)
    return _in_body_axes(profile) or of_position != of_velocity


def _integral(rate: np.ndarray) -> np.ndarray:
    """[n, c] by the trapezoidal rule, from zero."""
    out = np.zeros_like(rate)
    np.cumsum(0.5 * (rate[1:] + rate[:-1]) * STEP_S, axis=0, out=out[1:])
    return out


def _turned(heading: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """R(ψ) times body vectors [n, 2] or one [2]."""
    c, s = np.cos(heading), np.sin(heading)
    return np.stack(frames.in_earth_axes(vector[..., 0], vector[..., 1], c, s), axis=-1)


def _of_yaw_rate(motion: Motion, profile: Profile) -> Iterator[Estimate | NotCompared]:
    """The yaw rate against the heading's own."""
    if profile.sensors.yaw_rate is None:
        return

    def problem(motion: Motion, margin: float) -> Problem:
        grid = bins(motion.starts, round(margin / STEP_S) + 2)
        of_heading = grid.change(motion.heading[:, None])
        turned = _integral(motion.yaw_rate[:, None])

        @lru_cache(maxsize=POINTS_KEPT)
        def late(delay: float) -> np.ndarray:
            return grid.change(shifted(turned, delay / STEP_S))

        def model(p: np.ndarray) -> np.ndarray:
            return late(p[TAU_R]) - (1.0 + p[RATE_SCALE]) * of_heading - p[RATE_BIAS]

        def other_side(p: np.ndarray) -> dict[int, np.ndarray]:
            return {RATE_SCALE: -(late(p[TAU_R]) - p[RATE_BIAS]) / (1.0 + p[RATE_SCALE])}

        return Problem(
            model, grid, steps=np.array([STEP_S, 1e-3, 1e-4]),
            prior=np.array([2.0, 0.3, 2.0 * DEGREE]),
            limit=np.array([margin, MOST_SCALE, 10.0]), other_side=other_side,
        )  # fmt: skip

    found = solved(motion, problem, (TAU_R,), RATE_SCALE, RATE_SLOW_S)
    if isinstance(found, str):
        yield _unfound("yaw rate and heading", found)
        return
    yield _clock("yaw_rate", *found.interval(TAU_R))
    yield _scale("yaw_rate_scale", "yaw_rate", found.interval(RATE_SCALE))
    value, low, high = (v / DEGREE for v in found.interval(RATE_BIAS))
    yield Estimate("yaw_rate_bias", "yaw_rate", value, low, high, 0.0, BIAS_DEGPS, "deg/s")


def _of_velocity(motion: Motion, profile: Profile) -> Iterator[Estimate | NotCompared]:
    """The position's change against the velocity, turned by the heading where it is body-fixed."""
    if profile.sensors.velocity is None:  # it is the position's own change
        return
    body = _in_body_axes(profile)
    of_position, of_velocity = _arms(profile)
    arm = np.subtract(of_position, of_velocity)
    length = profile.ship.length_m

    def problem(motion: Motion, margin: float) -> Problem:
        grid = bins(motion.starts, round(margin / STEP_S) + 2)

        @lru_cache(maxsize=POINTS_KEPT)
        def travelled(delay: float, offset: float, ahead: float, starboard: float) -> np.ndarray:
            antenna = _turned(motion.heading - offset, arm + np.array((ahead, starboard)))
            return grid.change(shifted(motion.position, delay / STEP_S) - antenna)

        @lru_cache(maxsize=POINTS_KEPT)
        def logged(delay: float, offset: float) -> np.ndarray:
            velocity = shifted(motion.velocity, delay / STEP_S)
            over_ground = _turned(motion.heading - offset, velocity) if body else velocity
            return grid.change(_integral(over_ground))

        def sides(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            travel = travelled(p[TAU_P], p[OFFSET], p[AHEAD], p[STARBOARD])
            return travel - p[[DRIFT_X, DRIFT_Y]], logged(p[TAU_V], p[OFFSET])

        def model(p: np.ndarray) -> np.ndarray:
            travel, logged_change = sides(p)
            return travel - logged_change / (1.0 + p[SPEED_SCALE])

        def other_side(p: np.ndarray) -> dict[int, np.ndarray]:
            return {SPEED_SCALE: sides(p)[0] / (1.0 + p[SPEED_SCALE])}

        alone, skew = 2.0 if _separable(profile) else 0.0, 10.0 * DEGREE if body else 0.0
        return Problem(
            model, grid,
            steps=np.array([STEP_S, STEP_S, 1e-3, 1e-3, 1e-2, 1e-2, 1e-3, 1e-3]),
            prior=np.array([alone, 2.0, skew, 0.3, 0.5 * length, 0.5 * length, 1.0, 1.0]),
            limit=np.array(
                [margin, margin, math.pi, MOST_SCALE, *[10.0 * length] * 2, 10.0, 10.0]
            ),
            other_side=other_side,
        )  # fmt: skip

    found = solved(motion, problem, (TAU_P, TAU_V), SPEED_SCALE, WAY_SLOW_S)
    if isinstance(found, str):
        yield _unfound("position and velocity", found)
        return
    cancelling = body and _cancel(found, motion, profile)
    if cancelling:
        yield _unfound(
            "the position's clock and the antenna's place",
            "a position that is late and an antenna that is further ahead undo each other at "
            "a steady speed",
        )
    else:
        yield from _gnss_clocks(found, profile)
    if body:
        value, low, high = (v / DEGREE for v in found.interval(OFFSET))
        yield Estimate("heading_offset", "heading", value, low, high, 0.0, HEADING_DEG, "deg")
    scale = _scale("velocity_scale", "velocity", found.interval(SPEED_SCALE))
    if _filtered(scale, found, motion, profile):
        yield _unfound("the velocity's scale", "a filter as late as it is takes as much of turns")
    else:
        yield scale
    if one_receiver(profile) or cancelling:
        return
    least = max(ANTENNA_M, ANTENNA_LENGTHS * length)
    for index, channel in ((AHEAD, "position ahead"), (STARBOARD, "position starboard")):
        value, low, high = found.interval(index)
        yield Estimate("antenna_offset", channel, value, low, high, 0.0, least, "m")


def _filtered(scale: Estimate, found: RobustFit, motion: Motion, profile: Profile) -> bool:
    """Whether a velocity shows too little as one does that a filter makes late."""
    late = float(found.value[TAU_V] - (found.value[TAU_P] if _separable(profile) else 0.0))
    if not scale.notable or late < CLOCK_S:
        return False
    body = _in_body_axes(profile)
    velocity = _turned(motion.heading, motion.velocity) if body else motion.velocity
    share = velocity_filter.takes(velocity, late, STEP_S)
    return velocity_filter.explains(scale.value, 0.5 * (scale.high - scale.low), share)


def one_receiver(profile: Profile) -> bool:
    """Whether position and velocity over ground are of one place: they then move alike wherever it
    is, and say nothing of a lever arm."""
    of_position, of_velocity = _arms(profile)
    return not _in_body_axes(profile) and of_position == of_velocity


def _cancel(found: RobustFit, motion: Motion, profile: Profile) -> bool:
    """Whether the delay between position and velocity and the antenna's place ahead are both
    notable, hardly known but together, and undo each other: a = u τ at the speed u."""
    late = float(found.value[TAU_P] - found.value[TAU_V])
    ahead = float(found.value[AHEAD])
    delay, place = np.zeros(len(found.value)), np.zeros(len(found.value))
    delay[[TAU_P, TAU_V]], place[AHEAD] = (1.0, -1.0), 1.0
    of_delay, of_place = (float(one @ found.cov @ one) for one in (delay, place))
    both = float(delay @ found.cov @ place)
    if min(of_delay, of_place) <= 0.0 or abs(both) < TOGETHER * math.sqrt(of_delay * of_place):
        return False
    length = profile.ship.length_m
    small = abs(late) < CLOCK_S or abs(ahead) < max(ANTENNA_M, ANTENNA_LENGTHS * length)
    speed = float(np.median(motion.velocity[:, 0]))
    return not small and abs(ahead - speed * late) < CANCEL * abs(ahead)


def _gnss_clocks(found: RobustFit, profile: Profile) -> Iterator[Estimate]:
    """Delays of position and velocity; as one of `gnss` where both are late by the same.

    Velocities that were turned by the heading when they were recorded keep its turns and not their
    own time: they look punctual, and the position early by what they are late. No profile tells
    them from a log's own, so of body velocities only the time between the two is reported.
    """
    if not _separable(profile):
        yield _later_of_two(*found.interval(TAU_V))
        return
    position, velocity = (
        _clock("position", *found.interval(TAU_P)), _clock("velocity", *found.interval(TAU_V)),
    )  # fmt: skip
    both = found.cov[np.ix_((TAU_P, TAU_V), (TAU_P, TAU_V))]
    sum_, difference = np.array([0.5, 0.5]), np.array([1.0, -1.0])
    half = found.quantile * math.sqrt(sum_ @ both @ sum_)
    value = 0.5 * (position.value + velocity.value)
    together = _clock("gnss", value, value - half, value + half)
    apart = found.quantile * math.sqrt(difference @ both @ difference)
    late = velocity.value - position.value
    if together.notable and abs(late) < max(CLOCK_S, SURE_HALF_INTERVALS * apart):
        yield together
    elif not _in_body_axes(profile):
        yield position
        yield velocity
    elif velocity.notable:
        yield velocity
        if position.notable:
            yield _clock("position", -late, -late - apart, -late + apart, rival="velocity")
    else:
        yield _later_of_two(late, late - apart, late + apart)


def _later_of_two(late: float, low: float, high: float) -> Estimate:
    """Of position and velocity, from how late the velocity is against the position."""
    if late >= 0:
        return _clock("velocity", late, low, high, rival="position")
    return _clock("position", -late, -high, -low, rival="velocity")


def _scale(kind: str, channel: str, beyond: tuple[float, float, float]) -> Estimate:
    """Measured over true, from the share by which it is more."""
    value, low, high = (1.0 + v for v in beyond)
    return Estimate(kind, channel, value, low, high, 1.0, SCALE, "1")


def _clock(channel: str, value: float, low: float, high: float, rival: str = "") -> Estimate:
    return Estimate("clock_offset", channel, value, low, high, 0.0, CLOCK_S, "s", rival)
