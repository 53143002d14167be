"""The records of an ArduPilot DataFlash log (.BIN), a numpy table for each kind of message.

The file describes itself: a record FMT gives the number, length, name, format letters and labels of
a kind before it is used, FMTU, UNIT and MULT its units (ArduPilot, libraries/AP_Logger, README.md).
A record is A3 95, the number of its kind, and packed little-endian fields. Where each record ends
the next begins: heads are found by their two bytes, and those to which no record leads are bytes
inside of others.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

HEAD = b"\xa3\x95"
HEAD_BYTES = 3
FMT, FMT_BYTES = 0x80, 89
BLOCK_BYTES = 4 << 20  # read at once
LONGEST = 255  # bytes of a record
FORMATS = {  # letter: numpy type, divisor of the whole number
    "a": ("(32,)<i2", 1.0), "b": ("i1", 1.0), "B": ("u1", 1.0), "h": ("<i2", 1.0),
    "H": ("<u2", 1.0), "i": ("<i4", 1.0), "I": ("<u4", 1.0), "f": ("<f4", 1.0), "d": ("<f8", 1.0),
    "g": ("<f2", 1.0), "n": ("S4", 1.0), "N": ("S16", 1.0), "Z": ("S64", 1.0), "c": ("<i2", 100.0),
    "C": ("<u2", 100.0), "e": ("<i4", 100.0), "E": ("<u4", 100.0), "L": ("<i4", 1e7),
    "M": ("u1", 1.0), "q": ("<i8", 1.0), "Q": ("<u8", 1.0),
}  # fmt: skip
DESCRIBING = ("FMTU", "UNIT", "MULT")
INSTANCE = "#"  # the unit of a field that tells instruments of a kind apart
INSTANCE_LABELS = ("I", "C", "Inst", "Instance")  # where no unit marks one


@dataclass(frozen=True, slots=True)
class Layout:
    """One kind of record, as its FMT has it."""

    kind: int
    length: int  # bytes, with the head
    name: str
    letters: str
    labels: tuple[str, ...]

    @property
    def dtype(self) -> np.dtype:
        sizes = [np.dtype(FORMATS[letter][0]) for letter in self.letters]
        offsets = np.cumsum([HEAD_BYTES, *(size.itemsize for size in sizes)])[:-1]
        return np.dtype({
            "names": list(self.labels), "formats": sizes, "offsets": offsets.tolist(),
            "itemsize": self.length,
        })  # fmt: skip


@dataclass(frozen=True)
class Table:
    """All records of one kind, in the order of the file.

    rows     [n] structured: the fields as they are stored
    divisor  label → by what the stored number is divided
    unit     label → what the result is in, where the log says so
    instance the label that tells instruments apart, "" for none
    """

    rows: np.ndarray
    divisor: dict[str, float]
    unit: dict[str, str] = field(default_factory=dict)
    instance: str = ""

    def __len__(self) -> int:
        return len(self.rows)

    def has(self, *labels: str) -> bool:
        return set(labels) <= set(self.rows.dtype.names or ())

    def number(self, label: str) -> np.ndarray:
        """Values [n] in the field's unit; NaN where there is no such field."""
        if not self.has(label):
            return np.full(len(self.rows), np.nan)
        with np.errstate(invalid="ignore"):  # a float that signals NaN
            return self.rows[label].astype(np.float64) / self.divisor[label]

    def text(self, label: str) -> list[str]:
        return [raw.decode("latin-1") for raw in self.rows[label].tolist()]

    def boot_us(self) -> np.ndarray:
        """When each record was written [n], µs since the autopilot started."""
        if self.has("TimeUS"):
            return self.rows["TimeUS"].astype(np.int64)
        if self.has("TimeMS"):  # until 2014
            return self.rows["TimeMS"].astype(np.int64) * 1000
        return np.zeros(len(self.rows), np.int64)

    def take(self, rows: np.ndarray) -> Table:
        return Table(self.rows[rows], self.divisor, self.unit, self.instance)

    def in_order(self) -> Table:
        """By time: the autopilot's threads swap some records."""
        return self.take(np.argsort(self.boot_us(), kind="stable"))

    def by_instance(self) -> dict[int, Table]:
        """Each instrument's records, by its number."""
        if not self.instance or not self.has(self.instance):
            return {0: self} if len(self) else {}
        of = self.rows[self.instance]
        return {int(one): self.take(np.flatnonzero(of == one)) for one in np.unique(of)}


