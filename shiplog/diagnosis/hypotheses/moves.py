"""What is one step from a hypothesis: the causes that are worth adding to it, and those to drop.

What a cause adds is predicted by its derivative where the hypothesis is linearised (12). Of
coefficients that were fitted to nominal voyages that is near enough. Of given coefficients the path
is far from the model's own, and what is not linear in between decides. Additions are then looked at
`nearer`: linearised at the numbers that the derivative gives, before any is fitted.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from shiplog.diagnosis.hypotheses import evidence
from shiplog.diagnosis.hypotheses.hypothesis import Hypothesis
from shiplog.diagnosis.hypotheses.table import Hypotheses
from shiplog.diagnosis.trial.fitted import Fit, Point
from shiplog.models.causes import Cause

LIKELY = 0.3  # share of the best one's evidence: before it is linearised a cause may lack more
CONTENDERS = 3  # causes that are tried from one hypothesis
# nats of the best addition, up to which all are looked at from nearer: on the Esso Osaka with its
# published coefficients a derivative promised from 50 too few to 80 too many
CLOSE_CALL = 200.0
# Realistic sizes that a fit may start from, besides the number of a secant: of a limit, what is
# larger than any order changes nothing, and what is too small is another ship.
STARTS = (0.25, 0.5, 1.0)

Addition = tuple[tuple[str, ...], dict[str, np.ndarray], float]


def additions(
    table: Hypotheses, one: Hypothesis, fit: Fit, causes: Sequence[Cause], nearer: bool = False
) -> list[Addition]:
    """The sets with one cause more than a hypothesis that are worth a look, by their log Bayes
    factors where it is linearised (12), or where each of them is: labels, numbers to start from,
    score expected."""
    candidates = [
        c for c in causes
        if c.label not in one.causes
        and all(compatible(c, table.by[label]) for label in one.causes)
    ]  # fmt: skip
    _, found = evidence.scan(
        table.trial, fit.point, candidates, (*table.trial.fixed, *one.causes),
        one.estimate.noise_factor, one.remainder,
    )  # fmt: skip
    promised = {f.name: f.evidence for f in found if f.evidence > 0.0}
    if nearer and max(promised.values(), default=0.0) < CLOSE_CALL:
        of, here = {f.name: f.numbers for f in found}, value(table, fit.point, fit)
        promised = {name: _from_nearer(table, fit, of[name]) - here for name in promised}
    most, scale, added = max(promised.values(), default=0.0), table.scale, []
    for f in sorted(found, key=lambda f: -promised.get(f.name, -math.inf)):
        gained = promised.get(f.name, 0.0)
        if gained <= 0.0 or gained < LIKELY * most:
            continue
        labels = tuple(sorted((*one.causes, f.name)))
        numbers = {**one.estimate.numbers, **f.numbers}
        added.append((labels, numbers, scale.score(one.evidence + gained, labels, one.kind)))
    return added[:CONTENDERS]


def _from_nearer(table: Hypotheses, fit: Fit, added: Mapping[str, np.ndarray]) -> float:
    """Log evidence [nats] of a fit and a cause in addition, with the trial linearised at both their
    numbers, at the fit's own noise; minus infinity where the model diverges there."""
    numbers = {**fit.estimate.numbers, **added}
    try:
        point = table.trial.linearise(
            numbers, fit.point, fit.estimate.noise_factor, fit.remainder
        )  # fmt: skip
    except np.linalg.LinAlgError:
        return -math.inf
    return value(table, point, fit, tuple(numbers))


def value(
    table: Hypotheses, point: Point, fit: Fit, included: tuple[str, ...] | None = None
) -> float:
    """Log evidence [nats] at a point, with the noise and the remainder of a fit; of its causes,
    unless others are `included`."""
    causes = fit.included if included is None else included
    return evidence.level(
        table.trial, point, fit.estimate.noise_factor, causes, fit.remainder
    ).value  # fmt: skip


def start_of(
    table: Hypotheses, fit: Fit, label: str, numbers: Mapping[str, np.ndarray]
) -> np.ndarray | None:
    """Number of a cause that is new in a set, to start from: the most probable of some sizes, where
    its derivative is that of a first step of its own; else None. Nor is it asked where the trial
    has no greater errors than the nominal voyages: each size costs a linearisation."""
    cause = table.by[label]
    if not cause.first_step or cause.count > 1 or table.trial.as_nominal:
        return None
    size = cause.sizes(table.trial.reference.setting)
    tried = (numbers[label], *(share * size for share in STARTS))
    return max(tried, key=lambda x: _from_nearer(table, fit, {**numbers, label: x}))


def reductions(one: Hypothesis) -> list[tuple[tuple[str, ...], dict[str, np.ndarray]]]:
    """The sets with one cause less than a hypothesis: labels, numbers to start from."""
    fewer = (tuple(n for n in one.causes if n != label) for label in one.causes)
    return [(labels, {n: one.estimate.numbers[n] for n in labels}) for labels in fewer if labels]


def compatible(one: Cause, other: Cause) -> bool:
    """Whether both may be in one hypothesis: either may say that they may not."""
    return one.compatible(other.label) and other.compatible(one.label)
