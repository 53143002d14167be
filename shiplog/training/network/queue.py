"""A work queue on this machine: so many processes, a task each at a time.

A process that dies costs the task that it was at and no other. Whatever ends the process that
asked ends the workers.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import connection
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from shiplog.exceptions import ShiplogError
from shiplog.machine import child
from shiplog.machine.unexpected import unexpected

REPORT_INTERVAL_S = 0.5  # between two reports of a worker
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NPROC")

Report = Callable[[float], None]


@dataclass(frozen=True)
class Task:
    """A call in another process: function(*arguments, report=...).

    cost   how long it takes, in any unit; the time left is reckoned by it
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    cost: float = 1.0


@dataclass(frozen=True)
class Event:
    """What became known of a task.

    share    of it that is done, 0 to 1
    ended    whether it is over, with `result`, or with `failure`: why there is none
    """

    task: Task
    share: float
    ended: bool = False
    result: Any = None
    failure: str = ""


@dataclass
class _Worker:
    process: BaseProcess
    pipe: Connection
    task: Task | None = None


def cores() -> int:
    """Those that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def work(tasks: Sequence[Task], workers: int | None = None) -> Generator[Event, None, None]:
    """Do all tasks, in their order; one a core unless `workers` says otherwise.

    A task that fails, or whose process is ended from outside, is an event with `failure`; the
    others go on. Closing the iterator, as any exception does, ends the workers.
    """
    waiting = list(reversed(tasks))
    busy: dict[Connection, _Worker] = {}
    try:
        for _ in range(min(workers or cores(), len(tasks))):
            one = _hire()
            busy[one.pipe] = one
            yield _give(one, waiting.pop())
        while busy:
            for pipe in connection.wait(list(busy)):
                assert isinstance(pipe, Connection)
                one = busy[pipe]
                assert one.task is not None
                kind: str = "died"
                value: Any = None
                with suppress(EOFError, OSError):
                    kind, value = pipe.recv()
                if kind == "share":
                    yield Event(one.task, value)
                    continue
                if kind == "died":
                    one.process.join()
                    yield Event(one.task, 0.0, True, failure=_ended(one.process.exitcode))
                elif kind == "failed":
                    yield Event(one.task, 0.0, True, failure=value)
                else:
                    yield Event(one.task, 1.0, True, value)
                if waiting and kind == "died":
                    del busy[pipe]
                    one = _hire()
                    busy[one.pipe] = one
                if waiting:
                    yield _give(one, waiting.pop())
                elif kind == "died":
                    del busy[pipe]
                else:
                    _send(one, None)
                    one.process.join()
                    del busy[pipe]
    finally:
        for one in busy.values():
            one.process.terminate()
        for one in busy.values():
            one.process.join()


def _hire() -> _Worker:
    """A process for one task at a time.

    One core, one task: numerical libraries of child processes read these at import. Two threads on
    products this small wait for each other more than they work, and on a busy machine for each
    other alone.
    """
    return _Worker(*child.spawn(_serve, dict.fromkeys(THREADS, "1")))


def _give(one: _Worker, task: Task) -> Event:
    one.task = task
    _send(one, (task.function, task.arguments))
    return Event(task, 0.0)


def _send(one: _Worker, what: tuple[Callable[..., Any], tuple[Any, ...]] | None) -> None:
    """To a worker; one that has died meanwhile is found out where its answer is waited for."""
    with suppress(OSError):
        one.pipe.send(what)


def _serve(pipe: Connection) -> None:
    """In a worker: tasks until there are none."""
    while (given := pipe.recv()) is not None:
        function, arguments = given
        latest = [0.0]

        def report(share: float, latest: list[float] = latest) -> None:
            now = time.monotonic()
            if now - latest[0] > REPORT_INTERVAL_S:
                latest[0] = now
                pipe.send(("share", share))

        try:
            answer = ("done", function(*arguments, report=report))
        except ShiplogError as error:
            answer = ("failed", str(error))
        except MemoryError:
            answer = ("failed", "too little memory")
        except OSError as error:  # a disk that is full
            answer = ("failed", f"{error.filename}: {error.strerror}")
        except Exception as error:
            answer = ("failed", str(unexpected(error)))
        pipe.send(answer)


def _ended(code: int | None) -> str:
    """Why a process is no more."""
    if name := child.ending_signal(code):
        why = ", perhaps for want of memory" if name == "SIGKILL" else ""
        return f"its process was ended from outside ({name}{why})"
    return f"its process ended by itself (exit code {code})"
