"""ROS 1 and ROS 2 bags to one MCAP file: the same messages, together with their definitions.

An MCAP file that ROS 2 recorded is a log already, and needs none of this; several of them that one
metadata.yaml lists are one log.
"""

from __future__ import annotations

import logging
import os
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from mcap.writer import CompressionType, IndexType, Writer

from shiplog.exceptions import LogUnreadable, ShiplogError, listed
from shiplog.logs.conversion import ros2_bags
from shiplog.logs.conversion.original import Format, Original
from shiplog.logs.conversion.ros2_bags import MCAP, SQLITE, Line, is_ros2_bag
from shiplog.logs.conversion.write import CHUNK_BYTES, LOG_CONTRACT
from shiplog.machine import files
from shiplog.machine.unexpected import QUOTED_LETTERS
from shiplog.nomenclature.units import SECOND_NS

if TYPE_CHECKING:  # it takes long to load, and few need it
    from rosbags.interfaces import Connection
    from rosbags.rosbag1 import Reader
    from rosbags.typesys.store import Typestore

log = logging.getLogger(__name__)

BAG = ".bag"
HEADER = "std_msgs/msg/Header"
LATEST_NS = 1 << 63


def is_bag(path: Path) -> bool:
    """A ROS 1 .bag, a ROS 2 .db3, or a folder that rosbag2 made of .db3 or .mcap files."""
    return is_ros2_bag(path) or (path.suffix.lower() == BAG and path.is_file())


def only_log(path: Path) -> Path | None:
    """The log of a bag that is one MCAP file, which can be read as it is."""
    if not path.is_dir():
        return None
    parts = ros2_bags.parts_of(path)
    alone = len(parts.files) == 1 and not parts.missing and parts.files[0].suffix == MCAP
    return parts.files[0] if alone else None


def bags_once(sources: Iterable[Path]) -> list[Path]:
    """The sources, each once: the files of one metadata.yaml are parts of one, the folder."""
    once: dict[Path, Path] = {}
    for path in sources:
        part = path.suffix.lower() == SQLITE or MCAP in path.suffixes[-2:]
        if part and path.is_file() and is_bag(path.parent):
            path = path.parent if path.parent.name.strip(".") else path.parent.resolve()
        once.setdefault(path.resolve(), path)
    return list(once.values())


def bag_to_log(path: Path, target: Path, ship: str) -> list[str]:
    """Every topic of a bag into one MCAP file, in the bag's order and by its clock.

    `target` appears when the log is whole. Returns what of the bag is not in it, with the reasons:
    topics whose definition nobody has, messages that do not fit theirs, parts that are not there,
    and all that comes after a place that is damaged. Raises LogUnreadable where there is nothing to
    write.
    """
    with files.whole(target) as partial, partial.open("wb") as stream:
        if path.suffix.lower() == BAG:
            with _opened(path) as reader:
                made = _Log(stream, ship, path.name)
                made.copy(_of_ros1(reader, made))
        else:
            made = _Log(stream, ship, path.name)
            for part in made.parts(path):
                made.take(part)
        made.finish()
        stream.flush()
        os.fsync(stream.fileno())
    return made.lost


class _Log:
    """The log that is being written, and what could not be put into it."""

    def __init__(self, stream: BinaryIO, ship: str, name: str) -> None:
        self.name, self.lost = name, []
        self._writer = Writer(
            stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD,
            index_types=IndexType.ALL, enable_crcs=True,
        )  # fmt: skip
        self._writer.start(profile="")
        voyage = {"ship": ship, "contract": LOG_CONTRACT, "table": name}
        self._writer.add_metadata("voyage", voyage)
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[Line, int | None] = {}
        self._topics: set[str] = set()
        self._bad: Counter[str] = Counter()
        self._begin = self._last = self._count = self._written = 0
        self._damage: LogUnreadable | None = None

    def parts(self, path: Path) -> list[Path]:
        """The files of a ROS 2 bag; those that are not there are noted."""
        found = ros2_bags.parts_of(path)
        self.lost += found.missing
        return found.files

    def take(self, part: Path) -> None:
        """One file of a ROS 2 bag, as far as it can be read."""
        try:
            with ros2_bags.opened(part) as one:
                self.copy(one.messages())
                self.lost += one.lost
        except LogUnreadable as error:
            self._damage = self._damage or error
            self.lost.append(f"{part.name}: {error.message}")

    def leave_out(self, topic: str, why: str) -> None:
        self._topics.add(topic)
        if (said := f"{topic}: {why}") not in self.lost:
            self.lost.append(said)

    def bad(self, topic: str) -> None:
        """One message does not fit its definition."""
        self._bad[topic] += 1

    def copy(self, messages: Iterator[tuple[Line, int, int, bytes]]) -> None:
        """The messages as far as they can be read."""
        damage = None
        while True:
            try:
                line, time, published, data = next(messages)
            except StopIteration:
                break
            except (MemoryError, ShiplogError):
                raise
            except Exception as error:  # of a damaged bag: whatever its bytes lead to
                damage = error
                break
            self._begin, self._last = (self._begin, time) if self._count else (time, time)
            self._count += 1
            self._put(line, time, published, data)
        if damage is not None:
            self._damage = self._damage or _unreadable(self.name, damage)
            self.lost.append(
                f"what comes after {self._count} messages, "
                f"{(self._last - self._begin) / SECOND_NS:.1f} s from the first one: the bag is "
                f"damaged there ({_words(damage)}); copy the original again"
            )

    def _put(self, line: Line, time: int, published: int, data: bytes) -> None:
        channel = self._channel(line)
        if channel is None:
            return
        if not (0 <= time < LATEST_NS and 0 <= published < LATEST_NS):  # what MCAP can hold
            self._bad[line.topic] += 1
            return
        self._written += 1
        self._writer.add_message(channel, time, data, published, (self._count - 1) % 2**32)

    def _channel(self, line: Line) -> int | None:
        if line not in self._channels:
            self._topics.add(line.topic)
            self._channels[line] = self._registered(line)
        return self._channels[line]

    def _registered(self, line: Line) -> int | None:
        try:
            stated = ros2_bags.stated(line)
        except Exception as error:  # of a definition that is none: whatever its text leads to
            self.leave_out(line.topic, " ".join(str(error).split())[:QUOTED_LETTERS])
            return None
        key = (stated.kind, stated.schema, stated.definition)
        if key not in self._schemas:
            self._schemas[key] = self._writer.register_schema(*key)
        return self._writer.register_channel(
            stated.topic, stated.encoding, self._schemas[key], dict(stated.metadata)
        )

    def finish(self) -> None:
        """Raises LogUnreadable where nothing was written."""
        if not self._written and self._damage is not None:
            raise self._damage
        if not any(channel is not None for channel in self._channels.values()):
            raise LogUnreadable(
                f"{self.name} has no topic whose messages can be read"
                + (f": {'; '.join(self.lost)}." if self.lost else ".")
                + (f" Topics: {listed(self._topics)}." if self._topics else ""),
                hint="record it as MCAP, which keeps the definitions.",
            )
        self._writer.finish()
        damage = [said for said in self.lost if said.startswith("what comes after")]
        fit = [f"{topic}: {n} of its messages do not fit their definition"
               for topic, n in self._bad.items()]  # fmt: skip
        self.lost = [said for said in self.lost if said not in damage] + fit + damage


