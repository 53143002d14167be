"""Products of a trial's segments with every voyage's and part's own deviations integrated out:
equations (3) to (5) of this room.

One pass of a point serves every process noise and many hypotheses: it is kept in the trial's cache,
with totals and volumes. Products are made part by part and added voyage by voyage.
"""

from __future__ import annotations

import itertools
import operator
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any
from weakref import ref

import numpy as np

from shiplog.diagnosis.linear import segment_nodes
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.diagnosis.noise import discrepancy, part_products
from shiplog.diagnosis.noise.discrepancy import Discrepancy
from shiplog.diagnosis.noise.likelihood import ProcessNoise
from shiplog.diagnosis.noise.part_products import Gram, PartPass
from shiplog.diagnosis.noise.remainder import Remainder
from shiplog.diagnosis.nominal import campaign_prior
from shiplog.diagnosis.nominal.nominal_campaign import Campaign
from shiplog.diagnosis.trial.cache import Cache, Total
from shiplog.diagnosis.trial.fitted import Point

VOYAGES = 8  # of a block: their matrices are added before those of the others
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
        """The point's parts without their starts, with the columns of every family: 0.2 MB a
        segment, so that those of the last point are kept."""
        key, kept = weight.tobytes(), self.cache.passes
        if kept is None or kept[0]() is not point.path or kept[1] != key:
            self.cache.passes = kept = None  # before others are made
            made = ref(point.path), key, tuple(self._made(point, weight))
            self.cache.passes = kept = made
        return kept[2]

    def _made(self, point: Point, weight: np.ndarray) -> Iterator[PartPass]:
        reference = self.campaign.reference
        unit = np.append(reference.columns.unit, np.ones(self.omitted.count))
        return part_products.passes(
            point.linear, reference.process_noise, self.parts, unit, weight, self.accelerations
        )

    def _passes_of_first(self, first: Point, weight: np.ndarray) -> Sequence[PartPass]:
        """The first point's, of which volumes alone are asked: the columns that deviate."""
        key, kept = weight.tobytes(), self.cache.first
        if kept is None or kept[0]() is not first.path or kept[1] != key:
            last = self.cache.passes
            alike = last is not None and last[0]() is first.path and last[1] == key
            columns = np.append(0, 1 + np.flatnonzero(self.campaign.effects.deviation))
            given = last[2] if last is not None and alike else self._made(first, weight)
            passes = tuple(one.of_columns(columns) for one in given)
            self.cache.first = kept = ref(first.path), key, passes
        return kept[2]

    def accelerations(self, cut: Cut) -> np.ndarray:
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
        prior, size = of.inverse_kernels(self.grid.nodes), 1 + len(self.deviation(remainder))
        for one in self._passes(point, weight):
            yield one.gram(prior, size)

    def total(self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder) -> Total:
        """G [1 + C, 1 + C] of all parts (4), C as in `each_part`, and log|R| (5)."""
        key = (noise, weight.tobytes(), remainder.shape)
        size = 1 + len(self.deviation(remainder))
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
        """As `total`, worked out. Added block by block: so it is the same to the last bit where
        blocks are added elsewhere (`blocks`)."""
        volumes: list[float] = []

        def in_blocks() -> Iterator[tuple[int, np.ndarray]]:
            for of, one in self.each_voyage(point, noise, weight, remainder):
                volumes.append(one.volume)
                yield block_of[of], one.G

        block_of = self._block_of
        return Total(add_in_blocks(in_blocks()), sum(volumes, sum(self.logdets(point, weight))))

    @property
    def blocks(self) -> list[list[Any]]:
        """Voyages in their order, VOYAGES at a time."""
        every = list(dict.fromkeys(self.voyage.tolist()))
        return [every[at : at + VOYAGES] for at in range(0, len(every), VOYAGES)]

    @property
    def _block_of(self) -> dict[Any, int]:
        return {of: number for number, block in enumerate(self.blocks) for of in block}

    def logdets(self, point: Point, weight: np.ndarray) -> list[float]:
        """log|C₀| of each part (`part_products`)."""
        return [one.logdet for one in self._passes(point, weight)]

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
        return self._without(point, noise, weight, remainder, gone)

    def _without(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder, gone: set
    ) -> np.ndarray:
        """Σ_v G_v of the voyages that are not `gone`, block by block."""
        kept, block_of = self.kept_voyages(point, noise, weight, remainder), self._block_of
        return add_in_blocks((block_of[of], G) for of, G in kept.items() if of not in gone)

    def kept_voyages(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> dict[object, np.ndarray]:
        """G_v of each voyage; those of the last point and noise that they were asked for stay."""
        key = (noise, weight.tobytes(), remainder)
        kept = self.cache.voyages
        if kept is None or kept[0]() is not point.path or kept[1] != key:
            every = self.each_voyage(point, noise, weight, remainder)
            voyages = {of: one.G for of, one in every}
            self.cache.voyages = kept = (ref(point.path), key, voyages)
        return kept[2]

    def each_voyage(
        self, point: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> Iterator[tuple[object, Gram]]:
        """G of each voyage with b_k and c_v integrated out (4), and its share of log|R| (5) but for
        instruments and starts."""
        each = self.each_part(point, noise, weight, remainder)
        deviation = self.deviation(remainder)
        return campaign_prior.each_voyage(
            each, self.voyage, self.campaign.apart * deviation, deviation
        )

    def deviation(self, remainder: Remainder) -> np.ndarray:
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
            kept = self._kept(first, key, 0)
            self.cache.volumes[key] = (
                kept.volume if kept else self._volume(first, noise_factor, weight, remainder)
            )
        return self.cache.volumes[key]

    def _volume(
        self, first: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> float:
        volumes, logdets = self.volumes(first, noise, weight, remainder)
        return sum(volumes, sum(logdets))

    def volumes(
        self, first: Point, noise: float, weight: np.ndarray, remainder: Remainder
    ) -> tuple[list[float], list[float]]:
        """Shares of log|R| of each voyage, and log|C₀| of each part. Of the columns that deviate:
        others have no part in it."""
        of = self.process_noise(first.linear.cut, noise, remainder)
        prior, passes = of.inverse_kernels(self.grid.nodes), self._passes_of_first(first, weight)
        within = self.campaign.effects.deviation
        within = within[within > 0.0]
        each = (one.gram(prior) for one in passes)
        voyages = campaign_prior.each_voyage(
            each, self.voyage, self.campaign.apart * within, within
        )
        return [one.volume for _, one in voyages], [one.logdet for one in passes]


def add_in_blocks(each: Iterable[tuple[int, np.ndarray]]) -> np.ndarray:
    """Σ_blocks (Σ_v G_v) of block and G_v of one voyage after the other."""
    whole: np.ndarray | None = None
    for _, block in itertools.groupby(each, key=operator.itemgetter(0)):
        G = add_up(one for _, one in block)
        whole = G if whole is None else whole + G
    assert whole is not None
    return whole


def add_up(each: Iterable[np.ndarray]) -> np.ndarray:
    """The matrices added in their order."""
    first, *others = each
    return sum(others, first)
