"""Progress on stderr with the time left, in a terminal only.

`Bars` shows a queue of trainings, `tracked` a list of files, `staged` the stages of a function, and
`loading` that libraries are being loaded. In a file, a queue leaves a line now and then; the others
leave nothing.
"""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from pathlib import Path
from typing import ParamSpec, TypeVar

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from shiplog.nomenclature.numbers import counted

log = logging.getLogger(__name__)

LEAST_BAR, MOST_BAR, WORDS = 4, 40, 50  # letters of a bar, and of what stands next to it
LINE_S = 30.0  # between two lines where there is no terminal
LEAST_DONE = 0.02  # share of the work, below which no time left is given: it would be hours off
# Of a log ingested or a table converted: a first guess that the finished logs correct.
BYTES_PER_S = 1.5e6


class Bars:
    """A bar for all tasks, weighted by their cost, and one for each task in progress.

    noun   what one task is
    """

    def __init__(self, costs: Mapping[str, float], noun: str = "training") -> None:
        self._noun = noun
        self._cost = dict(costs)
        self._whole = sum(costs.values()) or 1.0
        self._share = dict.fromkeys(costs, 0.0)
        self._before: dict[str, float] = {}  # share that an interrupted training goes on from
        self._ended = 0
        self._began = self._latest = time.monotonic()
        self._own: dict[str, TaskID] = {}
        self._progress: Progress | None = None
        if costs and drawable():
            self._progress = _columns()
            self._all = self._progress.add_task(counted(len(costs), noun), total=1.0)

    def __enter__(self) -> Bars:
        if self._progress is not None:
            self._progress.start()
        return self

    def __exit__(self, *why: object) -> None:
        if self._progress is not None:
            self._progress.stop()

    def show(self, name: str, share: float, ended: bool) -> None:
        """Show that this share (0 to 1) of task `name` is done."""
        self._share[name] = 1.0 if ended else share
        self._ended += ended
        if share > 0.0 and not ended:
            self._before.setdefault(name, share)
        done = self._of_all(self._share)
        if self._progress is None:
            self._line(done)
            return
        if name not in self._own:
            self._own[name] = self._progress.add_task(f"  {name}", total=1.0)
        self._progress.update(self._own[name], completed=share, visible=not ended)
        self._progress.update(self._all, completed=done)

    def _of_all(self, share: Mapping[str, float]) -> float:
        return sum(self._cost[n] * s for n, s in share.items()) / self._whole

    def _line(self, done: float) -> None:
        now = time.monotonic()
        if now - self._latest < LINE_S:
            return
        self._latest = now
        here = done - self._of_all(self._before)  # in this process, whose clock it is
        left = ""
        if here >= LEAST_DONE:
            left = f"; about {_duration((now - self._began) * (1.0 - done) / here)} left"
        log.info(
            "%d of %d %ss done, %.0f%%%s", self._ended, len(self._share), self._noun, 100.0 * done,
            left,
        )  # fmt: skip


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h"


P = ParamSpec("P")
T = TypeVar("T")
R = TypeVar("R")


def tracked(
    paths: Sequence[Path], title: str, expected_s: Callable[[Path], float] | None = None
) -> Iterator[Path]:
    """The paths in turn, with a bar in which each counts by the seconds that it is expected to
    take, or else by its size."""
    yield from through(paths, title, expected_s or _expected_s)


def through(items: Sequence[T], title: str, expected_s: Callable[[T], float]) -> Iterator[T]:
    """The items in turn, with a bar in which each counts by the seconds that it is expected to
    take."""
    if not items:
        return
    seconds = {f"{i + 1} of {len(items)}": expected_s(item) for i, item in enumerate(items)}
    with _stages(title, seconds):
        for stage, item in zip(seconds, items, strict=True):
            reach(stage)
            yield item


