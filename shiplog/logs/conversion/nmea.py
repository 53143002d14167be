"""NMEA 0183 text to topics of the contract, with the clock that its lines leave open.

A sentence has its own time only where it carries UTC (RMC, GGA, GLL). The others take the receive
stamp of their line, or without one a place between the UTC times before and after them.
"""

from __future__ import annotations

import logging
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime
from pathlib import Path

import numpy as np
import pynmea2

from shiplog.exceptions import ChannelMissing, listed
from shiplog.logs.conversion.clock import DAY_NS
from shiplog.logs.conversion.nmea_sentences import (
    INSTEAD,
    SENTENCE_TOPICS,
    SENTENCES,
    NotValid,
    facts,
    family,
)
from shiplog.logs.conversion.receive_clock import against_utc
from shiplog.logs.faults import as_metadata
from shiplog.logs.write import Series
from shiplog.units import SECOND_NS, UNIX_NS, unix_unit

log = logging.getLogger(__name__)

SUFFIXES = (".nmea", ".txt", ".log", ".nma", ".gps", ".csv", ".dat", ".raw")
SENTENCE = re.compile(r"[$!][A-Z]{2}[A-Z]{3},[^$!\r\n*]*(?:\*[0-9A-Fa-f]{2})?")
ISO = re.compile(r"(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d:\d\d)(?:[.,](\d+))?(Z|[+-]\d\d:?\d\d)?")
PROPRIETARY = re.compile(r"\$(P[A-Z0-9]{3,}),")  # a maker's own, after his three letters
NUMBER = re.compile(r"(?<!\d)(\d{10,19})(?:\.(\d+))?(?!\d)")
OF_DAY = re.compile(r"(?<![\d:])(\d\d):(\d\d):(\d\d)(?:[.,](\d+))?")
SENTENCE_SHARE = 0.5  # share of the first lines with a sentence that make a text an NMEA log
EPOCH = date(1970, 1, 1)
LAST_YEAR = 2261  # whose nanoseconds since 1970 still have 64 bits


@dataclass(slots=True)
class Rows:
    """The sentences of one topic and talker; times in ns, -1 where there is none."""

    kind: str  # of nmea_sentences.SENTENCE_TOPICS
    own: list[int] = field(default_factory=list)  # UTC in the sentence
    received: list[int] = field(default_factory=list)
    place: list[int] = field(default_factory=list)  # which sentence of the file it was
    values: list[tuple[float, ...]] = field(default_factory=list)


def is_nmea(path: Path) -> bool:
    """Whether the text holds NMEA sentences, whatever it is called."""
    if not path.is_file() or path.suffix.lower() not in SUFFIXES:
        return False
    with path.open("rb") as stream:
        lines = stream.read(16_384).decode("latin-1").splitlines()[:100]
    filled = [line for line in lines if line.strip()]
    sentences = sum(bool(SENTENCE.search(line)) for line in filled)
    return bool(filled) and sentences >= SENTENCE_SHARE * len(filled)


def read_nmea(path: Path) -> tuple[list[Series], int]:
    """An NMEA log as topics, and how many of its sentences were damaged.

    Raises ChannelMissing where no sentence says anything of a ship, or none has a time.
    """
    reader = _Reader()
    with path.open("r", encoding="latin-1") as stream:
        for line in stream:
            reader.take(line)
    return reader.finish(path.name), reader.damaged


def lines_to_series(lines: Iterable[str], name: str, received: Sequence[int]) -> list[Series]:
    """Sentences with the recorder's time [ns] of each, as topics. Raises ChannelMissing."""
    reader = _Reader()
    for line, stamp in zip(lines, received, strict=True):
        reader.take(line, stamp)
    return reader.finish(name)


