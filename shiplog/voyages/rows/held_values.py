"""Values that repeat although the ship moves, told from rest and from a coarse instrument.

A repeated value is a fault only where another sensor shows that it should have changed. A position
is compared with the velocity's integral, a heading with the yaw rate's, or, where none is
measured, with the course; a velocity or a yaw rate that repeats is compared with the change of the
position or the heading. What an instrument counts in steps stands still until the ship has gone a
step. A rate may be biased by as much as it scatters, or by DOUBT of what it measures.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows import course_over_ground, fault_detection
from shiplog.voyages.rows.resampling import STEP_NS, Samples

STEP_S = STEP_NS * 1e-9
DOUBT = 0.02  # of the 95 % quantile of a rate: bias and scale of one that a filter has smoothed
ACCIDENT = 1e-3  # chance that noise makes anything in a whole record look held
DRIFT_S, FEWEST_PIECES = 30.0, 6  # s: pieces over which a rate's bias is measured
LONG_S = 5.0  # s: a stretch of repeats that may hide what the bias is
SPREADS = 3.0  # standard deviations between pieces by which the bias may be another
METRE = 111_320.0  # m, a degree of latitude
COUNTED = ("position", "heading")  # whose steps may be others where their numbers are larger


def find_held(
    name: str,
    samples: Samples,
    sampled: dict[str, Samples],
    times: np.ndarray,
    columns: Mapping[str, np.ndarray],
    over_ground: np.ndarray,
    profile: Profile,
) -> list[tuple[int, int]]:
    """Rows (first, last) in which a sensor repeats a value that cannot have stood still.

    times [m] ns and columns [m] of the grid; over_ground [m, 2]: velocity along x0 and y0, m/s,
    NaN where it is not known.
    """
    runs = fault_detection.repeats(samples.value)
    if not runs:
        return []
    around = fault_detection.steps_around(samples.value, runs) if name in COUNTED else 0.0
    if name == "position" and profile.sensors.kind(name) == "geodetic":
        around = around * METRE
    steps = np.maximum(samples.resolution, around)
    least = _by_chance(runs, samples.noise, steps, len(samples.time)) + steps

    def kept(
        runs: list[tuple[int, int]],
        travel: np.ndarray | None,
        least: float | np.ndarray,
        drift: float = 0.0,
    ) -> list[tuple[int, int]]:
        return fault_detection.held_on_grid(times, samples.time, runs, travel, least, drift)

    if name == "wind":  # nothing to compare it with; a calm is none
        return kept(
            _moving(fault_detection.improbable(runs, len(samples.time)), samples), None, 0.0
        )
    speed, turning = np.nan_to_num(over_ground), np.nan_to_num(columns["yaw_rate"])[:, None]
    if name == "position" and "velocity" not in sampled:
        return []  # a derived velocity repeats with it: `lost_pose` has looked
    if name == "position":
        gone = np.cumsum(speed, axis=0) * STEP_S
        return kept(runs, gone, least, _bias(sampled["velocity"], speed))
    turned = np.cumsum(turning, axis=0) * STEP_S
    if name == "heading" and profile.sensors.yaw_rate is not None:
        drift = _bias(sampled["yaw_rate"], turning)
        off = _unwrapped(columns["heading"]) - turned[:, 0]
        measured = _drift(off, kept(runs, None, 0.0))
        if measured is not None:
            bias, drift = measured[0], min(drift, measured[1])
            turned = turned + bias * STEP_S * np.arange(len(turned))[:, None]
        return kept(runs, turned, least, drift)
    position = np.stack([_filled(columns[c]) for c in ("x0", "y0")], axis=1)
    if name == "heading":
        keel = columns["heading"].copy()
        for first, last in kept(runs, None, 0.0):  # what may be frozen is not compared
            keel[first : last + 1] = np.nan
        course = course_over_ground.course(sampled, speed, position, keel, profile)
        if course is None:
            return []
        shortest = course.seconds / samples.period_s  # a shorter stretch has no course of its own
        long = np.array([last - first + 1 >= shortest for first, last in runs], bool)
        runs = [run for run, is_long in zip(runs, long, strict=True) if is_long]
        return kept(runs, course.angle[:, None], least[long] + course.swing)
    runs = fault_detection.improbable(runs, len(samples.time))
    if not runs:
        return []
    moving = _moving(runs, samples)
    if name == "velocity":
        gone = np.cumsum(speed, axis=0) * STEP_S
        other, off, bias = sampled["position"], position - gone, _bias(samples, speed)
    else:
        other, off = sampled["heading"], _unwrapped(columns["heading"])[:, None] - turned
        bias = _bias(samples, turning)
    sure = moving if samples.resolution == 0.0 else []  # no value of so many digits comes twice
    unsure = [run for run in runs if run not in sure]
    by_noise = 2.0 * other.noise * math.sqrt(math.log(max(len(samples.time), 1) / ACCIDENT))
    shown = kept(unsure, off, by_noise + other.resolution, bias)
    return sorted(kept(sure, None, 0.0) + shown)


def _moving(runs: list[tuple[int, int]], samples: Samples) -> list[tuple[int, int]]:
    """Runs whose value is no rest."""
    rest = np.all(np.abs(samples.value) <= samples.resolution, axis=1)
    return [run for run in runs if not rest[run[0]]]


def _by_chance(
    runs: list[tuple[int, int]], sigma: float, steps: np.ndarray | float, count: int
) -> np.ndarray:
    """How far [runs] a channel may have gone while noise makes its samples repeat by accident.

    Two samples with noise σ, counted in steps q, of a channel that goes by d between them are one
    number with the chance p = q/(2σ√π) exp(-d²/(4σ²)). Of a record of N samples n repeats in a row
    come about with less than ACCIDENT from

        d = 2σ √(ln(N/ACCIDENT) + n ln min(1, q/(2σ√π)))

    on. At least 3σ, also of numbers of so many digits that no two are the same.
    """
    if sigma <= 0.0 or count == 0:
        return np.zeros(len(runs))
    repeats = np.array([last - first + 1 for first, last in runs], float)
    one = np.minimum(1.0, np.broadcast_to(steps, len(runs)) / (2.0 * sigma * math.sqrt(math.pi)))
    with np.errstate(divide="ignore"):
        chance = math.log(count / ACCIDENT) + repeats * np.log(one)
    return np.maximum(3.0 * sigma, 2.0 * sigma * np.sqrt(chance.clip(min=0.0)))


def _drift(off: np.ndarray, away: list[tuple[int, int]]) -> tuple[float, float] | None:
    """Bias of a rate and how far it may be from that, from what it and its channel differ by.

    off [m]: channel less the rate's integral; away: rows that are in doubt. Medians over pieces of
    DRIFT_S, which have to be FEWEST_PIECES; None where too few are whole.
    """
    sound = np.ones(len(off), bool)
    for first, last in away:
        if (last - first) * STEP_S > LONG_S:
            sound[first : last + 1] = False
    rows = round(DRIFT_S / STEP_S)
    firsts = np.arange(0, len(off) - rows, rows)
    firsts = firsts[[bool(sound[a : a + rows].all()) for a in firsts]]
    if len(firsts) < FEWEST_PIECES:
        return None
    slopes = (off[firsts + rows - 1] - off[firsts]) / DRIFT_S
    bias = float(np.median(slopes))
    return bias, SPREADS * 1.4826 * float(np.median(np.abs(slopes - bias)))


def _bias(samples: Samples, rate: np.ndarray) -> float:
    """How fast a rate that is 0 may be said to move, in its unit."""
    return max(samples.noise, DOUBT * float(np.quantile(np.linalg.norm(rate, axis=1), 0.95)))


def _filled(column: np.ndarray) -> np.ndarray:
    """A column [m] without its NaN, on straight lines across them."""
    known = np.flatnonzero(np.isfinite(column))
    if len(known) == 0:
        return np.zeros(len(column))
    return np.interp(np.arange(len(column)), known, column[known])


def _unwrapped(heading: np.ndarray) -> np.ndarray:
    known = np.isfinite(heading)
    whole = heading.copy()
    whole[known] = np.unwrap(heading[known])
    return _filled(whole)
