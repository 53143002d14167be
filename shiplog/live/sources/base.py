"""What a source of messages is to the watch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import polars as pl


@dataclass(frozen=True)
class Arrived:
    """What one look at a source brought.

    frames    topic → log_time, publish_time, stamp [ns] and the wanted fields
    notes     what happened to the source, a sentence each
    metadata  records of the log, such as "voyage"
    topics    all that it is known to hold, also silent ones
    anew      another voyage begins with these messages
    ended     nothing comes any more
    """

    frames: Mapping[str, pl.DataFrame] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    metadata: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    topics: frozenset[str] = frozenset()
    anew: bool = False
    ended: bool = False

    @property
    def count(self) -> int:
        return sum(frame.height for frame in self.frames.values())


class Source(Protocol):
    """Looked at again and again. Nothing of it waits: what is not there yet comes with the next
    look. It writes nothing where the recorder writes.

    name    what a user calls it
    live    its messages are as of now, so that its clock can be compared with this machine's
    """

    name: str
    live: bool

    def look(self, clock: int) -> Arrived:
        """What came since; `clock` is this machine's time [ns]."""
        ...

    def place(self) -> dict[str, Any]:
        """Where another process would go on."""
        ...

    def close(self) -> None: ...
