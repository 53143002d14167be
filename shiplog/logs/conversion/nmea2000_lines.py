"""The notations in which NMEA 2000 is logged as text: lines to messages.

A line is one frame of the bus, as candump and YDWG write it, or one whole message, as canboat,
Actisense and iKonvert do. Messages longer than eight bytes come as fast packets: byte 0 is a
counter (3 bits) and the number of the frame (5 bits), byte 1 of the first frame the length.
Sources: can-utils, candump.c; canboat, `common/parse.c`; Yacht Devices, YDWG manual, appendix E;
Actisense, NMEA 2000 ASCII output format; Digital Yacht, iKonvert serial protocol.
"""

from __future__ import annotations

import re
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, islice, pairwise

import numpy as np
import polars as pl

from shiplog.nomenclature.units import SECOND_NS

BLOCK_LINES = 100_000  # read at once
DAY_NS, IKONVERT_NS = 86_400 * SECOND_NS, 1_000 * SECOND_NS
LEAST_UNIX_S = 100_000_000  # seconds since 1970; what is less counts from the start of a log
PDU2 = 240  # PDU formats from there on are to all, and the next byte is a part of the PGN
PGNS = (59_392, 131_071)  # of NMEA 2000
FRAME_BYTES = 8
COMMENTS = ("#", "$", "//", ";")  # beginnings of lines that are no message, such as a status


@dataclass(frozen=True)
class Notation:
    """A way to write the bus.

    name     what wrote it
    line     pattern of a line. Its groups: day, h, m, s and part (of a second) of a stamp, `id` (a
             CAN identifier) or pgn and src, len (bytes, to be checked), data
    base     of pgn and src; coded: how data are written
    wraps_ns after which its stamps begin again; 0 where they do not
    frames   whether each line is a frame of the bus, and not a whole message
    """

    name: str
    line: str
    base: int = 10
    coded: str = "hex"
    wraps_ns: int = 0
    frames: bool = True

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        return re.compile(self.line)

    def has(self, group: str) -> bool:
        return group in self.pattern.groupindex


def _notation(name: str, line: str, **more) -> Notation:
    return Notation(name, line.replace("H", "[0-9A-Fa-f]"), **more)


NOTATIONS = (
    # (1502979132.106111) can0 18EEFF01#05A0BE1C00A0A0C0
    _notation("candump -L",
              r"^\((?P<s>\d+)\.(?P<part>\d+)\)\s+\S+\s+(?P<id>H{8})#(?P<data>(?:HH){0,8})"
              r"(?:\s+[RT])?\s*$"),
    #  (1436509053.850870)  can0  09F8027F   [8]  00 FC 10 3B FF 7F FF FC; the stamp is optional
    _notation("candump",
              r"^\s*(?:\(\s*(?:(?P<day>\d{4}-\d\d-\d\d)\s+(?P<h>\d\d):(?P<m>\d\d):)?(?P<s>\d+)"
              r"\.(?P<part>\d+)\)\s+)?(?:\S+\s+(?:[RT]X\s+-\s+-\s+)?|<0x)(?P<id>H{8})>?\s+"
              r"\[(?P<len>\d)\](?P<data>(?:\s+HH)+)(?:\s+'.*')?\s*$"),
    # 2016-02-28T19:57:02.364Z,2,127250,7,255,8,ff,10,3b,ff,7f,ce,f5,fc
    _notation("canboat",
              r"^(?P<day>\d{4}-\d\d-\d\d)[T-](?P<h>\d\d):(?P<m>\d\d):(?P<s>\d\d)"
              r"(?:[.,](?P<part>\d+))?Z?,\d+,(?P<pgn>\d+),(?P<src>\d+),\d+,(?P<len>\d+)"
              r"(?P<data>(?:,HH)+)\s*$", frames=False),
    # 17:33:21.107 R 19F51323 01 2F 30 70 00 2F 30 70; T is what the gateway itself sent
    _notation("YDWG",
              r"^(?:(?P<h>\d\d):(?P<m>\d\d):(?P<s>\d\d)\.(?P<part>\d+)\s+[RT]\s+)?(?P<id>H{8})"
              r"(?P<data>(?:\s+HH)+)\s*$", wraps_ns=DAY_NS),
    # A173321.107 23FF7 1F513 012F3070002F3070: source, destination and priority, then the PGN
    _notation("Actisense",
              r"^(?:A(?P<h>\d\d)(?P<m>\d\d)(?P<s>\d\d)\.(?P<part>\d+)\s+)?(?P<src>HH)HHH\s+"
              r"(?P<pgn>H{5,6})\s+(?P<data>(?:HH)+)\s*$", base=16, wraps_ns=DAY_NS, frames=False),
    # !PDGY,127257,3,17,255,0.563,AP9/UgAh/v8=: the timer counts to 1000 s
    _notation("iKonvert",
              r"^!PDGY,(?P<pgn>\d+),\d*,(?P<src>\d+),\d*,(?P<s>\d+)(?:\.(?P<part>\d+))?,"
              r"(?P<data>[A-Za-z0-9+/]*=*)\s*$", coded="base64", wraps_ns=IKONVERT_NS,
              frames=False),
)  # fmt: skip


