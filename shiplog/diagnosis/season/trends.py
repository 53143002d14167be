"""Each cause of a hypothesis voyage by voyage: sizes, slope, events, the date of a limit."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from shiplog.diagnosis.onset.drift import DAY_S, Slope
from shiplog.diagnosis.onset.stretch_information import Stretches
from shiplog.diagnosis.season import limit, own_numbers, pooling, speed_loss, voyage_sizes
from shiplog.diagnosis.season.pooling import Pooled, Voyages
from shiplog.diagnosis.trial.fitted import Fit
from shiplog.diagnosis.trial.trial import Trial
from shiplog.diagnosis.verdict.result import Named
from shiplog.exceptions import ShiplogError, UsageError, listed
from shiplog.models.causes import Cause, ParameterEstimate, si

log = logging.getLogger(__name__)

TAIL = (0.05, 0.95)
MOST_VOYAGES = 60  # of a verdict's view of its season
WEARS = "ship"  # kind of causes that wear along a season: hull, screws, rudders
BULK = (0.005, 0.995)  # of the draws: the calm speed of those beyond is that of the end
CALM_GRID = 13  # sizes at which the model's calm speed is worked out; straight in between


@dataclass(frozen=True)
class OfVoyage:
    """A cause in one voyage: name of a parameter → its size.

    date       middle of the voyage; None where its recorder knows no date
    pooled     by partial pooling; `alone` without: each voyage has a size of its own
    speed      change of the calm speed at equal revolutions that the pooled size makes, %; None of
               causes that change none
    """

    voyage: str
    date: datetime | None
    pooled: Mapping[str, ParameterEstimate]
    alone: Mapping[str, ParameterEstimate]
    speed: ParameterEstimate | None


@dataclass(frozen=True)
class Event:
    """What a docking changed: levels before and after it, at its date, and their difference."""

    date: datetime
    before: Mapping[str, ParameterEstimate]
    after: Mapping[str, ParameterEstimate]
    change: Mapping[str, ParameterEstimate]


@dataclass(frozen=True)
class Limit:
    """When the trend passes a limit of the user's, with its 90 % interval.

    low, value, high   None where it does not within ten years
    passed             probability that it has at the last voyage already
    ever               probability that it does within ten years
    """

    parameter: str
    limit: float
    unit: str
    low: datetime | None
    value: datetime | None
    high: datetime | None
    passed: float
    ever: float


@dataclass(frozen=True)
class Trend:
    """One cause over a season.

    spread   τ: standard deviation from voyage to voyage, share of the cause's realistic size; None
             of one voyage
    slope    of causes that wear, where there are three dated voyages or more
    """

    label: str
    cause: Cause
    voyages: tuple[OfVoyage, ...]
    spread: ParameterEstimate | None
    slope: Slope | None
    events: tuple[Event, ...]
    limit: Limit | None


def of_fit(
    trial: Trial, fit: Fit, labels: Sequence[str], starts: Mapping[str, datetime],
    events: Sequence[datetime] = (), limits: Mapping[str, float] | None = None,
) -> tuple[Trend, ...]:  # fmt: skip
    """Of the causes `labels` of a hypothesis that holds them all, each with sizes of its own in
    each voyage. A voyage that is far from what all have in common is fitted by itself.

    starts   when each voyage began; without those whose recorder knows no date
    events   dates at which every cause may have changed, such as dockings
    limits   label → limit of the first parameter, in its unit

    Raises ShiplogError where the model diverges.
    """
    if not labels:
        return ()
    try:
        there = own_numbers.common(trial, fit, labels)
        information = own_numbers.information_of(trial, fit, labels, there)
        if there.far(information).any():
            there = own_numbers.fitted_alone(trial, fit, labels, there, information)
            information = own_numbers.information_of(trial, fit, labels, there)
            _warn_of_far(trial, there.far(information))
        seasons = _together(trial, information, labels, starts, events)
        return tuple(of.trend((limits or {}).get(of.cause.label)) for of in seasons)
    except np.linalg.LinAlgError as error:
        raise ShiplogError(
            "The causes could not be followed: the model diverges on these voyages.",
            hint="see what `shiplog diagnose` says of them.",
        ) from error


def _warn_of_far(trial: Trial, far: np.ndarray) -> None:
    """Say which voyages [V] are far from where they were linearised, after all."""
    if far.any():
        voyages = np.unique(trial.record.voyage[trial.rows])[far]
        log.warning(
            "%s: far from where the likelihood is linear. The sizes of these voyages may be wrong "
            "by more than their intervals: follow voyages that are alike by themselves "
            "(--voyages).",
            listed([trial.record.names[v] for v in voyages]),
        )


def of_verdict(
    trial: Trial, fit: Fit, named: Sequence[Named], starts: Mapping[str, datetime]
) -> dict[str, tuple[OfVoyage, ...]]:
    """Label → each named cause of a verdict in each voyage; none of one voyage alone, of very many,
    or of voyages that are far from each other: `shiplog trend` has those."""
    labels = [one.cause.label for one in named if one.cause.label in fit.included]
    if not labels or not 2 <= len(trial.record.names) <= MOST_VOYAGES:
        return {}
    with contextlib.suppress(np.linalg.LinAlgError):  # of a model that hardly is this ship's
        there = own_numbers.common(trial, fit, labels)
        information = own_numbers.information_of(trial, fit, labels, there)
        if not there.far(information).any():
            seasons = _together(trial, information, labels, starts)
            return {of.cause.label: of.voyages() for of in seasons}
    return {}


def _together(
    trial: Trial, information: Stretches, labels: Sequence[str], starts: Mapping[str, datetime],
    events: Sequence[datetime] = (),
) -> tuple[_Season, ...]:  # fmt: skip
    """The causes of some information, their numbers one after another."""
    by = {c.label: c for c in trial.reference.model.causes}
    causes = [by[label] for label in labels]
    each = tuple(cause.count for cause in causes)
    of, names = voyage_sizes.by_voyage(trial, information, starts, events, each)
    dated = set(trial.record.names) <= set(starts)
    wears = [cause.kind == WEARS and dated for cause in causes]
    first = min(starts[n] for n in trial.record.names) if dated else None
    return tuple(
        _Season(trial, cause, information.unit[at], of, names, pooled, first,
                tuple(sorted(events)) if dated else ())
        for cause, at, pooled in zip(
            causes, of.places, pooling.pool(of, wears, trial.reference.freedom), strict=True
        )
    )  # fmt: skip


@dataclass(frozen=True)
class _Season:
    """One cause with its draws; `first` is the date of day 0, None without dates."""

    trial: Trial
    cause: Cause
    unit: np.ndarray
    of_voyages: Voyages
    names: tuple[str, ...]
    pooled: Pooled
    first: datetime | None
    events: tuple[datetime, ...]

    def voyages(self) -> tuple[OfVoyage, ...]:
        """The cause in each of them."""
        speed = self._speed_of()
        return tuple(
            OfVoyage(
                name, self._date(float(self.of_voyages.days[v])),
                self._estimates(self.pooled.sizes[:, v]), self._estimates(self.pooled.alone[:, v]),
                None if speed is None else _summary(speed(self.pooled.sizes[:, v, 0]), "%"),
            )
            for v, name in enumerate(self.names)
        )  # fmt: skip

    def trend(self, limit_at: float | None) -> Trend:
        voyages = self.voyages()
        spread = _summary(self.pooled.spread, "1") if len(voyages) > 1 else None
        return Trend(
            self.cause.label, self.cause, voyages, spread, self._slope(), self._events(),
            self._limit(limit_at),
        )  # fmt: skip

    def _date(self, days: float | None) -> datetime | None:
        if self.first is None or days is None:
            return None
        return self.first + timedelta(seconds=days * DAY_S)

    def _estimates(self, draws: np.ndarray) -> dict[str, ParameterEstimate]:
        """The contract's parameters of draws [D, q], in units."""
        numbers = draws * self.unit
        middle = self.cause.displayed(numbers.mean(0))
        found = {}
        for name, (values, unit) in self.cause.displayed(numbers).items():
            spread = values - middle[name][0]
            if unit == "deg":
                spread = (spread + 180.0) % 360.0 - 180.0
            low, high = np.quantile(spread, TAIL)
            value = float(middle[name][0])
            found[name] = ParameterEstimate(
                value, value + min(float(low), 0.0), value + max(float(high), 0.0), unit
            )
        return found

    def _slope(self) -> Slope | None:
        """β in a day, of the first parameter."""
        if not self.pooled.slope.any():
            return None
        of = self.cause.parameters[0]
        days = self.of_voyages.span
        per_day = self.pooled.slope[:, 0] * self.unit[0] / si(of.unit) / days
        unit = "1/day" if of.unit == "1" else f"{of.unit}/day"
        one = _summary(per_day, unit)
        return Slope(of.name, one.value, one.low, one.high, one.unit, days)

    def _events(self) -> tuple[Event, ...]:
        """Between each two levels, at the last event between them."""
        found = []
        days, level = self.of_voyages.days, self.of_voyages.level
        for after in range(1, int(level.max()) + 1):
            begin, end = days[level == after - 1].max(), days[level == after].min()
            at = [one for one in self.events if begin <= self._days(one) <= end]
            if not at:
                continue
            t = (self._days(at[-1]) - self.of_voyages.middle) / max(self.of_voyages.span, 1e-12)
            one, other = (
                self.pooled.levels[:, g] + t * self.pooled.slope for g in (after - 1, after)
            )
            found.append(Event(
                at[-1], self._estimates(one), self._estimates(other), self._change(other - one)
            ))  # fmt: skip
        return tuple(found)

    def _change(self, difference: np.ndarray) -> dict[str, ParameterEstimate]:
        """Of the numbers themselves: a difference of directions or factors is one of numbers."""
        return {
            p.name: _summary(difference[:, i] * self.unit[i] / si(p.unit), p.unit)
            for i, p in enumerate(self.cause.parameters)
        }

    def _days(self, date: datetime) -> float:
        assert self.first is not None
        return (date.timestamp() - self.first.timestamp()) / DAY_S

    def _limit(self, at: float | None) -> Limit | None:
        if at is None:
            return None
        parameter = refuse_limit(self.cause)
        if not self.pooled.slope.any():
            raise UsageError(
                f"A limit of {self.cause.label} needs a trend: three voyages or more with dates, "
                f"and there are {len(self.names)}.",
                hint="give more voyages, or leave --limit out.",
            )
        absent, one = (float(self.cause.displayed(np.array([n]))[parameter][0]) for n in (0.0, 1.0))
        x = (at - absent) / (one - absent) / self.unit[0]
        found = limit.passing(self.of_voyages, self.pooled, float(x))
        unit = self.cause.displayed(np.zeros(1))[parameter][1]
        return Limit(
            parameter, at, unit, self._date(found.low), self._date(found.value),
            self._date(found.high), found.passed, found.ever,
        )  # fmt: skip

    def _speed_of(self):
        """Size → change of the calm speed ahead at equal revolutions [%]; None where it has none.

        100 (V(x)/V(0) - 1), V the model's steady speed at the trial's mean revolutions
        """
        if self.cause.kind != WEARS or self.cause.count != 1 or self.cause.over_trial:
            return None
        sizes = self.pooled.sizes[..., 0]
        low, high = np.quantile(sizes, BULK)
        grid = np.linspace(min(float(low), -0.01), max(float(high), 0.01), CALM_GRID)
        grid = np.unique(np.append(grid, 0.0))
        calm = calm_speeds(self.trial, self.cause, grid * self.unit[0])
        still = calm[grid == 0.0][0]
        if not np.isfinite(calm).all() or abs(np.ptp(calm)) < 1e-6 * still:
            return None
        change = 100.0 * (calm / still - 1.0)
        return lambda x: np.interp(x, grid, change)


