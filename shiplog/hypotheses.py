"""Every hypothesis about a trial on one scale: nothing, noise, each cause, unknown structures.

A trial's segments are linearised once; each hypothesis is then algebra. What is named is
linearised again where it was found, with a path of its own, until it rests.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from shiplog import evidence, segments, structure
from shiplog.causes import Cause
from shiplog.evidence import Gram, Weighed
from shiplog.record import Record
from shiplog.reference import Reference, read
from shiplog.segments import Linear, Path

LOUDER = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0)  # λ: how much more unrest than usual
QUIETER = 0.7
ROBUST = 6.0  # segments beyond this many medians count less
ROUNDS = 3  # of linearising again
REST = 0.02  # of a number's size: it rests


@dataclass(frozen=True)
class Found:
    """One hypothesis.

    evidence   log marginal likelihood, nats above `nothing but louder unrest`
    louder     λ at which it is best
    numbers    of each cause in it, as a change from what is usual, with their covariance
    """

    name: str
    evidence: float
    louder: float
    numbers: Mapping[str, np.ndarray] = field(default_factory=dict)
    covariance: np.ndarray | None = None


@dataclass(frozen=True)
class Point:
    """A trial linearised where some causes' numbers stand."""

    numbers: Mapping[str, np.ndarray]
    path: Path
    linear: Linear
    weighed: Weighed


@dataclass(frozen=True)
class Level:
    """One λ: the trial's products in units, robustly weighted, and the base hypothesis' solution.

    The base holds the causes named already, free, beside all that is usual.
    """

    louder: float
    gram: np.ndarray  # [1 + C, 1 + C]
    logdet: float
    inverse: np.ndarray  # of information and data together, base's own numbers last
    solution: np.ndarray
    value: float  # log evidence of the base


