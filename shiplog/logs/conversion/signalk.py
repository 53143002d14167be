"""The log of a Signal K server: deltas as JSON lines, NMEA 0183 and NMEA 2000 between them.

A delta holds values of paths in SI and radians, by source and time (Signal K 1.7, delta format).
The server's multiplexed log puts Unix milliseconds and a letter before each line: `N` for NMEA
0183, `A` for NMEA 2000 in canboat's notation, others for deltas. What the server made deltas of
stands in the log twice: NMEA 0183 counts before them, and NMEA 2000 only for what neither has.
"""

from __future__ import annotations

import json
import logging
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from shiplog.exceptions import ChannelMissing, listed
from shiplog.logs.conversion.nmea import NmeaLog, read_sentences, text_to_logs
from shiplog.logs.conversion.nmea2000 import read_bus_lines
from shiplog.logs.conversion.nmea2000_lines import notation_of
from shiplog.logs.conversion.nmea_lines import Stamps
from shiplog.logs.conversion.original import Format
from shiplog.logs.conversion.signalk_topics import PREFIXES, Values, topics_of, unread
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding

log = logging.getLogger(__name__)

MULTIPLEXED = re.compile(r"^(\d{10,16});([A-Z]);(.*)$", re.DOTALL)
DELTA = re.compile(r'^\s*\{.*"(updates|self)"')
N2K = re.compile(r"^\d{4}-\d\d-\d\dT[\d:.]+Z?,\d,(\d{5,6}),\d+,\d+,\d+,")
LINE_SHARE = 0.5  # of the first lines, that make a text such a log
LOOKED_AT_BYTES, LOOKED_AT_LINES = 65_536, 200
PGNS = {
    126992: "system time", 127245: "rudder", 127250: "heading", 127251: "rate of turn",
    127257: "attitude", 127258: "magnetic variation", 127488: "engine speed",
    127489: "engine", 127508: "battery", 128259: "speed through water", 128267: "depth",
    129025: "position", 129026: "course and speed over ground", 129029: "GNSS position",
    130306: "wind",
}  # fmt: skip
MOST_NAMED = 6


@dataclass(slots=True)
class _Deltas:
    """The values of the deltas so far, by the ship that they are of."""

    own: str = ""  # what the server calls its ship, where it says so
    ships: dict[str, Values] = field(default_factory=dict)
    damaged: int = 0
    timeless: int = 0
    stamps: Stamps = field(default_factory=Stamps)

    def take(self, text: str, received: int) -> None:
        """One line. `received` ns, -1 without."""
        try:
            delta = json.loads(text)
        except (ValueError, RecursionError):
            self.damaged += 1
            return
        if not isinstance(delta, dict):
            return
        if isinstance(delta.get("self"), str):
            self.own = delta["self"].removeprefix("vessels.")
        ship = str(delta.get("context") or "self").removeprefix("vessels.")
        updates = delta.get("updates")
        for update in updates if isinstance(updates, list) else ():
            if isinstance(update, dict):
                self._update(update, ship, received)

    def _update(self, update: dict, ship: str, received: int) -> None:
        stamp = update.get("timestamp")
        time = self.stamps.read(stamp) if isinstance(stamp, str) else -1
        time = received if time < 0 else time
        source = _source(update)
        values = update.get("values")
        for pair in values if isinstance(values, list) else ():
            path = pair.get("path") if isinstance(pair, dict) else None
            if not isinstance(path, str):
                continue
            if time < 0:
                self.timeless += 1
                continue
            kept = self.ships.setdefault(ship, Values())
            kept.add(path, source, time, received if received >= 0 else time, pair.get("value"))

    def ours(self) -> Values:
        """The own ship's: as the server says, else `self`, else the ship with most values."""
        for name in (self.own, "self"):
            if name in self.ships:
                return self.ships[name]
        return max(self.ships.values(), key=lambda kept: kept.used, default=Values())


