"""`--to python`: one file of numpy, without shiplog."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from shiplog.export import asked_function, statements, written_python
from shiplog.export.filled import filled, inert
from shiplog.export.job import Job
from shiplog.export.languages import PYTHON
from shiplog.export.ship import Ship
from shiplog.export.trial import Difference, Trial, difference
from shiplog.machine import files

CONSUMER = "numpy"


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    files.write_text(path, text(job.ship, record))


def losses(job: Job) -> tuple[str, ...]:
    return job.ship.losses


def compare(job: Job, path: Path) -> Difference:
    given = () if job.ship.function is None else (asked_function.of_job(job),)
    return difference(job.trial, sail(job.ship, job.trial, path, given))


def text(ship: Ship, record: Sequence[str]) -> str:
    made = statements.written(ship.equations, PYTHON, _product)
    inputs, given = ship.inputs, ship.function
    return filled("ship_py.txt", {
        "GIVEN_FIRST": "f, " if given else "", "GIVEN_SELF": "f, " if given else "",
        "GIVEN_ARRAY": ", array=np.asarray" if given else "",
        "GIVEN_PARAMETER": ", given" if given else "",
        "GIVEN_ARGUMENT": ", self._given" if given else "",
        "GIVEN_ADDED": f" + asked(given, x, {', '.join(made.outputs[3:])})" if given else "",
        "GIVEN_NAME": inert(f"{given.function} of {given.name}") if given else "",
        "SHA256": given.sha256 if given else "",
        "GIVEN_FACTS": ", ".join(
            map(repr, (given.returns, given.step, given.layout, given.wind))
        ) if given else "",
        "SHIP": inert(ship.ship), "RUN": inert(ship.run), "LABEL": inert(ship.label),
        "AUTHOR": ship.author, "RECORD": "\n".join(inert(line) for line in record),
        "METHOD": "Heun's method" if ship.heun else "Euler's method",
        "UNITS": ", ".join(f"{i.unit} ({i.name})" for i in inputs),
        "SPEED": f"{ship.speed:.6g}", "FIRST": inputs[0].name, "STEP": repr(ship.step),
        "ACTUATORS": _tuple(repr(i.name) for i in inputs),
        "APPROACH": _tuple(repr(i.approach) for i in inputs),
        "RATE": _tuple(repr(i.rate) for i in inputs),
        "OFFSET": _tuple(repr(i.offset) for i in inputs),
        "GEARED": _tuple(repr(i.geared) for i in inputs),
        "LAG": repr(ship.lag), "DELAY": repr(ship.delay), "HEUN": repr(ship.heun),
        "LIMITS": _tuple(PYTHON.number(x) for x in ship.limits),
        "COEFFICIENTS": "\n".join(
            f"    {inert(n.name)!r}: ({n.value!r}, {inert(n.unit)!r}, {inert(n.meaning)!r}),"
            for n in ship.numbers
        ),
        "MATRICES": "".join(_matrix(i, m) for i, m in enumerate(ship.equations.matrices)) + "\n",
        "CONSTANTS": str(made.constants), "HOISTED": _indented(made.hoisted),
        "VARYING": _indented(made.varying) or "    pass",
        "SURGE": made.outputs[0], "SWAY": made.outputs[1], "YAW": made.outputs[2],
    }, given=given is not None)  # fmt: skip


def sail(ship: Ship, trial: Trial, path: Path, given: tuple[Any, ...] = ()) -> np.ndarray:
    """[n, 6] by the file itself, which shiplog has just written, with the function that it asks."""
    known = written_python.names_of(path, ship.identifier)
    made = known["Ship"](*given, *trial.start)
    found = np.empty((len(trial.orders), 6))
    for k, orders in enumerate(trial.orders):
        driven = dict(zip(known["ACTUATORS"], orders, strict=True))
        found[k] = made.step(driven, trial.water.wind, trial.water.current)
    return found


def version() -> str:
    return np.__version__


def _tuple(words) -> str:
    return "".join(f"{word}, " for word in words).rstrip(" ")


def _indented(lines: Sequence[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


def _matrix(place: int, matrix: np.ndarray) -> str:
    text = base64.b64encode(np.ascontiguousarray(matrix, dtype="<f8").tobytes()).decode()
    return f'MATRIX{place} = _matrix({len(matrix)}, "{text}")\n'


def _product(name: str, matrix: int, rows: int, given: list[str]) -> list[str]:
    return [f"{name} = _times(MATRIX{matrix}, {', '.join(given)})"]
