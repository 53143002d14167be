"""A hypothesis about a trial, fitted: causes and remainder, from a start to a fit.

Gauss-Newton with step halving. The trial is linearised at the causes' numbers θ₀; the next point is
the posterior mean A⁻¹ b (7) there, until the step Δ between both is short:

    δ² = Δᵀ Σ⁻¹ Δ,   Σ = P - K S Kᵀ of the causes' numbers                       (14), Mahalanobis
    δ ρ / (1 - ρ) < LEFT,   ρ = δ / δ_before                 what is left of a geometric series

A step is rejected, and halved, if log p(r, θ₀) is then far lower and the next step is longer.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.hypotheses import evidence
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.trial.fitted import Estimate, Fit, Point, Start
from shiplog.diagnosis.trial.trial import Trial

RELINEARISATIONS = 10  # of linearising again, at most
AWAY = 1e4  # m, m/s or rad, that no ship is off in half a minute
LOST_NATS = 10.0  # of the numbers' log density: a step that loses more may be rejected
MOST_HALVINGS = 3  # of one step, at most
LEFT = 0.2  # standard deviations: expected distance from the optimum, at which a fit has converged
# Of convergence, until two steps give it: length of a step over that of the last one. A clock may
# reach 0.8; with this, a first step of more than half a standard deviation is not the last one.
RATE = 0.3
STEADY = 0.05  # of the logarithm of the process noise, from one round to the next: converged


@dataclass(frozen=True)
class _Iterate:
    """A point θ₀, the posterior there, and the length δ of the step to its mean [sd]."""

    point: Point
    base: Estimate
    step: float

    def rejected(self, before: _Iterate) -> bool:
        """Whether the step from the iterate before went too far: δ is longer than it was, and the
        numbers are less probable."""
        lost = before.base.density - self.base.density
        return self.step > before.step and lost > LOST_NATS

    def converged(self, before: _Iterate | None, damping: float) -> bool:
        """Whether further steps would change neither the numbers nor the evidence. Convergence is
        taken for linear, with the rate ρ of the last two steps; after a damped step ρ is not
        known."""
        rho, gained = RATE, math.inf
        if before is not None and before.step > 0.0 and damping == 1.0:
            rho = min(self.step / before.step, 0.99)
            gained = self.base.density - before.base.density
        little = max(gained, 0.5 * self.step**2) < evidence.LITTLE_NATS
        return little or self.step * rho / (1.0 - rho) < LEFT

    def estimate_at_point(self) -> Estimate:
        """The fit with the point's own numbers, in the order of its covariance, without the gain
        ½ δ² that the step promises."""
        at_point = {name: self.point.numbers[name] for name in self.base.numbers}
        return replace(self.base, numbers=at_point,
                       evidence=self.base.evidence - 0.5 * self.step**2)  # fmt: skip


def resume(
    trial: Trial, included: Sequence[str], remainder: Remainder, start: Start,
    lowest: float = -np.inf, *, anew: bool = False,
) -> Fit:  # fmt: skip
    """`evaluate`, from where an earlier fit of this hypothesis converged, if there was one.

    anew   from `start` nevertheless
    """
    starts, key = trial.cache.starts, (tuple(included), remainder)
    if anew:
        starts.pop(key, None)
    fit = evaluate(trial, included, remainder, starts.get(key, start), lowest)
    if fit.estimate.evidence != -math.inf:
        starts[key] = fit.start
    return fit


def evaluate(
    trial: Trial, included: Sequence[str], remainder: Remainder, start: Start,
    lowest: float = -np.inf,
) -> Fit:  # fmt: skip
    """These causes with this remainder, linearised again until their numbers converge: numbers,
    covariance (7), evidence (3) and the point of them. It depends on its arguments alone.

    A step is rejected, too, if the evidence is below the `lowest` that is possible, about a path
    that the process noise found there allows. A fit that does not converge has the evidence of the
    most probable numbers that it met; one that diverges has none.
    """
    name = "+".join(included)
    numbers, near, noise_factor, lately = start.numbers, start.path, 1.0, start.noise_factor
    if lately is not None:
        noise_factor = lately
    elif remainder.shaped:
        # where each channel has a factor of its own the common one stays near 1; an intermittent
        # force is estimated together with the nominal process noise, which is then kept
        lately = 1.0
    with_force = remainder.intermittent is not None
    last: _Iterate | None = None  # that was accepted
    best: _Iterate | None = None
    halvings, damping = 0, 1.0  # of a step; it grows back once steps are accepted
    bend = start.bend  # of the evidence over log λ; zero until it is known
    steady = with_force  # whether the process noise has converged: a round then keeps it
    for _ in range(RELINEARISATIONS):
        try:
            point = trial.linearise(numbers, near, noise_factor, remainder)
            base = _posterior(trial, point, included, remainder, lately, steady, bend)
            if base.evidence < lowest:
                if abs(math.log(base.noise_factor / noise_factor)) < STEADY:
                    raise np.linalg.LinAlgError("a step too far")
                near, noise_factor = point, base.noise_factor  # too firm a path, with any numbers
                continue
            here = _Iterate(point, base, _length(point, base, included))
            if last is not None and here.rejected(last):
                raise np.linalg.LinAlgError("a step too far")
        except np.linalg.LinAlgError:  # the fit diverged, and its path with it
            free = [name for name in included if name not in trial.fixed]
            if halvings == MOST_HALVINGS or not free:
                break
            halvings, damping = halvings + 1, 0.5 * damping
            half = _halved(numbers, last.point.numbers if last else None, free[-1])
            numbers = trial.clipped(half)
            continue
        converged = here.converged(last, damping)
        settled = lately is not None and abs(math.log(base.noise_factor / lately)) < STEADY
        steady = with_force or settled
        last, damping = here, damping if halvings else min(2.0 * damping, 1.0)
        halvings = 0
        if best is None or base.density >= best.base.density:
            best = here
        near, noise_factor, bend = point, base.noise_factor, base.bend
        numbers = trial.clipped(_interpolated(base.numbers, point.numbers, damping))
        lately = noise_factor
        if not all(np.isfinite(values).all() for values in numbers.values()):
            return Fit(point, replace(base, name=name, evidence=-np.inf), remainder)
        if converged:
            if not with_force:  # by three levels, whatever was enough on the way
                base, _ = evidence.scan(trial, point, (), included, lately, remainder)
            return Fit(point, replace(base, name=name), remainder)
    if best is None:
        assert trial.first is not None
        return Fit(trial.first, Estimate(name, -np.inf, 1.0, numbers), remainder)
    return Fit(best.point, replace(best.estimate_at_point(), name=name), remainder)


def _length(point: Point, base: Estimate, included: Sequence[str]) -> float:
    """Of the step from a point's numbers to the most probable ones there, standard deviations."""
    if not included:
        return 0.0
    assert base.covariance is not None
    step = np.concatenate([base.numbers[n] - point.numbers[n] for n in included])
    return math.sqrt(max(float(step @ np.linalg.solve(base.covariance, step)), 0.0))