@dataclass
class DataFlash:
    """What a file holds of the kinds that were asked for.

    records   how many there are, of all kinds
    skipped   bytes between whole records that are of none
    cut       bytes of a record that the end of the file cuts off
    """

    tables: dict[str, Table] = field(default_factory=dict)
    records: int = 0
    skipped: int = 0
    cut: int = 0

    def get(self, name: str) -> Table | None:
        """The records of a kind in the order of their times; None where there is none."""
        table = self.tables.get(name)
        return table.in_order() if table is not None and len(table) else None


def read_records(path: Path, wanted: Collection[str]) -> DataFlash:
    """All records of the kinds `wanted`, in one pass and block by block."""
    reader = _Reader({*wanted, *DESCRIBING})
    rest = b""
    with path.open("rb") as stream:
        while True:
            block = stream.read(BLOCK_BYTES)
            data = rest + block
            rest = data[reader.take(data, final=not block) :]
            if not block:
                return reader.finish()


class _Reader:
    """Layouts known so far, and the records found."""

    def __init__(self, wanted: set[str]) -> None:
        self.wanted = wanted
        self.layouts: dict[int, Layout] = {}
        self.lengths = np.zeros(256, np.int64)
        self.parts: dict[str, list[tuple[Layout, np.ndarray]]] = {}
        self.found = DataFlash()
        self.lengths[FMT] = FMT_BYTES

    def take(self, data: bytes, final: bool) -> int:
        """The records of a block; how many of its bytes were used. What follows begins the next."""
        raw = np.frombuffer(data, np.uint8)
        pos = 0
        for at, layout in self._definitions(data):
            known = self.layouts.get(layout.kind)
            if known is not None and at < pos:
                continue
            if known is not None and known != layout:  # the kind means something else from here on
                pos = self._chain(raw, pos, at, False)
            self.layouts[layout.kind] = layout
            self.lengths[layout.kind] = layout.length
        return self._chain(raw, pos, len(raw), final)

    def _definitions(self, data: bytes) -> list[tuple[int, Layout]]:
        """Place and layout of each FMT that is sound in itself."""
        found, at = [], data.find(HEAD + bytes([FMT]))
        while at >= 0:
            layout = _layout(data[at + HEAD_BYTES : at + FMT_BYTES])
            if layout is not None:
                found.append((at, layout))
            at = data.find(HEAD + bytes([FMT]), at + HEAD_BYTES)
        return found

    def _chain(self, raw: np.ndarray, begin: int, end: int, final: bool) -> int:
        """Records from `begin` on, each beginning where the one before ends; where it stopped."""
        stop = min(end, len(raw) - HEAD_BYTES + 1)
        if stop <= begin:
            self.found.cut += len(raw) - begin if final else 0
            return len(raw) if final else begin
        marked = (raw[begin:stop] == HEAD[0]) & (raw[begin + 1 : stop + 1] == HEAD[1])
        heads = np.flatnonzero(marked) + begin
        kinds = raw[heads + 2]
        known = self.lengths[kinds] > 0
        heads, kinds = heads[known], kinds[known]
        after = heads + self.lengths[kinds]
        keep, pos = self._walk(raw, heads, after, begin, end, final)
        self._keep(raw, heads[keep], kinds[keep])
        return pos

    def _walk(
        self, raw: np.ndarray, heads: np.ndarray, after: np.ndarray, begin: int, end: int,
        final: bool,
    ) -> tuple[np.ndarray, int]:  # fmt: skip
        """(which heads begin a record [n], where the last whole one ends)."""
        n = len(heads)
        keep = np.zeros(n, bool)
        nearest = np.searchsorted(heads, after)
        leads = np.append(heads, -1)[nearest] == after  # to another head
        gaps = np.flatnonzero(~leads | (nearest != np.arange(n) + 1))  # not to the very next one
        pos = begin
        at = int(np.searchsorted(heads, pos))
        while True:
            if at >= n or heads[at] != pos:  # no record begins where the last one ends
                sound = np.flatnonzero(leads[at:] | (after[at:] == len(raw)))
                to = int(heads[at + sound[0]]) if len(sound) else (
                    end if final or end < len(raw) else max(pos, len(raw) - LONGEST)
                )  # fmt: skip
                if not final and len(raw) - pos < HEAD_BYTES:
                    return keep, pos
                unknown = raw[pos : pos + 2].tobytes() == HEAD  # of a kind that no FMT describes
                damage = self._lost(raw[pos:to], final and to == len(raw)) and not unknown
                if damage and at and keep[at - 1]:
                    keep[at - 1] = False  # what leads into damage is damaged
                    self.found.skipped += int(after[at - 1] - heads[at - 1])
                pos = to
                if not len(sound):
                    return keep, pos
                at += int(sound[0])
            until = int(gaps[np.searchsorted(gaps, at)])
            keep[at : until + 1] = True
            pos, at = int(after[until]), int(nearest[until])
            if pos > end:
                keep[until] = False
                if final:
                    self.found.cut += len(raw) - int(heads[until])
                return keep, len(raw) if final else int(heads[until])
            if pos == end:
                return keep, pos

    def _lost(self, between: np.ndarray, to_the_end: bool) -> bool:
        """Count bytes of no record; whether they are damage: a card is filled up with 00 or FF."""
        if not len(between) or (between[0] in (0, 255) and (between == between[0]).all()):
            return False
        if to_the_end:
            self.found.cut += len(between)
            return False
        self.found.skipped += len(between)
        return True

    def _keep(self, raw: np.ndarray, heads: np.ndarray, kinds: np.ndarray) -> None:
        self.found.records += len(heads)
        for kind in np.flatnonzero(np.bincount(kinds, minlength=256)).tolist():
            layout = self.layouts.get(kind)
            if layout is None or layout.name not in self.wanted:
                continue
            rows = sliding_window_view(raw, layout.length)[heads[kinds == kind]]
            rows = rows.view(layout.dtype).reshape(-1)
            self.parts.setdefault(layout.name, []).append((layout, rows))

    def finish(self) -> DataFlash:
        joined: dict[str, tuple[Layout, np.ndarray]] = {}
        for name, parts in self.parts.items():
            layout = parts[-1][0]
            same = [rows for one, rows in parts if one == layout]
            joined[name] = layout, np.concatenate(same)
        units = _Units(joined)
        self.found.tables = {
            name: units.table(layout, rows) for name, (layout, rows) in joined.items()
        }
        return self.found


