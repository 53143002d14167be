"""A hypothesis about a trial: a set of causes and one kind of remainder, with its prior.

    p(no cause) = NO_CHANGE
    p(n causes) = (1 - NO_CHANGE) ANOTHER_CAUSEⁿ⁻¹ n! Π p_c       n! orders are one set
    p_c = 1 / (names in the catalogue · labels of this name)
    p(kind) = REMAINDER / (kinds but nominal);   p(nominal) = 1 - REMAINDER

The form error (nats) is an allowance for causes that imitate what the equations of another one
leave: nats go with the square of a force.

    (n - 1) max_c f_c² log B_c,   or FORM_ERROR² log B_force n where that is more

with f_c the share of a cause's force that its equations may leave wrong, and B_c its Bayes factor
by itself.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.linear.linear_segments import Path
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED, Remainder
from shiplog.diagnosis.trial.fitted import Estimate, Point
from shiplog.models.causes import Cause

Key = tuple[tuple[str, ...], str]  # causes by label, in alphabetical order, and kind of remainder


@dataclass(frozen=True)
class Place:
    """Where a trial was linearised, without the linearisation, which takes 50 MB and more."""

    numbers: Mapping[str, np.ndarray]
    path: Path


@dataclass(frozen=True)
class Hypothesis:
    """Causes by label, in alphabetical order, and a remainder.

    evidence   log marginal likelihood [nats], the trial counting for its share
    score      log evidence + log prior - placebo - allowance for form errors: log posterior up to
               a constant
    point      the trial linearised at the causes' numbers; of a hypothesis far behind, the point
               without relinearisation
    estimate   their numbers and covariance there
    side_force  of an intermittent remainder
    """

    causes: tuple[str, ...]
    remainder: Remainder
    evidence: float
    score: float
    point: Point | Place
    estimate: Estimate
    side_force: SideForce | None = None

    @property
    def kind(self) -> str:
        return self.remainder.kind

    @property
    def noise_factor(self) -> float:
        """As `Fit.noise_factor`."""
        return self.remainder.overall(self.estimate.noise_factor)


def name_of(label: str) -> str:
    """`clock_offset:wind` is the wind's clock."""
    return label.partition(":")[0]


def holds_one(without: Collection[frozenset[str]], labels: Sequence[str]) -> bool:
    """Whether these causes have all names of one of the sets."""
    names = set(map(name_of, labels))
    return any(one <= names for one in without)


class Priors:
    """Log prior of every hypothesis about one ship; causes of one name share that name's.

    each    label → log p_c
    kinds   kind of remainder → log p(kind)
    """

    def __init__(self, catalogue: Sequence[Cause], families: Sequence[str]) -> None:
        names = [name_of(cause.label) for cause in catalogue]
        self.each = {
            cause.label: -math.log(len(set(names)) * names.count(name_of(cause.label)))
            for cause in catalogue
        }
        kinds = (RAISED, INTERMITTENT, *families)
        self.kinds = dict.fromkeys(kinds, math.log(thresholds.REMAINDER / len(kinds)))
        self.kinds[NOMINAL] = math.log(1.0 - thresholds.REMAINDER)

    def causes(self, labels: Sequence[str]) -> float:
        """log p(n causes)."""
        if not labels:
            return math.log(thresholds.NO_CHANGE)
        further = (len(labels) - 1) * math.log(thresholds.ANOTHER_CAUSE)
        further += math.lgamma(len(labels) + 1.0)  # n! orders of n causes are one set
        return math.log(1.0 - thresholds.NO_CHANGE) + further + sum(self.each[n] for n in labels)

    def hypothesis(self, labels: Sequence[str], kind: str) -> float:
        """log p(causes) + log p(kind)."""
        return self.causes(labels) + self.kinds[kind]


def form_error_of(cause: Cause) -> float:
    """f_c: share of its force or reading that a cause's equations may leave wrong."""
    return max(thresholds.FORM_ERROR, cause.form_error)


def form_error(
    alone: Mapping[str, float], labels: Sequence[str], by: Mapping[str, Cause], force: float = 0.0
) -> float:
    """Allowance, in nats, for further causes that imitate the form error of another one, or of an
    intermittent force: of the one that leaves most.

    alone   log B_c of each cause by itself, over no cause
    by      label → cause
    force   log B_force of an intermittent force by itself, where these causes act with one
    """
    left = (form_error_of(by[n]) ** 2 * alone.get(n, 0.0) for n in labels)
    of_causes = max(0.0, *left) * (len(labels) - 1) if len(labels) > 1 else 0.0
    return max(of_causes, thresholds.FORM_ERROR**2 * force * len(labels))
