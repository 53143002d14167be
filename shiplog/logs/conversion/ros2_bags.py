"""ROS 2 bags: the parts that a metadata.yaml lists, SQLite or MCAP, message by message.

Read here and not by a library, so that one topic nobody has a definition of costs itself alone, and
that a database is whole whose last rows still stand in its write-ahead log.
"""

from __future__ import annotations

import logging
import re
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote

from mcap.records import Schema

from shiplog.exceptions import LogUnreadable
from shiplog.logs.conversion import packed
from shiplog.logs.decoding import ros, ros_definitions
from shiplog.logs.mcap_file import scan
from shiplog.logs.mcap_file.records import TooLarge
from shiplog.logs.reading import salvage
from shiplog.machine import files

log = logging.getLogger(__name__)

SQLITE, MCAP = ".db3", ".mcap"
METADATA = "metadata.yaml"
PENDING = ("-wal", "-journal")  # beside a database: rows that are not in it yet, or not whole
ROOM = 1.1  # times the bytes of a database that a temporary folder must have free
OTHERS = ("protobuf", "jsonschema")
DEFINED = ("ros2msg", "ros2idl")  # encodings of a definition


@dataclass(frozen=True, slots=True)
class Line:
    """A topic of one type, as a part of a bag describes it."""

    topic: str
    kind: str
    encoding: str  # of its messages: "cdr"
    schema: str  # "ros2msg", "ros2idl"; else it has no definition
    definition: bytes
    metadata: tuple[tuple[str, str], ...] = ()


@dataclass(slots=True)
class Parts:
    """The files of a bag in their order, and what of them is not there."""

    files: list[Path]
    missing: list[str] = field(default_factory=list)


def is_ros2_bag(path: Path) -> bool:
    """A folder that rosbag2 made, or a database of one."""
    if path.is_dir():
        there = any(path.glob(f"*{SQLITE}*")) or any(path.glob(f"*{MCAP}*"))
        return (path / METADATA).is_file() and there
    return path.suffix.lower() == SQLITE and path.is_file()


def parts_of(path: Path) -> Parts:
    """The parts that the metadata lists; all that there are where it cannot be read."""
    if path.is_file():
        return Parts([path])
    there = sorted(
        p for p in path.iterdir() if {SQLITE, MCAP} & set(map(str.lower, p.suffixes[-2:]))
    )  # fmt: skip
    try:
        from ruamel.yaml import YAML  # as rosbags has it

        content = YAML(typ="safe").load((path / METADATA).read_text(encoding="utf-8"))
        named = [Path(str(name)).name for name in
                 content["rosbag2_bagfile_information"]["relative_file_paths"]]  # fmt: skip
    except Exception as error:  # a YAML parser raises its own
        log.warning("%s: %s cannot be read: %s", path.name, METADATA, " ".join(str(error).split()))
        return Parts(there)
    found = {p.name: p for p in there} | {packed.inner_name(p): p for p in there}
    listed = [found[name] for name in named if name in found]
    missing = [f"{name}: it is in {METADATA}, and not in the folder" for name in named
               if name not in found]  # fmt: skip
    return Parts(listed or there, missing)


def part_of(path: Path) -> str:
    """What to do about a log that may be a part of a split recording, to end a hint; else nothing.

    rosbag2 numbers the parts of a bag, and metadata.yaml lists them.
    """
    numbered = re.fullmatch(r"(.+_)\d+", path.stem)
    alike = list(path.parent.glob(f"{numbered[1]}[0-9]*{path.suffix}")) if numbered else []
    if len(alike) < 2 or (path.parent / METADATA).is_file():
        return ""
    return (
        "; if this is a part of a split recording, give the folder with its metadata.yaml (ros2 "
        "bag reindex makes one), or join the parts with mcap merge"
    )


