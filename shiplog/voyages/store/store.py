"""Ingested voyages on disk: hive Parquet, one folder a voyage.

    store/voyage=<name>/table.parquet     10 Hz, zstd
    store/voyage=<name>/voyage.json       ship, profile, source hash, report, corrections
    store/.voyage=<name>.new, .old        while a voyage is written, or replaced
    store/.lock                           held by the one process that writes

A voyage is written under a hidden name and renamed when complete: wherever a process is killed, a
voyage is there as it was, or as it was to become. What is listed are the folders themselves, so
that no list can be out of date. Readers wait for nobody: while a voyage is replaced they find the
one that was there before. What a killed process left is put in order by the next one.

The same log through the same profile is recognised by its content and left alone; another log
under a taken name is refused. What was put right is part of that: the same log ingested without is
the table as it was measured.
"""

from __future__ import annotations

import datetime
import hashlib
import json
import logging
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING

from shiplog.exceptions import StoreError, VoyageMissing, listed, nearest
from shiplog.logs.health.health_report import VoyageReport
from shiplog.machine import files
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.voyages.store import catalogue, parts
from shiplog.voyages.store.catalogue import NEW, OLD, CatalogueEntry
from shiplog.voyages.store.voyage import Voyage

if TYPE_CHECKING:
    import polars as pl

    from shiplog.ship_profile.profile import Profile
    from shiplog.voyages.ingest.ingest import Voyage as IngestedVoyage

CORRECTED = ("kind", "channel", "value", "low", "high", "unit")
INGEST_VERSION = 12  # raised when the same log would become another table or report
SILENT_WAIT_S = 2.0  # how long one waits for another process without a word

log = logging.getLogger(__name__)

# What is heavy is imported where rows, profiles or the lock are asked for: whoever only lists a
# store waits for none of it.


