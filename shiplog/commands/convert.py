"""Tables, NMEA 0183 text and ROS bags to MCAP logs of the contract."""

from __future__ import annotations

import logging
import os
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from shiplog.commands.bars import drawable, tracked
from shiplog.drafting import draft as draft_log
from shiplog.drafting import draft_table
from shiplog.drafting.folders import Folder, clock_section, look_into, recognised
from shiplog.exceptions import ShiplogError
from shiplog.logs.conversion import columns, packed
from shiplog.logs.conversion.bags import MCAP, bag_to_log, bags_once, is_bag
from shiplog.logs.conversion.delimited import is_table, read_table
from shiplog.logs.conversion.heartbeat import saying
from shiplog.logs.conversion.nmea import is_nmea, read_nmea_log
from shiplog.logs.conversion.nmea_folder import read_folder
from shiplog.logs.conversion.signalk import is_signalk, read_signalk
from shiplog.logs.conversion.topics import holds_tables
from shiplog.logs.conversion.write import Series, refuse_existing, write_log
from shiplog.logs.health.health_report import Finding
from shiplog.logs.mcap_file import foreign_files
from shiplog.logs.mcap_file.foreign_files import is_foreign
from shiplog.logs.mcap_file.refusals import begins_as_log, refuse_log
from shiplog.machine import files, reading_limits
from shiplog.machine.paths import check_there, refuse_namesake
from shiplog.machine.unexpected import unexpected
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.report.result import Printed
from shiplog.ship_profile.profile import Column, Profile

log = logging.getLogger(__name__)


@dataclass(frozen=True, repr=False)
class Converted(Printed):
    """The logs that were written, what was refused, and what of the others was lost."""

    logs: list[Path] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)
    lost: dict[str, str] = field(default_factory=dict)
    out: Path | None = None

    @property
    def lines(self) -> list[str]:
        return [f"{counted(len(self.logs), 'log')} in {self.out}"]

    @property
    def json(self) -> dict:
        logs = [str(path) for path in self.logs]
        return {"contract": CONTRACT, "logs": logs, "refused": self.refused, "lost": self.lost}


def convert(sources: list[Path], profile: Profile | None, out: Path) -> Converted:
    """Each source, or each voyage in it, to one log. One that is refused does not stop the rest.

    profile  says what a single table's columns are; NMEA, bags and folders do without
    """
    done = Converted(out=out)
    for path in tracked(bags_once(sources), "converting"):
        try:
            reading_limits.begin(path)
            with nullcontext() if drawable() else saying(f"{path.name}: converting"):
                for target in _each(path, profile, out, done):
                    done.logs.append(target)
        except BaseException as error:  # one bad source never ends the others; a panic, too
            done.refused[str(path)] = _why(error, path.name)
    reading_limits.end()
    return done


def draft(path: Path, vessel: str | None = None) -> str:
    """TOML text of a profile for a log, a table, or what first has to become a log."""
    reading_limits.begin(path)
    with saying(f"{path.name}: drafting"), packed.unpacked(path) as source:
        if not path.exists() or is_log(source):
            return draft_log(source, vessel)
        if not (is_bag(source) or is_signalk(source) or is_nmea(source) or source.is_dir()):
            foreign_files.refuse(source)
            if not is_table(source):
                foreign_files.refuse_binary(source, source.name)
            return draft_table(source, vessel)
        found = look_into(source) if source.is_dir() and not is_bag(source) else Folder()
        if found.trips:
            log.info(
                "%s: %d tables of the same columns, a voyage each; drafted from %s. `convert` "
                "takes the folder with the profile", path.name, len(found.trips),
                found.trips[0].name,
            )  # fmt: skip
            return draft_table(found.trips[0], vessel)
        with files.temporary_folder() as folder:
            done = Converted()
            times = dict([found.clock] if found.clock else [])
            (target,) = _each(source, None, folder, done, times)
            text = draft_log(target, vessel)
        for what in done.lost.values():
            log.warning("%s: left out: %s", path.name, what)
        return recognised(text, path, tuple(done.lost.values())) + clock_section(found.clock)


@contextmanager
def as_logs(path: Path, profile: Profile | None, done: Converted) -> Iterator[list[Path]]:
    """A log itself; of what `convert` takes the logs that it makes, for the time of the block."""
    if not path.exists() or is_log(path):
        yield [path]
        return
    with packed.unpacked(path) as source:
        if is_log(source) or not _convertible(source, profile):
            yield [source]
            return
        with files.temporary_folder() as folder:
            yield list(_each(source, profile, folder, done))


