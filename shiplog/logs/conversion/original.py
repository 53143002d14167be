"""What becomes logs, and what a format of it is."""

from __future__ import annotations

import logging
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from shiplog.exceptions import ShiplogError
from shiplog.logs.conversion.write import Series, refuse_existing, write_log
from shiplog.logs.health.health_report import Finding
from shiplog.machine import files
from shiplog.machine.unexpected import unexpected
from shiplog.ship_profile.profile import Column, Profile

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Original:
    """A file or folder to make logs of.

    path     where it can be read
    given    what it was unpacked from, or itself
    profile  says what a table's columns are; the other formats do without
    out      folder of the logs
    refused  file or voyage → why it is no log; to be added to
    lost     file → what of it is in no log; to be added to
    times    column → how it counts, of topics without a Unix time
    """

    path: Path
    given: Path
    profile: Profile | None
    out: Path
    refused: dict[str, str]
    lost: dict[str, str]
    times: Mapping[str, Column] | None = None

    @property
    def name(self) -> str:
        """Of the log."""
        return self.path.stem if self.path.is_file() else Path(os.path.abspath(self.path)).name

    @property
    def ship(self) -> str:
        return self.profile.ship.name if self.profile else self.name

    def place(self, name: str | None = None) -> Path:
        """Where the log goes, of this name if one is given. Raises ShiplogError where one is."""
        target = self.out / f"{name or self.name}.mcap"
        refuse_existing(target)
        target.parent.mkdir(parents=True, exist_ok=True)
        return target

    def copied(self) -> Path:
        """The file itself as the log."""
        target = self.place()
        with files.whole(target) as partial:
            shutil.copyfile(self.path, partial)
        return target

    def written(
        self, parts: list[Series], findings: Sequence[Finding] = (), name: str | None = None
    ) -> Path:
        """A log of these topics."""
        target = self.place(name)
        datum = self.profile.site.datum if self.profile else None
        notes = {"table": self.given.name}
        write_log(target, parts, ship=self.ship, datum=datum, notes=notes, findings=findings)
        rows = max((len(part.time) for part in parts), default=0)
        log.info("%s: %d topics, %d rows", target.name, len(parts), rows)
        return target


@dataclass(frozen=True)
class Format:
    """A kind of file or folder that becomes logs.

    name   in the help of `convert`
    takes  whether it is the one for a path, where no format before it is
    logs   writes the logs of an original
    sure   whether logs can be made of a path that `takes` accepts, as far as a look says; and with
           a profile or without. Unless given, always
    voyage whether each file is a voyage by itself: a folder stands for all such files in it
    table  whether a profile has to say what its columns are
    """

    name: str
    takes: Callable[[Path], bool]
    logs: Callable[[Original], Iterator[Path]]
    sure: Callable[[Path, Profile | None], bool] = lambda path, profile: True
    voyage: bool = False
    table: bool = False


def why(error: BaseException, doing: str) -> str:
    """Why something is refused, for a user."""
    return str(error if isinstance(error, ShiplogError) else unexpected(error, doing))
