"""The fit of a nominal campaign: where its model, its discrepancy and its noise converge."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis.linear import linearisation, segment_nodes, segments
from shiplog.diagnosis.linear.linear_segments import Linear, Path, Wide
from shiplog.diagnosis.linear.measurement_correction import read
from shiplog.diagnosis.linear.parameter_layout import Columns
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.diagnosis.noise import bounds, discrepancy, likelihood, noise_estimate
from shiplog.diagnosis.noise.campaign_parts import marginal
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.models.causes import Setting
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.voyages.rows.recording import Record

LINEARISATIONS = 20  # of moving the coefficients to where they are linearised, at most
LONGEST_MOVE = 2.0  # plausible spreads that a coefficient moves in one round
NEAR, CLOSE = 5.0, 0.7  # nats and plausible spreads, for which they are not moved on
EDGE = 1e-6  # of a coefficient's range, by which it stays inside its bounds
NO_ROOM = 1e-9  # plausible spreads beyond a bound: bounded least squares needs some room
LOST_NATS = 50.0  # of the campaign's log density: a move that loses more is halved
MOST_HALVINGS = 3  # of one move, at most
ON_THE_WAY, AT_REST = 2, 3  # rounds in which instrument and process noise are estimated
FIRST_NOISE = 0.04  # of the acceleration that a path may have: process noise before it is estimated
FREE = 2.0  # times the process noise: the allowed acceleration at a path's nodes
PROCESS_NOISE_TIME_S = 4.0  # s, of a three-metre ship
FIRST_SIZE = 1.0  # of a family's weights, in units of the process noise
LEAST_SIZE = 0.01  # the same: a model without discrepancy has none of it
SIZE_STEPS = 3  # of expectation-maximisation, of these sizes, each time


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
    and the noise to sizes, that make up for it. A move after which the campaign is far less
    probable is halved. A fit that does not converge is where the campaign was most probable.

    Raises np.linalg.LinAlgError where the model diverges on every segment from the start.
    """
    campaign = _Campaign.of(model, setting, start, record, seen)
    here = best = campaign.first()
    halvings, damping = 0, 1.0  # of a move; it grows back once moves are accepted
    ended = here.converged
    for _ in range(rounds):
        if ended:
            break
        there = campaign.at(campaign.after(here, damping), here)
        if there is None or here.better(there, LOST_NATS):
            if halvings == MOST_HALVINGS:
                break
            halvings, damping = halvings + 1, 0.5 * damping
            continue
        ended = there.converged
        damping = damping if halvings else min(2.0 * damping, 1.0)
        here, halvings = there, 0
        if here.better(best):
            best = here
    return (here if ended else best).at_rest()


@dataclass(frozen=True)
class _Iterate:
    """A campaign linearised with coefficients theta [P], and what is most probable there."""

    theta: np.ndarray
    whole: np.ndarray
    path: Path
    joint: _Joint
    process_noise: ProcessNoise
    sizes: Mapping[str, float]
    solution: _Solution

    @property
    def far(self) -> float:
        """Plausible spreads that a coefficient is still to move, at most."""
        return float(np.abs(self.solution.found[: len(self.theta)]).max(initial=0.0))

    def better(self, other: _Iterate, nats: float = 0.0) -> bool:
        """Whether its model diverges on fewer segments; on as many, whether the campaign is more
        probable, by more than these nats: what a model diverges on is not in its density."""
        lost, lost_there = (int(of.joint.linear.lost.sum()) for of in (self, other))
        if lost != lost_there:
            return lost < lost_there
        return self.solution.value > other.solution.value + nats

    @property
    def converged(self) -> bool:
        return self.solution.gain < NEAR and self.far < CLOSE

    def at_rest(self) -> Converged:
        """The fit that ends here, with the noise estimated once more."""
        noise = self.joint.noise(self.solution.found, self.process_noise, AT_REST)
        return Converged(self.theta, self.path, noise)


