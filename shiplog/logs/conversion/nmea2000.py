"""NMEA 2000 logs in the notations of candump, canboat, YDWG, Actisense and iKonvert.

Lines become messages (`nmea2000_lines`), their fields numbers (`nmea2000_fields`), the recorder's
stamps UTC (`nmea2000_clock`), and each sender of a kind a topic (`nmea2000_topics`).
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

from shiplog.exceptions import ChannelMissing
from shiplog.logs.conversion.nmea2000_clock import clock_of
from shiplog.logs.conversion.nmea2000_fields import FAST, MESSAGES, NAMES, WIDTHS
from shiplog.logs.conversion.nmea2000_lines import (
    Bus,
    Notation,
    counts_from_the_line_before,
    lines_of,
    notation_of,
    read_lines,
    states_messages,
)
from shiplog.logs.conversion.nmea2000_topics import topics_of
from shiplog.logs.conversion.original import Format
from shiplog.logs.conversion.recordings import Recording, one_log
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.numbers import counted

log = logging.getLogger(__name__)

LOOKED_AT_BYTES, LOOKED_AT_LINES = 65_536, 200
LINE_SHARE = 0.5  # of the first lines, that make a text such a log
RECORD = {
    "position": "129029 or 129025",
    "heading": "127250",
    "actuators": "127245 (rudder), 127488 (engine) and 127493 (gear)",
}
MOST_NAMED = 8


def is_nmea2000(path: Path) -> bool:
    """Whether a text is such a log, whatever it is called."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        start = stream.read(LOOKED_AT_BYTES)
    if b"\0" in start[:1024].lstrip(b"\0"):
        return False
    first = _first(lines_of(start.decode("latin-1").splitlines()))
    notation = notation_of(first, LINE_SHARE)
    return notation is not None and states_messages(first, notation, LINE_SHARE)


def read_nmea2000(path: Path) -> Recording:
    """The topics of a log. Raises ChannelMissing where it says nothing of a ship."""
    with path.open("r", encoding="latin-1") as stream:
        first = _first(lines_of(stream))
    notation = notation_of(first, 0.0)
    assert notation is not None, path.name
    with path.open("r", encoding="latin-1") as stream:
        return read_bus_lines(lines_of(stream), path.name, notation, first)


def read_bus_lines(
    lines: Iterable[str], name: str, notation: Notation, first: list[str]
) -> Recording:
    """The topics of lines in one notation. Raises ChannelMissing."""
    deltas = counts_from_the_line_before(first, notation)
    bus = read_lines(lines, notation, WIDTHS, FAST, deltas)
    if not bus.rows:
        raise ChannelMissing(
            f"{name} holds no message of NMEA 2000 that says how a ship moves. Messages found: "
            f"{_named(bus)}.",
            hint="log " + ", ".join(f"{pgn} ({NAMES[pgn]})" for pgn in MESSAGES) + ".",
        )
    clock = clock_of(bus, name)
    series, findings = topics_of(bus, clock)
    if not series:
        found = ", ".join(f"{pgn} ({NAMES[pgn]})" for pgn in sorted({pgn for pgn, _ in bus.rows}))
        raise ChannelMissing(
            f"{name} holds no value of a ship's motion: of {found} every one says that it is not "
            "available.",
            hint="log while the instruments are on.",
        )
    if bus.others:
        log.info("%s: messages not used: %s", name, _named(bus))
    findings = clock.findings + findings + _damage(bus)
    for finding in findings:
        log.warning("%s: %s", name, finding.sentence)
    lost = [counted(bus.damaged, "damaged line") + "."] if bus.damaged else []
    return Recording(series, findings, lost, RECORD)


FORMAT = Format("NMEA 2000 logs", is_nmea2000, one_log(read_nmea2000), voyage=True)


def _first(lines: Iterable[str]) -> list[str]:
    return list(islice(_filled(lines), LOOKED_AT_LINES))


def _filled(lines: Iterable[str]) -> Iterator[str]:
    return (line for line in lines if line.strip())


def _named(bus: Bus) -> str:
    named = ", ".join(
        f"{pgn}{' ' + NAMES[pgn] if pgn in NAMES else ''} ({count})"
        for pgn, count in bus.others.most_common(MOST_NAMED)
    )
    more = len(bus.others) - MOST_NAMED
    return (named or "none") + (f" and {more} more" if more > 0 else "")


def _damage(bus: Bus) -> list[Finding]:
    found = []
    if bus.damaged:
        sentence = f"{counted(bus.damaged, 'damaged line')} of {bus.lines} left out."
        found.append(Finding("dropped", "log", sentence, value=float(bus.damaged)))
    if bus.incomplete:
        sentence = (
            f"{counted(bus.incomplete, 'message')} of several frames left out: a frame is missing."
        )
        found.append(Finding("dropped", "log", sentence, value=float(bus.incomplete)))
    return found
