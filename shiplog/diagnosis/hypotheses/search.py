"""The search: which hypotheses are weighed, starting from the best ones so far.

The loop takes the best hypothesis, asks for its candidates (`additions`, `reductions`), weighs each
(`weighing`), and puts what comes back into the table.

Each set of causes is linearised again at its most probable numbers, and weighed under every kind of
remainder that could win. One cause is then added to the best hypotheses or dropped from them, until
no promising set is left. A remainder may explain a part of what a cause explains wholly. As long as
a cause promises about as much as the best hypothesis has, it is therefore added to nothing as well.
The order in which sets are weighed matters for those alone that are far behind. Of a cause in the
best set, forms that exclude each other take its place in turn.

Remainders cost most of a set S. They are left out where a larger set B ⊃ S is far ahead of S and no
remainder R adds to it. S with R is B with R whose further numbers are zero, so that

    max_R p(r | S, R) ≤ max_R p(r | B, R) · (Occam's factor of the further numbers, a few nats)

and what R could explain for S it would explain for B as well. Once B is banned, they are weighed.

What a cause adds is predicted by its derivative where the hypothesis is linearised (`moves`). Of
two actuators exchanged, half is worse than nothing; a wall that pushes the ship off keeps it away.
Where they are absent the derivative of such causes says little: they are looked at where they are
`whole`, too.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis import thresholds
from shiplog.diagnosis.decision_parts import ALL, Parts
from shiplog.diagnosis.hypotheses import evidence, moves
from shiplog.diagnosis.hypotheses.hypothesis import Hypothesis, holds_one, name_of
from shiplog.diagnosis.hypotheses.intermittent import ResidualNoise
from shiplog.diagnosis.hypotheses.moves import LIKELY, Addition
from shiplog.diagnosis.hypotheses.table import Hypotheses, Table, rescored, shortened
from shiplog.diagnosis.hypotheses.weighing import (
    RAISING,
    SEARCH_NATS,
    CauseSet,
    Rough,
    plain_fit,
    weigh_as,
    weigh_plain,
    weigh_remainders,
)
from shiplog.diagnosis.noise.remainder import INTERMITTENT, NOMINAL, RAISED
from shiplog.diagnosis.trial.fitted import ExpectedEvidence, Fit, Point
from shiplog.diagnosis.trial.trial import Trial
from shiplog.machine import memory

MOST_CAUSES = 5  # of a hypothesis; of a ship with more the given coefficients are another ship's
MOST_SETS = 16  # that are linearised; the others are far behind
WHATEVER_SIZE = 100.0  # realistic sizes, beyond which no cause is what its numbers say

log = logging.getLogger(__name__)


class Search:
    """The moves from set to set: candidates of a hypothesis are weighed, and put into the table.

    table     the hypotheses weighed so far
    noise     estimates of noise from a residual
    expected  label → expected log Bayes factor of that cause, by its size
    scanned   label → score of that cause by itself, scanned before any set is searched
    likely    numbers of a set of causes that is likely from the start, by label
    nearer    additions are linearised at their own numbers before they are chosen from
    """

    def __init__(
        self, trial: Trial, point: Point, placebo: Mapping[str, float],
        likely: Mapping[str, np.ndarray] | None = None, noise: ResidualNoise | None = None,
        parts: Parts = ALL, nearer: bool = False,
    ) -> None:  # fmt: skip
        self.nearer = nearer
        self.table = Hypotheses(trial, point, placebo if parts.placebo else {}, parts=parts)
        self.noise = noise or ResidualNoise(trial, at_one_place=parts.placebo)
        self.likely = dict(likely or {})
        self.expected: dict[str, ExpectedEvidence] = {}
        self.scanned: dict[str, float] = {}
        self._most = MOST_SETS
        self._tried: set[tuple[str, ...]] = set()
        self._starts: dict[str, np.ndarray | None] = {}  # label → number that its fits start from
        self._expanded: set[tuple[tuple[str, ...], str]] = set()
        self._without_remainders: dict[tuple[str, ...], Mapping[str, np.ndarray]] = {}
        self._without_force: set[tuple[str, ...]] = set()

    def run(self) -> None:
        """Evaluate hypotheses until no further one is promising."""
        if () not in self._tried:
            self.weigh((), {}, self.table.first, later=True)
            self._scan_each_alone()
            self._weigh_wholes()
            if self.likely:
                self.weigh(tuple(sorted(self.likely)), self.likely, self.table.first)
            elif self._without_remainders:
                self._weigh_ordinary()
        self._add_remainders()
        while len(self._tried) < self._most:
            ranked = self.table.ranked()
            least = ranked[0].score - SEARCH_NATS
            allowed = (s for label, s in self.scanned.items() if not self._banned((label,)))
            promising = max(allowed, default=-math.inf) > self._least_promise
            near = [h for h in ranked if h.score > least or (promising and h is self.table.nothing)]
            fresh = [h for h in near if (h.causes, h.kind) not in self._expanded]
            if not fresh:
                break
            self._expand(fresh[0])
        self.table.found = rescored(self.table.found, self.table.scale)

    def exclude(self, *names: str) -> None:
        """Go on without a cause, or without these together, for as many sets again: those behind
        were hardly weighed."""
        self.table.banned.add(frozenset(names))
        self._most = len(self._tried) + MOST_SETS
        self._expanded.clear()
        self.run()

    @property
    def diverged(self) -> set[str]:
        """Labels of causes that explain something where they are linearised, and whose fit by
        themselves diverges from there."""
        return {
            labels[0] for labels in self._tried
            if len(labels) == 1 and (labels, NOMINAL) not in self.table.found
        }  # fmt: skip

    @property
    def _least_promise(self) -> float:
        """Score from which on a cause is worth a fit by itself, of what its derivative promises
        where nothing has changed: SEARCH_NATS below the best; above nothing where the best leaves
        something unknown, or has no cause and raised noise. Far from linear, as the force of a line
        that drags the ship away, a cause may explain many times what it promises."""
        best, nothing = self.table.ranked()[0], self.table.nothing.score
        least = best.score - SEARCH_NATS
        explained = best.kind == NOMINAL or (best.kind == RAISED and best.causes)
        return least if explained else min(least, nothing + SEARCH_NATS)

    def _banned(self, labels: Sequence[str]) -> bool:
        return holds_one(self.table.banned, labels)

    def cause_set(self, labels: tuple[str, ...]) -> CauseSet:
        """A set of causes, with what was weighed so far as seeds."""
        table, nothing = self.table, self.table.found.get(((), NOMINAL))
        others = Table({key: h for key, h in table.found.items() if h.causes != labels})
        raised, ranked = others.best(RAISED, table.banned), table.ranked()
        return CauseSet(
            table.trial, labels, self.noise, table.scale,
            nothing=None if nothing is None else nothing.evidence,
            raised=raised, intermittent=others.best(INTERMITTENT, table.banned),
            no_force=raised is not None and raised.causes in self._without_force,
            spectrum=table.parts.spectrum, best=ranked[0].score if ranked else -math.inf,
        )  # fmt: skip

    def weigh(
        self, labels: tuple[str, ...], numbers: Mapping[str, np.ndarray], at: Point,
        later: bool = False,
    ) -> None:  # fmt: skip
        """Put the hypotheses of these causes into the table; those with a remainder where they
        could win, or `later`, once another set was weighed."""
        table = self.table
        self._tried.add(labels)
        plain = plain_fit(self.cause_set(labels), table.fixed | dict(numbers), at)
        if plain is None:
            return
        for one in weigh_plain(plain):
            table.found.put(one)
        if plain.raises and (later or self._without_remainders or self._is_behind(labels)):
            self._without_remainders[labels] = dict(numbers)
        else:
            self._put_remainders(plain)
        if len(labels) == 1:
            (label,) = labels
            gained = table.found[labels, NOMINAL].evidence - table.nothing.evidence
            table.alone[label] = max(gained, table.alone.get(label, -math.inf))
        table.found = shortened(table.found, [table.nothing, *table.ranked()])
        del plain
        memory.give_back()
        if not later:
            self._add_remainders()

    def _is_behind(self, labels: tuple[str, ...]) -> bool:
        """Whether no remainder of these causes could win: a larger set is far ahead of them, and
        none adds to that one."""
        best, found = self.table.ranked()[0], self.table.found
        if best.kind != NOMINAL or not set(labels) < set(best.causes):
            return False
        own = max(found[labels, kind].score for kind in (NOMINAL, RAISED))
        return best.causes not in self._without_remainders and own < best.score - SEARCH_NATS

    def _add_remainders(self) -> None:
        """Weigh the remainders that were left out, where they could win by now."""
        for labels in list(self._without_remainders):
            if self._banned(labels) or self._is_behind(labels):
                continue
            table, numbers = self.table, self._without_remainders.pop(labels)
            plain = plain_fit(self.cause_set(labels), table.fixed | dict(numbers), table.first)
            if plain is None:
                continue
            self._put_remainders(plain)
            self._expanded.discard((labels, RAISED))
            table.found = shortened(table.found, [table.nothing, *table.ranked()])
            del plain
            memory.give_back()

    def _put_remainders(self, plain: Rough) -> None:
        """Put a set with each kind of remainder into the table."""
        labels = plain.of.labels
        weighed = weigh_remainders(replace(plain, of=self.cause_set(labels)))
        for one in weighed:
            self.table.found.put(one)
        if plain.raises and all(one.kind != INTERMITTENT for one in weighed):
            self._without_force.add(labels)

    def _weigh_ordinary(self) -> None:
        """The cause that explains most with the nominal process noise, where that is more probable
        than raised noise without a cause: it may leave nothing to a remainder."""
        table, none = self.table, self.table.found[(), RAISED]
        level = evidence.level(table.trial, table.first, 1.0, table.trial.fixed, RAISING)
        allowed = (c.label for c in table.catalogue if not self._banned((c.label,)))
        found = (evidence.candidate(table.trial, level, label) for label in allowed)
        best = max(found, key=lambda one: one.evidence, default=None)
        if best is not None and best.evidence > none.evidence:
            self.weigh((best.name,), best.numbers, table.first)

    def _weigh_wholes(self) -> None:
        """The causes of which a derivative where they are absent says little, each alone, from
        where it is whole: where that explains something, and more than its derivative promises."""
        table, nothing = self.table, self.table.nothing
        fit = table.fit(nothing)
        here = moves.value(table, fit.point, fit)
        for cause in table.catalogue:
            if not cause.whole or self._banned((cause.label,)):
                continue
            size = cause.sizes(table.trial.reference.setting)
            numbers = {cause.label: np.array(cause.whole) * size}
            try:  # about a path of its own: that without the cause is of another ship
                point = table.trial.linearise(numbers, None, fit.estimate.noise_factor)
            except np.linalg.LinAlgError:
                continue
            explained = moves.value(table, point, fit, tuple(numbers)) - here
            if explained > max(table.alone.get(cause.label, 0.0), SEARCH_NATS):
                self.weigh((cause.label,), numbers, point)

    def _weigh_again(self, labels: tuple[str, ...], one: Hypothesis, fit: Fit) -> None:
        """A set with one cause less than the best hypothesis, with that one's noise: it may have
        been weighed with noise that was less probable, which is no evidence for the cause."""
        if one is not self.table.ranked()[0]:
            return
        key = (labels, one.kind)
        if again := weigh_as(self.cause_set(labels), one, fit, self.table.found.get(key)):
            self.table.found.put(again)
            self._expanded.discard(key)

    def _expand(self, one: Hypothesis) -> None:
        """Weigh the sets with one cause more or less than a hypothesis has."""
        self._expanded.add((one.causes, one.kind))
        fit = self.table.fit(one)
        best = self.table.ranked()[0].score
        from_nothing = one is self.table.nothing
        for labels, numbers, predicted in self._additions(one, fit):
            first = not one.causes and one.score > best - SEARCH_NATS
            least = self._least_promise if from_nothing else best - SEARCH_NATS
            worth = first or predicted > least
            if worth and labels not in self._tried and len(self._tried) < self._most:
                (new,) = set(labels) - set(one.causes)
                if new not in self._starts:
                    self._starts[new] = moves.start_of(self.table, fit, new, numbers)
                if (start := self._starts[new]) is not None:
                    numbers = {**numbers, new: start}
                self.weigh(labels, numbers, fit.point)
        for labels, numbers in moves.reductions(one):
            if labels in self._tried:
                self._weigh_again(labels, one, fit)
            elif len(self._tried) < self._most:
                self.weigh(labels, numbers, fit.point)
        for labels, numbers in self._exchanges(one) if one.score == best else ():
            if labels not in self._tried and len(self._tried) < self._most:
                self.weigh(labels, numbers, fit.point)

    def _exchanges(self, one: Hypothesis) -> list[tuple[tuple[str, ...], dict[str, np.ndarray]]]:
        """The sets with another form of one of the best hypothesis' causes, such as the clock of
        another channel, where both cannot be in one set: which form promised more where nothing was
        known of its size is no proof. A form that promised less than LIKELY of it is left out."""
        table, found = self.table, []
        nothing = table.nothing.score
        for label in one.causes:
            rest = [n for n in one.causes if n != label]
            for other in table.catalogue:
                fits = all(moves.compatible(other, table.by[n]) for n in rest)
                if name_of(other.label) != name_of(label) or other.label == label or not fits:
                    continue
                promised = self.scanned[other.label] - nothing
                if moves.compatible(other, table.by[label]) or promised <= 0.0:
                    continue
                if promised >= LIKELY * (self.scanned[label] - nothing):
                    numbers = {n: one.estimate.numbers[n] for n in rest}
                    numbers[other.label] = np.zeros(other.count)
                    labels = tuple(sorted((*rest, other.label)))
                    if not self._banned(labels):
                        found.append((labels, numbers))
        return found

    def _additions(self, one: Hypothesis, fit: Fit) -> list[Addition]:
        """As `additions`, of causes that are not banned; none beyond `MOST_CAUSES`."""
        if len(one.causes) >= MOST_CAUSES:
            return []
        catalogue = self.table.catalogue
        allowed = [c for c in catalogue if not self._banned((*one.causes, c.label))]
        return moves.additions(self.table, one, fit, allowed, self.nearer)

    def _scan_each_alone(self) -> None:
        """What each cause explains by itself, and what would show of it, whatever is searched."""
        table, nothing = self.table, self.table.nothing
        _, found = evidence.scan(
            table.trial, table.fit(nothing).point, table.catalogue, table.trial.fixed,
            nothing.estimate.noise_factor,
        )  # fmt: skip
        scale = table.scale
        table.alone |= {f.name: f.evidence for f in found}
        self.scanned = {
            f.name: scale.score(nothing.evidence + f.evidence, (f.name,), NOMINAL) for f in found
        }
        self.expected = {  # what a nominal voyage has of a cause has to be exceeded, too
            f.name: replace(f.expected, cost=f.expected.cost + table.placebo.get(f.name, 0.0))
            for f in found if f.expected is not None
        }  # fmt: skip
        self._say_what_would_not_show()

    def _say_what_would_not_show(self) -> None:
        """Log the causes that these voyages cannot reveal, before any is searched for."""
        shares = {
            name: expected.common_size(thresholds.SHOWS_NATS)
            for name, expected in self.expected.items()
        }
        blind = [
            f"{name_of(n)} below {s:.0%}" if s < WHATEVER_SIZE else f"{name_of(n)} at any size"
            for n, s in shares.items() if s > 1.0
        ]  # fmt: skip
        if blind:
            log.info("not detectable at realistic size: %s", ", ".join(dict.fromkeys(blind)))