class Part:
    """One file of a bag."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lost: list[str] = []
        self.database: sqlite3.Connection | None = None

    def messages(self) -> Iterator[tuple[Line, int, int, bytes]]:
        """(what, time by the recorder, by the publisher, payload) of each; what could not be read
        is in `lost` then. Raises sqlite3.Error where a database is damaged, at that place."""
        if self.database is None:
            yield from self._of_mcap()
        else:
            yield from self._of_sqlite(self.database)

    def _of_mcap(self) -> Iterator[tuple[Line, int, int, bytes]]:
        found = scan.survey(self.path)
        lines: dict[int, Line] = {}
        large = 0
        for batch in salvage.messages(found):
            for message in batch:
                number = message.channel_id
                if number not in lines and number in found.channels:
                    lines[number] = _line(found.channels[number], found.schemas)
                if isinstance(message.data, TooLarge):
                    large += 1
                elif number in lines:
                    times = message.log_time, message.publish_time
                    yield lines[number], *times, bytes(message.data)
        self.lost += [f"{self.path.name}: at byte {loss.offset} it {loss.reason}"
                      for loss in found.losses]  # fmt: skip
        if large:
            self.lost.append(f"{self.path.name}: {large} messages that are too large")

    def _of_sqlite(self, database: sqlite3.Connection) -> Iterator[tuple[Line, int, int, bytes]]:
        known = {row[0] for row in database.execute(
            "SELECT name FROM sqlite_master WHERE type = 'table'"
        )}  # fmt: skip
        if not {"topics", "messages"} <= known:
            raise LogUnreadable(
                f"{self.path.name} is an SQLite database, and no ROS bag.",
                hint="tables of it can be exported: sqlite3 -header -csv FILE.db3 'SELECT * FROM "
                "NAME' > NAME.csv.",
            )
        definitions = {}
        if "message_definitions" in known:
            definitions = {
                kind: (encoding, text) for kind, encoding, text in database.execute(
                    "SELECT topic_type, encoding, encoded_message_definition "
                    "FROM message_definitions"
                )
            }  # fmt: skip
        lines = {}
        for number, topic, kind, form in database.execute(
            "SELECT id, name, type, serialization_format FROM topics"
        ):
            encoding, text = definitions.get(kind, ("", ""))
            text = text.encode() if isinstance(text, str) else text or b""
            lines[number] = Line(topic, kind, form, encoding, text)
        rows = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY timestamp")
        for number, time, data in rows:
            if number not in lines or not isinstance(data, bytes) or not isinstance(time, int):
                raise sqlite3.DatabaseError("a row that holds no message")
            yield lines[number], time, time, data


@contextmanager
def opened(path: Path) -> Iterator[Part]:
    """A part of a bag that can be read: unpacked, and with the rows that its database has not taken
    in yet. The user's own files stay as they are."""
    with ExitStack() as stack:
        inside = stack.enter_context(packed.unpacked(path))
        part = Part(inside)
        if inside.suffix.lower() == SQLITE:
            source = inside
            if any(_pending(inside)):
                source = _settled(inside, stack.enter_context(files.temporary_folder()))
            name = quote(str(source.resolve()))
            part.database = sqlite3.connect(f"file:{name}?immutable=1", uri=True)
            stack.callback(part.database.close)
        yield part


def stated(line: Line) -> Line:
    """The line with a definition that can be read: its own, or ROS's of this name.

    Raises ValueError with the reason where there is none.
    """
    schema = Schema(id=1, name=line.kind, encoding=line.schema, data=line.definition)
    if line.schema in OTHERS or line.encoding == "json":  # of an MCAP file, which keeps them
        return line
    if (line.encoding, line.schema) == ("ros1", "ros1msg"):
        ros.messages(schema)
        return line
    if line.encoding != "cdr":
        raise ValueError(f"its messages are {line.encoding!r}, not CDR")
    if line.schema not in DEFINED or not line.definition.strip():
        known = ros_definitions.of_its_name(schema)
        if known is None:
            raise ValueError(f"nothing says what a {line.kind} holds")
        schema = known
    ros.messages(schema)
    return Line(line.topic, line.kind, line.encoding, schema.encoding, schema.data, line.metadata)


def _line(channel, schemas) -> Line:
    schema = schemas.get(channel.schema_id)
    described = (schema.name, schema.encoding, schema.data) if schema else ("", "", b"")
    kind, encoding, data = described
    metadata = tuple(sorted(channel.metadata.items()))
    return Line(channel.topic, kind, channel.message_encoding, encoding, data, metadata)


def _pending(path: Path) -> Iterator[Path]:
    """The files beside a database that hold what it has not taken in."""
    for ending in PENDING:
        beside = path.with_name(path.name + ending)
        if beside.is_file() and beside.stat().st_size:
            yield beside


def _settled(path: Path, folder: Path) -> Path:
    """A copy of a database with all that was committed. Raises LogUnreadable where there is no
    room for it."""
    beside = list(_pending(path))
    size = sum(one.stat().st_size for one in (path, *beside))
    if shutil.disk_usage(folder).free < ROOM * size:
        raise LogUnreadable(
            f"{path.name} has rows that are still in {beside[0].name}, and {folder.parent} has no "
            f"room for a copy of {size >> 20} MB that could take them in.",
            hint=f"free some space, or let SQLite do it: sqlite3 {path.name} 'PRAGMA "
            "wal_checkpoint(TRUNCATE)'.",
        )
    copy = folder / path.name
    for one in (path, *beside):
        shutil.copyfile(one, folder / one.name)
    log.info("%s: rows of %s are read as well, from a copy", path.name, beside[0].name)
    database = sqlite3.connect(copy)
    try:
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        database.execute("PRAGMA journal_mode = DELETE")
    finally:
        database.close()
    return copy
