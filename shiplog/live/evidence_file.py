"""The evidence of a watch as arrays, and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from shiplog.live.alarm import Watcher


def arrays(watcher: Watcher) -> dict[str, np.ndarray]:
    """Of the evidence so far; not of directions and thresholds, which the run gives."""
    found = {"ends": np.array(watcher.ends, np.int64)}
    for name, one in (("evidence", watcher.evidence), ("alert", watcher.alert)):
        found[f"{name}_total"] = one.total
        found[f"{name}_since"] = np.array(one.since)
        found[f"{name}_parts"] = np.array(one.parts)
    return found


def facts(watcher: Watcher) -> dict[str, Any]:
    return {"quiet": watcher.quiet, "named": watcher.named, "squares": watcher.squares}


def restore(watcher: Watcher, kept: dict[str, np.ndarray], said: dict[str, Any]) -> bool:
    """Go on from these; False where they are of another model, and nothing is changed."""
    size = 1 + sum(watcher.directions.widths)
    every = {"evidence": watcher.evidence, "alert": watcher.alert}
    for name in every:
        total = kept.get(f"{name}_total")
        if total is None or total.shape != (size, size) or not np.isfinite(total).all():
            return False
    for name, one in every.items():
        one.total = kept[f"{name}_total"].copy()
        one.since = list(kept[f"{name}_since"])
        one.parts = list(kept[f"{name}_parts"])
    watcher.ends = [int(time) for time in kept["ends"]]
    watcher.squares = [float(value) for value in said.get("squares", [])]
    watcher.quiet, watcher.named = said.get("quiet"), str(said.get("named", ""))
    return True
