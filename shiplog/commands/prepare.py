"""Logs into the store, and voyages out of it as 1 Hz tables."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import polars as pl

from shiplog.commands.bars import tracked
from shiplog.commands.convert import Converted, as_logs
from shiplog.exceptions import ShiplogError
from shiplog.logs.conversion import formats
from shiplog.logs.conversion.bags import MCAP, bags_once, is_bag, only_log
from shiplog.logs.health import health_report
from shiplog.logs.health.health_report import Finding, NotCompared, VoyageReport
from shiplog.logs.reading.check import expected_s, health_of
from shiplog.logs.reading.read import contents, read
from shiplog.machine import reading_limits
from shiplog.machine.unexpected import unexpected
from shiplog.nomenclature.numbers import counted
from shiplog.report.evaluation import tables
from shiplog.report.page.health import shown as health
from shiplog.report.result import Shown, Shows
from shiplog.ship_profile import file as profiles
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.ingest.fitting_profile import fitting_profile
from shiplog.voyages.ingest.ingest import consistency_of, ingest
from shiplog.voyages.ingest.sensor_correction import corrected
from shiplog.voyages.samples import fields_read, two_sources
from shiplog.voyages.store.store import Store

log = logging.getLogger(__name__)


@dataclass(frozen=True, repr=False)
class Ingested(Shows):
    """What became of logs: `store` holds those in `reports`; `refused` says why of the others.

    lost    what of a file that had to become a log first is not in it
    store   None where logs were only checked
    """

    reports: list[VoyageReport] = field(default_factory=list)
    refused: dict[str, ShiplogError] = field(default_factory=dict)
    lost: dict[str, str] = field(default_factory=dict)
    store: Store | None = None

    @property
    def shown(self) -> Shown | None:  # type: ignore[override]  # made when it is asked for
        if self.store is None or not self.reports:
            return None
        store, names = self.store, list(dict.fromkeys(one.name for one in self.reports))
        return Shown(lambda: health.plots(store, names), lambda: health.rendered(store, names))

    def __repr__(self) -> str:
        taken = (
            f"{counted(len(self.reports), 'voyage')}, {counted(self.findings.height, 'finding')}"
        )
        into = "only checked" if self.store is None else f"in {str(self.store.path)!r}"
        return f"Ingested({taken}, {len(self.refused)} refused, {into})"

    @property
    def voyages(self) -> pl.DataFrame:
        """One row a log that was taken: name, seconds, usable_s, windows, messages_read,
        messages_lost, findings."""
        kept = ("name", "seconds", "usable_s", "windows", "messages_read", "messages_lost")
        rows = [
            {key: getattr(report, key) for key in kept} | {"findings": len(report.findings)}
            for report in self.reports
        ]
        numbers = {"name": pl.String, "seconds": pl.Float64}
        return pl.DataFrame(rows, {k: numbers.get(k, pl.Int64) for k in (*kept, "findings")})

    @property
    def findings(self) -> pl.DataFrame:
        """One row a finding: voyage, kind, channel, sentence, start_s, end_s, value, low, high,
        unit, reason."""
        return health_report.frame({report.name: report.findings for report in self.reports})

    @property
    def lines(self) -> list[str]:
        """Of the logs that were taken."""
        return [line for one in self.reports for line in tables.voyage_lines(one)]

    @property
    def json(self) -> dict:
        return tables.voyages_json(self.reports, self.refused)

    def __str__(self) -> str:
        refused = [f"{Path(path).name} refused: {error}" for path, error in self.refused.items()]
        return "\n".join([*self.lines, *refused])

    @property
    def complete(self) -> bool:
        """Every log was taken, every message of it could be read, and no two channels exclude
        each other."""
        return not self.refused and not self.damaged and not self.lost

    @property
    def damaged(self) -> list[VoyageReport]:
        """Of logs of which something could not be read, or cannot be right."""
        return [report for report in self.reports if report.serious]


def ingest_logs(
    paths: Sequence[Path], profile: str | None, store: Store, correct: bool = False
) -> Ingested:
    """Each log into the store; one that cannot be taken does not stop the others.

    correct  put right what the sensors say of each other beyond doubt
    """
    chosen = profiles.load(profile) if profile else None
    done = Ingested(store=store)
    reported: set[str] = set()
    store.mend()  # else it would wait for the next voyage that is new
    for path, logs in _opened(tracked(paths, "ingesting"), chosen, done):
        for one in logs:
            _ingest_one(one, None if one == path else path, chosen, store, correct, done, reported)
    reading_limits.end()
    return done


def _opened(
    paths: Iterable[Path], chosen: Profile | None, done: Ingested
) -> Iterator[tuple[Path, list[Path]]]:
    """Each path with the logs in it; one that cannot be opened is noted, and stops no other."""
    for path in paths:
        made = Converted()
        try:
            reading_limits.begin(path)
            with as_logs(path, chosen, made) as logs:
                yield path, logs
        except GeneratorExit:
            raise
        except (
            BaseException
        ) as error:  # one bad file never ends the others; a panic is no Exception
            done.refused[str(path)] = _as_said(error, path)
        done.refused.update({name: ShiplogError(why) for name, why in made.refused.items()})
        done.lost.update(made.lost)


def _ingest_one(
    path: Path, source: Path | None, chosen: Profile | None, store: Store, correct: bool,
    done: Ingested, reported: set[str],
) -> None:  # fmt: skip
    """One log, which was made of `source` if there is one, into the store."""
    try:
        found = replace(contents(path), source=source)
        profile_of = chosen or fitting_profile(found)
        if profile_of.source not in reported:
            reported.add(profile_of.source)
            for line in tables.estimated(profile_of):
                log.info(line)
        if store.holds(path.stem, found.sha256, profile_of, correct, source is not None):
            done.reports.append(store.report(path.stem))
            log.info("%s: unchanged", path.stem)
            return
        voyage = ingest(path, profile_of)
        voyage = replace(voyage, contents=found)
        if correct:
            voyage = corrected(voyage)
        state = store.add(voyage)
    except BaseException as error:  # one bad log never ends the others; a panic is no Exception
        done.refused[str(source or path)] = _of_source(_as_said(error, path), path, source)
        return
    done.reports.append(voyage.report)
    log.info("%s: %s", voyage.name, state)


def _of_source(error: ShiplogError, made: Path, source: Path | None) -> ShiplogError:
    """What is said of a log that was made on the way, of the file that was given."""
    if source is None or made.name not in error.message:
        return error
    return ShiplogError(error.message.replace(made.name, source.name), error.hint)


def _as_said(error: BaseException, path: Path) -> ShiplogError:
    return error if isinstance(error, ShiplogError) else unexpected(error, path.name)


def expand(paths: Iterable[Path]) -> list[Path]:
    """Folders stand for the logs and recorders' files in them, but for hidden files; a bag of one
    log for this log, and one of several parts, or a folder of tables, for itself."""
    found: list[Path] = []
    for path in bags_once(paths):
        alone = only_log(path) if is_bag(path) else None
        logs = [] if is_bag(path) or not path.is_dir() else sorted(
            p for p in path.glob("[!.]*") if MCAP in p.suffixes[-2:] and p.is_file()
        ) + formats.voyages_in(path)  # fmt: skip
        found += [alone] if alone else logs or [path]
    return found


def check_logs(paths: Sequence[Path], profile: str | None = None) -> Ingested:
    """The health of each log by itself, and of its sensors by each other; nothing is stored."""
    chosen = profiles.load(profile) if profile else None
    done = Ingested()
    for path, logs in _opened(tracked(expand(paths), "checking", expected_s), chosen, done):
        for one in logs:
            try:
                done.reports.append(_checked(one, chosen, None if one == path else path))
            except BaseException as error:  # one bad log never ends the others
                done.refused[str(path)] = _of_source(_as_said(error, one), one, path)
    reading_limits.end()
    return done


def _checked(path: Path, chosen: Profile | None, source: Path | None) -> VoyageReport:
    """A log's health; where a profile fits it, also what its sensors say of each other."""
    found = contents(path)
    profile, why = chosen, None
    try:
        profile = chosen or fitting_profile(found)
    except ShiplogError as error:
        why = error
    sent = two_sources.several(path, profile) if profile else {}
    reading = read(path, fields_read.wanted(profile, sent) if profile else {}, others=True)
    report = health_of(reading)
    findings: tuple[Finding, ...] = ()
    not_compared: tuple[NotCompared, ...] = ()
    try:
        if profile is not None:
            compared = consistency_of(reading, profile, sent)
            findings, not_compared = compared.findings, compared.not_compared
    except BaseException as error:  # what ingest would refuse has its health all the same
        why = error if isinstance(error, ShiplogError) else unexpected(error, path.name)
    if why is not None:
        said = _of_source(why, path, source).message
        log.info("%s: sensors not held against each other: %s", path.stem, said)
    return replace(report, findings=(*report.findings, *findings), not_compared=not_compared)