def _convertible(path: Path, profile: Profile | None) -> bool:
    """Whether logs can be made of it; the reader of logs says what is wrong with the others."""
    if path.is_dir():
        return is_bag(path) or holds_tables(path) or any(map(is_nmea, path.glob("[!.]*")))
    return (
        is_bag(path)
        or is_signalk(path)
        or is_nmea(path)
        or (profile is not None and not is_foreign(path))
    )


def is_log(path: Path) -> bool:
    """Whether a file is an MCAP log, by its name or by its content."""
    if path.suffix.lower() == MCAP:
        return not path.is_dir()
    return path.is_file() and begins_as_log(path)


def _each(
    path: Path, profile: Profile | None, out: Path, done: Converted,
    times: Mapping[str, Column] | None = None,
) -> Iterator[Path]:  # fmt: skip
    check_there(path, "a table, NMEA 0183 text, a ROS bag, or a folder of one table per topic")
    with packed.unpacked(path) as source:
        yield from _of_source(source, path, profile, out, done, times)


def _of_source(
    path: Path, given: Path, profile: Profile | None, out: Path, done: Converted,
    times: Mapping[str, Column] | None,
) -> Iterator[Path]:  # fmt: skip
    """The logs of a file or folder; `given` is what it was unpacked from, or itself."""
    called = path.stem if path.is_file() else Path(os.path.abspath(path)).name  # of `.`, too
    ship = profile.ship.name if profile else called
    target = out / f"{called}.mcap"
    if is_bag(path):
        refuse_existing(target)
        target.parent.mkdir(parents=True, exist_ok=True)
        if lost := bag_to_log(path, target, ship):
            done.lost[str(given)] = "; ".join(lost)
        log.info("%s written", target.name)
        yield target
    elif path.is_dir() and profile is not None and (trips := look_into(path).trips):
        for table in trips:
            yield from _each(table, profile, out, done)
    elif path.is_dir():
        folder = read_folder(path, profile, times)
        lost = [counted(folder.damaged, "damaged sentence") + "."] if folder.damaged else []
        if lost := [*lost, *folder.left_out]:
            done.lost[str(given)] = " ".join(lost)
        found = [*folder.findings, *columns.dropped(folder.left_out)]
        yield _written(target, folder.series, profile, ship, given, found)
    elif is_log(path):
        refuse_log(path, given)
        refuse_existing(target)
        target.parent.mkdir(parents=True, exist_ok=True)
        with files.whole(target) as partial:
            shutil.copyfile(path, partial)
        yield target
    elif is_signalk(path) or is_nmea(path):
        text = read_signalk(path) if is_signalk(path) else read_nmea_log([path], path.name)
        if text.damaged:
            done.lost[str(given)] = counted(text.damaged, "damaged sentence")
        yield _written(target, text.series, profile, ship, given, text.findings)
    else:
        foreign_files.refuse(path)
        if not is_table(path):
            foreign_files.refuse_binary(path, path.name)
        yield from _of_table(path, given, columns.required(profile, given), out, done)


def _of_table(
    path: Path, given: Path, profile: Profile, out: Path, done: Converted
) -> Iterator[Path]:
    """A log for each voyage of a table."""
    voyages, lost = columns.voyages(read_table(path, profile.table), profile, path)
    if lost:
        done.lost[str(given)] = ", ".join(lost)
    begun: set[str] = set()
    ship = profile.ship.name
    for name, part, found in voyages:
        try:  # one bad voyage never ends the others
            refuse_namesake(name, begun, path)
            series = columns.series(part, profile)
            found = [*found, *columns.dropped(lost)]
            target = _written(out / f"{name}.mcap", series, profile, ship, given, found)
        except BaseException as error:
            where = str(given) if name == path.stem else f"{given}: {name}"
            done.refused[where] = _why(error, f"{path.name}: {name}")
            continue
        yield target


def _why(error: BaseException, doing: str) -> str:
    return str(error if isinstance(error, ShiplogError) else unexpected(error, doing))


def _written(
    target: Path,
    parts: list[Series],
    profile: Profile | None,
    ship: str,
    source: Path,
    findings: Sequence[Finding] = (),
) -> Path:
    refuse_existing(target)
    datum = profile.site.datum if profile else None
    target.parent.mkdir(parents=True, exist_ok=True)
    notes = {"table": source.name}
    write_log(target, parts, ship=ship, datum=datum, notes=notes, findings=findings)
    log.info(
        "%s: %d topics, %d rows",
        target.name,
        len(parts),
        max((len(p.time) for p in parts), default=0),
    )
    return target
