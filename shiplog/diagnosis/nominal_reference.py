"""The nominal reference: the posterior of coefficients and causes after the training voyages.

Coefficients and the numbers of every cause are estimated together, each with its plausible spread
as prior. An error that the model has everywhere is then part of them; the diagnosis tests changes
only. Coefficients fitted to one campaign are over-confident for the next. Their information matrix
is divided by κ (a power prior, Ibrahim & Chen 2000).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shiplog.diagnosis import (
    discrepancy,
    input_misfit,
    likelihood,
    linearisation,
    segment_nodes,
    segments,
)
from shiplog.diagnosis.input_misfit import Misfit
from shiplog.diagnosis.likelihood import Modes, ProcessNoise
from shiplog.diagnosis.linear_segments import Linear, Path, Wide
from shiplog.diagnosis.measurement_correction import read
from shiplog.diagnosis.parameter_layout import HELD_INFORMATION, Columns
from shiplog.models.causes import Cause, Setting, constants_of
from shiplog.models.compiled_network import Network
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.voyages.recording import Record

LINEARISATIONS = 20  # of moving the coefficients to where they are linearised, at most
LONGEST_MOVE = 2.0  # plausible spreads that a coefficient moves in one round
NEAR, CLOSE = 5.0, 0.7  # nats and plausible spreads, for which they are not moved on
AT_BOUNDS = 0.05  # plausible spreads: all that can still move has converged
ON_THE_WAY, AT_REST = 2, 3  # rounds in which instrument and process noise are estimated
FREE = 2.0  # times the process noise: the allowed acceleration at a path's nodes
KAPPAS = (2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 32.0)
CAMPAIGN = 4.0  # least κ between campaigns: voyages of one are more alike
VOYAGES = 2.0  # and between voyages, together with the error of a network on all of them
CAREFUL_KAPPA = 11.0  # of too few voyages
PROCESS_NOISE_TIME_S = 4.0  # s, of a three-metre ship
FIRST_SIZE = 1.0  # of a family's weights, in units of the process noise
LEAST_SIZE = 0.01  # the same: a model without discrepancy has none of it
SIZE_STEPS = 3  # of expectation-maximisation, of these sizes, each time
GIVEN = 0.1  # of the plausible spread, that coefficients nobody fitted are held to


@dataclass(frozen=True)
class Reference:
    """θ that all is linearised about, and what the nominal campaign says around it.

    information  [C, C]  and pull [C], in units of `columns.unit`, κ applied; `anchor` [C] of the
                 latter is the run's own coefficients'
    nominal      that campaign, and its `modes` under the nominal process noise; None where the
                 model was trained on the very data that are diagnosed
    freedom      degrees of it with which κ is known: the sizes of covariances hang on it
    adapts       whether the model has absorbed causes there, and is fitted again with them
    learned      whether it stands for a network that has, and that no voyage is held out to
    misfit       what is wrong of such a network's inputs
    counts       for how much of itself a trial counts: what is wrong there each voyage has its own
                 of
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
    learned: bool = False
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

    @cached_property
    def nominal_coefficients(self) -> np.ndarray:
        """[P] coefficients."""
        base = self.columns.base
        return self.theta + self.mean[:base] * self.columns.unit[:base]

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

    def held(self, noise_factor: float, intermittent: np.ndarray | None = None) -> Wide:
        """Allowed distance of a path where the process noise has this factor, and with an
        intermittent force."""
        acceleration = noise_factor * self.process_noise.acceleration
        if intermittent is not None:
            acceleration = np.hypot(acceleration, intermittent)
        return hold(self.process_noise, acceleration)

    @property
    def coefficients(self) -> dict[str, np.ndarray]:
        """Of the ship's MMG, by name: the base's own, or those that stand in for a network's."""
        values = self.theta if self.model.own else np.asarray(self.model.stand_in_values)
        return dict(zip(self.model.stand_in.names, values, strict=True))


def hold(process_noise: ProcessNoise, acceleration: np.ndarray) -> Wide:
    """Allowed distance of a path with an acceleration [3] at its nodes."""
    return Wide(process_noise.noise, process_noise.start, FREE * acceleration)


