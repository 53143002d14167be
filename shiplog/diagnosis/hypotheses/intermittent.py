"""An intermittent side force at one place of a trial, its nominal part, and its pattern.

Random forces on a ship often act at one place, and in bursts. In rougher weather the same forces
are larger, and no device is at work.

The acceleration a at the nodes of a segment is process noise n and that of the force f:

    a = n + f,   n ~ N(0, λ² Q_n),   f ~ N(0, Q_f),   Q = λ² Q_n + Q_f                   (1)
    f | a ~ N(K a, Q_f - K Q_f),   K = Q_f Q⁻¹                                      gain (2)
    f | r ~ N(K â, K V Kᵀ + Q_f - K Q_f)                    with a | r ~ N(â, V) [3J, 3J] (3)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import fits, unrecorded_thruster
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.linear.segments import SegmentGrid
from shiplog.diagnosis.noise import on_off, raised_noise
from shiplog.diagnosis.noise.on_off import ON, STRONGEST
from shiplog.diagnosis.noise.raised_noise import Residual, Residuals
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.trial.fitted import Fit
from shiplog.diagnosis.trial.trial import Trial

# How the pattern of a force is read
OFF = 0.2  # share of the strongest, below which it is off
KNOWN = 2.0  # standard deviations of the estimate: a weaker force shows no pattern
COMES_AND_GOES = 0.5  # of the time: what is on for longer is no device that comes and goes
VARIES = 1.0  # time between over time on, from which a force merely varies: a Gaussian one has 1.13


@dataclass(frozen=True)
class ResidualNoise:
    """Estimates of the noise that explains the residual of a fit.

    at_one_place  whether nominal process noise that acts at one place is looked for: it is then
                  raised with the rest
    """

    trial: Trial
    at_one_place: bool = True

    @cached_property
    def nominal(self) -> Remainder | None:
        """As `nominal_side_force`."""
        if not self.at_one_place:
            return None
        return nominal_side_force(self.trial.campaign, self.trial.grid)

    def raised(self, fit: Fit) -> Remainder:
        """Process noise raised in each channel by itself."""
        return raised_noise.raise_channels(noise_left(self.trial, fit), self.nominal)[1]

    def side_force(self, fit: Fit) -> SideForce:
        """As `side_force`, with its log Bayes factor over raised noise, whose nominal part acts at
        one place too."""
        return side_force(self.trial, fit, self.nominal)

    def add_pattern(self, fit: Fit, force: SideForce) -> SideForce:
        """As `add_pattern`."""
        return add_pattern(self.trial, fit, force)


def nominal_side_force(campaign: Campaign, g: SegmentGrid) -> Remainder | None:
    """Nominal process noise that acts at one place; None where independent noise in each channel is
    more probable.

    The residual of each part is left by its own posterior mean A⁻¹ b, (6) and (7) of this room,
    with the other voyages as its prior, as for a trial.
    """
    reference = campaign.reference
    linear = reference.nominal
    if linear is None or not campaign.weight.sum():
        return None
    accelerations = partial(campaign.discrepancy.accelerations, g=g)
    unit, c = reference.columns.unit, reference.counts
    d = np.empty((len(linear.e), len(unit)))
    names = np.unique(campaign.voyage)
    for rows, part, voyage in zip(campaign.rows, campaign.parts, campaign.voyage, strict=True):
        left_out = int(np.searchsorted(names, voyage))
        P_inv, P_inv_mu = campaign.prior_without(left_out, campaign.apart)
        G = c * part[: 1 + len(P_inv_mu), : 1 + len(P_inv_mu)]
        d[rows] = np.linalg.solve(G[1:, 1:] + P_inv, G[1:, 0] + P_inv_mu) * unit
    left, none = linear.less_numbers(d, accelerations), np.zeros(linear.j.shape[-1])
    kept = raised_noise.residual(
        left, none, reference.process_noise, campaign.weight, reference.counts
    )
    found = unrecorded_thruster.estimate_side_force(kept, reference)
    return found.remainder if found.gain > 0.0 else None


def side_force(trial: Trial, fit: Fit, at_one_place: Remainder | None = None) -> SideForce:
    """The most probable intermittent side force in the residual of a hypothesis.

    It is on or off where its pattern may be that of a device, and such a course is more probable:
    that of this estimate, or the one that the hypothesis has. `at_one_place` as
    `raised_noise.raise_channels` has it."""
    left = noise_left(trial, fit)
    found = unrecorded_thruster.estimate_side_force(left, trial.reference, at_one_place)
    if found.gain <= 0.0:
        return found
    force, deviation = force_at_nodes(trial, fit, found, found.remainder)
    found = replace(found, device=device_probability(force, deviation))
    if found.device == 0.0:
        return found
    kept = trial.weight > 0.0
    rows = segment_nodes.rows_of_nodes(trial.rows[kept], trial.grid)
    courses = (on_off.course(force[kept], np.abs(deviation[kept]), rows), fit.remainder.course)
    devices = (
        unrecorded_thruster.estimate_on_off_force(left, trial.reference, found, course, rows)
        for course in courses
        if course is not None
    )
    return max((found, *devices), key=lambda one: one.value)


def noise_left(trial: Trial, fit: Fit) -> Residual | Residuals:
    """The residual r - W w - J d of a hypothesis, to be explained by noise."""
    return trial.noise_left(fit.point, fits.numbers_from_point(trial, fit))


def add_pattern(trial: Trial, fit: Fit, side_force: SideForce) -> SideForce:
    """The force with the probability that it is that of one device, by its pattern; `fit` has the
    force in its remainder. Of a force that is on or off, the course was found with it."""
    if side_force.course is not None:
        return side_force
    return replace(side_force, device=device_probability(*force_at_nodes(trial, fit, side_force)))


def force_at_nodes(
    trial: Trial, fit: Fit, side_force: SideForce, remainder: Remainder | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation (3) of the unrecorded thruster's force at the nodes [S, J], N.

    It is that of a hypothesis whose remainder has it, or of the given remainder that has it, with
    λ = 1."""
    noise = 1.0 if remainder is not None else fit.estimate.noise_factor
    d = fits.numbers_from_point(trial, fit)
    mean, variance = trial.force_across(fit.point, d, noise, remainder or fit.remainder)
    newton = side_force.unit[1]  # sway acceleration of 1 N
    return mean / newton, np.sqrt(np.maximum(variance, 0.0)) / newton


