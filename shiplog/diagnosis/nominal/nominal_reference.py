"""The nominal reference: what is known of coefficients and causes before a trial.

An error that the model has everywhere is part of it; the diagnosis tests changes only. What is
fitted to some voyages is over-confident for others: their products count for 1/κ of themselves (a
power prior, Ibrahim & Chen 2000). `nominal_campaign` makes it of the training voyages, and `assume`
of a network that is diagnosed on these very voyages. A trial's numbers x [C], in units, have

    x ~ N(Λ⁻¹ η, Λ⁻¹)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from shiplog.diagnosis.linear import linearisation, segments
from shiplog.diagnosis.linear.linear_segments import Linear, Wide, acting
from shiplog.diagnosis.linear.measurement_correction import read
from shiplog.diagnosis.linear.parameter_layout import HELD_INFORMATION, Columns
from shiplog.diagnosis.noise import input_misfit, part_products
from shiplog.diagnosis.noise.campaign_parts import marginal
from shiplog.diagnosis.noise.input_misfit import Misfit
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.nominal import nominal_fit
from shiplog.diagnosis.nominal.nominal_fit import anchored, columns_of, converged, hold, wide_of
from shiplog.models.causes import Cause, Setting, constants_of
from shiplog.models.compiled_network import Network
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.voyages.rows.recording import Record

KAPPAS = (2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 32.0)  # that are tried
CAREFUL_KAPPA = 11.0  # of too few voyages, and the most by which a trial counts less
FEWEST_VOYAGES = 3  # from which κ is estimated
GIVEN = 0.1  # of the plausible spread, that coefficients nobody fitted are held to


@dataclass(frozen=True)
class Reference:
    """θ* that all is linearised about, and the prior x ~ N(Λ⁻¹ η, Λ⁻¹) of a trial's numbers.

    information  Λ [C, C] and pull η [C], in units of `columns.unit`; `anchor` [C] of the latter is
                 the run's own coefficients'
    nominal      that campaign; None where the model was trained on the very data that are diagnosed
    freedom      degrees of freedom that the voyages leave; intervals are wider with fewer
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
    nominal: Linear | None
    freedom: float
    adapts: bool = False
    misfit: Misfit | None = None
    counts: float = 1.0
    expected: np.ndarray | None = None

    @cached_property
    def mean(self) -> np.ndarray:
        """Λ⁻¹ η [C]: nominal numbers, in units."""
        return np.linalg.solve(self.information, self.pull)

    @cached_property
    def information_volume(self) -> float:
        """log|Λ|."""
        return float(np.linalg.slogdet(self.information)[1])

    def distance(self, one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> float:
        """max |q₁ - q₂|/u: the most that a number differs, in units of its size; of the same
        causes, label → numbers q, SI."""
        columns = self.columns
        return max(
            (
                float(np.abs((one[n] - other[n]) / columns.unit[columns.indices[n]]).max())
                for n in one
            ),
            default=0.0,
        )

    def expected_acceleration(
        self, cut: segments.Cut, g: segments.SegmentGrid
    ) -> np.ndarray | None:
        """Φ ŵ [S, 3J]: acceleration that is expected at a path's nodes, that of the discrepancy. A
        path that had to do without would be off by more than the process noise, and what is not
        linear in that would look like a change."""
        if self.expected is None or self.misfit is None:
            return None
        return acting(partial(self.misfit.accelerations, g=g), cut, self.expected)

    def allowed_distance(self, noise_factor: float, remainder: Remainder) -> Wide:
        """Allowed distance of a path, FREE √(λ² q² + p²) of the acceleration, where the process
        noise has the factor λ = `noise_factor`, with a remainder."""
        of = remainder.apply_to(self.process_noise)
        acceleration = noise_factor * of.acceleration
        if of.intermittent is not None:
            acceleration = np.hypot(acceleration, of.intermittent)
        return hold(self.process_noise, acceleration)

    @property
    def coefficients(self) -> dict[str, np.ndarray]:
        """Of the ship's MMG, by name: the base's own, or those that stand in for a network's."""
        values = self.theta if self.model.own else np.asarray(self.model.stand_in_values)
        return dict(zip(self.model.stand_in.names, values, strict=True))


def freedom(voyages: int) -> float:
    """max(V - 1, 2): degrees of it that V voyages leave to what they have in common."""
    return float(max(voyages - 1, 2))


def nominal_information(
    total: np.ndarray, kappa: float, known: np.ndarray, anchor: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Λ = M/κ + K [C, C] and η = g/κ + η₀ [C]: of a campaign's products G [1 + C, 1 + C], which
    count for 1/κ, together with the information K = diag(`known`) and the pull η₀ = `anchor`."""
    return total[1:, 1:] / kappa + np.diag(known), total[1:, 0] / kappa + anchor


def inflation(each: np.ndarray, known: np.ndarray, anchor: np.ndarray) -> float:
    """argmax_κ Σ_v log p(e_v | the other voyages; κ), of KAPPAS: κ that predicts each voyage best
    from the others; CAREFUL_KAPPA where there are too few.

    each   G [V, 1 + C, 1 + C] of each voyage; `known` K and `anchor` η₀ [C], information and pull
           before any data: all in units
    """
    if len(each) < FEWEST_VOYAGES:
        return CAREFUL_KAPPA
    total = each.sum(0)
    scores = []
    for kappa in KAPPAS:
        score = 0.0
        for left in each:
            score += marginal(left, *nominal_information(total - left, kappa, known, anchor))
        scores.append(score)
    return KAPPAS[int(np.argmax(scores))]


def assume(
    model: Extended, setting: Setting, start: Start, record: Record, given: bool, inputs: Network
) -> Reference:
    """Of a network without a nominal campaign: noise, discrepancy and κ are estimated from these
    voyages, and coefficients have their plausible spread: Λ = diag(K), η = the anchor, and K is
    HELD_INFORMATION of causes' numbers, which have no nominal size.

    given    published coefficients, with a tenth of that spread, and not fitted to these voyages
    inputs   the network that trained on these voyages: the discrepancy is a function of its inputs
    """
    if given:
        start = replace(start, spread=GIVEN * start.spread)
    at = converged(model, setting, start, record, rounds=0 if given else nominal_fit.LINEARISATIONS)
    columns = columns_of(model, setting, start)
    cut, moved, observed = read(model, setting, record, segments.begins(record))
    whole = np.concatenate((at.theta, np.zeros(len(columns.unit) - columns.base)))
    g = segments.grid(record)
    linear = linearisation.linear(model, whole, cut, g, at.path, moved, observed)
    noise = at.process_noise
    wrong = input_misfit.estimate(inputs, linear, g, noise, columns.prior_information, columns.unit)
    anchor = np.append(anchored(start, at.theta, columns), np.zeros(wrong.count))
    columns = columns.with_misfit(wrong.count)
    names = np.unique(linear.cut.voyage)
    each = [
        part_products.whole(
            linear.pick(linear.cut.voyage == v), noise, columns.unit,
            accelerations=partial(wrong.accelerations, g=g),
        ).G
        for v in names
    ]  # fmt: skip
    kappa = inflation(np.stack(each), columns.prior_information, anchor)
    # without a nominal campaign no cause has a nominal size
    K = columns.prior_information.copy()
    K[columns.base : columns.linearised] = HELD_INFORMATION
    return Reference(
        model, setting, at.theta, columns, at.process_noise, wide_of(setting), np.diag(K),
        anchor, anchor, None, freedom(len(names)), adapts=not given, misfit=wrong,
        counts=1.0 / min(kappa, CAREFUL_KAPPA),
    )  # fmt: skip


def with_causes(reference: Reference, causes: Sequence[Cause]) -> Reference:
    """One that `assume` made, with these causes in its model and no others."""
    setting, columns = reference.setting, reference.columns
    sizes = [cause.sizes(setting) for cause in causes]
    first, last = columns.base, columns.linearised
    more = sum(len(size) for size in sizes)

    def extend(values: np.ndarray, own: float) -> np.ndarray:
        return np.concatenate((values[:first], np.full(more, own), values[last:]))

    constants = {**constants_of(causes, setting), **reference.model.constants}
    return replace(
        reference,
        model=replace(reference.model, causes=tuple(causes), constants=constants),
        columns=Columns(
            first, tuple(causes),
            np.concatenate((columns.unit[:first], *sizes, columns.unit[last:])), columns.misfit,
        ),
        information=np.diag(extend(np.diag(reference.information), HELD_INFORMATION)),
        pull=extend(reference.pull, 0.0),
        anchor=extend(reference.anchor, 0.0),
    )  # fmt: skip
