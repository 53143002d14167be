"""Ingested voyages on disk: hive Parquet, one folder a voyage, and a small catalogue.

    store/catalogue.parquet               one row a voyage, made again from the folders
    store/voyage=<name>/table.parquet     10 Hz, zstd
    store/voyage=<name>/voyage.json       ship, profile, source hash, report, corrections
    store/.lock                           held by the one process that writes

A voyage is written under a hidden name and renamed when complete. The folders are the truth: a
process that is killed between a folder's rename and the catalogue's leaves a catalogue that is out
of date, which every reader notices. The same log through the same profile is recognised by its
content and left alone; another log under a taken name is refused. What was put right is part of
that: the same log ingested without is the table as it was measured.
"""

from __future__ import annotations

import hashlib
import json
import logging
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, fields
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

import polars as pl
from filelock import FileLock
from pydantic import ValidationError

from shiplog import files
from shiplog.exceptions import StoreError, listed, nearest
from shiplog.logs.health_report import CONTRACT, VoyageReport
from shiplog.profile import Profile
from shiplog.profile_file import advice
from shiplog.voyages import catalogue, one_hertz, parts
from shiplog.voyages.catalogue import NEW, OLD, CatalogueEntry

if TYPE_CHECKING:  # with it come scipy and the readers of logs, in half a second
    from shiplog.voyages.ingest import Voyage

CORRECTED = ("kind", "channel", "value", "low", "high", "unit")
INGEST_VERSION = 4  # raised when the same log would become another table or report
LONGEST = 240  # letters; file systems have room for 255, and NEW or OLD takes some

log = logging.getLogger(__name__)


