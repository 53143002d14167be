"""NMEA 0183 text to topics of the contract, with findings of what its sentences say of themselves.

Lines become sentences (`nmea_lines`), sentences facts (`nmea_sentences`); what a talker, its
receivers and clocks are shows only in the whole file (`nmea_receivers`, `nmea_utc`, `nmea_clock`).
"""

from __future__ import annotations

import heapq
import logging
from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

import numpy as np

from shiplog.exceptions import ChannelMissing, listed
from shiplog.logs.conversion import nmea_report as report
from shiplog.logs.conversion import nmea_status
from shiplog.logs.conversion.nmea_ais import vdo
from shiplog.logs.conversion.nmea_clock import clock_of
from shiplog.logs.conversion.nmea_lines import (
    EPOCH,
    LAST_YEAR,
    SENTENCE,
    Checksums,
    Lines,
    Sentence,
)
from shiplog.logs.conversion.nmea_sentences import SENTENCES, TIME_AT
from shiplog.logs.conversion.nmea_topics import Gathered, Rows, Spoken, topics_of
from shiplog.logs.conversion.nmea_utc import Resolved, Times, kept, resolve
from shiplog.logs.conversion.original import Format, Original
from shiplog.logs.conversion.write import Series
from shiplog.logs.health.health_report import Finding
from shiplog.nomenclature.numbers import counted
from shiplog.nomenclature.units import SECOND_NS

log = logging.getLogger(__name__)

SENTENCE_SHARE = 0.5  # share of the first lines with a sentence that make a text an NMEA log
LOOKED_AT_BYTES, LOOKED_AT_LINES = 65_536, 200
FIRST_YEARS = 80  # two digits of a year from there on are of the last century
USED = frozenset({*SENTENCES, "ZDA"})
READ = {**SENTENCES, "VDO": vdo}


@dataclass(frozen=True, slots=True)
class NmeaLog:
    """What a text of NMEA came to."""

    series: list[Series]
    damaged: int  # sentences
    findings: list[Finding] = field(default_factory=list)


def is_nmea(path: Path) -> bool:
    """Whether a text holds NMEA sentences, whatever it is called."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        start = stream.read(LOOKED_AT_BYTES)
    if b"\0" in start[:1024]:
        return False
    lines = start.decode("latin-1").splitlines()[:LOOKED_AT_LINES]
    filled = [line for line in lines if line.strip()]
    sentences = sum(bool(SENTENCE.search(line)) for line in filled)
    return bool(filled) and sentences >= SENTENCE_SHARE * len(filled)


def read_nmea_log(paths: Sequence[Path], name: str) -> NmeaLog:
    """One log of a text, or of several that one recorder wrote, an instrument each.

    Raises ChannelMissing where no sentence says anything of a ship, or none has a time."""
    if len(paths) == 1:
        return read_sentences(_text(paths[0]), name)
    reader = _Reader()
    files = [(Lines(path.stem), path) for path in paths]
    merged = heapq.merge(*(_stamped(*one) for one in files), key=lambda item: item[0])
    for _, sentence in merged:
        reader.take(sentence)
    return reader.finish(name, [lines for lines, _ in files])


def lines_to_series(lines: Iterable[str], name: str, received: Sequence[int]) -> list[Series]:
    """Sentences with the recorder's time [ns] of each, as topics. Raises ChannelMissing."""
    reader, read = _Reader(), Lines()
    for line, stamp in zip(lines, received, strict=True):
        for sentence in read.accept(line, stamp):
            reader.take(sentence)
    return reader.finish(name, [read]).series


def read_sentences(lines: Iterable[str], name: str) -> NmeaLog:
    """The same of lines. Raises ChannelMissing."""
    reader, read = _Reader(), Lines()
    for line in lines:
        for sentence in read.accept(line):
            reader.take(sentence)
    return reader.finish(name, [read])


def text_to_logs(read: Callable[[Path], NmeaLog]) -> Callable[[Original], Iterator[Path]]:
    """The one log of a text that `read` reads."""

    def logs(original: Original) -> Iterator[Path]:
        text = read(original.path)
        if text.damaged:
            original.lost[str(original.given)] = counted(text.damaged, "damaged sentence")
        yield original.written(text.series, text.findings)

    return logs


