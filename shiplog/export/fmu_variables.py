"""Variables of an FMU, in the order of their value references in templates/component.h."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from shiplog.export.ship import Ship
from shiplog.nomenclature.channels import STATE

# Of a unit: exponents of FMI's base units, and a factor.
UNITS: dict[str, dict[str, str]] = {
    "m": {"m": "1"}, "m/s": {"m": "1", "s": "-1"}, "m/s2": {"m": "1", "s": "-2"},
    "rad": {"rad": "1"}, "rad/s": {"rad": "1", "s": "-1"}, "rad/s2": {"rad": "1", "s": "-2"},
    "rev/s": {"rad": "1", "s": "-1", "factor": repr(2.0 * math.pi)},
    "rev/s2": {"rad": "1", "s": "-2", "factor": repr(2.0 * math.pi)},
    "1/s": {"s": "-1"}, "s": {"s": "1"}, "s/m": {"s": "1", "m": "-1"},
    "N": {"kg": "1", "m": "1", "s": "-2"}, "kg": {"kg": "1"},
}  # fmt: skip
RATES = {"rad": "rad/s", "rev/s": "rev/s2", "1": "1/s"}
ACCELERATIONS = (("surge", "m/s2"), ("sway", "m/s2"), ("yaw", "rad/s2"))
NO_LIMITS = (-math.inf, math.inf)
INPUT, OUTPUT, FIXED, TUNABLE, TIME = "input", "output", "fixed", "tunable", "independent"


@dataclass(frozen=True)
class Variable:
    """role   INPUT, OUTPUT, a parameter that is FIXED or TUNABLE, or TIME
    start  None of what is calculated
    low, high  of an input, where the ship has them"""

    name: str
    about: str
    role: str
    unit: str = ""
    start: float | bool | None = None
    low: float = -math.inf
    high: float = math.inf


def of_ship(ship: Ship) -> list[Variable]:
    """Real variables, then two booleans: whether orders are recorded positions, and whether the
    model has diverged."""
    state = [(c.name, c.unit, value) for c, value in zip(STATE, _start(ship), strict=True)]
    found = [
        Variable(f"order.{i.name}", f"ordered position of the {i.kind} {i.name}", INPUT, i.unit,
                 i.approach, *((i.low, i.high) if i.low <= i.approach <= i.high else NO_LIMITS))
        for i in ship.inputs
    ]  # fmt: skip
    for what, about in (("wind", "true wind, where it comes from"), ("current", "where it sets")):
        found += [
            Variable(f"{what}.{axis}", f"{about}, along {axis}", INPUT, "m/s", 0.0)
            for axis in ("x0", "y0")
        ]
    found += [Variable(name, f"{name} over ground", OUTPUT, unit) for name, unit, _ in state]
    found += [
        Variable(f"actuator.{i.name}", f"position of {i.name}, which moves at its rate", OUTPUT,
                 i.unit)
        for i in ship.inputs
    ]  # fmt: skip
    found += [
        Variable(f"acceleration.{name}", f"{name} acceleration of the last inner step", OUTPUT, u)
        for name, u in ACCELERATIONS
    ]
    found += [
        Variable(f"start.{name}", f"{name} over ground at the start", FIXED, unit, value)
        for name, unit, value in state
    ]
    found += [
        Variable(f"start.{i.name}", f"position of {i.name} at the start", FIXED, i.unit, i.approach)
        for i in ship.inputs
    ]
    found += [
        Variable(f"rate.{i.name}", f"fastest change of {i.name} a second", TUNABLE, RATES[i.unit],
                 i.rate)
        for i in ship.inputs
    ]  # fmt: skip
    found += [
        Variable(_structured(n.name), n.meaning, TUNABLE, n.unit if n.unit in UNITS else "",
                 n.value)
        for n in ship.numbers
    ]  # fmt: skip
    return [
        *found,
        Variable(
            "recorded", "orders are recorded positions: no rate limits them", FIXED, start=False
        ),
        Variable("diverged", "it is where no ship goes", OUTPUT),
    ]


def _structured(name: str) -> str:
    """Of a coefficient, by FMI's structured convention: words that begin with a letter. A cause's
    numbers are `current.0`, and its label may have a colon."""
    found = re.sub(r"[^\w.]", "_", name, flags=re.ASCII)
    return "coefficient." + re.sub(r"\.(?=\d)", "_", found)


def _start(ship: Ship) -> list[float]:
    return [ship.speed if c.name == "surge" else 0.0 for c in STATE]