@dataclass(slots=True)
class Rows:
    """The messages of one kind and sender: which line, stamp, and payloads of `width` bytes."""

    width: int
    place: array = field(default_factory=lambda: array("q"))
    stamp: array = field(default_factory=lambda: array("q"))
    payload: bytearray = field(default_factory=bytearray)

    def add(self, place: Iterable[int], stamp: Iterable[int], data: Iterable[bytes]) -> None:
        """Messages; what of a payload was not sent has no value."""
        self.place.extend(place)
        self.stamp.extend(stamp)
        width = self.width
        self.payload += b"".join(one[:width].ljust(width, b"\xff") for one in data)

    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(place [n], stamp [n] ns or -1, payload [n, width])."""
        raw = np.frombuffer(bytes(self.payload), np.uint8).reshape(-1, self.width)
        return np.array(self.place, np.int64), np.array(self.stamp, np.int64), raw


@dataclass
class Bus:
    """What the lines of a log hold of the kinds that were asked for.

    rows      by PGN and source address
    others    how many messages of other kinds
    damaged   lines that are no comment and cannot be read; incomplete: fast packets
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
        if not line.strip() or line.startswith(COMMENTS):
            continue
        filled += 1
        counts.update(one.name for one in NOTATIONS if one.pattern.match(line))
    if not counts:
        return None
    best = max(NOTATIONS, key=lambda one: counts[one.name])
    return best if counts[best.name] >= share * filled else None


def states_messages(lines: Iterable[str], notation: Notation, share: float) -> bool:
    """Whether lines that have no stamp, such as three whole numbers, are messages at all: by their
    PGNs."""
    table = _parsed(list(lines), notation).filter(pl.col("data").is_not_null())
    known = table.filter((pl.col("stamp") >= 0) | pl.col("pgn").is_between(*PGNS))
    return known.height > 0 and known.height >= share * table.height


def read_lines(
    lines: Iterable[str], notation: Notation, widths: dict[int, int], fast: frozenset[int],
    deltas: bool = False,
) -> Bus:  # fmt: skip
    """The messages of a log.

    widths  PGN → bytes of a message that are kept; others are only counted
    fast    PGNs that are sent as fast packets
    deltas  stamps count from the line before
    """
    bus, joined, elapsed = Bus(notation), _Joined(), 0
    stream = iter(lines)
    while block := list(islice(stream, BLOCK_LINES)):
        found = _parsed(block, notation)
        known = found.filter(pl.col("data").is_not_null())
        bus.damaged += sum(map(_is_damaged, found.filter(pl.col("data").is_null())["line"]))
        known = known.with_columns(pl.col("place") + bus.lines)
        bus.lines += len(block)
        if deltas:
            known = known.with_columns(pl.col("stamp").cum_sum() + elapsed)
            elapsed = known["stamp"][-1] if known.height else elapsed
        wanted = known.filter(pl.col("pgn").is_in(list(widths)))
        counts = known.filter(~pl.col("pgn").is_in(list(widths)))["pgn"].value_counts()
        bus.others.update(dict(counts.iter_rows()))
        _take(bus, wanted, widths, fast, joined)
    bus.incomplete = joined.broken
    return bus


def _take(
    bus: Bus, wanted: pl.DataFrame, widths: dict[int, int], fast: frozenset[int], joined: _Joined
) -> None:
    """Messages of a block into the rows of their kind and sender."""
    for (pgn, source), part in wanted.group_by("pgn", "source", maintain_order=True):
        key = int(pgn), int(source)  # type: ignore[call-overload]
        place, stamp, data = (part[name].to_list() for name in ("place", "stamp", "data"))
        if key[0] in fast:
            whole = [
                one for row in zip(place, stamp, data, strict=True)
                if (one := joined.add(key, *row, frames=bus.notation.frames)) is not None
            ]  # fmt: skip
            if not whole:
                continue
            place, stamp, data = zip(*whole, strict=True)
        bus.rows.setdefault(key, Rows(widths[key[0]])).add(place, stamp, data)


