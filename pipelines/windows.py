"""1 Hz rows to the paper's eight sets of windows.

    python -m pipelines.windows SECONDS WINDOWS [--size 100]

    WINDOWS/ref.parquet, sli2.parquet, ... d-ref.parquet    voyage, segment, start, copy

A row is a window of I seconds: it begins with the row `start` of a segment and crosses no gap.
Slicing begins a window every S seconds; jittering takes each M times, and training adds noise to
the velocities of these copies (Wakita et al. 2024, Eqs. 12 to 18 and Table 3). The values stay
where they are, in the 1 Hz rows: a set of a hundred times as many windows is a few kilobytes.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import polars as pl

from pipelines.downsample import rows
from pipelines.stage import stage
from shiplog.machine import files
from shiplog.machine.paths import check_there, refuse_taken
from shiplog.voyages.windows.augmentation import AUGMENTATIONS
from shiplog.voyages.windows.split import plan
from shiplog.voyages.windows.windows import SIZE


def windows(seconds: Path, out: Path, size: int = SIZE) -> dict[str, int]:
    """Writes the eight sets. Returns how many windows each has."""
    table = rows(seconds)
    sets = {data: plan(table, data, size) for data in AUGMENTATIONS}
    refuse_taken(out, "folder of windows")
    with files.whole_folder(out) as new:
        for data, planned in sets.items():
            planned.write_parquet(new / f"{data}.parquet")
    return {data: planned.height for data, planned in sets.items()}


def planned(folder: Path, data: str, voyages: tuple[str, ...]) -> pl.DataFrame:
    """The windows of some voyages in one of the sets."""
    check_there(folder / f"{data}.parquet", "what `pipelines.windows` wrote")
    table = pl.scan_parquet(folder / f"{data}.parquet")
    return table.filter(pl.col("voyage").is_in(voyages)).collect()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("seconds", type=Path)
    parser.add_argument("windows", type=Path)
    parser.add_argument("--size", type=int, default=SIZE, help="seconds of a window, I")
    given = parser.parse_args()
    with stage():
        for data, count in windows(given.seconds, given.windows, given.size).items():
            print(f"{data}: {count} windows")
