"""The nominal campaign: its coefficients and errors, and the differences between its voyages.

Coefficients, the causes' nominal numbers and the weights of the model's discrepancy are estimated
together. The variance between the parts of the campaign (`voyage_effects`) is the variance of a
trial without any change: once as a campaign, and once more in each of its parts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shiplog.diagnosis import (
    discrepancy,
    likelihood,
    linearisation,
    nominal_reference,
    segment_nodes,
    segments,
    voyage_effects,
)
from shiplog.diagnosis.discrepancy import Discrepancy
from shiplog.diagnosis.likelihood import Modes, Unrest
from shiplog.diagnosis.linearisation import Linear
from shiplog.diagnosis.measurement_correction import read
from shiplog.diagnosis.nominal_reference import Reference, Settled
from shiplog.diagnosis.parameter_layout import HELD_INFORMATION, Columns
from shiplog.diagnosis.voyage_effects import VoyageEffects, reduced
from shiplog.models.causes import Setting
from shiplog.models.compiled_network import Network
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.voyages.recording import Record

ROBUST = 6.0  # medians of χ², from which on a segment counts less
PART = 20  # segments of one part of a campaign: 10 minutes of a three-metre ship
FEWEST_PARTS = 4  # parts that a campaign is cut into, where it has twice as many segments
NOISE_TIMES = (0.25, 0.5, 1.0, 2.0, 4.0)  # of the process noise, times the first guess
SHARES = (1.0, 0.5, 0.25, 0.12, 0.06, 0.03)


@dataclass(frozen=True)
class Campaign:
    """What a trial is compared with.

    reference    the linearisation point and prior of a trial's numbers, [C] with the discrepancy's
                 weights; `counts` is the share of itself that a trial counts
    effects      deviation of one part's numbers from the others' [C]
    discrepancy  its families and their columns
    unseen       families that no model of forces has, over the nominal campaign
    each         products of the nominal parts, in units: [1 + C, 1 + C], then the unseen families'
    noise        standard deviation, over the parts, of the logarithm of the process noise
    rows         nominal segments of each part; weight [S] of each segment
    """

    reference: Reference
    effects: VoyageEffects
    discrepancy: Discrepancy
    unseen: Discrepancy
    each: tuple[np.ndarray, ...]
    noise: float
    rows: tuple[np.ndarray, ...]
    weight: np.ndarray

    @cached_property
    def parts(self) -> tuple[np.ndarray, ...]:
        """`each` with every part's own numbers integrated out."""
        deviation = np.append(self.effects.deviation, np.zeros(self.unseen.count))
        return tuple(reduced(g, deviation)[0] for g in self.each)

    def prior_without(self, left_out: int) -> tuple[np.ndarray, np.ndarray]:
        """Information and pull of a trial's numbers, one nominal part left out."""
        known = self.effects.size**-2.0
        count = 1 + len(known)
        kept = [g[:count, :count] for i, g in enumerate(self.parts) if i != left_out]
        return prior(kept, known, self.reference.anchor, self.effects.deviation,
                     self.reference.counts)  # fmt: skip


def parts_of(voyage: np.ndarray, part: int = PART, fewest: int = FEWEST_PARTS) -> list[np.ndarray]:
    """Rows of contiguous segments that belong together: no part crosses two voyages.

    voyage   [S] of each segment, in order
    """
    while True:
        found: list[np.ndarray] = []
        for name in dict.fromkeys(voyage.tolist()):
            rows = np.flatnonzero(voyage == name)
            found += np.array_split(rows, max(round(len(rows) / part), 1))
        if len(found) >= fewest or part <= 2 or len(voyage) < 2 * fewest:
            return found
        part = part // 2


def picked(modes: Modes, rows: np.ndarray) -> Modes:
    """The segments `rows` of a pass; its volume is not theirs."""
    return replace(
        modes, dd=modes.dd[rows], md=modes.md[rows], felt=modes.felt[rows], axes=modes.axes[rows],
        pushed=modes.pushed[rows],
    )  # fmt: skip


def products(
    modes: Modes, parts: Sequence[np.ndarray], unit: np.ndarray,
    weight: np.ndarray | None = None, noise: float = 1.0,
) -> list[np.ndarray]:  # fmt: skip
    """[1 + C, 1 + C] of each part, in units [C]."""
    by = np.concatenate(([1.0], unit))
    scale = np.outer(by, by)
    weight = np.ones(len(modes.dd)) if weight is None else weight
    return [picked(modes, rows).total(weight[rows], noise) * scale for rows in parts]


