"""One set of causes under every kind of remainder, linearised where it is most probable."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import evidence, unrecorded_thruster
from shiplog.diagnosis.hypotheses.evaluate import resume
from shiplog.diagnosis.hypotheses.hypothesis import Hypothesis
from shiplog.diagnosis.hypotheses.table import Hypotheses
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED, Remainder, noise_prior
from shiplog.diagnosis.trial.fitted import Fit, Found, Level, Point, Start
from shiplog.diagnosis.trial.trial import Trial

SEARCH_NATS = 10.0  # nats behind the best, beyond which a hypothesis is not worth a linearisation
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
class Rough:
    """A set of causes with raised process noise: where it is linearised, and its levels there."""

    point: Point
    remainder: Remainder
    levels: list[Level]

    @property
    def best(self) -> Level:
        return max(self.levels, key=lambda level: level.value)

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
        """Nats that a family gains where it explains the share `SPECTRUM` of the raised noise."""
        factor = self.remainder.overall(self.best.noise_factor)
        share = thresholds.SPECTRUM * max(1.0 - factor**-2.0, 0.0)
        return -0.5 * self.observations * math.log1p(-share)

    def fit(self, trial: Trial, labels: Sequence[str], included: Sequence[str], one: Level) -> Fit:
        """The set at one of its levels."""
        numbers = evidence.numbers_of(trial, one, self.point, included)
        found = Found("+".join(labels), one.value, one.noise_factor, *numbers)
        return Fit(self.point, found, self.remainder)


@dataclass(frozen=True)
class Change:
    """A change of one family's weights: where it is linearised, with what evidence, at what process
    noise."""

    point: Point
    remainder: Remainder
    value: float
    noise: float


def weigh(
    table: Hypotheses, labels: tuple[str, ...], numbers: Mapping[str, np.ndarray], at: Point
) -> None:
    """Put the hypotheses of these causes into the table; none, where their fit diverges.

    numbers   of the causes, to start from; at: a point whose path is to start from
    """
    trial, included = table.trial, table.included(labels)
    point, near = at, None
    if labels:
        lowest = table.nothing.evidence - FAILED_NATS
        both = table.fixed | dict(numbers)
        fit = resume(trial, included, RAISING, Start(both, at.path), lowest)
        if fit.diverged:
            return
        point, near = fit.point, fit.found.noise_factor
    levels = evidence.levels(trial, point, included, near, RAISING)
    if near is not None and near > RAISED_FROM:  # the noise may be nominal again
        levels.append(evidence.level(trial, point, 1.0, included, RAISING))
    nominal = best(trial, levels, NOMINAL).noise_factor
    if abs(math.log(nominal)) > 2.0 * trial.nominal_spread:  # its prior favours the nominal noise
        levels += nominal_levels(trial, point, included, nominal)
    plain = Rough(point, RAISING, levels)
    nominal_fit = plain.fit(trial, labels, included, best(trial, levels, NOMINAL))
    table.put(labels, nominal_fit.found.evidence, replace(nominal_fit, remainder=Remainder()))
    rough = rougher(table, labels, plain)
    raised_fit = rough.fit(trial, labels, included, rough.best)
    table.put(labels, raised_fit.found.evidence, raised_fit)
    if len(labels) == 1:
        gained = table.found[labels, NOMINAL].evidence - table.nothing.evidence
        table.noted_alone(labels[0], gained)
    if plain.best.noise_factor > RAISED_FROM:
        _weigh_intermittent(table, labels)
    _weigh_families(table, labels, plain, rough)
    table.forget()


def weigh_as(table: Hypotheses, labels: tuple[str, ...], one: Hypothesis, fit: Fit) -> bool:
    """Whether these causes, some of another hypothesis, are more probable with the noise of that
    one, where it has a shape of its own. They are then kept with it."""
    if not one.remainder.shaped:
        return False
    numbers = {name: fit.found.numbers[name] for name in table.included(labels)}
    start = replace(fit, found=replace(fit.found, numbers=numbers))
    again = _fitted_with(table, labels, start, one.remainder, anew=True)
    before = table.found.get((labels, one.kind))
    least = -math.inf if before is None else before.evidence + evidence.LITTLE_NATS
    if again.diverged or again.found.evidence < least:
        return False
    force = one.side_force
    pattern = None if force is None else table.with_pattern(again, force)
    table.put(labels, again.found.evidence, again, pattern)
    return True


def rougher(table: Hypotheses, labels: tuple[str, ...], plain: Rough) -> Rough:
    """Raised noise with a factor of its own in each channel, where that is more probable than one
    for all. Factors and numbers are fitted in turn: each is off where the other one is. They start
    from the factors that were most probable so far, and stay there where the set is far behind."""
    if plain.best.noise_factor <= RAISED_FROM:
        return plain
    trial, included = table.trial, table.included(labels)
    fit = plain.fit(trial, labels, included, plain.best)
    before, rounds = table.best_of(RAISED), NOISE_ROUNDS
    if before is not None and before.remainder.shaped:
        fit = _fitted_with(table, labels, fit, before.remainder)
        near = table.score(fit.found.evidence, labels, RAISED) > before.score - SEARCH_NATS
        rounds = 1 if near else 0
    for _ in range(rounds):
        if not fit.diverged:
            fit = _fitted_with(table, labels, fit, table.raised_by_channel(fit))
    if fit.diverged:
        return plain
    at, remainder = fit.point, fit.remainder
    levels = evidence.levels(trial, at, included, fit.found.noise_factor, remainder)
    shaped = Rough(at, remainder, levels)
    return shaped if shaped.best.value > plain.best.value else plain


def _fitted_with(
    table: Hypotheses, labels: tuple[str, ...], fit: Fit, remainder: Remainder, anew: bool = False
) -> Fit:
    """The same causes with another remainder."""
    start = Start(fit.found.numbers, fit.point.path)
    return resume(table.trial, table.included(labels), remainder, start, anew=anew)


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
    return max(levels, key=lambda level: level.value)


def raised_over_nominal(trial: Trial, noise: float) -> float:
    """Log prior density of a level of noise under `raised` over that under `nominal`."""
    nominal = trial.nominal_spread
    return noise_prior(noise, nominal, RAISING) - noise_prior(noise, nominal, Remainder())


# --- families of the discrepancy, and an intermittent force


def changed(
    trial: Trial, plain: Rough, rough: Rough, included: tuple[str, ...], family: str
) -> Change:
    """A change of one family's weights together with included causes, at its best size and noise.

    The noise may be raised as well, since no family describes an unknown force exactly: in the
    most probable way, `rough`. The family counts only if it is more probable with nominal noise
    than noise alone that is raised by one factor; otherwise its functions are a fit to noise. Nor
    does it count where it explains little of raised noise: that is an error of the spectrum.
    """

    def tried(of: Rough) -> list[tuple[float, float, float]]:
        """Log evidence, size of the change, λ at each level, which are made under `raised`."""
        found = []
        for level in of.levels:
            gained, size = evidence.family_change(
                trial, of.point, level, included, family, of.remainder
            )
            found.append((level.value + gained, size, level.noise_factor))
        return found

    nominal = [(v - raised_over_nominal(trial, noise), s, noise) for v, s, noise in tried(plain)]
    noisy = max(nominal)[0] > plain.best.value
    value, size, noise = max(tried(rough) if noisy else nominal)
    raised = plain.best.noise_factor > RAISED_FROM
    if raised and value - rough.best.value < rough.spectrum():
        value = -math.inf
    if not noisy:
        return Change(plain.point, Remainder(family, size), value, noise)
    remainder = replace(rough.remainder, kind=family, size=size, noisy=True)
    return Change(rough.point, remainder, value, noise)


def _weigh_families(table: Hypotheses, labels: tuple[str, ...], plain: Rough, rough: Rough) -> None:
    trial, included = table.trial, table.included(labels)
    kinds = (NOMINAL, RAISED, INTERMITTENT)
    found = (table.found[labels, kind] for kind in kinds if (labels, kind) in table.found)
    alone = max(found, key=lambda h: h.score)
    changes = [changed(trial, plain, rough, included, family) for family in trial.families]
    scores = [table.score(c.value, labels, c.remainder.kind) for c in changes]
    near = max((alone.score, *(score - SEARCH_NATS for score in scores)))
    for one, score in zip(changes, scores, strict=True):
        _weigh_change(table, labels, one, alone, score >= near)


def _weigh_change(
    table: Hypotheses, labels: tuple[str, ...], one: Change, alone: Hypothesis, leads: bool
) -> None:
    """The set together with a change of one family; linearised again if that is promising."""
    trial, included, remainder = table.trial, table.included(labels), one.remainder
    if not leads:  # far behind: its numbers are never asked for
        found = replace(alone.found, evidence=one.value)
        table.put(labels, one.value, Fit(one.point, found, remainder))
        return
    here, _ = evidence.scan(trial, one.point, (), included, one.noise, remainder)
    if labels:
        again = resume(trial, included, remainder, Start(here.numbers, one.point.path))
        if not again.diverged and again.found.evidence > one.value:
            table.put(labels, again.found.evidence, again)
            return
    table.put(labels, max(one.value, here.evidence), Fit(one.point, here, remainder))


def _weigh_intermittent(table: Hypotheses, labels: tuple[str, ...]) -> None:
    """An intermittent side force instead of raised process noise, with the causes fitted together
    with it: fitted to raised noise alone they would make up for it. Less probable than noise that
    is raised in each channel by itself it is that noise, and is not counted twice. Nor is a set
    asked that is far behind another one with raised noise."""
    raised, most = table.found[labels, RAISED], table.best_of(RAISED)
    assert most is not None
    if raised.score < most.score - SEARCH_NATS:
        return
    found = _fitted_with_force(table, labels, raised)
    if found is None:
        return
    fit, force = found
    if force.gain > 0.0 and fit.found.evidence > raised.evidence:
        table.put(labels, fit.found.evidence, fit, table.with_pattern(fit, force))


def _fitted_with_force(
    table: Hypotheses, labels: tuple[str, ...], raised: Hypothesis
) -> tuple[Fit, SideForce] | None:
    """An intermittent force and the numbers of a set, fitted in turn until the evidence stays. They
    begin with the most probable force so far, or with raised noise. Its gain is that of the last
    estimate next to these numbers. None where the fit diverges."""
    fit, before = table.fit(raised), table.best_of(INTERMITTENT)
    given = None if before is None else before.side_force
    best: tuple[Fit, SideForce] | None = None
    if given is not None:
        fit = _fitted_with(table, labels, fit, given.remainder)
        best = None if fit.diverged else (fit, given)
    steps: list[unrecorded_thruster.Step] = []
    gain = 0.0
    for _ in range(FORCE_ROUNDS):
        if fit.diverged:  # nor is there anything left of it that a force could explain
            break
        tried = table.intermittent(fit)
        gain = tried.gain
        steps = [] if given is None else [*steps[-1:], (given, tried)]
        given = tried if len(steps) < 2 else unrecorded_thruster.extrapolated(*steps)
        last, fit = fit, _fitted_with(table, labels, fit, given.remainder)
        if given is not tried and fit.found.evidence < last.found.evidence:  # they led too far
            given, steps = tried, []
            fit = _fitted_with(table, labels, last, given.remainder)
        reached = -math.inf if best is None else best[0].found.evidence
        if fit.diverged or fit.found.evidence <= reached:
            break
        best = fit, given
        if fit.found.evidence < max(reached + FORCE_NATS, raised.evidence - LEFT_NATS):
            break
    return None if best is None else (best[0], replace(best[1], gain=gain))
