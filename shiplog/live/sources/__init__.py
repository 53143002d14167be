"""Where messages come from: one file a source, one line each in SOURCES."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from shiplog.exceptions import UsageError
from shiplog.live.sources.base import Source

Wanted = Mapping[str, Collection[str]]
Place = Mapping[str, Any] | None


@dataclass(frozen=True)
class Kind:
    """What a user writes, whether that is it, and how it is opened."""

    written: str
    fits: Callable[[str], bool]
    opened: Callable[[str, Wanted, Place], Source]


def _address(*schemes: str) -> Callable[[str], bool]:
    return lambda text: text.split("://", 1)[0] in schemes and "://" in text


def _foxglove(text: str, wanted: Wanted, place: Place) -> Source:
    from shiplog.live.sources.foxglove import Foxglove

    return Foxglove(text, wanted)


def _socket(text: str, wanted: Wanted, place: Place) -> Source:
    from shiplog.live.sources.socket_lines import SocketLines

    return SocketLines(text)


def _folder(text: str, wanted: Wanted, place: Place) -> Source:
    from shiplog.live.sources.rotated_folder import RotatedFolder

    return RotatedFolder(Path(text), wanted, place)


def _mcap(text: str, wanted: Wanted, place: Place) -> Source:
    from shiplog.live.sources.mcap_file import McapFile

    return McapFile(Path(text), wanted, place)


def _text(text: str, wanted: Wanted, place: Place) -> Source:
    from shiplog.live.sources.text_file import TextFile

    return TextFile(Path(text), place)


SOURCES = (
    Kind("ws://HOST:PORT, a Foxglove WebSocket", _address("ws", "wss"), _foxglove),
    Kind("udp://HOST:PORT or tcp://HOST:PORT, NMEA 0183 or Signal K", _address("udp", "tcp"),
         _socket),
    Kind("a folder that a recorder rotates", lambda text: Path(text).is_dir(), _folder),
    Kind("an MCAP file", lambda text: ".mcap" in Path(text).suffixes[-2:], _mcap),
    Kind("a text file of NMEA 0183 or Signal K", lambda text: Path(text).is_file(), _text),
)  # fmt: skip


def opened(text: str, wanted: Wanted, place: Place = None) -> Source:
    """The source that a user means. Raises UsageError where it is none."""
    for kind in SOURCES:
        if kind.fits(text):
            return kind.opened(text, wanted, place)
    raise UsageError(
        f"{text} is no source that can be watched.",
        hint="give " + "; ".join(kind.written for kind in SOURCES) + ".",
    )
