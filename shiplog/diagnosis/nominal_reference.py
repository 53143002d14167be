"""The nominal reference: the posterior of coefficients and causes after the training voyages.

Coefficients and the numbers of every cause are estimated together, each with its plausible spread
as prior. An error that the model has everywhere is then part of them; the diagnosis tests changes
only. Coefficients fitted to one campaign are over-confident for the next. Their information matrix
is divided by κ (a power prior, Ibrahim & Chen 2000).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shiplog.diagnosis import input_misfit, likelihood, linearisation, nominal_fit, segments
from shiplog.diagnosis.campaign_parts import marginal
from shiplog.diagnosis.input_misfit import Misfit
from shiplog.diagnosis.likelihood import Modes, ProcessNoise
from shiplog.diagnosis.linear_segments import Linear, Wide
from shiplog.diagnosis.measurement_correction import read
from shiplog.diagnosis.nominal_fit import Converged, anchored, columns_of, converged, hold, wide_of
from shiplog.diagnosis.parameter_layout import HELD_INFORMATION, Columns
from shiplog.diagnosis.remainder import Remainder
from shiplog.models.causes import Cause, Setting, constants_of
from shiplog.models.compiled_network import Network
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.voyages.recording import Record

KAPPAS = (2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 32.0)
CAMPAIGN = 4.0  # least κ between campaigns: voyages of one are more alike
VOYAGES = 2.0  # and between voyages, together with the error of a network on all of them
CAREFUL_KAPPA = 11.0  # of too few voyages
GIVEN = 0.1  # of the plausible spread, that coefficients nobody fitted are held to


@dataclass(frozen=True)
class Reference:
    """θ that all is linearised about, and what the nominal campaign says around it.

    information  [C, C]  and pull [C], in units of `columns.unit`, κ applied; `anchor` [C] of the
                 latter is the run's own coefficients'
    nominal      that campaign, and its `modes` under the nominal process noise; None where the
                 model was trained on the very data that are diagnosed
    freedom      degrees of freedom with which κ is known; intervals are wider with fewer
    adapts       whether the model has absorbed causes there, and is fitted again with them
    misfit       the error of its MMG as a function of the network's inputs
    counts       share of itself that a trial counts, as its voyages have errors of their own
    expected     [W] weights of the discrepancy that a path follows; none where None
    """

    model: Extended
    setting: Setting
    theta: np.ndarray
    columns: Columns
    process_noise: ProcessNoise
    wide: Wide
    information: np.ndarray
    pull: np.ndarray
    anchor: np.ndarray
    kappa: float
    nominal: Linear | None
    modes: Modes | None
    freedom: float
    adapts: bool = False
    misfit: Misfit | None = None
    counts: float = 1.0
    expected: np.ndarray | None = None

    @cached_property
    def mean(self) -> np.ndarray:
        """[C] nominal numbers, in units."""
        return np.linalg.solve(self.information, self.pull)

    @cached_property
    def information_volume(self) -> float:
        """log|information|."""
        return float(np.linalg.slogdet(self.information)[1])

    def apart(self, one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> float:
        """The most that a number differs, in units of its size; of the same causes."""
        columns = self.columns
        return max(
            (float(np.abs((one[n] - other[n]) / columns.unit[columns.of[n]]).max()) for n in one),
            default=0.0,
        )

    def about(self, cut: segments.Cut, g: segments.SegmentGrid) -> np.ndarray | None:
        """Acceleration [S, 3J] that is expected at a path's knots: that of the discrepancy. A path
        that had to do without would be off by more than the process noise, and what is not linear
        in that would look like a change."""
        if self.expected is None or self.misfit is None:
            return None
        return self.misfit.accelerations(cut, g) @ self.expected

    def held(self, noise_factor: float, remainder: Remainder) -> Wide:
        """Allowed distance of a path where the process noise has this factor, with a remainder."""
        of = remainder.in_noise(self.process_noise)
        acceleration = noise_factor * of.acceleration
        if of.intermittent is not None:
            acceleration = np.hypot(acceleration, of.intermittent)
        return hold(self.process_noise, acceleration)

    @property
    def coefficients(self) -> dict[str, np.ndarray]:
        """Of the ship's MMG, by name: the base's own, or those that stand in for a network's."""
        values = self.theta if self.model.own else np.asarray(self.model.stand_in_values)
        return dict(zip(self.model.stand_in.names, values, strict=True))


