"""The MCAP conformance set: 416 files that differ in what a writer may leave out or add.

The set (github.com/foxglove/mcap, tests/conformance) describes each file record by record: six
contents, times the ways to write them. The files are made here from that description, and shiplog
must read exactly the messages, channels and metadata that it states. Offsets and CRCs that the
set states of some of its files hold the writer here to it.
"""

from __future__ import annotations

import struct
import zlib
from itertools import chain, combinations
from pathlib import Path

import mcap_bytes as mcap
import pytest

from shiplog.exceptions import LogUnreadable
from shiplog.logs.mcap_file import scan
from shiplog.logs.reading import salvage
from shiplog.logs.reading.read import contents, read

FEATURES = ("ch", "mx", "st", "rsh", "rch", "ax", "mdx", "chx", "sum", "pad")
PADDING = b"\x01\x02\x03"  # what `pad` appends to records that a newer version may extend

EXAMPLE = (mcap.SCHEMA, mcap.schema(1, "Example", "c", bytes([4, 5, 6])))
CHANNEL = (mcap.CHANNEL, mcap.channel(1, 1, "example", "a", {"foo": "bar"}))
PAYLOAD = bytes([1, 2, 3])
TEN = ((0, 0), (2, 2), (1, 1), (3, 3), (3, 3), (5, 5), (4, 4), (7, 7), (8, 8), (9, 9))
CONTENTS = {
    "NoData": [],
    "OneMessage": [EXAMPLE, CHANNEL, (mcap.MESSAGE, mcap.message(1, 10, 2, 1, PAYLOAD))],
    "OneAttachment": [(mcap.ATTACHMENT, struct.pack("<QQ", 2, 1) + mcap.text("myFile")
                       + mcap.text("application/octet-stream") + struct.pack("<Q", 3) + PAYLOAD)],
    "OneMetadata": [(mcap.METADATA, mcap.text("myMetadata") + mcap.mapping({"foo": "bar"}))],
    "OneSchemalessMessage": [
        (mcap.CHANNEL, mcap.channel(1, 0, "example", "text")),
        (mcap.MESSAGE, mcap.message(1, 10, 2, 1, PAYLOAD)),
    ],
    "TenMessages": [EXAMPLE, CHANNEL] + [
        (mcap.MESSAGE, mcap.message(1, i, *times, PAYLOAD)) for i, times in enumerate(TEN)
    ],
}  # fmt: skip


def makes_sense(name: str, features: frozenset[str]) -> bool:
    """Whether the set has a file of this content with these features."""
    kinds = {opcode for opcode, _ in CONTENTS[name]}
    needs = {"ax": mcap.ATTACHMENT, "mdx": mcap.METADATA, "rsh": mcap.SCHEMA,
             "rch": mcap.CHANNEL, "ch": mcap.MESSAGE}  # fmt: skip
    if any(feature in features and opcode not in kinds for feature, opcode in needs.items()):
        return False
    if features & {"mx", "chx"} and "ch" not in features:
        return False
    return "sum" not in features or bool(features & {"chx", "rsh", "rch", "mdx", "ax", "st"})


VARIANTS = [
    (name, frozenset(features))
    for name in CONTENTS
    for features in chain(*(combinations(FEATURES, n) for n in range(len(FEATURES) + 1)))
    if makes_sense(name, frozenset(features))
]


