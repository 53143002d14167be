"""A trial: the segments of the voyages in question, linearised where a hypothesis stands.

A hypothesis is a set of causes and one kind of remainder. Its columns join those of the campaign: a
cause's numbers as a change from nominal, or a family of the discrepancy as a change of its weights.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Self

import numpy as np

from shiplog.diagnosis.linear import linearisation, segment_nodes, segments
from shiplog.diagnosis.linear.linear_segments import Linear, Path, acting
from shiplog.diagnosis.linear.measurement_correction import as_hypothesised, read
from shiplog.diagnosis.linear.segments import SegmentGrid
from shiplog.diagnosis.noise import discrepancy, part_of_noise, raised_noise, residual_acceleration
from shiplog.diagnosis.noise.campaign_parts import PART, parts_of, squares
from shiplog.diagnosis.noise.discrepancy import Discrepancy
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.noise.raised_noise import Residual, Residuals
from shiplog.diagnosis.noise.remainder import LEAST_SPREAD, Remainder
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.nominal.nominal_reference import Reference
from shiplog.diagnosis.trial.cache import Cache, Numbers, Read
from shiplog.diagnosis.trial.fitted import Point
from shiplog.diagnosis.trial.trial_products import Products
from shiplog.models.causes import Cause
from shiplog.voyages.rows.recording import Record


@dataclass(frozen=True)
class Trial:
    """Voyages in question, against a campaign.

    fixed     labels of causes that the model has already, with numbers that stay
    excluded  labels of causes that no hypothesis has
    parts     rows of the segments [S] of each part; voyage of each part
    unseen    families that no model of forces has, over the trial
    weight    [S] for how much a segment counts; nothing, where the model diverges on it
    first     where it was linearised first; None before that
    begun     whether it is known where the model itself diverges
    as_nominal  whether the model simulates it as well as the nominal voyages: then no dependence
              that the model lacks has changed
    cache     readings, products and starts, which its copies with other weights share
    """

    campaign: Campaign
    record: Record
    fixed: tuple[str, ...]
    grid: SegmentGrid
    rows: np.ndarray
    parts: tuple[np.ndarray, ...]
    voyage: np.ndarray
    omitted: Discrepancy
    weight: np.ndarray
    cache: Cache
    first: Point | None = None
    begun: bool = False
    as_nominal: bool = False
    excluded: tuple[str, ...] = ()

    @classmethod
    def build(
        cls, campaign: Campaign, record: Record, fixed: Sequence[str] = (),
        cache: Cache | None = None, **more: object,
    ) -> Self:  # fmt: skip
        """All segments of a record with weight 1; `cache` is a new one where none is handed in."""
        grid, rows = segments.grid(record), segments.begins(record)
        reference = campaign.reference
        nodes = segment_nodes.conditions_at_nodes(segments.cut(record, rows), grid)
        known = len(reference.columns.unit)
        unseen = discrepancy.build(
            record.profile, reference.process_noise.acceleration, known, discrepancy.OMITTED, nodes
        )
        # as long as those from which the campaign knows how far parts differ
        longest = max((len(part) for part in campaign.rows), default=PART)
        parts = tuple(parts_of(record.voyage[rows], longest, fewest=1))
        voyage = record.voyage[rows[[part[0] for part in parts]]]
        weight = np.ones(len(rows))
        return cls(campaign, record, tuple(fixed), grid, rows, parts, voyage, unseen, weight,
                   cache or Cache(), **more)  # type: ignore[arg-type]  # fmt: skip

    @property
    def reference(self) -> Reference:
        return self.campaign.reference

    @property
    def products(self) -> Products:
        """Products of its segments, at any point of it."""
        return Products(
            self.campaign, self.omitted, self.grid, self.parts, self.voyage, self.cache
        )  # fmt: skip

    @cached_property
    def families(self) -> dict[str, np.ndarray]:
        """Family of the discrepancy → its columns, of those that may have changed."""
        if self.as_nominal:
            return {}
        both = (*self.campaign.discrepancy.families, *self.omitted.families)
        return {family.name: family.columns for family in both}

    @property
    def nominal_spread(self) -> float:
        """Standard deviation of the logarithm of the process noise from campaign to campaign."""
        return max(self.campaign.noise, LEAST_SPREAD)

    def bounds(self, label: str) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest numbers [Q] of a cause, SI."""
        return self._cause(label).bounds(self.reference.setting)

    def farthest(self, label: str) -> float:
        """As `Cause.farthest` of this ship."""
        return self._cause(label).farthest(self.reference.setting)

    def clipped(self, numbers: Numbers) -> Numbers:
        """These numbers, each moment clipped to the largest that its force or mass can make."""
        found = dict(numbers)
        for label, values in numbers.items():
            farthest = self.farthest(label)
            if math.isfinite(farthest):
                most = farthest * abs(values[0])
                found[label] = np.append(values[:1], np.clip(values[1:], -most, most))
        return found

    def _cause(self, label: str) -> Cause:
        (cause,) = (c for c in self.reference.model.causes if c.label == label)
        return cause

    def process_noise(self, remainder: Remainder, cut: segments.Cut | None = None) -> ProcessNoise:
        """The nominal one; with an intermittent force in it, where one remains. Of the trial's own
        segments, or of others."""
        rows = segment_nodes.rows_of_nodes(self.rows if cut is None else cut.rows, self.grid)
        return remainder.apply_to(self.reference.process_noise, rows)

    def linearise(
        self,
        numbers: Numbers,
        near: Path | Point | None = None,
        noise_factor: float | None = None,
        remainder: Remainder | None = None,
    ) -> Point:
        """The trial linearised with these numbers (1), about a path fitted to the measurement.

        near          a path to start from, or a point whose linearisation predicts the path: where
                      what it predicts is far off, the path is fitted from there
        noise_factor  λ that limits the path. A path that follows every wave of the noise is as far
                      from the likely one as a free rollout; its nonlinearity imitates evidence
        remainder     whose process noise and intermittent force the path may follow

        Raises np.linalg.LinAlgError where the model diverges with these numbers only: this
        hypothesis then fails.
        """
        ref = self.reference
        wide = ref.wide
        if noise_factor is not None:
            wide = ref.allowed_distance(noise_factor, remainder or Remainder())
        cut, _, _ = self.reading(numbers)
        whole = np.concatenate((ref.theta, ref.columns.numbers(dict(numbers))))
        about = ref.expected_acceleration(cut, self.grid)
        if isinstance(near, Point):
            stood = np.concatenate((ref.theta, ref.columns.numbers(dict(near.numbers))))
            path = linearisation.predict_path(near.linear, whole - stood, wide, about)
            found = Point(numbers, path, self.linear_at(numbers, path))
            if linearisation.left_to_pull(found.linear, wide, about) < linearisation.FAR_NATS:
                return self._refuse_divergent(found)
            near, rounds = path, linearisation.MOST_PULLS
        else:
            rounds = 1 if near else linearisation.MOST_PULLS
        path = linearisation.fit_path(ref.model, whole, cut, self.grid, wide, near, rounds, about)
        return self.linearise_about(numbers, path)

    def linearise_about(self, numbers: Numbers, path: Path) -> Point:
        """The trial linearised with these numbers about this very path. Raises as `linearise`."""
        return self._refuse_divergent(Point(numbers, path, self.linear_at(numbers, path)))

    def linear_at(self, numbers: Numbers, path: Path) -> Linear:
        """The same, wherever the model diverges."""
        ref = self.reference
        cut, moved, observed = self.reading(numbers)
        whole = np.concatenate((ref.theta, ref.columns.numbers(dict(numbers))))
        return linearisation.linear(
            ref.model, whole, cut, self.grid, path, moved, observed, ref.wide
        )

    def squares(self, point: Point, d: np.ndarray, process_noise: ProcessNoise) -> np.ndarray:
        """χ²_s = rᵀ C_s⁻¹ r [S] of what is left, r = e - W w - J d, of numbers and weights d."""
        left, d = self.less_misfit(point.linear, d)
        left = replace(left, e=left.e - left.j @ d)
        return squares(left, self.reference.process_noise, process_noise)

    def noise_left(self, point: Point, d: np.ndarray) -> Residual | Residuals:
        """r = e - W w - J d, of numbers and weights d, to be explained by noise."""
        left, d = self.less_misfit(point.linear, d)
        ref, of = self.reference, self.record.voyage[self.rows]
        blocks = []
        for voyages in self.products.blocks:
            own = np.isin(of, voyages)
            one = left if own.all() else left.pick(own)
            blocks.append(
                raised_noise.residual(one, d, ref.process_noise, self.weight[own], ref.counts)
            )
        return raised_noise.in_blocks(blocks)

    def force_across(
        self, point: Point, d: np.ndarray, noise: float, remainder: Remainder
    ) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variance [S, J] of an intermittent force in e - W w - J d, with the process
        noise of a remainder times λ = `noise`: `part_of_noise.across_at_nodes`."""
        left, d = self.less_misfit(point.linear, d)
        return part_of_noise.across_at_nodes(left, d, self.process_noise(remainder).times(noise))

    def reading(self, numbers: Numbers) -> Read:
        """The segments as read with these numbers, and the effects of all of them on the inputs
        and size of the discrepancy.

        The effect of a sensor's cause depends on the corrections before it. With a clock that is
        one second late, the antenna's columns are one second late too, and two clocks would seem to
        disagree. Columns at nearby numbers are no substitute. Those of several clocks differ by
        noise, and a sum of them would fit the noise of the data.
        """
        ref, causes = self.reference, self.reference.model.causes
        reading = {
            c.label: np.asarray(numbers[c.label]) for c in causes if c.reads and c.label in numbers
        }
        alike = (
            kept for before, kept in self.cache.readings
            if before.keys() == reading.keys() and ref.distance(before, reading) == 0.0
        )  # fmt: skip
        kept = next(alike, None)
        if kept is None:
            kept = read(
                ref.model, ref.setting, self.record, self.rows, dict(reading), self.cache.acted
            )
            self.cache.readings = [*self.cache.readings[:1], (reading, kept)]
        cut, moved, observed = kept
        return as_hypothesised(cut, causes, numbers), moved, observed

    def _refuse_divergent(self, point: Point) -> Point:
        if self.begun and (point.linear.lost & (self.weight > 0.0)).any():
            raise np.linalg.LinAlgError("the model diverges with these numbers")
        return point

    def covering(self, point: Point) -> Linear:
        """The point's segments and those between them: residuals of the same accuracy
        everywhere."""
        ref = self.reference
        rows = np.setdiff1d(residual_acceleration.covering(self.record), self.rows)
        if not len(rows):  # every stretch is one segment long, to the row
            return point.linear
        numbers = dict(point.numbers)
        cut, moved, observed = read(ref.model, ref.setting, self.record, rows, numbers)
        whole = np.concatenate((ref.theta, ref.columns.numbers(numbers)))
        path = linearisation.fit_path(
            ref.model,
            whole,
            cut,
            self.grid,
            ref.wide,
            about=ref.expected_acceleration(cut, self.grid),
        )
        between = linearisation.linear(
            ref.model, whole, cut, self.grid, path, moved, observed, ref.wide
        )
        return point.linear.joined(between)

    def less_misfit(self, linear: Linear, d: np.ndarray) -> tuple[Linear, np.ndarray]:
        """A pass of the trial without W w, the effect of the misfit's weights w among the numbers
        d [C], and the numbers of its own columns."""
        misfit, count = self.reference.misfit, self.reference.columns.linearised
        if misfit is not None:
            by_weight = partial(misfit.accelerations, g=self.grid)
            linear = linear.less(acting(by_weight, linear.cut, d[count:]))
        return linear, d[:count]

    def leave_out(self, segments_out: np.ndarray) -> Self:
        """The same with segments [S] bool that no hypothesis is judged on."""
        return replace(self, weight=np.where(segments_out, 0.0, self.weight))
