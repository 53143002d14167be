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
from typing import Any

import numpy as np

from shiplog.foreign import integrate
from shiplog.foreign.callables import PythonFunction, Refused
from shiplog.foreign.confinement import confine
from shiplog.foreign.progress import NOW
from shiplog.foreign.rows import Trouble
from shiplog.foreign.trying import Simulator, checked, slopes

MOST_BYTES = 1 << 30  # of one message


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
                from shiplog.foreign.fmu_file import description

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
        from shiplog.foreign.exchange import ExchangeFmu
        from shiplog.foreign.fmu import Fmu

        found = (ExchangeFmu if head["mapping"]["exchange"] else Fmu)(path, head["mapping"])
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


def answered(
    simulator: Simulator, do: str, arrays: list[np.ndarray]
) -> tuple[list[np.ndarray], list[Trouble]]:
    """The arrays of an answer, and the troubles."""
    if do == "rates":
        found, troubles = simulator.rates(arrays[0])
        return [found], troubles
    if do == "slopes":
        rows, steps = arrays
        return slopes(simulator, rows, steps)
    if do == "along":
        start, acceleration, driven, step = arrays
        states, troubles = integrate.along(
            simulator.rates, start, acceleration, driven, float(step[0])
        )
    else:
        start, driven, dt, begin = arrays
        states, troubles = simulator.roll(start, driven, dt, begin)
    return [states], troubles
