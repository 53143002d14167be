"""Memory of a watch that sails on for days.

    python -m pipelines.experiments.watching.days SHIPS SHIP --hours 72

SHIPS is the folder of `ships`. Voyages of four hours, half an hour apart, are sailed in a child
process, which hands their messages over half an hour at a time; the watch takes them as
`shiplog watch` does, with alarm and kept rows. A line after each hour of rows: the memory of the
process. At the end the slope of a straight line through the later two thirds [MB a day of sailing],
with an interval of 90 % by the scatter about it: of all lines, and of the highest line of each
voyage but the last. The source holds what the watch has not yet taken of a voyage, and the next
one: memory rises and falls with each voyage, and after the last one nothing follows. A line an hour
is printed as it comes, so that a run that was stopped has its figure, too: --report FILE reads what
was printed.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.stats import t as student
from threadpoolctl import threadpool_limits

from pipelines.experiments.watching import sailing
from pipelines.experiments.watching.false_alarms import resident_mb
from pipelines.experiments.watching.sailing import Ship
from shiplog.live import preparation
from shiplog.live.messages import Frames
from shiplog.live.session import Watch
from shiplog.live.sources.base import Arrived
from shiplog.nomenclature.units import SECOND_NS
from shiplog.training.runs import load_model
from shiplog.voyages.store.store import Store

FIRST = 400_000  # hours after FIRST_DAY of the first voyage, and its seed
VOYAGE_S, PAUSE_S, AT_ONCE_S = 14_400.0, 1800.0, 1800.0
EVERY_S = 3600.0


def voyage(ship: Ship, number: int) -> tuple[list[Frames], dict[str, dict[str, str]]]:
    """Messages of a voyage, AT_ONCE_S at a time, and its metadata."""
    series = sailing.leg(ship, FIRST + 5 * number, VOYAGE_S)
    reading = sailing.reading_of(series, _profile(ship), sailing.home_instruments.DATUM)
    first = min(int(f["log_time"][0]) for f in reading.frames.values() if f.height)
    parts: list[Frames] = []
    for at in np.arange(0.0, VOYAGE_S, AT_ONCE_S):
        low, high = (first + round(s * SECOND_NS) for s in (at, at + AT_ONCE_S))
        parts.append({t: f.filter(f["log_time"].is_between(low, high, "left"))
                      for t, f in reading.frames.items()})  # fmt: skip
    return parts, dict(reading.contents.metadata)


def _profile(ship: Ship):
    return load_model.load(Path(_SHIPS) / ship.name / "base").profile


_SHIPS = ""


def _begin(ships: str) -> None:
    global _SHIPS
    _SHIPS = ships


class Sailed:
    """A source whose voyages another process sails while the watch is busy with the one before."""

    name, live = "sailed", True

    def __init__(self, ships: Path, ship: Ship, voyages: int) -> None:
        context = get_context("spawn")
        self.pool = ProcessPoolExecutor(1, context, _begin, (str(ships),))
        self.coming = [(ship, number) for number in range(voyages)]
        self.parts: list[Frames] = []
        self.metadata: dict[str, dict[str, str]] = {}
        self._ask()

    def _ask(self) -> None:
        self.future = self.pool.submit(voyage, *self.coming.pop(0)) if self.coming else None

    def look(self, clock: int) -> Arrived:
        if not self.parts and self.future is not None:
            self.parts, self.metadata = self.future.result()
            self._ask()
        frames = self.parts.pop(0) if self.parts else {}
        ended = not self.parts and self.future is None
        return Arrived({t: f for t, f in frames.items() if f.height}, metadata=self.metadata,
                       ended=ended)  # fmt: skip

    def place(self) -> dict:
        return {}

    def close(self) -> None:
        self.pool.shutdown(cancel_futures=True)


def hours(watch: Watch) -> Iterator[tuple[float, float]]:
    """Hours of rows so far, and memory then [MB]."""
    rows, said = 0, 0.0
    while not watch.done:
        for event in watch.step(sailing.LATER):
            final = getattr(event, "final", None)
            rows += 0 if final is None else final.height
        if rows * 0.1 - said >= EVERY_S:
            said = rows * 0.1
            yield said / 3600.0, resident_mb()


def slope(at_h: np.ndarray, memory: np.ndarray) -> tuple[float, float, float]:
    """MB a day of the later two thirds, and its interval of 90 %. Of fewer than four lines nan."""
    kept = slice(len(at_h) // 3, None)
    x, y = at_h[kept] / 24.0, memory[kept]
    if len(x) < 4:
        return np.nan, np.nan, np.nan
    x = x - x.mean()
    found = float(x @ y / (x @ x))
    left = y - y.mean() - found * x
    error = np.sqrt(left @ left / (len(x) - 2) / (x @ x))
    wide = float(student.ppf(0.95, len(x) - 2) * error)
    return found, found - wide, found + wide


def highest(at_h: np.ndarray, memory: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The line of most memory of each voyage but the last."""
    voyage = np.ceil(np.round(at_h * 3600.0 / VOYAGE_S, 2) - 0.1)
    chosen = [
        np.flatnonzero(voyage == v)[memory[voyage == v].argmax()] for v in np.unique(voyage)[:-1]
    ]
    return at_h[chosen], memory[chosen]


def in_words(at_h: np.ndarray, memory: np.ndarray) -> str:
    """Both slopes."""
    line = "{:.2f} MB a day ({:.2f} to {:.2f})"
    return (f"{line.format(*slope(at_h, memory))}; of the highest of each voyage but the last "
            f"{line.format(*slope(*highest(at_h, memory)))}")  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ships", type=Path)
    parser.add_argument("ship")
    parser.add_argument("--hours", type=float, default=72.0)
    parser.add_argument("--report", type=Path)
    given = parser.parse_args()
    if given.report:
        lines = [line.split()[:2] for line in given.report.read_text().splitlines()
                 if line[:1].isdigit()]  # fmt: skip
        print(in_words(*np.array(lines, float).T))
        return
    (ship,) = (s for s in sailing.SHIPS if s.name == given.ship)
    folder = given.ships / ship.name
    run, store = load_model.load(folder / "base"), Store(folder / "store")
    found: list[tuple[float, float]] = []
    with threadpool_limits(1, user_api="blas"), tempfile.TemporaryDirectory() as out:
        prepared = preparation.campaign_of(run, folder / "base", store)
        assert prepared is not None
        campaign, calibration = prepared
        source = Sailed(given.ships, ship, int(np.ceil(given.hours * 3600.0 / VOYAGE_S)))
        watch = Watch(run, source, campaign, calibration, calibration.watcher(1.0), Path(out))
        for at, memory in hours(watch):
            found.append((at, memory))
            print(f"{at:.2f} {memory:.1f} MB, {time.process_time():.0f} s of processor", flush=True)
        source.close()
    print(in_words(*np.array(found).T))


if __name__ == "__main__":
    main()