def prior(
    parts: Sequence[np.ndarray], known: np.ndarray, anchor: np.ndarray, deviation: np.ndarray,
    share: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Information [C, C] and pull [C] on a trial's numbers: the posterior of the nominal parts,
    which count for `share` of themselves, widened by one campaign's own deviation."""
    total = share * sum(parts, np.zeros((len(known) + 1,) * 2))
    covariance = np.linalg.inv(total[1:, 1:] + np.diag(known))
    mean = covariance @ (total[1:, 0] + anchor)
    information = np.linalg.inv(covariance + np.diag(deviation**2))
    return information, information @ mean


@dataclass(frozen=True)
class Characteristics:
    """What the nominal campaign alone says of model and ship; it can be kept for later trials.

    unrest     sizes and correlation times of instrument and process noise
    deviation   group of columns → standard deviation of one part's numbers, in their units
    size        family of the discrepancy → prior size of its weights
    share       how much of itself a trial counts
    noise       standard deviation, over the parts, of the logarithm of the process noise
    weight      [S] of each segment
    """

    unrest: Unrest
    deviation: Mapping[str, float]
    size: Mapping[str, float]
    share: float
    noise: float
    weight: np.ndarray


@dataclass(frozen=True)
class _Pass:
    """The nominal voyages linearised once, with the discrepancy's families."""

    linear: Linear
    columns: Columns
    held: np.ndarray
    families: Discrepancy
    pushed: np.ndarray
    rows: list[np.ndarray]


def _pass(model: Extended, setting: Setting, start: Start, record: Record, at: Settled) -> _Pass:
    columns = nominal_reference.columns_of(model, setting, start)
    cut, moved, shown = read(model, setting, record, segments.begins(record))
    whole = np.concatenate((at.theta, np.zeros(len(columns.unit) - columns.base)))
    g = segments.grid(record)
    wide = nominal_reference.wide_of(setting)
    linear = linearisation.linear(model, whole, cut, g, at.path, moved, shown, wide)
    held = nominal_reference.anchored(start, at.theta, columns)
    families = discrepancy.of(
        record.profile, at.unrest.push, len(columns.unit), discrepancy.SEEN,
        segment_nodes.at_knots(linear.cut, g),
    )  # fmt: skip
    pushed = families.pushed(linear.cut, g)
    columns = columns.with_misfit(families.count)
    held = np.concatenate((held, np.zeros(families.count)))
    return _Pass(linear, columns, held, families, pushed, parts_of(linear.cut.voyage))


def characteristics(
    model: Extended, setting: Setting, start: Start, record: Record, at: Settled
) -> Characteristics:
    """Estimated from the nominal voyages, linearised at their converged coefficients `at`."""
    made = _pass(model, setting, start, record, at)
    columns, held, known = made.columns, made.held, made.columns.known
    unrest = noise_time(made.linear, made.pushed, columns, held, at.unrest)
    groups = _groups(model, columns, made.families)
    sized = [family.columns for family in made.families.families]
    weight = np.ones(len(made.linear.e))
    for last in (False, False, True):
        modes = likelihood.modes(likelihood.weighed(made.linear, unrest), unrest).beside(
            made.pushed
        )
        each = products(modes, made.rows, columns.unit, weight)
        effects = voyage_effects.learn(each, known, held, list(groups.values()), sized)
        if not last:  # what the parts disagree in is no noise, nor what a few segments are off by
            weight = _weights(modes, made, effects)
            unrest = _noise_of_parts(made, effects, unrest, weight >= 1.0)
    parts = [reduced(one, effects.deviation)[0] for one in each]
    share = _share(parts, effects, held)
    information, pull = prior(parts, effects.size**-2.0, held, effects.deviation, share)
    return Characteristics(
        unrest,
        {name: float(effects.deviation[at[0]]) for name, at in groups.items()},
        {f.name: float(effects.size[f.columns[0]]) for f in made.families.families},
        share,
        _noise(modes, made.rows, columns, effects, information, pull, weight),
        weight,
    )


def robust_weights(square: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Weight [S] of segments with these squares [S]: what is ROBUST medians off or more counts
    less, so that a few segments do not decide. Segments that are not `kept` [S] have none."""
    middle = float(np.median(square[kept])) if kept.any() else 1.0
    weight = np.minimum(1.0, ROBUST * middle / np.maximum(square, 1e-9))
    return np.where(kept, weight, 0.0)


def squares(modes: Modes, numbers: np.ndarray, noise: float = 1.0) -> np.ndarray:
    """χ² [S] of the segments with these numbers [C + W], SI: of the pass's own columns, then of
    those of accelerations at the nodes."""
    r = np.concatenate(([1.0], -numbers))
    left, more = r[: modes.dd.shape[-1]], r[modes.dd.shape[-1] :]
    pushed = modes.pushed @ more
    along = modes.md @ left
    square = np.einsum("i,sij,j->s", left, modes.dd, left, optimize=True)
    square += ((2.0 * along + modes.felt * pushed) * pushed).sum(-1)
    return square - ((along + modes.felt * pushed) ** 2 / (modes.felt + noise**-2.0)).sum(-1)


def _weights(modes: Modes, made: _Pass, effects: VoyageEffects) -> np.ndarray:
    assert effects.numbers is not None
    square = np.empty(len(modes.dd))
    for rows, numbers in zip(made.rows, effects.numbers, strict=True):
        square[rows] = squares(picked(modes, rows), numbers * made.columns.unit)
    return robust_weights(square, ~made.linear.lost)


def _noise_of_parts(
    made: _Pass, effects: VoyageEffects, unrest: Unrest, kept: np.ndarray
) -> Unrest:
    """Noise of the residuals of the `kept` [S] segments when every part has its own numbers."""
    assert effects.numbers is not None
    own = np.empty((len(made.linear.e), len(made.columns.unit)))
    for rows, numbers in zip(made.rows, effects.numbers, strict=True):
        own[rows] = numbers * made.columns.unit
    left = made.linear.less_numbers(own, made.pushed).pick(kept)
    return likelihood.learnt(left, np.zeros(made.columns.linearised), unrest, rounds=3)


def learn(
    model: Extended, setting: Setting, start: Start, record: Record, at: Settled,
    found: Characteristics,
) -> Campaign:  # fmt: skip
    """The campaign as a trial's causes see it, which depend on where the trial was."""
    made = _pass(model, setting, start, record, at)
    columns, held, families = made.columns, made.held, made.families
    unrest, known = found.unrest, made.columns.known
    modes = likelihood.modes(likelihood.weighed(made.linear, unrest), unrest).beside(made.pushed)
    unseen = discrepancy.of(
        record.profile, at.unrest.push, len(columns.unit), discrepancy.UNSEEN,
        segment_nodes.at_knots(made.linear.cut, segments.grid(record)),
    )  # fmt: skip
    whole = modes.beside(unseen.pushed(made.linear.cut, segments.grid(record)))
    unit = np.append(columns.unit, np.ones(unseen.count))
    weight = np.where(made.linear.lost, 0.0, found.weight)
    every = products(whole, made.rows, unit, weight)
    deviation, size = np.zeros(len(known)), known**-0.5
    for name, where in _groups(model, columns, families).items():
        deviation[where] = found.deviation.get(name, voyage_effects.LEAST_DEVIATION)
    for family in families.families:
        size[family.columns] = found.size[family.name]
    effects = VoyageEffects(deviation, size)
    count = 1 + len(known)
    parts = [reduced(g[:count, :count], deviation)[0] for g in every]
    information, pull = prior(parts, size**-2.0, held, deviation, found.share)
    reference_made = Reference(
        model, setting, at.theta, columns, unrest, nominal_reference.wide_of(setting), information,
        pull, held, 1.0 / found.share, made.linear, modes,
        nominal_reference.freedom(len(made.rows)),
        misfit=families,  # type: ignore[arg-type]  # it acts as a network's Misfit does
        counts=found.share,
    )  # fmt: skip
    return Campaign(
        reference_made, effects, families, unseen, tuple(every), found.noise, tuple(made.rows),
        weight,
    )  # fmt: skip


def widened(model: Extended, setting: Setting, start: Start) -> Start:
    """Coefficients at least as free on the nominal voyages as any cause makes them in a trial."""
    names = model.base.names
    values = dict(zip(names, start.values, strict=True))
    spread = start.spread.copy()
    still = np.zeros(6)
    for cause in model.causes:
        if not cause.absorbed:
            continue
        for size in np.diag(cause.sizes(setting)):
            changed = cause.coefficients(dict(values), size, still, 0.5, {})
            for i, name in enumerate(names):
                more = abs(float(changed.get(name, values[name])) - values[name])
                spread[i] = max(spread[i], more)
    return replace(start, spread=spread)


def noise_time(
    linear: Linear, pushed: np.ndarray, columns: Columns, held: np.ndarray, unrest: Unrest
) -> Unrest:
    """Sizes and correlation time of the process noise that make the nominal campaign likeliest,
    the model's discrepancy aside."""
    best, found = -math.inf, unrest
    middle = NOISE_TIMES.index(1.0)
    for way in (NOISE_TIMES[middle:], NOISE_TIMES[:middle][::-1]):
        for factor in way:
            tried = replace(found, time=factor * unrest.time)
            for _ in range(2 if factor == 1.0 else 1):
                numbers, _ = _solved(linear, pushed, tried, columns, held)
                left = linear.less(pushed @ numbers[columns.linearised :])
                tried = likelihood.learnt(left, numbers[: columns.linearised], tried, rounds=2)
            _, value = _solved(linear, pushed, tried, columns, held)
            if value < best:
                break
            best, found = value, tried
    return found


def _solved(
    linear: Linear, pushed: np.ndarray, unrest: Unrest, columns: Columns, held: np.ndarray
) -> tuple[np.ndarray, float]:
    """Likeliest numbers [C], SI, and the campaign's log marginal likelihood."""
    modes = likelihood.modes(likelihood.weighed(linear, unrest), unrest).beside(pushed)
    by = np.concatenate(([1.0], columns.unit))
    total = modes.total(np.ones(len(linear.e))) * np.outer(by, by)
    both = total[1:, 1:] + np.diag(columns.known)
    value = (
        nominal_reference.marginal(total, np.diag(columns.known), held) - 0.5 * modes.log_volume()
    )
    return np.linalg.solve(both, total[1:, 0] + held) * columns.unit, value


def _groups(model: Extended, columns: Columns, families: Discrepancy) -> dict[str, np.ndarray]:
    """Columns that share one variance: coefficients of one part of the ship, each cause's numbers,
    each family of the discrepancy."""
    part = np.array([name.split(".")[0] for name in model.base.names])
    found = {name: np.flatnonzero(part == name) for name in dict.fromkeys(part.tolist())}
    found |= {c.label: columns.of[c.label] for c in model.causes if c.usual}
    return found | {family.name: family.columns for family in families.families}


def _share(parts: Sequence[np.ndarray], effects: VoyageEffects, held: np.ndarray) -> float:
    """How much of itself a trial counts: the share with which the parts predict each other best
    (a power posterior: Grünwald & van Ommen 2017)."""
    known = effects.size**-2.0
    scores = []
    for share in SHARES:
        score = 0.0
        for i, left in enumerate(parts):
            kept = [g for j, g in enumerate(parts) if j != i]
            information, pull = prior(kept, known, held, effects.deviation, share)
            score += nominal_reference.marginal(left, information, pull)
        scores.append(score)
        if score < max(scores):
            break
    return SHARES[int(np.argmax(scores))]


def _noise(modes, rows, columns, effects, information, pull, weight) -> float:
    """Standard deviation of the logarithm of the process noise over the parts."""
    found = []
    for part in rows:
        own = picked(modes, part)
        scores = []
        tried = np.exp(np.linspace(-0.6, 0.6, 7))
        for factor in tried:
            gram = products(own, [np.arange(len(part))], columns.unit, weight[part], factor)[0]
            gram, logdet = reduced(gram, effects.deviation)
            volume = float(weight[part] @ np.log1p(factor**2 * own.felt).sum(-1)) + logdet
            scores.append(nominal_reference.marginal(gram, information, pull) - 0.5 * volume)
        found.append(math.log(tried[int(np.argmax(scores))]))
    return float(np.sqrt(np.mean(np.square(found))))


def assumed(
    model: Extended, setting: Setting, start: Start, record: Record, given: bool,
    inputs: Network | None = None,
) -> Campaign:  # fmt: skip
    """Without a nominal campaign: the trial's own voyages take its place, and no cause has a
    nominal size.

    given    coefficients that nobody fitted, held near their values; else a fit to these voyages
    inputs   a network that was trained on these voyages
    """
    if inputs is not None:
        made = nominal_reference.assume(model, setting, start, record, given, inputs)
        none = Discrepancy((), made.unrest.push)
        effects = VoyageEffects(np.zeros(len(made.pull)), made.columns.known**-0.5)
        return Campaign(made, effects, none, none, (), 0.0, (), np.zeros(0))
    start = widened(model, setting, start)
    at = nominal_reference.settled(
        model, setting, start, record, rounds=0 if given else nominal_reference.ROUNDS
    )
    # how parts differ is learned with coefficients as free as they plausibly are: what all parts
    # have in common must not look like a difference
    found = characteristics(model, setting, start, record, at)
    whole = learn(model, setting, start, record, at, found)
    columns, known = whole.reference.columns, whole.effects.size**-2.0
    known[columns.base : columns.linearised] = HELD_INFORMATION
    if given:
        known[: columns.base] = nominal_reference.GIVEN**-2.0
    made = replace(
        whole.reference, information=np.diag(known), pull=known * whole.reference.anchor,
        nominal=None, modes=None, adapts=not given,
    )  # fmt: skip
    return replace(
        whole, reference=made, effects=VoyageEffects(whole.effects.deviation, known**-0.5), each=()
    )