class Trial:
    """Voyages under question, against a reference."""

    def __init__(self, reference: Reference, record: Record) -> None:
        self.reference, self.record = reference, record
        self.grid = segments.grid(record)
        self.rows = segments.begins(record)
        self._known: tuple[np.ndarray, np.ndarray] | None = None
        self.weight = np.ones(len(self.rows))

    # --- linearisation ---

    def at(self, numbers: Mapping[str, np.ndarray], path: Path | None = None) -> Point:
        """Linearised with these numbers, around a path pulled onto what was then measured."""
        ref = self.reference
        cut, moved, shown = read(
            ref.model, ref.setting, self.record, self.rows, dict(numbers), self._known
        )
        if self._known is None:
            self._known = (moved, shown)
        whole = np.concatenate((ref.theta, ref.columns.numbers(dict(numbers))))
        path = segments.pulled(
            ref.model, whole, cut, self.grid, ref.wide, path, rounds=1 if path else 2
        )
        linear = segments.linear(ref.model, whole, cut, self.grid, path, moved, shown)
        return Point(numbers, path, linear, evidence.weighed(linear, ref.unrest.noise))

    def robust(self, point: Point) -> None:
        """Weights of the segments, the same for every hypothesis: a few must not decide."""
        ref = self.reference
        level = self.level(point, self.quietest(point), ())
        gram = evidence.gram(point.weighed, ref.unrest.louder(level.louder)).scaled(
            ref.columns.unit
        )
        d = np.concatenate(([-1.0], level.solution[: len(ref.columns.unit)]))
        chi2 = np.einsum("i,sij,j->s", d, gram.each, d)
        self.weight = np.minimum(1.0, ROBUST * np.median(chi2) / np.maximum(chi2, 1e-9))

    # --- algebra ---

    def gram(self, point: Point, louder: float) -> Gram:
        ref = self.reference
        found = evidence.gram(point.weighed, ref.unrest.louder(louder)).scaled(ref.columns.unit)
        return Gram(found.each * self.weight[:, None, None], found.logdet)

    def level(self, point: Point, louder: float, included: Sequence[str]) -> Level:
        """The base hypothesis at one λ: what is usual, and the included causes free."""
        ref = self.reference
        gram = self.gram(point, louder)
        return self._solved(
            gram.total, gram.logdet, louder, point, included, ref.information, ref.pull
        )

    def _solved(self, total, logdet, louder, point, included, information, pull) -> Level:
        columns = self.reference.columns
        extra = np.concatenate([columns.of[name] for name in included] or [np.zeros(0, int)])
        chosen = np.concatenate((np.arange(len(total) - 1), extra)).astype(int)
        gram = np.block(
            [[total[:1, :1], total[:1, 1 + chosen]],
             [total[1 + chosen][:, :1], total[np.ix_(1 + chosen, 1 + chosen)]]]
        )  # fmt: skip
        count, more = len(pull), len(extra)
        known = np.zeros((count + more, count + more))
        known[:count, :count] = information
        known[count:, count:] = np.eye(more)
        # the included numbers are counted from where they were linearised
        stood = [point.numbers.get(n, np.zeros(len(columns.of[n]))) for n in included]
        units = [columns.unit[columns.of[n]] for n in included]
        before = np.concatenate(
            [-s / u for s, u in zip(stood, units, strict=True)] or [np.zeros(0)]
        )
        towards = np.concatenate((pull, before))
        both = gram[1:, 1:] + known
        inverse = np.linalg.inv(both)
        solution = inverse @ (gram[1:, 0] + towards)
        square = gram[0, 0] + towards @ np.linalg.solve(known, towards)
        square -= (gram[1:, 0] + towards) @ solution
        value = -0.5 * float(
            square + np.linalg.slogdet(both)[1] - np.linalg.slogdet(known)[1] + logdet
        )
        return Level(louder, gram, logdet, inverse, solution, value)

    def quietest(self, point: Point, included: Sequence[str] = ()) -> float:
        """λ at which the base hypothesis is best, alone."""
        levels = self.levels(point, included)
        return max(levels, key=lambda level: level.value).louder

    def levels(self, point: Point, included: Sequence[str] = ()) -> list[Level]:
        """From the usual unrest upwards, until it is too much; below it, if that is better."""
        found = []
        for louder in LOUDER:
            found.append(self.level(point, louder, included))
            if len(found) > 1 and found[-1].value < found[-2].value:
                break
        if len(found) == 2:
            found.append(self.level(point, QUIETER, included))
        return found

    def scan(
        self, point: Point, candidates: Sequence[Cause], included: Sequence[str] = ()
    ) -> tuple[Found, list[Found]]:
        """The base hypothesis, and each candidate besides it, each at its own best λ."""
        levels = self.levels(point, included)
        best = max(levels, key=lambda level: level.value)
        # a cause that explains makes the unrest fall: every λ from the usual one to the base's
        found = []
        for cause in candidates:
            tried = [self._with(level, cause.label) for level in levels]
            found.append(max(tried, key=lambda f: f.evidence))
        base = Found(
            "nothing", 0.0, best.louder,
            *self._numbers(best, point, included),
        )  # fmt: skip
        moved = [replace(f, evidence=f.evidence - best.value) for f in found]
        return replace(base, evidence=best.value), sorted(moved, key=lambda f: -f.evidence)

    def _with(self, level: Level, label: str) -> Found:
        """One cause more, its change from the usual with a prior of its size."""
        columns = self.reference.columns.of[label]
        joined = level.gram[1:, 1:][:, columns]
        pull = level.gram[1:, 0][columns] - joined.T @ level.solution
        own = joined[columns] - joined.T @ level.inverse @ joined + np.eye(len(columns))
        value = np.linalg.solve(own, pull)
        gained = 0.5 * float(pull @ value) - 0.5 * float(np.linalg.slogdet(own)[1])
        unit = self.reference.columns.unit[columns]
        return Found(
            label, level.value + gained, level.louder, {label: value * unit},
            np.linalg.inv(own) * np.outer(unit, unit),
        )  # fmt: skip

    def _numbers(
        self, level: Level, point: Point, included: Sequence[str]
    ) -> tuple[dict[str, np.ndarray], np.ndarray]:
        columns = self.reference.columns
        at, found = len(columns.unit), {}
        start = at
        units = []
        for name in included:
            unit = columns.unit[columns.of[name]]
            stood = point.numbers.get(name, np.zeros(len(unit)))
            found[name] = stood + level.solution[at : at + len(unit)] * unit
            units.append(unit)
            at += len(unit)
        whole = np.concatenate(units or [np.zeros(0)])
        return found, level.inverse[start:, start:] * np.outer(whole, whole)

    def settle(
        self, included: Sequence[str], numbers: Mapping[str, np.ndarray], path: Path | None
    ) -> tuple[Point, Found]:
        """These causes together, linearised where they are until they rest."""
        by = {cause.label: cause for cause in self.reference.model.causes}
        point = None
        for _ in range(ROUNDS):
            point = self.at(numbers, path)
            path = point.path
            base, _ = self.scan(point, (), included)
            moved = {}
            for name in included:
                low, high = by[name].bounds(self.reference.setting)
                moved[name] = np.clip(base.numbers[name], low, high)
            size = {n: self.reference.columns.unit[self.reference.columns.of[n]] for n in included}
            far = max(
                float(np.abs((moved[n] - numbers[n]) / size[n]).max()) for n in included
            )
            numbers = moved
            if far < REST:
                break
        assert point is not None
        return point, replace(base, name="+".join(included), numbers=numbers)

    # --- unknown structures and louder unrest ---

    def structures(self, point: Point, base: Found, included: Sequence[str]) -> list[Found]:
        """Each family's evidence above the base hypothesis, less what is usual of it."""
        ref = self.reference
        here = structure.at_knots(point.linear.cut, self.grid)
        usual = None
        if ref.nominal is not None:
            usual = structure.at_knots(ref.nominal.cut, self.grid)
        found = []
        for family in structure.FAMILIES:
            basis = structure.basis(family, self.record, *(k for k in (usual, here) if k))
            if basis is None:
                continue
            columns = structure.columns(point.linear, basis.features(here), ref.unrest.push)
            weighed = evidence.weighed(
                point.linear, ref.unrest.noise, np.concatenate((point.linear.j, columns), -1)
            )
            before = None
            if usual is not None and ref.nominal is not None and family != "time":
                added = structure.columns(ref.nominal, basis.features(usual), ref.unrest.push)
                joined = np.concatenate((ref.nominal.j, added), -1)
                before = evidence.gram(
                    evidence.weighed(ref.nominal, ref.unrest.noise, joined), ref.unrest
                ).total
            best = max(
                (
                    one
                    for louder in sorted({1.0, base.louder})
                    for one in self._structure(family, weighed, before, point, included, louder)
                ),
                key=lambda f: f.evidence,
            )
            found.append(replace(best, evidence=best.evidence - base.evidence))
        return sorted(found, key=lambda f: -f.evidence)

    def _structure(self, family, weighed, before, point, included, louder) -> Iterator[Found]:
        """At one λ, in each size."""
        ref = self.reference
        unit = ref.columns.unit
        count, more = len(unit), weighed.dd.shape[-1] - 1 - len(unit)
        gram = evidence.gram(weighed, ref.unrest.louder(louder))
        whole = (gram.each * self.weight[:, None, None]).sum(0)
        fresh = np.eye(count + more)
        fresh[:count, :count] = ref.information
        pull = np.concatenate((ref.pull, np.zeros(more)))
        for size in structure.SIZES:
            by = np.concatenate(([1.0], unit, np.full(more, size)))
            total = whole * np.outer(by, by)
            value = self._solved(total, gram.logdet, louder, point, included, fresh, pull).value
            if before is not None:
                # what the nominal campaign has of it already is no news
                known = _joint(before * np.outer(by, by), ref)
                usual = self._solved(total, gram.logdet, louder, point, included, *known).value
                kept = total[: count + 1, : count + 1]
                without = self._solved(
                    kept, gram.logdet, louder, point, included, ref.information, ref.pull
                ).value
                value -= max(usual - without, 0.0)
            yield Found(family, value, louder)


def _joint(known: np.ndarray, ref: Reference) -> tuple[np.ndarray, np.ndarray]:
    """Information and pull of coefficients and weights together after the nominal campaign; κ
    makes the coefficients less sure, not the weights."""
    size, count = len(known) - 1, len(ref.pull)
    before = np.diag(np.concatenate((ref.columns.known, np.ones(size - count))))
    mean = np.linalg.solve(known[1:, 1:] + before, known[1:, 0])
    by = np.ones(size)
    by[:count] = ref.kappa**-0.5
    information = known[1:, 1:] * np.outer(by, by) + before
    return information, information @ mean
