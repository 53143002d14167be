"""Voyages in whose middle something begins, watched as files that grow while the watch runs.

    python -m pipelines.experiments.watching.grown SHIPS KEPT --half-way 60 --first 1000

The voyages are those of `segments_kept --half-way`. Each is written as an MCAP log in small chunks,
and this log is handed over in pieces of AT_ONCE_S: a second file grows by one piece, `Watch` looks
until it has nothing more to do, and so on to the end. Causal rows, health, finished segments and
their products are thus those of `shiplog watch`. The products H_s go to KEPT, one file a voyage,
for `rates`; what is there is not made again. KEPT must not hold files of `segments_kept --half-way`
of the same numbers.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
from threadpoolctl import threadpool_limits

from pipelines.experiments.watching import sailing, segments_kept
from pipelines.experiments.watching.sailing import Ship
from shiplog.live import segment_products
from shiplog.live.alarm import Alarm, Thresholds, Watcher
from shiplog.live.nominal import Nominal
from shiplog.live.session import Watch, notices
from shiplog.live.sources.mcap_file import McapFile
from shiplog.logs.conversion import write
from shiplog.logs.conversion.write import Series
from shiplog.machine import files
from shiplog.nomenclature.units import SECOND_NS
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import Run
from shiplog.voyages.samples import fields_read

AT_ONCE_S = 10.0  # s of the voyage that the file grows by
CHUNK_BYTES = 8192  # of the log, so that a recorder hands over some seconds at a time


@dataclass
class Kept(Watcher):
    """A watcher that raises no alarm and keeps what it was given: H_s, and the ends of the segments
    [ns]."""

    products: list[np.ndarray] = field(default_factory=list)
    times: list[int] = field(default_factory=list)

    def add(self, gram: np.ndarray, end: int) -> Alarm | None:
        self.products.append(self.directions.products(gram))
        self.times.append(end)
        return super().add(gram, end)


def watched(
    run: Run, of: Nominal, directions: segment_products.Directions, series: Sequence[Series],
    seconds: float, folder: Path,
) -> tuple[np.ndarray, np.ndarray, int]:  # fmt: skip
    """Ends of the segments [S], s into the voyage, H_s [S, N, N], and the messages on health."""
    whole, growing = folder / "whole.mcap", folder / "growing.mcap"
    with mock.patch.object(write, "CHUNK_BYTES", CHUNK_BYTES):
        write.write_log(whole, series, ship=run.profile.ship.name,
                        datum=sailing.home_instruments.DATUM)  # fmt: skip
    content = whole.read_bytes()
    piece = -(-len(content) // max(1, round(seconds / AT_ONCE_S)))
    watcher = Kept(directions, Thresholds(np.inf, np.inf, False), 1.0)
    source = McapFile(growing, fields_read.wanted(run.profile, {}))
    watch = Watch(run, source, of, watcher=watcher)
    said: list[Any] = []
    with growing.open("wb") as stream:
        for at in range(0, len(content), piece):
            stream.write(content[at : at + piece])
            stream.flush()
            said += notices(list(watch.step(sailing.LATER)))
            while watch.busy:
                said += notices(list(watch.step(sailing.LATER)))
    said += notices(list(watch.finish(sailing.LATER)))
    first = watch.rows.anchor or 0
    times = (np.array(watcher.times, np.int64) - first) / SECOND_NS
    return times, np.stack(watcher.products), len(said)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ships", type=Path)
    parser.add_argument("kept", type=Path)
    parser.add_argument("--half-way", type=int, default=60)
    parser.add_argument("--first", type=int, default=1000)
    given = parser.parse_args()
    with threadpool_limits(1, user_api="blas"):  # of matrices too small to share out
        keep(given)


def keep(given: argparse.Namespace) -> None:
    given.kept.mkdir(parents=True, exist_ok=True)
    there = {s: segments_kept.campaign_of(given.ships / s.name) for s in sailing.FIVE}
    maps = {s: segment_products.directions(of.campaign) for s, of in there.items()}
    runs: dict[Ship, Run] = {s: load_model.load(given.ships / s.name / "base") for s in there}
    for voyage in segments_kept.half_ways(there, given.half_way, given.first):
        path = given.kept / f"half-{voyage.number:03d}.npz"
        if path.exists():
            continue
        ship, began = voyage.ship, time.process_time()
        seconds = voyage.seconds(there[ship])
        series, begins = voyage.series(seconds)
        with tempfile.TemporaryDirectory() as folder:
            times, H, said = watched(
                runs[ship], there[ship], maps[ship], series, seconds, Path(folder)
            )
        with files.whole(path) as partial, partial.open("wb") as stream:
            voyage.write(stream, H, times, begins)
        print(
            f"{voyage.number} {ship.name} {voyage.cause}: {len(H)} segments, {said} on health, "
            f"{time.process_time() - began:.0f} s of processor", flush=True,
        )  # fmt: skip


if __name__ == "__main__":
    main()
