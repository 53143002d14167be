"""What a fitted hypothesis says of a trial: coefficients, residual, numbers without some voyages,
the work of its remainder.

Every function begins with the posterior mean A⁻¹ b (7) at the hypothesis' own λ.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import evidence
from shiplog.diagnosis.linear.linear_segments import Linear, acting
from shiplog.diagnosis.noise import discrepancy
from shiplog.diagnosis.noise.remainder import CHANGE_SIZES
from shiplog.diagnosis.nominal import voyage_effects
from shiplog.diagnosis.trial.fitted import Fit, Level
from shiplog.diagnosis.trial.trial import Trial
from shiplog.nomenclature import channels

CHANNELS = tuple(c.name for c in channels.VELOCITY)


def solution(trial: Trial, fit: Fit) -> Level:
    """Posterior of a hypothesis at its own λ (7)."""
    return evidence.level(
        trial, fit.point, fit.estimate.noise_factor, fit.included, fit.remainder
    )  # fmt: skip


def coefficients(trial: Trial, fit: Fit) -> np.ndarray:
    """[P] coefficients of the base, together with a hypothesis; of a network its bends [F, 3]."""
    return _coefficients(trial, solution(trial, fit))


def _coefficients(trial: Trial, level: Level) -> np.ndarray:
    """Nominal coefficients plus their part of A⁻¹ b, SI."""
    ref, count = trial.reference, trial.reference.columns.base
    if ref.model.bends:
        assert ref.misfit is not None
        columns = ref.columns
        return ref.misfit.bends(level.mean[columns.linearised : len(columns.unit)])
    return ref.theta + level.mean[:count] * ref.columns.unit[:count]


def numbers_from_point(trial: Trial, fit: Fit) -> np.ndarray:
    """d [C], SI: all numbers under a hypothesis, counted from its point. Nominal numbers are those
    of A⁻¹ b; to the causes' columns is added what its numbers differ by from the point's."""
    ref = trial.reference
    level = solution(trial, fit)
    d = level.mean[: len(ref.columns.unit)] * ref.columns.unit
    for name, values in fit.estimate.numbers.items():
        d[ref.columns.indices[name]] += values - fit.point.numbers.get(name, 0.0)
    return d


def residual(trial: Trial, linear: Linear, fit: Fit) -> tuple[Linear, np.ndarray]:
    """A pass of the trial without W w, the effect of the discrepancy under a hypothesis, and the
    numbers d of its own columns: r - W w and J d have the noise as their difference."""
    return trial.less_misfit(linear, numbers_from_point(trial, fit))


def refitted(
    trial: Trial, fit: Fit, left_out: np.ndarray
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Numbers of the causes and coefficients [P] from (7), with the products G of the segments that
    are not `left_out` [S] bool."""
    noise = fit.estimate.noise_factor
    G = trial.products.leave_out(fit.point, noise, trial.weight, fit.remainder, left_out)
    level = evidence.solve(trial, G, 0.0, noise, fit.point, fit.included, fit.remainder)
    numbers, _ = evidence.numbers_of(trial, level, fit.point, fit.included)
    return numbers, _coefficients(trial, level)


def less_parts(trial: Trial, linear: Linear, fit: Fit) -> Linear:
    """A pass of this trial without J b_k, the effect of each part's own deviations b_k, under a
    hypothesis. The pass may have other segments of the record than the trial's.

    b_k is the most probable one given θ, from N(0, (1 + a²) D): part and voyage together."""
    columns, campaign = trial.reference.columns, trial.campaign
    theta = numbers_from_point(trial, fit) / columns.unit
    deviation = math.hypot(1.0, campaign.apart) * campaign.effects.deviation
    misfit = trial.reference.misfit
    accelerations = np.zeros((len(linear.e), linear.z.shape[-1] - 6, 0))
    if misfit is not None:
        accelerations = partial(misfit.accelerations, g=trial.grid)
    begins = trial.rows[[rows[0] for rows in trial.parts]]
    part = np.searchsorted(begins, linear.cut.rows, side="right") - 1
    b = np.zeros((len(linear.e), len(columns.unit)))
    each = trial.products.each_part(
        fit.point, fit.estimate.noise_factor, trial.weight, fit.remainder
    )  # fmt: skip
    for k, one in enumerate(each):
        b[part == k] = voyage_effects.own_numbers(one.G, theta, deviation) * columns.unit
    return linear.less_numbers(b, accelerations)


def imitated(trial: Trial, fit: Fit, label: str, size: float) -> float:
    """Share, 0 to 1, of what a cause does to the observations that a change of the weights of the
    remainder's family does as well, the campaign's own numbers free.

    x and w are numbers of the cause and weights of the family. With the nominal numbers eliminated
    (10), their normal matrix has the blocks M_xx, M_wx and M_ww:

        share = gᵀ (M_ww + σ⁻² I)⁻¹ g / (xᵀ M_xx x),   g = M_wx x

    size   σ of that change, as it is expected without the cause
    """
    family = trial.families.get(fit.remainder.kind)
    if family is None:
        return 0.0
    ref = trial.reference
    of, nominal = ref.columns.indices[label], np.arange(len(ref.pull))
    total = trial.products.total(
        fit.point, fit.estimate.noise_factor, trial.weight, fit.remainder
    )  # fmt: skip
    G = ref.counts * total.G[1:, 1:]
    both = np.concatenate((of, family)).astype(int)
    B = G[np.ix_(nominal, both)]
    A = G[: len(nominal), : len(nominal)] + ref.information
    M = G[np.ix_(both, both)] - B.T @ np.linalg.solve(A, B)
    q = len(of)
    x = fit.estimate.numbers[label] / ref.columns.unit[of]
    whole = x @ M[:q, :q] @ x
    g = M[q:, :q] @ x
    M_ww = M[q:, q:] + size**-2.0 * np.eye(len(family))
    return float(g @ np.linalg.solve(M_ww, g) / whole) if whole > 0.0 else 1.0


def acts_on(trial: Trial, fit: Fit, family: str) -> tuple[str, ...]:
    """Channels on which a change of a family's weights acts: where the standard deviation of its
    acceleration W w, over that of the process noise, is near the largest."""
    changed_by = replace(fit.remainder, kind=family, size=CHANGE_SIZES[1], noisy=False)
    level = evidence.level(trial, fit.point, fit.estimate.noise_factor, fit.included, changed_by)
    of = trial.omitted if family in discrepancy.OMITTED else trial.campaign.discrepancy
    columns = trial.families[family]
    w = np.zeros(of.count)
    w[columns - of.families[0].columns[0]] = level.mean[-len(columns) :]
    accelerations = acting(partial(of.accelerations, g=trial.grid), fit.point.linear.cut, w)
    size = (
        accelerations.reshape(len(accelerations), 3, -1).std((0, 2))
        / trial.reference.process_noise.acceleration
    )
    return tuple(str(n) for n in np.array(CHANNELS)[size > thresholds.ACTS * size.max()])
