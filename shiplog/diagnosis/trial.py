"""A trial: its segments, and the log evidence of every hypothesis about them.

A hypothesis is a set of causes and one kind of remainder. Its columns join those of the campaign: a
cause's numbers as a change from nominal, or a family of the discrepancy as a change of its weights.
Every voyage of the trial and every part of it has deviations of its own (`voyage_effects`,
`campaign_prior`), which are integrated out.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from shiplog.diagnosis import (
    campaign_prior,
    discrepancy,
    evidence,
    intermittent,
    segment_nodes,
    segments,
    unrecorded_thruster,
)
from shiplog.diagnosis.campaign_parts import parts_of, products, robust_weights, squares
from shiplog.diagnosis.fitted import Found, Level, Point
from shiplog.diagnosis.likelihood import Modes, Weighed
from shiplog.diagnosis.linear_segments import Linear
from shiplog.diagnosis.nominal_campaign import Campaign
from shiplog.diagnosis.parameter_layout import HELD_INFORMATION
from shiplog.diagnosis.voyage_effects import reduced
from shiplog.voyages.recording import Record

NOMINAL, RAISED, INTERMITTENT = "nominal", "raised", "intermittent"
NOISES = (0.5, 0.7, 0.85, 1.0, 1.2, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 16.0)  # times the nominal
FINER = 1.08  # step about the best of them
SIZES = (1.0, 3.0, 9.0)  # of a change of a family's weights, in units of the process noise
LEAST_SPREAD = 0.05  # of the logarithm of the process noise: two campaigns are never alike
RAISED_SPREAD = 1.0  # the same where the process noise is raised: by e, either way


@dataclass(frozen=True)
class Remainder:
    """What remains together with the causes: a kind, the size of a family's change, and whether
    process noise is raised together with that change."""

    kind: str = NOMINAL
    size: float = 1.0
    noisy: bool = False

    @property
    def raises(self) -> bool:
        """Whether the process noise is expected to be raised."""
        return self.noisy or self.kind in (RAISED, INTERMITTENT)


class Trial(evidence.TrialEvidence):
    """Voyages in question, against a campaign."""

    def __init__(self, campaign: Campaign, record: Record, fixed: Sequence[str] = ()) -> None:
        super().__init__(campaign.reference, record, fixed)
        self.campaign = campaign
        knots = segment_nodes.at_knots(segments.cut(record, self.rows), self.grid)
        known = len(campaign.reference.columns.unit)
        self.unseen = discrepancy.of(
            record.profile, campaign.reference.process_noise.push, known, discrepancy.UNSEEN, knots
        )
        both = (*campaign.discrepancy.families, *self.unseen.families)
        self.families = {family.name: family.columns for family in both}
        self.parts = parts_of(record.voyage[self.rows])
        self.voyage = record.voyage[self.rows[[part[0] for part in self.parts]]]  # of each part
        self.remainder = Remainder()  # that `scan` includes
        self.lost = np.zeros(len(self.rows), dtype=bool)  # segments on which the model diverges
        self.begun = False
        self._totals: list[tuple[weakref.ref[Weighed], tuple, np.ndarray, float]] = []

    @property
    def pulse(self) -> bytes:
        """Tells one remainder of this trial from another."""
        return super().pulse + f"{self.remainder}".encode()

    # --- linearisation ---

    def at(self, numbers, near=None, noise_factor=None) -> Point:
        """Segments on which the model diverges carry no information. Where only a hypothesis makes
        it diverge it is that hypothesis that fails: raises np.linalg.LinAlgError."""
        point = super().at(numbers, near, noise_factor)
        lost = point.linear.lost
        if lost is not None and (lost & (self.weight > 0.0)).any():
            if point is not self.first and self.begun:
                raise np.linalg.LinAlgError("the model diverges with these numbers")
            self.weight = np.where(lost, 0.0, self.weight)
            self.lost = lost
        return point

    def begin(self, numbers: Mapping[str, np.ndarray]) -> Point:
        point = super().begin(numbers)
        self.begun = True
        return point

    def robust(self, point: Point) -> None:
        """Weights of the segments, the same for every hypothesis: a few must not decide."""
        level = max(self.levels(point), key=lambda level: level.value)
        none = np.zeros(self.unseen.count)
        unit = np.append(self.reference.columns.unit, none)
        d = np.append(level.solution[: len(self.reference.pull)], none)
        modes, noise = self.modes(point, level.noise_factor)
        self.weight = robust_weights(squares(modes, d * unit, noise), self.weight > 0.0)

    # --- products ---

    def _misfitting(self, modes: Modes, point: Point) -> Modes:
        cut, misfit = point.linear.cut, self.reference.misfit
        if misfit is not None:
            modes = modes.beside(misfit.pushed(cut, self.grid))
        return modes.beside(self.unseen.pushed(cut, self.grid))

    def total(self, point: Point, noise: float) -> tuple[np.ndarray, float]:
        """Products [1 + C, 1 + C] of all parts, and log|I + D^½ M D^½| of them."""
        key = (noise, self.weight.tobytes(), super().pulse)
        for of, known, total, volume in self._totals:
            if of() is point.weighed and known == key:
                return total, volume
        modes, noise = self.modes(point, noise)
        unit = np.append(self.reference.columns.unit, np.ones(self.unseen.count))
        deviation = np.append(self.campaign.effects.deviation, np.zeros(self.unseen.count))
        each = products(modes, self.parts, unit, self.weight, noise)
        parts, volumes = zip(*(reduced(gram, deviation) for gram in each), strict=True)
        apart = self.campaign.apart * deviation
        voyages, more = campaign_prior.of_voyages(parts, self.voyage, apart)
        total, volume = sum(voyages[1:], voyages[0]), sum(volumes) + sum(more)
        # no id(): a point that is gone leaves its own to the next one
        self._totals = [*self._totals[-40:], (weakref.ref(point.weighed), key, total, volume)]
        return total, volume

    def volume(self, noise_factor: float) -> float:
        """log |C| at one level of process noise, the same for every hypothesis: that of the first
        point. How far a model lets noise be felt is no evidence of a cause."""
        assert self.first is not None
        key = (noise_factor, super().pulse + self.weight.tobytes())
        if key not in self._volumes:
            modes, by = self.modes(self.first, noise_factor)
            self._volumes[key] = modes.log_volume(by) + self.total(self.first, noise_factor)[1]
        return self._volumes[key]

    def level(self, point: Point, noise_factor: float, included: Sequence[str]) -> Level:
        total, _ = self.total(point, noise_factor)
        ref = self.reference
        level = self.solve(
            total,
            self.volume(noise_factor),
            noise_factor,
            point,
            included,
            ref.information,
            ref.pull,
        )
        return replace(level, value=level.value + self.expected(noise_factor, self.remainder))

    @property
    def usual_spread(self) -> float:
        """Standard deviation of the logarithm of the process noise from campaign to campaign."""
        return max(self.campaign.noise, LEAST_SPREAD)

    def expected(self, noise: float, beside: Remainder) -> float:
        """Log prior density of a level of process noise together with a remainder, less the
        greatest one together with `nominal`."""
        usual = self.usual_spread
        spread = RAISED_SPREAD if beside.raises else usual
        return -0.5 * (math.log(noise) / spread) ** 2 - math.log(spread / usual)

    def solve(self, total, logdet, noise_factor, point, included, information, pull) -> Level:
        """The base hypothesis of a trial's products [1 + C, 1 + C]: nominal numbers, the included
        causes, and the remainder's change of weights."""
        columns, share = self.reference.columns, self.reference.counts
        total, logdet = share * total, share * logdet
        extra = [columns.of[name] for name in included]
        family = self.families.get(self.remainder.kind, np.zeros(0, int))
        held = [np.full(len(c), HELD_INFORMATION if n in self.fixed else 1.0)
                for n, c in zip(included, extra, strict=True)]  # fmt: skip
        held.append(np.full(len(family), self.remainder.size**-2.0))
        count = len(pull)
        chosen = np.concatenate((np.arange(count), *extra, family)).astype(int)
        gram = total[np.ix_(np.append(0, 1 + chosen), np.append(0, 1 + chosen))]
        more = len(chosen) - count
        known = np.zeros((count + more, count + more))
        known[:count, :count] = information
        known[count:, count:] = np.diag(np.concatenate(held))
        # the included numbers are counted from where they were linearised
        before = [
            np.zeros(len(c)) if n in self.fixed
            else -np.asarray(point.numbers.get(n, np.zeros(len(c)))) / columns.unit[c]
            for n, c in zip(included, extra, strict=True)
        ]  # fmt: skip
        towards = np.concatenate((pull, *(k * b for k, b in zip(held, before, strict=False)),
                                  np.zeros(len(family))))  # fmt: skip
        both = gram[1:, 1:] + known
        inverse = np.linalg.inv(both)
        solution = inverse @ (gram[1:, 0] + towards)
        square = gram[0, 0] + self._square_of_prior(towards, count, held, information)
        square -= (gram[1:, 0] + towards) @ solution
        volume = np.linalg.slogdet(both)[1] - self._volume_of_prior(held, information)
        value = -0.5 * float(square + volume + logdet)
        return Level(noise_factor, gram, logdet, inverse, solution, value)

    def _square_of_prior(self, towards, count, held, information) -> float:
        own = np.concatenate([*held, np.zeros(0)])
        mean = self.reference.mean
        return float(towards[:count] @ mean + (towards[count:] ** 2 / own).sum())

    def _volume_of_prior(self, held, information) -> float:
        if not hasattr(self, "_information_volume"):
            self._information_volume = np.linalg.slogdet(information)[1]
        return self._information_volume + float(np.log(np.concatenate([*held, np.ones(0)])).sum())

    def levels(self, point, included=(), near=None) -> list[Level]:
        """From the nominal process noise outwards while it gets likelier; finely about the best."""
        tried: dict[float, Level] = {}

        def at(noise: float) -> float:
            if noise not in tried:
                tried[noise] = self.level(point, noise, included)
            return tried[noise].value

        if near is None:
            middle = NOISES.index(1.0)
            best = middle
            for way in (1, -1):
                i = middle
                while 0 <= i + way < len(NOISES) and at(NOISES[i + way]) > at(NOISES[i]):
                    i += way
                if at(NOISES[i]) > at(NOISES[best]):
                    best = i
                if best != middle:
                    break
            here = NOISES[best]
        else:
            here = near
        below, middle_value, above = at(here / FINER), at(here), at(here * FINER)
        bend = below - 2.0 * middle_value + above
        top = float(np.clip(0.5 * (below - above) / bend, -3.0, 3.0)) if bend < 0.0 else 0.0
        if abs(top) > 1.0:  # of the parabola through them, and beyond them
            at(here * FINER**top)
        return list(tried.values())

    def numbers_of(self, level, point, included):
        """Numbers and covariance of the included causes; a family's weights come after them."""
        found: dict[str, np.ndarray] = {}
        columns = self.reference.columns
        at = first = len(self.reference.pull)
        units = []
        for name in included:
            unit = columns.unit[columns.of[name]]
            stood = point.numbers.get(name, np.zeros(len(unit)))
            found[name] = stood + level.solution[at : at + len(unit)] * unit
            units.append(unit)
            at += len(unit)
        whole = np.concatenate(units or [np.zeros(0)])
        return found, level.inverse[first:at, first:at] * np.outer(whole, whole)

    def without(self, point, included, noise_factor, left_out):
        """Numbers of the included causes and coefficients [P], from the other segments alone."""
        kept, ref = self.weight, self.reference
        self.weight = np.where(left_out, 0.0, kept)
        try:
            total, _ = self.total(point, noise_factor)
        finally:
            self.weight = kept
        level = self.solve(total, 0.0, noise_factor, point, included, ref.information, ref.pull)
        return self.numbers_of(level, point, included)[0], self._coefficients(level)

    def of_parts(self, linear: Linear, point: Point, base: Found) -> Linear:
        """A pass of this trial without what each part's own deviations do, under a hypothesis of
        that point. The pass may have other segments of the record than the trial's."""
        columns = self.reference.columns
        unit = np.append(columns.unit, np.ones(self.unseen.count))
        common = self.solved(point, base) / columns.unit
        modes, noise = self.modes(point, base.noise_factor)
        deviation = math.hypot(1.0, self.campaign.apart) * self.campaign.effects.deviation
        free = np.flatnonzero(deviation > 0.0)
        pushed = np.zeros((len(linear.e), linear.z.shape[-1] - 6, 0))
        if self.reference.misfit is not None:
            pushed = self.reference.misfit.pushed(linear.cut, self.grid)
        begins = self.rows[[rows[0] for rows in self.parts]]
        of = np.searchsorted(begins, linear.cut.rows, side="right") - 1
        numbers = np.zeros((len(linear.e), columns.linearised + pushed.shape[-1]))
        for i, gram in enumerate(products(modes, self.parts, unit, self.weight, noise)):
            own = gram[np.ix_(1 + free, 1 + free)] + np.diag(deviation[free] ** -2.0)
            left = gram[1 + free, 0] - gram[np.ix_(1 + free, 1 + np.arange(len(common)))] @ common
            rows = np.flatnonzero(of == i)
            numbers[np.ix_(rows, free)] = np.linalg.solve(own, left) * columns.unit[free]
        return linear.less_numbers(numbers, pushed)

    # --- remainders ---

    def changed(self, point: Point, level: Level, included: Sequence[str], family: str):
        """Log Bayes factor, in nats, of a change of one family's weights over a level without it,
        at its most probable size; and that size."""
        columns, share = self.families[family], self.reference.counts
        total, _ = self.total(point, level.noise_factor)
        more = [self.reference.columns.of[n] for n in included]
        rows = 1 + np.concatenate([np.arange(len(self.reference.pull)), *more])
        joined = share * total[np.ix_(rows, 1 + columns)]
        pull = share * total[1 + columns, 0] - joined.T @ level.solution
        own = share * total[np.ix_(1 + columns, 1 + columns)] - joined.T @ level.inverse @ joined
        found = []
        for size in SIZES:
            whole = size**2 * own + np.eye(len(own))
            gained = 0.5 * size**2 * float(pull @ np.linalg.solve(whole, pull))
            found.append((gained - 0.5 * float(np.linalg.slogdet(whole)[1]), size))
        return max(found)

    def imitated(self, point: Point, base: Found, label: str, remainder: Remainder) -> float:
        """Share, 0 to 1, of what a cause does to the observations that a change of a family's
        weights does as well, the campaign's own numbers free."""
        family = self.families.get(remainder.kind)
        if family is None:
            return 0.0
        columns, ref = self.reference.columns, self.reference
        of, count = columns.of[label], len(ref.pull)
        total = self.reference.counts * self.total(point, base.noise_factor)[0][1:, 1:]
        both = np.concatenate((of, family)).astype(int)
        joined = total[np.ix_(np.arange(count), both)]
        known = total[:count, :count] + ref.information
        left = total[np.ix_(both, both)] - joined.T @ np.linalg.solve(known, joined)
        does = base.numbers[label] / columns.unit[of]
        own = does @ left[: len(of), : len(of)] @ does
        across = left[len(of) :, : len(of)] @ does
        free = left[len(of) :, len(of) :] + remainder.size**-2.0 * np.eye(len(family))
        return float(across @ np.linalg.solve(free, across) / own) if own > 0.0 else 1.0

    def intermittent(self, point: Point, base: Found) -> unrecorded_thruster.Pulses:
        """An intermittent force at one place along the ship, and its log Bayes factor over raised
        noise, whose nominal part acts at one place too."""
        return unrecorded_thruster.pulses(self, point, base, self.usual_push)

    @cached_property
    def usual_push(self) -> np.ndarray | None:
        """Acceleration [3] that the nominal process noise has at one place."""
        return intermittent.usual_push(self.campaign, self.grid)

    def acts_on(self, point: Point, base: Found, family: str) -> tuple[str, ...]:
        """Channels in which the acceleration of a family exceeds a third of its largest."""
        kept, self.remainder = self.remainder, Remainder(family, SIZES[1])
        try:
            level = self.level(point, base.noise_factor, tuple(base.numbers))
        finally:
            self.remainder = kept
        of = self.unseen if family in discrepancy.UNSEEN else self.campaign.discrepancy
        columns = self.families[family]
        weights = np.zeros(of.count)
        weights[columns - of.families[0].columns[0]] = level.solution[-len(columns) :]
        pushed = of.pushed(point.linear.cut, self.grid) @ weights
        size = pushed.reshape(len(pushed), 3, -1).std((0, 2)) / self.reference.process_noise.push
        names = np.array(["surge", "sway", "yaw_rate"])
        return tuple(str(n) for n in names[size > size.max() / 3.0])
