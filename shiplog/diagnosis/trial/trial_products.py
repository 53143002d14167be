"""Products of a trial's segments with every voyage's and part's own deviations integrated out.

Every voyage of a trial and every part of it has deviations of its own (`voyage_effects`,
`campaign_prior`).
"""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Sequence

import numpy as np

from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.linear.segments import SegmentGrid
from shiplog.diagnosis.noise import discrepancy, likelihood
from shiplog.diagnosis.noise.campaign_parts import products
from shiplog.diagnosis.noise.discrepancy import Discrepancy
from shiplog.diagnosis.noise.likelihood import Modes, Weighed
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.nominal import campaign_prior
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.trial.fitted import Point

KEPT_MODES = 4  # 20 MB each
KEPT_TOTALS = 41  # one point needs about a dozen levels, and again for each family


class Products:
    """They are kept: one pass serves every level of process noise and many hypotheses.

    parts   rows of the segments of each part; voyage of each part
    """

    def __init__(
        self, campaign: Campaign, unseen: Discrepancy, grid: SegmentGrid,
        parts: Sequence[np.ndarray], voyage: np.ndarray,
    ) -> None:  # fmt: skip
        self._campaign, self._unseen, self._grid = campaign, unseen, grid
        self._parts, self._voyage = parts, voyage
        self._modes: list[tuple[Weighed, tuple, Modes]] = []
        self._totals: list[tuple[weakref.ref[Weighed], tuple, np.ndarray, float]] = []
        self._volumes: dict[tuple, float] = {}
        self._by_voyage: tuple[weakref.ref[Weighed], tuple, dict[object, np.ndarray]] | None = None

    def modes(self, point: Point, noise_factor: float, remainder: Remainder) -> tuple[Modes, float]:
        """Products of the point, and the wanted factors λ: one pass serves every λ, but that of an
        intermittent force together with the process noise, whose axes turn with it."""
        rows = segment_nodes.rows_at_knots(point.linear.cut.rows, self._grid)
        process_noise = remainder.in_noise(self._campaign.reference.process_noise, rows)
        shape, left = remainder.shape, noise_factor
        if process_noise.intermittent is not None:
            process_noise, shape, left = process_noise.times(noise_factor), (shape, left), 1.0
        for of, known, found in self._modes:
            if of is point.weighed and known == shape:
                return found, left
        found = self._with_families(likelihood.modes(point.weighed, process_noise), point)
        # the first point's, for `volume`, and the last ones
        last = self._modes[1:][2 - KEPT_MODES :]
        self._modes = [*self._modes[:1], *last, (point.weighed, shape, found)]
        return found, left

    def _with_families(self, modes: Modes, point: Point) -> Modes:
        cut, misfit = point.linear.cut, self._campaign.reference.misfit
        if misfit is not None:
            modes = modes.joined(misfit.accelerations(cut, self._grid))
        return modes.joined(self._unseen.accelerations(cut, self._grid))

    def of_parts(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> list[np.ndarray]:
        """[1 + C, 1 + C] of each part, in units, its own deviations in it. C are the columns of the
        reference; those of the families that no campaign shows are there where the remainder is
        one of them, since they are a quarter of all."""
        modes, noise = self.modes(point, noise, remainder)
        unit = self._campaign.reference.columns.unit
        if remainder.kind in discrepancy.UNSEEN:
            unit = np.append(unit, np.ones(self._unseen.count))
        return products(modes.first(len(unit)), self._parts, unit, weight, noise)

    def total(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> tuple[np.ndarray, float]:
        """Products [1 + C, 1 + C] of all parts, C as in `of_parts`, and log|I + D^½ M D^½| of
        them."""
        key = (noise, weight.tobytes(), remainder.shape)
        size = 1 + len(self._deviation(remainder))
        for of, known, total, volume in self._totals:
            if of() is point.weighed and known == key and len(total) >= size:
                return total if len(total) == size else total[:size, :size], volume
        voyages, volume = self._voyages(point, noise, weight, remainder)
        total = _sum(voyages.values())
        # no id(): a point that is gone leaves its own to the next one
        kept = (weakref.ref(point.weighed), key, total, volume)
        self._totals = [*self._totals[1 - KEPT_TOTALS :], kept]
        return total, volume

    def without(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder,
        left_out: np.ndarray,
    ) -> np.ndarray:  # fmt: skip
        """Products as `total`, of the segments that are not `left_out` [S]. Those of the other
        voyages are kept: one voyage after the other is left out."""
        gone = {
            of for of, rows in zip(self._voyage, self._parts, strict=True) if left_out[rows].any()
        }
        whole = all(
            left_out[rows].all()
            for of, rows in zip(self._voyage, self._parts, strict=True)
            if of in gone
        )
        if not whole or len(gone) == len(set(self._voyage)):
            return self.total(point, noise, np.where(left_out, 0.0, weight), remainder)[0]
        key = (noise, weight.tobytes(), remainder)
        kept = self._by_voyage
        if kept is None or kept[0]() is not point.weighed or kept[1] != key:
            voyages, _ = self._voyages(point, noise, weight, remainder)
            self._by_voyage = kept = (weakref.ref(point.weighed), key, voyages)
        return _sum([gram for of, gram in kept[2].items() if of not in gone])

    def _voyages(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> tuple[dict[object, np.ndarray], float]:
        """Products of each voyage, and log|I + D^½ M D^½| of all."""
        each = self.of_parts(point, noise, weight, remainder)
        within = self._deviation(remainder)
        grams, volumes = campaign_prior.of_voyages(
            each, self._voyage, self._campaign.apart * within, within
        )
        return dict(zip(np.unique(self._voyage), grams, strict=True)), sum(volumes)

    def _deviation(self, remainder: Remainder) -> np.ndarray:
        """[C] of a part's own numbers; of the families that no campaign shows there are none."""
        of = self._campaign.effects.deviation
        more = self._unseen.count if remainder.kind in discrepancy.UNSEEN else 0
        return np.append(of, np.zeros(more))

    def volume(
        self, first: Point, noise_factor: float, weight: np.ndarray, remainder: Remainder
    ) -> float:
        """log |C| at one level of process noise: that of the first point, for every hypothesis.
        Otherwise a model with less damping would gain evidence because it amplifies the noise."""
        key = (noise_factor, remainder.shape, weight.tobytes())
        if key not in self._volumes:
            modes, by = self.modes(first, noise_factor, remainder)
            total = self.total(first, noise_factor, weight, remainder)
            self._volumes[key] = modes.log_volume(by, weight) + total[1]
        return self._volumes[key]


def _sum(each: Iterable[np.ndarray]) -> np.ndarray:
    first, *others = each
    return sum(others, first)
