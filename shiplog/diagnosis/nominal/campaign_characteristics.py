"""What the nominal campaign alone says of model and ship; it can be kept for later trials.

In turn, LEARNING_ROUNDS times, about θ* (symbols as in the room's opening):

    D, s     variance of the parts' numbers, sizes of the discrepancy    `voyage_effects.learn`
    w_s      min(1, ROBUST · median(χ²)/χ²_s), χ² with each part's own numbers   `robust_weights`
    σ, q     of the residuals when each part has its own numbers         `noise_estimate`
    x*(t)    paths about the acceleration of the discrepancy, Φ ŵ        `linearisation.fit_path`

then a and κ, and the spread of log λ over the parts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.linear import linearisation, segment_nodes, segments
from shiplog.diagnosis.linear.linear_segments import Linear, Path
from shiplog.diagnosis.linear.measurement_correction import read
from shiplog.diagnosis.linear.parameter_layout import Columns
from shiplog.diagnosis.noise import discrepancy, noise_estimate, part_products
from shiplog.diagnosis.noise.campaign_parts import marginal, parts_of, robust_weights, squares
from shiplog.diagnosis.noise.discrepancy import Discrepancy
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.nominal import campaign_prior, nominal_fit, voyage_effects
from shiplog.diagnosis.nominal.campaign_prior import prior
from shiplog.diagnosis.nominal.nominal_fit import Converged
from shiplog.diagnosis.nominal.voyage_effects import VoyageEffects, reduced
from shiplog.models.causes import Setting
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.voyages.rows.recording import Record

LEARNING_ROUNDS = 3  # of deviations, noise and paths in turn
NOISE_LEVELS = np.exp(np.linspace(-0.6, 0.6, 7))  # of one part, times the process noise of all
NOISE_TIMES = (0.25, 0.5, 1.0, 2.0, 4.0)  # of the process noise, times the first guess


@dataclass(frozen=True)
class Characteristics:
    """What the nominal campaign alone says of model and ship; it can be kept for later trials.

    process_noise  sizes and correlation times of instrument and process noise: σ, q, τ
    deviation   group of columns → D^½, standard deviation of one part's numbers, in their units
    size        family of the discrepancy → s, prior size of its weights
    apart       a, how far voyages are from each other, in those deviations
    share       κ, share of itself that a trial counts
    noise       standard deviation, over the parts, of the logarithm of the process noise
    weight      w [S] of each segment
    path        of each segment, as a trial's segments have theirs: about the discrepancy
    """

    process_noise: ProcessNoise
    deviation: Mapping[str, float]
    size: Mapping[str, float]
    apart: float
    share: float
    noise: float
    weight: np.ndarray
    path: Path


@dataclass(frozen=True)
class NominalPass:
    """The nominal voyages linearised once, with the discrepancy's families."""

    linear: Linear
    columns: Columns
    anchor: np.ndarray
    families: Discrepancy
    accelerations: np.ndarray
    rows: list[np.ndarray]


def nominal_pass(
    model: Extended, setting: Setting, start: Start, record: Record, at: Converged,
    numbers: Mapping[str, np.ndarray] | None = None, pulled: bool = True,
) -> NominalPass:  # fmt: skip
    """`numbers` of causes that the voyages have; none but on voyages that are not nominal. Whether
    the path has been fitted with them."""
    columns = nominal_fit.columns_of(model, setting, start)
    cut, moved, observed = read(model, setting, record, segments.begins(record), numbers)
    whole = np.concatenate((at.theta, columns.numbers(numbers or {})))
    g, path = segments.grid(record), at.path
    wide = nominal_fit.wide_of(setting)
    if not pulled:
        path = linearisation.fit_path(model, whole, cut, g, wide, path)
    linear = linearisation.linear(model, whole, cut, g, path, moved, observed, wide)
    anchor = nominal_fit.anchored(start, at.theta, columns)
    families = discrepancy.build(
        record.profile, at.process_noise.acceleration, len(columns.unit), discrepancy.MODELLED,
        segment_nodes.conditions_at_nodes(linear.cut, g),
    )  # fmt: skip
    accelerations = families.accelerations(linear.cut, g)
    columns = columns.with_misfit(families.count)
    anchor = np.concatenate((anchor, np.zeros(families.count)))
    return NominalPass(
        linear, columns, anchor, families, accelerations, parts_of(linear.cut.voyage)
    )


