"""Recorders' files, tables, NMEA 0183 text and ROS bags to MCAP logs of the contract."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from shiplog.commands.bars import drawable, tracked
from shiplog.drafting import draft as draft_log
from shiplog.drafting import draft_table
from shiplog.drafting.folders import Folder, clock_section, look_into, recognised
from shiplog.logs.conversion import formats, packed, table_rows
from shiplog.logs.conversion.bags import bags_once, is_bag
from shiplog.logs.conversion.copies import is_log
from shiplog.logs.conversion.heartbeat import saying
from shiplog.logs.conversion.original import Original, why
from shiplog.machine import files, reading_limits
from shiplog.machine.paths import check_file, check_there, refuse_taken
from shiplog.nomenclature.contract import CONTRACT
from shiplog.nomenclature.numbers import counted
from shiplog.report.result import Printed
from shiplog.ship_profile.profile import Column, Profile
from shiplog.ship_profile.unchecked_lines import unchecked_lines

log = logging.getLogger(__name__)


@dataclass(frozen=True, repr=False)
class Converted(Printed):
    """The logs that were written, what was refused, and what of the others was lost."""

    logs: list[Path] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)
    lost: dict[str, str] = field(default_factory=dict)
    out: Path | None = None

    def __repr__(self) -> str:
        made = counted(len(self.logs), "log")
        return f"Converted({made} in {str(self.out)!r}, {len(self.refused)} refused)"

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
            done.refused[str(path)] = why(error, path.name)
    reading_limits.end()
    return done


@dataclass(frozen=True, repr=False)
class Draft(Printed):
    """A ship profile that was drafted: `toml` is its text, `written` the file that holds it."""

    toml: str
    written: Path | None = None

    def __repr__(self) -> str:
        where = "not written" if self.written is None else str(self.written)
        return f"Draft({counted(len(self.unchecked), 'key')} to check; {where})"

    @property
    def unchecked(self) -> tuple[str, ...]:
        """Keys whose line says CHECK, such as `ship.length_m`: a person has to look them over."""
        return unchecked_lines(self.toml)

    @property
    def lines(self) -> list[str]:
        """The draft itself; once it is written, where."""
        if self.written is None:
            return [self.toml]
        return [f"draft written to {self.written}: look over every line that says CHECK"]

    @property
    def json(self) -> dict:
        written = None if self.written is None else str(self.written)
        return {"contract": CONTRACT, "profile": self.toml, "written": written}


def draft_profile(path: Path, out: Path | None = None, vessel: str | None = None) -> Draft:
    """Draft a profile, and write it to `out` where a path is given. Raises ShiplogError."""
    if out is not None:
        refuse_taken(out)
        out = check_file(out, "--out")
    (toml,) = [draft(one, vessel) for one in tracked([path], "drafting")]
    if out is not None:
        files.write_text(out, toml)
    return Draft(toml, out)


def draft(path: Path, vessel: str | None = None) -> str:
    """TOML text of a profile for a log, a table, or what first has to become a log."""
    reading_limits.begin(path)
    said = nullcontext() if drawable() else saying(f"{path.name}: drafting")
    with said, packed.unpacked(path) as source:
        if not path.exists() or is_log(source):
            return draft_log(source, vessel)
        if formats.recognise(source).table:
            table_rows.refuse_others(source)
            return draft_table(source, vessel)
        if recorded := _recorded(source):
            log.info("%s: drafted from %s", path.name, recorded[0].name)
            return draft(recorded[0], vessel)
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
            text = draft_log(target, vessel, path.name)
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
        if is_log(source) or not formats.convertible(source, profile):
            yield [source]
            return
        with files.temporary_folder() as folder:
            yield list(_each(source, profile, folder, done))


def _each(
    path: Path, profile: Profile | None, out: Path, done: Converted,
    times: Mapping[str, Column] | None = None,
) -> Iterator[Path]:  # fmt: skip
    check_there(path, "a recorder's file, a table, a ROS bag, or a folder of one table per topic")
    with packed.unpacked(path) as source:
        if recorded := _recorded(source):
            for file in recorded:
                yield from _each(file, profile, out, done)
            return
        tables = profile is not None and source.is_dir() and not is_bag(source)
        trips = look_into(source).trips if tables else ()
        for table in trips:
            yield from _each(table, profile, out, done)
        if not trips:
            one = Original(source, path, profile, out, done.refused, done.lost, times)
            yield from formats.recognise(source).logs(one)


def _recorded(source: Path) -> list[Path]:
    """The recorders' files of a folder, each a voyage."""
    return formats.voyages_in(source) if source.is_dir() and not is_bag(source) else []
