"""Where in the user's cache shiplog keeps what it can work out again."""

from __future__ import annotations

import os
from pathlib import Path


def folder() -> Path:
    """Whatever is in it may be removed at any time."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "shiplog"
