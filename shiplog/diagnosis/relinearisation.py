"""The named causes, linearised again at their estimates, with a path of their own, until they
converge."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis import evidence
from shiplog.diagnosis.fitted import Found, Point
from shiplog.diagnosis.linear_segments import Path
from shiplog.diagnosis.remainder import Remainder
from shiplog.diagnosis.trial import Trial

RELINEARISATIONS = 10  # of linearising again, at most: a map whose ends are held takes nine
AWAY = 1e4  # m, m/s or rad, that no ship is off in half a minute
STEP_NATS = 100.0  # nats: no step of a converging fit loses as much
MOST_HALVINGS = 3  # times that a step is halved where the fit diverges
AT_REST = 0.02  # of a number's size: it has converged
STEADY = 0.05  # of the logarithm of the process noise, from one round to the next: converged


def converge(
    trial: Trial,
    included: Sequence[str],
    numbers: Mapping[str, np.ndarray],
    path: Path | None,
    lowest: float = -np.inf,
    remainder: Remainder = evidence.NO_CHANGE_OF_NOISE,
) -> tuple[Point, Found]:
    """These causes together, linearised again until their numbers converge.

    They start from where an earlier fit of them converged, if there was one. A step has gone too
    far if the evidence is then below the `lowest` that is possible. Where that is known, no further
    step may lose STEP_NATS. A step that has gone too far is halved.
    """
    # where each channel has a factor of its own the common one stays near 1; an intermittent force
    # is estimated together with the nominal process noise, which is then kept
    point, noise_factor, lately = None, 1.0, 1.0 if remainder.shaped else None
    held = remainder.intermittent is not None
    near: Path | Point | None = path
    key = (tuple(included), remainder)
    if key in trial.converged:
        numbers, near, noise_factor = trial.converged[key]
        lately = noise_factor
    stood: Mapping[str, np.ndarray] | None = None  # where the fit last held
    shorter = 0
    steady = held  # whether the process noise has converged: a round then keeps it
    for _ in range(RELINEARISATIONS):
        try:
            point = trial.at(numbers, near, noise_factor, remainder)
            base = _fitted(trial, point, included, remainder, lately, steady, lowest)
        except np.linalg.LinAlgError:  # the fit diverged, and its path with it
            if shorter == MOST_HALVINGS or not included:
                assert trial.first is not None
                return trial.first, Found("+".join(included), -np.inf, noise_factor, numbers)
            shorter += 1
            numbers = _half_way(numbers, stood, included[-1])
            continue
        near, stood = point, numbers
        if lowest > -np.inf:  # of one that joins; without one, the others' evidence must fall
            lowest = max(lowest, base.evidence - STEP_NATS)
        settled = lately is not None and abs(math.log(base.noise_factor / lately)) < STEADY
        kept, steady = steady, held or settled
        noise_factor = lately = base.noise_factor
        if not all(np.isfinite(values).all() for values in base.numbers.values()):
            base = replace(base, evidence=-np.inf)  # the fit diverged
            break
        far = trial.reference.apart(base.numbers, numbers)
        numbers = base.numbers
        if far < AT_REST:
            if kept and not held:
                base, _ = evidence.scan(trial, point, (), included, lately, remainder)
                numbers, noise_factor = base.numbers, base.noise_factor
            trial.converged[key] = (numbers, point.path, noise_factor)
            break
    assert point is not None
    return point, replace(base, name="+".join(included), numbers=numbers)


def _fitted(
    trial: Trial, point: Point, included: Sequence[str], remainder: Remainder,
    lately: float | None, steady: bool, lowest: float,
) -> Found:  # fmt: skip
    """The hypothesis at a point. Raises np.linalg.LinAlgError where the step there went too far."""
    if np.abs(point.linear.e).max() > AWAY:
        raise np.linalg.LinAlgError("the path diverged")
    if steady and lately is not None:
        base = evidence.fit(trial, point, included, lately, remainder)
    else:
        base, _ = evidence.scan(trial, point, (), included, lately, remainder)
    if base.evidence < lowest:
        raise np.linalg.LinAlgError("a step too far")
    return base


def _half_way(
    numbers: Mapping[str, np.ndarray], stood: Mapping[str, np.ndarray] | None, last: str
) -> dict[str, np.ndarray]:
    """Half a step: back towards where the fit held; before it ever did, half of the last cause."""
    if stood is None:
        return {**numbers, last: 0.5 * numbers[last]}
    return {n: 0.5 * (values + stood[n]) for n, values in numbers.items()}
