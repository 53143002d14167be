"""What a recorder's own file comes to, on its way to a log; and the library that reads it."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

from shiplog.exceptions import ShiplogError
from shiplog.logs.conversion.original import Original
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding

ALL = "recorders"  # the extra that brings every library


@dataclass(frozen=True, slots=True)
class Recording:
    """The topics of one file.

    lost   what of the file is in no topic, a sentence each: the exit code is 3 then
    """

    series: list[Series]
    findings: list[Finding] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)


def one_log(read: Callable[[Path], Recording]) -> Callable[[Original], Iterator[Path]]:
    """The one log of a file that `read` reads."""

    def logs(original: Original) -> Iterator[Path]:
        found = read(original.path)
        if found.lost:
            original.lost[str(original.given)] = " ".join(found.lost)
        yield original.written(found.series, found.findings)

    return logs


class LibraryMissing(ShiplogError):
    """A format needs a library that was not installed."""

    def __init__(self, file: str, what: str, library: str, extra: str) -> None:
        super().__init__(
            f"{file} is {what}, and {library}, which reads it, is not installed.",
            hint=f"pip install 'shiplog[{extra}]' brings it, and 'shiplog[{ALL}]' those of all "
            "recorders.",
        )


def library(module: str, extra: str, path: Path, what: str) -> ModuleType:
    """The module of a library that reads `path`, imported here and nowhere at the top of a file.

    extra  the extra of shiplog that brings it
    what   the file is, such as "a MAVLink telemetry log"

    Raises LibraryMissing.
    """
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise LibraryMissing(path.name, what, module.partition(".")[0], extra) from error
