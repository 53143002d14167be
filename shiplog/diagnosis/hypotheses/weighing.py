"""One set of causes under every kind of remainder, linearised where it is most probable.

Under each kind the score (15) is the largest over λ and over what the kind leaves free:

    nominal        log Z(λ) + log p(λ), λ about 1
    raised         the same with a wide prior of λ; or with a factor in each channel of its own
    intermittent   log Z(λ, force) instead of raised noise
    family         log Z + log Bayes factor of a change of its weights w ~ N(0, σ² I) (12)
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import evidence, unrecorded_thruster
from shiplog.diagnosis.hypotheses.evaluate import resume
from shiplog.diagnosis.hypotheses.hypothesis import Hypothesis
from shiplog.diagnosis.hypotheses.intermittent import ResidualNoise
from shiplog.diagnosis.hypotheses.table import Scale
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import NOMINAL, RAISED, Remainder, noise_prior
from shiplog.diagnosis.trial.fitted import Estimate, Fit, Level, Point, Start
from shiplog.diagnosis.trial.trial import Trial

SEARCH_NATS = 10.0  # nats behind the best, beyond which a hypothesis is not worth a linearisation
TIE_NATS = 3.0  # nats behind the best, e³ = 20 to 1, up to which a change is fitted to its end
FAILED_NATS = 50.0  # nats below nothing, at which a fit has failed: without effect it loses a few
# Times the nominal process noise, from which a factor for each channel, and an intermittent force,
# are tested
RAISED_FROM = 1.2
RAISING = Remainder(RAISED)
NOISE_ROUNDS = 2  # of fitting noise and numbers in turn
FORCE_ROUNDS = 6  # of fitting an intermittent force and numbers in turn, at most
FORCE_NATS = 2.0  # gained by a round, that do not decide between hypotheses
LEFT_NATS = 300.0  # behind raised noise, that further rounds do not make up for


@dataclass(frozen=True)
class CauseSet:
    """A set of causes to be weighed, and what the sets before it are a seed of.

    labels        of its causes
    noise         estimates of noise from a residual
    scale         of the scores
    best          score of the most probable hypothesis so far
    nothing       log evidence of no cause; None where it is that set
    raised        the most probable hypothesis so far with raised process noise
    intermittent  the same with an intermittent force
    no_force      whether the causes of `raised` were found to have no such force
    spectrum      whether a change of a family has to explain some of raised noise
    """

    trial: Trial
    labels: tuple[str, ...]
    noise: ResidualNoise
    scale: Scale
    nothing: float | None = None
    raised: Hypothesis | None = None
    intermittent: Hypothesis | None = None
    no_force: bool = False
    spectrum: bool = True
    best: float = -math.inf

    @property
    def included(self) -> tuple[str, ...]:
        """Labels that a fit includes; causes of the model itself keep their numbers."""
        return (*self.trial.fixed, *self.labels)

    def fit(self, fit: Fit, remainder: Remainder, anew: bool = False) -> Fit:
        """These causes with another remainder, from the numbers and path of a fit."""
        start = Start(fit.estimate.numbers, fit.point.path, bend=fit.estimate.bend)
        return resume(self.trial, self.included, remainder, start, anew=anew)

    def hypothesis(self, fit: Fit, force: SideForce | None = None) -> Hypothesis:
        """A fit of them with its score."""
        return self.scale.hypothesis(self.labels, fit.estimate.evidence, fit, force)

    def explains_more(self, raised: float) -> bool:
        """Whether the set explains something that the best one with raised noise does not, by its
        score with that one's noise. Otherwise its residual is the same, and so is what is estimated
        from that."""
        return self.raised is None or raised > self.raised.score


@dataclass(frozen=True)
class Rough:
    """A set of causes with raised process noise: where it is linearised, and its levels there."""

    of: CauseSet
    point: Point
    remainder: Remainder
    levels: list[Level]

    @cached_property
    def best(self) -> Level:
        return evidence.top(self.levels)

    @property
    def raises(self) -> bool:
        """Whether the process noise is raised by enough to ask what raised it."""
        return self.best.noise_factor > RAISED_FROM

    @property
    def observations(self) -> float:
        """How many independent values the process noise was estimated from: the curvature of the
        log evidence over the logarithm of the noise is twice that."""
        top, apart = math.log(self.best.noise_factor), 0.5 * math.log(evidence.FINE_STEP)
        at = {math.log(one.noise_factor) - top: one.value for one in self.levels}
        near = [0.0]  # and those nearest to it; a level may have been computed twice, but for
        for noise in sorted(at, key=abs):  # rounding
            if min(abs(noise - other) for other in near) > apart:
                near.append(noise)
        if len(near) < 3:
            return 0.0
        parabola = np.polyfit(near[:3], [at[noise] for noise in near[:3]], 2)
        return max(-float(parabola[0]), 0.0)

    def spectrum(self) -> float:
        """Nats that a family gains where it explains the share `SPECTRUM` of the raised noise:
        -½ n log(1 - SPECTRUM (1 - λ⁻²)) of n observations."""
        factor = self.remainder.overall(self.best.noise_factor)
        share = thresholds.SPECTRUM * max(1.0 - factor**-2.0, 0.0)
        return -0.5 * self.observations * math.log1p(-share)

    def fit(self, level: Level, remainder: Remainder | None = None) -> Fit:
        """The set at one of its levels, under this remainder or another one of the same noise."""
        numbers = evidence.numbers_of(self.of.trial, level, self.point, self.of.included)
        name, noise = "+".join(self.of.labels), level.noise_factor
        found = Estimate(name, level.value, noise, *numbers, bend=level.bend)
        return Fit(self.point, found, remainder or self.remainder)


@dataclass(frozen=True)
class Change:
    """A change of one family's weights: where it is linearised, with what evidence, at what process
    noise."""

    point: Point
    remainder: Remainder
    value: float
    noise: float


def weigh_plain(plain: Rough) -> list[Hypothesis]:
    """A set with nominal process noise, and with one factor for all channels."""
    of = plain.of
    nominal = plain.fit(best(of.trial, plain.levels, NOMINAL), Remainder())
    return [of.hypothesis(nominal), of.hypothesis(plain.fit(plain.best))]


def weigh_remainders(plain: Rough) -> list[Hypothesis]:
    """A set with each other kind of remainder, and with noise raised in each channel by itself."""
    of = plain.of
    nominal, _ = weigh_plain(plain)
    rough = shape(plain)
    raised = of.hypothesis(rough.fit(rough.best))
    weighed = [raised]
    if plain.raises:
        force = _add_force(of, raised)
        weighed += [force] if force is not None else []
    alone = max((nominal, *weighed), key=lambda h: h.score)
    return [*weighed, *_add_families(of, plain, rough, alone)]


def plain_fit(of: CauseSet, numbers: Mapping[str, np.ndarray], at: Point) -> Rough | None:
    """The set under one factor λ of all channels, with levels about the most probable λ under
    `raised` and under `nominal`; None where its fit diverges.

    numbers   of the causes, with those of the model's own, to start from
    at        a point whose path is to start from; of no cause the point itself
    """
    trial, included, point, near = of.trial, of.included, at, 1.0
    if of.labels:
        assert of.nothing is not None
        start = Start(numbers, at.path)
        fit = resume(trial, included, RAISING, start, of.nothing - FAILED_NATS)
        if fit.diverged:
            return None
        point, near = fit.point, fit.estimate.noise_factor
    levels = evidence.levels(trial, point, included, near, RAISING)
    if near > RAISED_FROM:  # the noise may be nominal again
        levels.append(evidence.level(trial, point, 1.0, included, RAISING))
    nominal = best(trial, levels, NOMINAL).noise_factor
    if not evidence.enclosed(levels, nominal):  # its prior favours the nominal noise
        levels += nominal_levels(trial, point, included, nominal)
    return Rough(of, point, RAISING, levels)


def weigh_as(
    of: CauseSet, one: Hypothesis, fit: Fit, before: Hypothesis | None
) -> Hypothesis | None:
    """These causes, some of another hypothesis, with the noise of that one, where it has a shape of
    its own; None where they are not more probable with it than `before`."""
    if not one.remainder.shaped:
        return None
    numbers = {name: fit.estimate.numbers[name] for name in of.included}
    start = replace(fit, estimate=replace(fit.estimate, numbers=numbers))
    again = of.fit(start, one.remainder, anew=True)
    least = -math.inf if before is None else before.evidence + evidence.LITTLE_NATS
    if again.diverged or again.estimate.evidence < least:
        return None
    force = one.side_force
    return of.hypothesis(again, None if force is None else of.noise.add_pattern(again, force))


def shape(plain: Rough) -> Rough:
    """Raised noise with a factor of its own in each channel, where that is more probable than one
    for all. Factors and numbers are fitted in turn: each is off where the other one is. They start
    from the factors that were most probable so far, and stay there where it explains no more."""
    if not plain.raises:
        return plain
    of, fit = plain.of, plain.fit(plain.best)
    before, rounds = of.raised, NOISE_ROUNDS
    if before is not None and before.remainder.shaped:
        fit = of.fit(fit, before.remainder)
        score = of.scale.score(fit.estimate.evidence, of.labels, RAISED)
        rounds = 1 if of.explains_more(score) else 0
    for _ in range(rounds):
        if not fit.diverged:
            fit = of.fit(fit, of.noise.raised(fit))
    if fit.diverged:
        return plain
    levels = evidence.levels(
        of.trial, fit.point, of.included, fit.estimate.noise_factor, fit.remainder
    )  # fmt: skip
    shaped = Rough(of, fit.point, fit.remainder, levels)
    return shaped if shaped.best.value > plain.best.value else plain


def nominal_levels(
    trial: Trial, point: Point, included: Sequence[str], nominal: float
) -> list[Level]:
    """Levels about the best one under `nominal`, with their values under `raised`."""
    levels = evidence.levels(trial, point, included, nominal)
    return [
        replace(one, value=one.value + raised_over_nominal(trial, one.noise_factor))
        for one in levels
    ]  # fmt: skip


def best(trial: Trial, levels: Sequence[Level], kind: str) -> Level:
    """Of levels made under `raised` the best under a kind of remainder."""
    if kind != RAISED:
        levels = [
            replace(one, value=one.value - raised_over_nominal(trial, one.noise_factor))
            for one in levels
        ]  # fmt: skip
    return evidence.top(levels)


def raised_over_nominal(trial: Trial, noise: float) -> float:
    """log p(λ | raised) - log p(λ | nominal)."""
    nominal = trial.nominal_spread
    return noise_prior(noise, nominal, RAISING) - noise_prior(noise, nominal, Remainder())


# --- families of the discrepancy


def change(plain: Rough, rough: Rough, family: str) -> Change:
    """A change of one family's weights together with included causes, at its best size and noise.

    The noise may be raised as well, since no family describes an unknown force exactly: in the
    most probable way, `rough`. The family counts only if it is more probable with nominal noise
    than noise alone that is raised by one factor; otherwise its functions are a fit to noise. Nor
    does it count where it explains little of raised noise: that is an error of the spectrum.
    """
    trial, included = plain.of.trial, plain.of.included

    def tried(of: Rough) -> list[tuple[float, float, float]]:
        """Log evidence, size of the change, λ at each level, which are made under `raised`."""
        found = []
        for level in of.levels:
            gained, size = evidence.family_change(
                trial, of.point, level, included, family, of.remainder
            )
            found.append((level.value + gained, size, level.noise_factor))
        return found

    nominal = _top([(v - raised_over_nominal(trial, n), size, n) for v, size, n in tried(plain)])
    noisy = nominal[0] > plain.best.value
    value, size, noise = _top(tried(rough)) if noisy else nominal
    least = rough.spectrum() if plain.of.spectrum else 0.0
    if plain.raises and value - rough.best.value < least:
        value = -math.inf
    if not noisy:
        return Change(plain.point, Remainder(family, size), value, noise)
    remainder = replace(rough.remainder, kind=family, size=size, noisy=True)
    return Change(rough.point, remainder, value, noise)


def _top(found: Sequence[tuple[float, float, float]]) -> tuple[float, float, float]:
    """Of log evidence, size and λ at each level the best, its evidence at the parabola's top."""
    values, sizes, noises = zip(*found, strict=True)
    best, gain, _ = evidence.top_of(noises, values)
    return values[best] + gain, sizes[best], noises[best]