FORMAT = Format(
    "NMEA 0183 text", is_nmea, text_to_logs(lambda path: read_nmea_log([path], path.name))
)


def _text(path: Path) -> Iterator[str]:
    with path.open("r", encoding="latin-1") as stream:
        yield from stream


def _stamped(lines: Lines, path: Path) -> Iterator[tuple[int, Sentence]]:
    """The sentences of a file, each with the last receive stamp before it [ns]."""
    last = -1
    for line in _text(path):
        for sentence in lines.accept(line):
            last = max(last, sentence.received)
            yield last, sentence


class _Reader:
    """Sentences one after the other, as the facts that they are."""

    def __init__(self) -> None:
        self.gathered = Gathered()
        self.times, self.checksums = Times(), Checksums()
        self.received, self.length = array("q"), array("i")  # of each sentence, by its place
        self.senders: dict[tuple[str, str], int] = {}  # talker and source, in order of appearance
        self.damaged = 0
        self.unused: Counter[str] = Counter()

    def take(self, sentence: Sentence) -> None:
        kind = sentence.kind
        if kind not in USED and not (kind == "VDO" and sentence.own_ship):
            self.unused[kind] += 1
            self.damaged += sentence.wrong != 0
            return
        place = len(self.received)
        form = len(sentence.fields)
        try:
            facts = [] if kind == "ZDA" else list(READ[kind](sentence.fields, sentence.vouched))
            of_day = self._of_day(sentence)
            day = _day(sentence)
        except (ValueError, IndexError):
            self.damaged += 1  # a field that is no number, or is not there
            return
        sender = self.senders.setdefault((sentence.talker, sentence.source), len(self.senders))
        self.checksums.note(sentence, place)
        self.received.append(sentence.received)
        self.length.append(sentence.length)
        for topic, values, why_not in facts:
            rows = self.gathered.rows.get((topic, sender))
            if rows is None:
                rows = self.gathered.rows[topic, sender] = Rows(topic)
            if why_not:
                rows.why_not[len(rows.place)] = why_not
            rows.place.append(place)
            rows.values.append(values)
        if of_day >= 0:
            self.times.place.append(place)
            self.times.of_day.append(of_day)
            self.times.day.append(day)
            self.times.trusted.append(not (facts and facts[0].why_not))
            self.times.sender.append(sender)
            digits = sum(len(field) for field in sentence.fields[:3])
            self.gathered.form.append(form * 1000 + digits)

    def _of_day(self, sentence: Sentence) -> int:
        """The UTC in a sentence [ns of its day], -1 without. Raises ValueError."""
        at = TIME_AT.get(sentence.kind, -1)
        text = sentence.fields[at] if 0 <= at < len(sentence.fields) else ""
        if not text:
            return -1
        if len(text) < 6 or not (text[:6].isdecimal() and text[6:7] in ("", ".")):
            raise ValueError(text)
        hours, minutes, seconds = int(text[:2]), int(text[2:4]), int(text[4:6])
        if hours > 23 or minutes > 59 or seconds > 60 or not (text[7:] or "0").isdecimal():
            raise ValueError(text)
        whole = ((hours * 60 + minutes) * 60 + seconds) * SECOND_NS
        return whole + int(text[7:16].ljust(9, "0"))

    def finish(self, name: str, lines: Sequence[Lines]) -> NmeaLog:
        """The topics. Raises ChannelMissing where there is none, or no time at all."""
        cut = self.checksums.cut()
        for read in lines:
            self.damaged += read.damaged
            self.unused += read.unused
        self.damaged += len(cut)
        received = np.array(self.received, np.int64)
        if cut:
            self._drop(np.array(cut), len(received))
        resolved = resolve(self.times, received)
        self._not_valid_where_still(resolved)
        if not self.gathered.valid():
            raise ChannelMissing(
                f"{name} holds no valid sentence of position, heading, wind or actuators. "
                f"Sentences found: {listed(self.unused)}.{self._why_none()}",
                hint="record RMC, GGA, HDT, HDG, ROT, MWV, RSA or RPM.",
            )
        dateless = any(read.stamps.of_day is not None for read in lines)
        instruments = [np.array(rows.place, np.int64) for rows in self.gathered.rows.values()]
        clock = clock_of(resolved, received, np.array(self.length, np.int64), instruments, dateless)
        if not len(clock.known) and not (received >= 0).any():
            raise ChannelMissing(
                f"{name} has no time: neither RMC, GGA or ZDA nor a stamp before each line."
                + (f" {self.damaged} sentences are damaged." if self.damaged else ""),
                hint="record RMC with the other sentences, or have the logger stamp each line.",
            )
        spoken = topics_of(self.gathered, resolved, clock, [*self.senders])
        if not spoken.series:
            raise ChannelMissing(
                f"{name} has no valid sentence with a time.",
                hint="record RMC with the other sentences, or have the logger stamp each line.",
            )
        self._say(name, spoken, len(resolved.place) > 0 and not resolved.dated)
        findings = report.findings(spoken, resolved, clock, [talker for talker, _ in self.senders])
        findings += [report.renamed(*one) for one in self.checksums.renamed.items()]
        if self.damaged:
            findings.insert(0, report.damaged(self.damaged, len(self.received)))
        for finding in findings:
            log.warning("%s: %s", name, finding.sentence)
        return NmeaLog(spoken.series, self.damaged, findings)

    def _drop(self, cut: np.ndarray, count: int) -> None:
        """Leave out the sentences at the places `cut`."""
        gone = np.zeros(count, bool)
        gone[cut] = True
        self.gathered.drop(gone)
        keep = ~gone[np.array(self.times.place, np.int64)]
        self.times = kept(self.times, keep)
        self.gathered.form = array("q", np.array(self.gathered.form)[keep].tolist())

    def _not_valid_where_still(self, resolved: Resolved) -> None:
        """Sentences by a clock that stands still are placeholders, whatever else they say."""
        still = set(resolved.place[resolved.still].tolist())
        for rows in self.gathered.rows.values() if still else ():
            for i, place in enumerate(rows.place):
                if place in still:
                    rows.why_not.setdefault(i, nmea_status.PLACEHOLDER)

    def _why_none(self) -> str:
        words = Counter(w for rows in self.gathered.rows.values() for w in rows.why_not.values())
        said = f" Not valid by their own word: {listed(words)}." if words else ""
        return said + (f" {self.damaged} sentences are damaged." if self.damaged else "")

    def _say(self, name: str, spoken: Spoken, dateless: bool) -> None:
        if dateless:
            log.warning("%s: no RMC or ZDA says the date; times count from 1970-01-01", name)
        if spoken.invalid:
            log.warning(
                "%s: %d sentences whose own status says that they are not valid",
                name, spoken.invalid,
            )  # fmt: skip
        if self.unused:
            most = ", ".join(f"{kind} ({n})" for kind, n in self.unused.most_common(8))
            log.info("%s: sentences not used: %s", name, most)
        for what in spoken.notes:
            log.info("%s: %s", name, what)


def _day(sentence: Sentence) -> int:
    """Days since 1970 of the date in RMC and ZDA, -1 without one. Raises ValueError."""
    fields = sentence.fields
    if sentence.kind == "RMC":
        text = fields[8]
        if not text:
            return -1
        if len(text) != 6 or not text.isdecimal():
            raise ValueError(text)
        return (date(_year(text[4:]), int(text[2:4]), int(text[:2])) - EPOCH).days
    if sentence.kind == "ZDA" and len(fields) > 3 and all(fields[1:4]):
        year = _year(fields[3])
        if not EPOCH.year <= year <= LAST_YEAR:
            raise ValueError(f"the year {year}")
        return (date(year, int(fields[2]), int(fields[1])) - EPOCH).days
    return -1


def _year(text: str) -> int:
    """Two digits are of this century, or of the last decades before it."""
    year = int(text)
    return year if year > 99 else year + (1900 if year >= FIRST_YEARS else 2000)
