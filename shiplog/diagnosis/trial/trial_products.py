"""Products of a trial's segments with every voyage's and part's own deviations integrated out:
equations (3) to (5) of this room.

One pass serves every factor λ of the process noise and many hypotheses, so that modes, totals and
volumes are kept in the trial's cache.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from weakref import ref

import numpy as np

from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.linear.segments import SegmentGrid
from shiplog.diagnosis.noise import discrepancy, likelihood
from shiplog.diagnosis.noise.campaign_parts import products
from shiplog.diagnosis.noise.discrepancy import Discrepancy
from shiplog.diagnosis.noise.likelihood import Modes
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.nominal import campaign_prior
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.trial.cache import Cache
from shiplog.diagnosis.trial.fitted import Point

KEPT_MODES = 4  # 20 MB each
KEPT_TOTALS = 41  # one point needs about a dozen levels, and again for each family


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

    def modes(self, point: Point, noise_factor: float, remainder: Remainder) -> tuple[Modes, float]:
        """Modes of the process noise at a point, and the factor λ to divide them by (2). One pass
        serves every λ, but that of an intermittent force together with the process noise, whose
        axes turn with it."""
        rows = segment_nodes.rows_of_nodes(point.linear.cut.rows, self.grid)
        process_noise = remainder.apply_to(self.campaign.reference.process_noise, rows)
        shape, left = remainder.shape, noise_factor
        if process_noise.intermittent is not None:
            process_noise, shape, left = process_noise.times(noise_factor), (shape, left), 1.0
        for of, known, modes in self.cache.modes:
            if of is point.weighed and known == shape:
                return modes, left
        modes = self._join_families(likelihood.modes(point.weighed, process_noise), point)
        first, last = self.cache.modes[:1], self.cache.modes[1:][2 - KEPT_MODES :]
        self.cache.modes = [*first, *last, (point.weighed, shape, modes)]
        return modes, left

    def _join_families(self, modes: Modes, point: Point) -> Modes:
        """With the columns of the discrepancy: a weight w acts as an acceleration W w."""
        cut, misfit = point.linear.cut, self.campaign.reference.misfit
        if misfit is not None:
            modes = modes.joined(misfit.accelerations(cut, self.grid))
        return modes.joined(self.omitted.accelerations(cut, self.grid))

    def each_part(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> list[np.ndarray]:
        """G_k [1 + C, 1 + C] of each part (3), its own deviations in it. C are the columns of the
        reference; those of the families that no campaign shows are there where the remainder is
        one of them, since they are a quarter of all."""
        modes, noise = self.modes(point, noise, remainder)
        unit = self.campaign.reference.columns.unit
        if remainder.kind in discrepancy.OMITTED:
            unit = np.append(unit, np.ones(self.omitted.count))
        return products(modes.first(len(unit)), self.parts, unit, weight, noise)

    def total(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> tuple[np.ndarray, float]:
        """G [1 + C, 1 + C] of all parts (4), C as in `each_part`, and Σ log|I + D^½ M D^½| (5)."""
        key = (noise, weight.tobytes(), remainder.shape)
        size = 1 + len(self._deviation(remainder))
        for of, known, G, volume in self.cache.totals:
            if of() is point.weighed and known == key and len(G) >= size:
                return G if len(G) == size else G[:size, :size], volume
        voyages, volume = self._voyages(point, noise, weight, remainder)
        G = _sum(voyages.values())
        kept = (ref(point.weighed), key, G, volume)
        self.cache.totals = [*self.cache.totals[1 - KEPT_TOTALS :], kept]
        return G, volume

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
            return self.total(point, noise, np.where(left_out, 0.0, weight), remainder)[0]
        key = (noise, weight.tobytes(), remainder)
        kept = self.cache.voyages
        if kept is None or kept[0]() is not point.weighed or kept[1] != key:
            voyages, _ = self._voyages(point, noise, weight, remainder)
            self.cache.voyages = kept = (ref(point.weighed), key, voyages)
        return _sum([G for of, G in kept[2].items() if of not in gone])

    def _voyages(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> tuple[dict[object, np.ndarray], float]:
        """G of each voyage with b_k and c_v integrated out (4), and Σ log|I + D^½ M D^½| (5)."""
        each = self.each_part(point, noise, weight, remainder)
        deviation = self._deviation(remainder)
        G, volumes = campaign_prior.reduce_voyages(
            each, self.voyage, self.campaign.apart * deviation, deviation
        )
        return dict(zip(np.unique(self.voyage), G, strict=True)), sum(volumes)

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
        key = (noise_factor, remainder.shape, weight.tobytes())
        if key not in self.cache.volumes:
            modes, by = self.modes(first, noise_factor, remainder)
            total = self.total(first, noise_factor, weight, remainder)
            self.cache.volumes[key] = modes.log_volume(by, weight) + total[1]
        return self.cache.volumes[key]


def _sum(each: Iterable[np.ndarray]) -> np.ndarray:
    first, *others = each
    return sum(others, first)