def _posterior(
    trial: Trial, point: Point, included: Sequence[str], remainder: Remainder,
    lately: float | None, steady: bool, bend: float,
) -> Estimate:  # fmt: skip
    """The hypothesis at a point, over λ, or at the λ of the last round where that is steady; with
    the `bend` of the last round. Raises np.linalg.LinAlgError where the path diverged."""
    if point.linear.farthest > AWAY:
        raise np.linalg.LinAlgError("the path diverged")
    if steady and lately is not None:
        return evidence.fit(trial, point, included, lately, remainder)
    near, bend = (1.0, 0.0) if lately is None else (lately, bend)
    return evidence.scan(trial, point, (), included, near, remainder, bend)[0]


def _halved(
    numbers: Mapping[str, np.ndarray], accepted: Mapping[str, np.ndarray] | None, last: str
) -> Mapping[str, np.ndarray]:
    """Half a step from the accepted numbers; where there are none, half of the last free cause."""
    if accepted is None:
        return {**numbers, last: 0.5 * numbers[last]}
    return _interpolated(numbers, accepted, 0.5)


def _interpolated(
    numbers: Mapping[str, np.ndarray], begin: Mapping[str, np.ndarray], share: float
) -> Mapping[str, np.ndarray]:
    """A share of the step from `begin` to these numbers."""
    if share == 1.0:
        return numbers
    return {n: share * values + (1.0 - share) * begin[n] for n, values in numbers.items()}
