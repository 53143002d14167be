"""The slope of a cause that grows, equation (20)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from shiplog.diagnosis.onset.recorded_time import elapsed
from shiplog.diagnosis.onset.stretch_information import Stretches
from shiplog.diagnosis.trial.trial import Trial
from shiplog.models.causes import Cause, si
from shiplog.nomenclature.numbers import NINETY_SPREADS

DAY_S = 86_400.0


@dataclass(frozen=True)
class Slope:
    """Change of a cause's first parameter in a day, with its 90 % interval.

    parameter  its name; `unit` that of the slope
    days       from the first row of the trial to the last
    """

    parameter: str
    value: float
    low: float
    high: float
    unit: str
    days: float


def slope(
    trial: Trial, information: Stretches, cause: Cause, starts: Mapping[str, datetime],
    freedom: float = math.inf,
) -> Slope | None:  # fmt: skip
    """x₁ of (20) of the cause's first number, over the time from the first row to the last; of a
    cause that is itself a slope over the trial, its number. None of a trial without length.

        (x₀, x₁) | r ~ N((M + I)⁻¹ y, (M + I)⁻¹)
    """
    days = days_of(trial, trial.rows[information.first], starts)
    last = days_of(trial, np.array([len(trial.record) - 1]), starts)[0]
    span = float(last - days_of(trial, np.array([0]), starts)[0])
    if span <= 0.0:
        return None
    tau = np.zeros(len(days)) if cause.over_trial else (days - days.mean()) / span
    x, V = with_slope(information.y, information.M, tau)
    q = len(information.unit)
    at = 0 if cause.over_trial else q
    by = information.unit[0] / span / si(cause.parameters[0].unit)
    value, spread = float(x[at] * by), NINETY_SPREADS * math.sqrt(V[at, at]) * abs(by)
    parameter = cause.parameters[0]
    unit = "1/day" if parameter.unit == "1" else f"{parameter.unit}/day"
    return Slope(parameter.name, value, value - spread, value + spread, unit, span)


def with_slope(y: np.ndarray, M: np.ndarray, tau: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean [2 q] and covariance [2 q, 2 q] of (x₀, x₁), in units."""
    q = y.shape[1]
    both = np.stack((np.ones(len(tau)), tau))
    pull = np.einsum("tb,bq->tq", both, y).ravel()
    information = np.einsum("tb,bqcp,sc->tqsp", both, M, both, optimize=True)
    covariance = np.linalg.inv(information.reshape(2 * q, 2 * q) + np.eye(2 * q))
    return covariance @ pull, covariance


def days_of(trial: Trial, rows: np.ndarray, starts: Mapping[str, datetime]) -> np.ndarray:
    """Days from the first voyage's start to rows of the record; of recorded time where a voyage has
    no date in `starts`."""
    record = trial.record
    if not set(record.names) <= set(starts):
        return elapsed(record, rows) / DAY_S
    began = np.array([starts[name].timestamp() for name in record.names])
    return (began[record.voyage[rows]] - began.min() + record.time[rows]) / DAY_S
