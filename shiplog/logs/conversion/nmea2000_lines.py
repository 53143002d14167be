"""The notations in which NMEA 2000 is logged as text: lines to messages.

A line is one frame of the bus, as candump and YDWG write it, or one whole message, as canboat,
Actisense and iKonvert do. Messages longer than eight bytes come as fast packets: byte 0 is a
counter (3 bits) and the number of the frame (5 bits), byte 1 of the first frame the length.
Sources: can-utils, candump.c; canboat, `common/parse.c`; Yacht Devices, YDWG manual, appendix E;
Actisense, NMEA 2000 ASCII output format; Digital Yacht, iKonvert serial protocol.
"""

from __future__ import annotations

import base64
import binascii
import re
from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import pairwise

import numpy as np

from shiplog.nomenclature.units import SECOND_NS

HEX = "[0-9A-Fa-f]"
DAY_NS, IKONVERT_NS = 86_400 * SECOND_NS, 1_000 * SECOND_NS
LEAST_UNIX_S = 100_000_000  # seconds since 1970; what is less counts from the start of a log
PDU2 = 240  # PDU formats from there on are to all, and the next byte is a part of the PGN


@dataclass(frozen=True, slots=True)
class Frame:
    """One line: its stamp in the notation's own clock [ns], -1 without one."""

    stamp: int
    pgn: int
    source: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Notation:
    """A way to write the bus.

    name     what wrote it
    line     a line of it matches from its beginning
    read     the frame of a match; None where it is none of NMEA 2000. Raises ValueError
    wraps_ns after which its stamps begin again; 0 where they do not
    frames   whether each line is a frame of the bus, and not a whole message
    """

    name: str
    line: re.Pattern[str]
    read: Callable[[re.Match[str]], Frame | None]
    wraps_ns: int = 0
    frames: bool = True


