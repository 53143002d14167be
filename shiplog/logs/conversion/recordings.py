"""What a recorder's own file comes to, on its way to a log; and the library that reads it."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

from shiplog.exceptions import ShiplogError
from shiplog.logs.conversion.original import Original
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding

ALL = "recorders"  # the extra that brings every library
NOT_THERE = {  # what can be done without it
    "position": "No position is in the log: its messages can be checked, and no voyage made of it.",
    "heading": "No heading is in the log: its messages can be checked, and no voyage made of it, "
    "since a course over ground is none.",
    "actuators": "No actuator is in the log: it can be ingested and its sensors compared, and no "
    "model trained.",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Recording:
    """The topics of one file.

    lost    what of the file is in no topic, a sentence each: the exit code is 3 then
    record  what this recorder has to log for a position, a heading and actuators
    """

    series: list[Series]
    findings: list[Finding] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    record: Mapping[str, str] = field(default_factory=dict)


def one_log(read: Callable[[Path], Recording]) -> Callable[[Original], Iterator[Path]]:
    """The one log of a file that `read` reads."""

    def logs(original: Original) -> Iterator[Path]:
        found = read(original.path)
        if found.lost:
            original.lost[str(original.given)] = " ".join(found.lost)
        yield original.written(found.series, [*found.findings, *absent(found)])

    return logs


def absent(found: Recording) -> list[Finding]:
    """What a ship's model needs and the file does not hold: what can be done, what to record."""
    holds = {
        "position": any({"latitude", "x0_m"} & set(one.columns) for one in found.series),
        "heading": any("heading" in name for one in found.series for name in one.columns),
        "actuators": any("actuator" in one.metadata for one in found.series),
    }
    return [
        Finding("not_available", what, f"{NOT_THERE[what]} Log {found.record[what]}.")
        for what, there in holds.items() if not there and what in found.record
    ]  # fmt: skip


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
