"""The parent's end of the children that run a simulator: requests shared out among them, answers
in the order of the rows, and a child that ended or hangs replaced.

What a child cannot answer is not a number, and is kept as a trouble: with the second of the voyage
at which it happened. The rows after it go on.
"""

from __future__ import annotations

import contextlib
import logging
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.foreign import progress, worker
from shiplog.foreign.rows import Trouble
from shiplog.foreign.source import SimulatorError, Source
from shiplog.machine import child as children

log = logging.getLogger(__name__)

PATIENCE_S = 180.0  # s without an answer, after which a child is ended by force
PATIENCE_PART = 0.2  # of it, that a request should take
STEPS_OF_A_SECOND = 20  # of a rollout, each as long as an acceleration
OPENING_S = 300.0  # the same of its start: torch or JAX is imported
MOST_LETTERS = 300  # of what a simulator says of a failure
RESTARTS = 20  # of children that ended, in one call; more is no simulator
ROWS_AT_A_TIME = 4096  # of a request: tens of megabytes with their differences
SLOW_ROWS = 64  # of a simulator that is asked row by row: fewer are not worth a second process
CHILDREN = max(1, min(4, os.cpu_count() or 1))
CALM = {  # a child computes on one core, and leaves graphics and clusters alone
    "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1",
    "JAX_PLATFORMS": "cpu", "CUDA_VISIBLE_DEVICES": "", "PYTHONDONTWRITEBYTECODE": "1",
}  # fmt: skip


@dataclass(frozen=True)
class Ship:
    """What a simulator is given: names of the actuators in the profile's order, and whether the
    ship has an anemometer."""

    actuators: tuple[str, ...]
    wind: bool


class _Ended(Exception):
    """A child is no more, with what is to be said of it."""


@dataclass(frozen=True)
class _Child:
    """process, its pipe, and the file in which it says how far it has come."""

    process: Any
    pipe: Connection
    progress: Path

    def end(self) -> None:
        self.pipe.close()
        self.process.kill()
        self.process.join()
        self.progress.unlink(missing_ok=True)


