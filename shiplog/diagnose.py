"""From evidence to a verdict: what is named, what is not, and why.

Forward selection with a backward check, on one scale of evidence with `nothing but louder
unrest`, a thruster that nobody records, and unknown structures. A cause is named only where it
beats them all, is large enough to matter, and did not come out of a fit that failed.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from shiplog import unnamed
from shiplog.causes import Cause
from shiplog.decision import LEAST, PULSES, Decision, Named, Structure
from shiplog.hypotheses import Found, Point, Trial
from shiplog.settling import FALLS, settle
from shiplog.unnamed import Pulses

LEARNED = 40.0  # that the first one must beside a network that has learned from these voyages
CONTENDS = 2.0  # nats from which on a cause is linearised again
MORE = 25.0  # that one must whose gain is not sure
FURTHER = 30.0  # that each further one must: small evidence follows large ones about
SURE = 60.0  # that leave no doubt, where held-out voyages cannot tell gain from loss
FLEXIBLE = 40.0  # nats that an unknown structure must bring beyond a cause: it fits anything
UNKNOWN = 60.0  # nats that it must bring where no cause is named
FAINT = 60.0  # nats of a cause, below which a structure that explains as much takes its place
POSES = 0.0  # nats that a structure as good as the first cause may still bring beside it
STOCHASTIC = 40.0  # nats that louder unrest must bring to be said
LOUD = 1.4  # times the usual unrest, from which on it is asked where it comes from
PULSED = 40.0  # nats that pulses must bring beyond louder unrest, the first thing beyond all else
TEMPERATURE = 2.0  # nats: at 3, 176 of 177 blind cases said with 0.9 and more were right
ALIKE = 8.0  # nats within which two causes cannot be told apart
MOST = 3  # causes
EXCHANGE = 2.0  # nats that a cause must bring in another one's place
MOVED = "motion"  # what a thruster that nobody records changes itself
SETTLED = 3  # contenders that are linearised again
SHARE = 0.3  # of the best one's evidence that makes a contender


def decide(trial: Trial, point: Point, banned: Collection[str] = ()) -> Decision:
    """From a trial linearised as the model stands, with what it has of causes (`Trial.fixed`).

    banned   labels that held-out voyages have refuted already
    """
    trial.unrest = trial.reference.unrest
    search = _Search(trial, point, banned)
    nothing = search.base
    while search.one_more():
        pass
    search.backwards()
    named = search.named()
    setting = trial.reference.setting
    traces = tuple(n for n in named if not n.cause.practical(n.numbers, setting))
    real = tuple(n for n in named if n.cause.practical(n.numbers, setting))
    structure, base = search.structure, search.base
    verdict = "named" if real or search.pulses else "none"
    if structure is not None and verdict == "none":
        verdict = "unknown"
    elif verdict == "none" and base.louder >= LOUD and search.stochastic > STOCHASTIC:
        verdict = "unknown"
        structure = Structure("stochastic", search.stochastic, ("surge", "sway", "yaw_rate"))
    return Decision(
        verdict, real, structure, search.pulses, traces, search.rejected, search.ranking,
        base.louder, search.point, base, point, nothing, tuple(search.remains), search.told,
        least=search.least,
    )  # fmt: skip


class _Search:
    """Forward selection as it stands: what is named so far, beside the causes that may join."""

    def __init__(self, trial: Trial, point: Point, banned: Collection[str]) -> None:
        self.trial, self.point = trial, point
        self.least = LEARNED if trial.reference.learned else LEAST
        self.included: tuple[str, ...] = trial.fixed
        self.catalogue = [
            c for c in trial.reference.model.causes
            if c.label not in trial.fixed and c.label not in banned
        ]  # fmt: skip
        self.base, self.found = trial.scan(point, self.catalogue, self.included)
        self.told = {f.name: f.told for f in self.found if f.told is not None}
        self.rejected: dict[str, str] = {}
        self.ranking: dict[str, float] = {}
        self.steps: dict[str, tuple[float, dict[str, float]]] = {}  # evidence, and over others
        self.pulses: Pulses | None = None
        self.structures = unnamed.Structures(trial, point)
        self.structure: Structure | None = None
        self.remains: list[Found] = []
        self.start = (point, self.base)
        self.rival: Found | None = None  # the best structure before the first cause was named
        self.first = ""  # the cause whose probability is of the ranking

    @property
    def stochastic(self) -> float:
        """Nats that louder unrest brings over the usual one."""
        if self.base.louder <= 1.0:
            return 0.0
        usual = self.trial.level(self.point, 1.0, self.included).value
        return self.base.evidence - usual

    def _rough(self, included: Sequence[str]) -> bool:
        causes = self.trial.reference.model.causes
        return any(c.rough for c in causes if c.label in included)

    def _may_pulse(self, base: Found, included: Sequence[str]) -> bool:
        """What a map leaves of a shoal comes and goes, too, as the ship passes it."""
        return self.pulses is None and base.louder >= LOUD and not self._rough(included)

    def one_more(self) -> bool:
        """Whether something more was found: a cause, or a thruster that nobody records."""
        self.remains = self._unexplained()
        if self._pulses():
            return True
        if self._poses():
            return False
        settled = _settle(self.trial, self.point, self.base, self.found, self.included)
        first = self.included == self.trial.fixed
        further = max(SURE if self._rough(self.included) else FURTHER, self.least)
        wanted = self.least if first and self.pulses is None else further
        if not self.ranking:
            self.ranking = self._ranked(settled, wanted)
        best = settled[0][1] if settled else None
        gain = best.evidence - self.base.evidence if best else -math.inf
        if self._structure(settled, gain):
            return False
        full = len(self.included) - len(self.trial.fixed) >= MOST
        if best is None or gain < wanted or full:
            return False
        self._take(settled, gain)
        return True

    def _unexplained(self) -> list[Found]:
        """What unknown structures explain beside all that was found. Beside a thruster that nobody
        records none of motion is asked: it moves the ship as no model knows, and what is left of
        that goes with its motion."""
        found = self.structures.found(self.point, self.base, self.included)
        return found if self.pulses is None else [f for f in found if f.name != MOVED]

    def _pulses(self) -> bool:
        """Whether a force that comes and goes explains the unrest better than all else."""
        if not self._may_pulse(self.base, self.included):
            return False
        tried = unnamed.pulses(self.trial, self.point, self.base)
        rivals = max((f.evidence for f in (*self.found[:1], *self.remains[:1])), default=0.0)
        wanted = PULSED + max(rivals, 0.0)
        if self.rival is not None:  # it may do without cause and thruster
            instead = self.rival.evidence + SURE - self.steps[self.first][0]
            wanted = max(PULSED, rivals, instead)
        if tried.gain <= wanted:
            return False
        self.rival = None
        self._pulsed(tried)
        return True

    def _pulsed(self, pulses: Pulses) -> None:
        """This is the thruster, beside which all else is judged."""
        self.pulses = pulses
        self.trial.unrest = replace(self.trial.unrest, pulse=pulses.unit * pulses.force)
        self.base, self.found = self.trial.scan(
            self.point, self._left(self.included), self.included
        )

    def _structure(self, settled: Sequence[tuple[Point, Found]], gain: float) -> bool:
        """Whether an unknown structure explains far more than the best cause; or, where not much
        speaks for that, as much: a structure pays for its freedom, and beside a true cause it
        explains less. Of what is little for either nothing is said."""
        strongest = max(self.remains, key=lambda f: f.evidence, default=None)
        if strongest is None:
            return False
        best = settled[0][1] if settled else None
        far = strongest.evidence > max(UNKNOWN, gain + FLEXIBLE)
        if far and settled and strongest.evidence <= gain + self._second(*settled[0]):
            if not self.steps:
                self._inherits(_last(settled[0][1]), f"unknown:{strongest.name}")
            return False
        faint = self.least <= gain < FAINT and strongest.evidence >= gain - TEMPERATURE
        if not (far or faint):
            return False
        if far or gain >= MORE:
            acts_on = self.structures.acts_on(self.point, strongest)
            self.structure = Structure(strongest.name, strongest.evidence, acts_on)
        if best is not None:
            more = strongest.evidence - max(gain, 0.0)
            much = f"{more:.0f} nats more" if more >= 1.0 else "as much"
            self.rejected[_last(best)] = (
                f"a dependence on {strongest.name} that it does not have explains {much}"
            )
            if faint:
                self._instead(_last(best), strongest, odds(more + TEMPERATURE, 0.0))
        return True

    def _second(self, point: Point, best: Found) -> float:
        """Nats that a further cause brings beside the best one, or a thruster that nobody records,
        where it would be taken: a structure may explain two causes at once."""
        included = tuple(best.numbers)
        _, found = self.trial.scan(point, self._left(included), included)
        told = [f.evidence for f in found if f.evidence >= FURTHER]
        if self._may_pulse(best, included):
            tried = unnamed.pulses(self.trial, point, best)
            told += [tried.gain] if tried.gain > PULSED else []
        return max(told, default=0.0)

    def _instead(self, label: str, structure: Found, sure: float) -> None:
        """Of the probability of a cause so much is the structure's that takes its place."""
        moved = sure * self.ranking.get(label, 0.0)
        family = f"unknown:{structure.name}"
        self.ranking[label] = self.ranking.get(label, 0.0) - moved
        self.ranking[family] = self.ranking.get(family, 0.0) + moved

    def _inherits(self, label: str, other: str) -> None:
        """The probability of another answer is a cause's, which explains what that one does."""
        self.ranking[label] = self.ranking.get(label, 0.0) + self.ranking.pop(other, 0.0)

    def _poses(self) -> bool:
        """Whether what was named first only looks like what is there: a structure that anything may
        have explained as much, for all its freedom, and explains more beside it, which is no
        second cause's."""
        rival, self.rival = self.rival, None
        strongest = max(self.remains, key=lambda f: f.evidence, default=None)
        second = max((f.evidence for f in self.found), default=-math.inf)
        if rival is None or strongest is None or strongest.evidence < max(POSES, second):
            return False
        ((label, (gain, _)),) = self.steps.items()
        if rival.evidence < gain:
            return False
        self.steps.clear()
        self.rejected[label] = (
            f"a dependence on {rival.name} explains as much, and beside it "
            f"{strongest.evidence:.0f} nats more"
        )
        self._instead(label, rival, odds(strongest.evidence, POSES))
        self.included, self.point, self.base = self.trial.fixed, *self.start
        self.structure = Structure(
            rival.name, rival.evidence, self.structures.acts_on(self.point, rival)
        )
        return True

    def _take(self, settled: Sequence[tuple[Point, Found]], gain: float) -> None:
        """The best contender joins; the others are set against it."""
        if not self.steps and self.pulses is None:
            self.rival = max(self.remains, key=lambda f: f.evidence, default=None)
        self.point, self.base = settled[0]
        label = _last(self.base)
        if self.pulses is None:
            self.first = self.first or label
        less = {_last(one): self.base.evidence - one.evidence for _, one in settled[1:]}
        self.steps[label] = (gain, less)
        for other, nats in less.items():
            self.rejected.setdefault(other, f"{label} explains {nats:.0f} nats more")
        self.included = tuple(self.base.numbers)
        if self.pulses is not None:  # its place was found while it had to explain this, too
            self._pulsed(unnamed.pulses(self.trial, self.point, self.base))
            return
        _, self.found = self.trial.scan(self.point, self._left(self.included), self.included)

    def _left(self, included: Sequence[str]) -> list[Cause]:
        left = [c for c in self.catalogue if all(c.beside(label) for label in included)]
        return left if self.pulses is None else [c for c in left if not c.answers]

    def _ranked(self, settled: Sequence[tuple[Point, Found]], wanted: float) -> dict[str, float]:
        """Probabilities of the first step, tempered; `none` holds the threshold."""
        base = self.base
        value = {"none": wanted}
        value |= {f.name: f.evidence for f in self.found}
        value |= {_last(one): one.evidence - base.evidence for _, one in settled}
        value |= {f"unknown:{f.name}": f.evidence - FLEXIBLE for f in self.remains}
        if base.louder >= LOUD:  # said where nothing is named
            value["unknown:stochastic"] = wanted + self.stochastic - STOCHASTIC
            if settled and settled[0][1].evidence - base.evidence > wanted:
                value["unknown:stochastic"] = min(value["unknown:stochastic"], wanted)
        share = np.array(list(value.values())) / TEMPERATURE
        share = np.exp(share - share.max())
        share /= share.sum()
        order = np.argsort(-share)
        ranking = {list(value)[i]: float(share[i]) for i in order}
        if self.pulses is None:
            return ranking
        sure = odds(self.pulses.gain, PULSED)
        return {PULSES: sure} | {k: (1.0 - sure) * v for k, v in ranking.items()}

    def backwards(self) -> None:
        """Each named cause must still be missed when the others are refitted without it. What the
        first one that is not had of evidence and probability is the next one's."""
        fixed = len(self.trial.fixed)
        while len(self.included) - fixed > 1:
            losses, instead = {}, []
            for label in self.included[fixed:]:
                rest = tuple(n for n in self.included if n != label)
                numbers = {n: self.base.numbers[n] for n in rest}
                point, base = settle(self.trial, rest, numbers, self.point.path)
                losses[label] = (self.base.evidence - base.evidence, point, base, rest)
                others = [c for c in self._left(rest) if c.label != label]
                _, found = self.trial.scan(point, others, rest)
                instead += [(f.evidence - losses[label][0], label, f) for f in found[:1]]
            label = min(losses, key=lambda n: losses[n][0])
            loss, point, base, rest = losses[label]
            if loss >= self.least:
                if instead and self._exchanged(max(instead, key=lambda one: one[0]), losses):
                    continue
                break
            less = max(loss, 0.0)
            self.rejected[label] = f"without it the others explain all but {less:.0f} nats"
            gone, _ = self.steps.pop(label)
            self.included, self.point, self.base = rest, point, base
            if label == self.first:
                self.first = rest[fixed]
                gain, beaten = self.steps[self.first]
                self.steps[self.first] = (gone + gain - loss, beaten)
                self._inherits(self.first, label)

    def _exchanged(self, best: tuple[float, str, Found], losses: dict) -> bool:
        """Whether another cause explains more in the place of one that is named: the first was
        chosen while it had to explain the others' part, too."""
        lead, label, other = best
        if lead < -CONTENDS:
            return False
        loss, point, base, rest = losses[label]
        numbers = {**base.numbers, **other.numbers}
        at, fitted = settle(self.trial, (*rest, other.name), numbers, point.path)
        more = fitted.evidence - self.base.evidence
        if not more > EXCHANGE:
            return False
        self.rejected[label] = f"beside the others {other.name} explains {more:.0f} nats more"
        self.rejected.pop(other.name, None)
        self.steps.pop(label)
        self.steps[other.name] = (loss + more, {label: more})
        if label == self.first:
            self.first = other.name
            self._inherits(other.name, label)
        self.included, self.point, self.base = tuple(fitted.numbers), at, fitted
        return True

    def named(self) -> tuple[Named, ...]:
        by = {c.label: c for c in self.trial.reference.model.causes}
        found, at = [], 0
        for label in self.included:
            cause = by[label]
            part = slice(at, at + cause.count)
            at += cause.count
            if label in self.trial.fixed:
                continue
            assert self.base.covariance is not None
            gain, less = self.steps[label]
            sure = odds(gain, FURTHER)
            alike = tuple(other for other, nats in less.items() if nats < ALIKE)
            found.append(
                Named(
                    cause, gain, self.ranking.get(label, sure) if label == self.first else sure,
                    np.asarray(self.base.numbers[label]), self.base.covariance[part, part], alike,
                    less, self.trial.reference.freedom,
                )
            )  # fmt: skip
        return tuple(found)


def _last(found: Found) -> str:
    """The label that joined last."""
    return found.name.split("+")[-1]


def _settle(trial, point, base, found, included) -> list[tuple[Point, Found]]:
    """Contenders linearised where they are found, best first; those whose fit ran away left out."""
    contenders = [
        f
        for f in found[:SETTLED]
        if f.evidence > CONTENDS and f.evidence >= SHARE * found[0].evidence
    ]
    settled = []
    for one in contenders:
        numbers = dict(base.numbers) | dict(one.numbers)
        beat = max((f.evidence for _, f in settled), default=-math.inf) - ALIKE
        at, fitted = settle(
            trial, (*included, one.name), numbers, point.path, beat, base.evidence - FALLS
        )  # fmt: skip
        if np.isfinite(fitted.evidence):
            settled.append((at, fitted))
    return sorted(settled, key=lambda pair: -pair[1].evidence)


def odds(gain: float, wanted: float) -> float:
    """Probability of what brings so many nats where so many are wanted."""
    return 1.0 / (1.0 + math.exp(min((wanted - gain) / TEMPERATURE, 50.0)))
