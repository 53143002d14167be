"""Speed loss at equal revolutions, in the sense of ISO 19030-2:2016.

    V_d = 100 (V_m - V_e)/V_e   [%], below zero where the ship is slower than the model

    V_m   speed through the water of a block, measured
    V_e   steady speed ahead of the model with the block's actuators, in its wind: u̇ = 0 (bisection)

ISO 19030-2 takes the expected speed at equal delivered power from a table; logs of manoeuvring have
revolutions, and the model gives the speed at these. The standard's filters (its Sec. 6.2 and Annex)
are kept: block averages, true wind of at most 7.9 m/s, rudder of at most 5 degrees, depth of more
than 3 √(B T) and 2.75 V²/g, Chauvenet's criterion. The block's length and the wind limit are those
of a ship of 100 m or more; a shorter one has them by Froude's law, times √(L/100 m). Blocks in
which the ship is not steady are left out.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import erfc, stdtrit

from shiplog.diagnosis.linear import linearisation
from shiplog.diagnosis.trial.trial import Trial
from shiplog.nomenclature import frames
from shiplog.voyages.rows.recording import Record

BLOCK_S = 600.0  # s, of a block average
MOST_WIND = 7.9  # m/s, true: the end of 4 Bft
MOST_ANGLE = math.radians(5.0)  # of rudders and azimuths, mean of the magnitude
LARGE = 100.0  # m: from this length on block and wind limit are as the standard has them
SHALLOW_DRAUGHT, SHALLOW_SPEED = 3.0, 2.75  # √(B T); V²/g
GRAVITY = 9.81  # m/s²
STEADY_SPEED = 0.05  # share by which the speed may change from the first third to the last
STEADY_REVOLUTIONS = 0.03  # standard deviation over mean
SLOWEST = 0.2  # of the trial's working speed: a ship that hardly moves has no speed to lose
BISECTIONS = 40
FASTEST = 3.0  # times the measured speed: the expected one is looked for below


@dataclass(frozen=True)
class SpeedLoss:
    """V_d of one voyage, %.

    value      mean of its blocks; None without any
    low, high  90 % interval of that mean, Student's t; None of fewer than two blocks
    blocks     that were counted
    left_out   why → how many were not
    """

    value: float | None
    low: float | None
    high: float | None
    blocks: int
    left_out: Mapping[str, int]


def of_voyages(
    trial: Trial, theta: np.ndarray, water: Mapping[str, tuple[float, float]] | None = None
) -> dict[str, SpeedLoss]:
    """Voyage → V_d, by a model with coefficients θ [C], its causes' numbers zero or as they stand.

    water   its velocity along x₀ and y₀ [m/s] in each voyage; where none is given it stands
    """
    record = trial.record
    speed = np.hypot(record.state[:, 1], record.state[:, 3])
    working = float(np.quantile(speed, 0.9)) if len(speed) else 0.0
    found = {}
    for v, name in enumerate(record.names):
        out: Counter[str] = Counter()
        current = (water or {}).get(name, (0.0, 0.0))
        blocks = [
            one for rows in _blocks(record, v)
            if (one := _block(trial, rows, current, SLOWEST * working, out)) is not None
        ]  # fmt: skip
        losses = _losses(trial, theta, blocks, out)
        found[name] = _mean(losses, dict(out))
    return found


@dataclass(frozen=True)
class _Block:
    """Means of a block: speed through the water [m/s], heading [rad], actuators [A], true wind over
    the water [2]."""

    speed: float
    heading: float
    actuator: np.ndarray
    share: float
    wind: np.ndarray


def scale(length: float) -> float:
    """√(L/100 m), 1 at most."""
    return min(1.0, math.sqrt(length / LARGE))


def _blocks(record: Record, voyage: int) -> list[np.ndarray]:
    """Rows of each whole block of a voyage; none crosses a gap."""
    size = max(round(BLOCK_S * scale(record.profile.ship.length_m) / record.step), 3)
    starts = np.flatnonzero(record.starts & (record.voyage == voyage))
    found = []
    for first in starts:
        last = int(record.lasts[first]) + 1
        found += [np.arange(at, at + size) for at in range(first, last - size + 1, size)]
    return found


def _block(
    trial: Trial, rows: np.ndarray, current: tuple[float, float], slowest: float,
    out: Counter[str],
) -> _Block | None:  # fmt: skip
    """The means, or None with the reason counted in `out`."""
    record, ship = trial.record, trial.record.profile.ship
    state, actuator = record.state[rows], record.actuator[rows]
    axes = frames.axes(state[:, 4])
    ahead, starboard = frames.in_body_axes(*current, axes.cos, axes.sin)
    u, v = state[:, 1] - ahead, state[:, 3] - starboard
    speed = np.hypot(u, v)
    mean = float(speed.mean())
    wind = record.true_wind[rows].mean(0) + np.array(current)
    kinds = [a.kind for a in record.profile.actuators]
    angles = actuator[:, [i for i, k in enumerate(kinds) if k in ("rudder", "azimuth")]]
    drives = actuator[:, [i for i, k in enumerate(kinds) if k in ("propeller", "thruster")]]
    turns = drives[:, np.abs(drives).mean(0) > 1e-6]
    third = len(rows) // 3
    change = abs(float(u[-third:].mean() - u[:third].mean()))
    depth = record.profile.site.depth_m
    draught = ship.draught_m or 0.0
    deep = max(
        SHALLOW_DRAUGHT * math.sqrt(ship.breadth * draught), SHALLOW_SPEED * mean**2 / GRAVITY
    )
    if float(u.mean()) < max(slowest, 1e-3):
        out["slow or astern"] += 1
    elif angles.size and float(np.abs(angles).mean(0).max()) > MOST_ANGLE:
        out["rudder above 5 deg"] += 1
    elif not turns.size or (turns.std(0) > STEADY_REVOLUTIONS * np.abs(turns.mean(0))).any():
        out["revolutions not steady"] += 1
    elif change > STEADY_SPEED * mean:
        out["speed not steady"] += 1
    elif record.profile.has_wind and np.hypot(*wind) > MOST_WIND * scale(ship.length_m):
        out["wind above the limit"] += 1
    elif depth is not None and depth <= deep:
        out["shallow water"] += 1
    else:
        heading = math.atan2(float(axes.sin.mean()), float(axes.cos.mean()))
        return _Block(mean, heading, actuator.mean(0), float(record.share[rows].mean()), wind)
    return None


def _losses(
    trial: Trial, theta: np.ndarray, blocks: list[_Block], out: Counter[str]
) -> np.ndarray:  # fmt: skip
    """V_d of each block, without those that Chauvenet's criterion rejects."""
    if not blocks:
        return np.zeros(0)
    V_m = np.array([one.speed for one in blocks])
    V_e = expected_speed(
        trial, theta, V_m, np.array([one.heading for one in blocks]),
        np.array([[*one.actuator, one.share, *one.wind] for one in blocks]),
    )  # fmt: skip
    known = np.isfinite(V_e)
    out["no steady speed of the model"] += int((~known).sum())
    loss = 100.0 * (V_m[known] - V_e[known]) / V_e[known]
    kept = chauvenet(loss)
    out["outlier"] += int((~kept).sum())
    return loss[kept]


