"""Two instruments against each other, with no model of the ship: which formula joins them.

Position against velocity, over windows of T seconds (vectors over ground are complex numbers):

    Δp = z X - τ ΔẊ + Δ(e^{iψ}) a + c T

with X the integral of the velocity as it is, or as it would be were a sign, an axis or a unit
another one; z how the two differ in size and angle; τ a delay, a the place of the antenna and c the
current of a log that counts through the water, all small beforehand. Heading against yaw rate:

    Δψ = k ∫r dt - τ Δr + b T

Heading against the way that the ship goes: X = ∫ |V| e^{iψ} dt, and of a ship that goes ahead and
astern by turns X = ∫ s |V| e^{iψ} dt, s = ±1 the sign of V along e^{iψ}. The way's own turning
against the yaw rate, from one window to the next: Δ arg Δp = k ∫r dt.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from shiplog.nomenclature.channels import DEGREE
from shiplog.voyages.contradictions.regression import Regression, regress
from shiplog.voyages.contradictions.track import Track, Windows, noise

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
NATURAL = 0.15  # natural logarithm, and rad: of two that are about one
PERFECT = 0.02  # unexplained share, and less: nothing is wrong
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


@dataclass(frozen=True)
class UnderWay:
    """Windows in which position or velocity moves, the change of both [w], and the speed below
    which neither is said to move, m/s."""

    windows: Windows
    by_position: np.ndarray
    by_velocity: np.ndarray
    slowest: float


def slowest(t: Track) -> float:
    """m/s: what is slower is at rest, drifts at a berth, or is lost in the steps of a receiver."""
    froude = SLOW_FROUDE * math.sqrt(GRAVITY * t.profile.ship.length_m)
    steps = OVER_STEPS * noise(t.binned(t.velocity), t.usable)
    return max(SLOW_MPS, min(froude, SLOW_MOST_MPS), steps)


def find_under_way(t: Track) -> UnderWay | None:
    """At a length of window at which most of the time under way can be used; None where the ship
    hardly moves."""
    least, floor = slowest(t), math.sqrt(2.0) * OVER_NOISE * noise(t.place, t.usable)
    found = []
    for seconds in LENGTHS_S:
        w = t.windows(seconds)
        y, x = w.change(t.place), w.change(t.sailed)
        moves = np.maximum(np.abs(y), np.abs(x)) > max(floor, least * seconds)
        found.append(UnderWay(w.chosen(moves), y[moves], x[moves], least))
    lasts = [len(one.by_position) * one.windows.seconds for one in found]
    for fewest in (ENOUGH, FEWEST):
        for one, last in zip(found, lasts, strict=True):
            if len(one.by_position) >= fewest and last >= MOST_OF_THEM * max(lasts):
                return one
    longest = [(last, i) for i, last in enumerate(lasts) if len(found[i].by_position) >= FEWEST]
    return found[max(longest)[1]] if longest else None


Sailed = tuple[np.ndarray, np.ndarray]  # X and ΔẊ [w] of a velocity


def sailed(t: Track, w: Windows, velocity: np.ndarray) -> Sailed:
    """Integral and change of a velocity over ground [n] over each window."""
    return w.change(t.integral(velocity)), w.change(t.binned(velocity))


def complex_fit(
    t: Track, w: Windows, y: np.ndarray, x: Sailed, drift: bool, arm: float
) -> Regression | None:
    """y = z X - τ ΔẊ + Δ(e^{iψ}) a + c T: z first, c last. None where that velocity is nothing."""
    if not np.any(x[0]):
        return None
    columns, prior = [x[0], 1j * x[0], x[1]], [np.inf, np.inf, DELAY_S]
    if arm > 0:
        d = w.change(t.bow)
        columns += [d, 1j * d]
        prior += [arm, arm]
    if drift:
        size = max(float(np.median(np.abs(y))), float(np.median(np.abs(x[0]))))
        current = CURRENT_SHARE * size / w.seconds
        columns += [np.full(len(y), w.seconds + 0j), np.full(len(y), 1j * w.seconds)]
        prior += [current, current]
    return regress(y, columns, w.block, prior)


def natural(fit: Regression) -> bool:
    """Whether both sides are of about one size and direction."""
    size, angle, _, _ = fit.polar()
    return abs(math.log(size)) < NATURAL and abs(angle) < NATURAL


def _spread(y: np.ndarray) -> float:
    """Of the directions of vectors, sign apart."""
    direction = np.exp(2j * np.angle(y))
    return 1.0 - float(np.abs(np.mean(direction)))


def position_and_velocity(t: Track, moved: UnderWay) -> Joined:
    """Their formulas; the velocity as it is alone, where it leaves so little that no other one
    could be said to be better."""
    w, y, x = moved.windows, moved.by_position, moved.by_velocity
    length, v = t.profile.ship.length_m, t.velocity
    arm = length * (ARM_LENGTHS if t.body or t.arm != 0 else ARM_SHARED)
    path = w.change(t.integral(np.abs(v)))
    speeds = float(np.median(np.abs(y))) / w.seconds, float(np.median(path)) / w.seconds
    spread = _spread(y if speeds[0] > 0 else x)
    as_is = complex_fit(t, w, y, (x, w.change(t.binned(t.over_ground))), t.body, arm)
    fits = {} if as_is is None else {"as it is": as_is}
    if as_is is not None and as_is.left < PERFECT and natural(as_is):
        return Joined(fits, len(y), w.seconds, spread, speeds)
    tried: dict[str, np.ndarray] = {"mirrored": t.over_ground.conj()}
    if t.body:
        tried |= {
            "heading mirrored": v * t.ahead.conj(),
            "sway mirrored": v.conj() * t.ahead,
            "heading in radians": v * np.exp(1j * RAD * t.heading),
        }
    elif t.profile.sensors.kind("velocity") == "sog_cog":
        tried["course in radians"] = np.abs(v) * np.exp(1j * RAD * np.angle(v))
    for name, velocity in tried.items():
        if fit := complex_fit(t, w, y, sailed(t, w, velocity), t.body, arm):
            fits[name] = fit
    if fit := regress(y, [np.imag(x) + 0j, 1j * np.real(x)], w.block, [np.inf] * 2):
        fits["swapped"] = fit
    return Joined(fits, len(y), w.seconds, spread, speeds)


def heading_and_way(t: Track, moved: UnderWay) -> Iterator[Joined]:
    """The way over ground of the position, and that of a velocity over ground, against
    ∫ |V| e^{iψ} dt. `by turns` is the share that the same heading leaves of a ship that goes
    ahead and astern: on two courses at right angles, one of them astern, a mirrored heading fits,
    too."""
    w, speed = moved.windows, np.abs(t.velocity)
    as_is = sailed(t, w, speed * t.ahead)
    along = np.where(np.real(t.over_ground * t.ahead.conj()) < 0.0, -speed, speed)
    by_turns = sailed(t, w, along * t.ahead)
    tried = {"as it is": as_is, "mirrored": sailed(t, w, speed * t.ahead.conj())}
    radians: Sailed | None = None
    for way in (moved.by_position,) if t.body else (moved.by_position, moved.by_velocity):
        fits, extra = {}, {}
        for name, x in tried.items():
            if fit := complex_fit(t, w, way, x, False, 0.0):
                fits[name] = fit
        if "as it is" in fits and fits["as it is"].left > PERFECT:
            radians = radians or sailed(t, w, speed * np.exp(1j * RAD * t.heading))
            if fit := complex_fit(t, w, way, radians, False, 0.0):
                fits["in radians"] = fit
        if drifting := complex_fit(t, w, way, as_is, True, 0.0):
            current = float(np.hypot(*drifting.theta[-2:]))
            _, angle, _, half = drifting.polar()
            extra = {"drifting": drifting.left, "current": current, "angle": angle, "half": half}
        if either := complex_fit(t, w, way, by_turns, False, 0.0):
            extra["by turns"] = either.left
        yield Joined(fits, len(way), w.seconds, _spread(way), extra=extra)


def bend(t: Track, moved: UnderWay, turned_by: np.ndarray) -> tuple[float, float, float] | None:
    """k of Δ arg Δp = k Δψ with its 90 % interval, where the two go together; turned_by [B] rad:
    the heading, or the integral of the yaw rate."""
    w, y, x = moved.windows, moved.by_position, moved.by_velocity
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
    if abs(np.mean(y[turns])) > np.std(y[turns]):
        # all turn to one side, about as fast: of these alone a ratio is as well an offset
        turns = np.ones(len(y), bool)
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
    """Whether `lag` found a delay, and one that no fit looks for. A swing of one period turned
    round looks like half a period late: what is alike with another sign is not late."""
    apart = 1.0 - abs(now) > LESS_ALIKE * (1.0 - then)
    return abs(late) > FIT_LAG_S and then > ALIKE and apart


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
