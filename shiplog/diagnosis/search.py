"""Which hypotheses are weighed: a search outwards from the best ones found so far.

A set of causes is linearised again where its numbers are likeliest, and compared under every kind
of remainder. From the best hypotheses one cause is added or dropped, until no set that is worth it
is left; which set came first cannot matter.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shiplog.diagnosis.fitted import Found, Level, Point
from shiplog.diagnosis.hypothesis import Hypothesis, Place, Priors, form_error, name_of
from shiplog.diagnosis.relinearisation import settle
from shiplog.diagnosis.result import SHOWS_NATS
from shiplog.diagnosis.trial import INTERMITTENT, NOMINAL, RAISED, Remainder, Trial

MOST_CAUSES = 5  # of a hypothesis; of a ship with more the given coefficients are another ship's
MOST_SETS = 16  # that are linearised; the others are far behind
KEPT_LINEARISATIONS = 6  # the others are computed again when needed
SEARCH_NATS = 10.0  # nats behind the best, beyond which a hypothesis is not worth a linearisation
LIKELY = 0.3  # share of the best one's evidence: before it is linearised a cause may lack more
CONTENDERS = 3  # causes that are tried from one hypothesis
FAILED_NATS = 50.0  # nats below nothing, at which a fit has failed: without effect it loses a few
RAISED_FROM = 1.2  # times the nominal process noise, from which an intermittent force is tested


log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Change:
    """A change of one family's weights: with what evidence, at what process noise."""

    remainder: Remainder
    value: float
    noise: float


