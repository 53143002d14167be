"""Since when each named cause of a verdict acts, or how fast it grows."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from shiplog.diagnosis.onset import change_points, drift, stretch_information
from shiplog.diagnosis.onset.change_points import Places
from shiplog.diagnosis.onset.drift import Slope
from shiplog.diagnosis.onset.recorded_time import elapsed, offsets
from shiplog.diagnosis.onset.stretch_information import Stretches
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict.result import Decision, Named
from shiplog.models.causes import ParameterEstimate

log = logging.getLogger(__name__)

FEWEST = 4  # stretches, with fewer there is nothing to choose between


@dataclass(frozen=True)
class Moment:
    """When a change happened, with its 90 % interval: s of recorded time from the trial's start,
    its voyages in the order of their start. `voyage` and `start_s` are the same instant, s into
    that voyage."""

    elapsed_s: float
    low: float
    high: float
    voyage: str
    start_s: float


@dataclass(frozen=True)
class Onset:
    """Since when a cause acts.

    begin       its beginning; 0 where it is present from the start
    from_start  probability of that
    off         its end, where it is more probable than not that it ends within the trial
    ends        probability of that
    while_on    its parameters while it acts, where it does not act all the time
    acting      [B] probability that it acts in each stretch, of recorded time between `edges`
                [B + 1], s, and of the voyage `voyages` [B]
    """

    begin: Moment
    from_start: float
    off: Moment | None
    ends: float
    while_on: Mapping[str, ParameterEstimate]
    acting: np.ndarray
    edges: np.ndarray
    voyages: tuple[str, ...]


@dataclass(frozen=True)
class Course:
    """What is said of one named cause: an onset, or a slope; neither of a trial that is short."""

    onset: Onset | None = None
    slope: Slope | None = None


def of_decision(
    trial: Trial, decision: Decision, starts: Mapping[str, datetime]
) -> dict[str, Course]:
    """Label → course of each named cause; a cause whose products cannot be made has none.

    starts   when each voyage began, as its recorder knows it
    """
    found: dict[str, Course] = {}
    for one in decision.named:
        if one.cause.label not in decision.fit.included:
            continue
        try:
            found[one.cause.label] = _course(trial, decision, one, starts)
        except np.linalg.LinAlgError as error:
            log.info("no onset of %s: %s", one.cause.label, error)
    return found


def _course(
    trial: Trial, decision: Decision, one: Named, starts: Mapping[str, datetime]
) -> Course:  # fmt: skip
    information = stretch_information.of_cause(trial, decision.fit, one.cause.label)
    if one.cause.drifts:
        return Course(slope=drift.slope(trial, information, one.cause, starts, one.freedom))
    if len(information.first) < FEWEST:
        return Course()
    return Course(onset=onset(trial, information, one))


def onset(trial: Trial, information: Stretches, one: Named) -> Onset:
    """Of a cause's information in the stretches of a trial."""
    places = places_of(trial, information.first)
    found = change_points.changes(information.y, information.M, places)
    ends = 1.0 - found.to_end
    i, j = found.likeliest
    while_on: Mapping[str, ParameterEstimate] = {}
    if (i, j) != (0, len(information.first)):
        x, V = change_points.numbers(information.y, information.M, i, j)
        unit = information.unit
        while_on = one.cause.estimates(x * unit, V * np.outer(unit, unit), one.freedom)
    return Onset(
        _moment(trial, *found.begin()), found.from_start,
        _moment(trial, *found.stop()) if ends >= 0.5 else None, ends, while_on, found.acting,
        np.append(elapsed(trial.record, trial.rows[information.first]), places.end),
        tuple(trial.record.names[v] for v in trial.record.voyage[trial.rows[information.first]]),
    )  # fmt: skip


def places_of(trial: Trial, first: np.ndarray) -> Places:
    """Where a change between stretches may be. One that is found before a stretch happened between
    the middle of the last segment before it and the middle of its first one, or in the port between
    two voyages."""
    record, length = trial.record, trial.grid.seconds
    begin = elapsed(record, trial.rows)
    middle, edge = begin + 0.5 * length, change_points.EDGE * length
    voyage = record.voyage[trial.rows[first]]
    seam = np.where(np.diff(voyage) != 0, offsets(record)[voyage[1:]], np.nan)
    end = float(offsets(record)[-1])
    low, high = middle[first[1:] - 1] - edge, middle[first[1:]] + edge
    return Places(np.maximum(low, 0.0), np.minimum(high, end), seam, length, end)


def _moment(trial: Trial, value: float, low: float, high: float) -> Moment:
    begins = offsets(trial.record)
    v = int(np.clip(np.searchsorted(begins, value, side="right") - 1, 0, len(begins) - 2))
    return Moment(value, low, high, trial.record.names[v], value - float(begins[v]))
