"""A folder of one NMEA 0183 text per instrument, as research ships record them, is one log.

Texts with receive stamps are read together, in the order of the stamps: an instrument without UTC
has its clock from the others. A text without stamps stands for itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from shiplog.exceptions import ChannelMissing, ShiplogError
from shiplog.logs.conversion.columns import dropped, named_apart
from shiplog.logs.conversion.nmea import NmeaLog, is_nmea, read_nmea_log
from shiplog.logs.conversion.nmea_lines import SENTENCE, Stamps
from shiplog.logs.conversion.nmea_receivers import fills
from shiplog.logs.conversion.original import Format, Original
from shiplog.logs.conversion.topics import folder_to_series, holds_tables
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.numbers import counted
from shiplog.ship_profile.profile import Column, Profile

LOOKED_AT = 50  # lines of a text, that say whether it has stamps
HEADERS = ("sentence", "nmea")  # a table's column of sentences has stamps of its own


@dataclass(slots=True)
class FolderLog:
    """What a folder came to."""

    series: list[Series] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)  # reasons
    findings: list[Finding] = field(default_factory=list)
    damaged: int = 0


def read_folder(
    folder: Path, profile: Profile | None, times: Mapping[str, Column] | None = None
) -> FolderLog:
    """The topics of a folder's tables and NMEA texts. Raises ChannelMissing where there is none."""
    texts = [path for path in sorted(folder.glob("[!.]*")) if is_nmea(path) and not _table(path)]
    done = FolderLog()
    stamped = [path for path in texts if _has_stamps(path)]
    groups = [stamped] if stamped else []
    groups += [[path] for path in texts if path not in stamped]
    for group in groups:
        try:
            _add(done, read_nmea_log(group, group[0].name if len(group) == 1 else folder.name))
        except ShiplogError as error:
            done.left_out.append(error.message)
    try:
        tables, reasons = folder_to_series(folder, profile, texts, times)
        done.left_out += reasons
        done.series += [replace(one, topic=_free(one.topic, done.series)) for one in tables]
    except ChannelMissing:
        if not done.series and not texts:
            raise
    if not done.series:
        raise ChannelMissing(
            f"{folder} holds no topic. {' '.join(done.left_out)}",
            hint="record RMC with the other sentences, or have the logger stamp each line.",
        )
    done.series = named_apart(done.series)
    return done


def _logs(original: Original) -> Iterator[Path]:
    folder = read_folder(original.path, original.profile, original.times)
    lost = [counted(folder.damaged, "damaged sentence") + "."] if folder.damaged else []
    if lost := [*lost, *folder.left_out]:
        original.lost[str(original.given)] = " ".join(lost)
    yield original.written(folder.series, [*folder.findings, *dropped(folder.left_out)])


FORMAT = Format(
    "folders of one of them per topic or instrument", Path.is_dir, _logs,
    sure=lambda path, profile: holds_tables(path) or any(map(is_nmea, path.glob("[!.]*"))),
)  # fmt: skip


def _add(done: FolderLog, found: NmeaLog) -> None:
    """Join the topics of one more text: what follows the same one goes on, else it is another."""
    done.findings += found.findings
    done.damaged += found.damaged
    for one in found.series:
        for k, before in enumerate(done.series):
            same = before.topic == one.topic and tuple(before.columns) == tuple(one.columns)
            if same and fills(before.time, one.time):
                done.series[k] = _joined(before, one)
                break
        else:
            done.series.append(replace(one, topic=_free(one.topic, done.series)))


def _joined(one: Series, other: Series) -> Series:
    columns = {
        name: np.concatenate((one.columns[name], other.columns[name])) for name in one.columns
    }
    logged = [s.time if s.log_time is None else s.log_time for s in (one, other)]
    time = np.concatenate((one.time, other.time))
    return replace(one, time=time, columns=columns, log_time=np.concatenate(logged))


def _free(topic: str, series: Iterable[Series]) -> str:
    taken = {one.topic for one in series}
    number, name = 2, topic
    while name in taken:
        name, number = f"{topic}_{number}", number + 1
    return name


def _lines(path: Path) -> list[str]:
    with path.open("r", encoding="latin-1") as stream:
        return [line for line, _ in zip(stream, range(LOOKED_AT), strict=False)]


def _has_stamps(path: Path) -> bool:
    stamps, stamped, count = Stamps(), 0, 0
    for line in _lines(path):
        if found := SENTENCE.search(line):
            count += 1
            stamped += stamps.read(f"{line[: found.start()]} {line[found.end() :]}") >= 0
    return 2 * stamped > count


def _table(path: Path) -> bool:
    first = next(iter(_lines(path)), "").lower()
    return not SENTENCE.search(first.upper()) and any(name in first for name in HEADERS)
