"""10 Hz to 1 Hz: the voyages of a store as a folder of 1 Hz rows.

    python -m pipelines.downsample STORE SECONDS [--ray ADDRESS]

    SECONDS/voyage=NAME/000000.parquet    voyage, time, the ship's columns (SI), samples, elapsed;
                                          a file a day
    SECONDS/profile.json, logs.json       the ship; SHA-256 of each voyage's log

A second is the mean of the usable rows within half a second of it, circular where an angle is
averaged (Wakita et al. 2024, Sec. 4.1); one with fewer than five rows is missing. A voyage needs
some 100 MB, however long it is. With Ray a voyage is a task, and both folders are on a disk that
all nodes share.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import polars as pl

from pipelines.stage import stage
from shiplog.machine import files
from shiplog.machine.paths import check_there, refuse_taken
from shiplog.ship_profile.profile import Profile
from shiplog.voyages.rows import one_hertz
from shiplog.voyages.store.store import Store


def downsample(store: Path, out: Path, ray: str | None = None) -> None:
    """Raises ShiplogError for a store that cannot be read."""
    voyages = Store(store)
    names = voyages.select()
    profile = voyages.profile(names)
    refuse_taken(out, "folder of seconds")
    with files.whole_folder(out) as new:
        if ray is None:
            for name, table in zip(names, voyages.tables(names), strict=True):
                folder = new / f"voyage={name}"
                one_hertz.sink_averages([table], profile.columns, profile.circular, folder)
        else:
            from shiplog.commands.cluster import resample

            tables = [store / f"voyage={name}" / "table.parquet" for name in names]
            folders = resample(tables, profile.columns, sorted(profile.circular), new, ray)
            for name, folder in zip(names, folders, strict=True):
                folder.rename(new / f"voyage={name}")
        files.write_json(new / "profile.json", profile.model_dump(mode="json"))
        files.write_json(new / "logs.json", voyages.hashes(names))


def rows(seconds: Path) -> pl.DataFrame:
    """The 1 Hz rows, sorted, with their segments: stretches without a missing second."""
    check_there(seconds / "profile.json", "what `pipelines.downsample` wrote")
    found = pl.scan_parquet(seconds / "voyage=*" / "*.parquet", hive_partitioning=False)
    return one_hertz.segments(found.collect())


def ship(seconds: Path) -> Profile:
    """The profile that the voyages were read through."""
    return Profile.model_validate_json((seconds / "profile.json").read_text(encoding="utf-8"))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("store", type=Path)
    parser.add_argument("seconds", type=Path)
    parser.add_argument("--ray", metavar="ADDRESS", help="a Ray cluster, such as auto")
    given = parser.parse_args()
    with stage():
        downsample(given.store.resolve(), given.seconds.resolve(), given.ray)