def active_intervals(trial: Trial, fit: Fit, side_force: SideForce) -> list[dict]:
    """When the unrecorded thruster worked: voyage, start_s, end_s, strongest force_N and its sd_N.
    It starts and stops between two nodes, on average half of the time between them away."""
    force, sd = force_at_nodes(trial, fit, side_force)
    rows = segment_nodes.rows_of_nodes(trial.rows, trial.grid)
    course = side_force.course or on_off.course(force, np.abs(sd), rows)
    record, half = trial.record, 0.5 * trial.grid.node_step
    times: list[dict] = []
    for first, last in course.on if course else ():
        size = np.where((rows >= first) & (rows <= last), np.abs(force), -1.0)
        strongest = np.unravel_index(size.argmax(), size.shape)
        of_voyage = record.time[record.voyage == record.voyage[first]]
        times.append({
            "voyage": record.names[record.voyage[first]],
            "start_s": float(max(record.time[first] - half, of_voyage[0])),
            "end_s": float(min(record.time[last] + half, of_voyage[-1])),
            "force_N": float(force[strongest]), "sd_N": float(sd[strongest]),
        })  # fmt: skip
    return times


def device_probability(force: np.ndarray, deviation: np.ndarray) -> float:
    """Probability 1, ½ or 0 that a side force [S, J], N, is that of one device, which is on or
    off; ½ where its pattern is between both.

    A force that merely varies is between its extremes for much of the time: a Gaussian one is 1.13
    times as long between 0.2 and 0.5 of its 95 % quantile as above. A device is hardly ever
    between, and is on for less than COMES_AND_GOES of the time.

    `deviation` [S, J] is the standard deviation of the estimate.
    """
    size = np.abs(force)
    strongest = float(np.quantile(size, STRONGEST))
    if strongest < KNOWN * float(np.median(deviation)):
        return 0.0
    on = size > ON * strongest
    between = (size > OFF * strongest) & ~on
    share = between.sum() / on.sum()
    if on.mean() > COMES_AND_GOES:
        return 0.0
    if share < thresholds.BETWEEN:
        return 1.0
    return 0.5 if share < VARIES else 0.0