@dataclass
class Bridge:
    """Children of one simulator; they start with the first request.

    settings   of its mapping, as JSON
    probe      rows [n, D] at which it was tried when it was opened
    troubles   all that went wrong so far
    """

    source: Source
    ship: Ship
    settings: Mapping[str, Any]
    probe: np.ndarray
    troubles: list[Trouble] = field(default_factory=list)
    _children: list[_Child] = field(default_factory=list)
    _facts: dict[str, Any] | None = None
    _restarts: int = 0

    @staticmethod
    def describe(source: Source) -> dict[str, Any]:
        """What an FMU says of itself, read in a child. Raises SimulatorError."""
        process, pipe = children.spawn(worker.serve, CALM)
        try:
            worker.send(pipe, {"do": "describe", "path": str(source.path)})
            answer, _ = _received(pipe, OPENING_S)
        except (_Ended, OSError) as error:
            raise SimulatorError(
                f"{source.name} {error}, when it was to be read.", hint="look into the FMU."
            ) from error
        finally:
            pipe.close()
            process.kill()
            process.join()
        if "refused" in answer:
            raise SimulatorError(
                f"{source.name} cannot be used: {_inert(answer['refused'])}.",
                hint="mend that, and give the same command again.",
            )
        return answer["facts"]

    # --- requests ---

    @property
    def facts(self) -> dict[str, Any]:
        """What is known of the simulator. Raises SimulatorError where it cannot be used."""
        if self._facts is None:
            self._child(0)
        assert self._facts is not None
        return self._facts

    def rates(self, rows: np.ndarray) -> np.ndarray:
        """ν̇ [n, 3] of rows [n, D]."""
        (found,) = self._shared("rates", [rows], (), [(3,)])
        return found

    def slopes(self, rows: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """ν̇ [n, 3] and ∂ν̇/∂(x, u, ω) [n, 3, D - 1]."""
        width = rows.shape[1] - 1
        middle, by = self._shared("slopes", [rows], (steps,), [(3,), (3, width)])
        return middle, np.nan_to_num(by)

    def roll(
        self, start: np.ndarray, driven: np.ndarray, dt: np.ndarray, begin: np.ndarray
    ) -> tuple[np.ndarray, list[Trouble]]:
        """States [N, I, 6], and what went wrong in them, by window."""
        before = len(self.troubles)
        (found,) = self._shared("roll", [start, driven, dt, begin], (), [(driven.shape[1], 6)])
        return found, self.troubles[before:]

    def along(
        self, start: np.ndarray, acceleration: np.ndarray, driven: np.ndarray, step: np.ndarray
    ) -> np.ndarray:
        """States [S, K, 6]."""
        given, shape = [start, acceleration, driven], (driven.shape[1], 6)
        (found,) = self._shared("along", given, (step,), [shape])
        return found

    # --- children ---

    @property
    def _slow(self) -> bool:
        return self.facts.get("layout") not in ("rows", "columns")

    def _shared(
        self, do: str, by_row: Sequence[np.ndarray], whole: Sequence[np.ndarray],
        shapes: Sequence[tuple[int, ...]],
    ) -> list[np.ndarray]:  # fmt: skip
        """Arrays [n, …] of the rows, in parts of which each child has one at a time."""
        count = len(by_row[0])
        least = 1 if do == "roll" else SLOW_ROWS
        many = min(CHILDREN, max(1, count // least)) if self._slow else 1
        # of a slow one only as many as it answers within a part of the patience
        each = self.facts["seconds"] * _accelerations(do, by_row)
        soon = int(PATIENCE_PART * PATIENCE_S / max(each, 1e-9))
        size = min(ROWS_AT_A_TIME, max(1, soon), max(1, -(-count // many)))
        parts = [slice(at, min(at + size, count)) for at in range(0, count, size)]
        found = [np.full((count, *shape), np.nan) for shape in shapes]
        for at in range(0, len(parts), many):
            some = parts[at : at + many]
            asked: list[tuple[int, slice, list[np.ndarray]]] = []
            for number, part in enumerate(some):
                given = [*(one[part] for one in by_row), *whole]
                self._send(number, do, given)
                asked.append((number, part, given))
            for number, part, given in asked:
                self._answer(number, part, do, given, len(by_row), found)
        return found

    def _send(self, number: int, do: str, given: Sequence[np.ndarray]) -> None:
        child = self._child(number)
        progress.begun(child.progress)
        with contextlib.suppress(OSError):  # that it has ended is found when it is to answer
            worker.send(child.pipe, {"do": do}, given)

    def _answer(
        self, number: int, part: slice, do: str, given: list[np.ndarray], by_row: int,
        found: list[np.ndarray],
    ) -> None:  # fmt: skip
        """Fill in a part; one whose child ended is asked again in halves, until its row is
        found."""
        try:
            head, arrays = self._received(number, PATIENCE_S)
        except _Ended as error:
            reached = progress.read(self._children[number].progress)
            self._restart(number)
            count = part.stop - part.start
            if count == 1:
                second = reached if np.isfinite(reached) else float(given[0][0, -1])
                self._note(Trouble(part.start, second, str(error)))
                return
            half = count // 2
            for own in (slice(0, half), slice(half, count)):
                some = [*(one[own] for one in given[:by_row]), *given[by_row:]]
                self._send(number, do, some)
                there = slice(part.start + own.start, part.start + own.stop)
                self._answer(number, there, do, some, by_row, found)
            return
        for row, second, words in head.get("troubles", ()):
            self._note(Trouble(part.start + int(row), float(second), _inert(str(words))))
        for whole, values in zip(found, arrays, strict=True):
            if values.shape != whole[part].shape:
                raise SimulatorError(
                    f"{self.source.name} answered with an array of shape {values.shape}; expected "
                    f"{whole[part].shape}.",
                    hint="look into the simulator.",
                )
            whole[part] = values

    def _note(self, trouble: Trouble) -> None:
        if len(self.troubles) < 10_000:
            self.troubles.append(trouble)

    def _child(self, number: int) -> _Child:
        while len(self._children) <= number:
            self._children.append(self._started())
        return self._children[number]

    def _started(self) -> _Child:
        """A child in which the simulator is open. Raises SimulatorError."""
        number, name = tempfile.mkstemp(prefix="shiplog-progress-")
        os.close(number)
        progress.begun(Path(name))
        new = _Child(*children.spawn(worker.serve, CALM), Path(name))
        head = {
            "do": "open", "path": str(self.source.path), "kind": self.source.kind,
            "function": self.source.function, "actuators": len(self.ship.actuators),
            "wind": self.ship.wind, "mapping": self.settings, "progress": name,
        }  # fmt: skip
        try:
            worker.send(new.pipe, head, [self.probe])
            answer, _ = _received(new.pipe, OPENING_S)
        except (_Ended, OSError) as error:
            new.end()
            raise SimulatorError(
                f"{self.source.name} {error}, before it gave one step.",
                hint="look into the simulator: it has to give a step of this ship.",
            ) from error
        if "refused" in answer:
            new.end()
            raise SimulatorError(
                f"{self.source.name} cannot be used: {_inert(answer['refused'])}.",
                hint="mend that, and give the same command again.",
            )
        if self._facts is None:
            self._facts = answer["facts"]
            for what in answer["facts"].get("unlimited", ()):
                log.warning("%s: its %s cannot be limited here.", self.source.name, what)
        return new

    def _received(self, number: int, patience: float) -> tuple[dict[str, Any], list[np.ndarray]]:
        head, arrays = _received(self._children[number].pipe, patience)
        if "refused" in head:
            raise _Ended(_inert(head["refused"]))
        return head, arrays

    def _restart(self, number: int) -> None:
        """Raises SimulatorError where it has ended too often."""
        self._children[number].end()
        self._restarts += 1
        if self._restarts > RESTARTS:
            raise SimulatorError(
                f"{self.source.name} ended its process {self._restarts} times.",
                hint="look into the simulator.",
            )
        self._children[number] = self._started()

    def close(self) -> None:
        for one in self._children:
            one.end()
        self._children.clear()


def _received(pipe: Connection, patience: float) -> tuple[dict[str, Any], list[np.ndarray]]:
    """Raises _Ended."""
    try:
        if not pipe.poll(patience):
            raise _Ended(f"gave no answer within {patience:g} s")
        return worker.receive(pipe)
    except (EOFError, OSError) as error:
        raise _Ended("ended its process") from error
    except (ValueError, KeyError, TypeError) as error:
        raise _Ended("gave an answer that cannot be read") from error


def _inert(words: str) -> str:
    """A stranger's words on one line, without what a terminal would act on."""
    return "".join(c if c.isprintable() else " " for c in words)[:MOST_LETTERS]


def _accelerations(do: str, by_row: Sequence[np.ndarray]) -> int:
    """How many accelerations a row of a request takes."""
    if do == "roll":
        return STEPS_OF_A_SECOND * by_row[1].shape[1]
    if do == "along":
        return by_row[2].shape[1]
    return 2 * by_row[0].shape[1] if do == "slopes" else 1
