"""Log evidence of a hypothesis about a trial: algebra on the products of a point.

The base hypothesis holds the nominal numbers, the causes that are included, free, and the change
of weights of its remainder.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis.linear.parameter_layout import HELD_INFORMATION
from shiplog.diagnosis.noise import bounds
from shiplog.diagnosis.noise.campaign_parts import robust_weights, squares
from shiplog.diagnosis.noise.remainder import Remainder, noise_prior
from shiplog.diagnosis.trial.fitted import ExpectedEvidence, Found, Level, Point
from shiplog.diagnosis.trial.trial import Numbers, Trial
from shiplog.models.causes import Cause

NOISES = (0.5, 0.7, 0.85, 1.0, 1.2, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 16.0)  # times the nominal
FINE_STEP = 1.08  # step about the best of them
LITTLE_NATS = 1.0  # gain of a step, too small to decide between hypotheses
MOST_PATHS = 8  # of the model as it stands, one closer to the measurement than the other, at most
NO_CHANGE_OF_NOISE = Remainder()


def begin(trial: Trial, numbers: Numbers) -> tuple[Trial, Point]:
    """The trial with weights of its segments, and the model as it stands, its path held as firmly
    as the process noise then found allows, and linearised again until the evidence stays: causes
    must not gain by a path that converges with them. Segments on which the model diverges carry no
    information. Raises np.linalg.LinAlgError where it diverges on all."""
    first = trial.at(numbers)
    trial = replace(trial.leaving_out(first.linear.lost), first=first)
    trial = replace(trial, weight=robust(trial, first))
    point, last = first, -np.inf
    for _ in range(MOST_PATHS):
        base, _ = scan(trial, point, (), trial.fixed)
        if abs(base.evidence - last) < LITTLE_NATS:
            break
        point, last = trial.at(numbers, point, base.noise_factor), base.evidence
    trial = trial.leaving_out(point.linear.lost)
    if not trial.weight.any():  # a prior without data would name nothing, as if nothing had changed
        raise np.linalg.LinAlgError("the model diverges on every segment of the trial")
    return replace(trial, begun=True), point


def robust(trial: Trial, point: Point) -> np.ndarray:
    """Weights [S] of the segments, the same for every hypothesis: a few must not decide."""
    best = max(levels(trial, point), key=lambda one: one.value)
    none = np.zeros(trial.unseen.count)
    unit = np.append(trial.reference.columns.unit, none)
    d = np.append(best.solution[: len(trial.reference.pull)], none)
    modes, noise = trial.products.modes(point, best.noise_factor, NO_CHANGE_OF_NOISE)
    return robust_weights(squares(modes, d * unit, noise), trial.weight > 0.0)


def level(
    trial: Trial, point: Point, noise: float, included: Sequence[str] = (),
    remainder: Remainder = NO_CHANGE_OF_NOISE,
) -> Level:  # fmt: skip
    """The base hypothesis at one level of process noise."""
    assert trial.first is not None
    total, _ = trial.products.total(point, noise, trial.weight, remainder)
    volume = trial.products.volume(trial.first, noise, trial.weight, remainder)
    found = solve(trial, total, volume, noise, point, included, remainder)
    value = found.value + noise_prior(noise, trial.nominal_spread, remainder)
    share = _within(trial, found, point, included)
    return replace(found, value=value + share, share=share)


def solve(
    trial: Trial, total: np.ndarray, volume: float, noise: float, point: Point,
    included: Sequence[str], remainder: Remainder,
) -> Level:  # fmt: skip
    """The base hypothesis of a trial's products [1 + C, 1 + C], its level of noise as likely as any
    other. The reference says for how much of itself the trial counts."""
    ref = trial.reference
    columns, information, pull = ref.columns, ref.information, ref.pull
    total, volume = ref.counts * total, ref.counts * volume
    extra = [columns.of[name] for name in included]
    family = trial.families.get(remainder.kind, np.zeros(0, int))
    held = [np.full(len(c), HELD_INFORMATION if n in trial.fixed else 1.0)
            for n, c in zip(included, extra, strict=True)]  # fmt: skip
    held.append(np.full(len(family), remainder.size**-2.0))
    own = np.concatenate(held)
    count = len(pull)
    chosen = np.concatenate((np.arange(count), *extra, family)).astype(int)
    gram = total[np.ix_(np.append(0, 1 + chosen), np.append(0, 1 + chosen))]
    known = np.zeros((len(chosen), len(chosen)))
    known[:count, :count] = information
    known[count:, count:] = np.diag(own)
    # the included numbers are counted from where they were linearised
    before = [
        np.zeros(len(c)) if n in trial.fixed
        else -np.asarray(point.numbers.get(n, np.zeros(len(c)))) / columns.unit[c]
        for n, c in zip(included, extra, strict=True)
    ]  # fmt: skip
    towards = np.concatenate((pull, *(k * b for k, b in zip(held, before, strict=False)),
                              np.zeros(len(family))))  # fmt: skip
    both = gram[1:, 1:] + known
    inverse = np.linalg.inv(both)
    solution = inverse @ (gram[1:, 0] + towards)
    of_prior = float(towards[:count] @ ref.mean + (towards[count:] ** 2 / own).sum())
    square = gram[0, 0] + of_prior - (gram[1:, 0] + towards) @ solution
    gained = np.linalg.slogdet(both)[1] - (ref.information_volume + float(np.log(own).sum()))
    value = -0.5 * float(square + gained + volume)
    return Level(noise, gram, inverse, solution, value)


def levels(
    trial: Trial, point: Point, included: Sequence[str] = (), near: float | None = None,
    remainder: Remainder = NO_CHANGE_OF_NOISE,
) -> list[Level]:  # fmt: skip
    """From the nominal process noise outwards while it gets likelier; finely about the best.
    `near`: about there only."""
    tried: dict[float, Level] = {}

    def at(noise: float) -> float:
        if noise not in tried:
            tried[noise] = level(trial, point, noise, included, remainder)
        return tried[noise].value

    if near is None:
        middle = NOISES.index(1.0)
        best = middle
        for way in (1, -1):
            i = middle
            while 0 <= i + way < len(NOISES) and at(NOISES[i + way]) > at(NOISES[i]):
                i += way
            if at(NOISES[i]) > at(NOISES[best]):
                best = i
            if best != middle:
                break
        here = NOISES[best]
    else:
        here = near
    below, middle_value, above = at(here / FINE_STEP), at(here), at(here * FINE_STEP)
    bend = below - 2.0 * middle_value + above
    top = float(np.clip(0.5 * (below - above) / bend, -3.0, 3.0)) if bend < 0.0 else 0.0
    if abs(top) > 1.0:  # of the parabola through them, and beyond them
        at(here * FINE_STEP**top)
    return list(tried.values())


def scan(
    trial: Trial, point: Point, candidates: Sequence[Cause], included: Sequence[str] = (),
    near: float | None = None, remainder: Remainder = NO_CHANGE_OF_NOISE,
) -> tuple[Found, list[Found]]:  # fmt: skip
    """The base hypothesis, and each candidate in addition to it, each at its own best level."""
    tried = levels(trial, point, included, near, remainder)
    best = max(tried, key=lambda one: one.value)
    found = []  # a cause that explains makes the process noise fall: each level is tried
    for cause in candidates:
        each = [_with(trial, one, cause.label) for one in tried]
        found.append(max(each, key=lambda f: f.evidence))
    moved = [replace(f, evidence=f.evidence - best.value) for f in found]
    return _found(trial, best, point, included), sorted(moved, key=lambda f: -f.evidence)


def fit(
    trial: Trial, point: Point, included: Sequence[str], noise: float, remainder: Remainder
) -> Found:
    """The base hypothesis at one level of process noise."""
    return _found(trial, level(trial, point, noise, included, remainder), point, included)


def _found(trial: Trial, one: Level, point: Point, included: Sequence[str]) -> Found:
    numbers, covariance = numbers_of(trial, one, point, included)
    density = one.value - one.share - _gained(trial, one, included)
    return Found("nothing", one.value, one.noise_factor, numbers, covariance, density=density)


def _gained(trial: Trial, one: Level, included: Sequence[str]) -> float:
    """Log evidence less the log density of the numbers that the point was linearised at."""
    columns, first = trial.reference.columns, len(trial.reference.pull)
    own = slice(first, first + sum(len(columns.of[n]) for n in included))
    step, spread = one.solution[own], one.inverse[own, own]
    return 0.5 * float(step @ np.linalg.solve(spread, step) + np.linalg.slogdet(spread)[1])


def _with(trial: Trial, one: Level, label: str) -> Found:
    """One cause more, its change from the nominal with a prior of its size."""
    columns = trial.reference.columns.of[label]
    joined = one.gram[1:, 1:][:, columns]
    pull = one.gram[1:, 0][columns] - joined.T @ one.solution
    own = joined[columns] - joined.T @ one.inverse @ joined + np.eye(len(columns))
    value = np.linalg.solve(own, pull)
    cost = 0.5 * float(np.linalg.slogdet(own)[1])
    gained = 0.5 * float(pull @ value) - cost
    unit = trial.reference.columns.unit[columns]
    left = np.linalg.inv(own)
    low, high = (bound / unit for bound in trial.bounds(label))
    gained += bounds.log_share(value, _deviation(left), np.ones(len(unit)), low, high)
    farthest = trial.farthest(label) * unit[0] / unit[-1]
    if math.isfinite(farthest):
        gained += bounds.log_on_board(value, left, np.ones(len(unit)), farthest)
        value = bounds.on_board(value, left, farthest)
    value = bounds.within(value, left, low, high)
    information = own - np.eye(len(columns))
    shrunk = information @ left
    expected = ExpectedEvidence(
        np.diagonal(shrunk @ information).copy(), cost - 0.5 * float(np.trace(shrunk))
    )
    return Found(
        label, one.value + gained, one.noise_factor, {label: value * unit},
        left * np.outer(unit, unit), expected,
    )  # fmt: skip


def numbers_of(
    trial: Trial, one: Level, point: Point, included: Sequence[str]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Numbers of the included causes within their bounds, and covariance."""
    mean, covariance = _free(trial, one, point, included)
    if not included:
        return {}, covariance
    limits = [trial.bounds(name) for name in included]
    low, high = (np.concatenate(of) for of in zip(*limits, strict=True))
    ends = np.cumsum([len(of) for of, _ in limits])[:-1]
    if np.isfinite(covariance).all():
        for name, at in zip(included, (0, *ends), strict=True):
            if math.isfinite(trial.farthest(name)):
                mean = bounds.on_board(mean, covariance, trial.farthest(name), int(at))
    found = bounds.within(mean, covariance, low, high)
    return dict(zip(included, np.split(found, ends), strict=True)), covariance


