"""What a watch holds in memory, and how soon it says what a message means.

    python -m pipelines.experiments.watching.resident RUN STORE LOG.mcap
    python -m pipelines.experiments.watching.resident RUN STORE LOG.mcap --latency 60

The first replays a log and prints the memory of the process step by step. The second hands the
log's messages over as they were recorded, ten times a second and more, their stamps moved to now,
and looks every `LOOK_S` as `shiplog watch` does. Latency is from the moment at which a message was
recorded to the provisional point that it makes; the processor time of a look says what that would
be on a core of its own.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import polars as pl
from threadpoolctl import threadpool_limits

from pipelines.experiments.watching.false_alarms import resident_mb
from shiplog.live import messages, preparation, sources, watch_pace
from shiplog.live.error_now import Point
from shiplog.live.messages import Frames
from shiplog.live.session import Watch
from shiplog.live.sources.base import Arrived
from shiplog.nomenclature.units import SECOND_NS
from shiplog.training.runs import load_model
from shiplog.voyages.samples import fields_read
from shiplog.voyages.store.store import Store

EVERY_S = 300.0  # of the log, between two lines
TIMES = ("log_time", "publish_time", "stamp")
LIBRARIES = ("jax", "llvmlite", "torch", "matplotlib", "rerun")  # what a process should not need


class Recorded:
    """A source of a log's messages, each as soon as its time has come."""

    name, live = "recorded", True

    def __init__(self, frames: Frames, metadata) -> None:
        self.frames, self.metadata = dict(frames), metadata

    def look(self, clock: int) -> Arrived:
        now = pl.col("log_time") <= clock
        came = {t: f.filter(now) for t, f in self.frames.items()}
        self.frames = {t: f.filter(~now) for t, f in self.frames.items()}
        return Arrived(
            {t: f for t, f in came.items() if f.height}, metadata=self.metadata,
            ended=not any(f.height for f in self.frames.values()),
        )  # fmt: skip

    def place(self) -> dict:
        return {}

    def close(self) -> None:
        pass


def moved(path: Path, run, seconds: float) -> Recorded:
    """The first seconds of a log, as if they were recorded from now on."""
    source = sources.opened(str(path), fields_read.wanted(run.profile, {}), None)
    parts: dict[str, list[pl.DataFrame]] = {}
    ended, metadata = False, {}
    while not ended:
        arrived = source.look(time.time_ns())
        ended, metadata = arrived.ended, arrived.metadata
        for topic, frame in arrived.frames.items():
            parts.setdefault(topic, []).append(frame)
    source.close()
    frames = {t: pl.concat(own, how="diagonal_relaxed") for t, own in parts.items()}
    first = messages.oldest(frames)
    later = time.time_ns() + SECOND_NS - first
    kept = pl.col("log_time") < first + round(seconds * SECOND_NS)
    return Recorded(
        {
            t: f.filter(kept).with_columns(pl.col(c) + later for c in TIMES if c in f.columns)
            for t, f in frames.items()
        },
        metadata,
    )  # fmt: skip


def latencies(watch: Watch) -> dict[str, np.ndarray]:
    """Of each look that had new messages [n], s: from the newest one to its provisional point, the
    age of that point's row, and the processor time of the look."""
    found: dict[str, list[float]] = {"message to point": [], "age of its row": [], "work": []}
    newest = 0
    while not watch.done:
        began, point = time.process_time(), None
        for event in watch.step(time.time_ns()):
            if isinstance(event, Point) and event.provisional:
                point = event
        now, work = time.time_ns(), time.process_time() - began
        if point is not None and watch.window.newest > newest:
            newest = watch.window.newest
            for what, value in zip(found, (now - newest, now - point.time), strict=False):
                found[what].append(value / SECOND_NS)
            found["work"].append(work)
        if not watch.busy:
            time.sleep(watch_pace.LOOK_S)
    return {what: np.array(values) for what, values in found.items()}


def held(watch: Watch) -> Iterator[tuple[str, float]]:
    """Memory as the log goes on, and at its end."""
    said, first = 0.0, None
    while not watch.done:
        for _ in watch.step(time.time_ns()):
            pass
        first = first or watch.rows.anchor
        at = 0.0 if first is None else ((watch.rows.done or first) - first) / SECOND_NS
        if at - said >= EVERY_S:
            said = at
            yield f"{at / 60.0:.0f} min of rows", resident_mb()
    for _ in watch.finish(time.time_ns()):
        pass
    yield "end of the log", resident_mb()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("run", "store", "log"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--latency", type=float, default=0.0, help="seconds of the log")
    given = parser.parse_args()
    print(f"| modules imported | {resident_mb():.0f} |")
    run, store = load_model.load(given.run), Store(given.store)
    with threadpool_limits(1, user_api="blas"):  # as the command has it
        prepared = preparation.campaign_of(run, given.run, store)
        assert prepared is not None
        print(f"| campaign and thresholds | {resident_mb():.0f} |")
        campaign, calibration = prepared
        watcher = calibration.watcher(6.0)
        if given.latency:
            source = moved(given.log, run, given.latency)
            watch = Watch(run, source, campaign, calibration, watcher)
            for what, values in latencies(watch).items():
                middle, most = np.quantile(values, [0.5, 0.95])
                print(f"{what}: {middle:.3f} s, 95 % below {most:.3f} s, {len(values)} looks")
            return
        source = sources.opened(str(given.log), fields_read.wanted(run.profile, {}), None)
        for what, resident in held(Watch(run, source, campaign, calibration, watcher)):
            print(f"| {what} | {resident:.0f} |", flush=True)
    print("loaded:", ", ".join(name for name in LIBRARIES if name in sys.modules) or "none")


if __name__ == "__main__":
    main()
