"""The kept rows as a voyage of a store: what `diagnose` is asked about after an alarm."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from shiplog.live.events import clock
from shiplog.logs.health.health_report import VoyageReport
from shiplog.logs.reading.read import Contents
from shiplog.machine import files
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.ingest import ingest
from shiplog.voyages.ingest.ingest import Voyage
from shiplog.voyages.rows.recording import RATE_HZ
from shiplog.voyages.store.store import Store


def name_of(since: int) -> str:
    """Of rows that begin at a time [ns]."""
    return "watch_" + clock(since)[:19].replace("-", "").replace(":", "")


def add(
    store: Store, table: pl.DataFrame, profile: Profile, folder: Path,
    datum: tuple[float, float] | None,
) -> str:  # fmt: skip
    """Write the rows into the store; the voyage's name. Raises StoreError."""
    name = name_of(int(table["time"].to_physical()[0]))
    kept = folder / f"{name}.parquet"
    with files.whole(kept) as partial:
        table.write_parquet(partial, compression="zstd")
    usable_s, windows = ingest.usable(table, profile)
    report = VoyageReport(
        name, 0, 0, table.height, (table.height - 1) / RATE_HZ, usable_s=usable_s, windows=windows
    )
    contents = Contents(kept, kept.stat().st_size, {}, {}, "shiplog watch", "")
    store.add(Voyage(name, profile, contents, table, report, datum, ()))
    return name