def _free(
    trial: Trial, one: Level, point: Point, included: Sequence[str]
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers [Q] of the included causes and their covariance, were they without bounds; a
    family's weights come after them."""
    columns = trial.reference.columns
    none = np.zeros(0)
    unit = np.concatenate([none, *(columns.unit[columns.of[name]] for name in included)])
    stood = [point.numbers.get(name, np.zeros(len(columns.of[name]))) for name in included]
    first = len(trial.reference.pull)
    own = slice(first, first + len(unit))
    mean = np.concatenate([none, *stood]) + one.solution[own] * unit
    return mean, one.inverse[own, own] * np.outer(unit, unit)


def _deviation(covariance: np.ndarray) -> np.ndarray:
    """[Q] standard deviations. Rounding may leave a variance of nearly known numbers below zero:
    these count as known."""
    return np.sqrt(np.maximum(np.diagonal(covariance), 1e-30))


def _within(trial: Trial, one: Level, point: Point, included: Sequence[str]) -> float:
    """What the causes' bounds add to the log evidence; of the model's own causes nothing."""
    columns, at, share = trial.reference.columns, 0, 0.0
    if set(included) <= set(trial.fixed):
        return share
    mean, covariance = _free(trial, one, point, included)
    deviation = _deviation(covariance)
    for name in included:
        size = columns.unit[columns.of[name]]
        own, at = slice(at, at + len(size)), at + len(size)
        if name not in trial.fixed:
            share += bounds.log_share(mean[own], deviation[own], size, *trial.bounds(name))
            if math.isfinite(trial.farthest(name)) and np.isfinite(deviation[own]).all():
                share += bounds.log_on_board(
                    mean[own], covariance[own, own], size, trial.farthest(name)
                )
    return share
