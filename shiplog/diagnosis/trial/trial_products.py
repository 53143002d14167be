"""Products of a trial's segments with every voyage's and part's own deviations integrated out:
equations (3) to (5) of this room.

One pass of a point serves every process noise and many hypotheses: it is kept in the trial's cache,
with totals and volumes. Products are made part by part and added voyage by voyage.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from weakref import ref

import numpy as np

from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.diagnosis.noise import discrepancy, part_products
from shiplog.diagnosis.noise.discrepancy import Discrepancy
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.noise.part_products import Gram, PartPass
from shiplog.diagnosis.noise.remainder import NOMINAL, Remainder
from shiplog.diagnosis.nominal import campaign_prior
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.trial.cache import Cache, Total
from shiplog.diagnosis.trial.fitted import Point

KEPT_PASSES = 2  # of the first point and the last one, 0.2 MB a segment each
KEPT_TOTALS = 24  # 0.7 MB each; one point needs about a dozen levels, and again with each family


@dataclass(frozen=True)
class Products:
    """Products of a trial at its points.

    unseen  families that no model of forces has, over the trial
    parts   rows of the segments of each part; voyage of each part
    cache   where they are kept
    """

    campaign: Campaign
    omitted: Discrepancy
    grid: SegmentGrid
    parts: Sequence[np.ndarray]
    voyage: np.ndarray
    cache: Cache

    def _passes(self, point: Point, weight: np.ndarray) -> Sequence[PartPass]:
        """The point's parts without their starts, with the columns of every family."""
        key = weight.tobytes()
        kept = [one for one in self.cache.passes if one[0]() is not None]
        found = next((one for one in kept if one[0]() is point.path and one[1] == key), None)
        if found is None:
            self.cache.passes = kept = kept[1 - KEPT_PASSES :]  # before another one is made
            reference = self.campaign.reference
            unit = np.append(reference.columns.unit, np.ones(self.omitted.count))
            passes = part_products.passes(
                point.linear, reference.process_noise, self.parts, unit, weight, self._accelerations
            )
            found = ref(point.path), key, tuple(passes)
        # the one that was asked for last is the last: the first point's stays, as each level has it
        self.cache.passes = [*(one for one in kept if one is not found), found]
        return found[2]

    def _accelerations(self, cut: Cut) -> np.ndarray:
        """Φ of the discrepancy: a weight w acts as an acceleration Φ w."""
        misfit = self.campaign.reference.misfit
        of = [] if misfit is None else [misfit.accelerations(cut, self.grid)]
        return np.concatenate([*of, self.omitted.accelerations(cut, self.grid)], -1)

    def process_noise(self, cut: Cut, noise: float, remainder: Remainder) -> ProcessNoise:
        """That of a trial's segments together with a remainder, times λ = `noise`."""
        rows = segment_nodes.rows_of_nodes(cut.rows, self.grid)
        return remainder.apply_to(self.campaign.reference.process_noise, rows).times(noise)

    def each_part(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> Iterator[Gram]:
        """G_k [1 + C, 1 + C] of each part (3), its own deviations in it. C are the columns of the
        reference; those of the families that no campaign shows are there where the remainder is
        one of them, since they are a quarter of all."""
        of = self.process_noise(point.linear.cut, noise, remainder)
        prior, size = of.inverse_kernels(self.grid.nodes), 1 + len(self._deviation(remainder))
        for one in self._passes(point, weight):
            yield one.gram(prior, size)

    def total(self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder) -> Total:
        """G [1 + C, 1 + C] of all parts (4), C as in `each_part`, and log|R| (5)."""
        key = (noise, weight.tobytes(), remainder.shape)
        size = 1 + len(self._deviation(remainder))
        if kept := self._kept(point, key, size):
            return kept
        found = self._added(point, noise, weight, remainder)
        self.cache.totals = [*self.cache.totals[1 - KEPT_TOTALS :], (ref(point.path), key, found)]
        return found

    def _kept(self, point: Point, key: tuple, size: int) -> Total | None:
        """A total that was worked out before, of as many columns or more."""
        for of, known, kept in self.cache.totals:
            if of() is point.path and known == key and len(kept.G) >= size:
                return kept if len(kept.G) == size else Total(kept.G[:size, :size], kept.volume)
        return None

    def _added(self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder) -> Total:
        """As `total`, added voyage by voyage."""
        whole = np.zeros((1 + len(self._deviation(remainder)),) * 2)
        logdet = sum(one.logdet for one in self._passes(point, weight))
        for _, one in self._voyages(point, noise, weight, remainder):
            whole += one.G
            logdet += one.volume
        return Total(whole, logdet)

    def leave_out(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder,
        left_out: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """G as `total`, of the segments that are not `left_out` [S]. Those of the other voyages are
        kept: one voyage after the other is left out."""
        gone = {
            of for of, rows in zip(self.voyage, self.parts, strict=True) if left_out[rows].any()
        }
        whole = all(
            left_out[rows].all()
            for of, rows in zip(self.voyage, self.parts, strict=True)
            if of in gone
        )
        if not whole or len(gone) == len(set(self.voyage)):
            return self.total(point, noise, np.where(left_out, 0.0, weight), remainder).G
        key = (noise, weight.tobytes(), remainder)
        kept = self.cache.voyages
        if kept is None or kept[0]() is not point.path or kept[1] != key:
            every = self._voyages(point, noise, weight, remainder)
            voyages = {of: one.G for of, one in every}
            self.cache.voyages = kept = (ref(point.path), key, voyages)
        return _sum([G for of, G in kept[2].items() if of not in gone])

    def _voyages(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> Iterator[tuple[object, Gram]]:
        """G of each voyage with b_k and c_v integrated out (4), and its share of log|R| (5) but for
        instruments and starts."""
        each = self.each_part(point, noise, weight, remainder)
        deviation = self._deviation(remainder)
        return campaign_prior.each_voyage(
            each, self.voyage, self.campaign.apart * deviation, deviation
        )

    def _deviation(self, remainder: Remainder) -> np.ndarray:
        """The diagonal of D^½ [C]; of the families that no campaign shows there is none."""
        of = self.campaign.effects.deviation
        more = self.omitted.count if remainder.kind in discrepancy.OMITTED else 0
        return np.append(of, np.zeros(more))

    def volume(
        self, first: Point, noise_factor: float, weight: np.ndarray, remainder: Remainder
    ) -> float:
        """log|R| (5) at one λ: that of the first point, for every hypothesis. Otherwise a model
        with less damping would gain evidence because it amplifies the noise."""
        key = (noise_factor, weight.tobytes(), remainder.shape)
        if key not in self.cache.volumes:
            alike = replace(remainder, kind=NOMINAL)  # a family has no deviation of its own
            made = self._kept(first, key, 0) or self._added(first, noise_factor, weight, alike)
            self.cache.volumes[key] = made.volume
        return self.cache.volumes[key]


def _sum(each: Iterable[np.ndarray]) -> np.ndarray:
    first, *others = each
    return sum(others, first)
