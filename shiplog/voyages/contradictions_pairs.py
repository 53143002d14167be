"""Two instruments against each other, with no model of the ship: which formula joins them.

Position against velocity, over windows of T seconds (vectors over ground are complex numbers):

    Δp = z X - τ ΔẊ + Δ(e^{iψ}) a + c T

with X the integral of the velocity as it is, or as it would be were a sign, an axis or a unit
another one; z how the two differ in size and angle; τ a delay, a the place of the antenna and c the
current of a log that counts through the water, all small beforehand. Heading against yaw rate:

    Δψ = k ∫r dt - τ Δr + b T

Heading against the way that the ship goes: X = ∫ |V| e^{iψ} dt. The way's own turning against the
yaw rate, from one window to the next: Δ arg Δp = k ∫r dt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from shiplog.channels import DEGREE
from shiplog.voyages.contradictions_regression import Regression, regress
from shiplog.voyages.contradictions_track import Track, Windows, noise

LENGTHS_S = (8, 16, 32, 64, 128, 4, 2)  # of a window, in the order in which they are tried
TURN_LENGTHS_S = (30, 10, 100, 4)
ENOUGH, FEWEST = 14, 10  # windows in which the ship moves
MOST_OF_THEM = 0.8  # of the time under way that a longer window would use
OVER_NOISE = 25.0  # times the noise of a position: less travel tells no ratio
SLOW_MPS, SLOW_FROUDE, SLOW_MOST_MPS = 0.12, 0.03, 0.5  # slower than that is at rest
OVER_STEPS = 2.0  # times the noise of a velocity
GRAVITY = 9.81
TURNED_RAD = 4.0 * DEGREE  # in a window: less is no turn
OVER_HEADING_NOISE = 10.0
ARM_LENGTHS, ARM_SHARED = 0.25, 0.02  # prior of the antenna's place, ship lengths
CURRENT_SHARE = 0.7  # prior of a current, of the ship's speed
DELAY_S = 1.0  # prior of a delay
BIAS_RADPS, BIAS_SHARE = 0.3 * DEGREE, 0.1  # prior of a gyro's bias: rad/s, and of its rms
RAD = 1.0 / DEGREE  # 57.3
TOGETHER = 0.7  # correlation from which the way is said to turn with the yaw rate
MOST_LAG_S = 120  # longest delay that is looked for
FIT_LAG_S = 5.0  # shorter ones are for the fit
ALIKE, LESS_ALIKE = 0.85, 4.0  # at a delay, and how many times less they are alike at none


@dataclass(frozen=True)
class Joined:
    """Which formulas join two instruments: each with its regression.

    left     formula → share of the change that it leaves unexplained
    spread   of the directions sailed: 0 on one straight line, 1 all round
    windows  how many were compared; seconds: how long each is
    """

    fits: dict[str, Regression]
    windows: int
    seconds: float
    spread: float = 1.0
    speeds: tuple[float, float] = (0.0, 0.0)  # median of the position's and of the velocity's, m/s
    extra: dict[str, float] = field(default_factory=dict)

    @property
    def left(self) -> dict[str, float]:
        return {name: fit.left for name, fit in self.fits.items()}


def slowest(t: Track) -> float:
    """m/s: what is slower is at rest, drifts at a berth, or is lost in the steps of a receiver."""
    froude = SLOW_FROUDE * math.sqrt(GRAVITY * t.profile.ship.length_m)
    steps = OVER_STEPS * noise(t.binned(t.velocity), t.usable)
    return max(SLOW_MPS, min(froude, SLOW_MOST_MPS), steps)


def under_way(t: Track) -> tuple[Windows, np.ndarray, np.ndarray] | None:
    """Windows in which position or velocity moves, and the change of both."""
    least, floor = slowest(t), math.sqrt(2.0) * OVER_NOISE * noise(t.place, t.usable)
    found: list[tuple[Windows, np.ndarray, np.ndarray]] = []
    for seconds in LENGTHS_S:
        w = t.windows(seconds)
        y, x = w.change(t.place), w.change(t.sailed)
        moves = np.maximum(np.abs(y), np.abs(x)) > max(floor, least * seconds)
        found.append((w.chosen(moves), y[moves], x[moves]))
    most = max(len(w.first) * w.seconds for w, _, _ in found)
    for fewest in (ENOUGH, FEWEST):
        for one in found:
            count = len(one[0].first)
            if count >= fewest and count * one[0].seconds >= MOST_OF_THEM * most:
                return one
    return max((one for one in found if len(one[0].first) >= FEWEST),
               key=lambda one: len(one[0].first) * one[0].seconds, default=None)  # fmt: skip


def complex_fit(
    t: Track, w: Windows, y: np.ndarray, velocity: np.ndarray, drift: bool, arm: float
) -> Regression | None:
    """y = z X - τ ΔẊ + Δ(e^{iψ}) a + c T of a velocity Ẋ [n] over ground: z first. None where
    that velocity is nothing."""
    x, late = w.change(t.integral(velocity)), w.change(t.binned(velocity))
    if not np.any(x):
        return None
    columns, prior = [x, 1j * x, late], [np.inf, np.inf, DELAY_S]
    if arm > 0:
        d = w.change(t.binned(t.ahead))
        columns += [d, 1j * d]
        prior += [arm, arm]
    if drift:
        size = max(float(np.median(np.abs(y))), float(np.median(np.abs(x))))
        current = CURRENT_SHARE * size / w.seconds
        columns += [np.full(len(y), w.seconds + 0j), np.full(len(y), 1j * w.seconds)]
        prior += [current, current]
    return regress(y, columns, w.block, prior)


def _spread(y: np.ndarray) -> float:
    """Of the directions of vectors, sign apart."""
    direction = np.exp(2j * np.angle(y))
    return 1.0 - float(np.abs(np.mean(direction)))


def position_and_velocity(t: Track) -> Joined | None:
    """None where the ship hardly moves."""
    moved = under_way(t)
    if moved is None:
        return None
    w, y, x = moved
    length = t.profile.ship.length_m
    arm = length * (ARM_LENGTHS if t.body or t.arm != 0 else ARM_SHARED)
    v = t.velocity
    tried: dict[str, np.ndarray] = {"as it is": t.over_ground, "mirrored": t.over_ground.conj()}
    if t.body:
        tried |= {
            "heading mirrored": v * t.ahead.conj(),
            "sway mirrored": v.conj() * t.ahead,
            "heading in radians": v * np.exp(1j * RAD * t.heading),
        }
    elif t.profile.sensors.kind("velocity") == "sog_cog":
        tried["course in radians"] = np.abs(v) * np.exp(1j * RAD * np.angle(v))
    fits = {
        name: fit
        for name, velocity in tried.items()
        if (fit := complex_fit(t, w, y, velocity, t.body, arm)) is not None
    }
    if fit := regress(y, [x.imag + 0j, 1j * x.real], w.block, [np.inf] * 2):
        fits["swapped"] = fit
    path = w.change(t.integral(np.abs(v)))
    speeds = float(np.median(np.abs(y))) / w.seconds, float(np.median(path)) / w.seconds
    return Joined(fits, len(y), w.seconds, _spread(y if speeds[0] > 0 else x), speeds)


def heading_and_way(t: Track, position: bool) -> Joined | None:
    """The way over ground, of the position or the velocity, against ∫ |V| e^{iψ} dt."""
    moved = under_way(t)
    if moved is None or (not position and t.body):
        return None
    w, y, x = moved
    way = y if position else x
    speed = np.abs(t.velocity)
    tried = {
        "as it is": t.ahead,
        "mirrored": t.ahead.conj(),
        "in radians": np.exp(1j * RAD * t.heading),
    }
    fits = {}
    for name, axis in tried.items():
        fit = complex_fit(t, w, way, speed * axis, False, 0.0)
        if fit is not None:
            fits[name] = fit
    extra = {}
    drifting = complex_fit(t, w, way, speed * t.ahead, True, 0.0)
    if drifting is not None:
        extra = {"drifting": drifting.left, "current": float(np.hypot(*drifting.theta[-2:]))}
    return Joined(fits, len(way), w.seconds, _spread(way), extra=extra)


def bend(t: Track, turned_by: np.ndarray) -> tuple[float, float, float] | None:
    """k of Δ arg Δp = k Δψ with its 90 % interval, where the two go together; turned_by [B] rad:
    the heading, or the integral of the yaw rate."""
    moved = under_way(t)
    if moved is None:
        return None
    w, y, x = moved
    if np.median(np.abs(y)) < 0.1 * np.median(np.abs(x)):  # a position that stands still
        y = x
    next_to = np.flatnonzero(np.diff(w.first) == round(w.seconds))
    if len(next_to) < FEWEST:
        return None
    bent = np.angle(y[next_to + 1] * y[next_to].conj())
    middle = (w.first + w.last) // 2
    turned = turned_by[middle[next_to + 1]] - turned_by[middle[next_to]]
    if min(np.std(bent), np.std(turned)) < 1e-9:
        return None
    together = float(np.corrcoef(bent, turned)[0, 1])
    fit = regress(bent, [turned, np.full(len(bent), w.seconds)], w.block[next_to],
                  [np.inf, BIAS_RADPS])  # fmt: skip
    return None if fit is None or abs(together) < TOGETHER else fit.interval(0)


def heading_and_yaw_rate(t: Track) -> Joined | None:
    """None where the ship hardly turns, by either."""
    if t.profile.sensors.yaw_rate is None:
        return None
    quiet = OVER_HEADING_NOISE * noise(t.turned, t.usable)
    quiet_rate = OVER_HEADING_NOISE * noise(t.turned_by_rate, t.usable)
    for seconds in TURN_LENGTHS_S:
        w = t.windows(seconds)
        y, x = w.change(t.turned), w.change(t.turned_by_rate)
        centred = np.abs(x - np.median(x)) if len(x) else x
        by_heading = np.abs(y) > max(TURNED_RAD, quiet)
        by_rate = centred > max(TURNED_RAD, quiet_rate)
        turns = by_heading | by_rate
        if turns.sum() >= FEWEST:
            break
    else:
        return None
    both = float(by_heading.sum()), float(by_rate.sum())
    w, y, x = w.chosen(turns), y[turns], x[turns]
    time = np.full(len(y), w.seconds)
    late = w.change(t.binned(t.yaw_rate))
    bias = BIAS_RADPS + BIAS_SHARE * float(np.sqrt(np.mean(x**2))) / w.seconds
    fits = {}
    slope = 1e3  # prior of a slope: of what stands still it is 0, however little is known
    for name, side, other in (("rate by heading", x, y), ("heading by rate", y, x)):
        fit = regress(side, [other, late, time], w.block, [slope, DELAY_S, bias])
        if fit is not None:
            fits[name] = fit
    joint = max(_alike(x, y), _alike(x - np.mean(x), y - np.mean(y)), key=abs)
    return Joined(
        fits, len(y), w.seconds,
        extra={"correlation": joint, "by heading": both[0], "by rate": both[1]},
    )  # fmt: skip


def is_late(late: float, then: float, now: float) -> bool:
    """Whether `lag` found a delay, and one that no fit looks for."""
    return abs(late) > FIT_LAG_S and then > ALIKE and 1.0 - now > LESS_ALIKE * (1.0 - then)


def _alike(one: np.ndarray, other: np.ndarray) -> float:
    """Cosine between two vectors; 0 where one of them is nothing."""
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / size if size > 0.0 else 0.0


def lag(one: np.ndarray, other: np.ndarray, usable: np.ndarray) -> tuple[float, float, float]:
    """By how many seconds `other` comes after `one`, both changes a second [B], and how alike they
    are then and without it: of −MOST_LAG_S to MOST_LAG_S the delay at which they are most alike."""
    good = usable[1:] & usable[:-1]
    one, other = (np.where(good, v - np.mean(v[good]), 0.0) for v in (one, other))
    size = float(np.sqrt(np.sum(np.abs(one) ** 2) * np.sum(np.abs(other) ** 2)))
    if size == 0.0:
        return 0.0, 0.0, 0.0
    count = len(one)
    padded = 1 << int(np.ceil(np.log2(2 * count)))
    spectrum = np.fft.fft(one, padded).conj() * np.fft.fft(other, padded)
    alike = np.real(np.fft.ifft(spectrum)) / size
    most = min(MOST_LAG_S, count // 4)
    lags = np.arange(-most, most + 1)
    best = int(lags[np.argmax(alike[lags])])
    return float(best), float(alike[best]), float(alike[0])