@dataclass(slots=True)
class Rows:
    """The messages of one kind and sender: which line, stamp, and payloads of `width` bytes."""

    width: int
    place: array = field(default_factory=lambda: array("q"))
    stamp: array = field(default_factory=lambda: array("q"))
    payload: bytearray = field(default_factory=bytearray)

    def add(self, place: int, stamp: int, data: bytes) -> None:
        self.place.append(place)
        self.stamp.append(stamp)
        self.payload += data[: self.width].ljust(self.width, b"\xff")  # what is not sent is none

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(place [n], stamp [n] ns, payload [n, width])."""
        raw = np.frombuffer(bytes(self.payload), np.uint8).reshape(-1, self.width)
        return np.array(self.place, np.int64), np.array(self.stamp, np.int64), raw


@dataclass
class Bus:
    """What the lines of a log hold of the kinds that were asked for.

    rows      by PGN and source address
    others    how many messages of other kinds
    damaged   lines that are of the notation and cannot be read; incomplete: fast packets
    """

    notation: Notation
    rows: dict[tuple[int, int], Rows] = field(default_factory=dict)
    others: Counter[int] = field(default_factory=Counter)
    damaged: int = 0
    incomplete: int = 0
    lines: int = 0


def notation_of(lines: Iterable[str], share: float) -> Notation | None:
    """The notation that at least a `share` of the lines are in; comments do not count."""
    counts: Counter[str] = Counter()
    filled = 0
    for line in lines:
        text = line.strip()
        if not text or text.startswith(("#", "$PDGY")):
            continue
        filled += 1
        counts.update(one.name for one in NOTATIONS if one.line.match(text))
    if not filled or not counts:
        return None
    best = max(NOTATIONS, key=lambda one: counts[one.name])
    return best if counts[best.name] >= share * filled else None


def read_lines(
    lines: Iterable[str], notation: Notation, widths: dict[int, int], fast: frozenset[int],
    deltas: bool = False,
) -> Bus:  # fmt: skip
    """The messages of a log.

    widths  PGN → bytes of a message that are kept; others are only counted
    fast    PGNs that are sent as fast packets
    deltas  stamps count from the line before
    """
    bus = Bus(notation)
    joined, total = _Joined(), 0
    match, read, rows = notation.line.match, notation.read, bus.rows
    for place, line in enumerate(lines):
        found = match(line.strip())
        if found is None:
            bus.damaged += _is_damaged(line)
            continue
        try:
            frame = read(found)
        except ValueError:
            bus.damaged += 1
            continue
        if frame is None:
            continue
        pgn, data, stamp = frame.pgn, frame.data, frame.stamp
        if deltas:
            stamp = total = total + stamp
        width = widths.get(pgn)
        if width is None:
            bus.others[pgn] += 1
            continue
        if pgn in fast and (notation.frames or len(data) <= 8):
            whole = joined.add((pgn, frame.source), place, stamp, data)
            if whole is None:
                continue
            place, stamp, data = whole
        key = pgn, frame.source
        if key not in rows:
            rows[key] = Rows(width)
        rows[key].add(place, stamp, data)
    bus.lines = place + 1 if rows or bus.others else 0
    bus.incomplete = joined.broken
    return bus


def counts_from_the_line_before(lines: Iterable[str], notation: Notation) -> bool:
    """Whether stamps are the time since the last line, as of candump -td: small and unordered."""
    stamps = []
    for line in lines:
        if found := notation.line.match(line.strip()):
            frame = notation.read(found)
            stamps += [frame.stamp] if frame else []
    small = bool(stamps) and 0 <= max(stamps) < LEAST_UNIX_S * SECOND_NS
    return small and not notation.wraps_ns and any(b < a for a, b in pairwise(stamps))


def _is_damaged(line: str) -> bool:
    """Whether a line that is in no notation is more than a comment or a status."""
    text = line.strip()
    return bool(text) and not text.startswith(("#", "$", "//", ";"))


class _Joined:
    """Fast packets that are being received, by kind, sender and counter."""

    def __init__(self) -> None:
        self.begun: dict[tuple[int, int, int], tuple[int, int, int, int, bytes]] = {}
        self.broken = 0

    def add(
        self, key: tuple[int, int], place: int, stamp: int, data: bytes
    ) -> tuple[int, int, bytes] | None:
        """Place and stamp of the first frame, and the payload, once it is whole."""
        if not data:
            return None
        counter, number = data[0] >> 5, data[0] & 31
        of = (*key, counter)
        if number == 0:
            self.broken += of in self.begun
            if len(data) < 2:
                return None
            self.begun[of] = (1, data[1], place, stamp, data[2:])
        elif of in self.begun:
            expected, length, place, stamp, before = self.begun[of]
            if number != expected:
                del self.begun[of]
                self.broken += 1
                return None
            self.begun[of] = (number + 1, length, place, stamp, before + data[1:])
        else:
            return None
        _, length, place, stamp, payload = self.begun[of]
        if len(payload) < length:
            return None
        del self.begun[of]
        return place, stamp, payload[:length]


def parted(identifier: int) -> tuple[int, int]:
    """(PGN, source address) of a CAN identifier of 29 bits, ISO 11783-3."""
    formatted, specific = identifier >> 16 & 0xFF, identifier >> 8 & 0xFF
    pgn = (identifier >> 24 & 3) << 16 | formatted << 8
    return (pgn | specific if formatted >= PDU2 else pgn), identifier & 0xFF


_KNOWN: dict[str, tuple[int, int]] = {}


def _of_identifier(text: str) -> tuple[int, int]:
    found = _KNOWN.get(text)
    if found is None:
        found = _KNOWN[text] = parted(int(text, 16) & 0x1FFFFFFF)
    return found


def decimal_ns(text: str) -> int:
    """Seconds in decimals as whole ns."""
    whole, _, part = text.partition(".")
    return int(whole) * SECOND_NS + int(part[:9].ljust(9, "0"))


def _clock_ns(hours: str, minutes: str, seconds: str) -> int:
    return (int(hours) * 60 + int(minutes)) * 60 * SECOND_NS + decimal_ns(seconds)


def _candump(found: re.Match[str]) -> Frame:
    """`(1502979132.106111) can0 18EEFF01#05A0BE1C00A0A0C0`, of candump -L."""
    pgn, source = _of_identifier(found[2])
    return Frame(decimal_ns(found[1]), pgn, source, bytes.fromhex(found[3]))


def _candump_screen(found: re.Match[str]) -> Frame:
    """` (1436509053.850870)  can0  09F8027F   [8]  00 FC 10 3B FF 7F FF FC`, the stamp optional."""
    pgn, source = _of_identifier(found[2])
    stamp = -1
    if text := found[1]:
        stamp = _date_ns(text) if "-" in text else decimal_ns(text)
    return Frame(stamp, pgn, source, bytes.fromhex(found[4])[: int(found[3])])


def _canboat(found: re.Match[str]) -> Frame:
    """`2016-02-28T19:57:02.364Z,2,127250,7,255,8,ff,10,3b,ff,7f,ce,f5,fc`."""
    data = bytes.fromhex(found[5].replace(",", ""))
    if len(data) != int(found[4]):
        raise ValueError("not as long as it says")
    return Frame(_date_ns(found[1]), int(found[2]), int(found[3]), data)


def _ydwg(found: re.Match[str]) -> Frame:
    """`17:33:21.107 R 19F51323 01 2F 30 70 00 2F 30 70`; T is what the gateway itself sent."""
    pgn, source = _of_identifier(found[4])
    stamp = _clock_ns(found[1], found[2], found[3]) if found[1] else -1
    return Frame(stamp, pgn, source, bytes.fromhex(found[5]))


def _actisense(found: re.Match[str]) -> Frame:
    """`A173321.107 23FF7 1F513 012F3070002F3070`: source, destination and priority, then PGN."""
    stamp = _clock_ns(found[1], found[2], found[3]) if found[1] else -1
    return Frame(stamp, int(found[5], 16), int(found[4][:2], 16), bytes.fromhex(found[6]))


def _ikonvert(found: re.Match[str]) -> Frame:
    """`!PDGY,127257,3,17,255,0.563,AP9/UgAh/v8=`: the timer counts to 1000 s."""
    try:
        data = base64.b64decode(found[4] + "=" * (-len(found[4]) % 4), validate=True)
    except binascii.Error as error:
        raise ValueError(str(error)) from error
    return Frame(decimal_ns(found[3]), int(found[1]), int(found[2]), data)


def _date_ns(text: str) -> int:
    """ISO in UTC, with T, a space or a hyphen between date and time of day."""
    day, clock = text[:10], text[11:].removesuffix("Z").replace(",", ".")
    when = datetime.fromisoformat(day).replace(tzinfo=UTC)
    hours, minutes, seconds = clock.split(":")
    return int(when.timestamp()) * SECOND_NS + _clock_ns(hours, minutes, seconds)


def _pattern(text: str) -> re.Pattern[str]:
    return re.compile(text.replace("H", HEX))


NOTATIONS = (
    Notation("candump -L", _pattern(r"\((\d+\.\d+)\)\s+\S+\s+(H{8})#((?:HH){0,8})(?:\s+[RT])?$"),
             _candump),
    Notation("candump", _pattern(r"(?:\(\s*([\d\-: .]+)\)\s+)?(?:\S+\s+(?:[RT]X\s+-\s+-\s+)?|<0x)"
                                 r"(H{8})>?\s+\[(\d)\]((?:\s+HH)+)(?:\s+'.*')?$"),
             _candump_screen),
    Notation("canboat", _pattern(
        r"(\d{4}-\d\d-\d\d[T-]\d\d:\d\d:\d\d(?:[.,]\d+)?Z?),\d+,(\d+),(\d+),\d+,(\d+)((?:,HH)+)$"),
        _canboat, frames=False),
    Notation("YDWG", _pattern(r"(?:(\d\d):(\d\d):(\d\d\.\d+)\s+[RT]\s+)?(H{8})((?:\s+HH)+)$"),
             _ydwg, DAY_NS),
    Notation("Actisense", _pattern(
        r"(?:A(\d\d)(\d\d)(\d\d\.\d+)\s+)?(H{5})\s+(H{5,6})\s+((?:HH)+)$"),
             _actisense, DAY_NS, frames=False),
    Notation("iKonvert", _pattern(r"!PDGY,(\d+),\d*,(\d+),\d*,(\d+(?:\.\d+)?),([A-Za-z0-9+/]+=*)$"),
             _ikonvert, IKONVERT_NS, frames=False),
)  # fmt: skip


def lines_of(stream: Iterable[str]) -> Iterator[str]:
    """Lines without the byte order mark and NULs that some loggers leave."""
    for line in stream:
        yield line.lstrip("\ufeff\0") if line[:1] in ("\ufeff", "\0") else line
