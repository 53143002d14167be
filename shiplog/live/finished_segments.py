"""Segments that are finished: final rows, cut end to end in every unbroken stretch.

A segment needs CONTEXT_S of rows on either side, in which a clock may be late and over which a
motion is averaged; at the end of a stretch it does without. Rows that were not measured break a
stretch, as in a campaign; so do seconds in which a channel is not to be trusted. A segment in which
the actuators are moved as in no training voyage (`handling`) is left out and kept in `unlike`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import polars as pl

from shiplog.live import segment_products
from shiplog.live.handling import Unlike
from shiplog.live.nominal import Nominal, as_campaign
from shiplog.nomenclature.units import SECOND_NS
from shiplog.voyages.rows import recording
from shiplog.voyages.rows.recording import RATE_HZ

CONTEXT_S = 6.0


@dataclass(frozen=True)
class Segment:
    """Its first and last time [ns], and its products G_s [1 + C, 1 + C]."""

    start: int
    end: int
    gram: np.ndarray


@dataclass
class FinishedSegments:
    """Of one voyage; `begin` is the earliest start of the next segment [ns]."""

    nominal: Nominal
    rows: pl.DataFrame | None = None
    begin: int = 0
    distrusted: list[tuple[int, int]] = field(default_factory=list)  # ns
    unlike: list[tuple[int, list[Unlike]]] = field(default_factory=list)  # ns, of the last `add`

    @property
    def seconds(self) -> float:
        return self.nominal.grid.seconds

    def add(self, final: pl.DataFrame, end: bool = False) -> list[Segment]:
        """More final rows: the segments that they finish. `end`: nothing comes any more."""
        self.rows = final if self.rows is None else pl.concat((self.rows, final))
        self.unlike = []
        held = self.rows.height / RATE_HZ
        if held < self.seconds + CONTEXT_S and not end:
            return []
        found = self._cut(end)
        since = self.begin - round(CONTEXT_S * SECOND_NS)
        most = round((2.0 * self.seconds + 2.0 * CONTEXT_S) * RATE_HZ)
        self.rows = self.rows.filter(pl.col("time").to_physical() >= since)[-most:]
        self.distrusted = [one for one in self.distrusted if one[1] >= since]
        return found

    def distrust(self, since: int, until: int) -> None:
        """No segment of these times [ns] counts."""
        self.distrusted.append((since, until))

    def _cut(self, end: bool) -> list[Segment]:
        assert self.rows is not None
        profile = self.nominal.record.profile
        if self.rows.height < 2:
            return []
        record = recording.read([self.rows], ["watched"], profile)
        if not len(record):
            return []
        first = int(self.rows["time"].to_physical()[0])
        times = first + np.rint(record.time * 10).astype(np.int64) * (SECOND_NS // 10)
        size = self.nominal.grid.rows
        context = round(CONTEXT_S * RATE_HZ)
        edges = np.append(np.flatnonzero(record.starts), len(record))
        chosen: list[int] = []
        for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            closed = end or b < len(record)  # else rows still come
            at = a + int(np.searchsorted(times[a:b], self.begin))
            while at + size < b and (closed or at + size + context < b):
                chosen.append(at)
                at += size
                self.begin = int(times[at])
            if closed and at < b:
                self.begin = max(self.begin, int(times[b - 1]) + 1)
        record = as_campaign(record, self.nominal.timescale)
        trusted = [at for at in chosen if self._trusted(int(times[at]), int(times[at + size]))]
        new = {at: self.nominal.handling.unlike(record, at) for at in trusted}
        self.unlike = [(int(times[at + size]), found) for at, found in new.items()]
        trusted = [at for at in trusted if not new[at]]
        if not trusted:
            return []
        grams = segment_products.grams(
            self.nominal.campaign.reference, self.nominal.grid, record, np.array(trusted)
        )
        return [
            Segment(int(times[at]), int(times[at + size]), gram)
            for at, gram in zip(trusted, grams, strict=True)
        ]

    def _trusted(self, start: int, end: int) -> bool:
        return not any(since < end and until > start for since, until in self.distrusted)


def span(segments: Sequence[Segment]) -> tuple[int, int] | None:
    """From the first to the last time [ns]."""
    return (segments[0].start, segments[-1].end) if segments else None
