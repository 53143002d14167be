"""An intermittent side force at one place of a trial, its nominal part, and its pattern.

Random forces on a ship often act at one place, and in bursts. In rougher weather the same forces
are larger, and no device is at work.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import fits, unrecorded_thruster
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.linear.segments import SegmentGrid
from shiplog.diagnosis.noise import likelihood, on_off, raised_noise
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.noise.on_off import ON, STRONGEST
from shiplog.diagnosis.noise.raised_noise import Left
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.trial.fitted import Fit
from shiplog.diagnosis.trial.trial import Trial

# How the pattern of a force is read
OFF = 0.2  # share of the strongest, below which it is off
KNOWN = 2.0  # standard deviations of the estimate: a weaker force shows no pattern
COMES_AND_GOES = 0.5  # of the time: what is on for longer is no device that comes and goes
NO_NOISE = 1e-9  # of the process noise, that leaves the intermittent force by itself
VARIES = 1.0  # time between over time on, from which a force merely varies: a Gaussian one has 1.13


def nominal_side_force(campaign: Campaign, g: SegmentGrid) -> Remainder | None:
    """Nominal process noise that acts at one place; None where independent noise in each channel is
    more probable.

    Each part's numbers are predicted by the other voyages and itself, as a trial's are.
    """
    reference = campaign.reference
    linear = reference.nominal
    if linear is None or not campaign.weight.sum():
        return None
    accelerations = campaign.discrepancy.accelerations(linear.cut, g)
    unit, share = reference.columns.unit, reference.counts
    own = np.empty((len(linear.e), len(unit)))
    names = np.unique(campaign.voyage)
    for rows, part, voyage in zip(campaign.rows, campaign.parts, campaign.voyage, strict=True):
        left_out = int(np.searchsorted(names, voyage))
        information, pull = campaign.prior_without(left_out, campaign.apart)
        gram = share * part[: 1 + len(pull), : 1 + len(pull)]
        own[rows] = np.linalg.solve(gram[1:, 1:] + information, gram[1:, 0] + pull) * unit
    left, none = linear.less_numbers(own, accelerations), np.zeros(linear.j.shape[-1])
    kept = raised_noise.left_by(
        left, none, reference.process_noise, campaign.weight, reference.counts
    )
    found = unrecorded_thruster.estimate_side_force(kept, reference)
    return found.remainder if found.gain > 0.0 else None


def side_force(trial: Trial, fit: Fit, at_one_place: Remainder | None = None) -> SideForce:
    """Of what a hypothesis leaves; `at_one_place` as `raised_noise.by_channel` has it. It is on or
    off where its pattern may be that of a device, and such a course is more probable: that of this
    estimate, or the one that the hypothesis has."""
    left = noise_left(trial, fit)
    found = unrecorded_thruster.estimate_side_force(left, trial.reference, at_one_place)
    if found.gain <= 0.0:
        return found
    force, deviation = force_at_nodes(trial, fit, found, trial.process_noise(found.remainder))
    found = replace(found, device=of_one_device(force, deviation))
    if found.device == 0.0:
        return found
    kept = trial.weight > 0.0
    rows = segment_nodes.rows_at_knots(trial.rows[kept], trial.grid)
    courses = (on_off.course(force[kept], np.abs(deviation[kept]), rows), fit.remainder.course)
    devices = (
        unrecorded_thruster.estimate_on_off_force(left, trial.reference, found, course, rows)
        for course in courses
        if course is not None
    )
    return max((found, *devices), key=lambda one: one.value)


def noise_left(trial: Trial, fit: Fit) -> Left:
    """What a hypothesis leaves, to be explained by noise."""
    left, d = fits.residual(trial, fit.point.linear, fit)
    ref = trial.reference
    return raised_noise.left_by(left, d, ref.process_noise, trial.weight, ref.counts)


def with_pattern(trial: Trial, fit: Fit, side_force: SideForce) -> SideForce:
    """The same with the probability that it is one device's; `fit` has it in its remainder. Of a
    force that is on or off, the course was found with that probability."""
    if side_force.course is not None:
        return side_force
    return replace(side_force, device=of_one_device(*force_at_nodes(trial, fit, side_force)))


def force_at_nodes(
    trial: Trial, fit: Fit, side_force: SideForce, process_noise: ProcessNoise | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Force of the unrecorded thruster at the knots and its standard deviation [S, J] in N; of a
    hypothesis whose remainder has it, or in the given process noise that has it."""
    if process_noise is None:
        process_noise = trial.process_noise(fit.remainder).times(fit.found.noise_factor)
    left = fits.residual(trial, fit.point.linear, fit)
    z, covariance = likelihood.starts_and_knots(*left, process_noise)
    knots = trial.grid.knots
    kernel = process_noise.kernel(knots)
    alone = replace(process_noise, acceleration=NO_NOISE * process_noise.acceleration)
    intermittent = alone.kernel(knots)
    share = intermittent @ np.linalg.inv(kernel)
    accelerations = (share @ z[:, 6:, None]).reshape(len(z), 3, knots)
    sway = slice(knots, 2 * knots)
    beyond = (intermittent - share @ intermittent)[..., sway, sway]
    of_sway = share[..., sway, :]
    known = of_sway @ covariance[:, 6:, 6:] @ np.swapaxes(of_sway, -1, -2)
    variance = np.diagonal(known + beyond, axis1=1, axis2=2)
    return accelerations[:, 1] / side_force.unit[1], np.sqrt(
        np.maximum(variance, 0.0)
    ) / side_force.unit[1]


def active_intervals(trial: Trial, fit: Fit, side_force: SideForce) -> list[dict]:
    """When the unrecorded thruster worked: voyage, start_s, end_s, strongest force_N and its sd_N.
    It starts and stops between two knots, on average half of the time between them away."""
    force, sd = force_at_nodes(trial, fit, side_force)
    rows = segment_nodes.rows_at_knots(trial.rows, trial.grid)
    course = side_force.course or on_off.course(force, np.abs(sd), rows)
    record, half = trial.record, 0.5 * trial.grid.knot
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


def of_one_device(force: np.ndarray, deviation: np.ndarray) -> float:
    """Probability that a side force [S, J], N, is that of one device, which is on or off: one,
    zero, or a half where its pattern is between both.

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
