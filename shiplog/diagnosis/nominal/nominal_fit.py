"""The fit of a nominal campaign: where its model, its discrepancy and its noise converge.

About coefficients θ*, with the products G of the campaign in units u (`noise`), numbers
x = (d_θ, causes' numbers, w), the prior information K = diag(1, …, 1/s_f²) and the pull η:

    V = (M + K)⁻¹,   x̂ = V (g + η),   η_θ = (θ_run - θ*)/u           all numbers
    s_f² = mean over family f of (ŵ² + diag V_ww)                     sizes of the discrepancy
    σ, q maximise p(e - J x̂)                                          `noise_estimate`
    θ* ← θ* + α u x̂_θ,   α = damping · min(1, LONGEST_MOVE/max|x̂_θ|)  the next linearisation

until x̂_θ is small. A move is judged by the log density of the campaign and of θ*, all other
numbers integrated out:  log p(e | θ*) - ½ |(θ_run - θ*)/u|².
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis.linear import linearisation, segment_nodes, segments
from shiplog.diagnosis.linear.linear_segments import Linear, Path, Wide
from shiplog.diagnosis.linear.measurement_correction import Moved, read
from shiplog.diagnosis.linear.parameter_layout import Columns
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.diagnosis.noise import (
    bounds,
    discrepancy,
    likelihood,
    noise_estimate,
    part_products,
)
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
    probable is halved. A fit that does not converge is where the campaign was most probable:
    argmax of log p(e | θ*) - ½ |(θ_run - θ*)/u|² over the iterates, of those on which the model
    diverges on fewest segments.

    Raises np.linalg.LinAlgError where the model diverges on every segment from the start.
    """
    campaign = _Campaign.build(model, setting, start, record, seen)
    here = best = campaign.first()
    halvings, damping = 0, 1.0  # of a move; it grows back once moves are accepted
    ended = here.converged
    for _ in range(rounds):
        if ended:
            break
        there = campaign.linearise(campaign.move(here, damping), here)
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
    return (here if ended else best).finish()


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
        """max |x̂_θ|: plausible spreads that a coefficient is still to move, at most."""
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
        """gain < NEAR and max|x̂_θ| < CLOSE."""
        return self.solution.gain < NEAR and self.far < CLOSE

    def finish(self) -> Converged:
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
    moved: Moved
    observed: np.ndarray
    grid: SegmentGrid
    wide: Wide
    columns: Columns
    families: Sequence[discrepancy.Family]
    accelerations: np.ndarray
    begin: ProcessNoise

    @classmethod
    def build(
        cls, model: Extended, setting: Setting, start: Start, record: Record, seen: Sequence[str]
    ) -> _Campaign:
        columns = columns_of(model, setting, start)
        wide, grid, of = wide_of(setting), segments.grid(record), record.timescale
        cut, moved, observed = read(model, setting, record, segments.begins(record))
        begin = ProcessNoise(
            wide.noise, FIRST_NOISE * wide.acceleration, PROCESS_NOISE_TIME_S * of.factor,
            wide.start, bin=of.bin, node_step=of.node_step,
            intermittent_time=likelihood.INTERMITTENT_TIME_S * of.factor,
        )  # fmt: skip
        found = discrepancy.build(
            record.profile, begin.acceleration, columns.linearised, seen,
            segment_nodes.conditions_at_nodes(cut, grid),
        )  # fmt: skip
        return cls(
            model, start, cut, moved, observed, grid, wide, columns.with_misfit(found.count),
            found.families, found.accelerations(cut, grid), begin,
        )  # fmt: skip

    def first(self) -> _Iterate:
        """With the coefficients that the fit starts from, about paths onto the measurement."""
        theta = np.clip(self.start.values, self.start.low, self.start.high)
        whole = self._whole(theta)
        path = linearisation.fit_path(self.model, whole, self.cut, self.grid, self.wide)
        sizes = {family.name: FIRST_SIZE for family in self.families}
        return self._solved(theta, whole, path, self.begin, sizes)

    def linearise(self, theta: np.ndarray, near: _Iterate) -> _Iterate | None:
        """With other coefficients, about paths that a linearisation near them predicts; None where
        the model diverges."""
        whole = self._whole(theta)
        path = linearisation.predict_path(
            near.joint.linear, whole - near.whole,
            hold(near.process_noise, near.process_noise.acceleration),
            self.accelerations @ near.solution.weights,
        )  # fmt: skip
        try:
            return self._solved(theta, whole, path, near.process_noise, near.sizes)
        except np.linalg.LinAlgError:
            return None

    def move(self, here: _Iterate, damping: float) -> np.ndarray:
        """θ* + α u x̂_θ [P], α = damping · min(1, LONGEST_MOVE/max|x̂_θ|): one damped step on."""
        step = (here.solution.found * self.columns.unit)[: len(here.theta)]
        return here.theta + step * damping * min(1.0, LONGEST_MOVE / max(here.far, 1e-12))

    def _room(self, theta: np.ndarray) -> np.ndarray:
        """((low + ε) - θ*, (high - ε) - θ*)/u [2, P]: how far each coefficient may move, in units,
        to just inside its bounds; NO_ROOM at least."""
        edge = EDGE * (self.start.high - self.start.low)
        edge = np.where(np.isfinite(edge), edge, 0.0)
        ends = np.stack((self.start.low + edge, self.start.high - edge)) - theta
        room = ends / self.columns.unit[: len(theta)]
        return np.stack((np.minimum(room[0], -NO_ROOM), np.maximum(room[1], NO_ROOM)))

    def _whole(self, theta: np.ndarray) -> np.ndarray:
        """(θ, 0) [C]: coefficients, and causes' numbers of zero."""
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
        anchor = anchored(self.start, theta, self.columns)
        joint = _Joint(
            linear, self.accelerations, self.columns, anchor, self.families, self._room(theta)
        )
        before = joint.solved(process_noise, sizes)
        process_noise = joint.noise(before.found, process_noise, ON_THE_WAY)
        solution = joint.solved(process_noise, before.sizes)
        return _Iterate(theta, whole, path, joint, process_noise, solution.sizes, solution)