def _add_families(
    of: CauseSet, plain: Rough, rough: Rough, alone: Hypothesis
) -> Iterator[Hypothesis]:  # fmt: skip
    """The set together with a change of each family; `alone` is its best hypothesis without."""
    changes = [change(plain, rough, family) for family in of.trial.families]
    scores = [of.scale.score(c.value, of.labels, c.remainder.kind) for c in changes]
    near = max((alone.score, of.best - TIE_NATS, *(score - SEARCH_NATS for score in scores)))
    for one, score in zip(changes, scores, strict=True):
        yield _add_change(of, one, alone, score >= near)


def _add_change(of: CauseSet, one: Change, alone: Hypothesis, leads: bool) -> Hypothesis:
    """The set together with a change of one family; linearised again if that is promising."""
    if not leads:  # far behind: its numbers are never asked for
        found = replace(alone.estimate, evidence=one.value)
        return of.hypothesis(Fit(one.point, found, one.remainder))
    here, _ = evidence.scan(of.trial, one.point, (), of.included, one.noise, one.remainder)
    there = Fit(one.point, here, one.remainder)
    if of.labels:
        again = of.fit(there, one.remainder)
        if not again.diverged and again.estimate.evidence > one.value:
            return of.hypothesis(again)
    return of.scale.hypothesis(of.labels, max(one.value, here.evidence), there)


