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


def files() -> list[Path]:
    """All that is kept, least recently used first."""
    found = [path for path in folder().rglob("*") if path.is_file()]
    return sorted(found, key=lambda path: path.stat().st_mtime)


def size() -> int:
    """Bytes that are kept."""
    return sum(path.stat().st_size for path in files())


def trim(limit: int = LIMIT) -> int:
    """Remove what was used least recently until no more than `limit` bytes are kept; the bytes that
    were removed. A file that another process has removed, or that cannot be, is passed over."""
    kept, removed = size(), 0
    for path in files():
        if kept - removed <= limit:
            break
        try:
            bytes_ = path.stat().st_size
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
