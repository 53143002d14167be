"""What a fitted hypothesis says of a trial: coefficients, residuals, numbers without some voyages,
and the part of its remainder."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import evidence
from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.noise import discrepancy
from shiplog.diagnosis.noise.remainder import CHANGE_SIZES, Remainder
from shiplog.diagnosis.nominal import voyage_effects
from shiplog.diagnosis.trial.fitted import Fit, Level, Point
from shiplog.diagnosis.trial.trial import Trial
from shiplog.nomenclature import channels

CHANNELS = tuple(c.name for c in channels.VELOCITY)


def solution(trial: Trial, one: Fit) -> Level:
    """The hypothesis at its own level of process noise."""
    return evidence.level(
        trial, one.point, one.found.noise_factor, one.included, one.remainder
    )  # fmt: skip


def coefficients(trial: Trial, one: Fit) -> np.ndarray:
    """[P] of the base, together with a hypothesis; of a network its bends [F, 3]."""
    return _coefficients(trial, solution(trial, one))


def _coefficients(trial: Trial, level: Level) -> np.ndarray:
    ref, count = trial.reference, trial.reference.columns.base
    if ref.model.bends:
        assert ref.misfit is not None
        columns = ref.columns
        return ref.misfit.bends(level.solution[columns.linearised : len(columns.unit)])
    return ref.theta + level.solution[:count] * ref.columns.unit[:count]


def solved(trial: Trial, one: Fit) -> np.ndarray:
    """[C] numbers about the point under a hypothesis: nominal coefficients on these voyages, and
    the change by its causes."""
    ref = trial.reference
    level = solution(trial, one)
    d = level.solution[: len(ref.columns.unit)] * ref.columns.unit
    for name, values in one.found.numbers.items():
        d[ref.columns.of[name]] += values - one.point.numbers.get(name, 0.0)
    return d


def residual(trial: Trial, linear: Linear, one: Fit) -> tuple[Linear, np.ndarray]:
    """A pass of the trial without what the misfit does under a hypothesis, and the numbers of its
    own columns."""
    return trial.left(linear, solved(trial, one))


def without(
    trial: Trial, one: Fit, left_out: np.ndarray
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Numbers of the causes and coefficients [P], from the segments that are not `left_out` [S]."""
    noise = one.found.noise_factor
    total = trial.products.without(one.point, noise, trial.weight, one.remainder, left_out)
    level = evidence.solve(trial, total, 0.0, noise, one.point, one.included, one.remainder)
    numbers, _ = evidence.numbers_of(trial, level, one.point, one.included)
    return numbers, _coefficients(trial, level)


def of_parts(trial: Trial, linear: Linear, one: Fit) -> Linear:
    """A pass of this trial without what each part's own deviations do, under a hypothesis. The pass
    may have other segments of the record than the trial's."""
    columns, campaign = trial.reference.columns, trial.campaign
    common = solved(trial, one) / columns.unit
    deviation = math.hypot(1.0, campaign.apart) * campaign.effects.deviation
    accelerations = np.zeros((len(linear.e), linear.z.shape[-1] - 6, 0))
    if trial.reference.misfit is not None:
        accelerations = trial.reference.misfit.accelerations(linear.cut, trial.grid)
    begins = trial.rows[[rows[0] for rows in trial.parts]]
    of = np.searchsorted(begins, linear.cut.rows, side="right") - 1
    numbers = np.zeros((len(linear.e), columns.linearised + accelerations.shape[-1]))
    each = trial.products.of_parts(
        one.point, one.found.noise_factor, trial.weight, one.remainder
    )  # fmt: skip
    for i, gram in enumerate(each):
        own = voyage_effects.own_numbers(gram, common, deviation)
        numbers[of == i] = own * columns.unit
    return linear.less_numbers(numbers, accelerations)


# --- remainders


def changed(trial: Trial, point: Point, level: Level, included: tuple[str, ...], family: str,
            remainder: Remainder) -> tuple[float, float]:  # fmt: skip
    """Log Bayes factor, in nats, of a change of one family's weights over a level without it, at
    its most probable size; and that size. The level is of that `remainder`."""
    columns, ref = trial.families[family], trial.reference
    of = replace(remainder, kind=family)
    total, _ = trial.products.total(point, level.noise_factor, trial.weight, of)
    more = [ref.columns.of[n] for n in included]
    rows = 1 + np.concatenate([np.arange(len(ref.pull)), *more])
    joined = ref.counts * total[np.ix_(rows, 1 + columns)]
    pull = ref.counts * total[1 + columns, 0] - joined.T @ level.solution
    own = ref.counts * total[np.ix_(1 + columns, 1 + columns)] - joined.T @ level.inverse @ joined
    found = []
    for size in CHANGE_SIZES:
        whole = size**2 * own + np.eye(len(own))
        gained = 0.5 * size**2 * float(pull @ np.linalg.solve(whole, pull))
        found.append((gained - 0.5 * float(np.linalg.slogdet(whole)[1]), size))
    return max(found)


def imitated(trial: Trial, one: Fit, label: str, size: float) -> float:
    """Share, 0 to 1, of what a cause does to the observations that a change of the weights of the
    remainder's family does as well, the campaign's own numbers free.

    size   of that change, as it is expected without the cause
    """
    family = trial.families.get(one.remainder.kind)
    if family is None:
        return 0.0
    columns, ref = trial.reference.columns, trial.reference
    of, count = columns.of[label], len(ref.pull)
    noise = one.found.noise_factor
    total, _ = trial.products.total(one.point, noise, trial.weight, one.remainder)
    total = ref.counts * total[1:, 1:]
    both = np.concatenate((of, family)).astype(int)
    joined = total[np.ix_(np.arange(count), both)]
    known = total[:count, :count] + ref.information
    left = total[np.ix_(both, both)] - joined.T @ np.linalg.solve(known, joined)
    does = one.found.numbers[label] / columns.unit[of]
    own = does @ left[: len(of), : len(of)] @ does
    across = left[len(of) :, : len(of)] @ does
    free = left[len(of) :, len(of) :] + size**-2.0 * np.eye(len(family))
    return float(across @ np.linalg.solve(free, across) / own) if own > 0.0 else 1.0


def acts_on(trial: Trial, one: Fit, family: str) -> tuple[str, ...]:
    """Channels on which a change of a family's weights acts."""
    changed_by = replace(one.remainder, kind=family, size=CHANGE_SIZES[1], noisy=False)
    level = evidence.level(trial, one.point, one.found.noise_factor, one.included, changed_by)
    of = trial.unseen if family in discrepancy.UNSEEN else trial.campaign.discrepancy
    columns = trial.families[family]
    weights = np.zeros(of.count)
    weights[columns - of.families[0].columns[0]] = level.solution[-len(columns) :]
    accelerations = of.accelerations(one.point.linear.cut, trial.grid) @ weights
    size = (
        accelerations.reshape(len(accelerations), 3, -1).std((0, 2))
        / trial.reference.process_noise.acceleration
    )
    return tuple(str(n) for n in np.array(CHANNELS)[size > thresholds.ACTS * size.max()])