class Search:
    """All hypotheses weighed so far.

    placebo label or remainder → its log Bayes factor on nominal voyages, in nats
    alone   label → log Bayes factor of that cause by itself, over no cause
    told    label → information of these data about it
    scanned label → score of that cause by itself, where it was found first
    """

    def __init__(
        self, trial: Trial, point: Point, usual: Mapping[str, float], banned: Sequence[str] = ()
    ) -> None:
        self.trial, self.first, self.placebo = trial, point, usual
        self.catalogue = [
            c for c in trial.reference.model.causes
            if c.label not in trial.fixed and c.label not in banned
        ]  # fmt: skip
        self.fixed = {n: np.asarray(point.numbers[n]) for n in trial.fixed}
        self.priors = Priors(self.catalogue, tuple(trial.families))
        self.found: dict[tuple[tuple[str, ...], str], Hypothesis] = {}
        self.alone: dict[str, float] = {}
        self.told: dict = {}
        self.scanned: dict[str, float] = {}
        self.banned: set[str] = set()  # names
        self._most = MOST_SETS
        self._tried: set[tuple[str, ...]] = set()
        self._expanded: set[tuple[tuple[str, ...], str]] = set()

    def run(self) -> None:
        """Evaluate hypotheses until no further one is promising. Scores are then renewed, since the
        allowance for form errors needs every cause's own log Bayes factor."""
        self._run()
        self.found = {
            key: replace(h, score=self._score(h.evidence, h.causes, h.kind))
            for key, h in self.found.items()
        }

    def without(self, name: str) -> None:
        """Go on without a cause, as far again: what stood behind it has hardly been looked at."""
        self.banned.add(name)
        self.trial.process_noise = self.trial.reference.process_noise  # without an earlier force
        self._most = len(self._tried) + MOST_SETS
        self._expanded.clear()
        self.run()

    def _run(self) -> None:
        if () not in self._tried:
            self.weigh((), {}, self.first)
        while len(self._tried) < self._most:
            best = self.ranked()
            near = [h for h in best if h.score > best[0].score - SEARCH_NATS]
            fresh = [h for h in near if (h.causes, h.kind) not in self._expanded]
            if not fresh:
                return
            self._expand(fresh[0])

    def ranked(self) -> list[Hypothesis]:
        """Best first, without those that contain a banned cause."""
        kept = (h for h in self.found.values() if not self.banned & set(map(name_of, h.causes)))
        return sorted(kept, key=lambda h: -h.score)

    @property
    def nothing(self) -> Hypothesis:
        return self.found[(), NOMINAL]

    def point(self, one: Hypothesis) -> Point:
        """The trial linearised where a hypothesis was."""
        if isinstance(one.point, Point):
            return one.point
        return self.trial.at(one.point.numbers, one.point.path)

    def recalled(self, one: Hypothesis) -> Hypothesis:
        """A hypothesis with its linearisation."""
        return replace(one, point=self.point(one))

    def _forget(self) -> None:
        """Linearisations of all but the best hypotheses: each takes 50 MB and more."""
        best = [self.nothing, *self.ranked()]
        points = dict.fromkeys(id(h.point) for h in best if isinstance(h.point, Point))
        kept = list(points)[:KEPT_LINEARISATIONS]
        for key, one in self.found.items():
            if isinstance(one.point, Point) and id(one.point) not in kept:
                place = Place(one.point.numbers, one.point.path)
                self.found[key] = replace(one, point=place)

    # --- moves ---

    def _expand(self, one: Hypothesis) -> None:
        """The sets with one cause more or less than a hypothesis has."""
        self._expanded.add((one.causes, one.kind))
        one = self.recalled(one)
        best = self.ranked()[0].score
        for labels, numbers, predicted in self._additions(one):
            worth = predicted > best - SEARCH_NATS or not one.causes
            if worth and labels not in self._tried and len(self._tried) < self._most:
                self.weigh(labels, numbers, self.point(one))
        for label in one.causes if len(one.causes) > 1 else ():
            labels = tuple(n for n in one.causes if n != label)
            if labels not in self._tried:
                self.weigh(labels, {n: one.found.numbers[n] for n in labels}, self.point(one))

    def _additions(
        self, one: Hypothesis
    ) -> list[tuple[tuple[str, ...], dict[str, np.ndarray], float]]:
        if len(one.causes) >= MOST_CAUSES or one.kind == INTERMITTENT:
            return []
        candidates = [
            c for c in self.catalogue
            if c.label not in one.causes and c.name not in self.banned
            and all(c.beside(label) for label in one.causes)
        ]  # fmt: skip
        self.trial.remainder = one.remainder
        _, found = self.trial.scan(
            self.point(one), candidates, self._included(one.causes), one.found.noise_factor
        )
        if not one.causes and one.kind == NOMINAL:
            self.alone |= {f.name: f.evidence for f in found}
            self.scanned |= {
                f.name: self._score(one.evidence + f.evidence, (f.name,), NOMINAL) for f in found
            }
            if not self.told:
                self.told = {f.name: f.told for f in found}
                self._say_what_would_not_show()
        said = []
        for f in found:
            if f.evidence <= 0.0 or f.evidence < LIKELY * found[0].evidence:
                continue
            labels = tuple(sorted((*one.causes, f.name)))
            numbers = {**one.found.numbers, **f.numbers}
            score = self._score(one.evidence + f.evidence, labels, one.kind)
            said.append((labels, numbers, score))
        return said[:CONTENDERS]

    def _say_what_would_not_show(self) -> None:
        """Log the causes that these voyages cannot reveal, before any is searched for."""
        shares = {name: told.together(SHOWS_NATS) for name, told in self.told.items()}
        blind = [f"{name_of(n)} below {s:.0%}" for n, s in shares.items() if s > 1.0]
        if blind:
            log.info("not detectable at realistic size: %s", ", ".join(dict.fromkeys(blind)))

    # --- one set of causes ---

    def _included(self, labels: tuple[str, ...]) -> tuple[str, ...]:
        """Labels that a fit of these causes includes; causes of the model itself keep their
        numbers."""
        return (*self.fixed, *labels)

    def weigh(self, labels: tuple[str, ...], numbers: Mapping[str, np.ndarray], at: Point) -> None:
        """A set of causes under every remainder, linearised where it is likeliest."""
        self._tried.add(labels)
        trial = self.trial
        trial.remainder = Remainder(RAISED)
        point, near = at, None
        if labels:
            lowest = self.nothing.evidence - FAILED_NATS
            both = self.fixed | dict(numbers)
            point, base = settle(trial, self._included(labels), both, at.path, lowest=lowest)
            if not math.isfinite(base.evidence):
                return
            near = base.noise_factor
        included = self._included(labels)
        levels = trial.levels(point, included, near)
        if near is not None and near > RAISED_FROM:  # the noise may be nominal again
            levels.append(trial.level(point, 1.0, included))
        usual = self._best(levels, NOMINAL).noise_factor
        if abs(math.log(usual)) > 2.0 * trial.usual_spread:  # its prior favours the nominal noise
            levels += self.levels_of(point, included, usual)
        for kind in (NOMINAL, RAISED):
            self._keep(point, labels, Remainder(kind), self._best(levels, kind))
        if len(labels) == 1:
            gained = self.found[labels, NOMINAL].evidence - self.nothing.evidence
            self.alone[labels[0]] = max(gained, self.alone.get(labels[0], -math.inf))
        best = max((self.found[labels, kind] for kind in (NOMINAL, RAISED)), key=lambda h: h.score)
        changed = [self.changed(point, included, levels, family) for family in trial.families]
        scores = [self._score(c.value, labels, c.remainder.kind) for c in changed]
        near = max((best.score, *(score - SEARCH_NATS for score in scores)))
        for one, score in zip(changed, scores, strict=True):
            self._change(point, labels, one, best, score >= near)
        if self._best(levels, RAISED).noise_factor > RAISED_FROM:
            self._pulses(point, labels)
        self._forget()

    def levels_of(self, point: Point, included: Sequence[str], usual: float) -> list[Level]:
        """Levels about the best one under `nominal`, as made under RAISED."""
        trial = self.trial
        trial.remainder = Remainder(NOMINAL)
        levels = trial.levels(point, included, usual)
        trial.remainder = Remainder(RAISED)
        return [
            replace(level, value=level.value + self._more(level.noise_factor))
            for level in levels
        ]  # fmt: skip

    def _best(self, levels: Sequence[Level], kind: str) -> Level:
        """Of levels made under RAISED the best under a kind of remainder."""
        if kind == RAISED:
            return max(levels, key=lambda level: level.value)
        usual = [replace(one, value=one.value - self._more(one.noise_factor)) for one in levels]
        return max(usual, key=lambda level: level.value)

    def _more(self, noise: float) -> float:
        """Log prior density of a level of noise under `raised` over that under `nominal`."""
        expected = self.trial.expected
        return expected(noise, Remainder(RAISED)) - expected(noise, Remainder(NOMINAL))

    def changed(
        self, point: Point, included: Sequence[str], levels: Sequence[Level], family: str
    ) -> Change:
        """A change of one family's weights together with included causes, at its best size and
        noise.

        The noise may be raised as well, since no family describes an unknown force exactly. The
        family counts only if it is more probable with nominal noise than raised noise alone;
        otherwise its functions are a fit to noise.
        """
        usual, raised = [], []
        for level in levels:  # made under RAISED
            gained, size = self.trial.changed(point, level, included, family)
            value, noise = level.value + gained, level.noise_factor
            usual.append((value - self._more(noise), size, noise))
            raised.append((value, size, noise))
        noisy = max(usual)[0] > max(level.value for level in levels)
        value, size, noise = max(raised if noisy else usual)
        return Change(Remainder(family, size, noisy), value, noise)

    def _change(
        self, point: Point, labels: tuple[str, ...], one: Change, plain: Hypothesis, leads: bool
    ) -> None:
        """The set together with a change of one family; linearised again if that is promising."""
        trial, included = self.trial, self._included(labels)
        remainder, value, noise = one.remainder, one.value, one.noise
        if not leads:  # far behind: its numbers are never asked for
            self._put(labels, remainder, value, point, replace(plain.found, evidence=value))
            return
        trial.remainder = remainder
        if labels:
            start = trial.scan(point, (), included, noise)[0].numbers
            again, base = settle(trial, included, start, point.path)
            if math.isfinite(base.evidence) and base.evidence > value:
                self._put(labels, remainder, base.evidence, again, base)
                return
        base, _ = trial.scan(point, (), included, noise)
        self._put(labels, remainder, max(value, base.evidence), point, base)

    def _pulses(self, point: Point, labels: tuple[str, ...]) -> None:
        """An intermittent side force instead of raised process noise. A force without a gain over
        raised noise is that noise, and is not counted twice."""
        raised = self.found[labels, RAISED]
        self.trial.remainder = Remainder(INTERMITTENT)  # not the family that was tried last
        tried = self.trial.intermittent(point, raised.found)
        if tried.gain > 0.0:
            value = raised.evidence + tried.gain
            self._put(labels, Remainder(INTERMITTENT), value, point, raised.found, tried)

    def _keep(
        self, point: Point, labels: tuple[str, ...], remainder: Remainder, level: Level
    ) -> None:
        numbers, covariance = self.trial.numbers_of(level, point, self._included(labels))
        found = Found("+".join(labels), level.value, level.noise_factor, numbers, covariance)
        self._put(labels, remainder, level.value, point, found)

    def _put(self, labels, remainder, value, point, found, pulses=None) -> None:
        score = self._score(value, labels, remainder.kind)
        key = labels, remainder.kind
        if key not in self.found or self.found[key].score < score:
            self.found[key] = Hypothesis(labels, remainder, value, score, point, found, pulses)

    def _score(self, evidence: float, labels: Sequence[str], kind: str) -> float:
        misfit = sum(self.placebo.get(n, 0.0) for n in labels) + self.placebo.get(kind, 0.0)
        return evidence + self.priors.of(labels, kind) - misfit - form_error(self.alone, labels)
