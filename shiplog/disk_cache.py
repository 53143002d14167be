"""Where in the user's cache shiplog keeps what it can work out again."""

from __future__ import annotations

import hashlib
import os
from functools import lru_cache
from pathlib import Path

LIMIT = 400_000_000  # bytes: some forty ships' compiled equations and campaigns


def folder() -> Path:
    """Whatever is in it may be removed at any time."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "shiplog"


def keep_compiled() -> None:
    """What JAX compiles for one ship serves every later process, where a user has not said
    otherwise: some ten seconds each. To be called before JAX is imported."""
    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", str(folder() / "jax"))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")


def files() -> list[tuple[float, int, Path]]:
    """Time of last change, bytes and path of all that is kept, oldest first. Another process may
    remove a file at any time: what is gone is passed over."""
    found = []
    for path in folder().rglob("*"):
        try:
            if path.is_file():
                known = path.stat()
                found.append((known.st_mtime, known.st_size, path))
        except OSError:
            continue
    return sorted(found)


def size() -> int:
    """Bytes that are kept."""
    return sum(bytes_ for _, bytes_, _ in files())


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
    """Digest of this package's modules: what they worked out is stale where they have changed."""
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for path in sorted(root.rglob("*.py")):
        digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.digest()