def staged(title: str, seconds: Mapping[str, float]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function that calls `reach` at each of its stages: a bar runs meanwhile.

    seconds   stage → how long it takes on the sample logs, in the order of the stages
    """

    def decorated(function: Callable[P, R]) -> Callable[P, R]:
        @wraps(function)
        def called(*arguments: P.args, **named: P.kwargs) -> R:
            with _stages(title, seconds):
                return function(*arguments, **named)

        return called

    return decorated


def reach(stage: str) -> None:
    """The function that is `staged` begins this stage. Without a bar nothing happens."""
    bar = _CURRENT.get()
    if bar is not None:
        bar.reach(stage)


class Schedule:
    """Share done and time left of a sequence of stages, from their expected lengths.

    Within a stage the share grows with time, but never beyond the stage's end. The time left is
    scaled by how long the finished stages took against their expected lengths, and where a stage
    takes longer than that, by how long all took until now: a first stage that is read from the
    cache does not make the others as fast.
    """

    def __init__(self, seconds: Mapping[str, float], now: float) -> None:
        self._seconds = dict(seconds)
        self._began = self._entered = now
        self._stage = next(iter(seconds))

    def reach(self, stage: str, now: float) -> None:
        if stage in self._seconds:
            self._stage, self._entered = stage, now

    def at(self, now: float) -> tuple[float, float]:
        """Share done (0 to 1) and seconds left."""
        names = list(self._seconds)
        lengths = list(self._seconds.values())
        index = names.index(self._stage)
        before, whole = sum(lengths[:index]), sum(lengths)
        scale = (self._entered - self._began) / before if before > 0.0 else 1.0
        scale = max(scale, (now - self._began) / max(before + lengths[index], 1e-9))
        inside = (now - self._entered) / max(scale, 1e-9)
        done = min(before + inside, before + lengths[index])
        return done / whole, (whole - done) * scale


class _StageBar(Progress):
    """One bar of a schedule, redrawn with the time."""

    def __init__(self, title: str, schedule: Schedule) -> None:
        self.schedule = schedule
        console = Console(stderr=True)
        super().__init__(
            TextColumn("{task.description}"), _bar(console), TextColumn("{task.percentage:.0f}%"),
            TextColumn("{task.fields[left]} left"), console=console, transient=True,
            refresh_per_second=2,
        )  # fmt: skip
        self._title = title
        self._bar = self.add_task(title, total=1.0, left="")

    def reach(self, stage: str) -> None:
        self.schedule.reach(stage, time.monotonic())
        self.update(self._bar, description=f"{self._title}: {stage}")

    def get_renderables(self) -> Iterable[RenderableType]:
        for bar in self.task_ids:
            share, left = self.schedule.at(time.monotonic())
            self.update(bar, completed=share, left=_duration(left))
        yield from super().get_renderables()


class _Reported:
    """Stages of a function in a child process: it draws nothing, and says the share done."""

    def __init__(self, seconds: Mapping[str, float], report: Callable[[float], None]) -> None:
        self._schedule, self._report = Schedule(seconds, time.monotonic()), report

    def reach(self, stage: str) -> None:
        now = time.monotonic()
        self._schedule.reach(stage, now)
        self._report(self._schedule.at(now)[0])


_CURRENT: ContextVar[_StageBar | _Reported | None] = ContextVar("bar", default=None)


@contextmanager
def reported(seconds: Mapping[str, float], report: Callable[[float], None]) -> Iterator[None]:
    """In a child process, where a function is `staged`: no bar, and at each stage the share done.

    seconds   stage → how long it takes, as of `staged`
    """
    token = _CURRENT.set(_Reported(seconds, report))
    try:
        yield
    finally:
        _CURRENT.reset(token)


def drawable() -> bool:
    """Whether a bar can be drawn: stderr is a terminal."""
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def loading() -> Iterator[None]:
    """Say, in a terminal, that libraries are being loaded: torch and JAX take seconds."""
    if not drawable() or _CURRENT.get() is not None:
        yield
        return
    sys.stderr.write("loading")
    sys.stderr.flush()
    try:
        yield
    finally:
        sys.stderr.write("\r\x1b[K")  # over it, to the end of the line


@contextmanager
def _stages(title: str, seconds: Mapping[str, float]) -> Iterator[None]:
    if not drawable() or _CURRENT.get() is not None:  # one display at a time
        yield
        return
    bar = _StageBar(title, Schedule(seconds, time.monotonic()))
    token = _CURRENT.set(bar)
    try:
        with bar:
            yield
    finally:
        _CURRENT.reset(token)


def _columns() -> Progress:
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"), _bar(console), TextColumn("{task.percentage:.0f}%"),
        TimeRemainingColumn(), console=console, transient=True, refresh_per_second=2,
        speed_estimate_period=600.0,
    )  # fmt: skip


def _bar(console: Console) -> BarColumn:
    """The bar gives way to its words in a narrow terminal."""
    return BarColumn(bar_width=max(LEAST_BAR, min(MOST_BAR, console.width - WORDS)))


def _expected_s(path: Path) -> float:
    try:
        files = [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file()]
        size = sum(one.stat().st_size for one in files)
    except OSError:  # the reader says what is wrong with it
        size = 0
    return max(size, 1) / BYTES_PER_S
