"""Logs into the store, and voyages out of it as 1 Hz tables."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pipelines.bars import tracked
from shiplog import profile_file as profiles
from shiplog.exceptions import ShiplogError
from shiplog.logs import reading_limits
from shiplog.logs.check import expected_s, health_of
from shiplog.logs.health_report import Finding, VoyageReport
from shiplog.logs.read import contents, read
from shiplog.profile import Profile
from shiplog.report import tables
from shiplog.unexpected import unexpected
from shiplog.voyages import beside
from shiplog.voyages.fitting_profile import fitting_profile
from shiplog.voyages.ingest import consistency_of, ingest
from shiplog.voyages.sensor_correction import corrected
from shiplog.voyages.store import Store

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class IngestedLogs:
    """What became of each log: its report, or why it was refused."""

    reports: list[VoyageReport]
    refused: dict[str, ShiplogError]

    @property
    def complete(self) -> bool:
        """Every log was taken, every message of it could be read, and no two channels exclude
        each other."""
        return not self.refused and not self.damaged

    @property
    def damaged(self) -> list[VoyageReport]:
        """Of logs of which something could not be read, or cannot be right."""
        return [report for report in self.reports if report.serious]


def ingest_logs(
    paths: Sequence[Path], profile: str | None, store: Store, correct: bool = False
) -> IngestedLogs:
    """Each log into the store; one that cannot be taken does not stop the others.

    correct  put right what the sensors say of each other beyond doubt
    """
    chosen = profiles.load(profile) if profile else None
    reports: list[VoyageReport] = []
    refused: dict[str, ShiplogError] = {}
    reported: set[str] = set()
    store.mend()  # else it would wait for the next voyage that is new
    for path in tracked(paths, "ingesting"):
        try:
            reading_limits.begin(path)
            found = contents(path)
            profile_of = chosen or fitting_profile(found)
            if profile_of.source not in reported:
                reported.add(profile_of.source)
                for line in tables.estimated(profile_of):
                    log.info(line)
            if store.holds(path.stem, found.sha256, profile_of, correct):
                reports.append(store.report(path.stem))
                log.info("%s: unchanged", path.stem)
                continue
            voyage = ingest(path, profile_of)
            if correct:
                voyage = corrected(voyage)
            state = store.add(voyage)
        except ShiplogError as error:
            refused[str(path)] = error
            continue
        except BaseException as error:  # one bad log never ends the others; a panic is no Exception
            refused[str(path)] = unexpected(error, path.name)
            continue
        reports.append(voyage.report)
        log.info("%s: %s", voyage.name, state)
    reading_limits.end()
    return IngestedLogs(reports, refused)


def expand(paths: Iterable[Path]) -> list[Path]:
    """Folders stand for the logs in them, but for hidden files; one without logs for itself, which
    no reader takes."""
    found: list[Path] = []
    for path in paths:
        logs = sorted(path.glob("[!.]*.mcap")) if path.is_dir() else []
        found += logs or [path]
    return found


def check_logs(paths: Sequence[Path], profile: str | None = None) -> IngestedLogs:
    """The health of each log by itself, and of its sensors by each other; nothing is stored."""
    chosen = profiles.load(profile) if profile else None
    reports: list[VoyageReport] = []
    refused: dict[str, ShiplogError] = {}
    for path in tracked(expand(paths), "checking", expected_s):
        try:
            reading_limits.begin(path)
            reports.append(_checked(path, chosen))
        except ShiplogError as error:
            refused[str(path)] = error
        except BaseException as error:  # one bad log never ends the others; a panic is no Exception
            refused[str(path)] = unexpected(error, path.name)
    reading_limits.end()
    return IngestedLogs(reports, refused)


def _checked(path: Path, chosen: Profile | None) -> VoyageReport:
    """A log's health; where a profile fits it, also what its sensors say of each other."""
    found = contents(path)
    profile, why = chosen, None
    try:
        profile = chosen or fitting_profile(found)
    except ShiplogError as error:
        why = error
    reading = read(path, beside.wanted(profile) if profile else {}, others=True)
    report = health_of(reading)
    consistency: list[Finding] = []
    try:
        if profile is not None:
            consistency = consistency_of(reading, profile)
    except BaseException as error:  # what ingest would refuse has its health all the same
        why = error if isinstance(error, ShiplogError) else unexpected(error, path.name)
    if why is not None:
        log.info("%s: sensors not held against each other: %s", path.stem, why.message)
    return replace(report, findings=(*report.findings, *consistency))
