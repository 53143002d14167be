"""Where in the user's cache shiplog keeps what it can work out again."""

from __future__ import annotations

import hashlib
import os
from functools import lru_cache
from pathlib import Path


def folder() -> Path:
    """Whatever is in it may be removed at any time."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "shiplog"


@lru_cache
def source() -> bytes:
    """Digest of this package's modules: what they worked out is stale where they have changed."""
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for path in sorted(root.rglob("*.py")):
        digest.update(str(path.relative_to(root)).encode() + path.read_bytes())
    return digest.digest()
