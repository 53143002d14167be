"""The hypotheses about a trial that were weighed so far, on one scale."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from shiplog.diagnosis.hypotheses import intermittent
from shiplog.diagnosis.hypotheses.hypothesis import Hypothesis, Place, Priors, form_error, holds_one
from shiplog.diagnosis.hypotheses.unrecorded_thruster import SideForce
from shiplog.diagnosis.noise import raised_noise
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED, Remainder
from shiplog.diagnosis.trial.fitted import Fit, Point
from shiplog.diagnosis.trial.trial import Trial

KEPT_LINEARISATIONS = 6  # the others are computed again when needed


class Hypotheses:
    """Of each set of causes and kind of remainder the most probable hypothesis.

    first      the trial linearised with the model as it stands
    placebo    label or remainder → its log Bayes factor on nominal voyages, in nats
    catalogue  causes that a hypothesis may contain in addition to those of the model
    by         label → cause of the catalogue
    found      causes and kind of remainder → hypothesis
    alone      label → log Bayes factor of that cause by itself, over no cause
    banned     sets of names: a hypothesis that holds all names of one does not count any more
    """

    def __init__(self, trial: Trial, first: Point, placebo: Mapping[str, float]) -> None:
        self.trial, self.first, self.placebo = trial, first, placebo
        self.catalogue = [c for c in trial.reference.model.causes if c.label not in trial.fixed]
        self.by = {cause.label: cause for cause in self.catalogue}
        self.priors = Priors(self.catalogue, tuple(trial.families))
        self.found: dict[tuple[tuple[str, ...], str], Hypothesis] = {}
        self.alone: dict[str, float] = {}
        self.banned: set[frozenset[str]] = set()

    @property
    def fixed(self) -> dict[str, np.ndarray]:
        """Label → numbers of the causes that the model has already."""
        return {label: np.asarray(self.first.numbers[label]) for label in self.trial.fixed}

    def included(self, labels: Sequence[str]) -> tuple[str, ...]:
        """Labels that a fit of these causes includes; causes of the model itself keep their
        numbers."""
        return (*self.trial.fixed, *labels)

    @property
    def nothing(self) -> Hypothesis:
        return self.found[(), NOMINAL]

    def best_of(self, kind: str) -> Hypothesis | None:
        """The most probable one so far with this kind of remainder."""
        return next((h for h in self.ranked() if h.kind == kind), None)

    def ranked(self, without: str = "") -> list[Hypothesis]:
        """Best first, of those that are not banned; without those that contain a cause of this
        name."""
        banned = self.banned | ({frozenset((without,))} if without else set())
        kept = (h for h in self.found.values() if not holds_one(banned, h.causes))
        return sorted(kept, key=lambda h: -h.score)

    def fit(self, one: Hypothesis) -> Fit:
        """A hypothesis with the trial linearised where it was."""
        point = one.point
        if isinstance(point, Place):
            point = self.trial.at(point.numbers, point.path)
        return Fit(point, one.found, one.remainder)

    def score(self, evidence: float, labels: Sequence[str], kind: str) -> float:
        """Log posterior, in nats, up to a constant."""
        misfit = sum(self.placebo.get(n, 0.0) for n in labels) + self.placebo.get(kind, 0.0)
        force = self._intermittent_alone if kind == INTERMITTENT else 0.0
        allowance = form_error(self.alone, labels, self.by, force)
        return evidence + self.priors.of(labels, kind) - misfit - allowance

    @property
    def _intermittent_alone(self) -> float:
        """Log Bayes factor of an intermittent force without a cause, over nothing; where it is kept
        with causes only, that of raised noise, which was as probable."""
        alone = self.found.get(((), INTERMITTENT), self.found.get(((), RAISED)))
        return 0.0 if alone is None else alone.evidence - self.nothing.evidence

    def put(
        self,
        labels: tuple[str, ...],
        evidence: float,
        fit: Fit,
        side_force: SideForce | None = None,
    ) -> None:
        """Keep a hypothesis where it is the most probable one of its causes and kind."""
        kind = fit.remainder.kind
        score = self.score(evidence, labels, kind)
        if (labels, kind) not in self.found or self.found[labels, kind].score < score:
            self.found[labels, kind] = Hypothesis(
                labels, fit.remainder, evidence, score, fit.point, fit.found, side_force
            )

    def noted_alone(self, label: str, gained: float) -> None:
        """A log Bayes factor of one cause; the greatest counts."""
        self.alone[label] = max(gained, self.alone.get(label, -math.inf))

    def rescore(self) -> None:
        """Renew the scores: the allowance for form errors needs every cause's own log Bayes
        factor."""
        self.found = {
            key: replace(h, score=self.score(h.evidence, h.causes, h.kind))
            for key, h in self.found.items()
        }

    def forget(self) -> None:
        """Drop the linearisations of all but the best hypotheses: each takes 50 MB and more."""
        best = [self.nothing, *self.ranked()]
        points = dict.fromkeys(id(h.point) for h in best if isinstance(h.point, Point))
        kept = list(points)[:KEPT_LINEARISATIONS]
        for key, one in self.found.items():
            if isinstance(one.point, Point) and id(one.point) not in kept:
                place = Place(one.point.numbers, one.point.path)
                self.found[key] = replace(one, point=place)

    @cached_property
    def nominal_side_force(self) -> Remainder | None:
        """As `intermittent.nominal_side_force`."""
        return intermittent.nominal_side_force(self.trial.campaign, self.trial.grid)

    def intermittent(self, fit: Fit) -> SideForce:
        """An intermittent force at one place along the ship, and its log Bayes factor over raised
        noise, whose nominal part acts at one place too."""
        return intermittent.side_force(self.trial, fit, self.nominal_side_force)

    def with_pattern(self, fit: Fit, side_force: SideForce) -> SideForce:
        """As `intermittent.add_pattern`."""
        return intermittent.add_pattern(self.trial, fit, side_force)

    def raised_by_channel(self, fit: Fit) -> Remainder:
        """Process noise raised in each channel by itself, as a hypothesis leaves it."""
        left = intermittent.noise_left(self.trial, fit)
        return raised_noise.by_channel(left, self.nominal_side_force)[1]