@dataclass(frozen=True)
class _Solution:
    """What is most probable on one linearised campaign.

    found    x̂ [C], numbers in units, the coefficients within their bounds
    gain     log Bayes factor [nats] of moving the coefficients there in the linear model
    weights  ŵ [W] as `discrepancy_here` gives them
    sizes    s_f of each family's weights
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

    accelerations  Φ [S, 3J, W] of each weight; anchor η [C] as `anchored` gives it
    room           [2, P] least and greatest move of each coefficient, in units
    """

    linear: Linear
    accelerations: np.ndarray
    columns: Columns
    anchor: np.ndarray
    families: Sequence[discrepancy.Family]
    room: np.ndarray

    def solved(self, process_noise: ProcessNoise, sizes: Mapping[str, float]) -> _Solution:
        """x̂ = V (g + η), V = (M + K)⁻¹, the coefficients within their bounds; the sizes s_f of each
        family's weights are estimated on the way, s_f² = mean(ŵ² + diag V_ww), SIZE_STEPS times.
        Raises np.linalg.LinAlgError where a matrix is singular."""
        whole = part_products.whole(
            self.linear, process_noise, self.columns.unit, accelerations=self.accelerations
        )
        G = whole.G
        sizes = dict(sizes)
        for step in range(SIZE_STEPS + 1):
            K = self._prior_information(sizes)
            V = np.linalg.inv(G[1:, 1:] + np.diag(K))
            x, gain = most_probable_in_room(V @ (G[1:, 0] + self.anchor), V, self.room)
            if step == SIZE_STEPS or not self.families:
                break
            for family in self.families:
                w = family.columns
                square = float((x[w] ** 2 + np.diagonal(V)[w]).mean())
                sizes[family.name] = max(math.sqrt(square), LEAST_SIZE)
        weights = discrepancy_here(G, K, self.columns)
        value = self._density(G, K) - 0.5 * whole.volume
        return _Solution(x, gain, weights, sizes, value)

    def _density(self, total: np.ndarray, known: np.ndarray) -> float:
        """log p(e | θ*) - ½ |η_θ|², without the volume: log density of the campaign with all other
        numbers integrated out (`marginal` of their rows of G), and of the coefficients."""
        base = self.columns.base
        others = np.append(0, np.arange(1 + base, len(total)))
        K, eta = np.diag(known[base:]), self.anchor[base:]
        log_evidence = marginal(total[np.ix_(others, others)], K, eta)
        return log_evidence - 0.5 * float(self.anchor[:base] @ self.anchor[:base])

    def _prior_information(self, sizes: Mapping[str, float]) -> np.ndarray:
        """K [C]: that of the columns, and 1/s_f² of a family's weights."""
        K = self.columns.prior_information.copy()
        for family in self.families:
            K[family.columns] = sizes[family.name] ** -2.0
        return K

    def noise(self, found: np.ndarray, process_noise: ProcessNoise, rounds: int) -> ProcessNoise:
        """Instrument and process noise of e - J d - Zₐ Φ w, of numbers x = (d, w) [C] in units."""
        count = self.columns.linearised
        left = self.linear.less(self.accelerations @ found[count:])
        numbers = (found * self.columns.unit)[:count]
        return noise_estimate.estimate(left, numbers, process_noise, rounds=rounds)


