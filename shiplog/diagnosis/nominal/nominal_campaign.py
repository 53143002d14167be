"""The nominal campaign: its coefficients and errors, and the differences between its voyages.

Coefficients, the causes' nominal numbers and the weights of the model's discrepancy are estimated
together. The variance between its voyages and between their parts (`voyage_effects`,
`campaign_prior`) is the variance of a trial without any change.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from shiplog.diagnosis.linear import segment_nodes, segments
from shiplog.diagnosis.linear.linear_segments import Linear
from shiplog.diagnosis.linear.parameter_layout import HELD_INFORMATION
from shiplog.diagnosis.noise import discrepancy, part_products
from shiplog.diagnosis.noise.discrepancy import Discrepancy
from shiplog.diagnosis.nominal import campaign_prior, nominal_fit, nominal_reference, voyage_effects
from shiplog.diagnosis.nominal.campaign_characteristics import (
    Characteristics,
    characteristics,
    groups_of,
    nominal_pass,
)
from shiplog.diagnosis.nominal.campaign_prior import prior
from shiplog.diagnosis.nominal.nominal_fit import Converged
from shiplog.diagnosis.nominal.nominal_reference import Reference
from shiplog.diagnosis.nominal.voyage_effects import VoyageEffects, reduced
from shiplog.machine.arrays import double
from shiplog.models.causes import Setting
from shiplog.models.compiled_network import Network
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.voyages.rows.recording import Record


@dataclass(frozen=True)
class Campaign:
    """What a trial is compared with.

    reference    the linearisation point and prior of a trial's numbers, [C] with the discrepancy's
                 weights; `counts` is the share of itself that a trial counts
    effects      deviation of one part's numbers from the others' [C]
    discrepancy  its families and their columns
    unseen       families that no model of forces has, over the nominal campaign
    each         products of the nominal parts, in units: [1 + C, 1 + C], then the unseen families'
    voyage       of each part; parts of a campaign of one voyage are voyages of their own
    apart        how far voyages are from each other, in deviations of their parts
    noise        standard deviation, over the parts, of the logarithm of the process noise
    rows         nominal segments of each part; weight [S] of each segment
    """

    reference: Reference
    effects: VoyageEffects
    discrepancy: Discrepancy
    omitted: Discrepancy
    each: tuple[np.ndarray, ...]
    voyage: np.ndarray
    apart: float
    noise: float
    rows: tuple[np.ndarray, ...]
    weight: np.ndarray

    def without_nominal(self) -> Campaign:
        """All but its segments and their products, which a trial's segments do not need."""
        reference = replace(self.reference, nominal=None)
        return replace(self, reference=reference, each=(), rows=(), weight=np.zeros(0))

    @cached_property
    def parts(self) -> tuple[np.ndarray, ...]:
        """`each` with every part's own numbers b ~ N(0, D) integrated out (`reduced`)."""
        return tuple(reduced(g, self.deviation)[0] for g in self.each)

    @cached_property
    def voyages(self) -> tuple[np.ndarray, ...]:
        """Σ_i G_vi of each voyage, its own numbers c ~ N(0, a² D) integrated out."""
        return tuple(
            campaign_prior.reduce_voyages(self.parts, self.voyage, self.apart * self.deviation)[0]
        )

    @cached_property
    def total(self) -> np.ndarray:
        """Σ_v G_v of all voyages."""
        return np.sum(self.voyages, axis=0)

    @property
    def deviation(self) -> np.ndarray:
        """D^½ [C + W] of one part's numbers; zero of the unseen families' weights."""
        return np.append(self.effects.deviation, np.zeros(self.omitted.count))

    def residual(self, record: Record) -> Linear | None:
        """e - J (x̂ + b̂_i) u: the nominal voyages, whose record this is, without what the campaign
        says and what each of its parts i deviates by, b ~ N(0, (1 + a²) D); None where there are
        none of the model's own."""
        made = self.reference
        if made.nominal is None or made.misfit is None or not self.rows:
            return None
        unit = made.columns.unit
        deviation = math.hypot(1.0, self.apart) * self.effects.deviation
        numbers = np.zeros((len(made.nominal.e), len(unit)))
        for gram, rows in zip(self.each, self.rows, strict=True):
            own = voyage_effects.own_numbers(gram, made.mean, deviation)
            numbers[rows] = (made.mean + own) * unit
        accelerations = partial(made.misfit.accelerations, g=segments.grid(record))
        return made.nominal.less_numbers(numbers, accelerations)

    def prior_without(self, left_out: int, apart: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
        """Λ [C, C] and η [C] (`campaign_prior.prior`), one nominal voyage left out; of the numbers
        of a voyage that is so far `apart`, a."""
        K, ref = self.effects.size**-2.0, self.reference
        others = self.total if left_out < 0 else self.total - self.voyages[left_out]
        count, own = 1 + len(K), apart * self.effects.deviation
        return prior([others[:count, :count]], K, ref.anchor, own, ref.counts)


def learn(
    model: Extended, setting: Setting, start: Start, record: Record, at: Converged,
    found: Characteristics, numbers: Mapping[str, np.ndarray] | None = None,
) -> Campaign:  # fmt: skip
    """The campaign as a trial's causes see it, which depend on where the trial was: linearised
    about θ*, with the products of its parts and the prior of a trial's numbers,

        Λ = (V + δ²)⁻¹,  V = (K + κ Σ_v M_v)⁻¹,  m = V (η + κ Σ_v g_v)      `campaign_prior.prior`

    δ = a D^½ where there is one voyage only, whose parts then count as voyages. `numbers` as in
    `assume_campaign`. Raises np.linalg.LinAlgError where a matrix is singular.
    """
    made = nominal_pass(model, setting, start, record, replace(at, path=found.path), numbers)
    columns, anchor, families = made.columns, made.anchor, made.families
    process_noise, K = found.process_noise, made.columns.prior_information
    unseen = discrepancy.build(
        record.profile, at.process_noise.acceleration, len(columns.unit), discrepancy.OMITTED,
        segment_nodes.conditions_at_nodes(made.linear.cut, segments.grid(record)),
    )  # fmt: skip
    g = segments.grid(record)
    accelerations = np.concatenate(
        (made.accelerations, unseen.accelerations(made.linear.cut, g)), -1
    )
    unit = np.append(columns.unit, np.ones(unseen.count))
    weight = np.where(made.linear.lost, 0.0, found.weight)
    noise_prior = process_noise.inverse_kernels(g.nodes)
    passes = part_products.passes(
        made.linear, process_noise, made.rows, unit, weight, accelerations
    )
    every = [one.gram(noise_prior).G for one in passes]
    deviation, size = np.zeros(len(K)), K**-0.5
    for name, where in groups_of(model, columns, families).items():
        deviation[where] = found.deviation.get(name, voyage_effects.UNSEEN_DEVIATION)
    for family in families.families:
        size[family.columns] = found.size[family.name]
    effects = VoyageEffects(deviation, size)
    count = 1 + len(K)
    parts = [reduced(g[:count, :count], deviation)[0] for g in every]
    voyage = made.linear.cut.voyage[[rows[0] for rows in made.rows]]
    own = np.zeros(len(K))
    if len(np.unique(voyage)) == 1:  # its parts share its deviation, which another voyage has not
        voyage, own = np.arange(len(parts)), found.apart * deviation
    voyages, _ = campaign_prior.reduce_voyages(parts, voyage, found.apart * deviation)
    information, pull = prior(voyages, size**-2.0, anchor, own, found.share)
    reference_made = Reference(
        model, setting, at.theta, columns, process_noise, nominal_fit.wide_of(setting),
        information, pull, anchor, made.linear,
        nominal_reference.freedom(len(voyages)),
        misfit=families,  # type: ignore[arg-type]  # it acts as a network's Misfit does
        counts=found.share,
    )  # fmt: skip
    total = np.sum([g[:count, :count] for g in every], axis=0)
    weights = nominal_fit.discrepancy_here(total, size**-2.0, columns)
    reference_made = replace(reference_made, expected=weights)
    return Campaign(
        reference_made, effects, families, unseen, tuple(every), voyage, found.apart,
        found.noise,
        tuple(made.rows), weight,
    )  # fmt: skip


def widen(model: Extended, setting: Setting, start: Start) -> Start:
    """u_i ← max(u_i, max over causes |Δθ_i|): coefficients at least as free on the nominal voyages
    as any cause of realistic size makes them in a trial."""
    names = model.base.names
    values = dict(zip(names, start.values, strict=True))
    spread = start.spread.copy()
    still = np.zeros(6)
    for cause in model.causes:
        if not cause.absorbed:
            continue
        for size in np.diag(cause.sizes(setting)):
            with double():
                changed = cause.coefficients(dict(values), size, still, 0.5, {})
            for i, name in enumerate(names):
                more = abs(float(changed.get(name, values[name])) - values[name])
                spread[i] = max(spread[i], more)
    return replace(start, spread=spread)


def uniform_campaign(made: Reference) -> Campaign:
    """A campaign whose voyages do not differ, and whose model has no discrepancy."""
    none = Discrepancy((), made.process_noise.acceleration)
    effects = VoyageEffects(np.zeros(len(made.pull)), made.columns.prior_information**-0.5)
    return Campaign(made, effects, none, none, (), np.zeros(0), 0.0, 0.0, (), np.zeros(0))


def assume_campaign(
    model: Extended, setting: Setting, start: Start, record: Record, given: bool,
    inputs: Network | None = None, numbers: Mapping[str, np.ndarray] | None = None,
) -> Campaign:  # fmt: skip
    """Without a nominal campaign: the trial's own voyages take its place, and no cause has a
    nominal size.

    given    coefficients that nobody fitted, held near their values; else a fit to these voyages.
    inputs   a network that was trained on these voyages
    numbers  of causes that were found in these voyages: what they explain is no discrepancy
    """
    if inputs is not None:
        return uniform_campaign(
            nominal_reference.assume(model, setting, start, record, given, inputs)
        )
    start = widen(model, setting, start)
    rounds = 0 if given else nominal_fit.LINEARISATIONS
    at = nominal_fit.converged(model, setting, start, record, rounds, discrepancy.MODELLED)
    # how parts differ is learned with coefficients as free as they plausibly are: what all parts
    # have in common must not look like a difference
    found = characteristics(model, setting, start, record, at, numbers)
    whole = learn(model, setting, start, record, at, found, numbers)
    columns, K = whole.reference.columns, whole.effects.size**-2.0
    K[columns.base : columns.linearised] = HELD_INFORMATION
    if given:
        K[: columns.base] = nominal_reference.GIVEN**-2.0
    made = replace(
        whole.reference, information=np.diag(K), pull=K * whole.reference.anchor,
        nominal=None, adapts=not given,
    )  # fmt: skip
    return replace(
        whole,
        reference=made,
        effects=VoyageEffects(whole.effects.deviation, K**-0.5),
        each=(),
        voyage=np.zeros(0),
    )