@dataclass(frozen=True)
class _Campaign:
    """A nominal campaign that is linearised again and again, with its discrepancy's families.

    moved, observed  as `measurement_correction.read` gives them
    accelerations    [S, 3J, W] of each weight of the discrepancy
    begin            process noise before any is estimated
    """

    model: Extended
    start: Start
    cut: Cut
    moved: np.ndarray
    observed: np.ndarray
    grid: SegmentGrid
    wide: Wide
    columns: Columns
    families: Sequence[discrepancy.Family]
    accelerations: np.ndarray
    begin: ProcessNoise

    @classmethod
    def of(
        cls, model: Extended, setting: Setting, start: Start, record: Record, seen: Sequence[str]
    ) -> _Campaign:
        columns = columns_of(model, setting, start)
        wide, grid, of = wide_of(setting), segments.grid(record), record.timescale
        cut, moved, observed = read(model, setting, record, segments.begins(record))
        begin = ProcessNoise(
            wide.noise, FIRST_NOISE * wide.acceleration, PROCESS_NOISE_TIME_S * of.factor,
            wide.start, bin=of.bin, knot=of.knot,
            intermittent_time=likelihood.INTERMITTENT_TIME_S * of.factor,
        )  # fmt: skip
        found = discrepancy.of(
            record.profile, begin.acceleration, columns.linearised, seen,
            segment_nodes.at_knots(cut, grid),
        )  # fmt: skip
        return cls(
            model, start, cut, moved, observed, grid, wide, columns.with_misfit(found.count),
            found.families, found.accelerations(cut, grid), begin,
        )  # fmt: skip

    def first(self) -> _Iterate:
        """With the coefficients that the fit starts from, about paths onto the measurement."""
        theta = np.clip(self.start.values, self.start.low, self.start.high)
        whole = self._whole(theta)
        path = linearisation.pulled(self.model, whole, self.cut, self.grid, self.wide)
        sizes = {family.name: FIRST_SIZE for family in self.families}
        return self._solved(theta, whole, path, self.begin, sizes)

    def at(self, theta: np.ndarray, near: _Iterate) -> _Iterate | None:
        """With other coefficients, about paths that a linearisation near them predicts; None where
        the model diverges."""
        whole = self._whole(theta)
        path = linearisation.ahead(
            near.joint.linear, whole - near.whole,
            hold(near.process_noise, near.process_noise.acceleration),
            self.accelerations @ near.solution.weights,
        )  # fmt: skip
        try:
            return self._solved(theta, whole, path, near.process_noise, near.sizes)
        except np.linalg.LinAlgError:
            return None

    def after(self, here: _Iterate, damping: float) -> np.ndarray:
        """Coefficients [P] one damped step on."""
        step = (here.solution.found * self.columns.unit)[: len(here.theta)]
        return here.theta + step * damping * min(1.0, LONGEST_MOVE / max(here.far, 1e-12))

    def _room(self, theta: np.ndarray) -> np.ndarray:
        """[2, P] how far each coefficient may move, in units: to just inside its bounds."""
        edge = EDGE * (self.start.high - self.start.low)
        edge = np.where(np.isfinite(edge), edge, 0.0)
        ends = np.stack((self.start.low + edge, self.start.high - edge)) - theta
        room = ends / self.columns.unit[: len(theta)]
        return np.stack((np.minimum(room[0], -NO_ROOM), np.maximum(room[1], NO_ROOM)))

    def _whole(self, theta: np.ndarray) -> np.ndarray:
        return np.concatenate((theta, np.zeros(self.columns.linearised - self.columns.base)))

    def _solved(
        self, theta: np.ndarray, whole: np.ndarray, path: Path, process_noise: ProcessNoise,
        sizes: Mapping[str, float],
    ) -> _Iterate:  # fmt: skip
        """Noise, then all numbers, of the campaign about a path. Raises np.linalg.LinAlgError where
        the model diverges on every segment."""
        linear = linearisation.linear(
            self.model, whole, self.cut, self.grid, path, self.moved, self.observed
        )
        if linear.lost.all():
            raise np.linalg.LinAlgError("the model diverges on every segment of the campaign")
        held = anchored(self.start, theta, self.columns)
        joint = _Joint(
            linear, self.accelerations, self.columns, held, self.families, self._room(theta)
        )
        before = joint.solved(process_noise, sizes)
        process_noise = joint.noise(before.found, process_noise, ON_THE_WAY)
        solution = joint.solved(process_noise, before.sizes)
        return _Iterate(theta, whole, path, joint, process_noise, solution.sizes, solution)


