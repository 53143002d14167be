"""Progress of a queue on stderr: bars with the time left, or a line now and then in a file."""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Mapping

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

log = logging.getLogger(__name__)

LINE_S = 30.0  # between two lines where there is no terminal


class Bars:
    """A bar for all tasks, weighed by what they cost, and one for each that is being done."""

    def __init__(self, costs: Mapping[str, float]) -> None:
        self._cost = dict(costs)
        self._whole = sum(costs.values()) or 1.0
        self._share = dict.fromkeys(costs, 0.0)
        self._ended = 0
        self._began = self._latest = time.monotonic()
        self._own: dict[str, TaskID] = {}
        self._progress: Progress | None = None
        if costs and sys.stderr.isatty():
            self._progress = Progress(
                TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:.0f}%"),
                TimeRemainingColumn(), console=Console(stderr=True), transient=True,
                refresh_per_second=2, speed_estimate_period=600.0,
            )  # fmt: skip
            self._all = self._progress.add_task(f"{len(costs)} trainings", total=1.0)

    def __enter__(self) -> Bars:
        if self._progress is not None:
            self._progress.start()
        return self

    def __exit__(self, *why: object) -> None:
        if self._progress is not None:
            self._progress.stop()

    def show(self, name: str, share: float, ended: bool) -> None:
        """Task `name` is done to this share."""
        self._share[name] = 1.0 if ended else share
        self._ended += ended
        done = sum(self._cost[n] * s for n, s in self._share.items()) / self._whole
        if self._progress is None:
            self._line(done)
            return
        if name not in self._own:
            self._own[name] = self._progress.add_task(f"  {name}", total=1.0)
        self._progress.update(self._own[name], completed=share, visible=not ended)
        self._progress.update(self._all, completed=done)

    def _line(self, done: float) -> None:
        now = time.monotonic()
        if now - self._latest < LINE_S or done <= 0.0:
            return
        self._latest = now
        left = (now - self._began) * (1.0 - done) / done
        log.info(
            "%d of %d trainings done, %.0f%%; about %s left",
            self._ended, len(self._share), 100.0 * done, _duration(left),
        )  # fmt: skip


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h"
