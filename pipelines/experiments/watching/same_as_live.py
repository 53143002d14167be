"""Whether the segments of a leg that are worked out together are those of a watch of its messages.

    python -m pipelines.experiments.watching.same_as_live SHIPS KEPT SHIP --legs 2

The messages of a leg go through `Watch.step`, ten seconds at a time: causal rows, finished
segments, evidence, alarm. `false_alarms` makes rows of the whole leg and linearises all segments
together. Printed are the greatest differences of the statistic, in nats, and the alarms of both.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from pipelines.experiments.watching import rates, sailing, segments_kept
from pipelines.experiments.watching.false_alarms import FIRST
from pipelines.experiments.watching.rates import RATES, Known
from pipelines.experiments.watching.resident import Recorded
from shiplog.live import segment_products
from shiplog.live.alarm import Alarm, Watcher
from shiplog.live.events import SegmentDone
from shiplog.live.nominal import Nominal
from shiplog.live.session import Watch
from shiplog.live.sources.base import Source
from shiplog.training.runs import load_model
from shiplog.training.runs.load_model import Run


def live(run: Run, of: Nominal, source: Source, watcher: Watcher) -> tuple[list[float], list[int]]:
    """The statistic of each segment, and the numbers of those that raised an alarm."""
    watch = Watch(run, source, of.without_segments(), watcher=watcher)
    statistics: list[float] = []
    alarms: list[int] = []
    while not watch.done:
        for event in watch.step(sailing.LATER):
            if isinstance(event, SegmentDone):
                statistics.append(event.statistic)
            elif isinstance(event, Alarm) and not event.again:
                alarms.append(len(statistics) - 1)
    for event in watch.finish(sailing.LATER):
        if isinstance(event, SegmentDone):
            statistics.append(event.statistic)
        elif isinstance(event, Alarm) and not event.again:
            alarms.append(len(statistics) - 1)
    return statistics, alarms


def batch(ship: Known, products: np.ndarray, per_day: float) -> tuple[list[float], list[int]]:
    """The same of products H_s [S, N, N]."""
    watcher, statistics, alarms = ship.watcher(per_day), [], []
    for i, one in enumerate(products):
        alarm = watcher.add_product(one, i)
        assert watcher.latest is not None
        statistics.append(watcher.latest.total)
        if alarm is not None and not alarm.again:
            alarms.append(i)
    return statistics, alarms


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ships", type=Path)
    parser.add_argument("kept", type=Path)
    parser.add_argument("ship")
    parser.add_argument("--legs", type=int, default=2)
    given = parser.parse_args()
    with threadpool_limits(1, user_api="blas"):  # of matrices too small to share out
        compare(given)


def compare(given: argparse.Namespace) -> None:
    (ship,) = (s for s in sailing.SHIPS if s.name == given.ship)
    run = load_model.load(given.ships / ship.name / "base")
    of, known = segments_kept.campaign_of(given.ships / ship.name), rates.known(given.kept)
    directions = segment_products.directions(of.campaign)
    profile = of.record.profile
    for number in range(FIRST, FIRST + given.legs):
        series = sailing.leg(ship, number)
        reading = sailing.reading_of(series, profile, sailing.home_instruments.DATUM)
        record = sailing.record_of(series, profile)
        H = segments_kept.products(of, record, directions)
        for per_day in RATES:
            own = known[ship.name].watcher(per_day)
            watcher = Watcher(directions, own.thresholds, own.median)
            source = Recorded(reading.frames, reading.contents.metadata)
            one, raised = live(run, of, source, watcher)
            other, expected = batch(known[ship.name], H, per_day)
            apart = np.abs(np.array(one) - other).max() if len(one) == len(other) else np.nan
            print(
                f"{ship.name} leg {number}, {per_day:g} a day: {len(one)} and {len(other)} "
                f"segments, {apart:.2g} nats apart, alarms at {raised} and {expected}",
                flush=True,
            )


if __name__ == "__main__":
    main()
