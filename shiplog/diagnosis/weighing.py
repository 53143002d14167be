"""One set of causes under every kind of remainder, linearised where it is most probable."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis import evidence, fits
from shiplog.diagnosis.fitted import Fit, Found, Level, Point
from shiplog.diagnosis.hypotheses import Hypotheses
from shiplog.diagnosis.hypothesis import Hypothesis
from shiplog.diagnosis.relinearisation import converge
from shiplog.diagnosis.remainder import INTERMITTENT, NOMINAL, RAISED, Remainder, noise_prior
from shiplog.diagnosis.trial import Trial

SEARCH_NATS = 10.0  # nats behind the best, beyond which a hypothesis is not worth a linearisation
FAILED_NATS = 50.0  # nats below nothing, at which a fit has failed: without effect it loses a few
RAISED_FROM = 1.2  # times the nominal process noise, from which an intermittent force is tested
RAISING = Remainder(RAISED)


@dataclass(frozen=True)
class Change:
    """A change of one family's weights: with what evidence, at what process noise."""

    remainder: Remainder
    value: float
    noise: float


def weigh(
    table: Hypotheses, labels: tuple[str, ...], numbers: Mapping[str, np.ndarray], at: Point,
    banned: Collection[str] = (),
) -> None:  # fmt: skip
    """Put the hypotheses of these causes into the table; none, where their fit diverges.

    numbers   of the causes, to start from; at: a point whose path is to start from
    banned    names of causes whose linearisations need not be kept
    """
    trial, included = table.trial, table.included(labels)
    point, near = at, None
    if labels:
        lowest = table.nothing.evidence - FAILED_NATS
        both = table.fixed | dict(numbers)
        point, base = converge(trial, included, both, at.path, lowest, RAISING)
        if not math.isfinite(base.evidence):
            return
        near = base.noise_factor
    levels = evidence.levels(trial, point, included, near, RAISING)
    if near is not None and near > RAISED_FROM:  # the noise may be nominal again
        levels.append(evidence.level(trial, point, 1.0, included, RAISING))
    nominal = best(trial, levels, NOMINAL).noise_factor
    if abs(math.log(nominal)) > 2.0 * trial.nominal_spread:  # its prior favours the nominal noise
        levels += nominal_levels(trial, point, included, nominal)
    for kind in (NOMINAL, RAISED):
        one = best(trial, levels, kind)
        found = Found("+".join(labels), one.value, one.noise_factor,
                      *evidence.numbers_of(trial, one, point, included))  # fmt: skip
        table.put(labels, one.value, Fit(point, found, Remainder(kind)))
    if len(labels) == 1:
        gained = table.found[labels, NOMINAL].evidence - table.nothing.evidence
        table.noted_alone(labels[0], gained)
    _weigh_families(table, labels, point, levels)
    if best(trial, levels, RAISED).noise_factor > RAISED_FROM:
        _weigh_intermittent(table, labels, point)
    table.forget(banned)


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
    trial: Trial, point: Point, included: tuple[str, ...], levels: Sequence[Level], family: str
) -> Change:
    """A change of one family's weights together with included causes, at its best size and noise.

    The noise may be raised as well, since no family describes an unknown force exactly. The
    family counts only if it is more probable with nominal noise than raised noise alone;
    otherwise its functions are a fit to noise.
    """
    nominal, raised = [], []
    for level in levels:  # made under `raised`
        gained, size = fits.changed(trial, point, level, included, family, RAISING)
        value, noise = level.value + gained, level.noise_factor
        nominal.append((value - raised_over_nominal(trial, noise), size, noise))
        raised.append((value, size, noise))
    noisy = max(nominal)[0] > max(level.value for level in levels)
    value, size, noise = max(raised if noisy else nominal)
    return Change(Remainder(family, size, noisy), value, noise)


def _weigh_families(
    table: Hypotheses, labels: tuple[str, ...], point: Point, levels: Sequence[Level]
) -> None:
    trial, included = table.trial, table.included(labels)
    plain = max((table.found[labels, kind] for kind in (NOMINAL, RAISED)), key=lambda h: h.score)
    changes = [changed(trial, point, included, levels, family) for family in trial.families]
    scores = [table.score(c.value, labels, c.remainder.kind) for c in changes]
    near = max((plain.score, *(score - SEARCH_NATS for score in scores)))
    for one, score in zip(changes, scores, strict=True):
        _weigh_change(table, labels, point, one, plain, score >= near)


def _weigh_change(
    table: Hypotheses, labels: tuple[str, ...], point: Point, one: Change, plain: Hypothesis,
    leads: bool,
) -> None:  # fmt: skip
    """The set together with a change of one family; linearised again if that is promising."""
    trial, included, remainder = table.trial, table.included(labels), one.remainder
    if not leads:  # far behind: its numbers are never asked for
        found = replace(plain.found, evidence=one.value)
        table.put(labels, one.value, Fit(point, found, remainder))
        return
    here, _ = evidence.scan(trial, point, (), included, one.noise, remainder)
    if labels:
        again, base = converge(trial, included, here.numbers, point.path, remainder=remainder)
        if math.isfinite(base.evidence) and base.evidence > one.value:
            table.put(labels, base.evidence, Fit(again, base, remainder))
            return
    table.put(labels, max(one.value, here.evidence), Fit(point, here, remainder))


def _weigh_intermittent(table: Hypotheses, labels: tuple[str, ...], point: Point) -> None:
    """An intermittent side force instead of raised process noise. A force without a gain over
    raised noise is that noise, and is not counted twice."""
    raised = table.found[labels, RAISED]
    fit = Fit(point, raised.found, Remainder(INTERMITTENT))
    tried = table.intermittent(fit)
    if tried.gain > 0.0:
        table.put(labels, raised.evidence + tried.gain, fit, tried)
