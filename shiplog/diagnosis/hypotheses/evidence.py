"""Evidence and posterior of a hypothesis at one point: equations (6) to (13) of this room.

The base hypothesis of a point holds the nominal numbers, the causes that are included, free, and
the change of weights of its remainder's family. A candidate is one cause in addition to it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.linear.parameter_layout import HELD_INFORMATION
from shiplog.diagnosis.noise import bounds
from shiplog.diagnosis.noise.remainder import CHANGE_SIZES, Remainder, noise_prior
from shiplog.diagnosis.nominal.voyage_effects import inverse_and_volume
from shiplog.diagnosis.trial.fitted import Estimate, ExpectedEvidence, Level, Point
from shiplog.diagnosis.trial.trial import Trial
from shiplog.models.causes import Cause

FINE_STEP = 1.08  # of λ: its levels are whole powers of it, on one grid for all hypotheses
FARTHEST = 45  # steps from the nominal noise, at most: λ of 1/32 to 32
NEWTON_STEPS = 3  # to the top of a curve that is nearly a parabola
LONGEST = 18  # steps at once, at most: four times as much noise, or a quarter
MOST_MOVES = 8  # of three levels to others, at most
LITTLE_NATS = 1.0  # gain of a step, too small to decide between hypotheses
NO_CHANGE_OF_NOISE = Remainder()


# --- one factor of the process noise


def level(
    trial: Trial, point: Point, noise: float, included: Sequence[str] = (),
    remainder: Remainder = NO_CHANGE_OF_NOISE,
) -> Level:  # fmt: skip
    """The base hypothesis at one factor λ = `noise` of the process noise.

    Its value is log Z (3) + log p(λ) + the share of the bounds (13)."""
    assert trial.first is not None
    G = trial.products.total(point, noise, trial.weight, remainder).G
    log_R = trial.products.volume(trial.first, noise, trial.weight, remainder)
    one = solve(trial, G, log_R, noise, point, included, remainder)
    log_Z = one.value + noise_prior(noise, trial.nominal_spread, remainder)
    share = _log_share_of_bounds(trial, one, point, included)
    return replace(one, value=log_Z + share, share=share)


def solve(
    trial: Trial, G: np.ndarray, log_R: float, noise: float, point: Point,
    included: Sequence[str], remainder: Remainder,
) -> Level:  # fmt: skip
    """Posterior (7) and evidence (3) of the base hypothesis, every λ as likely as any other.

        A = P⁻¹ + c Hᵀ R⁻¹ H,   b = P⁻¹ μ + c Hᵀ R⁻¹ r
        log Z = -½ (c rᵀ R⁻¹ r + μᵀ P⁻¹ μ - bᵀ A⁻¹ b + log|A| - log|P⁻¹| + c log|R|)

    G      [1 + C, 1 + C]  [r J]ᵀ R⁻¹ [r J] over all C columns of the trial; H are N of them
    log_R  log|R|
    noise  λ, of which G and log|R| are

    Raises np.linalg.LinAlgError where A is not positive definite.
    """
    c = trial.reference.counts
    chosen = np.append(0, 1 + columns_of(trial, included, remainder))
    G = (c * G)[np.ix_(chosen, chosen)]
    prior = _prior(trial, point, included, remainder)
    A, b = G[1:, 1:] + prior.P_inv, G[1:, 0] + prior.P_inv_mu
    A_inv, log_A = inverse_and_volume(A)
    mean = A_inv @ b
    square = G[0, 0] + prior.square - b @ mean
    log_S = log_A - prior.log_P_inv
    return Level(noise, G, A_inv, mean, -0.5 * float(square + log_S + c * log_R))


@dataclass(frozen=True)
class _Prior:
    """θ ~ N(μ, P) of a base hypothesis (1).

    P_inv      [N, N]  P⁻¹
    P_inv_mu   [N]     P⁻¹ μ
    square     μᵀ P⁻¹ μ
    log_P_inv  log|P⁻¹|
    """

    P_inv: np.ndarray
    P_inv_mu: np.ndarray
    square: float
    log_P_inv: float


def _prior(
    trial: Trial, point: Point, included: Sequence[str], remainder: Remainder
) -> _Prior:  # fmt: skip
    """Of nominal numbers the posterior of the campaign; of a cause N(-θ₀, I), since its numbers θ
    are counted from the point, where they are θ₀; of a family's weights N(0, size² I). The model's
    own causes are held."""
    ref, unit = trial.reference, trial.reference.columns.unit
    columns = [ref.columns.indices[name] for name in included]
    family = trial.families.get(remainder.kind, np.zeros(0, int))
    precisions = [
        np.full(len(of), HELD_INFORMATION if name in trial.fixed else 1.0)
        for name, of in zip(included, columns, strict=True)
    ]
    precisions.append(np.full(len(family), remainder.size**-2.0))
    precision, nominal = np.concatenate(precisions), len(ref.pull)
    N = nominal + len(precision)
    P_inv = np.zeros((N, N))
    P_inv[:nominal, :nominal] = ref.information
    P_inv[nominal:, nominal:] = np.diag(precision)
    mu = [
        np.zeros(len(of)) if name in trial.fixed
        else -np.asarray(point.numbers.get(name, np.zeros(len(of)))) / unit[of]
        for name, of in zip(included, columns, strict=True)
    ]  # fmt: skip
    P_inv_mu = np.concatenate((
        ref.pull, *(p * m for p, m in zip(precisions, mu, strict=False)), np.zeros(len(family)),
    ))  # fmt: skip
    square = float(P_inv_mu[:nominal] @ ref.mean + (P_inv_mu[nominal:] ** 2 / precision).sum())
    return _Prior(P_inv, P_inv_mu, square, ref.information_volume + float(np.log(precision).sum()))


def columns_of(trial: Trial, included: Sequence[str], remainder: Remainder) -> np.ndarray:
    """[N] columns of H among the trial's C: all nominal numbers, causes, a family's weights."""
    ref = trial.reference
    causes = (ref.columns.indices[name] for name in included)
    family = trial.families.get(remainder.kind, np.zeros(0, int))
    return np.concatenate((np.arange(len(ref.pull)), *causes, family)).astype(int)


# --- more numbers, by a Schur complement


def candidate(trial: Trial, one: Level, label: str) -> Estimate:
    """One cause x ~ N(0, I) in addition to a base hypothesis: (10) to (12) with σ = 1, and (13).

        log Bayes factor = ½ yᵀ (M + I)⁻¹ y - ½ log|M + I|,   x | r ~ N((M + I)⁻¹ y, (M + I)⁻¹)

    To expect of x before any data are ½ |(M + I)^-½ M x|² - cost nats, with the cost
    ½ log|M + I| - ½ tr M (M + I)⁻¹.
    """
    columns = trial.reference.columns.indices[label]
    unit = trial.reference.columns.unit[columns]
    identity = np.eye(len(columns))
    B = one.G[1:, 1:][:, columns]
    y = one.G[1:, 0][columns] - B.T @ one.mean
    M_and_I = B[columns] - B.T @ one.covariance @ B + identity
    x = np.linalg.solve(M_and_I, y)
    half_log = 0.5 * float(np.linalg.slogdet(M_and_I)[1])
    nats = 0.5 * float(y @ x) - half_log
    covariance = np.linalg.inv(M_and_I)
    low, high = (bound / unit for bound in trial.bounds(label))
    nats += bounds.log_share(x, _deviations(covariance), np.ones(len(unit)), low, high)
    farthest = trial.farthest(label) * unit[0] / unit[-1]
    if math.isfinite(farthest):
        nats += bounds.log_share_on_board(x, covariance, np.ones(len(unit)), farthest)
        x = bounds.mode_on_board(x, covariance, farthest)
    x = bounds.bounded_mode(x, covariance, low, high)
    M = M_and_I - identity
    M_shrunk = M @ covariance
    expected = ExpectedEvidence(
        np.diagonal(M_shrunk @ M).copy(), half_log - 0.5 * float(np.trace(M_shrunk))
    )
    return Estimate(
        label, one.value + nats, one.noise_factor, {label: x * unit},
        covariance * np.outer(unit, unit), expected,
    )  # fmt: skip


def family_change(
    trial: Trial, point: Point, one: Level, included: tuple[str, ...], family: str,
    remainder: Remainder,
) -> tuple[float, float]:  # fmt: skip
    """A change w ~ N(0, σ² I) of one family's weights in addition to a base hypothesis: its log
    Bayes factor (12) at the most probable σ of `CHANGE_SIZES`, and this σ.

        ½ σ² yᵀ (σ² M + I)⁻¹ y - ½ log|σ² M + I|

    one   the base hypothesis with that `remainder`
    """
    ref, c = trial.reference, trial.reference.counts
    W = 1 + trial.families[family]
    H = 1 + np.concatenate([np.arange(len(ref.pull)), *(ref.columns.indices[n] for n in included)])
    with_family = replace(remainder, kind=family)
    G = trial.products.total(point, one.noise_factor, trial.weight, with_family).G
    B = c * G[np.ix_(H, W)]
    y = c * G[W, 0] - B.T @ one.mean
    M = c * G[np.ix_(W, W)] - B.T @ one.covariance @ B
    tried = []
    for size in CHANGE_SIZES:
        inner = size**2 * M + np.eye(len(M))
        square = 0.5 * size**2 * float(y @ np.linalg.solve(inner, y))
        tried.append((square - 0.5 * float(np.linalg.slogdet(inner)[1]), size))
    return max(tried)


# --- numbers of a posterior


def numbers_of(
    trial: Trial, one: Level, point: Point, included: Sequence[str]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Label → most probable numbers [q] of each included cause within its bounds, SI, and their
    covariance [Q, Q] without bounds, from (7)."""
    mean, covariance = _unbounded(trial, one, point, included)
    if not included:
        return {}, covariance
    limits = [trial.bounds(name) for name in included]
    low, high = (np.concatenate(of) for of in zip(*limits, strict=True))
    ends = np.cumsum([len(of) for of, _ in limits])[:-1]
    if np.isfinite(covariance).all():
        for name, at in zip(included, (0, *ends), strict=True):
            if math.isfinite(trial.farthest(name)):
                mean = bounds.mode_on_board(mean, covariance, trial.farthest(name), int(at))
    mode = bounds.bounded_mode(mean, covariance, low, high)
    return dict(zip(included, np.split(mode, ends), strict=True)), covariance


