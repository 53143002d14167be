"""What a trial was found to say: the causes that are named, or a structure, or nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.diagnosis.hypotheses.evaluate import resume
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.trial.fitted import Estimate, ExpectedEvidence, Fit, Start
from shiplog.diagnosis.trial.trial import Trial
from shiplog.models.causes import Cause, ParameterEstimate

EXPLAIN_MORE = "explain more"  # why a verdict is undecided: the causes by themselves do
REFUTED = "refuted"  # the same: held-out voyages refute the most probable causes
# The same: a force is on and off less clearly than a device, and more clearly than one that varies
PATTERN = "pattern"
SIDE_THRUST = "side_thrust"


@dataclass(frozen=True)
class Named:
    """One cause of the verdict. `numbers` and `covariance` are of the change from nominal.

    alike    labels of causes that may stand in its place: these data cannot tell
    freedom  degrees of it with which the covariance's size is known
    """

    cause: Cause
    evidence: float
    probability: float
    numbers: np.ndarray
    covariance: np.ndarray
    alike: tuple[str, ...] = ()
    freedom: float = math.inf

    @property
    def estimates(self) -> dict[str, ParameterEstimate]:
        return self.cause.estimates(self.numbers, self.covariance, self.freedom)


@dataclass(frozen=True)
class Structure:
    """The remainder of the verdict: a dependence without a named cause."""

    family: str
    evidence: float
    acts_on: tuple[str, ...]


@dataclass(frozen=True)
class Decision:
    """The decision from the posterior, before the held-out test.

    verdict    named, none, unknown or undecided
    named      in the order they were found
    structure  of what is unknown, or may be
    side_force  the unrecorded thruster, where it is one of the causes
    traces     causes below their practical size
    rejected   name, or label of one kind of a cause → why it is not named
    ranking    every answer → probability: names of causes, families as `unknown:family`, none
    fit        the hypothesis of the verdict: what is named, or nothing, with its remainder
    nothing    no cause, with the same remainder
    expected   label → expected log Bayes factor of each cause, by its size
    one_of     names of which one acts in addition, which of them these data cannot tell
    either     names of causes that act, or else something outside the catalogue does: these data
               cannot tell which
    why        an undecided verdict is: EXPLAIN_MORE, REFUTED, PATTERN, or else nothing is probable
    adapted    whether the model's coefficients are fitted again together with the named causes
    """

    verdict: str
    named: tuple[Named, ...]
    structure: Structure | None
    side_force: SideForce | None
    traces: tuple[Named, ...]
    rejected: Mapping[str, str]
    ranking: Mapping[str, float]
    fit: Fit
    nothing: Fit
    expected: Mapping[str, ExpectedEvidence] = field(default_factory=dict)
    one_of: tuple[str, ...] = ()
    either: tuple[str, ...] = ()
    why: str = ""
    adapted: bool = False

    @property
    def unnamed(self) -> Decision:
        """The same with nothing named, and the process noise as it is reported."""
        noise_factor = self.fit.estimate.noise_factor
        nothing = replace(self.nothing.estimate, noise_factor=noise_factor)
        return replace(self, named=(), one_of=(), fit=replace(self.nothing, estimate=nothing))


def without_cause(trial: Trial, decision: Decision, one: Named) -> Decision:
    """The same verdict with one cause less, the others fitted again."""
    named = tuple(n for n in decision.named if n is not one)
    fit, remainder = decision.fit, decision.fit.remainder
    labels = tuple(n for n in fit.included if n != one.cause.label)
    again = decision.nothing
    if labels:
        numbers = {n: fit.estimate.numbers[n] for n in labels}
        less = resume(trial, labels, remainder, Start(numbers, fit.point.path))
        if less.estimate.covariance is None:  # the fit diverged: it has no numbers
            named = ()
        else:
            again = less
    kept = _fitted_again(again.estimate, named)
    verdict = "named" if kept or decision.side_force else "none"
    return replace(decision, named=kept, verdict=verdict, fit=again)


def _fitted_again(found: Estimate, named: Sequence[Named]) -> tuple[Named, ...]:
    """The named causes that a hypothesis holds, in its order, with its numbers."""
    again, end, by = [], 0, {n.cause.label: n for n in named}
    for label, values in found.numbers.items():
        part = slice(end, end + len(values))
        end = part.stop
        if label in by:
            assert found.covariance is not None
            again.append(
                replace(
                    by[label], numbers=np.asarray(values), covariance=found.covariance[part, part]
                )
            )
    return tuple(again)


def without_simulation(decision: Decision) -> Decision:
    """Of a model that simulates nothing: its error goes with the motion, and has no name."""
    return replace(
        decision, verdict="unknown", named=(), side_force=None, traces=(),
        structure=Structure("motion", 0.0, ()), either=(), why="",
    )  # fmt: skip