class Store:
    """A folder of voyages.

        for voyage in store: print(voyage.name, voyage.seconds)
        store["voyage_6"].rows_1hz

    `len(store)` counts them, and `"voyage_6" in store` is whether that voyage is there, or that
    part of one.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def __repr__(self) -> str:
        try:
            names = [entry.name for entry in self.entries()]
        except StoreError:  # whoever looks at it in a debugger wants no error
            return f"Store({str(self.path)!r})"
        return (
            f"Store({str(self.path)!r}: {counted(len(names), 'voyage')}, {listed(names, most=6)})"
        )

    def __len__(self) -> int:
        return len(self.entries())

    def __bool__(self) -> bool:
        return True  # a store of no voyage is a store

    def __iter__(self) -> Iterator[Voyage]:
        return (Voyage(self, entry) for entry in self.entries())

    def __contains__(self, name: object) -> bool:
        try:
            return isinstance(name, str) and self[name].name == name
        except StoreError:
            return False

    def __getitem__(self, name: str) -> Voyage:
        """A voyage, or a part of one such as `trip[0:1200]`, by its name. Raises VoyageMissing."""
        entries = {entry.name: entry for entry in self.entries()}
        part = None if name in entries else parts.parse(str(name))
        whole = name if part is None else part.whole
        if whole not in entries:
            raise VoyageMissing(name, entries, str(self.path))
        _refuse_beyond(name, {key: entry.seconds for key, entry in entries.items()})
        return Voyage(self, entries[whole], part)

    def entries(self) -> list[CatalogueEntry]:
        """All voyages, by name."""
        self.mend(wait=False)
        return catalogue.entries(self.path)

    def select(self, patterns: Sequence[str] | None = None) -> list[str]:
        """Names that match any of the shell patterns, each name once; all when none is given. A
        part of a voyage (`parts`) is a name of its own, where it is given as it is.

        In the order of the patterns, then by name. Raises StoreError where one matches nothing.
        """
        lengths = {entry.name: entry.seconds for entry in self.entries()}
        names = list(lengths)
        if not names:
            raise StoreError(
                f"There is no voyage in the store {self.path}.",
                hint="ingest logs first: shiplog ingest LOG... --store DIR.",
            )
        chosen: dict[str, None] = {}
        for pattern in patterns or ["*"]:
            matching = self.there([pattern], names) or [n for n in names if fnmatchcase(n, pattern)]
            if not matching:
                raise StoreError(
                    f"No voyage matches {pattern!r}{nearest(pattern, names)}. "
                    f"In the store {self.path}: {listed(names)}.",
                    hint="`shiplog voyages` lists them; patterns such as 'trial_*' are allowed.",
                )
            for name in matching:
                _refuse_beyond(name, lengths)
            chosen.update(dict.fromkeys(matching))
        return list(chosen)

    def there(self, names: Iterable[str], stored: Sequence[str] | None = None) -> list[str]:
        """Those of these voyages, and parts of voyages, that the store holds."""
        known = {entry.name for entry in self.entries()} if stored is None else set(stored)
        return [n for n in names if n in known or ((p := parts.parse(n)) and p.whole in known)]

    def add(self, voyage: IngestedVoyage) -> str:
        """Take a voyage: "added", "unchanged" or "replaced" (same log, otherwise ingested).

        Raises StoreError where the name is taken by another log, or the store cannot be written;
        it is then as it was.
        """
        import polars as pl

        place = catalogue.place(self.path, voyage.name)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            with self._writing():
                return self._add(voyage, place)
        except (OSError, pl.exceptions.PolarsError) as error:
            refusal = files.refused(error, place)
            why = refusal.strerror if isinstance(refusal, OSError) else refusal
            raise StoreError(
                f"The voyage {voyage.name!r} cannot be written into the store {self.path}: {why}.",
                hint="give a --store on a disk with room that you may write to; what is in the "
                "store is as it was.",
            ) from error

    def _add(self, voyage: IngestedVoyage, place: Path) -> str:
        import polars as pl

        asked = voyage.corrected is not None
        made = voyage.contents.source is not None
        fingerprint = fingerprint_of(voyage.contents.sha256, voyage.profile, asked, made)
        state = "added"
        if place.is_dir():
            facts = catalogue.known(place)
            if facts and facts["sha256"] != voyage.contents.sha256:
                raise StoreError(
                    f"The store {self.path} already holds another log as the voyage "
                    f"{voyage.name!r} (from {facts['source']}).",
                    hint="rename the log file, or ingest into another --store.",
                )
            if facts and facts["fingerprint"] == fingerprint and _whole(place, facts):
                return "unchanged"
            state = "replaced"
        new = catalogue.hidden(place, NEW)
        table, facts = new / "table.parquet", new / "voyage.json"
        try:
            new.mkdir()
            voyage.table.select(pl.lit(voyage.name).alias("voyage"), pl.all()).write_parquet(
                table, compression="zstd", row_group_size=1_000_000
            )
            facts.write_text(json.dumps(_describe(voyage, fingerprint), indent=1), encoding="utf-8")
            for path in (table, facts):
                files.flush(path)
            if state == "replaced":  # the old table stands until the new one is whole
                place.rename(catalogue.hidden(place, OLD))
            new.rename(place)
        finally:
            self._sweep()
        return state

    def holds(
        self, name: str, sha256: str, profile: Profile, correct: bool = False,
        converted: bool = False,
    ) -> bool:  # fmt: skip
        """Whether this very log, read through this very profile, is here already and whole, and
        was corrected if that is requested. Of what was `converted` the [table] counts, too."""
        folder = self._folder(name)
        facts = catalogue.known(folder) if folder.is_dir() else None
        fingerprint = fingerprint_of(sha256, profile, correct, converted)
        return bool(facts) and facts["fingerprint"] == fingerprint and _whole(folder, facts)

    def mend(self, wait: bool = True) -> None:
        """Remove what an interrupted ingest left, and put back the voyage that it was replacing.

        wait   for a process that writes at this moment; else what lies there is that process's

        A store that cannot be written is left as it is: readers know how to read it.
        """
        if not catalogue.unfinished(self.path):
            return
        from filelock import Timeout

        try:
            with self._writing(wait):
                pass
        except Timeout:
            pass
        except OSError as error:
            log.debug("%s stays as it is: %s", self.path, error)

    def report(self, name: str) -> VoyageReport:
        """What was found when this voyage was ingested."""
        return VoyageReport.from_json(catalogue.facts(self._folder(name))["report"])

    def origin(self, name: str) -> tuple[str, tuple[float, float] | None]:
        """When a voyage or its part begins (ISO 8601, UTC), and the latitude and longitude [deg] of
        x₀ = y₀ = 0; None where its log has no coordinates."""
        part = self.part_of(name)
        facts = catalogue.facts(self._folder(part.whole if part else name))
        begins = datetime.datetime.fromisoformat(facts["start"])
        if part is not None:
            begins += datetime.timedelta(seconds=part.begin)
        datum = facts.get("datum")
        place = None if datum is None else (float(datum[0]), float(datum[1]))
        return begins.isoformat(timespec="seconds"), place

    def profile(self, names: Iterable[str]) -> Profile:
        """The profile the voyages were read through. Raises StoreError for two ships, and for two
        profiles of one that differ in sizes, places or kinds of sensors."""
        from pydantic import ValidationError

        from shiplog.ship_profile.differences import differences, readings
        from shiplog.ship_profile.file import advice
        from shiplog.ship_profile.profile import Profile
        from shiplog.voyages.rows import noise_estimate

        chosen: Profile | None = None
        first, instruments = "", []
        for name in names:
            part = self.part_of(name)
            facts = catalogue.facts(self._folder(part.whole if part else name))
            source = facts.get("profile_source", "")
            instruments += VoyageReport.from_json(facts["report"]).instruments
            try:
                profile = Profile.model_validate(facts["profile"] | {"source": source})
            except ValidationError as error:
                raise StoreError(
                    f"The profile of {name} in the store {self.path} cannot be used: "
                    f"{advice(error)}.",
                    hint="mend the profile and ingest the log again.",
                ) from error
            if chosen is None:
                chosen, first = profile, name
            elif profile.columns != chosen.columns or profile.ship.name != chosen.ship.name:
                raise StoreError(
                    f"The voyages are of different ships or sensors: {first} is of "
                    f"{chosen.ship.name!r} with {listed(chosen.actuator_names)}, {name} of "
                    f"{profile.ship.name!r} with {listed(profile.actuator_names)}.",
                    hint="choose voyages of one ship with --voyages.",
                )
            elif differ := differences(chosen, profile):
                raise StoreError(
                    f"{first} and {name} were ingested with two profiles of {profile.ship.name!r}, "
                    f"which differ in {listed(differ)}.",
                    hint="ingest their logs again with one profile, or choose voyages of one with "
                    "--voyages.",
                )
            elif other := readings(chosen, profile):
                log.warning(
                    "%s and %s were read with another unit, sign, zero or order of %s from the "
                    "same fields: if no instrument was changed, ingest them again with one profile",
                    first, name, listed(other),
                )  # fmt: skip
        if chosen is None:
            raise StoreError("No voyage was chosen.", hint="name some with --voyages.")
        return noise_estimate.completed(chosen, instruments)

    def tables(self, names: Sequence[str]) -> list[pl.LazyFrame]:
        """The 10 Hz rows, a lazy table a voyage: voyage, time, the ship's columns, quality.

        Raises StoreError for a voyage whose table is spoilt.
        """
        return [self._table(name) for name in names]

    def voyages(self) -> pl.DataFrame:
        """One row a voyage: name, start, length, usable seconds and windows, findings, source."""
        import polars as pl

        return pl.DataFrame([asdict(entry) for entry in self.entries()])

    def seconds(self, names: Sequence[str], profile: Profile) -> pl.DataFrame:
        """The sorted 1 Hz table of these voyages."""
        from shiplog.voyages.rows import one_hertz

        return one_hertz.resample(self.tables(names), profile.columns, profile.circular)

    def _table(self, name: str) -> pl.LazyFrame:
        import polars as pl

        part = self.part_of(name)
        if part is not None:
            elapsed = (pl.col("time") - pl.col("time").min()).dt.total_nanoseconds() * 1e-9
            inside = (elapsed >= part.begin) & (elapsed < part.end)
            return self._table(part.whole).filter(inside).with_columns(voyage=pl.lit(name))
        folder = catalogue.found_in(catalogue.place(self.path, name), _sound)
        if folder is None:
            catalogue.facts(self._folder(name))  # raises where that is what cannot be read
            raise StoreError(
                f"The table of {name} in the store {self.path} is spoilt.",
                hint="ingest its log again: shiplog ingest LOG --store DIR.",
            )
        return pl.scan_parquet(folder / "table.parquet", hive_partitioning=False)

    def part_of(self, name: str) -> parts.Part | None:
        """None where the name is that of a whole voyage, whatever it looks like."""
        return None if self._folder(name).is_dir() else parts.parse(name)

    def hashes(self, names: Iterable[str]) -> dict[str, str | None]:
        """Name → SHA-256 of its log; of a part, that of its voyage."""
        known = {entry.name: entry.sha256 for entry in self.entries()}
        of = {name: self.part_of(name) for name in names}
        return {name: known.get(part.whole if part else name) for name, part in of.items()}

    def _folder(self, name: str) -> Path:
        """The folder to read a voyage from. Raises StoreError for a name that none can have."""
        return catalogue.whole(catalogue.place(self.path, name))

    @contextmanager
    def _writing(self, wait: bool = True) -> Iterator[None]:
        """Alone: another process waits here. What an interrupted one left is put in order first.

        Raises OSError where the store cannot be written; Timeout where another process writes and
        this one does not wait.
        """
        from filelock import FileLock, Timeout

        lock = FileLock(self.path / ".lock")
        try:
            lock.acquire(timeout=SILENT_WAIT_S if wait else 0.0)
        except Timeout:
            if not wait:
                raise
            log.info("waiting for another process that writes into the store %s", self.path)
            lock.acquire()
        try:
            self._sweep()
            yield
        finally:
            lock.release()

    def _sweep(self) -> None:
        """Back in its place what was being replaced; away with what was never whole."""
        for old in self.path.glob(f".voyage=*{OLD}"):
            place = catalogue.place_of(old)
            if place.is_dir():
                shutil.rmtree(old, ignore_errors=True)
            else:
                old.rename(place)
        for new in self.path.glob(f".voyage=*{NEW}"):
            shutil.rmtree(new, ignore_errors=True)


def fingerprint_of(
    sha256: str, profile: Profile, correct: bool = False, converted: bool = False
) -> str:
    """Identity of a table: the log's content, the profile's meaning, and how it was ingested."""
    unread = None if converted else {"table"}
    text = f"{sha256}:{profile.model_dump_json(exclude=unread)}:{INGEST_VERSION}"
    text += ":corrected" if correct else ""
    return hashlib.sha256(text.encode()).hexdigest()


def _refuse_beyond(name: str, lengths: dict[str, float]) -> None:
    """Raises StoreError for a part that begins where its voyage has ended."""
    part = None if name in lengths else parts.parse(name)
    if part is not None and part.begin >= lengths[part.whole]:
        raise StoreError(
            f"{name} begins after the end of {part.whole}, which is "
            f"{lengths[part.whole]:.0f} s long.",
            hint=f"choose seconds from 0 to {lengths[part.whole]:.0f}.",
        )


def _sound(folder: Path) -> Path | None:
    """The folder, if both of its files can be read."""
    try:
        return folder if _whole(folder, catalogue.facts(folder)) else None
    except StoreError:
        return None


def _whole(folder: Path, facts: dict) -> bool:
    """Whether the table has the rows that were written: a disk may have lost them since."""
    import polars as pl

    try:
        rows = pl.scan_parquet(folder / "table.parquet", hive_partitioning=False)
        return rows.select(pl.len()).collect().item() == facts["report"]["rows"]
    except (OSError, pl.exceptions.PolarsError):
        return False


def _describe(voyage: IngestedVoyage, fingerprint: str) -> dict:
    return {
        "contract": CONTRACT,
        "fingerprint": fingerprint,
        "sha256": voyage.contents.sha256,
        "source": voyage.contents.origin.name,
        "start": str(voyage.table["time"][0]),
        "datum": voyage.datum,
        "profile": voyage.profile.model_dump(mode="json"),
        "profile_source": voyage.profile.source,
        "corrected": [{key: getattr(e, key) for key in CORRECTED} for e in voyage.corrected or ()],
        "report": voyage.report.as_json(),
    }
