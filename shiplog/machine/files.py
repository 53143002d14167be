"""Files that are there whole or not at all, and what killed processes left half-written.

A half-written file or folder carries the machine and the process in its name: it is removed by the
next call that writes there, unless that process still runs.
"""

from __future__ import annotations

import glob
import json
import math
import os
import platform
import re
import shutil
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import polars as pl

MACHINE = f"{zlib.crc32(platform.node().encode()):08x}"  # a disk may be shared
WRITER = re.compile(rf"[.-]{MACHINE}-(\d+)(?:-\w*|\.partial)$")  # how names of leavings end
CLOCK_TOLERANCE_S = 1.0  # file systems and process tables round their times


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A path to write to, which becomes `path` where the block ends well. Else nothing stays.

    Raises OSError that names `path` where the disk refuses, whichever library wrote.
    """
    with _partial(path) as partial:
        yield partial
        flush(partial)
        partial.replace(path)


@contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """An empty folder to write into, which becomes `path` where the block ends well. Else nothing
    stays. `path` may be there only if it is empty.

    Raises OSError as `whole` does.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with _partial(path) as partial:
        partial.mkdir()
        yield partial
        for file in partial.rglob("*"):
            if file.is_file():
                flush(file)
        partial.rename(path)


@contextmanager
def _partial(path: Path) -> Iterator[Path]:
    """A name to write under before `path` is there; removed at the end, an interrupt included."""
    sweep(path.parent, path.name)
    partial = path.with_name(f".{path.name}.{MACHINE}-{os.getpid()}.partial")
    try:
        yield partial
    except Exception as error:
        refusal = refused(error, path, partial)
        if refusal is error:
            raise
        raise refusal from error
    finally:
        remove(partial)


def flush(path: Path) -> None:
    """Onto the disk: a rename can survive a power cut that the content does not survive."""
    with open(path, "rb+") as file:
        os.fsync(file.fileno())


def refused(error: Exception, path: Path, *also: Path) -> Exception:
    """What the system says of `path`, as an OSError with its name, where a library reports it in
    words of its own or under another name (`also`). Any other exception comes back as it is."""
    if isinstance(error, OSError) and error.errno:
        number = error.errno
        if error.filename is not None and Path(os.fsdecode(error.filename)) not in also:
            return error
    else:  # as Rust has it (polars, safetensors), or shutil
        found = re.search(r"\(os error (\d+)\)|\[Errno (\d+)\]", str(error))
        number = int(found[1] or found[2]) if found else None
    return OSError(number, os.strerror(number), str(path)) if number else error


def sweep(folder: Path, name: str | None = None) -> None:
    """Remove what killed processes left half-written in a folder; only what was to become `name`
    if one is given."""
    pattern = f".{glob.escape(name)}.*.partial" if name else ".*.partial"
    for leaving in folder.glob(pattern):
        if _left(leaving):
            remove(leaving)


def remove(path: Path) -> None:
    """A file, or a folder with all that is in it, as far as the system allows."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
        return
    with suppress(OSError):
        path.unlink(missing_ok=True)


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder for the time of a block. Those of killed processes are removed first."""
    for leaving in Path(tempfile.gettempdir()).glob(f"shiplog-{MACHINE}-*"):
        if _left(leaving):
            remove(leaving)
    prefix = f"shiplog-{MACHINE}-{os.getpid()}-"
    with tempfile.TemporaryDirectory(prefix=prefix, ignore_cleanup_errors=True) as folder:
        yield Path(folder)


def _left(path: Path) -> bool:
    """Whether the process that its name tells has ended: none has that number, or one that is
    younger than what lies there."""
    import psutil  # here, as leavings are rare

    writer = WRITER.search(path.name)
    if writer is None or int(writer[1]) == os.getpid():
        return False
    try:
        return (
            psutil.Process(int(writer[1])).create_time() > path.stat().st_mtime + CLOCK_TOLERANCE_S
        )
    except psutil.NoSuchProcess:
        return True
    except (psutil.Error, OSError):  # another user's process; or gone meanwhile
        return False


def write_text(path: Path, text: str) -> None:
    with whole(path) as partial:
        partial.write_text(text, encoding="utf-8")


def is_stream(path: Path) -> bool:
    """Whether a path is written to as it goes, and never replaced: a pipe, or a device such as
    /dev/null."""
    return path.is_fifo() or path.is_char_device()


def write_answer(path: Path, text: str) -> None:
    """Where a user wants an answer: into a stream, or as a file."""
    if not is_stream(path):
        write_text(path, text)
        return
    with open(path, "w", encoding="utf-8") as stream:
        stream.write(text)


def write_json(path: Path, content: Any) -> None:
    """A number that is not finite becomes null."""
    write_text(path, json_text(content))


def write_frame(path: Path, frame: pl.DataFrame) -> None:
    """As Parquet."""
    with whole(path) as partial:
        frame.write_parquet(partial)


def json_text(content: Any) -> str:
    return json.dumps(finite(content), indent=1, allow_nan=False)


def finite(value: Any) -> Any:
    """JSON has no infinity: null instead of it, at any depth."""
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
