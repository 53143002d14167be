"""`--to mss`: a function for MATLAB and Octave, as the Marine Systems Simulator has its vessels."""

from __future__ import annotations

import base64
import re
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shiplog.exceptions import UsageError
from shiplog.export import compilers, statements
from shiplog.export.filled import filled, inert
from shiplog.export.job import Job
from shiplog.export.languages import OCTAVE
from shiplog.export.not_loaded import NotLoaded
from shiplog.export.ship import Ship
from shiplog.export.trial import Difference, Trial, difference
from shiplog.machine import files

CONSUMER = "Octave"
LONGEST_NAME = 63  # letters, of MATLAB
KEYWORDS = frozenset({
    "break", "case", "catch", "classdef", "continue", "else", "elseif", "end", "for", "function",
    "global", "if", "otherwise", "parfor", "persistent", "return", "spmd", "switch", "try", "while",
})  # fmt: skip
DRIVE = """
f = fopen('given.bin'); given = fread(f, Inf, 'double'); fclose(f);
start = given(1:6); wind = given(7:8); current = given(9:10); count = given(11);
orders = reshape(given(12:end), [], count);
x = start([2 4 6 1 3 5]); memory = []; out = zeros(6, count);
V = hypot(current(1), current(2)); beta = atan2(current(2), current(1));
for k = 1:count
    [x, memory] = FILE('step', x, orders(:, k), V, beta, wind, memory);
    out(:, k) = x([4 1 5 2 6 3]);
end
f = fopen('found.bin', 'w'); fwrite(f, out, 'double'); fclose(f);
"""


def write(job: Job, path: Path, record: Sequence[str]) -> None:
    """Raises UsageError for a file's name that no function can have."""
    good = re.fullmatch(r"[A-Za-z]\w*", path.stem, re.ASCII) and path.stem not in KEYWORDS
    if not good or len(path.stem) > LONGEST_NAME:
        raise UsageError(
            f"A function of MATLAB cannot be called {path.stem!r}, and its file has its name.",
            hint=f"give --out a name of letters, digits and _, such as {job.ship.identifier}.m.",
        )
    files.write_text(path, text(job.ship, path.stem, record))


def text(ship: Ship, name: str, record: Sequence[str]) -> str:
    made = statements.written(ship.equations, OCTAVE, _product)
    inputs = ship.inputs
    units = "; ".join(f"{i.name} ({i.unit})" for i in inputs)
    rows = [f"{n.value!r} % {inert(f'{n.name}, {n.unit}, {n.meaning}')}" for n in ship.numbers]
    return filled("ship_m.txt", {
        "FILE": name, "SHIP": inert(ship.ship), "RUN": inert(ship.run),
        "LABEL": inert(ship.label), "AUTHOR": ship.author, "UNITS": units,
        "RECORD": "\n".join(f"% {inert(line)}" for line in record) or "%",
        "METHOD": "Heun's method" if ship.heun else "Euler's method", "STEP": repr(ship.step),
        "APPROACH": _row(i.approach for i in inputs), "RATE": _row(i.rate for i in inputs),
        "OFFSET": _row(i.offset for i in inputs), "GEARED": _row(int(i.geared) for i in inputs),
        "LENGTH": repr(ship.length), "SPEED": repr(ship.speed), "LAG": repr(ship.lag),
        "DELAY": repr(ship.delay), "HEUN": str(int(ship.heun)),
        "ACTUATORS": ", ".join(f"'{i.name}'" for i in inputs),
        "NAMES": ", ".join("'" + inert(n.name).replace("'", "''") + "'" for n in ship.numbers),
        "COEFFICIENTS": "\n".join(rows), "CONSTANTS": str(max(made.constants, 1)),
        "HOISTED": "\n".join(made.hoisted), "VARYING": "\n".join(made.varying),
        "MATRICES": "".join(_matrix(i, m) for i, m in enumerate(ship.equations.matrices)),
        "SURGE": made.outputs[0], "SWAY": made.outputs[1], "YAW": made.outputs[2],
    })  # fmt: skip


def losses(job: Job) -> tuple[str, ...]:
    return job.ship.losses


def compare(job: Job, path: Path) -> Difference:
    return difference(job.trial, sail(job.trial, path))


def sail(trial: Trial, path: Path) -> np.ndarray:
    """[n, 6] by Octave. Raises NotLoaded without it."""
    program = octave()
    if program is None:
        raise NotLoaded("Octave is not installed (octave-cli)")
    water, folder = trial.water, path.parent
    given = np.concatenate(
        (trial.start, water.wind, water.current, [len(trial.orders)], trial.orders.ravel())
    )
    (folder / "given.bin").write_bytes(given.tobytes())
    (folder / "drive.m").write_text(DRIVE.replace("FILE", path.stem), encoding="utf-8")
    compilers.run([program, "--norc", "--quiet", "--no-gui", "drive.m"], folder)
    return np.frombuffer((folder / "found.bin").read_bytes()).reshape(-1, 6)


def octave() -> str | None:
    return shutil.which("octave-cli") or shutil.which("octave")


def version() -> str:
    program = octave()
    if program is None:
        return ""
    said = subprocess.run([program, "--version"], capture_output=True, check=False, text=True)
    found = re.search(r"\d+(\.\d+)+", said.stdout)
    return found[0] if found else ""


def _row(values) -> str:
    return " ".join(repr(value) for value in values)


def _matrix(place: int, matrix: np.ndarray) -> str:
    """Known from its first use on: [m, k], column by column, as base64 of doubles."""
    words = base64.b64encode(np.asarray(matrix, dtype="<f8").tobytes("F")).decode()
    shape = f"{matrix.shape[0]}, {matrix.shape[1]}"
    return (
        f"persistent matrix{place}\nif isempty(matrix{place})\n"
        f"    matrix{place} = reshape(typecast(matlab.net.base64decode('{words}'), 'double'), "
        f"{shape});\nend\n"
    )


def _product(name: str, matrix: int, rows: int, given: list[str]) -> list[str]:
    return [f"{name} = matrix{matrix} * [{'; '.join(given)}];"]
