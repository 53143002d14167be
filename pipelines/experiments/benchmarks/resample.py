"""10 Hz to 1 Hz: rows a second and peak memory, next to polars' `group_by_dynamic` as the peer.

Both go file by file, a voyage each, whose rows are in order. shiplog's route, which calls
`group_by_dynamic` too, does more: it leaves out unusable rows and the seconds around a jump or of
too few rows, counts `elapsed`, and looks whether the rows are sorted.

    python -m pipelines.experiments.benchmarks.resample [--rows 1e7 1e8] [--ray ADDRESS]

With --ray also as one task a voyage on that cluster. Each measurement runs in a process of its own,
so that its peak memory is its own.
"""

from __future__ import annotations

import argparse
import functools
import multiprocessing
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl

from shiplog.voyages.rows import one_hertz

COLUMNS = ("heading", "wind_angle", "surge", "sway", "yaw_rate", "propeller")
CIRCULAR = ("heading", "wind_angle")
VOYAGE_ROWS = 1_000_000  # a day and four hours
GOAL_ROWS_PER_SECOND = 3e6


def write_table(folder: Path, rows: int) -> list[Path]:
    """A fleet's worth of 10 Hz rows, one file a voyage, values that do not compress away."""
    rng = np.random.default_rng(0)
    paths = []
    for number in range(-(-rows // VOYAGE_ROWS)):
        count = min(VOYAGE_ROWS, rows - number * VOYAGE_ROWS)
        stamps = number * 10**15 + np.arange(count, dtype=np.int64) * 100_000_000
        values = {name: rng.normal(size=count) for name in COLUMNS}
        frame = pl.DataFrame(
            {"voyage": pl.repeat(f"v{number}", count, eager=True), "time": stamps}
            | values
            | {"quality": np.zeros(count, np.int32)}
        ).with_columns(pl.col("time").cast(pl.Datetime("ns", "UTC")))
        path = folder / f"{number}.parquet"
        frame.write_parquet(path)
        paths.append(path)
    return paths


def ours(paths: list[Path], out: Path) -> None:
    one_hertz.sink_averages((pl.scan_parquet(path) for path in paths), COLUMNS, CIRCULAR, out)


def peer(paths: list[Path], out: Path) -> None:
    """The same means by `group_by_dynamic`, what polars' own guide shows for resampling."""
    means = [one_hertz.mean_angle(c) if c in CIRCULAR else pl.col(c).mean() for c in COLUMNS]
    out.mkdir()
    for number, path in enumerate(paths):
        (
            pl.scan_parquet(path)
            .set_sorted("time")
            .group_by_dynamic("time", every="1s", offset="-500ms")
            .agg(pl.col("voyage").first(), *means, samples=pl.len())
            .sink_parquet(out / f"{number:06d}.parquet", engine="streaming")
        )


def on_ray(paths: list[Path], out: Path, address: str) -> None:
    """A task a voyage; the seconds hold the time to join the cluster."""
    from shiplog.commands import cluster

    cluster.resample(paths, COLUMNS, CIRCULAR, out, address)


def measure(job: Callable[[list[Path], Path], None], paths: list[Path], out: Path) -> tuple:
    """Seconds, of these of a processor, and peak memory [MB] of a job in a process of its own."""
    context = multiprocessing.get_context("spawn")
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=_child, args=(job, paths, out, sender))
    child.start()
    child.join()
    return receiver.recv() if receiver.poll() else (float("nan"),) * 3


def _child(job: Callable[[list[Path], Path], None], paths: list[Path], out: Path, sender) -> None:
    began, busy = time.perf_counter(), time.process_time()
    job(paths, out)
    took, busy = time.perf_counter() - began, time.process_time() - busy
    sender.send((took, busy, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=float, nargs="+", default=[1e6, 1e7])
    parser.add_argument("--no-peer", action="store_true")
    parser.add_argument("--ray", metavar="ADDRESS", help="a cluster that sees this disk")
    arguments = parser.parse_args()
    print(f"{'rows':>12} {'route':<18} {'rows/s':>10} {'rows/CPU s':>10} {'peak MB':>8}")
    for rows in map(int, arguments.rows):
        with tempfile.TemporaryDirectory() as scratch:
            paths = write_table(Path(scratch), rows)
            jobs = [("shiplog", ours)] + ([] if arguments.no_peer else [("group_by_dynamic", peer)])
            if arguments.ray:
                jobs.append(("shiplog on Ray", functools.partial(on_ray, address=arguments.ray)))
            for name, job in jobs:
                took, busy, peak = measure(job, paths, Path(scratch) / f"out_{name}")
                print(
                    f"{rows:>12} {name:<18} {rows / took:>10.3g} {rows / busy:>10.3g} {peak:>8.0f}",
                    flush=True,
                )
    print(f"goal: at least {GOAL_ROWS_PER_SECOND:.0e} rows/s, under 1 GB from 1e7 to 1e8 rows")


if __name__ == "__main__":
    main()