def wide_of(setting: Setting) -> Wide:
    """How far a path may be pulled, from what a ship of this size and speed does in seconds."""
    speed, length = setting.scale["speed"], setting.scale["length"]
    turn = speed / length
    at, going, angle, turning = 0.3 * length, speed, 0.3, turn
    known = setting.profile.sensors.noise
    unsaid = {  # for a sensor whose accuracy nobody states
        "position": 0.005 * length, "velocity": 0.03 * speed,
        "heading": 0.003, "yaw_rate": 0.03 * turn,
    }  # fmt: skip
    of = {name: known(name) or least for name, least in unsaid.items()}
    noise = np.array([of[n] for n in ("position", "velocity") * 2 + ("heading", "yaw_rate")])
    return Wide(
        noise, np.array([at, going, at, going, angle, turning]),
        np.array([0.1 * speed, 0.1 * speed, 0.1 * turn]),
    )  # fmt: skip


@dataclass(frozen=True)
class Converged:
    """Where a campaign is linearised, and its noise there.

    theta  [P] coefficients; path of each segment; process_noise with the instruments' noise
    """

    theta: np.ndarray
    path: Path
    process_noise: ProcessNoise


def converged(
    model: Extended, setting: Setting, start: Start, record: Record, rounds: int = LINEARISATIONS,
    seen: Sequence[str] = (),
) -> Converged:  # fmt: skip
    """Coefficients moved to where they are linearised, all causes' numbers together with them, and
    the discrepancy of the families `seen`; without rounds the coefficients stay where they are.

    Without its discrepancy a model that describes the ship badly would be moved to coefficients,
    and the noise to sizes, that make up for it."""
    columns = columns_of(model, setting, start)
    wide, g = wide_of(setting), segments.grid(record)
    cut, moved, observed = read(model, setting, record, segments.begins(record))
    base, linearised = columns.base, columns.linearised
    theta = np.clip(start.values, start.low, start.high)
    of = record.timescale
    process_noise = ProcessNoise(
        wide.noise,
        0.04 * wide.acceleration,
        PROCESS_NOISE_TIME_S * of.factor,
        wide.start,
        bin=of.bin,
        knot=of.knot,
    )
    families = discrepancy.of(
        record.profile, process_noise.acceleration, linearised, seen, segment_nodes.at_knots(cut, g)
    )
    accelerations = families.accelerations(cut, g)
    columns = columns.with_misfit(families.count)
    sizes = {family.name: FIRST_SIZE for family in families.families}
    path = linear = about = None
    last = False
    whole, firm = np.concatenate((theta, np.zeros(linearised - base))), wide
    for round_ in range(rounds + 1):
        if linear is None:
            path = linearisation.pulled(model, whole, cut, g, firm)
        else:
            before, whole = whole, np.concatenate((theta, np.zeros(linearised - base)))
            path = linearisation.ahead(linear, whole - before, firm, about)
        held = anchored(start, theta, columns)
        linear = linearisation.linear(model, whole, cut, g, path, moved, observed)
        joint = _Joint(linear, accelerations, columns, held, families.families)
        found, _ = joint.solved(process_noise, sizes)
        process_noise = joint.noise(found, process_noise, ON_THE_WAY)
        firm = hold(process_noise, process_noise.acceleration)
        found, gain = joint.solved(process_noise, sizes)
        about = accelerations @ joint.weights(process_noise, sizes)
        far = float(np.abs(found[:base]).max(initial=0.0))
        if last or round_ == rounds or (gain < NEAR and far < CLOSE):
            process_noise = joint.noise(found, process_noise, AT_REST)
            break
        moved_to = theta + (found * columns.unit)[:base] * min(1.0, LONGEST_MOVE / far)
        edge = 1e-6 * (start.high - start.low)
        edge = np.where(np.isfinite(edge), edge, 0.0)
        moved_to = np.clip(moved_to, start.low + edge, start.high - edge)
        step = np.abs((moved_to - theta) / columns.unit[:base])
        last, theta = float(step.max(initial=0.0)) < AT_BOUNDS, moved_to
    assert path is not None
    return Converged(theta, path, process_noise)


