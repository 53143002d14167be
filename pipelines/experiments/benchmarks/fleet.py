"""A fleet's voyages through the store: ingested, listed, averaged to 1 Hz, cut into windows.

    python -m pipelines.experiments.benchmarks.fleet [--hours 2] [--ingest 30] [--voyages 1000]

One simulated voyage is written once and ingested under many names; the store is then filled up with
copies of it, since ingesting a thousand takes hours. Each step runs in a process of its own, and
peak memory is reported after the first half of its voyages and at its end: what grows with the
number of voyages shows there. Averages and windows are made a voyage at a time, as
`shiplog.commands.cluster.resample` gives them to the machines of a Ray cluster.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

import polars as pl

from pipelines.experiments import simulated_ship
from shiplog.commands.prepare import ingest_logs
from shiplog.voyages.rows import one_hertz
from shiplog.voyages.store.store import Store
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import plan

Steps = Iterator[object]  # one for each voyage that is done


def write_log(path: Path, hours: float) -> None:
    voyage = simulated_ship.sail(hours * 3600.0, seed=1, wind=simulated_ship.Wind(3.0, 1))
    start = datetime(2026, 5, 1, tzinfo=UTC)
    simulated_ship.write_voyage(path, voyage, seed=1, start=start)


def ingesting(folder: Path, count: int) -> Steps:
    """The log under `count` names, a call each: the reader's process serves all of them."""
    store = Store(folder / "store")
    for number in range(count):
        log = folder / f"trip_{number:04d}.mcap"
        os.link(folder / "log.mcap", log)
        found = ingest_logs([log], "esso-vectwin", store)
        assert not found.refused, found.refused
        log.unlink()
        yield number


def fill(folder: Path, count: int) -> None:
    """The store with `count` voyages, all like its first one."""
    first, *others = sorted((folder / "store").glob("voyage=*"))
    facts = json.loads((first / "voyage.json").read_text(encoding="utf-8"))
    for number in range(1 + len(others), count):
        name = f"trip_{number:04d}"
        place = first.with_name(f"voyage={name}")
        place.mkdir()
        os.link(first / "table.parquet", place / "table.parquet")
        renamed = facts | {"report": facts["report"] | {"name": name}}
        (place / "voyage.json").write_text(json.dumps(renamed, indent=1), encoding="utf-8")


def listing(folder: Path, count: int) -> Steps:
    assert len(Store(folder / "store").entries()) == count
    yield from range(count)


def averaging(folder: Path, count: int) -> Steps:
    store = Store(folder / "store")
    names = store.select()[:count]
    profile = store.profile(names[:1])
    for name in names:
        out = folder / "seconds" / name
        one_hertz.sink_averages(store.tables([name]), profile.columns, profile.circular, out)
        yield name


def cutting(folder: Path, count: int) -> Steps:
    store = Store(folder / "store")
    names = store.select()[:count]
    profile = store.profile(names[:1])
    for name in names:
        rows = one_hertz.segments(pl.read_parquet(folder / "seconds" / name / "*.parquet"))
        planned = plan(rows, "sli2", windows.SIZE)
        cut = windows.cut(rows, planned, windows.SIZE, profile.actuator_names, profile.wind_names)
        yield len(cut)


def measure(step: Callable[[Path, int], Steps], folder: Path, count: int) -> tuple:
    """Seconds, processor seconds, and peak memory [MB] after half of the voyages and at the end."""
    receiver, sender = multiprocessing.get_context("spawn").Pipe(duplex=False)
    child = multiprocessing.get_context("spawn").Process(
        target=_child, args=(step, folder, count, sender)
    )
    child.start()
    sender.close()
    try:
        return receiver.recv()
    finally:
        child.join()


def _child(step: Callable[[Path, int], Steps], folder: Path, count: int, sender) -> None:
    began, half = time.perf_counter(), 0.0
    for number, _ in enumerate(step(folder, count), 1):
        if number == (count + 1) // 2:
            half = _peak()
    used = resource.getrusage(resource.RUSAGE_SELF)
    sender.send((time.perf_counter() - began, used.ru_utime + used.ru_stime, half, _peak()))


def _peak() -> float:
    """MB, of this process alone: `ru_maxrss` begins with what the parent had taken."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1024.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hours", type=float, default=2.0, help="length of a voyage")
    parser.add_argument("--ingest", type=int, default=30, help="voyages that are ingested")
    parser.add_argument("--voyages", type=int, default=1000, help="voyages in the store")
    given = parser.parse_args()
    head = f"{'step':<10} {'voyages':>7} {'s':>8} {'CPU s':>8} {'CPU s of one':>12}"
    print(f"{head} {'MB, half':>9} {'MB, end':>8}")
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        write_log(folder / "log.mcap", given.hours)
        size = (folder / "log.mcap").stat().st_size / 1e6
        steps = (
            (ingesting, given.ingest), (listing, given.voyages), (averaging, given.voyages),
            (cutting, given.voyages),
        )  # fmt: skip
        for step, count in steps:
            took, used, half, end = measure(step, folder, count)
            line = f"{step.__name__:<10} {count:>7} {took:>8.1f} {used:>8.1f} {used / count:>12.4f}"
            print(f"{line} {half:>9.0f} {end:>8.0f}", flush=True)
            if step is ingesting:
                fill(folder, given.voyages)
        table = next((folder / "store").glob("voyage=*/table.parquet")).stat().st_size / 1e6
        print(f"a log of {given.hours:g} h has {size:.1f} MB, its table {table:.1f} MB")
        shutil.rmtree(folder / "seconds")


if __name__ == "__main__":
    main()