@dataclass(frozen=True)
class _Solution:
    """What is most probable on one linearised campaign.

    found    [C] numbers, in units, the coefficients within their bounds
    gain     log Bayes factor [nats] of moving the coefficients there in the linear model
    weights  [W] as `discrepancy_here` gives them
    sizes    of each family's weights
    value    log density [nats] of the campaign and of the coefficients where it is linearised: all
             other numbers are integrated out; segments on which the model diverges are not in it
    """

    found: np.ndarray
    gain: float
    weights: np.ndarray
    sizes: Mapping[str, float]
    value: float


@dataclass(frozen=True)
class _Joint:
    """Coefficients, causes' numbers and weights of the discrepancy on one linearised campaign.

    accelerations  [S, 3J, W] of each weight; held [C] as `anchored` gives it
    room           [2, P] least and greatest move of each coefficient, in units
    """

    linear: Linear
    accelerations: np.ndarray
    columns: Columns
    held: np.ndarray
    families: Sequence[discrepancy.Family]
    room: np.ndarray

    def solved(self, process_noise: ProcessNoise, sizes: Mapping[str, float]) -> _Solution:
        """All numbers; the `sizes` of each family's weights are estimated on the way."""
        by = np.concatenate(([1.0], self.columns.unit))
        modes = likelihood.modes(likelihood.weighed(self.linear, process_noise), process_noise)
        modes = modes.joined(self.accelerations)
        total = modes.total(np.ones(len(self.linear.e))) * np.outer(by, by)
        sizes = dict(sizes)
        for step in range(SIZE_STEPS + 1):
            known = self._known(sizes)
            inverse = np.linalg.inv(total[1:, 1:] + np.diag(known))
            found, gain = within(inverse @ (total[1:, 0] + self.held), inverse, self.room)
            if step == SIZE_STEPS or not self.families:
                break
            for family in self.families:
                at = family.columns
                square = float((found[at] ** 2 + np.diagonal(inverse)[at]).mean())
                sizes[family.name] = max(math.sqrt(square), LEAST_SIZE)
        weights = discrepancy_here(total, known, self.columns)
        value = self._density(total, known) - 0.5 * modes.log_volume()
        return _Solution(found, gain, weights, sizes, value)

    def _density(self, total: np.ndarray, known: np.ndarray) -> float:
        """Log density of [e | J] and of the coefficients where they are."""
        base = self.columns.base
        others = np.append(0, np.arange(1 + base, len(total)))
        known, pull = np.diag(known[base:]), self.held[base:]
        found = marginal(total[np.ix_(others, others)], known, pull)
        return found - 0.5 * float(self.held[:base] @ self.held[:base])

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
        return noise_estimate.learnt(left, numbers, process_noise, rounds=rounds)


def within(free: np.ndarray, covariance: np.ndarray, room: np.ndarray) -> tuple[np.ndarray, float]:
    """The most probable numbers [C] with the first P of them within `room` [2, P], and the nats
    that those gain by moving there from zero.

    free    [C] the most probable numbers without bounds; covariance [C, C] theirs
    """
    first = slice(room.shape[1])
    moved = bounds.within(free[first], covariance[first, first], *room)
    information = np.linalg.inv(covariance[first, first])
    gain = float(moved @ information @ (free[first] - 0.5 * moved))
    # the other numbers go with those that a bound keeps from where they would be
    return free + covariance[:, first] @ information @ (moved - free[first]), gain


def discrepancy_here(total: np.ndarray, known: np.ndarray, columns: Columns) -> np.ndarray:
    """[W] most probable weights of the discrepancy, all other numbers staying where they are
    linearised: a path is simulated with those, and follows the discrepancy from there.

    total   products [1 + C, 1 + C] of a campaign; known [C] information on its numbers
    """
    at = np.arange(columns.linearised, len(columns.unit))
    return np.linalg.solve(total[np.ix_(1 + at, 1 + at)] + np.diag(known[at]), total[1 + at, 0])


def anchored(start: Start, theta: np.ndarray, columns: Columns) -> np.ndarray:
    """Pull [C], in units, of the run's own coefficients on those that have moved.

    Forces and masses share a scale. Held to their last values instead of the run's, masses would
    halve in a few rounds, and a load would be found too light.
    """
    pull = np.zeros(len(columns.unit))
    pull[: columns.base] = (start.values - theta) / columns.unit[: columns.base]
    return pull


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


def columns_of(model: Extended, setting: Setting, start: Start) -> Columns:
    sizes = [cause.sizes(setting) for cause in model.causes]
    return Columns(len(start.values), model.causes, np.concatenate((start.spread, *sizes)))
