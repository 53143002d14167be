"""A folder into which a recorder writes one file after another.

The files are read in the order of their names' last change; the newest is followed until another
one appears and no more comes of it. Hidden files are none. Nothing is written into the folder.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from shiplog.live.sources.base import Arrived, Source
from shiplog.live.sources.mcap_file import McapFile
from shiplog.live.sources.text_file import TextFile

TEXTS = (".nmea", ".log", ".txt", ".jsonl", ".json")


class RotatedFolder:
    """The files of a folder as one stream. Where the messages go on, it is one voyage; a pause
    between files that is longer than a watch bridges makes two."""

    def __init__(
        self, path: Path, wanted: Mapping[str, Collection[str]], at: Mapping[str, Any] | None = None
    ) -> None:
        self.path, self.wanted, self.name, self.live = path, wanted, f"{path.name}/", False
        self.done: set[str] = set()
        self.now: Source | None = None
        self._file = ""
        self._metadata: dict[str, Mapping[str, str]] = {}
        self._topics: frozenset[str] = frozenset()
        if at and at.get("folder") == path.name:
            self.done = set(at.get("done", ()))
            inside = at.get("inside") or {}
            file = path / str(inside.get("file", ""))
            if inside.get("file") and file.is_file():
                self.now, self._file = self._opened(file, inside), file.name

    def _opened(self, path: Path, at: Mapping[str, Any] | None = None) -> Source:
        if ".mcap" in path.suffixes[-2:]:
            return McapFile(path, self.wanted, at)
        return TextFile(path, at)

    def _files(self) -> list[Path]:
        found = []
        for path in self.path.glob("[!.]*"):
            if ".mcap" in path.suffixes[-2:] or path.suffix.lower() in TEXTS:
                try:
                    found.append((path.stat().st_mtime_ns, path.name, path))
                except OSError:  # it was removed meanwhile
                    continue
        return [path for _, _, path in sorted(found)]

    def look(self, clock: int) -> Arrived:
        try:
            files = self._files()
        except OSError as error:
            return Arrived(notes=(f"{self.name} cannot be read: {error.strerror}.",))
        waiting = [p for p in files if p.name not in self.done and p.name != self._file]
        if self.now is None:
            if not waiting:
                return Arrived()
            self.now, self._file = self._opened(waiting[0]), waiting[0].name
        arrived = self.now.look(clock)
        self._metadata |= arrived.metadata
        self._topics |= arrived.topics
        if arrived.count == 0 and (arrived.ended or (waiting and not self._grows())):
            self.done.add(self._file)
            self.now.close()
            self.now, self._file = None, ""
            self.done &= {p.name for p in files}  # what the recorder removed is forgotten
        return Arrived(arrived.frames, arrived.notes, self._metadata, self._topics, arrived.anew)

    def _grows(self) -> bool:
        """Whether the file that is read holds more than was read."""
        try:
            size = (self.path / self._file).stat().st_size
        except OSError:
            return False
        place = self.now.place() if self.now is not None else {}
        return size > int(place.get("byte", 0)) and not self._stuck(place, size)

    def _stuck(self, place: Mapping[str, Any], size: int) -> bool:
        """Whether half a record stands at the end of a file that was left like that."""
        before, self._before = getattr(self, "_before", None), (self._file, place["byte"], size)
        return before == self._before

    def place(self) -> dict[str, Any]:
        inside = self.now.place() if self.now is not None else {}
        return {"folder": self.path.name, "done": sorted(self.done), "inside": inside}

    def close(self) -> None:
        if self.now is not None:
            self.now.close()
