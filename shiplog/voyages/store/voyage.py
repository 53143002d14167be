"""One stored voyage, or a part of it, as a notebook asks for it: `store["voyage_6"]`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Protocol

from shiplog.logs.health import health_report
from shiplog.logs.health.health_report import Finding, VoyageReport
from shiplog.nomenclature.numbers import counted

if TYPE_CHECKING:
    import polars as pl

    from shiplog.ship_profile.profile import Profile
    from shiplog.voyages.store.catalogue import CatalogueEntry
    from shiplog.voyages.store.parts import Part


class Holder(Protocol):
    """What a voyage asks its store for."""

    def tables(self, names: Sequence[str]) -> list[pl.LazyFrame]: ...

    def seconds(self, names: Sequence[str], profile: Profile) -> pl.DataFrame: ...

    def profile(self, names: Sequence[str]) -> Profile: ...

    def report(self, name: str) -> VoyageReport: ...


@dataclass(frozen=True, repr=False)
class Voyage:
    """A voyage of a store. Rows are read when they are asked for.

    entry   the catalogue's row of the whole voyage
    part    seconds of it, where only these are asked for
    """

    store: Holder
    entry: CatalogueEntry
    part: Part | None = None

    @property
    def name(self) -> str:
        return self.entry.name if self.part is None else str(self.part)

    @property
    def ship(self) -> str:
        return self.entry.ship

    @property
    def start(self) -> datetime:
        """Of the first row, UTC."""
        begin = 0 if self.part is None else self.part.begin
        return datetime.fromisoformat(self.entry.start) + timedelta(seconds=begin)

    @property
    def seconds(self) -> float:
        """From the first row to the last [s]."""
        whole = self.entry.seconds
        return whole if self.part is None else min(whole, self.part.end) - self.part.begin

    @property
    def source(self) -> str:
        """Name of the log that it was made of."""
        return self.entry.source

    @property
    def table_10hz(self) -> pl.LazyFrame:
        """The table as it was ingested, lazily: voyage, time, the ship's columns (SI), quality. See
        `nomenclature.channels.Quality` for the marks."""
        return self.store.tables([self.name])[0]

    @property
    def rows_1hz(self) -> pl.DataFrame:
        """Means over a second of the rows that can be used: what windows are cut from. A second
        that is missing begins a new `segment`; `elapsed` [s] counts from the first row."""
        return self.store.seconds([self.name], self.profile)

    @property
    def profile(self) -> Profile:
        """The ship profile that the log was read through."""
        return self.store.profile([self.name])

    @property
    def report(self) -> VoyageReport:
        """What was found when the log was ingested; of a part, that of its whole voyage."""
        return self.store.report(self.entry.name)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What is not as it should be; of a part, what of it falls into these seconds, and what
        has no time."""
        found = self.report.findings
        if self.part is None:
            return found
        begin, end = self.part.begin, self.part.end
        return tuple(
            one for one in found
            if one.start_s is None
            or (one.start_s < end and (one.start_s if one.end_s is None else one.end_s) >= begin)
        )  # fmt: skip

    @property
    def findings_frame(self) -> pl.DataFrame:
        """The same, one row each: voyage, kind, channel, sentence, start_s, end_s, value, ..."""
        return health_report.frame({self.name: self.findings})

    @property
    def json(self) -> dict:
        """The contract's answer of `ingest` for it."""
        return self.report.as_json()

    @property
    def text(self) -> str:
        """A line of facts, then a line a finding."""
        facts = f"{self.name}: {self.seconds:.0f} s from {self._began}, {self.ship}"
        return "\n".join([facts, *(f"  {one.kind}: {one.sentence}" for one in self.findings)])

    @property
    def _began(self) -> str:
        return f"{self.start:%Y-%m-%d %H:%M:%S}"

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        found = "" if self.part else f", {counted(self.entry.findings, 'finding')}"
        return f"Voyage({self.name!r}: {self.seconds:.0f} s from {self._began}{found})"