class File:
    """A file of the set while it is written."""

    def __init__(self, name: str, features: frozenset[str]) -> None:
        self.records, self.features = CONTENTS[name], features
        self.data = bytearray(mcap.MAGIC)
        self.groups: list[tuple[int, int, int]] = []  # opcode, start, length
        self.indexes: dict[int, list[bytes]] = {}  # index records of the summary, by opcode
        self._write()

    def _add(self, opcode: int, body: bytes) -> int:
        """Where the record begins. Only records without data at their end can be padded."""
        at = len(self.data)
        bare = opcode in (mcap.MESSAGE, mcap.CHUNK, mcap.ATTACHMENT, mcap.FOOTER)
        self.data += mcap.record(
            opcode, body, PADDING if "pad" in self.features and not bare else b""
        )
        return at

    def _write(self) -> None:
        self._add(mcap.HEADER, mcap.text("") + mcap.text(""))
        inside = b""
        for opcode, body in self.records:
            if opcode in (mcap.SCHEMA, mcap.CHANNEL, mcap.MESSAGE) and "ch" in self.features:
                inside += mcap.record(opcode, body)
            else:
                self._alone(opcode, body)
        if "ch" in self.features:
            self._chunk(inside)
        self._add(mcap.DATA_END, struct.pack("<I", zlib.crc32(self.data)))
        self._summary()
        self.data += mcap.MAGIC

    def _alone(self, opcode: int, body: bytes) -> None:
        if opcode == mcap.ATTACHMENT:
            body += struct.pack("<I", zlib.crc32(body))
        at = self._add(opcode, body)
        where = struct.pack("<QQ", at, len(self.data) - at)
        if opcode == mcap.ATTACHMENT and "ax" in self.features:
            entry = where + struct.pack("<QQQ", 2, 1, 3) + mcap.text("myFile")
            entry += mcap.text("application/octet-stream")
            self.indexes.setdefault(mcap.ATTACHMENT_INDEX, []).append(entry)
        if opcode == mcap.METADATA and "mdx" in self.features:
            entry = where + mcap.text("myMetadata")
            self.indexes.setdefault(mcap.METADATA_INDEX, []).append(entry)

    def _messages(self) -> list[bytes]:
        return [body for opcode, body in self.records if opcode == mcap.MESSAGE]

    def _times(self) -> tuple[int, int]:
        logged = [struct.unpack_from("<Q", body, 6)[0] for body in self._messages()]
        return (min(logged), max(logged)) if logged else (0, 0)

    def _chunk(self, inside: bytes) -> None:
        start, end = self._times()
        at = self._add(mcap.CHUNK, mcap.chunk(inside, start, end, crc=0))
        length, indexes = len(self.data) - at, len(self.data)
        offsets: dict[int, int] = {}
        if "mx" in self.features:
            offsets[1] = indexes
            pairs, place = b"", len(inside) - sum(9 + len(m) for m in self._messages())
            for body in self._messages():
                pairs += struct.pack("<QQ", struct.unpack_from("<Q", body, 6)[0], place)
                place += 9 + len(body)
            self._add(mcap.MESSAGE_INDEX, struct.pack("<H", 1) + mcap.text(pairs))
        if "chx" in self.features:
            entry = struct.pack("<QQQQ", start, end, at, length) + mcap.numbers(offsets)
            entry += struct.pack("<Q", len(self.data) - indexes) + mcap.text("")
            entry += struct.pack("<QQ", len(inside), len(inside))
            self.indexes.setdefault(mcap.CHUNK_INDEX, []).append(entry)

    def _statistics(self) -> bytes:
        kinds = [opcode for opcode, _ in self.records]
        count, chunked = kinds.count(mcap.MESSAGE), "ch" in self.features
        body = struct.pack(
            "<QHIIII",
            count,
            kinds.count(mcap.SCHEMA),
            kinds.count(mcap.CHANNEL),
            kinds.count(mcap.ATTACHMENT),
            kinds.count(mcap.METADATA),
            chunked,
        )
        counts = mcap.numbers({1: count} if count else {})
        return body + struct.pack("<QQ", *self._times()) + counts

    def _group(self, opcode: int, bodies: list[bytes]) -> None:
        start = len(self.data)
        for body in bodies:
            self._add(opcode, body)
        if bodies:
            self.groups.append((opcode, start, len(self.data) - start))

    def _summary(self) -> None:
        start = len(self.data)
        for feature, opcode in (("rsh", mcap.SCHEMA), ("rch", mcap.CHANNEL)):
            if feature in self.features:
                self._group(opcode, [body for kind, body in self.records if kind == opcode])
        if "st" in self.features:
            self._group(mcap.STATISTICS, [self._statistics()])
        for opcode in (mcap.METADATA_INDEX, mcap.ATTACHMENT_INDEX, mcap.CHUNK_INDEX):
            self._group(opcode, self.indexes.get(opcode, []))
        offsets = len(self.data) if "sum" in self.features else 0
        for group in self.groups if offsets else []:
            self._add(mcap.SUMMARY_OFFSET, struct.pack("<BQQ", *group))
        written = len(self.data) > start
        self.start, self.offsets = (start if written else 0), offsets
        footer = struct.pack("<QQ", self.start, offsets)
        head = struct.pack("<BQ", mcap.FOOTER, 20)
        crc = zlib.crc32(self.data[start:] + head + footer) if written else 0
        self._add(mcap.FOOTER, footer + struct.pack("<I", crc))