@dataclass(frozen=True)
class _Joint:
    """Coefficients, causes' numbers and weights of the discrepancy on one linearised campaign.

    accelerations  [S, 3J, W] of each weight; held [C] as `anchored` gives it
    """

    linear: Linear
    accelerations: np.ndarray
    columns: Columns
    held: np.ndarray
    families: Sequence[discrepancy.Family]

    def solved(
        self, process_noise: ProcessNoise, sizes: dict[str, float]
    ) -> tuple[np.ndarray, float]:
        """[C] most probable numbers, in units; and the log Bayes factor, in nats, of moving the
        base's there in the linear model (half a Newton decrement). `sizes`, of each family's
        weights, are estimated on the way."""
        base, total = self.columns.base, self._total(process_noise)
        for step in range(SIZE_STEPS + 1):
            inverse = np.linalg.inv(total[1:, 1:] + np.diag(self._known(sizes)))
            found = inverse @ (total[1:, 0] + self.held)
            if step == SIZE_STEPS or not self.families:
                break
            for family in self.families:
                at = family.columns
                square = float((found[at] ** 2 + np.diagonal(inverse)[at]).mean())
                sizes[family.name] = max(math.sqrt(square), LEAST_SIZE)
        moved = found[:base]
        return found, 0.5 * float(moved @ np.linalg.solve(inverse[:base, :base], moved))

    def weights(self, process_noise: ProcessNoise, sizes: Mapping[str, float]) -> np.ndarray:
        """[W] as `discrepancy_here` gives them."""
        return discrepancy_here(self._total(process_noise), self._known(sizes), self.columns)

    def _total(self, process_noise: ProcessNoise) -> np.ndarray:
        by = np.concatenate(([1.0], self.columns.unit))
        modes = likelihood.modes(likelihood.weighed(self.linear, process_noise), process_noise)
        modes = modes.joined(self.accelerations)
        return modes.total(np.ones(len(self.linear.e))) * np.outer(by, by)

    def _known(self, sizes: Mapping[str, float]) -> np.ndarray:
        known = self.columns.known.copy()
        for family in self.families:
            known[family.columns] = sizes[family.name] ** -2.0
        return known

    def noise(self, found: np.ndarray, process_noise: ProcessNoise, rounds: int) -> ProcessNoise:
        """Instrument and process noise of what these numbers [C] leave."""
        count = self.columns.linearised
        left = self.linear.less(self.accelerations @ found[count:])
        numbers = (found * self.columns.unit)[:count]
        return likelihood.learnt(left, numbers, process_noise, rounds=rounds)


def discrepancy_here(total: np.ndarray, known: np.ndarray, columns: Columns) -> np.ndarray:
    """[W] most probable weights of the discrepancy, all other numbers staying where they are
    linearised: a path is simulated with those, and follows the discrepancy from there.

    total   products [1 + C, 1 + C] of a campaign; known [C] information on its numbers
    """
    at = np.arange(columns.linearised, len(columns.unit))
    return np.linalg.solve(total[np.ix_(1 + at, 1 + at)] + np.diag(known[at]), total[1 + at, 0])


def anchored(start: Start, theta: np.ndarray, columns: Columns) -> np.ndarray:
    """[C] how the run's own coefficients pull on those that stand elsewhere, in units.

    Forces and masses share a scale: held to where they last stood, and not to the run's, masses
    halve in a few rounds, and a load is found to weigh less than it does.
    """
    pull = np.zeros(len(columns.unit))
    pull[: columns.base] = (start.values - theta) / columns.unit[: columns.base]
    return pull


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


def columns_of(model: Extended, setting: Setting, start: Start) -> Columns:
    sizes = [cause.sizes(setting) for cause in model.causes]
    return Columns(len(start.values), model.causes, np.concatenate((start.spread, *sizes)))


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


def marginal(gram: np.ndarray, information: np.ndarray, pull: np.ndarray) -> float:
    """Log likelihood of [e | J] with its numbers integrated out, up to what no number changes."""
    both = gram[1:, 1:] + information
    towards = gram[1:, 0] + pull
    square = gram[0, 0] + pull @ np.linalg.solve(information, pull)
    square -= towards @ np.linalg.solve(both, towards)
    return -0.5 * float(square + np.linalg.slogdet(both)[1] - np.linalg.slogdet(information)[1])


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
    at = converged(model, setting, start, record, rounds=0 if given else LINEARISATIONS)
    kappa, least = (CAREFUL_KAPPA, CAMPAIGN) if inputs is None else (None, VOYAGES)
    whole = learn(model, setting, start, record, at, kappa, least, inputs)
    columns = whole.columns
    information = np.diag(columns.known.copy())
    causes = slice(columns.base, columns.linearised)
    # without a nominal campaign no cause has a nominal size
    information[causes, causes] = np.eye(columns.linearised - columns.base) * HELD_INFORMATION
    return replace(
        whole, information=information, pull=whole.anchor, nominal=None, modes=None,
        adapts=not given, learned=inputs is not None,
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
