"""What a trial was found to say: the causes that are named, or a structure, or nothing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.diagnosis.evidence import TrialEvidence
from shiplog.diagnosis.fitted import Found, Point, Told
from shiplog.diagnosis.relinearisation import settle
from shiplog.diagnosis.unrecorded_thruster import Pulses
from shiplog.models.causes import Cause, Shown

PULSES = "side_thrust"
SHOWS_NATS = 5.0  # nats from which on a cause would show in these data


@dataclass(frozen=True)
class Named:
    """One cause of the verdict. `numbers` and `covariance` are of the change from nominal.

    alike    labels of causes that these data cannot distinguish from it
    beaten   label → log Bayes factor over that cause in its place, in nats
    freedom  degrees of it with which the covariance's size is known
    """

    cause: Cause
    evidence: float
    probability: float
    numbers: np.ndarray
    covariance: np.ndarray
    alike: tuple[str, ...] = ()
    beaten: Mapping[str, float] = field(default_factory=dict)
    freedom: float = math.inf

    @property
    def shown(self) -> dict[str, Shown]:
        return self.cause.told(self.numbers, self.covariance, self.freedom)


@dataclass(frozen=True)
class Structure:
    """The remainder of the verdict: a dependence without a named cause."""

    family: str
    evidence: float
    acts_on: tuple[str, ...]


@dataclass(frozen=True)
class Decision:
    """The decision from the posterior, before the held-out test.

    verdict    named, none or unknown
    named      in the order they were found
    pulses     the unrecorded thruster, where it is one of the causes
    rejected   label → why not
    traces     causes below their practical size
    ranking    label or family → probability, of the first step
    noise_factor   λ, factor of the process noise, of the remainder
    point, base      the trial linearised with what is named, and that hypothesis
    first, nothing   the same without any cause
    told       label → information of these data about each cause
    adapted    whether the model's coefficients are fitted again together with the named causes
    """

    verdict: str
    named: tuple[Named, ...]
    structure: Structure | None
    pulses: Pulses | None
    traces: tuple[Named, ...]
    rejected: Mapping[str, str]
    ranking: Mapping[str, float]
    noise_factor: float
    point: Point
    base: Found
    first: Point
    nothing: Found
    told: Mapping[str, Told] = field(default_factory=dict)
    adapted: bool = False


def without(trial: TrialEvidence, decision: Decision, one: Named) -> Decision:
    """The same verdict with one cause less, the others fitted again."""
    named = tuple(n for n in decision.named if n is not one)
    labels = tuple(n for n in decision.base.numbers if n != one.cause.label)
    if labels:
        numbers = {n: decision.base.numbers[n] for n in labels}
        point, base = settle(trial, labels, numbers, decision.point.path)
        if base.covariance is None:  # the fit diverged: it has no numbers
            labels, named = (), ()
    if not labels:
        point, base = decision.first, decision.nothing
    again, at = [], 0
    by = {n.cause.label: n for n in named}
    for label in labels:
        count = len(base.numbers[label])
        part = slice(at, at + count)
        at += count
        if label in by:
            assert base.covariance is not None
            again.append(
                replace(
                    by[label],
                    numbers=np.asarray(base.numbers[label]),
                    covariance=base.covariance[part, part],
                )
            )
    verdict = "named" if again or decision.pulses else "none"
    return replace(
        decision,
        named=tuple(again),
        verdict=verdict,
        point=point,
        base=base,
        noise_factor=base.noise_factor,
    )


def untold(decision: Decision) -> Decision:
    """Of a model that simulates nothing: its error goes with the motion, and has no name."""
    return replace(
        decision, verdict="unknown", named=(), pulses=None, traces=(),
        structure=Structure("motion", 0.0, ()),
    )  # fmt: skip
