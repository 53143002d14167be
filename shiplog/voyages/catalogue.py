"""What a store holds, read from the facts of its folders: no table is opened, no polars loaded."""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from shiplog.exceptions import StoreError, listed
from shiplog.logs.health_report import VoyageReport

FACTS = ("sha256", "fingerprint", "source", "start", "profile", "report")  # every voyage.json
NEW, OLD = ".new", ".old"  # of a voyage's folder, hidden: while it is written, or replaced

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class CatalogueEntry:
    """One row of the catalogue: one voyage."""

    name: str
    ship: str
    start: str
    rows: int
    seconds: float
    findings: int
    rate_hz: float | None  # of the instrument that measures least often
    usable_s: int | None
    windows: int | None
    sha256: str
    fingerprint: str
    source: str
    written: int  # ns, last change of voyage.json: another one means that the row is out of date


def entries(store: Path, listed_already: Sequence[CatalogueEntry] = ()) -> list[CatalogueEntry]:
    """All voyages of a store, by name. A voyage that was listed after its last change is taken
    from the list; every other one is read from its folder.

    Raises StoreError where the store is a file.
    """
    if store.exists() and not store.is_dir():
        raise StoreError(
            f"The store {store} is a file, not a folder.", hint="give another --store."
        )
    known_rows = {(e.name, e.written): e for e in listed_already}
    found = []
    for folder in sorted(store.glob("voyage=*")):
        path = folder / "voyage.json"
        if not path.is_file():
            continue
        written = path.stat().st_mtime_ns
        row = known_rows.get((name_of(folder), written)) or _entry(folder, written)
        if row is None:
            log.warning("%s cannot be read and is left out: ingest its log again.", folder)
        else:
            found.append(row)
    return sorted(found, key=lambda entry: entry.name)


def interrupted(store: Path) -> bool:
    """Whether an ingest was killed while it replaced a voyage."""
    return any(store.glob(f".voyage=*{OLD}"))


def name_of(folder: Path) -> str:
    """The voyage's name, from its folder's."""
    return unquote(folder.name.removeprefix("voyage="))


def facts(folder: Path) -> dict:
    """A voyage's voyage.json. Raises StoreError."""
    path = folder / "voyage.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        lacking = [key for key in FACTS if key not in found]
        if lacking:
            raise ValueError(f"it lacks {listed(lacking)}")
        VoyageReport.from_json(found["report"])
        found["profile"]["ship"]["name"]
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise StoreError(
            f"{path} cannot be read: {error}.", hint="remove that folder and ingest the log again."
        ) from error
    return found


def known(folder: Path) -> dict | None:
    """The same; None where it cannot be read, or where it names another voyage than the folder."""
    try:
        found = facts(folder)
    except StoreError:
        return None
    return found if found["report"]["name"] == name_of(folder) else None


def _entry(folder: Path, written: int) -> CatalogueEntry | None:
    found = known(folder)
    if found is None:
        return None
    report = VoyageReport.from_json(found["report"])
    slowest = report.slowest
    return CatalogueEntry(
        report.name,
        found["profile"]["ship"]["name"],
        found["start"],
        report.rows,
        report.seconds,
        len(report.findings),
        slowest.rate_hz if slowest else None,
        report.usable_s,
        report.windows,
        found["sha256"],
        found["fingerprint"],
        found["source"],
        written,
    )
