"""Hypotheses about a trial on one scale: nothing, noise, each cause.

A trial's segments are linearised once; each hypothesis is then algebra. What is named is
linearised again where it was found, with a path of its own, until it rests.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from shiplog.diagnosis import likelihood, linearisation, residual_acceleration, segments
from shiplog.diagnosis.fitted import Found, Level, Point, Told
from shiplog.diagnosis.likelihood import Modes, Weighed
from shiplog.diagnosis.linear_segments import Linear, Path
from shiplog.diagnosis.measurement_correction import read
from shiplog.diagnosis.nominal_reference import Reference
from shiplog.diagnosis.parameter_layout import HELD_INFORMATION
from shiplog.models.causes import Cause
from shiplog.voyages.recording import Record

NOISE_FACTORS = (1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0)  # λ, factors of process noise
QUIETER = (0.7, 0.5, 0.35, 0.25)
FINER = 1.08  # step of λ about the best one
ROBUST = 6.0  # segments beyond this many medians count less


Read = tuple[segments.Cut, np.ndarray, np.ndarray]  # see `reading.read`


class TrialEvidence:
    """The trial against its nominal reference. `process_noise` includes an intermittent force.

    first    where it was linearised first
    rested   labels and force → numbers, path and λ at which a fit of these causes converged
    """

    def __init__(self, reference: Reference, record: Record, fixed: Sequence[str] = ()) -> None:
        """`fixed`: labels of causes that the model has already, with numbers that stay."""
        self.reference, self.record, self.fixed = reference, record, tuple(fixed)
        self.process_noise = reference.process_noise
        self.grid = segments.grid(record)
        self.rows = segments.begins(record)
        self._known: list[tuple[dict[str, np.ndarray], Read]] = []
        self.first: Point | None = None
        self.kept_modes: list[tuple[Weighed, Modes]] = []
        self._volumes: dict[tuple[float, bytes], float] = {}
        self.rested: dict[tuple[tuple[str, ...], bytes], tuple[dict, Path, float]] = {}
        self.weight = np.ones(len(self.rows))

    @property
    def pulse(self) -> bytes:
        """Identifies a process noise of this trial."""
        return b"" if self.process_noise.pulse is None else self.process_noise.pulse.tobytes()

    # --- linearisation ---

    def at(
        self,
        numbers: Mapping[str, np.ndarray],
        near: Path | Point | None = None,
        noise_factor: float | None = None,
    ) -> Point:
        """Linearised with these numbers, around a path pulled onto what was then measured.

        near          a path to pull from, or a point that expects what these numbers do to its own
        noise_factor  λ that holds the path: one that follows every wave of the noise is as far
                      from the likely one as a free rollout, and its nonlinearity imitates evidence
        """
        ref = self.reference
        wide = (
            ref.wide if noise_factor is None else ref.held(noise_factor, self.process_noise.pulse)
        )
        cut, moved, shown = self._read(numbers)
        whole = np.concatenate((ref.theta, ref.columns.numbers(dict(numbers))))
        if isinstance(near, Point):
            stood = np.concatenate((ref.theta, ref.columns.numbers(dict(near.numbers))))
            path = linearisation.ahead(near.linear, whole - stood, wide)
        else:
            path = linearisation.pulled(
                ref.model, whole, cut, self.grid, wide, near, rounds=1 if near else 2
            )
        linear = linearisation.linear(
            ref.model, whole, cut, self.grid, path, moved, shown, ref.wide
        )
        point = Point(numbers, path, linear, likelihood.weighed(linear, self.process_noise))
        if self.first is None:
            self.first = point
        return point

    def _read(self, numbers: Mapping[str, np.ndarray]) -> Read:
        """As `reading.read`. How a cause changes what is read depends on what is put right
        before: together with a clock that is late by a second an antenna's columns are a second
        old, and two clocks would seem to disagree. Nor do columns from a little together with
        serve: those of several clocks then differ by their noise, and a sum of them explains that
        of the data."""
        ref = self.reference
        reading = {
            c.label: np.asarray(numbers[c.label])
            for c in ref.model.causes
            if c.reads and c.label in numbers
        }
        for before, found in self._known:
            if before.keys() == reading.keys() and self.apart(before, reading) == 0.0:
                return found
        found = read(ref.model, ref.setting, self.record, self.rows, reading)
        self._known = [*self._known[:1], (reading, found)]
        return found

    def apart(self, one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> float:
        """The most that a number differs, in units of its size; of the same causes."""
        columns = self.reference.columns
        return max(
            (float(np.abs((one[n] - other[n]) / columns.unit[columns.of[n]]).max()) for n in one),
            default=0.0,
        )

    def begin(self, numbers: Mapping[str, np.ndarray]) -> Point:
        """The model as it stands, with weights of the segments and a path held as firmly as the
        process noise then found allows."""
        point = self.at(numbers)
        self.robust(point)
        base, _ = self.scan(point, (), self.fixed)
        return self.at(numbers, point, base.noise_factor)

    def covering(self, point: Point) -> Linear:
        """The point's segments and those between them: residuals of the same accuracy
        everywhere."""
        ref = self.reference
        rows = np.setdiff1d(residual_acceleration.covering(self.record), self.rows)
        numbers = dict(point.numbers)
        cut, moved, shown = read(ref.model, ref.setting, self.record, rows, numbers)
        whole = np.concatenate((ref.theta, ref.columns.numbers(numbers)))
        path = linearisation.pulled(ref.model, whole, cut, self.grid, ref.wide)
        between = linearisation.linear(
            ref.model, whole, cut, self.grid, path, moved, shown, ref.wide
        )
        return point.linear.beside(between)

    def robust(self, point: Point) -> None:
        """Weights of the segments, the same for every hypothesis: a few must not decide."""
        ref = self.reference
        level = self.level(point, self.quietest(point), ())
        unit = ref.columns.unit
        weighed, d = self.left_of(point, level.solution[: len(unit)] * unit)
        modes = likelihood.modes(weighed, self.process_noise)
        gram = modes.gram(level.noise_factor).scaled(unit[: len(d)])
        d = np.concatenate(([-1.0], d / unit[: len(d)]))
        chi2 = np.einsum("i,sij,j->s", d, gram.each, d)
        self.weight = np.minimum(1.0, ROBUST * np.median(chi2) / np.maximum(chi2, 1e-9))

    # --- algebra ---

    def modes(self, point: Point, noise_factor: float) -> tuple[Modes, float]:
        """Products of the point, and the wanted factors λ: one pass serves every λ, but that of a
        pulse together with the process noise, whose axes turn with it."""
        if self.process_noise.pulse is not None:
            found = likelihood.modes(point.weighed, self.process_noise.times(noise_factor))
            return self._misfitting(found, point), 1.0
        for of, found in self.kept_modes:
            if of is point.weighed:
                return found, noise_factor
        found = self._misfitting(likelihood.modes(point.weighed, self.process_noise), point)
        # the first point's, for `volume`, and the last two
        self.kept_modes = [*self.kept_modes[:1], *self.kept_modes[1:][-1:], (point.weighed, found)]
        return found, noise_factor

    def _misfitting(self, modes: Modes, point: Point) -> Modes:
        misfit = self.reference.misfit
        if misfit is None:
            return modes
        return modes.beside(misfit.pushed(point.linear.cut, self.grid))

    def left(self, linear: Linear, d: np.ndarray) -> tuple[Linear, np.ndarray]:
        """A pass of the trial without what the misfit's weights among the numbers d [C] do, and
        the numbers of its own columns."""
        misfit, count = self.reference.misfit, self.reference.columns.linearised
        if misfit is not None:
            linear = linear.less(misfit.pushed(linear.cut, self.grid) @ d[count:])
        return linear, d[:count]

    def left_of(self, point: Point, d: np.ndarray) -> tuple[Weighed, np.ndarray]:
        """The same of a point, as its products."""
        linear, own = self.left(point.linear, d)
        if linear is point.linear:
            return point.weighed, own
        return likelihood.weighed(linear, self.process_noise), own

    def volume(self, noise_factor: float) -> float:
        """log |C| at one λ, the same for every hypothesis: that of the first point. How far a
        model lets process noise be felt is no evidence of a cause, and where the process noise is a
        model's own misfit it would count as such."""
        assert self.first is not None
        key = (noise_factor, self.pulse)
        if key not in self._volumes:
            modes, factor_by = self.modes(self.first, noise_factor)
            self._volumes[key] = modes.log_volume(factor_by)
        return self._volumes[key]

    def level(self, point: Point, noise_factor: float, included: Sequence[str]) -> Level:
        """The base hypothesis at one λ: nominal numbers, and the included causes free."""
        ref = self.reference
        by = np.concatenate(([1.0], ref.columns.unit))
        modes, factor_by = self.modes(point, noise_factor)
        total = modes.total(self.weight, factor_by) * np.outer(by, by)
        volume = self.volume(noise_factor)
        return self.solve(
            total, volume, noise_factor, point, included, ref.information, ref.pull
        )  # fmt: skip

    def solve(
        self,
        total: np.ndarray,
        logdet: float,
        noise_factor: float,
        point: Point,
        included: Sequence[str],
        information: np.ndarray,
        pull: np.ndarray,
    ) -> Level:
        """The base hypothesis of a trial's products `total` [1 + C, 1 + C] in units; `information`
        [P, P] and `pull` [P] of the first P numbers are nominal; the included ones are added. The
        reference gives the weight of the trial's likelihood."""
        columns = self.reference.columns
        total, logdet = self.reference.counts * total, self.reference.counts * logdet
        extra = np.concatenate([columns.of[name] for name in included] or [np.zeros(0, int)])
        chosen = np.concatenate((np.arange(len(total) - 1), extra)).astype(int)
        gram = np.block(
            [[total[:1, :1], total[:1, 1 + chosen]],
             [total[1 + chosen][:, :1], total[np.ix_(1 + chosen, 1 + chosen)]]]
        )  # fmt: skip
        count, more = len(pull), len(extra)
        known = np.zeros((count + more, count + more))
        known[:count, :count] = information
        known[count:, count:] = np.diag(
            np.concatenate(
                [
                    np.full(len(columns.of[n]), HELD_INFORMATION if n in self.fixed else 1.0)
                    for n in included
                ]
                or [np.zeros(0)]
            )
        )
        # the included numbers are counted from where they were linearised
        stood = [point.numbers.get(n, np.zeros(len(columns.of[n]))) for n in included]
        units = [columns.unit[columns.of[n]] for n in included]
        before = np.concatenate(
            [
                np.zeros(len(u)) if n in self.fixed else -s / u
                for n, s, u in zip(included, stood, units, strict=True)
            ]
            or [np.zeros(0)]
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
        return Level(noise_factor, gram, logdet, inverse, solution, value)

    def quietest(self, point: Point, included: Sequence[str] = ()) -> float:
        """λ at which the base hypothesis is best, alone."""
        levels = self.levels(point, included)
        return max(levels, key=lambda level: level.value).noise_factor

    def levels(
        self, point: Point, included: Sequence[str] = (), near: float | None = None
    ) -> list[Level]:
        """From the nominal process noise upwards, until it is too much; below it, if that is
        better; and finely about the best, since thousands of knots make λ sharp. `near`: about
        there only."""
        found: list[Level] = []
        if near is not None:
            found.append(self.level(point, near, included))
        else:
            for noise_factor in NOISE_FACTORS:
                found.append(self.level(point, noise_factor, included))
                if len(found) > 1 and found[-1].value < found[-2].value:
                    break
            for quieter in QUIETER if len(found) == 2 else ():
                found.append(self.level(point, quieter, included))
                if found[-1].value < max(level.value for level in found[:-1]):
                    break
        best = max(found, key=lambda level: level.value)
        sides = [self.level(point, best.noise_factor * by, included) for by in (1.0 / FINER, FINER)]
        found += sides
        below, here, above = sides[0].value, best.value, sides[1].value
        bend = below - 2.0 * here + above
        if bend < 0.0:  # the top of the parabola through them
            off = np.clip(0.5 * (below - above) / bend, -2.0, 2.0)
            found.append(self.level(point, best.noise_factor * FINER**off, included))
        return found

    def scan(
        self,
        point: Point,
        candidates: Sequence[Cause],
        included: Sequence[str] = (),
        near: float | None = None,
    ) -> tuple[Found, list[Found]]:
        """The base hypothesis, and each candidate in addition to it, each at its own best λ."""
        levels = self.levels(point, included, near)
        best = max(levels, key=lambda level: level.value)
        found = []  # a cause that explains makes the process noise fall: each λ is tried
        for cause in candidates:
            tried = [self._with(level, cause.label) for level in levels]
            found.append(max(tried, key=lambda f: f.evidence))
        base = Found(
            "nothing", 0.0, best.noise_factor,
            *self.numbers_of(best, point, included),
        )  # fmt: skip
        moved = [replace(f, evidence=f.evidence - best.value) for f in found]
        return replace(base, evidence=best.value), sorted(moved, key=lambda f: -f.evidence)

    def fit(self, point: Point, included: Sequence[str], noise_factor: float) -> Found:
        """The base hypothesis at one level of process noise."""
        level = self.level(point, noise_factor, included)
        return Found("nothing", level.value, noise_factor, *self.numbers_of(level, point, included))

    def _with(self, level: Level, label: str) -> Found:
        """One cause more, its change from the nominal with a prior of its size."""
        columns = self.reference.columns.of[label]
        joined = level.gram[1:, 1:][:, columns]
        pull = level.gram[1:, 0][columns] - joined.T @ level.solution
        own = joined[columns] - joined.T @ level.inverse @ joined + np.eye(len(columns))
        value = np.linalg.solve(own, pull)
        cost = 0.5 * float(np.linalg.slogdet(own)[1])
        gained = 0.5 * float(pull @ value) - cost
        unit = self.reference.columns.unit[columns]
        left = np.linalg.inv(own)
        information = own - np.eye(len(columns))
        shrunk = information @ left
        told = Told(np.diagonal(shrunk @ information).copy(), cost - 0.5 * float(np.trace(shrunk)))
        return Found(
            label, level.value + gained, level.noise_factor, {label: value * unit},
            left * np.outer(unit, unit), told,
        )  # fmt: skip

    def numbers_of(
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

    def without(
        self, point: Point, included: Sequence[str], noise_factor: float, left_out: np.ndarray
    ) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Numbers of the included causes, and the coefficients [P] together with them, from the
        other segments alone; `left_out` [S] bool."""
        kept = self.weight
        self.weight = np.where(left_out, 0.0, kept)
        try:
            level = self.level(point, noise_factor, included)
        finally:
            self.weight = kept
        return self.numbers_of(level, point, included)[0], self._coefficients(level)

    def coefficients(self, point: Point, base: Found) -> np.ndarray:
        """[P] of the base, together with a hypothesis of that point; of a network its bends [F,
        3]."""
        return self._coefficients(self.level(point, base.noise_factor, tuple(base.numbers)))

    def _coefficients(self, level: Level) -> np.ndarray:
        ref, count = self.reference, self.reference.columns.base
        if ref.model.bends:
            assert ref.misfit is not None
            columns = ref.columns
            return ref.misfit.bends(level.solution[columns.linearised : len(columns.unit)])
        return ref.theta + level.solution[:count] * ref.columns.unit[:count]

    def solved(self, point: Point, base: Found) -> np.ndarray:
        """[C] numbers about the point under a hypothesis of that point: nominal coefficients on
        these voyages, and the change by its causes."""
        ref = self.reference
        level = self.level(point, base.noise_factor, tuple(base.numbers))
        d = level.solution[: len(ref.columns.unit)] * ref.columns.unit
        for name, values in base.numbers.items():
            d[ref.columns.of[name]] += values - point.numbers.get(name, 0.0)
        return d

    def leave_out(self, segments_out: np.ndarray) -> None:
        """Segments [S] bool that no hypothesis is judged on."""
        self.weight = np.where(segments_out, 0.0, self.weight)