def log_density(trial: Trial, one: Level, included: Sequence[str]) -> float:
    """Log density of the data and of the causes' numbers at the point itself.

        log p(r, θ₀) = log Z - ½ Δᵀ Σ⁻¹ Δ - ½ log|Σ|

    with Δ [Q] the step from the point to the posterior mean, and Σ [Q, Q] the covariance of the
    causes' numbers (7). The share of the bounds is left out."""
    columns, first = trial.reference.columns, len(trial.reference.pull)
    own = slice(first, first + sum(len(columns.indices[n]) for n in included))
    step, sigma = one.mean[own], one.covariance[own, own]
    square = step @ np.linalg.solve(sigma, step)
    return one.value - one.share - 0.5 * float(square + np.linalg.slogdet(sigma)[1])


def _unbounded(
    trial: Trial, one: Level, point: Point, included: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Posterior mean [Q] and covariance [Q, Q] of the included causes' numbers, SI (7)."""
    columns = trial.reference.columns
    none = np.zeros(0)
    unit = np.concatenate([none, *(columns.unit[columns.indices[name]] for name in included)])
    at_point = [point.numbers.get(name, np.zeros(len(columns.indices[name]))) for name in included]
    first = len(trial.reference.pull)
    own = slice(first, first + len(unit))
    mean = np.concatenate([none, *at_point]) + one.mean[own] * unit
    return mean, one.covariance[own, own] * np.outer(unit, unit)


def _deviations(covariance: np.ndarray) -> np.ndarray:
    """[Q] standard deviations. Rounding may leave a variance of nearly known numbers below zero:
    these count as known."""
    return np.sqrt(np.maximum(np.diagonal(covariance), 1e-30))


def _log_share_of_bounds(
    trial: Trial, one: Level, point: Point, included: Sequence[str]
) -> float:  # fmt: skip
    """What the bounds of the causes add to the log evidence (13); of the model's own causes
    nothing."""
    columns, at, share = trial.reference.columns, 0, 0.0
    if set(included) <= set(trial.fixed):
        return share
    mean, covariance = _unbounded(trial, one, point, included)
    deviation = _deviations(covariance)
    for name in included:
        size = columns.unit[columns.indices[name]]
        own, at = slice(at, at + len(size)), at + len(size)
        if name not in trial.fixed:
            share += bounds.log_share(mean[own], deviation[own], size, *trial.bounds(name))
            if math.isfinite(trial.farthest(name)) and np.isfinite(deviation[own]).all():
                share += bounds.log_share_on_board(
                    mean[own], covariance[own, own], size, trial.farthest(name)
                )
    return share


# --- over the factors of the process noise


def levels(
    trial: Trial, point: Point, included: Sequence[str] = (), near: float = 1.0,
    remainder: Remainder = NO_CHANGE_OF_NOISE, bend: float = 0.0,
) -> list[Level]:  # fmt: skip
    """The base hypothesis at each λ = FINE_STEPᵏ that is tried: at three, which are moved towards
    the top (`_steps_to_top`) until the best is the middle one. All hypotheses share one grid, since
    the volume of each λ is that of the first point.

    near   λ about which it begins
    bend   second difference, where it is known: two levels then give the top, if it is near"""
    tried: dict[int, Level] = {}

    def log_Z(power: int) -> float:
        if power not in tried:
            tried[power] = level(trial, point, FINE_STEP**power, included, remainder)
        return tried[power].value

    here = _power(near)
    if bend < 0.0:
        slope = log_Z(here + 1) - log_Z(here) - 0.5 * bend
        if -0.75 < -slope / bend < 1.75:
            return list(tried.values())
        here += round(_steps_to_top(slope, bend))
    for _ in range(MOST_MOVES):
        here = max(-FARTHEST, min(FARTHEST, here))
        below, at, above = (log_Z(here + way) for way in (-1, 0, 1))
        if max(below, above) <= at:
            break
        steps = _steps_to_top(0.5 * (above - below), below - 2.0 * at + above)
        here += round(steps) or round(math.copysign(1.0, steps))
    return list(tried.values())


def _steps_to_top(slope: float, bend: float) -> float:
    """Steps of FINE_STEP to the greatest log evidence, from its slope s and second difference b.

    Of n observations of a noise v(λ) = -n log λ - S/(2 λ²). At λ = 1, with h the logarithm of a
    step, s = h (S - n) and b = -2 h² S; at its greatest λ² = S/n, or log λ = -½ log(1 + 2 h s/b).
    A parabola in log λ, the same nearby, would take many steps where the noise is far greater."""
    h = math.log(FINE_STEP)
    if bend >= 0.0 or 1.0 + 2.0 * h * slope / bend <= math.exp(-2.0 * h * LONGEST):
        return math.copysign(LONGEST, slope)
    return max(-0.5 * math.log1p(2.0 * h * slope / bend) / h, -LONGEST)


def _power(noise: float) -> int:
    """k of λ = FINE_STEPᵏ, the nearest one."""
    return round(math.log(noise) / math.log(FINE_STEP))


def enclosed(tried: Sequence[Level], noise: float) -> bool:
    """Whether the levels on both sides of λ are among those that were tried."""
    powers = {_power(one.noise_factor / noise) for one in tried}
    return {-1, 1} <= powers


def top(tried: Sequence[Level], bend: float = 0.0) -> Level:
    """The best of some levels, with the value at the top of the curve in log λ through it and those
    about it (`top_of`): it is a step of FINE_STEP off at most, which may cost several nats."""
    noises, values = [one.noise_factor for one in tried], [one.value for one in tried]
    best, gain, bend = top_of(noises, values, bend)
    return replace(tried[best], value=values[best] + gain, bend=bend)


def top_of(
    noises: Sequence[float], values: Sequence[float], bend: float = 0.0
) -> tuple[int, float, float]:
    """Place of the greatest of some values, how far the top of the curve through it and its
    neighbours is above it, and the curve's second difference b.

    With neighbours v₋ and v₊ of v, x steps away, s = (v₊ - v₋)/2 and b = v₊ - 2v + v₋, the curve is

        s x + ½ b x² + c (x³ - x)/6,   c = -h b

    c is half of the third difference of many observations of a noise (`_steps_to_top`), as
    instruments hide a part of it; h is the logarithm of a step. On trials of two hours a parabola,
    c = 0, was up to 0.11 nats off a fine grid of levels, and this curve up to 0.06.
    A maximum at the end of what was tried has the curve through three levels on one side, its top a
    step further at most. With two levels b is the given `bend`."""
    best = max(range(len(values)), key=values.__getitem__)
    powers = [_power(noise / noises[best]) for noise in noises]
    at = dict(zip(powers, values, strict=True))
    value, h = values[best], math.log(FINE_STEP)
    if -1 in at and 1 in at:
        slope, bend = 0.5 * (at[1] - at[-1]), at[1] - 2.0 * value + at[-1]
    elif side := next((way for way in (-1, 1) if way in at), 0):
        if 2 * side in at:  # b is that of the level between: b(x) = b + c x
            bend = (at[2 * side] - 2.0 * at[side] + value) / (1.0 - h * side)
        slope = side * (at[side] - value - 0.5 * bend)
    else:
        return best, 0.0, bend
    if not bend < 0.0:
        return best, 0.0, bend
    skew, away = -h * bend, max(-1.0, min(1.0, -slope / bend))
    for _ in range(NEWTON_STEPS):
        rate = slope + bend * away + skew * (3.0 * away**2 - 1.0) / 6.0
        away = max(-1.0, min(1.0, away - rate / (bend + skew * away)))
    gain = slope * away + 0.5 * bend * away**2 + skew * (away**3 - away) / 6.0
    return best, max(gain, 0.0), bend


def scan(
    trial: Trial, point: Point, candidates: Sequence[Cause], included: Sequence[str] = (),
    near: float = 1.0, remainder: Remainder = NO_CHANGE_OF_NOISE, bend: float = 0.0,
) -> tuple[Estimate, list[Estimate]]:  # fmt: skip
    """The base hypothesis at its most probable λ; and each candidate in addition to it, at its
    own, with its log Bayes factor as its evidence, the greatest first. `bend` as `levels` has
    it."""
    tried = levels(trial, point, included, near, remainder, bend)
    best = top(tried, bend)
    noises = [one.noise_factor for one in tried]
    found = []  # a cause that explains makes the process noise fall: each level is tried
    for cause in candidates:
        each = [candidate(trial, one, cause.label) for one in tried]
        at, gain, _ = top_of(noises, [one.evidence for one in each], bend)
        found.append(replace(each[at], evidence=each[at].evidence + gain - best.value))
    return _estimate(trial, best, point, included), sorted(found, key=lambda one: -one.evidence)


def fit(
    trial: Trial, point: Point, included: Sequence[str], noise: float, remainder: Remainder
) -> Estimate:
    """The base hypothesis at one factor λ = `noise` of the process noise."""
    return _estimate(trial, level(trial, point, noise, included, remainder), point, included)


def _estimate(trial: Trial, one: Level, point: Point, included: Sequence[str]) -> Estimate:
    numbers, covariance = numbers_of(trial, one, point, included)
    density = log_density(trial, one, included)
    return Estimate(
        "nothing", one.value, one.noise_factor, numbers, covariance, density=density, bend=one.bend
    )