def _parsed(block: list[str], notation: Notation) -> pl.DataFrame:
    """place, line, stamp [ns, -1 without one], pgn, source and data of lines; no data where a line
    is not of the notation."""
    groups = pl.col("line").str.extract_groups(notation.line)
    table = pl.DataFrame({"line": block}).with_row_index("place").with_columns(
        pl.col("place").cast(pl.Int64), groups.alias("of")
    ).unnest("of")  # fmt: skip
    if notation.has("id"):
        number = pl.col("id").str.to_integer(base=16, strict=False)
        formatted, specific = (number // 65536) % 256, (number // 256) % 256
        pgn = (number // 2**24) % 4 * 65536 + formatted * 256
        pgn += pl.when(formatted >= PDU2).then(specific).otherwise(0)
        source = number % 256
    else:
        pgn, source = (
            pl.col(name).str.to_integer(base=notation.base, strict=False) for name in ("pgn", "src")
        )
    if notation.coded == "hex":
        data = pl.col("data").str.replace_all(r"[\s,]+", "").str.decode("hex", strict=False)
    else:
        short = (4 - pl.col("data").str.len_bytes() % 4) % 4
        whole = pl.col("data") + pl.lit("=").repeat_by(short).list.join("")
        data = whole.str.decode("base64", strict=False)
    if notation.has("len"):
        length = pl.col("len").cast(pl.Int64, strict=False)
        data = pl.when(data.bin.size() == length).then(data)
    return table.select(
        "place", "line", _stamp(notation).alias("stamp"), pgn.cast(pl.Int64).alias("pgn"),
        source.cast(pl.Int64).alias("source"), data.alias("data"),
    )  # fmt: skip


def _stamp(notation: Notation) -> pl.Expr:
    """ns of a line's stamp in the clock of its notation; -1 without one."""

    def whole(name: str) -> pl.Expr:
        return pl.col(name).cast(pl.Int64, strict=False)

    part = pl.col("part").str.slice(0, 9).str.pad_end(9, "0").cast(pl.Int64, strict=False)
    stamp = whole("s") * SECOND_NS + part.fill_null(0)
    if notation.has("h"):
        stamp += (whole("h").fill_null(0) * 60 + whole("m").fill_null(0)) * 60 * SECOND_NS
    if notation.has("day"):
        day = pl.col("day").str.to_date("%Y-%m-%d", strict=False).cast(pl.Int64)
        stamp += day.fill_null(0) * DAY_NS
    return stamp.fill_null(-1)


def counts_from_the_line_before(lines: Iterable[str], notation: Notation) -> bool:
    """Whether stamps are the time since the last line, as of candump -td: small and unordered."""
    table = _parsed(list(lines), notation).filter(pl.col("data").is_not_null())
    stamps = table["stamp"].to_list()
    small = bool(stamps) and 0 <= max(stamps) < LEAST_UNIX_S * SECOND_NS
    return small and not notation.wraps_ns and any(b < a for a, b in pairwise(stamps))


def _is_damaged(line: str) -> bool:
    """Whether a line that is in no notation is more than a comment or a status."""
    text = line.strip()
    return bool(text) and not text.startswith(COMMENTS)


class _Joined:
    """Fast packets that are being received, by kind, sender and counter."""

    def __init__(self) -> None:
        self.begun: dict[tuple[int, int, int], tuple[int, int, int, int, bytes]] = {}
        self.broken = 0

    def add(
        self, key: tuple[int, int], place: int, stamp: int, data: bytes, frames: bool
    ) -> tuple[int, int, bytes] | None:
        """Place and stamp of the first frame, and the payload, once it is whole; a line that is no
        frame and longer than one is whole itself."""
        if not frames and len(data) > FRAME_BYTES:
            return place, stamp, data
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


def lines_of(stream: Iterable[str]) -> Iterator[str]:
    """Lines without the byte order mark and NULs before the first one."""
    rest = iter(stream)
    first = next(rest, "")
    return chain((first.lstrip("\ufeff\u00ef\u00bb\u00bf\0"),), rest)
