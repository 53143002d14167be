"""Logs in: an MCAP file to one table a topic, with a report of what was lost on the way.

Rerun's reader is not used here although it is fast: it never returns from a corrupt zstd chunk and
ends the whole process on a payload it cannot decode, such as an enum number newer than the schema.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import polars as pl

from shiplog.exceptions import LogUnreadable
from shiplog.findings import Finding

from . import container, faults
from .gather import DIGEST, Gatherer
from .sample import sample

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic as the log describes it. `messages` is None when nothing has counted them."""

    name: str
    schema: str
    encoding: str
    schema_encoding: str
    messages: int | None
    metadata: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Contents:
    """What a log holds, without its messages."""

    path: Path
    sha256: str
    size: int
    topics: dict[str, Topic]
    metadata: dict[str, dict[str, str]]  # metadata records by name, such as "voyage"
    library: str
    profile: str


@dataclass(frozen=True, slots=True)
class Health:
    """What could be read. `messages_lost` is None when the log does not say how many it had."""

    route: str  # "fast": all of it, and every byte vouched for; else "salvage"
    messages_read: int
    messages_lost: int | None
    chunks: int
    chunks_lost: int
    findings: tuple[Finding, ...]
    undecodable: dict[str, str]  # topic -> reason


@dataclass(frozen=True, slots=True)
class Reading:
    """A log as tables: log_time, publish_time, stamp [ns], then one column a field."""

    contents: Contents
    health: Health
    frames: dict[str, pl.DataFrame]  # by topic, sorted by log_time


def contents(path: str | Path) -> Contents:
    """Topics, counts and metadata: from the summary alone when there is a sound one."""
    found = container.survey(Path(path))
    if found.summary is not None and found.summary.statistics is not None:
        return _contents(found, found.summary.statistics.channel_message_counts)
    gatherer = Gatherer(found, {})
    for block in container.blocks(found):
        gatherer.take(block, decode=False)
    return _contents(found, gatherer.counts)


def read(path: str | Path, wanted: Mapping[str, Collection[str]] | None = None) -> Reading:
    """Everything that can be read of a log, and what cannot.

    wanted  topic -> field paths; None is every topic and every field but bytes. A path may index
            a list (`position_covariance[0]`) and step into JSON inside a text (`value.lon`).
    """
    found = container.survey(Path(path))
    gatherer = Gatherer(found, wanted)
    for block in container.blocks(found):
        gatherer.take(block)
    frames = {name: table.finish() for name, table in gatherer.tables.items() if table.parts}
    count = sum(gatherer.counts.values())
    _refuse_nothing(found, gatherer, count, frames)
    health = _health(found, gatherer, frames)
    frames = {name: frame.drop(DIGEST) for name, frame in frames.items()}
    return Reading(_contents(found, gatherer.counts), health, frames)


def fields(
    path: str | Path, topics: Iterable[str] | None = None
) -> dict[str, dict[str, pl.DataType]]:
    """Leaf fields of each topic and their types, JSON inside texts included."""
    return sample(container.survey(Path(path)), topics)


def _contents(found: container.Survey, counts: Mapping[int, int]) -> Contents:
    topics: dict[str, Topic] = {}
    for number, channel in found.channels.items():
        schema = found.schemas.get(channel.schema_id)
        here = Topic(
            channel.topic,
            schema.name if schema else "",
            channel.message_encoding,
            schema.encoding if schema else "",
            counts.get(number, 0),
            channel.metadata,
        )
        known = topics.get(channel.topic)
        topics[channel.topic] = here if known is None else _merged(known, here)
    with found.path.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    return Contents(
        found.path, digest, found.size, topics, found.metadata,
        found.header.library, found.header.profile,
    )  # fmt: skip


def _merged(one: Topic, other: Topic) -> Topic:
    """One topic written through two channels."""

    def both(a: str, b: str) -> str:
        return a if b in a.split(", ") else f"{a}, {b}"

    return Topic(
        one.name,
        both(one.schema, other.schema),
        both(one.encoding, other.encoding),
        both(one.schema_encoding, other.schema_encoding),
        (one.messages or 0) + (other.messages or 0),
        one.metadata | other.metadata,
    )


def _health(
    found: container.Survey, gatherer: Gatherer, frames: Mapping[str, pl.DataFrame]
) -> Health:
    count = sum(gatherer.counts.values())
    statistics = found.summary.statistics if found.summary else None
    damaged = bool(found.losses or gatherer.orphans or gatherer.broken_blocks)
    lost: int | None = None if damaged else 0
    if statistics is not None:
        lost = max(statistics.message_count - count, 0)
    findings = faults.losses(found.losses, gatherer.first, lost)
    findings += _undecoded(gatherer)
    findings += faults.disorder(gatherer.order)
    for topic, frame in frames.items():
        findings += faults.repeats(topic, frame, gatherer.first or 0)
    findings += faults.clocks(frames)
    whole = statistics is not None and lost == 0 and not damaged and not found.unvouched
    return Health(
        "fast" if whole else "salvage", count, lost, found.chunks, found.chunks_lost,
        tuple(findings), gatherer.undecodable,
    )  # fmt: skip


def _undecoded(gatherer: Gatherer) -> list[Finding]:
    """Messages whose bytes arrived whole but do not fit their schema."""
    findings = []
    if gatherer.orphans:
        sentence = f"{gatherer.orphans} messages belong to channels whose description is lost."
        findings.append(Finding("crc", "log", sentence, value=float(gatherer.orphans)))
    for topic, table in gatherer.tables.items():
        if table.failed:
            sentence = f"{table.failed} messages on {topic} do not fit their schema; left out."
            findings.append(Finding("crc", topic, sentence, value=float(table.failed)))
    return findings


def _refuse_nothing(
    found: container.Survey, gatherer: Gatherer, count: int, frames: Mapping[str, pl.DataFrame]
) -> None:
    """Say why when a log gives nothing at all."""
    if gatherer.undecodable and not frames:
        reasons = ", ".join(sorted(set(gatherer.undecodable.values())))
        raise LogUnreadable(
            f"{found.path} has {count} messages, but none can be decoded: {reasons}.",
            hint="shiplog reads protobuf, ROS 2 CDR (ros2msg) and JSON; convert or record again.",
        )
    if count:
        return
    if found.losses:
        loss = found.losses[0]
        raise LogUnreadable(
            f"No message of {found.path} can be recovered: at byte {loss.offset} it {loss.reason}.",
            hint="copy the original again; if it is the original, the recording is lost.",
        )
    raise LogUnreadable(
        f"{found.path} holds no messages.", hint="check that the recorder was subscribed to topics."
    )
