"""The viewer of a watch."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any


def viewer(run: Path, web: bool) -> Callable[[Any], None]:
    """What takes an event to the viewer. Raises ShiplogError where none starts."""
    from shiplog.live import viewer as live_viewer

    return live_viewer.opened(f"{run.name}, watched", web)
