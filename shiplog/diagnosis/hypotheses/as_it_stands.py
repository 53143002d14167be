"""The model as it stands against a trial, before any hypothesis: which segments count."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses import evidence
from shiplog.diagnosis.noise.campaign_parts import robust_weights
from shiplog.diagnosis.trial.fitted import Point
from shiplog.diagnosis.trial.trial import Numbers, Trial

MOST_PATHS = 8  # of the model as it stands, one closer to the measurement than the other, at most


def begin(trial: Trial, numbers: Numbers) -> tuple[Trial, Point]:
    """The trial with weights of its segments, and the model as it stands, linearised.

    The path is limited by the process noise that was estimated about the path before, until the
    evidence stays: causes must not gain by a path that converges with them. Segments on which the
    model diverges carry no information; nor do those on which it does so where the path is limited
    by the nominal process noise, as that of the right hypothesis will be. Raises
    np.linalg.LinAlgError where it diverges on all."""
    first = trial.linearise(numbers)
    trial = replace(trial.leave_out(first.linear.lost), first=first)
    trial = replace(trial, weight=robust(trial, first))
    point, last = first, -np.inf
    for _ in range(MOST_PATHS):
        base, _ = evidence.scan(trial, point, (), trial.fixed)
        if abs(base.evidence - last) < evidence.LITTLE_NATS:
            break
        point, last = trial.linearise(numbers, point, base.noise_factor), base.evidence
    lost = point.linear.lost
    if base.noise_factor > thresholds.ORDINARY_NOISE:
        lost = lost | trial.linearise(numbers, point, 1.0).linear.lost
    trial = trial.leave_out(lost)
    if not trial.weight.any():  # a prior without data would name nothing, as if nothing had changed
        raise np.linalg.LinAlgError("the model diverges on every segment of the trial")
    return replace(trial, begun=True), point


def robust(trial: Trial, point: Point) -> np.ndarray:
    """Weights [S] of the segments by their χ² at the posterior mean, A⁻¹ b (7). They are the same
    for every hypothesis: a few segments must not decide."""
    best = evidence.top(evidence.levels(trial, point))
    ref = trial.reference
    d = best.mean[: len(ref.pull)] * ref.columns.unit
    square = trial.squares(point, d, ref.process_noise.times(best.noise_factor))
    return robust_weights(square, trial.weight > 0.0)
