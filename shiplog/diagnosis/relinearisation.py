"""The named causes, linearised again at their estimates, with a path of their own, until they
converge.

Gauss-Newton: where a linearisation has its most probable numbers, the next one is made. A step is
measured in standard deviations of the numbers, since neither their evidence nor their intervals
change by less. A step after which the numbers are far less probable, and the next step is longer,
went too far, and is halved.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis import evidence
from shiplog.diagnosis.fitted import Found, Point
from shiplog.diagnosis.linear_segments import Path
from shiplog.diagnosis.remainder import Remainder
from shiplog.diagnosis.trial import Trial

RELINEARISATIONS = 10  # of linearising again, at most
AWAY = 1e4  # m, m/s or rad, that no ship is off in half a minute
LOST_NATS = 10.0  # of the numbers' log density: a step that loses more, and leads to a longer one
MOST_HALVINGS = 3  # times in turn that a step is halved where it went too far
LEFT = 0.2  # standard deviations that a fit may still be off where it ends
LITTLE_NATS = 1.0  # that no step gains any more: not what decides between hypotheses
FALL = 0.1  # by which a step is expected to be shorter than the one before, until that is known
STEADY = 0.05  # of the logarithm of the process noise, from one round to the next: converged


@dataclass(frozen=True)
class _Stand:
    """A fit, the point that it was made at, and the length [sd] of the step from that point."""

    point: Point
    base: Found
    step: float

    def fails(self, before: _Stand) -> bool:
        """Whether the step from there went too far."""
        lost = before.base.density - self.base.density
        return self.step > before.step and lost > LOST_NATS

    def rests(self, before: _Stand | None, share: float) -> bool:
        """Whether a further step would change neither the numbers nor the evidence: steps get
        shorter by the factor by which the last one did, of which a `share` was taken."""
        fall, gained = FALL, math.inf
        if before is not None and before.step > 0.0 and share == 1.0:
            fall = min(self.step / before.step, 0.99)
            gained = self.base.density - before.base.density
        little = max(gained, 0.5 * self.step**2) < LITTLE_NATS
        return little or self.step * fall / (1.0 - fall) < LEFT

    def as_it_stands(self) -> Found:
        """With the point's own numbers: what the step would gain was not seen."""
        return replace(self.base, numbers=self.point.numbers,
                       evidence=self.base.evidence - 0.5 * self.step**2)  # fmt: skip


def converge(
    trial: Trial,
    included: Sequence[str],
    numbers: Mapping[str, np.ndarray],
    path: Path | None,
    lowest: float = -np.inf,
    remainder: Remainder = evidence.NO_CHANGE_OF_NOISE,
) -> tuple[Point, Found]:
    """These causes together, linearised again until their numbers converge.

    They start from where an earlier fit of them converged, if there was one. A first step has gone
    too far if the evidence is then below the `lowest` that is possible. A fit that does not
    converge has the evidence of the most probable numbers that it met.
    """
    # where each channel has a factor of its own the common one stays near 1; an intermittent force
    # is estimated together with the nominal process noise, which is then kept
    noise_factor, lately = 1.0, 1.0 if remainder.shaped else None
    held = remainder.intermittent is not None
    near: Path | Point | None = path
    key = (tuple(included), remainder)
    if key in trial.converged:
        numbers, near, noise_factor = trial.converged[key]
        lately = noise_factor
    stood: _Stand | None = None  # where the fit last held
    best: _Stand | None = None
    shorter, share = 0, 1.0  # of each step, that is taken: a fit that went too far is still there
    steady = held  # whether the process noise has converged: a round then keeps it
    for _ in range(RELINEARISATIONS):
        try:
            point = trial.at(numbers, near, noise_factor, remainder)
            base = _fitted(trial, point, included, remainder, lately, steady, lowest)
            here = _Stand(point, base, _length(point, base, included))
            if stood is not None and here.fails(stood):
                raise np.linalg.LinAlgError("a step too far")
        except np.linalg.LinAlgError:  # the fit diverged, and its path with it
            if shorter == MOST_HALVINGS or not included:
                break
            shorter, share = shorter + 1, 0.5 * share
            numbers = _half_way(numbers, stood.point.numbers if stood else None, included[-1])
            continue
        rests = here.rests(stood, share)
        settled = lately is not None and abs(math.log(base.noise_factor / lately)) < STEADY
        kept, steady = steady, held or settled
        stood, share = here, share if shorter else min(2.0 * share, 1.0)
        shorter = 0
        if best is None or base.density >= best.base.density:
            best = here
        near, noise_factor = point, base.noise_factor
        numbers = _towards(base.numbers, point.numbers, share)
        lately = noise_factor
        if not all(np.isfinite(values).all() for values in numbers.values()):
            return point, replace(base, name="+".join(included), evidence=-np.inf)
        if rests:
            if kept and not held:
                base, _ = evidence.scan(trial, point, (), included, lately, remainder)
            trial.converged[key] = (base.numbers, point.path, base.noise_factor)
            return point, replace(base, name="+".join(included))
    return _without_end(trial, included, remainder, best, numbers)


def _without_end(
    trial: Trial, included: Sequence[str], remainder: Remainder, best: _Stand | None,
    numbers: Mapping[str, np.ndarray],
) -> tuple[Point, Found]:  # fmt: skip
    """Of a fit that did not converge: the best that it met, or no evidence."""
    name = "+".join(included)
    if best is None:
        assert trial.first is not None
        return trial.first, Found(name, -np.inf, 1.0, numbers)
    found = (best.point.numbers, best.point.path, best.base.noise_factor)
    trial.converged[tuple(included), remainder] = found
    return best.point, replace(best.as_it_stands(), name=name)


def _length(point: Point, base: Found, included: Sequence[str]) -> float:
    """Of the step from a point's numbers to the most probable ones there, standard deviations."""
    if not included:
        return 0.0
    assert base.covariance is not None
    step = np.concatenate([base.numbers[n] - point.numbers[n] for n in included])
    return math.sqrt(max(float(step @ np.linalg.solve(base.covariance, step)), 0.0))


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
) -> Mapping[str, np.ndarray]:
    """Half a step: back towards where the fit held; before it ever did, half of the last cause."""
    if stood is None:
        return {**numbers, last: 0.5 * numbers[last]}
    return _towards(numbers, stood, 0.5)


def _towards(
    numbers: Mapping[str, np.ndarray], stood: Mapping[str, np.ndarray], share: float
) -> Mapping[str, np.ndarray]:
    """A share of the step from where the fit stood."""
    if share == 1.0:
        return numbers
    return {n: share * values + (1.0 - share) * stood[n] for n, values in numbers.items()}