def characteristics(
    model: Extended, setting: Setting, start: Start, record: Record, at: Converged,
    numbers: Mapping[str, np.ndarray] | None = None,
) -> Characteristics:  # fmt: skip
    """Estimated from the nominal voyages, linearised at their converged coefficients `at`."""
    made = nominal_pass(model, setting, start, record, at, numbers, pulled=not numbers)
    columns, anchor, K = made.columns, made.anchor, made.columns.prior_information
    process_noise = noise_time(made.linear, made.accelerations, columns, anchor, at.process_noise)
    groups = groups_of(model, columns, made.families)
    sized = [family.columns for family in made.families.families]
    weight = np.ones(len(made.linear.e))
    for round_ in range(LEARNING_ROUNDS):
        each = _products(made, process_noise, weight)
        effects = voyage_effects.learn(each, K, anchor, list(groups.values()), sized)
        if round_ == LEARNING_ROUNDS - 1:
            break
        # what parts disagree in is no noise, nor what a few segments are off by
        weight = _weights(made, effects, process_noise)
        process_noise = _noise_of_parts(made, effects, process_noise, weight >= 1.0)
        expected = nominal_fit.discrepancy_here(sum(each[1:], each[0]), effects.size**-2.0, columns)
        path = _path_about(model, record, at, made, expected, process_noise, numbers)
        at = replace(at, path=path)
        made = nominal_pass(model, setting, start, record, at, numbers)
    parts = [reduced(one, effects.deviation)[0] for one in each]
    voyages = made.linear.cut.voyage[[rows[0] for rows in made.rows]]
    apart, share = campaign_prior.learn(parts, voyages, effects, anchor)
    information, pull = prior(parts, effects.size**-2.0, anchor, apart * effects.deviation, share)
    return Characteristics(
        process_noise,
        {name: float(effects.deviation[at[0]]) for name, at in groups.items()},
        {f.name: float(effects.size[f.columns[0]]) for f in made.families.families},
        apart,
        share,
        _noise(made, process_noise, effects, information, pull, weight),
        weight,
        at.path,
    )


def _path_about(
    model: Extended, record: Record, at: Converged, made: NominalPass, expected: np.ndarray,
    process_noise: ProcessNoise, numbers: Mapping[str, np.ndarray] | None,
) -> Path:  # fmt: skip
    """The path of each segment about its model with the discrepancy, as firmly held as a trial's.
    Nonlinear errors are then the same in both."""
    about = made.accelerations @ expected
    whole = np.concatenate((at.theta, made.columns.numbers(numbers or {})))
    hold = nominal_fit.hold(process_noise, process_noise.acceleration)
    return linearisation.fit_path(
        model, whole, made.linear.cut, segments.grid(record), hold, at.path, about=about
    )


def _products(
    made: NominalPass, process_noise: ProcessNoise, weight: np.ndarray
) -> list[np.ndarray]:
    """G of each part, in units, its own numbers in it."""
    prior = process_noise.inverse_kernels(made.linear.path.acceleration.shape[-1])
    passes = part_products.passes(
        made.linear, process_noise, made.rows, made.columns.unit, weight, made.accelerations
    )
    return [one.gram(prior).G for one in passes]


def _weights(made: NominalPass, effects: VoyageEffects, process_noise: ProcessNoise) -> np.ndarray:
    """w [S]: robust weights of χ²_s with each part's own numbers x + b_i."""
    return robust_weights(squares(_less_own(made, effects), process_noise), ~made.linear.lost)


def _less_own(made: NominalPass, effects: VoyageEffects) -> Linear:
    """e - J (x + b_i) u: what is left when every part i has its own numbers."""
    assert effects.numbers is not None
    own = np.empty((len(made.linear.e), len(made.columns.unit)))
    for rows, numbers in zip(made.rows, effects.numbers, strict=True):
        own[rows] = numbers * made.columns.unit
    return made.linear.less_numbers(own, made.accelerations)


