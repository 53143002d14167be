"""ROS 1 and ROS 2 bags to MCAP: the same messages in CDR, together with their definitions.

An MCAP file that ROS 2 recorded is a log already, and needs none of this.
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

from shiplog import files
from shiplog.exceptions import LogUnreadable, listed
from shiplog.logs.write import CHUNK_BYTES, LOG_CONTRACT
from shiplog.unexpected import QUOTED_LETTERS
from shiplog.units import SECOND_NS

if TYPE_CHECKING:  # it takes long to load, and few need it
    from rosbags.highlevel import AnyReader
    from rosbags.interfaces import Connection
    from rosbags.typesys.store import Typestore

log = logging.getLogger(__name__)

BAG = ".bag"
SQLITE = ".db3"
HEADER = "std_msgs/msg/Header"
# Bags of ROS 2 before Iron hold no definitions; those of its own messages have hardly changed.
DEFAULT_TYPES = "ROS2_HUMBLE"

LATEST_NS = 1 << 63
Channels = dict[tuple[int, int], int]  # of each connection in each file of a bag


def is_bag(path: Path) -> bool:
    """A ROS 1 .bag, a ROS 2 .db3, or a folder that rosbag2 made of .db3 files."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file() and any(path.glob(f"*{SQLITE}*"))
    return path.suffix.lower() in (BAG, SQLITE) and path.is_file()


def bags_once(sources: Iterable[Path]) -> list[Path]:
    """The sources, each once: the .db3 files of one metadata.yaml are parts of one, the folder."""
    once: dict[Path, Path] = {}
    for path in sources:
        if path.suffix.lower() == SQLITE and is_bag(path.parent):
            path = path.parent if path.parent.name.strip(".") else path.parent.resolve()
        once.setdefault(path.resolve(), path)
    return list(once.values())


def bag_to_log(path: Path, target: Path, ship: str) -> list[str]:
    """Every topic of a bag into one MCAP file, in the bag's order and by its clock.

    `target` appears when the log is whole. Returns what of the bag is not in it, with the reasons:
    topics whose definition nobody has, messages that do not fit theirs, and all that comes after a
    place that is damaged. Raises LogUnreadable where there is nothing to write.
    """
    source = path.parent if path.suffix.lower() == SQLITE else path
    with (
        _opened(source, path.name) as reader,
        files.whole(target) as partial,
        partial.open("wb") as stream,
    ):
        lost = _write(reader, stream, ship, path.name)
        stream.flush()
        os.fsync(stream.fileno())
    return lost


@contextmanager
def _opened(source: Path, name: str) -> Iterator[AnyReader]:
    """Raises LogUnreadable where what a bag says of itself cannot be read."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    try:
        reader = AnyReader([source], default_typestore=get_typestore(Stores[DEFAULT_TYPES]))
        reader.open()
    except MemoryError:
        raise
    except Exception as error:  # of a damaged bag: whatever its bytes lead to
        raise _unreadable(name, error) from error
    try:
        yield reader
    finally:
        with suppress(Exception):
            reader.close()


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


def _write(reader: AnyReader, stream: BinaryIO, ship: str, name: str) -> list[str]:
    """Raises LogUnreadable where no topic can be written."""
    from rosbags.typesys import Stores, get_typestore

    store = reader.typestore
    if not reader.is2:  # ROS 1's header has a counter that ROS 2's has not; all else is the same
        header = get_typestore(Stores.ROS2_FOXY).fielddefs[HEADER]
        store = get_typestore(Stores.EMPTY)
        store.register({**reader.typestore.fielddefs, HEADER: header})
    writer = Writer(
        stream, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD, index_types=IndexType.ALL,
        enable_crcs=True,
    )  # fmt: skip
    writer.start(profile="")
    writer.add_metadata("voyage", {"ship": ship, "contract": LOG_CONTRACT, "table": name})
    channels, left_out = _channels(reader, store, writer)
    kept = [c for c in reader.connections if _key(c) in channels and c.topic not in left_out]
    if not kept:
        raise LogUnreadable(
            f"{name} has no topic whose messages can be read. Topics: {listed(reader.topics)}.",
            hint="record it as MCAP, which keeps the definitions.",
        )
    lost = [f"{topic}: {why}" for topic, why in left_out.items()]
    return lost + _copy(reader, kept, store, writer, channels, name)


def _channels(reader: AnyReader, store: Typestore, writer: Writer) -> tuple[Channels, dict]:
    """A channel for each topic and type of a bag; and the topics without one, with the reason."""
    channels: Channels = {}
    schemas: dict[str, int] = {}
    topics: dict[str, int] = {}
    left_out: dict[str, str] = {}
    for connection in reader.connections:
        kind = connection.msgtype
        try:
            if kind not in schemas:
                text, _ = store.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", text.encode())
                schemas[kind] = schema
            key = f"{connection.topic}\n{kind}"
            if key not in topics:
                topics[key] = writer.register_channel(connection.topic, "cdr", schemas[kind], {})
            channels[_key(connection)] = topics[key]
        except Exception as error:  # rosbags raises its own kinds, and KeyError for a lost part
            log.debug("%s: %s", connection.topic, error)
            left_out[connection.topic] = f"nothing says what a {kind} holds"
    return channels, left_out


def _copy(
    reader: AnyReader, kept: list[Connection], store: Typestore, writer: Writer,
    channels: Channels, name: str,
) -> list[str]:  # fmt: skip
    """The messages as far as they can be read, and what cannot. Raises LogUnreadable where that is
    the first one."""
    bad: Counter[str] = Counter()
    begin = last = count = 0
    messages, damage = reader.messages(connections=kept), None
    while True:
        try:
            connection, time, data = next(messages)
        except StopIteration:
            break
        except MemoryError:
            raise
        except Exception as error:  # of a damaged bag, as above; no reader goes on behind it
            damage = error
            break
        begin, last = (begin, time) if count else (time, time)
        count += 1
        try:
            cdr = data if reader.is2 else bytes(store.ros1_to_cdr(data, connection.msgtype))
            if not 0 <= time < LATEST_NS:
                raise ValueError("a time that MCAP cannot hold")
        except Exception as error:
            log.debug("%s: %s", connection.topic, error)
            bad[connection.topic] += 1
            continue
        writer.add_message(channels[_key(connection)], time, cdr, time, (count - 1) % 2**32)
    if damage is not None and count == bad.total():
        raise _unreadable(name, damage) from damage
    writer.finish()
    lost = [f"{topic}: {n} of its messages do not fit their definition" for topic, n in bad.items()]
    if damage is not None:
        lost.append(
            f"what comes after {count} messages, {(last - begin) / SECOND_NS:.1f} s from the first "
            f"one: the bag is damaged there ({_words(damage)}); copy the original again"
        )
    return lost


def _key(connection) -> tuple[int, int]:
    return id(connection.owner), connection.id
