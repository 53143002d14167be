"""Logs in: an MCAP file to one table a topic, with a report of what was lost on the way.

A clean log goes through Rerun's reader (`rerun_route`), what that cannot take through the packages
of each encoding (`salvage`). Both give the same tables.
"""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import polars as pl

from shiplog.exceptions import LogUnreadable
from shiplog.logs.decoding.tables import Tables, Tally
from shiplog.logs.health import dates, faults, stored_findings
from shiplog.logs.health.health_report import Finding
from shiplog.logs.mcap_file import scan
from shiplog.logs.mcap_file.container import Survey
from shiplog.logs.reading import preflight, rerun_route, salvage
from shiplog.logs.reading.sample import sample

HASHED_BYTES = 4 << 20  # bytes of a log that are read at a time for its hash


@dataclass(frozen=True, slots=True)
class Topic:
    """One topic as the log describes it. `messages` is None when nothing has counted them."""

    name: str
    schema: str
    encoding: str
    schema_encoding: str
    messages: int | None
    metadata: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Contents:
    """What a log holds, without its messages."""

    path: Path
    size: int
    topics: dict[str, Topic]
    metadata: dict[str, dict[str, str]]  # metadata records by name, such as "voyage"
    library: str
    profile: str
    source: Path | None = None  # the file or folder that it was converted from, if any

    @property
    def origin(self) -> Path:
        """What a user has of it."""
        return self.source or self.path

    @cached_property
    def sha256(self) -> str:
        """Of the bytes that were there when the log was opened; 0.6 s a gigabyte. Of a log that
        was converted: those of what it was made of."""
        return hash_of(self.path, self.size) if self.source is None else hash_of(self.source)


def hash_of(path: Path, size: int | None = None) -> str:
    """SHA-256 of a file, or of its first bytes; of a folder that of its files and their names."""
    digest = hashlib.sha256()
    if path.is_dir():
        for inside in sorted(p for p in path.rglob("*") if p.is_file()):
            digest.update(f"{inside.relative_to(path).as_posix()}\n{hash_of(inside)}\n".encode())
        return digest.hexdigest()
    size = path.stat().st_size if size is None else size
    with path.open("rb") as stream:
        for begin in range(0, size, HASHED_BYTES):
            digest.update(stream.read(min(HASHED_BYTES, size - begin)))
    return digest.hexdigest()


@dataclass(frozen=True, slots=True)
class Health:
    """What could be read: messages that are whole in the file. Lost are those that are not, and
    those that are, but whose bytes do not fit their schema; None when the log does not say how many
    it had."""

    route: str  # "fast": all of it, and every byte vouched for; else "salvage"
    messages_read: int
    messages_lost: int | None
    chunks: int
    chunks_lost: int
    findings: tuple[Finding, ...]
    undecodable: dict[str, str]  # topic -> reason
    restarted: Mapping[str, float] = field(default_factory=dict)  # topic -> s, see `faults`


@dataclass(frozen=True, slots=True)
class Reading:
    """A log as tables: log_time, publish_time, stamp [ns], then one column a field."""

    contents: Contents
    health: Health
    frames: dict[str, pl.DataFrame]  # by topic, sorted by log_time


def contents(path: str | Path) -> Contents:
    """Topics, counts and metadata: from the summary alone when there is a sound one."""
    found = scan.survey(Path(path))
    stated = found.statistics
    return _contents(found, stated.channel_message_counts if stated else found.counts)


def read(
    path: str | Path, wanted: Mapping[str, Collection[str]] | None = None, others: bool = False
) -> Reading:
    """Everything that can be read of a log, and what cannot.

    wanted  topic -> field paths; None is every topic and every field but bytes. A path may index
            a list (`position_covariance[0]`) and step into JSON inside a text (`value.lon`).
    others  the topics that are not in `wanted` are read as well, for their times alone
    """
    path = Path(path)
    tables = Tables(scan.survey(path), wanted, others)
    tally = left = None
    quick: set[str] = set()
    if rerun_route.worth_it(tables):
        sound = preflight.checked(tables)
        if sound is None:  # not for Rerun: all of it, from the beginning
            tables = Tables(scan.survey(path), wanted, others)
        else:
            tally, quick = sound
            quick = quick | rerun_route.read_most(tables, tally, quick)
            left = tables.topics(tally) - quick
            if left:  # the check has walked through it
                tables.found = scan.survey(path)
    if tally is None or left:
        tally = salvage.read_all(tables, left)
    frames = tables.finish(first=quick)
    _refuse_nothing(tables, tally, frames)
    health = _health(tables, tally, frames)
    return Reading(_contents(tables.found, tally.counts), health, frames)


def fields(
    path: str | Path, topics: Iterable[str] | None = None
) -> dict[str, dict[str, pl.DataType]]:
    """Leaf fields of each topic and their types, JSON inside texts included."""
    return sample(scan.survey(Path(path)), topics)


def _contents(found: Survey, counts: Mapping[int, int]) -> Contents:
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
    return Contents(
        found.path, found.size, topics, found.metadata, found.header.library, found.header.profile
    )


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


def _health(tables: Tables, tally: Tally, frames: Mapping[str, pl.DataFrame]) -> Health:
    found, broken = tables.found, sum(tables.failed.values())
    count = sum(tally.counts.values())
    damaged = bool(found.losses or tally.orphans)
    missing: int | None = None if damaged else 0
    if found.statistics is not None:
        missing = max(found.statistics.message_count - count, 0)
    # what does not fit its schema is lost, too
    lost = None if missing is None else missing + broken
    topics = {number: channel.topic for number, channel in found.channels.items()}
    findings = faults.losses(found.losses, tally.first, missing, topics)
    findings += faults.appended(found.sections)
    findings += faults.left_out(tally.orphans, tables)
    order = [(found.channels[n].topic, one) for n, one in tally.order.items()]
    again = faults.restarted(order, frames)
    findings += faults.disorder(order, again)
    suspects = {topic: times for topic, frame in frames.items() if (times := faults.twice(frame))}
    twice = salvage.repeated(found.path, suspects) if suspects else {}
    for topic, frame in frames.items():
        findings += faults.repeats(topic, frame, tally.first or 0, twice.get(topic, []))
    stored = stored_findings.of_record(found.metadata)
    findings += faults.clocks(frames, stored)
    noted = {channel.topic: channel.metadata for channel in found.channels.values()}
    findings += dates.impossible(frames, noted)
    findings += stored
    whole = found.statistics is not None and lost == 0 and not damaged and not found.unvouched
    return Health(
        "fast" if whole else "salvage", count, lost, found.chunks, found.chunks_lost,
        tuple(findings), tables.undecodable, again,
    )  # fmt: skip


def _refuse_nothing(tables: Tables, tally: Tally, frames: Mapping[str, pl.DataFrame]) -> None:
    """Say why when a log gives nothing at all."""
    found, count = tables.found, sum(tally.counts.values())
    reasons = sorted(set(tables.undecodable.values()))
    reasons += ["their bytes do not fit their schema"] * bool(tables.failed)
    reasons += ["they are too large"] * bool(tables.too_large)
    reasons += ["they are more than a log of its size can hold"] * bool(tables.too_many)
    if reasons and not frames:
        raise LogUnreadable(
            f"{found.path} has {count} messages, but none can be decoded: {', '.join(reasons)}.",
            hint="shiplog reads protobuf, JSON, and ROS messages with their definitions (cdr with "
            "ros2msg or ros2idl, ros1 with ros1msg); convert it or record again.",
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
