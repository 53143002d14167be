"""Ingested voyages on disk: hive Parquet, one folder a voyage, and a small catalogue.

    store/catalogue.parquet               one row a voyage, made again from the folders
    store/voyage=<name>/table.parquet     10 Hz, zstd
    store/voyage=<name>/voyage.json       ship, profile, source hash, report, what was put right

A voyage is written beside its place and renamed when whole. The same log through the same profile
is recognised by its content and left alone; another log under a taken name is refused. What was
put right is part of that: the same log ingested without is the table as it was measured.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from urllib.parse import quote

import polars as pl

from shiplog import parts
from shiplog.exceptions import StoreError, listed, nearest
from shiplog.findings import CONTRACT, VoyageReport
from shiplog.ingest import Voyage
from shiplog.profile import Profile

CORRECTED = ("kind", "channel", "value", "low", "high", "unit")
INGEST_VERSION = 3  # raised when the same log would become another table or report


@dataclass(frozen=True)
class Entry:
    """What the catalogue says of one voyage."""

    name: str
    ship: str
    start: str
    rows: int
    seconds: float
    findings: int
    sha256: str
    fingerprint: str
    source: str


class Store:
    """A folder of voyages."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)

    def entries(self) -> list[Entry]:
        """All voyages, by name. Reads the catalogue, or the folders where it is missing."""
        catalogue = self.path / "catalogue.parquet"
        if not catalogue.is_file():
            return self._scan_folders()
        return [Entry(**row) for row in pl.read_parquet(catalogue).to_dicts()]

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

        Raises StoreError where the name is taken by another log; the store is then as it was.
        """
        folder = self._folder(voyage.name)
        asked = voyage.corrected is not None
        fingerprint = fingerprint_of(voyage.contents.sha256, voyage.profile, asked)
        state = "added"
        if folder.is_dir():
            facts = _facts(folder)
            if facts["sha256"] != voyage.contents.sha256:
                raise StoreError(
                    f"The store {self.path} already holds another log as the voyage "
                    f"{voyage.name!r} (from {facts['source']}).",
                    hint="rename the log file, or ingest into another --store.",
                )
            if facts["fingerprint"] == fingerprint:
                return "unchanged"
            state = "replaced"
        partial = folder.with_name(f"{folder.name}.{os.getpid()}.partial")
        try:
            partial.mkdir(parents=True)
            voyage.table.select(pl.lit(voyage.name).alias("voyage"), pl.all()).write_parquet(
                partial / "table.parquet", compression="zstd", row_group_size=1_000_000
            )
            (partial / "voyage.json").write_text(
                json.dumps(_describe(voyage, fingerprint), indent=1), encoding="utf-8"
            )
            if state == "replaced":  # the old table stands until the new one is whole
                old = folder.with_name(f"{folder.name}.old.partial")
                folder.rename(old)
                partial.rename(folder)
                shutil.rmtree(old)
            else:
                partial.rename(folder)
        finally:
            shutil.rmtree(partial, ignore_errors=True)
        self._write_catalogue()
        return state

    def holds(self, name: str, sha256: str, profile: Profile, correct: bool = False) -> bool:
        """Whether this very log, read through this very profile, is here already, and was put
        right if that is asked for."""
        folder = self._folder(name)
        fingerprint = fingerprint_of(sha256, profile, correct)
        return folder.is_dir() and _facts(folder)["fingerprint"] == fingerprint

    def report(self, name: str) -> VoyageReport:
        """What was found when this voyage was ingested."""
        return VoyageReport.from_json(_facts(self._folder(name))["report"])

    def profile(self, names: Iterable[str]) -> Profile:
        """The profile the voyages were read through. Raises StoreError for two ships."""
        chosen: Profile | None = None
        first = ""
        for name in names:
            part = self._part(name)
            facts = _facts(self._folder(part.whole if part else name))
            source = facts.get("profile_source", "")
            profile = Profile.model_validate(facts["profile"] | {"source": source})
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
        """The 10 Hz rows, a lazy table a voyage: voyage, time, the ship's columns, quality."""
        return [self._table(name) for name in names]

    def _table(self, name: str) -> pl.LazyFrame:
        part = self._part(name)
        if part is None:
            return pl.scan_parquet(self._folder(name) / "table.parquet", hive_partitioning=False)
        elapsed = (pl.col("time") - pl.col("time").min()).dt.total_nanoseconds() * 1e-9
        inside = (elapsed >= part.begin) & (elapsed < part.end)
        return self._table(part.whole).filter(inside).with_columns(voyage=pl.lit(name))

    def _part(self, name: str) -> parts.Part | None:
        """None where the name is that of a whole voyage, whatever it looks like."""
        return None if self._folder(name).is_dir() else parts.parse(name)

    def hashes(self, names: Iterable[str]) -> dict[str, str | None]:
        """Name → SHA-256 of its log; of a part, that of its voyage."""
        known = {entry.name: entry.sha256 for entry in self.entries()}
        of = {name: self._part(name) for name in names}
        return {name: known.get(part.whole if part else name) for name, part in of.items()}

    def _folder(self, name: str) -> Path:
        return self.path / f"voyage={quote(name, safe=' ()+,')}"

    def _scan_folders(self) -> list[Entry]:
        entries = []
        for folder in sorted(self.path.glob("voyage=*")):
            if folder.name.endswith(".partial") or not (folder / "voyage.json").is_file():
                continue
            facts = _facts(folder)
            report = facts["report"]
            entries.append(
                Entry(
                    report["name"],
                    facts["profile"]["ship"]["name"],
                    facts["start"],
                    report["rows"],
                    report["seconds"],
                    len(report["findings"]),
                    facts["sha256"],
                    facts["fingerprint"],
                    facts["source"],
                )
            )
        return sorted(entries, key=lambda entry: entry.name)

    def _write_catalogue(self) -> None:
        rows = [asdict(entry) for entry in self._scan_folders()]
        partial = self.path / f"catalogue.{os.getpid()}.partial"
        pl.DataFrame(rows).write_parquet(partial)
        partial.replace(self.path / "catalogue.parquet")


def fingerprint_of(sha256: str, profile: Profile, correct: bool = False) -> str:
    """Identity of a table: the log's content, the profile's meaning, and how it was ingested."""
    text = f"{sha256}:{profile.model_dump_json(exclude={'table'})}:{INGEST_VERSION}"
    text += ":corrected" if correct else ""
    return hashlib.sha256(text.encode()).hexdigest()


def _facts(folder: Path) -> dict:
    path = folder / "voyage.json"
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StoreError(
            f"{path} cannot be read: {error}.", hint="remove that folder and ingest the log again."
        ) from error


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