def learn(
    model: Extended,
    setting: Setting,
    start: Start,
    record: Record,
    at: Converged | None = None,
    kappa: float | None = None,
    least: float = CAMPAIGN,
    inputs: Network | None = None,
) -> Reference:
    """From the nominal campaign, linearised at its converged fit `at`. κ is estimated from its own
    voyages unless given, and not below `least`. `inputs`: a network whose inputs the discrepancy is
    a function of."""
    at = at or converged(model, setting, start, record)
    columns = columns_of(model, setting, start)
    cut, moved, observed = read(model, setting, record, segments.begins(record))
    whole = np.concatenate((at.theta, np.zeros(len(columns.unit) - columns.base)))
    g = segments.grid(record)
    linear = linearisation.linear(model, whole, cut, g, at.path, moved, observed)
    modes = likelihood.modes(likelihood.weighed(linear, at.process_noise), at.process_noise)
    held = anchored(start, at.theta, columns)
    wrong = None
    if inputs is not None:
        wrong = input_misfit.of(
            inputs, linear.cut, g, modes, columns.known, columns.unit, at.process_noise.acceleration
        )  # fmt: skip
        modes = modes.joined(wrong.accelerations(linear.cut, g))
        columns = columns.with_misfit(wrong.count)
        held = np.concatenate((held, np.zeros(wrong.count)))
    voyage = linear.cut.voyage
    names = np.unique(voyage)
    by = np.concatenate(([1.0], columns.unit))
    each = np.stack([modes.total((voyage == v).astype(float)) for v in names]) * np.outer(by, by)
    chosen = kappa or inflation(each, columns.known, held, least)
    information, pull = nominal_information(each.sum(0), chosen, columns.known, held)
    return Reference(
        model, setting, at.theta, columns, at.process_noise, wide_of(setting), information, pull,
        held, chosen, linear, modes, freedom(len(names)), misfit=wrong,
    )  # fmt: skip


def freedom(voyages: int) -> float:
    """Degrees of it that so many voyages leave to what they have in common."""
    return float(max(voyages - 1, 2))


def nominal_information(
    total: np.ndarray, kappa: float, known: np.ndarray, held: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Information [C, C] and pull [C] of a campaign's products [1 + C, 1 + C], which count for 1/κ
    together with what is `known` and `held` without them."""
    return total[1:, 1:] / kappa + np.diag(known), total[1:, 0] / kappa + held


def inflation(
    each: np.ndarray, known: np.ndarray, held: np.ndarray, least: float = CAMPAIGN
) -> float:
    """κ that predicts each voyage best from the others; not below `least`, and careful with fewer
    than three.

    each [V, 1 + C, 1 + C] products of a voyage; what is known before any data, information and
    pull, `known` and `held` [C]: all in units
    """
    if len(each) < 3:
        return CAREFUL_KAPPA
    total = each.sum(0)
    scores, tried = [], [kappa for kappa in KAPPAS if kappa >= least]
    for kappa in tried:
        score = 0.0
        for left in each:
            score += marginal(left, *nominal_information(total - left, kappa, known, held))
        scores.append(score)
    return tried[int(np.argmax(scores))]


def assume(
    model: Extended, setting: Setting, start: Start, record: Record, given: bool,
    inputs: Network | None = None,
) -> Reference:  # fmt: skip
    """Without a nominal campaign: the process noise is estimated from these voyages.

    given    published coefficients, with a tenth of their plausible spread; else coefficients of a
             fit to these voyages, with their plausible spread
    inputs   a network that trained on these voyages
    """
    if given:
        start = replace(start, spread=GIVEN * start.spread)
    at = converged(model, setting, start, record, rounds=0 if given else nominal_fit.LINEARISATIONS)
    kappa, least = (CAREFUL_KAPPA, CAMPAIGN) if inputs is None else (None, VOYAGES)
    whole = learn(model, setting, start, record, at, kappa, least, inputs)
    columns = whole.columns
    information = np.diag(columns.known.copy())
    causes = slice(columns.base, columns.linearised)
    # without a nominal campaign no cause has a nominal size
    information[causes, causes] = np.eye(columns.linearised - columns.base) * HELD_INFORMATION
    return replace(
        whole, information=information, pull=whole.anchor, nominal=None, modes=None,
        adapts=not given,
        counts=1.0 / min(whole.kappa, CAREFUL_KAPPA) if inputs is not None else 1.0,
    )  # fmt: skip


def with_causes(reference: Reference, causes: Sequence[Cause]) -> Reference:
    """One that `assume` made, with these causes in its model and no others."""
    setting, columns = reference.setting, reference.columns
    sizes = [cause.sizes(setting) for cause in causes]
    first, last = columns.base, columns.linearised
    more = sum(len(size) for size in sizes)

    def widened(values: np.ndarray, own: float) -> np.ndarray:
        return np.concatenate((values[:first], np.full(more, own), values[last:]))

    constants = {**constants_of(causes, setting), **reference.model.constants}
    return replace(
        reference,
        model=replace(reference.model, causes=tuple(causes), constants=constants),
        columns=Columns(
            first, tuple(causes),
            np.concatenate((columns.unit[:first], *sizes, columns.unit[last:])), columns.misfit,
        ),
        information=np.diag(widened(np.diag(reference.information), HELD_INFORMATION)),
        pull=widened(reference.pull, 0.0),
        anchor=widened(reference.anchor, 0.0),
    )  # fmt: skip