class _Reader:
    """Sentences one after the other, with the date and the UTC that hold so far."""

    def __init__(self) -> None:
        self.rows: dict[tuple[str, str], Rows] = {}  # by topic and talker
        self.utc: list[tuple[int, int]] = []  # (place, ns) of each new UTC
        self.last: int | None = None  # ns, the UTC before
        self.dated: tuple[int, int] | None = None  # place of the first date, and what it adds
        self.of_day: int | None = None  # ns, the last receive stamp that had no date
        self.damaged = self.invalid = self.place = 0
        self.unused: Counter[str] = Counter()

    def take(self, line: str, received: int | None = None) -> None:
        """One line: its receive stamp, and the sentences in it."""
        found = list(SENTENCE.finditer(line))
        if not found:
            own = PROPRIETARY.search(line)
            self.unused.update([own[1]] if own else [])
            self.damaged += "$" in line and own is None
            return
        if received is None:
            received = self._stamp(line[: found[0].start()] + " " + line[found[-1].end() :])
        for match in found:
            self.place += 1
            self._sentence(match.group().strip(), -1 if received is None else received)

    def _sentence(self, text: str, received: int) -> None:
        kind = text[3:6]
        if text[0] == "!" or kind not in (*SENTENCES, "ZDA"):
            self.unused[kind] += 1
            return
        try:
            message = pynmea2.parse(text, check="*" in text)
            decoded = facts(message)  # first: a sentence that is not valid moves no clock
            own = self._own(message)
        except NotValid:
            self.invalid += 1
            return
        except (pynmea2.ParseError, ValueError, TypeError, AttributeError, ArithmeticError):
            self.damaged += 1  # a field that is no number raises whatever its converter raises
            return
        for topic, values in decoded or ():
            rows = self.rows.setdefault((topic, message.talker), Rows(topic))
            rows.own.append(own)
            rows.received.append(received)
            rows.place.append(self.place)
            rows.values.append(values)

    def _own(self, message) -> int:
        """The UTC in a sentence [ns], -1 in one without. Raises ValueError for a date of no log."""
        time = getattr(message, "timestamp", None)
        if not time or isinstance(time, str):
            return -1
        of_day = ((time.hour * 60 + time.minute) * 60 + time.second) * SECOND_NS
        of_day += time.microsecond * 1000
        utc = of_day + (self._day_before(of_day) * DAY_NS)
        day = None
        if message.sentence_type == "RMC":
            day = message.datestamp
        elif message.sentence_type == "ZDA":
            day = date(message.year, message.month, message.day)
        if isinstance(day, date):
            if not EPOCH.year <= day.year <= LAST_YEAR:
                raise ValueError(f"the year {day.year}")
            true = (day - EPOCH).days * DAY_NS + of_day
            if self.dated is None:
                self.dated = self.place, true - utc
            utc = true
        self.last = utc
        if not self.utc or self.utc[-1][1] != utc:
            self.utc.append((self.place, utc))
        return utc

    def _day_before(self, of_day: int) -> int:
        """The day that a time without a date belongs to: the nearest to the last one."""
        if self.last is None:
            return 0
        day, before = divmod(self.last, DAY_NS)
        return day + (of_day < before - DAY_NS // 2) - (of_day > before + DAY_NS // 2)

    def _stamp(self, around: str) -> int | None:
        """The receive stamp [ns] in the text around the sentence; None without one, or where it is
        no time: a leap second, or a damaged digit."""
        if iso := ISO.search(around):
            zone = (iso[4] or "Z").replace("Z", "+00:00")
            try:
                whole = datetime.fromisoformat(f"{iso[1]}T{iso[2]}{zone}").astimezone(UTC)
            except (ValueError, OverflowError):
                return None
            if not EPOCH.year <= whole.year <= LAST_YEAR:
                return None
            return int(whole.timestamp()) * SECOND_NS + _fraction(iso[3])
        if (number := NUMBER.search(around)) and (unit := unix_unit(int(number[1]))):
            scale = UNIX_NS[unit]
            return int(number[1]) * scale + _fraction(number[2]) * scale // SECOND_NS
        if clock := OF_DAY.search(around):
            seconds = (int(clock[1]) * 60 + int(clock[2])) * 60 + int(clock[3])
            of_day = seconds * SECOND_NS + _fraction(clock[4])
            day = 0
            if self.of_day is not None:  # counts on by itself: the GNSS date is added at the end
                day, before = divmod(self.of_day, DAY_NS)
                day += of_day < before - DAY_NS // 2
            self.of_day = day * DAY_NS + of_day
            return self.of_day
        return None

    def finish(self, name: str) -> list[Series]:
        """The topics. Raises ChannelMissing where there is none, or no time at all."""
        topics = self._chosen(name)
        if not topics:
            raise ChannelMissing(
                f"{name} holds no valid sentence of position, heading, wind or actuators. "
                f"Sentences found: {listed(self.unused)}.",
                hint="record RMC, GGA, HDT, ROT, MWV, RSA or RPM.",
            )
        for count, what in (
            (self.damaged, "damaged sentences (checksum or fields) left out"),
            (self.invalid, "sentences left out whose own status says that they are not valid"),
        ):
            if count:
                log.warning("%s: %d %s", name, count, what)
        if self.unused:
            most = ", ".join(f"{kind} ({n})" for kind, n in self.unused.most_common(8))
            log.info("%s: sentences not used: %s", name, most)
        clock = _Clock(self, topics, name)
        made = [clock.series(topic, rows) for topic, rows in sorted(topics.items())]
        noted = as_metadata(clock.clock.findings)
        return [replace(made[0], metadata={**made[0].metadata, **noted}), *made[1:]]

    def _chosen(self, name: str) -> dict[str, Rows]:
        """By topic: the best sentence for position and velocity; two talkers are two topics."""
        there = {kind for kind, _ in self.rows}
        wanted = {kind: kind for kind in there if kind.startswith("/")}
        if "/rudder/port" not in there:  # RSA calls the only rudder the starboard one
            wanted |= dict.fromkeys(there & {"/rudder/starboard"}, "/rudder/main")
        for topic, kinds in INSTEAD.items():
            best = [kind for kind in kinds if kind in there][:1]
            wanted |= dict.fromkeys(best, topic)
        topics: dict[str, Rows] = {}
        for (kind, talker), rows in self.rows.items():
            if kind not in wanted:
                continue
            topic = wanted[kind]
            if sum(other == kind for other, _ in self.rows) > 1:
                topic = f"{topic}/{talker.lower()}"
                log.info("%s: several talkers send one sentence; %s is of %s", name, topic, talker)
            topics[topic] = rows
        return topics


class _Clock:
    """The times of a file's sentences, once all of it is read."""

    def __init__(self, reader: _Reader, topics: dict[str, Rows], name: str) -> None:
        until, added = reader.dated or (0, 0)
        self.until, self.added = until, added
        self.places = np.array([place for place, _ in reader.utc], np.int64)
        self.utc = np.array([utc for _, utc in reader.utc], np.int64)
        self.utc[self.places < until] += added
        self.name = name
        if reader.utc and reader.dated is None:
            log.warning("%s: no RMC or ZDA says the date; times count from 1970-01-01", name)
        self.days = 0
        place, own, received, kind = self._lines(list(topics.values()))
        both = (own >= 0) & (received >= 0)
        if reader.of_day is not None and both.any():  # stamps without a date: the day is made good
            days = np.median((received - own)[both]) / DAY_NS
            self.days = round(days) * DAY_NS
            received = np.where(received >= 0, received - self.days, -1)
        self.clock = against_utc(received, own, kind)
        self.wrong = dict(zip(place.tolist(), self.clock.wrong.tolist(), strict=True))
        for finding in self.clock.findings:
            log.warning("%s: %s", name, finding.sentence)

    def _lines(self, rows: list[Rows]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Place, UTC, receive stamp and topic [n] of the sentences, in the order of the file."""
        place = np.concatenate([np.array(one.place, np.int64) for one in rows])
        own = np.concatenate([self.own(one) for one in rows])
        received = np.concatenate([np.array(one.received, np.int64) for one in rows])
        kind = np.repeat(np.arange(len(rows)), [len(one.place) for one in rows])
        _, first = np.unique(place, return_index=True)
        return place[first], own[first], received[first], kind[first]

    def own(self, rows: Rows) -> np.ndarray:
        """UTC [n] ns of sentences, those before the first date put onto its day; -1 is none."""
        own = np.array(rows.own, np.int64)
        return own + self.added * ((np.array(rows.place) < self.until) & (own >= 0))

    def series(self, topic: str, rows: Rows) -> Series:
        """One topic with its times. Raises ChannelMissing where nothing says any."""
        place, own = np.array(rows.place, np.int64), self.own(rows)
        received = np.array(rows.received, np.int64)
        stamped = received >= 0
        received = received - self.days * stamped
        if not len(self.utc) and not stamped.any():
            raise ChannelMissing(
                f"{self.name} has no time: neither RMC, GGA or ZDA nor a stamp before each line.",
                hint="record RMC with the other sentences, or have the logger stamp each line.",
            )
        wrong = np.array([self.wrong[one] for one in rows.place], np.int64)
        time = np.where(own >= 0, own, np.where(stamped, received - wrong, self._between(place)))
        known = time >= 0
        schema, names = SENTENCE_TOPICS[family(rows.kind)]
        values = np.array(rows.values, float).reshape(len(place), -1)[known]
        columns = dict(zip(names, values.T, strict=False))
        logged = np.where(stamped, received - wrong, time)[known]
        return Series(topic, schema, time[known], columns, log_time=logged, frame_id="nmea")

    def _between(self, place: np.ndarray) -> np.ndarray:
        """Times [n] ns of the sentences at `place` [n]: spread evenly over the time from the UTC
        before them to the next. -1 before the first UTC."""
        if not len(self.utc):
            return np.full(len(place), -1, np.int64)
        before = np.searchsorted(self.places, place, side="right") - 1
        period = int(np.median(np.diff(self.utc))) if len(self.utc) > 1 else 0
        step = np.diff(self.utc, append=self.utc[-1] + period)
        first = np.searchsorted(before, before, side="left")  # `before` only grows
        many = np.searchsorted(before, before, side="right") - first
        spread = self.utc[before] + step[before] * (np.arange(len(place)) - first) // many
        return np.where(before >= 0, spread, -1)


def _fraction(digits: str | None) -> int:
    """ns of the digits behind a decimal point."""
    return int((digits or "")[:9].ljust(9, "0"))