class Store:
    """A folder of voyages."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def entries(self) -> list[CatalogueEntry]:
        """All voyages, by name. Reads the catalogue, or the folders where the two differ."""
        if catalogue.interrupted(self.path):
            self.mend()
        return catalogue.entries(self.path, self._catalogue())

    def select(self, patterns: Sequence[str] | None = None) -> list[str]:
        """Names that match any of the shell patterns, each name once; all when none is given. A
        part of a voyage (`parts`) is a name of its own, where it is given as it is.

        In the order of the patterns, then by name. Raises StoreError where one matches nothing.
        """
        names = [entry.name for entry in self.entries()]
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
            chosen.update(dict.fromkeys(matching))
        return list(chosen)

    def there(self, names: Iterable[str], stored: Sequence[str] | None = None) -> list[str]:
        """Those of these voyages, and parts of voyages, that the store holds."""
        known = {entry.name for entry in self.entries()} if stored is None else set(stored)
        return [n for n in names if n in known or ((p := parts.parse(n)) and p.whole in known)]

    def add(self, voyage: Voyage) -> str:
        """Take a voyage: "added", "unchanged" or "replaced" (same log, otherwise ingested).

        Raises StoreError where the name is taken by another log, or the store cannot be written;
        it is then as it was.
        """
        folder = self._folder(voyage.name)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            with self._writing():
                return self._add(voyage, folder)
        except (OSError, pl.exceptions.PolarsError) as error:
            raise StoreError(
                f"The voyage {voyage.name!r} cannot be written into the store {self.path}: "
                f"{error}.",
                hint="give a --store on a disk with room that you may write to.",
            ) from error

    def _add(self, voyage: Voyage, folder: Path) -> str:
        asked = voyage.corrected is not None
        fingerprint = fingerprint_of(voyage.contents.sha256, voyage.profile, asked)
        state = "added"
        if folder.is_dir():
            facts = catalogue.known(folder)
            if facts and facts["sha256"] != voyage.contents.sha256:
                raise StoreError(
                    f"The store {self.path} already holds another log as the voyage "
                    f"{voyage.name!r} (from {facts['source']}).",
                    hint="rename the log file, or ingest into another --store.",
                )
            if facts and facts["fingerprint"] == fingerprint and _whole(folder, facts):
                self._list()
                return "unchanged"
            state = "replaced"
        new, old = (folder.with_name(f".{folder.name}{end}") for end in (NEW, OLD))
        try:
            new.mkdir()
            voyage.table.select(pl.lit(voyage.name).alias("voyage"), pl.all()).write_parquet(
                new / "table.parquet", compression="zstd", row_group_size=1_000_000
            )
            (new / "voyage.json").write_text(
                json.dumps(_describe(voyage, fingerprint), indent=1), encoding="utf-8"
            )
            if state == "replaced":  # the old table stands until the new one is whole
                folder.rename(old)
            new.rename(folder)
        finally:
            self._sweep()
        self._list()
        return state

    def holds(self, name: str, sha256: str, profile: Profile, correct: bool = False) -> bool:
        """Whether this very log, read through this very profile, is here already and whole, and
        was corrected if that is requested."""
        folder = self._folder(name)
        facts = catalogue.known(folder) if folder.is_dir() else None
        fingerprint = fingerprint_of(sha256, profile, correct)
        return bool(facts) and facts["fingerprint"] == fingerprint and _whole(folder, facts)

    def mend(self) -> None:
        """Finish what an interrupted ingest left undone: a voyage that was being replaced goes
        back to its place, and the catalogue lists every voyage. A store that cannot be written is
        left as it is."""
        if not self.path.is_dir():
            return
        try:
            with self._writing():
                self._list()
        except OSError as error:
            log.debug("%s stays as it is: %s", self.path, error)

    def report(self, name: str) -> VoyageReport:
        """What was found when this voyage was ingested."""
        return VoyageReport.from_json(catalogue.facts(self._folder(name))["report"])

    def profile(self, names: Iterable[str]) -> Profile:
        """The profile the voyages were read through. Raises StoreError for two ships."""
        chosen: Profile | None = None
        first = ""
        for name in names:
            part = self._part(name)
            facts = catalogue.facts(self._folder(part.whole if part else name))
            source = facts.get("profile_source", "")
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
        if chosen is None:
            raise StoreError("No voyage was chosen.", hint="name some with --voyages.")
        return chosen

    def tables(self, names: Sequence[str]) -> list[pl.LazyFrame]:
        """The 10 Hz rows, a lazy table a voyage: voyage, time, the ship's columns, quality.

        Raises StoreError for a voyage whose table is spoilt.
        """
        return [self._table(name) for name in names]

    def voyages(self) -> pl.DataFrame:
        """One row a voyage: name, start, length, usable seconds and windows, findings, source."""
        return pl.DataFrame([asdict(entry) for entry in self.entries()])

    def seconds(self, names: Sequence[str], profile: Profile) -> pl.DataFrame:
        """The sorted 1 Hz table of these voyages."""
        return one_hertz.resample(self.tables(names), profile.columns, profile.circular)

    def _table(self, name: str) -> pl.LazyFrame:
        part = self._part(name)
        if part is not None:
            elapsed = (pl.col("time") - pl.col("time").min()).dt.total_nanoseconds() * 1e-9
            inside = (elapsed >= part.begin) & (elapsed < part.end)
            return self._table(part.whole).filter(inside).with_columns(voyage=pl.lit(name))
        folder = self._folder(name)
        if not _whole(folder, catalogue.facts(folder)):
            raise StoreError(
                f"The table of {name} in the store {self.path} is spoilt.",
                hint="ingest its log again: shiplog ingest LOG --store DIR.",
            )
        return pl.scan_parquet(folder / "table.parquet", hive_partitioning=False)

    def _part(self, name: str) -> parts.Part | None:
        """None where the name is that of a whole voyage, whatever it looks like."""
        return None if self._folder(name).is_dir() else parts.parse(name)

    def hashes(self, names: Iterable[str]) -> dict[str, str | None]:
        """Name → SHA-256 of its log; of a part, that of its voyage."""
        known = {entry.name: entry.sha256 for entry in self.entries()}
        of = {name: self._part(name) for name in names}
        return {name: known.get(part.whole if part else name) for name, part in of.items()}

    def _folder(self, name: str) -> Path:
        """A voyage's folder. Raises StoreError for a name that no folder can have."""
        try:
            folder = f"voyage={quote(name, safe=' ()+,')}"
        except UnicodeEncodeError as error:
            raise StoreError(
                f"The name {name!a} of the log is not text.", hint="rename the log file."
            ) from error
        if len(folder) > LONGEST:
            raise StoreError(
                f"The name {name!r} of the log is too long for a folder.",
                hint="rename the log file.",
            )
        return self.path / folder

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Alone: two that write at once would each make a catalogue without the other's voyage.
        What an interrupted process left behind is put in order first."""
        with FileLock(self.path / ".lock"):
            self._sweep()
            yield

    def _sweep(self) -> None:
        """Back in its place what was being replaced; away with what was never whole."""
        for old in self.path.glob(f".voyage=*{OLD}"):
            place = old.with_name(old.name.removeprefix(".").removesuffix(OLD))
            if place.is_dir():
                shutil.rmtree(old, ignore_errors=True)
            else:
                old.rename(place)
        for new in self.path.glob(f".voyage=*{NEW}"):
            shutil.rmtree(new, ignore_errors=True)

    def _catalogue(self) -> list[CatalogueEntry]:
        """What catalogue.parquet lists; nothing where it cannot be read."""
        path = self.path / "catalogue.parquet"
        try:
            table = pl.read_parquet(path)
        except (OSError, pl.exceptions.PolarsError):
            return []
        if table.columns != [field.name for field in fields(CatalogueEntry)]:
            return []
        return [CatalogueEntry(**row) for row in table.to_dicts()]

    def _list(self) -> None:
        """Write the catalogue anew, if it does not say what the folders say."""
        entries = catalogue.entries(self.path, self._catalogue())
        if entries == self._catalogue():
            return
        rows = pl.DataFrame([asdict(entry) for entry in entries])
        files.write_frame(self.path / "catalogue.parquet", rows)


def fingerprint_of(sha256: str, profile: Profile, correct: bool = False) -> str:
    """Identity of a table: the log's content, the profile's meaning, and how it was ingested."""
    text = f"{sha256}:{profile.model_dump_json(exclude={'table'})}:{INGEST_VERSION}"
    text += ":corrected" if correct else ""
    return hashlib.sha256(text.encode()).hexdigest()


def _whole(folder: Path, facts: dict) -> bool:
    """Whether the table has the rows that were written: a disk may have lost them since."""
    try:
        rows = pl.scan_parquet(folder / "table.parquet", hive_partitioning=False)
        return rows.select(pl.len()).collect().item() == facts["report"]["rows"]
    except (OSError, pl.exceptions.PolarsError):
        return False


def _describe(voyage: Voyage, fingerprint: str) -> dict:
    return {
        "contract": CONTRACT,
        "fingerprint": fingerprint,
        "sha256": voyage.contents.sha256,
        "source": voyage.contents.path.name,
        "start": str(voyage.table["time"][0]),
        "datum": voyage.datum,
        "profile": voyage.profile.model_dump(mode="json"),
        "profile_source": voyage.profile.source,
        "corrected": [{key: getattr(e, key) for key in CORRECTED} for e in voyage.corrected or ()],
        "report": voyage.report.as_json(),
    }
