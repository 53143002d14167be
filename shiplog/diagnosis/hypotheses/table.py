"""The hypotheses about a trial that were weighed so far, and the scale of their scores."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog.diagnosis.decision_parts import ALL, Parts
from shiplog.diagnosis.hypotheses.hypothesis import (
    Hypothesis,
    Key,
    Place,
    Priors,
    form_error,
    holds_one,
)
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED
from shiplog.diagnosis.trial.fitted import Fit, Point
from shiplog.diagnosis.trial.trial import Trial
from shiplog.models.causes import Cause

KEPT_LINEARISATIONS = 2  # the others are computed again when needed


class Table(dict[Key, Hypothesis]):
    """Causes and kind of remainder → the most probable hypothesis of these."""

    def put(self, one: Hypothesis) -> None:
        """Keep a hypothesis where it is the most probable one of its causes and kind."""
        key = (one.causes, one.kind)
        if key not in self or self[key].score < one.score:
            self[key] = one

    def posterior(self, banned: Collection[frozenset[str]] = ()) -> list[Hypothesis]:
        """Best first, of those that hold no banned set of names."""
        kept = (h for h in self.values() if not holds_one(banned, h.causes))
        return sorted(kept, key=lambda h: -h.score)

    def best(self, kind: str, banned: Collection[frozenset[str]] = ()) -> Hypothesis | None:
        """The most probable one with this kind of remainder."""
        return next((h for h in self.posterior(banned) if h.kind == kind), None)


@dataclass(frozen=True)
class Scale:
    """What makes a score of the evidence of a hypothesis (15).

    priors   log p(causes) + log p(kind)
    placebo  label or kind of remainder → its log Bayes factor on nominal voyages, in nats
    by       label → cause of the catalogue
    alone    label → log Bayes factor of that cause by itself, over no cause
    force_alone   log Bayes factor of an intermittent force without a cause, over nothing
    form_errors   whether the equations of a cause, or of a force, have errors
    """

    priors: Priors
    placebo: Mapping[str, float]
    by: Mapping[str, Cause]
    alone: Mapping[str, float]
    force_alone: float
    form_errors: bool = True

    def score(self, evidence: float, labels: Sequence[str], kind: str) -> float:
        """Log posterior (15), in nats, up to a constant."""
        misfit = sum(self.placebo.get(n, 0.0) for n in labels) + self.placebo.get(kind, 0.0)
        force = self.force_alone if kind == INTERMITTENT else 0.0
        allowance = 0.0
        if self.form_errors:
            allowance = form_error(self.alone, labels, self.by, force)
        return evidence + self.priors.hypothesis(labels, kind) - misfit - allowance

    def hypothesis(
        self, labels: tuple[str, ...], evidence: float, fit: Fit, force: SideForce | None = None
    ) -> Hypothesis:
        """A fit of these causes with its score."""
        score = self.score(evidence, labels, fit.remainder.kind)
        return Hypothesis(labels, fit.remainder, evidence, score, fit.point, fit.estimate, force)


@dataclass
class Hypotheses:
    """A trial, the table of its hypotheses, and what their scores depend on.

    first      the trial linearised with the model as it stands
    placebo    label or remainder → its log Bayes factor on nominal voyages, in nats
    found      causes and kind of remainder → hypothesis
    alone      label → log Bayes factor of that cause by itself, over no cause
    banned     sets of names: a hypothesis that holds all names of one does not count any more
    parts      of the decision, that act
    catalogue  causes that a hypothesis may contain in addition to those of the model
    by         label → cause of the catalogue
    """

    trial: Trial
    first: Point
    placebo: Mapping[str, float]
    found: Table = field(default_factory=Table)
    alone: dict[str, float] = field(default_factory=dict)
    banned: set[frozenset[str]] = field(default_factory=set)
    parts: Parts = ALL

    def __post_init__(self) -> None:
        causes = self.trial.reference.model.causes
        apart = (*self.trial.fixed, *self.trial.excluded)
        self.catalogue = [c for c in causes if c.label not in apart]
        self.by = {cause.label: cause for cause in self.catalogue}
        self.priors = Priors(self.catalogue, tuple(self.trial.families))

    @property
    def fixed(self) -> dict[str, np.ndarray]:
        """Label → numbers of the causes that the model has already."""
        return {label: np.asarray(self.first.numbers[label]) for label in self.trial.fixed}

    @property
    def nothing(self) -> Hypothesis:
        return self.found[(), NOMINAL]

    @property
    def scale(self) -> Scale:
        """As it is now: every cause's own log Bayes factor is known at the end only. Where an
        intermittent force is kept with causes only, raised noise was as probable without one."""
        alone = self.found.get(((), INTERMITTENT), self.found.get(((), RAISED)))
        force = 0.0 if alone is None else alone.evidence - self.nothing.evidence
        errors = self.parts.form_error
        return Scale(self.priors, self.placebo, self.by, dict(self.alone), force, errors)

    def ranked(self, without: str = "") -> list[Hypothesis]:
        """Best first, of those that are not banned; without those that contain a cause of this
        name."""
        return self.found.posterior(
            self.banned | ({frozenset((without,))} if without else set())
        )  # fmt: skip

    def fit(self, one: Hypothesis) -> Fit:
        """A hypothesis with the trial linearised where it was."""
        point = one.point
        if isinstance(point, Place):
            point = self.trial.linearise_about(point.numbers, point.path)
        return Fit(point, one.estimate, one.remainder)


def rescored(table: Table, scale: Scale) -> Table:
    """The same hypotheses with the scores of another scale."""
    return Table({
        key: replace(h, score=scale.score(h.evidence, h.causes, h.kind))
        for key, h in table.items()
    })  # fmt: skip


def shortened(table: Table, best: Sequence[Hypothesis]) -> Table:
    """The same hypotheses without the linearisations of all but the `best`: each takes 50 MB and
    more."""
    points = dict.fromkeys(id(h.point) for h in best if isinstance(h.point, Point))
    kept = list(points)[:KEPT_LINEARISATIONS]
    return Table({
        key: h if isinstance(h.point, Place) or id(h.point) in kept
        else replace(h, point=Place(h.point.numbers, h.point.path))
        for key, h in table.items()
    })  # fmt: skip
