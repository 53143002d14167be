"""What a store holds, read from the facts of its folders: no table is opened, no polars loaded."""

from __future__ import annotations

import json
import logging
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar
from urllib.parse import quote, unquote

from shiplog.exceptions import StoreError, listed
from shiplog.logs.health.health_report import VoyageReport

FACTS = ("sha256", "fingerprint", "source", "start", "profile", "report")  # every voyage.json
NEW, OLD = ".new", ".old"  # of a voyage's folder, hidden: while it is written, or replaced
UNSHOWN = ("Cc", "Zl", "Zp")  # Unicode's categories of control characters and line ends
LONGEST = 240  # letters; file systems have room for 255, and NEW or OLD takes some

Found = TypeVar("Found")

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


def entries(store: Path) -> list[CatalogueEntry]:
    """All voyages of a store, by name, as their folders have them: a thousand take 0.1 s.

    Raises StoreError where the store is a file.
    """
    if store.exists() and not store.is_dir():
        raise StoreError(
            f"The store {store} is a file, not a folder.", hint="give another --store."
        )
    found = []
    for place in sorted(_places(store)):
        row = found_in(place, _entry)
        if row is None:
            log.warning("%s cannot be read and is left out: ingest its log again.", whole(place))
        else:
            found.append(row)
    return sorted(found, key=lambda entry: entry.name)


def unfinished(store: Path) -> bool:
    """Whether a process writes a voyage, or was killed at it."""
    return any(store.glob(".voyage=*"))


def _places(store: Path) -> set[Path]:
    """Where the folders of voyages are, or will be again."""
    places = set(store.glob("voyage=*"))
    places |= {place_of(old) for old in store.glob(f".voyage=*{OLD}")}
    return {place for place in places if found_in(place, _has_facts)}


def _has_facts(folder: Path) -> bool:
    return (folder / "voyage.json").is_file()


def place(store: Path, name: str) -> Path:
    """Where a voyage's folder is. Raises StoreError for a name that no folder can have, or that
    would break a line of a report."""
    if unshown(name):
        raise StoreError(
            f"The name {name!r} of the log holds a line end or a control character.",
            hint="rename the log file.",
        )
    try:
        folder = f"voyage={quote(name, safe=' ()+,')}"
    except UnicodeEncodeError as error:
        raise StoreError(
            f"The name {name!a} of the log is not text.", hint="rename the log file."
        ) from error
    if len(folder) > LONGEST:
        raise StoreError(
            f"The name {name!r} of the log is too long for a folder: {len(folder)} letters, where "
            f"{LONGEST} are the most. Letters that are not ASCII count three for each byte.",
            hint="rename the log file.",
        )
    return store / folder


def unshown(name: str) -> bool:
    """Whether a name holds what no line of text can show."""
    return any(unicodedata.category(letter) in UNSHOWN for letter in name)


def hidden(place: Path, end: str) -> Path:
    """The folder of a voyage while it is written (NEW) or replaced (OLD)."""
    return place.with_name(f".{place.name}{end}")


def place_of(old: Path) -> Path:
    """Of a hidden folder, the place that it was taken from."""
    return old.with_name(old.name.removeprefix(".").removesuffix(OLD))


def whole(place: Path) -> Path:
    """The folder to read a voyage from: while it is replaced, the one that was there before."""
    old = hidden(place, OLD)
    return old if not place.is_dir() and old.is_dir() else place


def found_in(place: Path, look: Callable[[Path], Found | None]) -> Found | None:
    """What is found in a voyage's folder; once more where it was moved since it was looked up, as
    by a process that replaces it."""
    return look(whole(place)) or look(whole(place))


def name_of(folder: Path) -> str:
    """The voyage's name, from its folder's."""
    place = place_of(folder) if folder.name.startswith(".") else folder
    return unquote(place.name.removeprefix("voyage="))


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


def read_known(folder: Path) -> dict | None:
    """The same; None where it cannot be read, or names another voyage than the folder, or one that
    no ingest would have named so."""
    try:
        found = facts(folder)
    except StoreError:
        return None
    name = found["report"]["name"]
    return found if name == name_of(folder) and not unshown(name) else None


def _entry(folder: Path) -> CatalogueEntry | None:
    found = read_known(folder)
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
    )