def refuse_limit(cause: Cause) -> str:
    """Its parameter that can have a limit. Raises UsageError for a cause without one."""
    shown = list(cause.displayed(np.zeros(cause.count)))
    if cause.count == 1 and len(shown) == 1 and cause.kind == WEARS:
        return shown[0]
    raise UsageError(
        f"{cause.label} can have no limit: it has {listed(shown)}, and does not wear along a "
        "season.",
        hint="give --limit of a cause of the ship with one number, such as thrust_loss=0.9.",
    )


def nominal_theta(trial: Trial) -> np.ndarray:
    """θ [C] as the nominal campaign has it, without any change by a cause."""
    ref = trial.reference
    theta = np.concatenate((ref.theta, np.zeros(ref.columns.linearised - ref.columns.base)))
    return theta + (ref.mean * ref.columns.unit)[: len(theta)]


def calm_speeds(trial: Trial, cause: Cause, numbers: np.ndarray) -> np.ndarray:
    """V(x) [n] of numbers x [n], SI: steady speed ahead without wind, every actuator that turns at
    its mean over the trial while it turns ahead, every angle at zero."""
    record = trial.record
    mean = np.zeros(record.actuator.shape[1])
    for i, a in enumerate(record.profile.actuators):
        ahead = record.actuator[:, i][record.actuator[:, i] > 0.0]
        if a.kind in ("propeller", "thruster") and len(ahead):
            mean[i] = float(ahead.mean())
    speed = float(np.hypot(record.state[:, 1], record.state[:, 3]).max())
    driven = np.array([[*mean, 0.5, 0.0, 0.0]])
    found = []
    column = trial.reference.columns.indices[cause.label][0]
    for x in numbers:
        theta = nominal_theta(trial)
        theta[column] += x
        found.append(
            speed_loss.expected_speed(trial, theta, np.array([speed]), np.zeros(1), driven)[0]
        )
    return np.array(found)


def _summary(draws: np.ndarray, unit: str) -> ParameterEstimate:
    low, high = np.quantile(draws, TAIL)
    return ParameterEstimate(float(draws.mean()), float(low), float(high), unit)