def _logs(original: Original) -> Iterator[Path]:
    target = original.place()
    if lost := bag_to_log(original.path, target, original.ship):
        original.lost[str(original.given)] = "; ".join(lost)
    log.info("%s written", target.name)
    yield target


FORMAT = Format("ROS bags", is_bag, _logs)


@contextmanager
def _opened(path: Path) -> Iterator[Reader]:
    """Raises LogUnreadable where what a bag says of itself cannot be read."""
    from rosbags.rosbag1 import Reader

    try:
        reader = Reader(path)
        reader.open()
    except MemoryError:
        raise
    except Exception as error:  # of a damaged bag: whatever its bytes lead to
        raise _unreadable(path.name, error) from error
    try:
        yield reader
    finally:
        with suppress(Exception):
            reader.close()


def _of_ros1(reader: Reader, made: _Log) -> Iterator[tuple[Line, int, int, bytes]]:
    """The messages of a ROS 1 bag in CDR; of a type that cannot be turned into it as they are."""
    store = _types(reader.connections)
    lines = {}
    for connection in reader.connections:
        line = _cdr(connection, store)
        if line is None:
            kind = connection.msgtype.replace("/msg/", "/")
            text = connection.msgdef.data.encode()
            line = Line(connection.topic, kind, "ros1", "ros1msg", text)
        lines[connection.id] = line
    for connection, time, data in reader.messages():
        line = lines[connection.id]
        if line.encoding == "cdr":
            try:
                data = bytes(store.ros1_to_cdr(data, connection.msgtype))
            except Exception as error:  # rosbags raises its own kinds
                log.debug("%s: %s", connection.topic, error)
                made.bad(connection.topic)
                continue
        yield line, time, time, bytes(data)


def _types(connections: Iterable[Connection]) -> Typestore:
    """The types of a ROS 1 bag; one that cannot be read costs itself alone."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    # ROS 1's header has a counter that ROS 2's has not; all else is the same
    header = get_typestore(Stores.ROS2_FOXY).fielddefs[HEADER]
    types = {HEADER: header}
    for connection in connections:
        try:
            found = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            get_typestore(Stores.EMPTY).register({**found, HEADER: header})
        except Exception as error:  # rosbags raises its own kinds, and what Python's compiler does
            log.debug("%s: %s", connection.topic, error)
            continue
        for name, fields in found.items():
            types.setdefault(name, fields)
    store = get_typestore(Stores.EMPTY)
    with suppress(Exception):
        store.register(types)
    return store


def _cdr(connection: Connection, store: Typestore) -> Line | None:
    """What a ROS 1 topic is in CDR; None where nobody can say."""
    from rosbags.typesys import get_types_from_msg

    kind = connection.msgtype
    try:
        own = get_types_from_msg(connection.msgdef.data, kind)
        if any(store.fielddefs[name][1] != fields[1] for name, fields in own.items()
               if name != HEADER):  # fmt: skip
            return None  # two definitions of one name
        text, _ = store.generate_msgdef(kind, ros_version=2)
        line = Line(connection.topic, kind, "cdr", "ros2msg", text.encode())
        ros2_bags.stated(line)
    except Exception as error:
        log.debug("%s: %s", connection.topic, error)
        return None
    return line


def _unreadable(name: str, error: Exception) -> LogUnreadable:
    return LogUnreadable(
        f"{name} cannot be read as a ROS bag: {_words(error)}.",
        hint="a ROS 2 bag is the folder with its metadata.yaml; `ros2 bag reindex` makes one "
        "anew, `rosbag reindex` mends a ROS 1 bag that was cut off, and the command .recover of "
        "sqlite3 takes what is sound out of a damaged .db3.",
    )


def _words(error: Exception) -> str:
    """A library's own words in one line; the kind of the exception where it has none."""
    words = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(words.split())[:QUOTED_LETTERS].rstrip(".") or type(error).__name__