def expected_speed(
    trial: Trial, theta: np.ndarray, near: np.ndarray, heading: np.ndarray, driven: np.ndarray
) -> np.ndarray:
    """u [n] with u̇(u; θ) = 0 between 0 and FASTEST `near` [n], straight ahead, by bisection; NaN
    where u̇ has one sign there. `driven` [n, A + 3]: actuators, share, true wind."""
    model = trial.reference.model

    def ahead(u: np.ndarray) -> np.ndarray:
        state = np.zeros((len(u), 1, 6))
        state[:, 0, 1], state[:, 0, 4] = u, heading
        return linearisation.accelerations(model, theta, state, driven[:, None])[:, 0, 0]

    low, high = 1e-3 * near, FASTEST * near
    bracketed = (ahead(low) > 0.0) & (ahead(high) < 0.0)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        faster = ahead(middle) > 0.0
        low, high = np.where(faster, middle, low), np.where(faster, high, middle)
    return np.where(bracketed, 0.5 * (low + high), np.nan)


def chauvenet(values: np.ndarray) -> np.ndarray:
    """[n] bool: n erfc(|x - mean|/(√2 s)) >= ½, Chauvenet's criterion as ISO 19030-2 has it."""
    spread = float(values.std(ddof=1)) if len(values) > 2 else 0.0
    if spread <= 0.0:
        return np.ones(len(values), dtype=bool)
    away = np.abs(values - values.mean()) / (math.sqrt(2.0) * spread)
    return len(values) * erfc(away) >= 0.5


def _mean(losses: np.ndarray, out: Mapping[str, int]) -> SpeedLoss:
    left_out = {why: count for why, count in out.items() if count}
    count = len(losses)
    if count == 0:
        return SpeedLoss(None, None, None, 0, left_out)
    value = float(losses.mean())
    if count == 1:
        return SpeedLoss(value, None, None, 1, left_out)
    half = float(stdtrit(count - 1, 0.95)) * float(losses.std(ddof=1)) / math.sqrt(count)
    return SpeedLoss(value, value - half, value + half, count, left_out)
