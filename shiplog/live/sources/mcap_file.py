"""An MCAP file that a recorder is writing, or one that is whole: a replay."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from shiplog.exceptions import ShiplogError
from shiplog.live.messages import Decoding
from shiplog.live.sources.base import Arrived
from shiplog.logs.mcap_file.growing import GrowingFile

BACK_BYTES = 8 << 20  # before the place where a watch goes on: minutes of messages for its rows


class McapFile:
    """Follows one file. A file that is shorter than before, or another file under its name, is read
    from its beginning."""

    def __init__(
        self, path: Path, wanted: Mapping[str, Collection[str]], at: Mapping[str, Any] | None = None
    ) -> None:
        self.path, self.wanted, self.name, self.live = path, wanted, path.name, False
        self._begin()
        if at and at.get("file") == path.name and at.get("identity") == list(self._identity or ()):
            self._pass_over(int(at["byte"]) - BACK_BYTES)

    def _begin(self) -> None:
        self.file = GrowingFile(self.path)
        self.decoding = Decoding(self.file.found, self.wanted)
        self._identity = self._stat()
        self._losses = self._failed = 0

    def _stat(self) -> tuple[int, int] | None:
        try:
            known = self.path.stat()
        except OSError:
            return None
        return known.st_dev, known.st_ino

    def _pass_over(self, until: int) -> None:
        """Read the descriptions before a byte, and none of the messages."""
        while self.file.at < until and not self.file.damaged:
            before = self.file.at
            for _ in self.file.look():
                pass
            if self.file.at == before:
                return

    def look(self, clock: int) -> Arrived:
        notes: list[str] = []
        anew = self._replaced(notes)
        try:
            batches = list(self.file.look())
        except OSError as error:
            return Arrived(notes=(*notes, f"{self.name} cannot be read: {error.strerror}."),
                           anew=anew)  # fmt: skip
        except ShiplogError as error:
            return Arrived(notes=(*notes, error.message), anew=anew)
        if self.decoding.found is not self.file.found:  # another log was appended
            self.decoding = Decoding(self.file.found, self.wanted)
        frames = self.decoding.frames(batches)
        found = self.file.found
        for loss in found.losses[self._losses :]:
            notes.append(f"{self.name} {loss.reason}, at byte {loss.offset}: it is left out.")
        self._losses = len(found.losses)
        failed = self.decoding.failed
        if failed > self._failed:
            notes.append(f"{failed - self._failed} messages of {self.name} fit no schema.")
        self._failed = failed
        topics = frozenset(channel.topic for channel in found.channels.values())
        return Arrived(frames, tuple(notes), found.metadata, topics, anew, self.file.ended)

    def _replaced(self, notes: list[str]) -> bool:
        now = self._stat()
        if now is None:
            notes.append(f"{self.name} is not there.")
            return False
        size = self.path.stat().st_size
        if now == self._identity and size >= self.file.at:
            return False
        began = self._identity is not None
        if began:
            notes.append(f"{self.name} was " + (
                "replaced" if now != self._identity else "cut short") +
                ": it is read from its beginning.")  # fmt: skip
        self._begin()
        return began

    def place(self) -> dict[str, Any]:
        return {"file": self.path.name, "identity": list(self._identity or ()),
                "byte": self.file.at}  # fmt: skip

    def close(self) -> None:
        """Nothing is held open."""
