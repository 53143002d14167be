"""The numbers of a run by name: its base's coefficients, then the parameters of its causes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np
import polars as pl

from shiplog.nomenclature.numbers import NINETY_SPREADS, figure
from shiplog.simulation.extended_simulator import Extension


@dataclass(frozen=True, slots=True)
class Coefficient:
    """One number of a model, in its unit. `float(it)` is the value.

    low, high       90 % interval; None where no fit says how sure the number is
    standard_error  likewise
    start           what it was before the fit; None of a cause's
    free            whether the data were asked for it
    cause           label of the cause that it belongs to; empty for one of the base
    """

    value: float
    unit: str
    low: float | None = None
    high: float | None = None
    standard_error: float | None = None
    start: float | None = None
    free: bool = True
    symbol: str = ""
    meaning: str = ""
    cause: str = ""

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        """Value, 90 % interval, unit, and what it is."""
        value = figure(self.value, 3)
        if self.low is not None and self.high is not None:
            value += f" ({figure(self.low, 3)} to {figure(self.high, 3)})"
        unit = "" if self.unit == "1" else f" {self.unit}"
        return ", ".join(filter(None, (f"{value}{unit}", self.symbol, self.meaning)))


def of(identified: pl.DataFrame | None, extension: Extension | None) -> dict[str, Coefficient]:
    """`part.key` → coefficient, then `cause.parameter` → parameter, in the order of the model's
    parameter vector.

    identified   of the base, as `RunFolder.identified`; None of a network, which has none

    A coefficient that was fitted again together with the causes has its new value, and no interval:
    the run keeps none. A cause's interval is that of its covariance, normally distributed.
    """
    found = {} if identified is None else _of_base(identified)
    if extension is None:
        return found
    if identified is not None:
        again = np.asarray(extension.coefficients)[: len(found)].tolist()
        found = {
            name: one if one.value == value else _moved(one, value)
            for (name, one), value in zip(found.items(), again, strict=True)
        }
    for cause in extension.causes:
        numbers, covariance = extension.numbers[cause.label], extension.covariance[cause.label]
        for name, one in cause.estimates(numbers, covariance).items():
            found[f"{cause.label}.{name}"] = Coefficient(
                one.value, one.unit, one.low, one.high, cause=cause.label, meaning=cause.story
            )
    return found


def _of_base(identified: pl.DataFrame) -> dict[str, Coefficient]:
    return {
        row["name"]: _coefficient(row, row["standard_error"] if row["free"] else None)
        for row in identified.to_dicts()
    }


def _coefficient(row: Mapping, error: float | None) -> Coefficient:
    value = row["value"]
    wide = None if error is None else NINETY_SPREADS * error
    return Coefficient(
        value, row["unit"], None if wide is None else value - wide,
        None if wide is None else value + wide, error, row["start"], row["free"], row["symbol"],
        row["meaning"],
    )  # fmt: skip


def _moved(one: Coefficient, value: float) -> Coefficient:
    """As it was fitted again, together with causes."""
    return Coefficient(
        value, one.unit, None, None, None, one.value, True, one.symbol, one.meaning
    )  # fmt: skip


def frame(coefficients: Mapping[str, Coefficient]) -> pl.DataFrame:
    """One row a coefficient: name, then its fields."""
    numbers = ("value", "low", "high", "standard_error", "start")
    names = list(Coefficient.__dataclass_fields__)
    schema = {"name": pl.String} | {
        n: pl.Float64 if n in numbers else pl.Boolean if n == "free" else pl.String for n in names
    }
    rows = [{"name": name, **asdict(one)} for name, one in coefficients.items()]
    return pl.DataFrame(rows, schema)