def is_signalk(path: Path) -> bool:
    """Whether a text is the log of a Signal K server, whatever it is called."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        start = stream.read(LOOKED_AT_BYTES).decode("utf-8", "replace")
    lines = [line for line in start.splitlines()[:LOOKED_AT_LINES] if line.strip()]
    return bool(lines) and sum(map(_is_known, lines)) >= LINE_SHARE * len(lines)


def _is_known(line: str) -> bool:
    split = MULTIPLEXED.match(line)
    if not split:
        return bool(DELTA.match(line))
    return split[3][:1] in ("$", "!", "{", "\\") or bool(N2K.match(split[3]))


def read_signalk(path: Path, name: str = "") -> NmeaLog:
    """The topics of such a log. Raises ChannelMissing where it says nothing of the ship.

    name   of it in messages; the file's unless given
    """
    name = name or path.name
    deltas, n2k = _Deltas(), Counter[int]()
    nmea, reason = NmeaLog([], 0), ""
    try:
        nmea = read_sentences(_sentences(path, deltas, n2k), name)
    except ChannelMissing as error:  # it has none: the deltas are read all the same
        reason = error.message
    kept = deltas.ours()
    series, findings = topics_of(kept)
    also = _joined(nmea.series, series)
    others = sum(k.used for k in deltas.ships.values()) - kept.used
    _say(name, kept, also, others)
    n2k_findings = _of_bus(path, n2k, nmea.series)
    if not nmea.series:
        said = " ".join((reason, *(finding.sentence for finding in n2k_findings)))
        raise ChannelMissing(
            f"{name} holds no value of the ship that is read. Paths found: "
            f"{listed(kept.paths)}. {said}",
            hint=f"log {listed(PREFIXES)}.",
        )
    findings = [*nmea.findings, *findings, *n2k_findings]
    for finding in findings[len(nmea.findings) :]:
        log.warning("%s: %s", name, finding.sentence)
    return NmeaLog(nmea.series, nmea.damaged + deltas.damaged, findings)


FORMAT = Format("Signal K logs", is_signalk, text_to_logs(read_signalk))


def _source(update: dict) -> str:
    """The source of an update: `$source`, or what its `source` says."""
    if isinstance(update.get("$source"), str):
        return update["$source"]
    source = update.get("source")
    if not isinstance(source, dict):
        return ""
    named = source.get("src") or source.get("talker") or ""
    return ".".join(str(part) for part in (source.get("label"), named) if part)


def _sentences(path: Path, deltas: _Deltas, n2k: Counter[int]) -> Iterator[str]:
    """The lines of NMEA 0183; what else there is goes where it is counted."""
    with path.open("r", encoding="utf-8", errors="replace") as stream:
        for line in stream:
            split = MULTIPLEXED.match(line)
            text = split[3] if split else line
            if text.lstrip().startswith("{"):
                deltas.take(text, deltas.stamps.read(split[1]) if split else -1)
            elif "$" in text or "!" in text:
                yield line
            elif found := N2K.match(text):
                n2k[int(found[1])] += 1


def _joined(series: list[Series], more: list[Series]) -> list[str]:
    """Add the deltas' topics, but for those that NMEA 0183 has: the server makes them of it."""
    there = {"/".join(one.topic.split("/")[:3]) for one in series}
    also = []
    for one in more:
        if "/".join(one.topic.split("/")[:3]) in there:
            also.append(one.topic)
        else:
            series.append(one)
    series.sort(key=lambda one: one.topic)
    return also


def _say(name: str, kept: Values, also: list[str], others: int) -> None:
    rest = unread(kept)
    if rest:
        most = ", ".join(f"{path} ({n})" for path, n in rest.most_common(8))
        log.info("%s: paths not used: %s", name, most)
    if also:
        log.info("%s: in deltas as well as in NMEA 0183, which is used: %s", name, listed(also))
    if others:
        log.info("%s: %d values of other ships are not used", name, others)


def _of_bus(path: Path, n2k: Counter[int], series: list[Series]) -> list[Finding]:
    """Add the topics of NMEA 2000 that neither NMEA 0183 nor a delta has; what was found of them,
    or, where they say nothing of a ship's motion, which messages there are."""
    if not n2k:
        return []
    first = list(islice(_bus_lines(path), LOOKED_AT_LINES))
    notation = notation_of(first, 0.0)
    try:
        assert notation is not None, path.name
        found = read_bus_lines(_bus_lines(path), path.name, notation, first)
    except ChannelMissing:
        return _not_read(n2k)
    if also := _joined(series, found.series):
        log.info("%s: in NMEA 2000 as well, which is not used of: %s", path.name, listed(also))
    return found.findings


def _bus_lines(path: Path) -> Iterator[str]:
    with path.open("r", encoding="utf-8", errors="replace") as stream:
        for line in stream:
            split = MULTIPLEXED.match(line)
            text = (split[3] if split else line).strip()
            if N2K.match(text):
                yield text


def _not_read(n2k: Counter[int]) -> list[Finding]:
    """What of the log is NMEA 2000, by name."""
    named = ", ".join(
        f"{pgn}{' ' + PGNS[pgn] if pgn in PGNS else ''} ({count})"
        for pgn, count in n2k.most_common(MOST_NAMED)
    )
    more = f" and {len(n2k) - MOST_NAMED} more" if len(n2k) > MOST_NAMED else ""
    sentence = (
        f"{n2k.total()} lines of NMEA 2000 are not read, since none says how a ship moves: "
        f"{named}{more}."
    )
    return [Finding("dropped", "log", sentence, value=float(n2k.total()))]