def most_probable_in_room(
    free: np.ndarray, covariance: np.ndarray, room: np.ndarray
) -> tuple[np.ndarray, float]:
    """The most probable numbers [C] with the first P of them (θ) within `room` [2, P], and the nats
    that those gain by moving there from zero in the linear model.

        x_θ = argmin (x - x̂_θ)ᵀ V_θθ⁻¹ (x - x̂_θ) within room,   gain = x_θᵀ V_θθ⁻¹ (x̂_θ - ½ x_θ)
        x = x̂ + V_•θ V_θθ⁻¹ (x_θ - x̂_θ)

    free        x̂ [C], the most probable numbers without bounds
    covariance  V [C, C], theirs
    """
    theta = slice(room.shape[1])
    x_theta = bounds.bounded_mode(free[theta], covariance[theta, theta], *room)
    information = np.linalg.inv(covariance[theta, theta])
    gain = float(x_theta @ information @ (free[theta] - 0.5 * x_theta))
    # the other numbers go with those that a bound keeps from where they would be
    return free + covariance[:, theta] @ information @ (x_theta - free[theta]), gain


def discrepancy_here(total: np.ndarray, known: np.ndarray, columns: Columns) -> np.ndarray:
    """ŵ = (M_ww + K_ww)⁻¹ g_w [W]: most probable weights of the discrepancy, all other numbers
    staying where they are linearised. A path is simulated with those, and follows the discrepancy
    from there.

    total   G [1 + C, 1 + C], products of a campaign; known   K [C], information on its numbers
    """
    w = np.arange(columns.linearised, len(columns.unit))
    return np.linalg.solve(total[np.ix_(1 + w, 1 + w)] + np.diag(known[w]), total[1 + w, 0])


def anchored(start: Start, theta: np.ndarray, columns: Columns) -> np.ndarray:
    """η [C], in units: η_θ = (θ_run - θ*)/u, the pull of the run's own coefficients on those that
    have moved, and zero for other numbers.

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
    """How far a path may be pulled, from what a ship of this length L and speed U does in seconds:
    start 0.3 L, U, 0.3 rad, U/L; acceleration 0.1 U and 0.1 U/L a second; noise of the profile's
    sensors, or 0.005 L, 0.03 U, 0.003 rad and 0.03 U/L where nobody states it."""
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
    """Layout of x: P coefficients in plausible spreads, then causes' numbers in realistic sizes."""
    sizes = [cause.sizes(setting) for cause in model.causes]
    return Columns(len(start.values), model.causes, np.concatenate((start.spread, *sizes)))
