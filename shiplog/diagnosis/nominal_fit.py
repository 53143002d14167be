"""The fit of a nominal campaign: where its model, its discrepancy and its noise converge."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis import discrepancy, likelihood, linearisation, segment_nodes, segments
from shiplog.diagnosis.likelihood import ProcessNoise
from shiplog.diagnosis.linear_segments import Linear, Path, Wide
from shiplog.diagnosis.measurement_correction import read
from shiplog.diagnosis.parameter_layout import Columns
from shiplog.models.causes import Setting
from shiplog.models.extended import Extended
from shiplog.models.starting_values import Start
from shiplog.voyages.recording import Record

LINEARISATIONS = 20  # of moving the coefficients to where they are linearised, at most
LONGEST_MOVE = 2.0  # plausible spreads that a coefficient moves in one round
NEAR, CLOSE = 5.0, 0.7  # nats and plausible spreads, for which they are not moved on
AT_BOUNDS = 0.05  # plausible spreads: all that can still move has converged
ON_THE_WAY, AT_REST = 2, 3  # rounds in which instrument and process noise are estimated
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
        found, _, _ = joint.solved(process_noise, sizes)
        process_noise = joint.noise(found, process_noise, ON_THE_WAY)
        firm = hold(process_noise, process_noise.acceleration)
        found, gain, weights = joint.solved(process_noise, sizes)
        about = accelerations @ weights
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
    ) -> tuple[np.ndarray, float, np.ndarray]:
        """[C] most probable numbers, in units; and the log Bayes factor, in nats, of moving the
        base's there in the linear model (half a Newton decrement); and weights [W] as
        `discrepancy_here` gives them. `sizes`, of each family's weights, are estimated on the way.
        """
        base, by = self.columns.base, np.concatenate(([1.0], self.columns.unit))
        modes = likelihood.modes(likelihood.weighed(self.linear, process_noise), process_noise)
        modes = modes.joined(self.accelerations)
        total = modes.total(np.ones(len(self.linear.e))) * np.outer(by, by)
        for step in range(SIZE_STEPS + 1):
            known = self._known(sizes)
            inverse = np.linalg.inv(total[1:, 1:] + np.diag(known))
            found = inverse @ (total[1:, 0] + self.held)
            if step == SIZE_STEPS or not self.families:
                break
            for family in self.families:
                at = family.columns
                square = float((found[at] ** 2 + np.diagonal(inverse)[at]).mean())
                sizes[family.name] = max(math.sqrt(square), LEAST_SIZE)
        moved = found[:base]
        gain = 0.5 * float(moved @ np.linalg.solve(inverse[:base, :base], moved))
        return found, gain, discrepancy_here(total, known, self.columns)

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