def test_the_set_has_416_files():
    assert len(VARIANTS) == len(set(VARIANTS)) == 416
    counts = [sum(name == one for one, _ in VARIANTS) for name in CONTENTS]
    assert counts == [6, 154, 14, 14, 74, 154]


ALL = frozenset({"ch", "mx", "st", "rsh", "rch", "chx", "sum", "pad"})


@pytest.mark.parametrize(
    ("name", "features", "chunk", "groups", "offsets"),
    [
        ("TenMessages", ALL, (28, 470), [(3, 692, 37), (4, 729, 50), (11, 779, 68), (8, 847, 86)],
         933),
        ("OneSchemalessMessage", ALL - {"pad", "rsh"}, (25, 119),
         [(4, 188, 36), (11, 224, 65), (8, 289, 83)], 372),
        ("OneMetadata", frozenset({"st", "mdx", "sum", "pad"}), None,
         [(11, 88, 58), (13, 146, 42)], 188),
    ],
)  # fmt: skip
def test_the_writer_puts_records_where_the_set_does(name, features, chunk, groups, offsets):
    file = File(name, features)
    assert (file.start, file.offsets, file.groups) == (groups[0][1], offsets, groups)
    chunks = [(at, n) for opcode, at, n in mcap.records(bytes(file.data)) if opcode == mcap.CHUNK]
    assert chunks == ([chunk] if chunk else [])


def stated(name: str) -> list[tuple]:
    bodies = [body for opcode, body in CONTENTS[name] if opcode == mcap.MESSAGE]
    return [(*struct.unpack_from("<HIQQ", body), body[22:]) for body in bodies]


def got(path: Path) -> list[tuple]:
    met = [m for batch in salvage.messages(scan.survey(path)) for m in batch]
    return [(m.channel_id, m.sequence, m.log_time, m.publish_time, m.data) for m in met]


@pytest.mark.parametrize("name", CONTENTS)
def test_every_file_of_the_set_gives_what_its_description_states(name, tmp_path):
    path = tmp_path / "log.mcap"
    for features in [features for one, features in VARIANTS if one == name]:
        path.write_bytes(File(name, features).data)
        assert got(path) == stated(name), sorted(features)
        found = contents(path)
        topics = {
            t: (x.schema, x.encoding, x.metadata, x.messages) for t, x in found.topics.items()
        }
        if name == "OneSchemalessMessage":
            assert topics == {"example": ("", "text", {}, 1)}
        elif name in ("OneMessage", "TenMessages"):
            assert topics == {"example": ("Example", "a", {"foo": "bar"}, len(stated(name)))}
        else:
            assert topics == {}
        assert found.metadata == ({"myMetadata": {"foo": "bar"}} if name == "OneMetadata" else {})
        survey = scan.survey(path)
        for _ in scan.walk(survey):
            pass
        assert (survey.losses, survey.ended) == ([], True), sorted(features)
        with pytest.raises(LogUnreadable, match=r"no messages|none can be decoded"):
            read(path)  # the set's encodings are made up
