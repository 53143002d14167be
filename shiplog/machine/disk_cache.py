"""The folder in the user's cache for results that shiplog can compute again, and its limit."""

from __future__ import annotations

import atexit
import hashlib
import os
import sys
from functools import lru_cache
from pathlib import Path

LIMIT = 400_000_000  # bytes: some forty ships' compiled equations and campaigns
FOLDERS = {  # folder: what is kept in it
    "jax": "machine code of compiled functions",
    "kernels": "machine code of ships' equations",
    "traced": "traced equations of ships that have no kernel",
    "settled": "posteriors of nominal campaigns",
    "watched": "thresholds of alarms",
    "faults": "traces of unexpected faults",
}


def folder() -> Path:
    """Whatever is in it may be removed at any time."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "shiplog"


def keep_compiled() -> None:
    """In a process of shiplog's own: let JAX, and that of its child processes, keep on disk what it
    compiles, unless the user has set another folder: later processes save some ten seconds a ship.
    A process that used JAX trims the cache when it ends.

    A process of somebody else's keeps its settings; there `jit_cache.kept_on_disk` does it.
    """
    for name, value in kept_by_jax().items():
        os.environ.setdefault(name.upper(), str(value))
    trim_when_done()


def kept_by_jax() -> dict[str, str | float]:
    """JAX's settings by which it keeps all that it compiles."""
    return {
        "jax_compilation_cache_dir": str(folder() / "jax"),
        "jax_persistent_cache_min_compile_time_secs": 0.0,
    }


def trim_when_done() -> None:
    """When the process ends, however often this is called."""
    atexit.unregister(_trim_after_jax)
    atexit.register(_trim_after_jax)


def files() -> list[tuple[float, int, Path]]:
    """Time of last change, bytes and path of every file, oldest first. Another process may remove
    a file at any time: such a file is left out."""
    found = []
    for path in folder().rglob("*"):
        try:
            if path.is_file():
                known = path.stat()
                found.append((known.st_mtime, known.st_size, path))
        except OSError:
            continue
    return sorted(found)


def sizes() -> dict[str, tuple[int, int]]:
    """Folder → number of files and bytes in it; all of FOLDERS, and others that exist."""
    found: dict[str, tuple[int, int]] = {kind: (0, 0) for kind in FOLDERS}
    for _, bytes_, path in files():
        kind = path.relative_to(folder()).parts[0]
        count, total = found.get(kind, (0, 0))
        found[kind] = (count + 1, total + bytes_)
    return found


def trim(limit: int = LIMIT) -> int:
    """Remove the oldest files until no more than `limit` bytes are kept; the bytes removed."""
    found = files()
    kept, removed = sum(bytes_ for _, bytes_, _ in found), 0
    for _, bytes_, path in found:
        if kept - removed <= limit:
            break
        try:
            path.unlink()
        except OSError:
            continue
        removed += bytes_
    return removed


@lru_cache
def source() -> bytes:
    """Digest of this package's modules: results of another version are not used."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[1]
    for path in sorted(root.rglob("*.py")):
        digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.digest()


def _trim_after_jax() -> None:
    """Only a process that used JAX has added files; for the others a look is not worth its time."""
    if "jax" in sys.modules:
        trim()
