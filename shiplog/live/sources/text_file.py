"""A text of NMEA 0183 or Signal K that a logger is writing."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from shiplog.live.sources.base import Arrived
from shiplog.live.sources.text_lines import TextLines

READ_BYTES = 1 << 16  # of one look: a minute of lines or more
BACK_BYTES = 1 << 20  # before the place where a watch goes on


class TextFile:
    """Follows one file; one that is cut short or replaced is read from its beginning."""

    def __init__(self, path: Path, at: Mapping[str, Any] | None = None) -> None:
        self.path, self.name, self.live = path, path.name, False
        self._begin()
        if at and at.get("file") == path.name and at.get("identity") == list(self._identity or ()):
            self.byte = max(int(at["byte"]) - BACK_BYTES, 0)

    def _begin(self) -> None:
        self.byte = 0
        self.text = TextLines(self.name)
        self._identity = self._stat()

    def _stat(self) -> tuple[int, int] | None:
        try:
            known = self.path.stat()
        except OSError:
            return None
        return known.st_dev, known.st_ino

    def look(self, clock: int) -> Arrived:
        notes: list[str] = []
        try:
            size = self.path.stat().st_size
            anew = size < self.byte or self._stat() != self._identity
            if anew:
                notes.append(f"{self.name} was cut short or replaced: it is read from its "
                             "beginning.")  # fmt: skip
                self._begin()
            with self.path.open("rb") as stream:
                stream.seek(self.byte)
                data = stream.read(READ_BYTES)
        except OSError as error:
            return Arrived(notes=(f"{self.name} cannot be read: {error.strerror}.",))
        self.byte += len(data)
        frames, why = self.text.messages(self.text.split(data))
        if why and data:
            notes.append(why)
        return Arrived(frames, tuple(notes), topics=frozenset(self.text.given), anew=anew)

    def place(self) -> dict[str, Any]:
        return {"file": self.path.name, "identity": list(self._identity or ()), "byte": self.byte}

    def close(self) -> None:
        """Nothing is held open."""
