"""ROS 1 and ROS 2 bags to MCAP: the same messages in CDR, together with their definitions.

An MCAP file that ROS 2 recorded is a log already, and needs none of this.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable
from pathlib import Path

from mcap.writer import CompressionType, IndexType, Writer

from shiplog import files
from shiplog.exceptions import LogUnreadable, listed
from shiplog.logs.write import CHUNK_BYTES, LOG_CONTRACT
from shiplog.unexpected import MENDABLE

log = logging.getLogger(__name__)

BAG = ".bag"
SQLITE = ".db3"
HEADER = "std_msgs/msg/Header"
# Bags of ROS 2 before Iron hold no definitions; those of its own messages have hardly changed.
DEFAULT_TYPES = "ROS2_HUMBLE"


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


def bag_to_log(path: Path, target: Path, ship: str) -> dict[str, str]:
    """Every topic of a bag into one MCAP file, in the bag's order and by its clock.

    `target` appears when the log is whole. Returns the topics that had to be left out, with the
    reason: those whose definition nobody has. Raises LogUnreadable.
    """
    from rosbags.highlevel import AnyReader, AnyReaderError
    from rosbags.rosbag1 import ReaderError as Reader1Error
    from rosbags.rosbag2 import ReaderError as Reader2Error
    from rosbags.typesys import Stores, get_typestore

    source = path.parent if path.suffix.lower() == SQLITE else path
    try:
        with (
            files.whole(target) as partial,
            AnyReader([source], default_typestore=get_typestore(Stores[DEFAULT_TYPES])) as reader,
            partial.open("wb") as stream,
        ):
            left_out = _write(reader, stream, ship, path.name)
            stream.flush()
            os.fsync(stream.fileno())
    except (AnyReaderError, Reader1Error, Reader2Error, OSError) as error:
        if isinstance(error, OSError) and error.errno in MENDABLE and error.filename == str(target):
            raise  # it is the log that cannot be written
        raise LogUnreadable(
            f"{path.name} cannot be read as a ROS bag: {error}.",
            hint="a ROS 2 bag is the folder with its metadata.yaml; `ros2 bag reindex` makes one "
            "anew, `rosbag reindex` mends a ROS 1 bag that was cut off.",
        ) from error
    return left_out


def _write(reader, stream, ship: str, name: str) -> dict[str, str]:
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
    channels: dict[tuple[int, int], int] = {}  # of each connection in each file of the bag
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
    kept = [c for c in reader.connections if _key(c) in channels and c.topic not in left_out]
    if not kept:
        raise LogUnreadable(
            f"{name} has no topic whose messages can be read. Topics: {listed(reader.topics)}.",
            hint="record it as MCAP, which keeps the definitions.",
        )
    for count, (connection, time, data) in enumerate(reader.messages(connections=kept)):
        cdr = data if reader.is2 else bytes(store.ros1_to_cdr(data, connection.msgtype))
        writer.add_message(channels[_key(connection)], time, cdr, time, count % 2**32)
    writer.finish()
    return left_out


def _key(connection) -> tuple[int, int]:
    return id(connection.owner), connection.id
