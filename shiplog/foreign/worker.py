"""In the child: requests by a pipe, and their answers. Nothing is pickled: a request is JSON with
the shapes of the arrays of doubles that follow it, and so is an answer.

| request | arrays | answer |
| --- | --- | --- |
| describe | | what an FMU says of itself |
| open | rows to try [n, D] | facts of the simulator |
| rates | rows [n, D] | ν̇ [n, 3] |
| slopes | rows [n, D], steps [D - 1] | ν̇ [n, 3], ∂ν̇/∂(x, u, ω) [n, 3, D - 1] |
| roll | start, driven, dt, begin | states [N, I, 6] |
| along | start, acceleration, driven, step | states [S, K, 6] |

A row is as in `rows`, D = 6 + A + 3. Each answer has the troubles: row, second and words.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from shiplog.foreign import integrate
from shiplog.foreign.callables import PythonFunction, Refused
from shiplog.foreign.confinement import confine
from shiplog.foreign.progress import NOW
from shiplog.foreign.rows import Trouble

MOST_BYTES = 1 << 30  # of one message


class Simulator(Protocol):
    """What a kind of simulator answers."""

    def rates(self, rows: np.ndarray) -> tuple[np.ndarray, list[Trouble]]: ...
    def exact(self, rows: np.ndarray) -> np.ndarray | None: ...
    def roll(
        self, start: np.ndarray, driven: np.ndarray, dt: np.ndarray, begin: np.ndarray
    ) -> tuple[np.ndarray, list[Trouble]]: ...


def send(pipe: Connection, head: dict[str, Any], arrays: Sequence[np.ndarray] = ()) -> None:
    """JSON, then arrays of doubles."""
    whole = [np.ascontiguousarray(one, dtype=float) for one in arrays]
    shapes = [list(one.shape) for one in whole]
    pipe.send_bytes(json.dumps(head | {"shapes": shapes}).encode())
    for one in whole:
        pipe.send_bytes(one.tobytes())


def receive(pipe: Connection) -> tuple[dict[str, Any], list[np.ndarray]]:
    """Raises EOFError where the other end has closed, ValueError for what is no message."""
    head = json.loads(pipe.recv_bytes(MOST_BYTES))
    arrays = []
    for shape in head["shapes"]:
        values = np.frombuffer(pipe.recv_bytes(MOST_BYTES), dtype=float)
        arrays.append(values.reshape([int(n) for n in shape]))
    return head, arrays


def serve(pipe: Connection) -> None:
    """Until the pipe ends."""
    lacking = confine()
    simulator: Any = None
    while True:
        try:
            head, arrays = receive(pipe)
        except (EOFError, OSError):
            return
        try:
            if head["do"] == "describe":
                from shiplog.foreign.fmu import description

                send(pipe, {"facts": description(Path(head["path"]))})
                continue
            if head["do"] == "open":
                NOW.open(Path(head["progress"]))
                simulator, facts = opened(head, arrays[0])
                send(pipe, {"facts": facts | {"unlimited": lacking}, "troubles": []})
                continue
            found, troubles = answered(simulator, head["do"], arrays)
            send(pipe, {"troubles": [[t.row, t.second, t.words] for t in troubles]}, found)
        except Refused as error:
            send(pipe, {"refused": str(error)})
        except MemoryError:
            send(pipe, {"refused": "it needed more memory than it may have"})


def opened(head: dict[str, Any], rows: np.ndarray) -> tuple[Simulator, dict[str, Any]]:
    """A simulator that is ready, and what is known of it. Raises Refused."""
    path = Path(head["path"])
    if head["kind"] == "fmu":
        from shiplog.foreign.fmu import Fmu

        found = Fmu(path, head["mapping"])
        return found, found.probe(rows)
    function = Called(path, head["function"], head["actuators"], head["wind"])
    function.probe(rows)
    return function, {
        "returns": function.returns, "step": function.step, "layout": function.layout,
        "library": function.library, "changes": function.changes,
        "differentiated": function.exact(rows[:2]) is not None,
    } | checked(function, rows)  # fmt: skip


class Called(PythonFunction):
    """A function, with its rollouts."""

    def roll(
        self, start: np.ndarray, driven: np.ndarray, dt: np.ndarray, begin: np.ndarray
    ) -> tuple[np.ndarray, list[Trouble]]:
        if self.returns == "next state":
            return integrate.by_steps(self.returned, self.step, start, driven, dt, begin)
        return integrate.by_rates(self.rates, start, driven, dt, begin)


def checked(simulator: Simulator, rows: np.ndarray) -> dict[str, Any]:
    """Whether it is deterministic, and what its accelerations depend on besides velocities."""
    first, troubles = simulator.rates(rows)
    again, _ = simulator.rates(rows)
    scale = np.nanmax(np.abs(first), axis=0, initial=0.0) + 1e-12

    def apart(other: np.ndarray) -> float:
        off = np.abs(other - first) / scale
        return float(np.nanmax(off, initial=0.0))

    def changed(columns: Sequence[int], by: float) -> np.ndarray:
        moved = rows.copy()
        moved[:, list(columns)] += by
        return simulator.rates(moved)[0]

    return {
        "random": apart(again),
        "place": apart(changed((0, 2), 500.0)),
        "time": apart(changed((-1,), 1.0)),
        "troubles": [[t.row, t.second, t.words] for t in troubles],
        "sound": float(np.isfinite(first).all(1).mean()),
    }


def answered(
    simulator: Simulator, do: str, arrays: list[np.ndarray]
) -> tuple[list[np.ndarray], list[Trouble]]:
    """The arrays of an answer, and the troubles."""
    if do == "rates":
        found, troubles = simulator.rates(arrays[0])
        return [found], troubles
    if do == "slopes":
        return slopes(simulator, *arrays)
    if do == "along":
        *given, step = arrays
        states, troubles = integrate.along(simulator.rates, *given, float(step[0]))
        return [states], troubles
    states, troubles = simulator.roll(*arrays)
    return [states], troubles


def slopes(
    simulator: Simulator, rows: np.ndarray, steps: np.ndarray
) -> tuple[list[np.ndarray], list[Trouble]]:
    """ν̇ and ∂ν̇/∂x_i ≈ (ν̇(x + h_i e_i) - ν̇(x - h_i e_i)) / 2h_i, of columns with a step h_i; zero
    for the others. A simulator's own derivatives where it has them."""
    middle, troubles = simulator.rates(rows)
    exact = simulator.exact(rows)
    if exact is not None:
        return [middle, exact], troubles
    found = np.zeros((len(rows), 3, rows.shape[1] - 1))
    columns = np.flatnonzero(steps)
    many = np.repeat(rows[None], 2 * len(columns), axis=0)
    for at, column in enumerate(columns):
        many[2 * at, :, column] += steps[column]
        many[2 * at + 1, :, column] -= steps[column]
    values, more = simulator.rates(many.reshape(-1, rows.shape[1]))
    values = values.reshape(len(columns), 2, len(rows), 3)
    apart = (values[:, 0] - values[:, 1]) / (2.0 * steps[columns, None, None])
    found[..., columns] = np.moveaxis(apart, 0, -1)
    # of a difference that failed on one side, nothing is known: it is zero, and is said
    found[~np.isfinite(found)] = 0.0
    moved = [Trouble(t.row % len(rows), t.second, t.words) for t in more]
    return [middle, found], troubles + moved
