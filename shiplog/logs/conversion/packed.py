"""Files that are compressed as a whole, unpacked into a temporary folder for the time of a block.

A few kilobytes can hold gigabytes: no more is unpacked than a log of that size can have.
"""

from __future__ import annotations

import bz2
import gzip
import lzma
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import lz4.frame
import zstandard

from shiplog.exceptions import LogUnreadable
from shiplog.machine import files, reading_limits

PIECE = 4 << 20  # bytes that are unpacked at a time
# Bytes of what may come out: tables and sentences are packed to a tenth, zeros to a thousandth.
LEAST_ROOM, MOST_RATIO = 1 << 30, 100
ZIP = b"PK\x03\x04"
DOCUMENTS = (
    "[content_types].xml",
    "mimetype",
    "xl/",
)  # in the zip files that are spreadsheets or books
MOST_FILES = 10_000  # in a zip
ENDINGS = (".gz", ".zst", ".zstd", ".bz2", ".xz", ".lz4", ".zip")


def _zstd(stream: IO[bytes]) -> Any:
    return zstandard.ZstdDecompressor().stream_reader(stream, read_across_frames=True)


OPENERS: dict[bytes, Callable[[IO[bytes]], Any]] = {  # how a packed file begins
    b"\x1f\x8b\x08": lambda stream: gzip.GzipFile(fileobj=stream), b"\x28\xb5\x2f\xfd": _zstd,
    b"BZh": bz2.BZ2File, b"\xfd7zXZ\x00": lzma.LZMAFile, b"\x04\x22\x4d\x18": lz4.frame.open,
}  # fmt: skip
DAMAGE = (OSError, EOFError, ValueError, RuntimeError, NotImplementedError, zlib.error,
          lzma.LZMAError, zstandard.ZstdError, zipfile.BadZipFile)  # fmt: skip


def is_packed(path: Path) -> bool:
    """Whether a file is another one, compressed; a spreadsheet is none, though it is a zip."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        start = stream.read(8)
    if start.startswith(ZIP):
        return not _is_document(path)
    return any(start.startswith(magic) for magic in OPENERS)


def inner_name(path: Path) -> str:
    """What the file in it is called: `trip.csv` of `trip.csv.gz`."""
    return path.stem if path.suffix.lower() in ENDINGS else path.name


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """The file itself, or what is in it: one file, or of a zip with several a folder.

    Raises LogUnreadable where it is damaged, or holds more than a log of its size can.
    """
    if not is_packed(path):
        yield path
        return
    with files.temporary_folder() as folder:
        try:
            inside = _of_zip(path, folder) if zipfile.is_zipfile(path) else _alone(path, folder)
        except DAMAGE as error:
            if getattr(error, "errno", None):
                raise
            raise LogUnreadable(
                f"{path.name} cannot be unpacked: {' '.join(str(error).split())[:100]}.",
                hint="copy the original again, or unpack it and give what is in it.",
            ) from error
        reading_limits.grown(inside)
        yield inside


def _alone(path: Path, folder: Path) -> Path:
    target = folder / inner_name(path)
    room = _room(path)
    with path.open("rb") as stream:
        start = stream.read(8)
        stream.seek(0)
        opener = next(opens for magic, opens in OPENERS.items() if start.startswith(magic))
        with opener(stream) as source, target.open("wb") as out:
            _copy(source, out, room, path)
    return target


def _of_zip(path: Path, folder: Path) -> Path:
    """Its only file, or the folder with all of them; names that lead out of it stay in it."""
    room = _room(path)
    with zipfile.ZipFile(path) as archive:
        inside = [one for one in archive.infolist() if not one.is_dir()]
        if len(inside) > MOST_FILES or sum(one.file_size for one in inside) > room:
            raise _too_much(path)
        made = []
        for one in inside:
            parts = [p for p in Path(one.filename).parts if p not in ("..", "/", "\\")]
            if not parts or any(p.startswith((".", "__MACOSX")) for p in parts):
                continue
            target = folder.joinpath(path.stem, *parts)
            target.parent.mkdir(parents=True, exist_ok=True)
            with archive.open(one) as source, target.open("wb") as out:
                room -= _copy(source, out, room, path)
            made.append(target)
    if not made:
        raise LogUnreadable(f"{path.name} holds no file.", hint="pack the logs again.")
    if len(made) == 1:
        return made[0]
    top = folder / path.stem
    only = list(top.iterdir())
    return only[0] if len(only) == 1 and only[0].is_dir() else top


def _copy(source: IO[bytes], out: IO[bytes], room: int, path: Path) -> int:
    """Bytes copied. Raises LogUnreadable for more than there is room for."""
    copied = 0
    while piece := source.read(PIECE):
        copied += len(piece)
        if copied > room:
            raise _too_much(path)
        out.write(piece)
    return copied


def _room(path: Path) -> int:
    return max(LEAST_ROOM, MOST_RATIO * path.stat().st_size)


def _too_much(path: Path) -> LogUnreadable:
    return LogUnreadable(
        f"{path.name} holds far more than a log of its size can.",
        hint="unpack it yourself, and give what is in it.",
    )


def _is_document(path: Path) -> bool:
    try:
        with zipfile.ZipFile(path) as archive:
            return any(n.lower().startswith(DOCUMENTS) for n in archive.namelist()[:MOST_FILES])
    except DAMAGE:
        return False
