"""A ship as C: one header of functions that are the same in C99 and C++11."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from shiplog.export import statements
from shiplog.export.filled import filled, inert
from shiplog.export.languages import C
from shiplog.export.ship import Ship

WIDTH = 6  # numbers a line


def header(ship: Ship, record: Sequence[str]) -> str:
    """`record`: lines of the comment at its head, such as how it compares with `simulate`."""
    name = ship.identifier
    made = statements.written(ship.equations, C, _product)
    inputs = ship.inputs
    whole, part = divmod(ship.delay / ship.step, 1.0)
    tables = {
        "COEFFICIENT": ship.theta, "APPROACH": [i.approach for i in inputs],
        "RATE": [i.rate for i in inputs], "OFFSET": [i.offset for i in inputs],
        "STEERS": [float(i.geared) for i in inputs],
    }  # fmt: skip
    words = {
        "NAME": name, "RUN": inert(ship.run), "SHIP": inert(ship.ship),
        "LABEL": inert(ship.label), "AUTHOR": ship.author, "RECORD": comment(record),
        "METHOD": "Heun's method" if ship.heun else "Euler's method",
        "UNITS": ", ".join(f"{i.unit} ({i.name})" for i in inputs),
        "COEFFICIENTS": str(len(ship.numbers)), "CONSTANTS": str(made.constants),
        "ACTUATORS": str(len(inputs)), "PAST": str(max(ship.past, 1)), "STEP": repr(ship.step),
        "PLACES": _places(ship),
        "ARRAYS": "\n".join(_table(name, key, values) for key, values in tables.items()),
        "MATRICES": "".join(_matrix(name, i, m) for i, m in enumerate(ship.equations.matrices)),
        "HOISTED": _indented(made.hoisted), "VARYING": _indented(made.varying),
        "SURGE": made.outputs[0], "SWAY": made.outputs[1], "YAW": made.outputs[2],
        "DELAYED": str(int(ship.delay > 0.0)), "LAGGING": str(int(ship.lag > 0.0)),
        "WHOLE": str(int(whole)), "PART": repr(part),
        "SHARE": repr(1.0 - math.exp(-ship.step / ship.lag) if ship.lag > 0.0 else 1.0),
        "HEUN": str(int(ship.heun)), "LIMIT_SURGE": C.number(ship.limits[0]),
        "LIMIT_SWAY": C.number(ship.limits[1]), "LIMIT_YAW": C.number(ship.limits[2]),
        "WATER": ", ".join(made.outputs[3:]),
        "GIVEN_PARAMETER": ", struct given *given" if ship.unit else "",
        "GIVEN_ARGUMENT": ", p->given" if ship.unit else "",
    }  # fmt: skip
    return filled("ship.h", words, given=ship.unit is not None)


def _places(ship: Ship) -> str:
    taken: dict[str, None] = {}
    lines = []
    for i, one in enumerate(ship.numbers):
        word = re.sub(r"\W", "_", f"{ship.identifier}_{one.name}", flags=re.ASCII)
        word = word if word not in taken else f"{word}_{i}"
        taken[word] = None
        lines.append(f"    {word} = {i}, /* {inert(f'{one.unit} {one.meaning}').strip()} */")
    return "\n".join(lines) or f"    {ship.identifier}_NONE = 0"


def comment(lines: Sequence[str]) -> str:
    return "\n".join(f" * {inert(line)}" for line in lines) or " *"


def _indented(lines: Sequence[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


def _table(name: str, key: str, values: Sequence[float] | np.ndarray) -> str:
    rows = numbers(values if len(values) else [0.0])
    return f"static const double {name}_{key}[] = {{\n{rows}\n}};"


def numbers(values: Sequence[float] | np.ndarray) -> str:
    each = [repr(float(value)) for value in values]
    rows = [", ".join(each[i : i + WIDTH]) for i in range(0, len(each), WIDTH)]
    return ",\n".join(f"    {row}" for row in rows)


def _matrix(name: str, place: int, matrix: np.ndarray) -> str:
    rows, columns = matrix.shape
    return f"""
/* [{rows}, {columns}], column by column, times a vector */
static const double {name}_MATRIX{place}[] = {{
{numbers(matrix.T.ravel())}
}};
static void {name}_product{place}(const double *given, double *found) {{
    int i, j;
    for (i = 0; i < {rows}; ++i) found[i] = 0.0;
    for (j = 0; j < {columns}; ++j) {{
        const double *column = {name}_MATRIX{place} + j * {rows};
        for (i = 0; i < {rows}; ++i) found[i] += column[i] * given[j];
    }}
}}
"""


def _product(name: str, matrix: int, rows: int, given: list[str]) -> list[str]:
    kept = [f"{name}_of[{i}] = {text};" for i, text in enumerate(given)]
    return [
        f"double {name}_of[{len(given)}], {name}[{rows}];", *kept,
        f"@NAME@_product{matrix}({name}_of, {name});",
    ]  # fmt: skip
