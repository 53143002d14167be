"""Lines of NMEA 0183 text: what a logger wrote before each sentence, and whether it is whole.

A sentence is `$` or `!`, two characters of its talker, three of its kind, fields, and `*` with the
exclusive or of all characters between as two hexadecimal digits (NMEA 0183, 5.2.3). Some talkers
leave out a leading zero of it, old ones send none at all.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from datetime import UTC, date, datetime
from functools import reduce
from operator import xor

from shiplog.logs.conversion.clock import DAY_NS
from shiplog.nomenclature.units import SECOND_NS, UNIX_NS, unix_unit

SENTENCE = re.compile(
    r"[$!]([A-Z0-9]{2})([A-Z]{3}),([^$!\r\n*\\]*)(?:\*([0-9A-Fa-f]{1,2}))?"
)  # talker, kind, fields, checksum
HEADLESS = re.compile(r"^[^$!]*,[^$!]*\*[0-9A-Fa-f]{2}\s*$")  # its beginning was lost
PROPRIETARY = re.compile(r"\$(P[A-Z0-9]{3,}),")  # a maker's own, after his three letters
ISO = re.compile(
    r"(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d:\d\d)(?:[.,](\d+))?(?: ?(Z|UTC|[+-]\d\d:?\d\d))?"
)
YEAR_DAY = re.compile(r"(\d{4})[:+](\d{3}):(\d\d):(\d\d):(\d\d)(?:[.,](\d+))?")  # of the year
NUMBER = re.compile(r"(?<!\d)(\d{10,19})(?:\.(\d+))?(?!\d)")
OF_DAY = re.compile(r"(?<![\d:])(\d\d):(\d\d):(\d\d)(?:[.,](\d+))?")
NAMED = re.compile(r"^\s*([A-Za-z][\w.-]*)[\s,;:]")  # the recorder's name of an instrument
TAGGED = re.compile(r"\\[^\\]*\bs:([^,*\\]+)")  # source in a tag block (NMEA 0183, 7.9)
EPOCH = date(1970, 1, 1)
LAST_YEAR = 2261  # whose nanoseconds since 1970 still have 64 bits
SENDS_CHECKSUMS = 0.5  # share of a talker's sentences with one from which on those without are cut
OWN_DEVICE = 10  # sentences of one kind, none with a checksum: a device that sends none
RENAMED, RENAMED_SHARE = 20, 0.9  # sentences of a kind with checksums wrong in the same bits
RARE_TALKER = 10  # sentences; of fewer nothing says what the talker does


@dataclass(frozen=True, slots=True)
class Sentence:
    """One sentence of a line."""

    talker: str
    kind: str
    fields: list[str]
    source: str  # the recorder's name of the instrument, or ""
    received: int  # ns, by the recorder's clock; -1 where the line has no stamp
    vouched: bool  # its checksum is there, and right
    wrong: int  # bits in which its checksum is wrong
    own_ship: bool  # `!`: encapsulated, as of AIS
    length: int  # characters on the line


class Stamps:
    """Receive stamps of one file: those without a date go on counting past midnight."""

    def __init__(self) -> None:
        self.of_day: int | None = None  # ns, the last stamp that had no date

    def read(self, around: str) -> int:
        """The receive stamp [ns] in the text around a sentence; -1 without one, or where it is no
        time: a leap second, or a damaged digit."""
        if len(around) < 8:  # the shortest is 10:11:12
            return -1
        if iso := ISO.search(around):
            zone = (iso[4] or "Z").replace("Z", "+00:00").replace("UTC", "+00:00")
            try:
                whole = datetime.fromisoformat(f"{iso[1]}T{iso[2]}{zone}").astimezone(UTC)
            except (ValueError, OverflowError):
                return -1
            if not EPOCH.year <= whole.year <= LAST_YEAR:
                return -1
            return int(whole.timestamp()) * SECOND_NS + _fraction(iso[3])
        if (number := NUMBER.search(around)) and (unit := unix_unit(int(number[1]))):
            scale = UNIX_NS[unit]
            return int(number[1]) * scale + _fraction(number[2]) * scale // SECOND_NS
        if day := YEAR_DAY.search(around):
            year, count, *clock = map(int, day.groups()[:5])
            if not (EPOCH.year <= year <= LAST_YEAR and 1 <= count <= 366):
                return -1
            days = (date(year, 1, 1) - EPOCH).days + count - 1
            return days * DAY_NS + _seconds(*clock) + _fraction(day[6])
        if clock := OF_DAY.search(around):
            of_day = _seconds(*map(int, clock.groups()[:3])) + _fraction(clock[4])
            day = 0
            if self.of_day is not None:  # counts on by itself: the GNSS date is added at the end
                day, before = divmod(self.of_day, DAY_NS)
                day += of_day < before - DAY_NS // 2
            self.of_day = day * DAY_NS + of_day
            return self.of_day
        return -1


def _seconds(hours: int, minutes: int, seconds: int) -> int:
    return ((hours * 60 + minutes) * 60 + seconds) * SECOND_NS


def _fraction(digits: str | None) -> int:
    """ns of the digits behind a decimal point."""
    return int((digits or "")[:9].ljust(9, "0"))


class Lines:
    """The sentences of lines one after the other, and the count of those that are damaged."""

    def __init__(self, source: str = "") -> None:
        """source   of all lines, where their file is of one instrument"""
        self.stamps, self.source = Stamps(), source
        self.damaged = 0
        self.unused: Counter[str] = Counter()  # a maker's own, by his letters

    def accept(self, line: str, received: int | None = None) -> list[Sentence]:
        """The sentences of a line whose checksums do not speak against them.

        received  ns, where the recorder's time is known otherwise than by the line
        """
        found = list(SENTENCE.finditer(line))
        if not found:
            own = PROPRIETARY.search(line)
            self.unused.update([own[1]] if own else [])
            if own is None and ("$" in line or HEADLESS.match(line)):
                self.damaged += 1
            return []
        before, source = line[: found[0].start()], self.source
        if received is None:
            received = self.stamps.read(f"{before} {line[found[-1].end() :]}")
        if before and (named := TAGGED.search(before) or NAMED.match(before)):
            source = f"{source} {named[1]}" if source else named[1]
        sentences = []
        for match in found:
            talker, kind, body, check = match.groups()
            if talker[0] == "P":  # five letters of a maker, as PASHR
                self.unused[talker + kind] += 1
                continue
            wrong = 0
            if check is not None:
                characters = match[0][1 : match.start(4) - match.start() - 1]
                wrong = reduce(xor, characters.encode("latin-1", "replace")) ^ int(check, 16)
            fields = body.split(",")
            if " " in body or "\t" in body:
                fields = [field.strip() for field in fields]
            sentences.append(Sentence(
                talker, kind, fields, source, received, check is not None and not wrong, wrong,
                match[0][0] == "!", len(match[0]),
            ))  # fmt: skip
        return sentences


class Checksums:
    """Who sends checksums, so that a sentence without one is known to be cut."""

    def __init__(self) -> None:
        self.sent: Counter[tuple[str, str]] = Counter()  # by talker and kind
        self.bare: dict[tuple[str, str], list[int]] = {}  # places of sentences without one
        self.wrong: dict[tuple[str, str], list[tuple[int, int]]] = {}  # bits and place
        self.renamed: dict[tuple[str, str], int] = {}  # sentences by talker and kind

    def note(self, sentence: Sentence, place: int) -> None:
        key = (sentence.talker, sentence.kind)
        if sentence.wrong:
            self.wrong.setdefault(key, []).append((sentence.wrong, place))
        elif sentence.vouched:
            self.sent[key] += 1
        else:
            self.bare.setdefault(key, []).append(place)

    def cut(self) -> list[int]:
        """Places of the sentences that are damaged: their checksum is wrong, or was lost with more.

        A talker that sends checksums sends them always: a sentence without one was cut. Only a
        kind that never has one is a device of its own under the same letters.
        """
        cut = self._wrong()
        sent: Counter[str] = Counter()
        bare: Counter[str] = Counter()
        for (talker, _), count in self.sent.items():
            sent[talker] += count
        for (talker, _), places in self.bare.items():
            bare[talker] += len(places)
        everywhere = sent.total() > SENDS_CHECKSUMS * (sent.total() + bare.total())
        for (talker, kind), places in self.bare.items():
            of_kind = self.sent[talker, kind]
            if of_kind == 0 and len(places) >= OWN_DEVICE:
                continue
            sends = sent[talker] >= SENDS_CHECKSUMS * (sent[talker] + bare[talker])
            unknown = sent[talker] == 0 and bare[talker] < RARE_TALKER
            if sends or of_kind >= len(places) or (unknown and everywhere):
                cut += places
        return cut

    def _wrong(self) -> list[int]:
        """Places of the sentences with a wrong checksum.

        Damage is never twice the same. Checksums that are wrong in the same bits throughout are of
        a multiplexer that renamed the talker and left them as they were: those are whole.
        """
        cut: list[int] = []
        for key, wrong in self.wrong.items():
            (bits, count), *_ = Counter(bits for bits, _ in wrong).most_common(1)
            if count >= RENAMED and count >= RENAMED_SHARE * (len(wrong) + self.sent[key]):
                self.sent[key] += count
                self.renamed[key] = count
            else:
                bits = 0
            cut += [place for other, place in wrong if other != bits]
        return cut
