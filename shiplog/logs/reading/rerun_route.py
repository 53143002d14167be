"""The fast route: Rerun's reader in a process of its own, for logs that a preflight finds clean.

Rerun never returns from a corrupt zstd chunk, passes over wrong checksums and unchunked messages in
silence, and ends its process on a payload it cannot decode, such as an enum number newer than the
schema. So it sees only logs in which every chunk was checked, its answer must have every row that
the log counts, and whatever it does to its process leaves the topic to `salvage`.
"""

from __future__ import annotations

import atexit
import contextlib
import json
import logging
import os
import threading
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from shiplog.logs.decoding.tables import Tables, Tally
from shiplog.machine import child, files, limits, reading_limits

if TYPE_CHECKING:
    import subprocess

log = logging.getLogger(__name__)

WORKER = Path(__file__).with_name("rerun_worker.py")
LEAST_MESSAGES = (
    20_000  # wanted messages: the process takes as long to start as 35 000 take to decode here,
)
LEAST_WARM = 2_000  # which the next log gets back; once it runs, a request costs 15 ms and no more
START_TIMEOUT_S = 30.0  # s, of which it needs 1 to start, more on a busy machine
PACE = 20_000  # messages/s that must at least come back; 600 000 do
MAP = {"key", "value"}
ENCODINGS = {("protobuf", "protobuf"), ("cdr", "ros2msg")}


class Mismatch(Exception):
    """Rerun gave another type than the schema states."""


def worth_it(tables: Tables) -> bool:
    """Whether a log says that it has enough wanted messages of the right kind, and not too many."""
    counts = tables.found.statistics.channel_message_counts if tables.found.statistics else {}
    least = LEAST_WARM if worker().runs else LEAST_MESSAGES
    return least <= sum(counts[number] for number in suitable(tables)) <= tables.room


def read_most(tables: Tables, tally: Tally, filled: Collection[str] = ()) -> set[str]:
    """Fill the tables that Rerun gives whole, but for those already `filled`; name their topics."""
    asked: dict[str, list[str]] = {}
    expected: dict[str, int] = {}
    for number, leaves in suitable(tables).items():
        topic = tables.found.channels[number].topic
        if tally.counts.get(number) and topic not in filled:
            asked[topic], expected[topic] = leaves, tally.counts[number]
    done: set[str] = set()
    if not asked:
        return done
    with files.temporary_folder() as folder:
        seconds = START_TIMEOUT_S + sum(expected.values()) / PACE
        request = {"log": str(tables.found.path.resolve()), "folder": str(folder), "topics": asked}
        most = {"seconds": seconds, "bytes": reading_limits.memory(tables.found.size)}
        rows = worker().ask(request | most, seconds).get("rows", [])
        for number, (topic, got) in enumerate(zip(asked, rows, strict=False)):
            if got == expected[topic] and _take(tables, topic, folder / f"{number}.arrow"):
                done.add(topic)
    for topic in asked.keys() - done:
        log.info("%s: %s is left to the slow route", tables.found.path, topic)
    return done


def suitable(tables: Tables) -> dict[int, list[str]]:
    """Leaves to ask Rerun for, by channel: those with a schema, alone on their topic."""
    found = tables.found
    alone = Counter(channel.topic for channel in found.channels.values())
    leaves: dict[int, list[str]] = {}
    for number, channel in found.channels.items():
        schema = found.schemas.get(channel.schema_id)
        kind = (channel.message_encoding, schema.encoding if schema else "")
        counts = found.statistics.channel_message_counts if found.statistics else {}
        fits = kind in ENCODINGS and number not in tables.odd
        if not fits or alone[channel.topic] > 1 or not counts.get(number):
            continue
        reader = tables.decoder(channel)
        if reader is not None:
            leaves[number] = tables.leaves(channel.topic, reader) or []
    return leaves


def _take(tables: Tables, topic: str, file: Path) -> bool:
    """Add one topic's rows, in the types that its schema states."""
    channel = next(c for c in tables.found.channels.values() if c.topic == topic)
    reader = tables.decoder(channel)
    if reader is None:
        return False
    try:
        frame = pl.read_ipc(file)
        frame = frame.select(
            stated(pl.col(name), dtype, reader.layout.get(name, dtype)).alias(name)
            for name, dtype in frame.schema.items()
        )
    except (OSError, Mismatch, pl.exceptions.PolarsError) as error:
        log.info("%s: %s", topic, error)
        return False
    logged, published = (frame.drop_in_place(name) for name in (":log_time", ":publish_time"))
    tables.add(topic, frame, logged, published)
    return True


def stated(column: pl.Expr, have: Any, want: Any) -> pl.Expr:
    """A column of Rerun's as the type `want`; what is no plain widening is a `Mismatch`."""
    if isinstance(want, pl.List) and isinstance(have, pl.List):  # never null: not sent is empty
        if isinstance(want.inner, pl.Struct) and {f.name for f in want.inner.fields} == MAP:
            raise Mismatch("a map, which Rerun gives in any order")
        nested = have.inner != want.inner or isinstance(want.inner, (pl.List, pl.Struct))
        inner = stated(pl.element(), have.inner, want.inner) if nested else None
        return (column if inner is None else column.list.eval(inner)).fill_null([])
    if have == want and not isinstance(want, pl.Struct):
        return column
    if have == pl.Float32 and want == pl.Float64:
        return column.cast(want)
    if isinstance(have, pl.Struct):
        inside = {field.name: field.dtype for field in have.fields}
        if want == pl.Int32 and inside == {"name": pl.String, "value": pl.Int32}:
            return column.struct.field("value")  # an enum
        if isinstance(want, pl.Struct) and inside.keys() >= {f.name for f in want.fields}:
            fields = [
                stated(column.struct.field(f.name), inside[f.name], f.dtype).alias(f.name)
                for f in want.fields
            ]
            return pl.when(column.is_not_null()).then(pl.struct(fields))
    raise Mismatch(f"{have} instead of {want}")


class Worker:
    """Rerun's process: started when it is needed, started again when it has died."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[str] | None = None

    @property
    def runs(self) -> bool:
        return self._process is not None and self._process.poll() is None

    def ask(self, request: dict[str, Any], seconds: float) -> dict[str, Any]:
        """Its answer; nothing when it died, or had to be ended after these seconds."""
        with self._lock:
            try:
                process = self._running()
                assert process.stdin and process.stdout
                with child.patience(process, seconds):
                    process.stdin.write(json.dumps(request) + "\n")
                    process.stdin.flush()
                    reply = json.loads(process.stdout.readline())
            except (OSError, ValueError):
                self._stop()
                return {}
            except BaseException:  # an answer that nobody waited for must not meet the next request
                self._stop()
                raise
        if "error" in reply:
            log.info("Rerun: %s", reply["error"])
        return reply

    def start(self) -> None:
        """Begin to load Rerun, so that the first request need not wait for it."""
        with self._lock, contextlib.suppress(OSError):
            self._running()

    def stop(self) -> None:
        with self._lock:
            self._stop()

    def _running(self) -> subprocess.Popen[str]:
        if self._process is None or not self.runs:
            self._stop()
            with limits.lifted():
                self._process = child.script(WORKER)
        return self._process

    def _stop(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        child.stop(process, patience_s=0.0)
        log.debug("Rerun's process ended with %d", process.returncode)


_workers: dict[int, Worker] = {}  # by process: one that forks leaves its own alone


def worker() -> Worker:
    """This process's worker."""
    return _workers.setdefault(os.getpid(), Worker())


@atexit.register
def _leave() -> None:
    worker().stop()