# --- an intermittent force


def _add_force(of: CauseSet, raised: Hypothesis) -> Hypothesis | None:
    """An intermittent side force instead of raised process noise, with the causes fitted together
    with it: fitted to raised noise alone they would make up for it. Less probable than noise that
    is raised in each channel by itself it is that noise, and is not counted twice. Nor is a set
    asked that is far behind another one with raised noise, or that explains no more than one that
    has no such force."""
    if of.raised is not None and raised.score < of.raised.score - SEARCH_NATS:
        return None
    if of.no_force and not of.explains_more(raised.score):
        return None
    found = _fitted_with_force(of, raised)
    if found is None:
        return None
    fit, force = found
    if force.gain <= 0.0 or fit.estimate.evidence <= raised.evidence:
        return None
    return of.hypothesis(fit, of.noise.add_pattern(fit, force))


def _fitted_with_force(of: CauseSet, raised: Hypothesis) -> tuple[Fit, SideForce] | None:
    """An intermittent force and the numbers of a set, fitted in turn until the evidence stays. They
    begin with the most probable force so far, or with raised noise. Its gain is that of the last
    estimate next to these numbers. None where the fit diverges."""
    assert isinstance(raised.point, Point)
    fit = Fit(raised.point, raised.estimate, raised.remainder)
    given = None if of.intermittent is None else of.intermittent.side_force
    best: tuple[Fit, SideForce] | None = None
    if given is not None:
        fit = of.fit(fit, given.remainder)
        best = None if fit.diverged else (fit, given)
    steps: list[unrecorded_thruster.Step] = []
    gain = 0.0
    for _ in range(FORCE_ROUNDS):
        if fit.diverged:  # nor is there anything left of it that a force could explain
            break
        tried = of.noise.side_force(fit)
        gain = tried.gain
        steps = [] if given is None else [*steps[-1:], (given, tried)]
        given = tried if len(steps) < 2 else unrecorded_thruster.extrapolated(*steps)
        last, fit = fit, of.fit(fit, given.remainder)
        if (
            given is not tried and fit.estimate.evidence < last.estimate.evidence
        ):  # they led too far
            given, steps = tried, []
            fit = of.fit(last, given.remainder)
        reached = -math.inf if best is None else best[0].estimate.evidence
        if fit.diverged or fit.estimate.evidence <= reached:
            break
        best = fit, given
        if fit.estimate.evidence < max(reached + FORCE_NATS, raised.evidence - LEFT_NATS):
            break
    return None if best is None else (best[0], replace(best[1], gain=gain))