def _noise_of_parts(
    made: NominalPass, effects: VoyageEffects, process_noise: ProcessNoise, kept: np.ndarray
) -> ProcessNoise:
    """σ, q of e - J (x + b_i) u of the `kept` [S] segments, every part i with its own numbers."""
    left = _less_own(made, effects).pick(kept)
    return noise_estimate.estimate(left, np.zeros(made.columns.linearised), process_noise, rounds=3)


def noise_time(
    linear: Linear,
    accelerations: np.ndarray,
    columns: Columns,
    anchor: np.ndarray,
    process_noise: ProcessNoise,
) -> ProcessNoise:
    """argmax_τ max_{σ, q} log p(e; σ, q, τ): sizes and correlation time of instrument and process
    noise that make the nominal campaign likeliest, all numbers x integrated out; τ of NOISE_TIMES
    times the first guess, from the middle to either side while the likelihood grows.

    accelerations   Φ [S, 3J, W]; anchor   η [C]
    """
    best, found = -math.inf, process_noise
    middle = NOISE_TIMES.index(1.0)
    for way in (NOISE_TIMES[middle:], NOISE_TIMES[:middle][::-1]):
        for factor in way:
            tried = replace(found, time=factor * process_noise.time)
            for _ in range(2 if factor == 1.0 else 1):
                numbers, _ = _solved(linear, accelerations, tried, columns, anchor)
                left = linear.less(accelerations @ numbers[columns.linearised :])
                tried = noise_estimate.estimate(
                    left, numbers[: columns.linearised], tried, rounds=2
                )
            _, value = _solved(linear, accelerations, tried, columns, anchor)
            if value < best:
                break
            best, found = value, tried
    return found


def _solved(
    linear: Linear,
    accelerations: np.ndarray,
    process_noise: ProcessNoise,
    columns: Columns,
    anchor: np.ndarray,
) -> tuple[np.ndarray, float]:
    """u (M + K)⁻¹ (g + η) [C]: likeliest numbers, SI; and log p(e), the campaign's log evidence
    [nats] (`marginal`, and the volume -½ Σ log|C_s|)."""
    whole = part_products.whole(linear, process_noise, columns.unit, accelerations=accelerations)
    G, K = whole.G, np.diag(columns.prior_information)
    M_K = G[1:, 1:] + K
    value = marginal(G, K, anchor) - 0.5 * whole.volume
    return np.linalg.solve(M_K, G[1:, 0] + anchor) * columns.unit, value


def groups_of(model: Extended, columns: Columns, families: Discrepancy) -> dict[str, np.ndarray]:
    """Columns that share one variance: coefficients of one part of the ship, each cause's numbers,
    each family of the discrepancy. Ship and discrepancy both have a part called wind."""
    part = np.array([name.split(".")[0] for name in model.base.names])
    found = {f"{name} coefficients": np.flatnonzero(part == name)
             for name in dict.fromkeys(part.tolist())}  # fmt: skip
    found |= {c.label: columns.indices[c.label] for c in model.causes if c.varies}
    return found | {f"{f.name} discrepancy": f.columns for f in families.families}


def _noise(
    made: NominalPass, process_noise: ProcessNoise, effects: VoyageEffects,
    information: np.ndarray, pull: np.ndarray, weight: np.ndarray,
) -> float:  # fmt: skip
    """√mean_i (log λ_i)²: root mean square, over the parts i, of the logarithm of the process noise
    over its estimate for the whole campaign,

        λ_i = argmax log p(e_i; λ),  x ~ N(Λ⁻¹ η, Λ⁻¹) + b_i integrated out, λ of NOISE_LEVELS
    """
    nodes = made.linear.path.acceleration.shape[-1]
    priors = [process_noise.times(by).inverse_kernels(nodes) for by in NOISE_LEVELS]
    found = []
    for part in part_products.passes(
        made.linear, process_noise, made.rows, made.columns.unit, weight, made.accelerations
    ):
        scores = []
        for prior_of_noise in priors:
            of = part.gram(prior_of_noise)
            gram, logdet = reduced(of.G, effects.deviation)
            scores.append(marginal(gram, information, pull) - 0.5 * (of.volume + logdet))
        found.append(math.log(NOISE_LEVELS[int(np.argmax(scores))]))
    return float(np.sqrt(np.mean(np.square(found))))
