"""Exceptions that nobody foresaw: one sentence for the user, the trace in a file for developers.

What the system says of a path is no fault of the program: the sentence is all there is.
"""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path

from shiplog.exceptions import ShiplogError
from shiplog.machine import disk_cache

MENDABLE = (  # what the system says of a path that the user can mend
    errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.ENOENT,
    errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.ENAMETOOLONG, errno.EFBIG,
)  # fmt: skip
QUOTED_LETTERS = 300  # letters of an exception's own words; some libraries quote whole files


class Unexpected(ShiplogError):
    """A fault of the program. The message names its kind and the file that holds its trace."""


def unexpected(error: BaseException, doing: str = "") -> ShiplogError:
    """What to tell of an exception. That of the program leaves its trace in a file, and says where.
    One that asks to end is raised again.

    doing   what the program was doing, such as the name of a log; empty for the command itself
    """
    if isinstance(error, (KeyboardInterrupt, SystemExit, GeneratorExit)):
        raise error
    if isinstance(error, OSError) and error.filename is not None and error.errno in MENDABLE:
        return ShiplogError(
            f"{os.fsdecode(error.filename)}: {error.strerror}.",
            hint="look whether that path is what you meant, may be used, and has room on its disk.",
        )
    if isinstance(error, MemoryError):
        return Unexpected(
            f"{doing + ': ' if doing else ''}more memory was needed than there is, or than a file "
            "of its size may take.",
            hint="if the file is sound, it is too large for this computer: cut it into parts.",
        )
    import traceback  # as below: seldom needed, and every command would wait for it

    words = " ".join(str(error).split())
    words = words if len(words) <= QUOTED_LETTERS else words[:QUOTED_LETTERS] + "..."
    kind = type(error).__name__
    where = _write("".join(traceback.format_exception(error)))
    kept = f"its trace is in {where}" if where else "its trace could not be written"
    return Unexpected(
        f"{doing + ': ' if doing else ''}an unexpected fault of the program: {kind}"
        f"{': ' + words if words else ''}; {kept}.",
        hint="please report it with that file; if the input is damaged, check it as well.",
    )


def _write(trace: str) -> Path | None:
    """Into the cache, whose size is limited, or into the temporary folder where that fails."""
    import datetime
    import platform
    import tempfile
    from importlib.metadata import PackageNotFoundError, version

    try:
        release = version("shiplog")
    except PackageNotFoundError:
        release = "not installed"
    head = f"shiplog {release}, Python {platform.python_version()}, {platform.platform()}\n"
    now = datetime.datetime.now(datetime.UTC).strftime("%Y%m%dT%H%M%S.%f")
    text = f"{head}{' '.join(sys.argv)!a}\n\n{trace}"
    for folder in (lambda: disk_cache.folder() / "faults", lambda: Path(tempfile.gettempdir())):
        try:
            path = folder() / f"shiplog-{now}-{os.getpid()}.txt"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", errors="backslashreplace")
        except (OSError, RuntimeError):  # RuntimeError: no home folder is known
            continue
        return path
    return None