def _layout(body: bytes) -> Layout | None:
    """Of the bytes after a head; None where they are no definition."""
    if len(body) < FMT_BYTES - HEAD_BYTES:
        return None
    try:
        name, letters, labels = (
            body[a:b].partition(b"\0")[0].decode("ascii") for a, b in ((2, 6), (6, 22), (22, 86))
        )
    except UnicodeDecodeError:
        return None
    if not name.isalnum() or not set(letters) <= FORMATS.keys():
        return None
    names = tuple(labels.split(",")) if labels else ()
    size = HEAD_BYTES + sum(np.dtype(FORMATS[letter][0]).itemsize for letter in letters)
    whole = size == body[1] and len(names) == len(letters) == len(set(names))
    return Layout(body[0], body[1], name, letters, names) if whole else None


class _Units:
    """What FMTU, UNIT and MULT say of the fields.

    A multiplier is of the stored whole number. The letters c, C, e, E and L have theirs already,
    and 0 stands for none."""

    def __init__(self, joined: dict[str, tuple[Layout, np.ndarray]]) -> None:
        self.of: dict[int, tuple[str, str]] = {}
        described = {"FmtType", "UnitIds", "MultIds"}
        if "FMTU" in joined and described <= set(joined["FMTU"][1].dtype.names or ()):
            rows = joined["FMTU"][1]
            for kind, units, mults in zip(
                rows["FmtType"].tolist(), rows["UnitIds"].tolist(), rows["MultIds"].tolist(),
                strict=True,
            ):  # fmt: skip
                self.of[kind] = units.decode("latin-1"), mults.decode("latin-1")
        self.names = self._letters(joined, "UNIT", "Label")
        self.factors = self._letters(joined, "MULT", "Mult")

    def _letters(self, joined: dict, name: str, label: str) -> dict:
        if name not in joined or not {"Id", label} <= set(joined[name][1].dtype.names or ()):
            return {}
        rows = joined[name][1]
        values = rows[label].tolist()
        values = [v.decode("latin-1") if isinstance(v, bytes) else float(v) for v in values]
        return dict(zip((chr(i & 0xFF) for i in rows["Id"].tolist()), values, strict=True))

    def table(self, layout: Layout, rows: np.ndarray) -> Table:
        units, mults = self.of.get(layout.kind, ("", ""))
        divisor, unit, instance = {}, {}, ""
        for i, (label, letter) in enumerate(zip(layout.labels, layout.letters, strict=True)):
            divisor[label] = FORMATS[letter][1]
            factor = self.factors.get(mults[i : i + 1], 0.0)
            if divisor[label] == 1.0 and factor and not label.startswith("Time"):
                divisor[label] = round(1.0 / factor) if factor < 1.0 else 1.0 / factor
            unit[label] = self.names.get(units[i : i + 1], "")
            if units[i : i + 1] == INSTANCE:
                instance = label
        if not instance:
            instance = next((one for one in INSTANCE_LABELS if one in layout.labels), "")
        return Table(rows, divisor, unit, instance)
