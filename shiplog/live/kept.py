"""The folder of a watch: what another process needs to go on, and the rows of the last hours.

OUT/state.npz      evidence so far, place in the source; written whole after each segment
OUT/rows/N.parquet final rows, ten minutes a file; of the last KEPT_S
OUT/events.jsonl   what was printed, a line an event

Nothing is written anywhere else but, on an alarm, the kept rows as a voyage of the store, where
`diagnose` finds them.
"""

from __future__ import annotations

import json
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from shiplog.exceptions import ShiplogError
from shiplog.machine import files
from shiplog.nomenclature.units import SECOND_NS

STATE = "state.npz"
ROWS = "rows"
KEPT_S = 4 * 3600.0
PIECE_S = 600.0


@dataclass
class KeptRows:
    """Final rows of the last hours, on disk; the latest minutes in memory."""

    folder: Path
    waiting: list[pl.DataFrame] = field(default_factory=list)

    def add(self, final: pl.DataFrame) -> None:
        if final.height:
            self.waiting.append(final)
        if self.waiting and _span_s(self.waiting) >= PIECE_S:
            self.flush()

    def flush_if_old(self) -> None:
        """What waits for longer than a tenth of a piece, when the state is written: a process that
        is killed then loses no more."""
        if self.waiting and _span_s(self.waiting) >= 0.1 * PIECE_S:
            self.flush()

    def flush(self) -> None:
        """All that waits, into a piece of its own."""
        if not self.waiting:
            return
        whole = pl.concat(self.waiting)
        self.folder.mkdir(parents=True, exist_ok=True)
        first = int(whole["time"].to_physical()[0])
        path = self.folder / f"{first:020d}.parquet"
        with files.whole(path) as partial:
            whole.write_parquet(partial, compression="zstd")
        self.waiting = []
        oldest = int(whole["time"].to_physical()[-1]) - round(KEPT_S * SECOND_NS)
        for old in self.pieces():
            if int(old.stem) < oldest - round(PIECE_S * SECOND_NS):
                files.remove(old)

    def pieces(self) -> list[Path]:
        return sorted(p for p in self.folder.glob("*.parquet") if p.stem.isdecimal())

    def table(self, since: int) -> pl.DataFrame | None:
        """All kept rows from a time on [ns]."""
        self.flush()
        parts = [pl.read_parquet(path) for path in self.pieces()]
        if not parts:
            return None
        whole = pl.concat(parts).unique("time", keep="last", maintain_order=True).sort("time")
        return whole.filter(pl.col("time").to_physical() >= since)


def _span_s(parts: list[pl.DataFrame]) -> float:
    first, last = (parts[i]["time"].to_physical()[j] for i, j in ((0, 0), (-1, -1)))
    return (int(last) - int(first)) / SECOND_NS


@dataclass(frozen=True)
class Saved:
    """What a watch goes on from: facts that are JSON, and arrays."""

    facts: dict[str, Any]
    arrays: dict[str, np.ndarray]


def save(folder: Path, saved: Saved) -> None:
    """Whole or not at all."""
    text = np.frombuffer(json.dumps(saved.facts).encode(), np.uint8)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with files.whole(folder / STATE) as partial, partial.open("wb") as stream:
            np.savez(stream, facts=text, **saved.arrays)  # type: ignore[arg-type]  # none is an option
    except OSError as error:
        raise ShiplogError(
            f"The state of the watch cannot be written into {folder}: {error.strerror}.",
            hint="give --out in a folder with room that you may write to; the state before stands.",
        ) from error


def load(folder: Path) -> Saved | None:
    """What is kept; None where there is nothing, or it is damaged: the watch then begins anew."""
    try:
        with np.load(folder / STATE, allow_pickle=False) as arrays:
            found = {name: arrays[name] for name in arrays.files}
        facts = json.loads(found.pop("facts").tobytes().decode())
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    return Saved(facts, found) if isinstance(facts, dict) else None
