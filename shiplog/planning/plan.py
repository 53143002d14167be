"""A run's plan: the manoeuvre that says most, and how sure its coefficients are after it, after the
standard zigzag of the same time, and now."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from shiplog.exceptions import ShiplogError
from shiplog.nomenclature.numbers import NINETY_SPREADS
from shiplog.planning import noise
from shiplog.planning.information import Instrument
from shiplog.planning.limits import Limits
from shiplog.planning.search import Found, Search
from shiplog.simulation.sailing import STILL, Sailed, Water
from shiplog.simulation.schedules import Zigzag
from shiplog.simulation.sensitivities import losses
from shiplog.simulation.window_series import WindowSeries, series
from shiplog.training.physics.output_error import residual_variance
from shiplog.training.runs.load_model import ForeignRun, PhysicalRun, Run
from shiplog.training.runs.sailing_run import Outside, Sailor
from shiplog.training.runs.trust_file import SHEET
from shiplog.voyages.windows import windows

ZIGZAGS = (10.0, 20.0)  # deg of rudder and heading: the standard ones, of which the better counts
MANY = 1000  # reversals: a zigzag is sailed for as long as the planned manoeuvre takes
# Share of its error now, down to which a manoeuvre has to take a coefficient to show it: a fifth
# narrower is more than the interval itself is known to.
SHOWN = 0.8


class CannotPlan(ShiplogError):
    """A run whose coefficients no manoeuvre can be planned for."""


@dataclass(frozen=True, slots=True)
class Expected:
    """A coefficient's standard error, in its unit: now, after the zigzag, after the plan."""

    name: str
    symbol: str
    meaning: str
    unit: str
    value: float
    now: float
    zigzag: float
    planned: float

    @property
    def shown(self) -> bool:
        """Whether either manoeuvre shows it."""
        return min(self.zigzag, self.planned) < SHOWN * self.now

    def as_json(self) -> dict:
        return {
            "name": self.name, "symbol": self.symbol, "meaning": self.meaning, "unit": self.unit,
            "value": self.value, "shown": self.shown,
            "half_width": {"now": NINETY_SPREADS * self.now, "zigzag": NINETY_SPREADS * self.zigzag,
                           "planned": NINETY_SPREADS * self.planned},
        }  # fmt: skip


@dataclass(frozen=True)
class Plan:
    """limits    within which it was searched
    found      the manoeuvre
    zigzag     the standard one that says more, and what was sailed of it
    expected   of every coefficient that was asked
    outside    where the model leaves its training data in the planned manoeuvre
    """

    limits: Limits
    found: Found
    zigzag: tuple[str, Sailed]
    expected: tuple[Expected, ...]
    outside: Outside
    water: Water

    @property
    def narrower(self) -> float:
        """Median, over the coefficients that either manoeuvre shows, of the interval after the
        zigzag over that after the plan; 1 where none is shown."""
        ratios = [one.zigzag / one.planned for one in self.expected if one.shown]
        return float(np.median(ratios)) if ratios else 1.0


def refuse_unplannable(run: Run) -> PhysicalRun:
    """Raises CannotPlan, saying what is possible with the run instead."""
    if isinstance(run, ForeignRun):
        raise CannotPlan(
            f"{run.name} is a run of {run.config.foreign.name}, which has no coefficients of "
            "shiplog's: no manoeuvre makes an interval of them narrower.",
            hint="--causes-only, with --simulator where it is a file, tells which causes the "
            "standard manoeuvres tell apart; or identify the ship from the same voyages with "
            "`shiplog train --model mmg`, and plan that run.",
        )
    if not isinstance(run, PhysicalRun):
        raise CannotPlan(
            f"{run.name} is a network: it has no coefficients of which a manoeuvre could make an "
            "interval narrower.",
            hint="identify the ship from the same voyages with `shiplog train --model mmg`, and "
            "plan that run; --causes-only tells which causes the standard manoeuvres tell apart.",
        )
    if run.extension is not None:
        raise CannotPlan(
            f"{run.name} was extended by a diagnosis: its coefficients were fitted again together "
            "with causes, and no covariance was kept.",
            hint="plan the run that it extends.",
        )
    if (run.path / SHEET).is_file():
        raise CannotPlan(
            f"{run.name} is from a trial sheet: no voyage has shown how much its model errs.",
            hint="record a first voyage, such as a zigzag; identify a run from it, with "
            f"--parameters {run.seed(0) / 'parameters.toml'}, and plan that.",
        )
    return run


def instrument_of(run: PhysicalRun, sailor: Sailor) -> Instrument:
    """What turns a manoeuvre into information about the run's coefficients. Those of a run that
    was fitted to nothing are as uncertain as is plausible, and all of them are asked."""
    seed = run.config.seeds[0]
    known, simulator = run.identified(seed), run.simulator(seed)
    spread = known["spread"].to_numpy()
    asked = spread > 0.0 if run.given else known["free"].to_numpy() & (spread > 0.0)
    free = np.flatnonzero(asked)
    if not len(free):
        raise CannotPlan(
            f"{run.name} has no coefficient that was free.", hint="train it without --free."
        )
    s = spread[free]
    covariance = simulator.covariance[np.ix_(free, free)] / np.outer(s, s)
    data = training_windows(run)
    variance = residual_variance(losses(simulator.model, simulator.theta, data), data)
    plain = Instrument(
        simulator.model, simulator.theta, free, s, np.eye(len(free)), variance, run.config.window,
        sailor.row, noise.of_run(run), (sailor.speed, sailor.length),
    )  # fmt: skip
    if run.given or not covariance.any():
        return plain
    calibrated = plain.calibrated(data, np.sqrt(np.diag(covariance)))
    return replace(calibrated, known=np.linalg.inv(covariance))


def training_windows(run: Run) -> WindowSeries:
    names = (run.profile.actuator_names, run.profile.wind_names)
    return series(windows.cut(run.training(), run.windows(), run.config.window, *names))


def plan(
    run: PhysicalRun,
    sailor: Sailor,
    limits: Limits,
    *,
    water: Water = STILL,
    seed: int = 0,
    instrument: Instrument | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Plan:
    """Raises NoRoom."""
    instrument = instrument or instrument_of(run, sailor)
    search = Search(sailor, instrument, limits, water, seed)
    found = search.run(progress)
    zigzag = _zigzag(search)
    known = run.identified(run.config.seeds[0])[instrument.free.tolist()].to_dicts()
    now = np.sqrt(np.diag(np.linalg.inv(instrument.known)))
    errors = [
        np.sqrt(np.diag(instrument.covariance(search.data(sailed))))
        for sailed in (zigzag[1], found.sailed)
    ]
    expected = tuple(
        Expected(
            row["name"], row["symbol"], row["meaning"], row["unit"], row["value"],
            *(float(s * e[i]) for e in (now, *errors)),
        )
        for i, (row, s) in enumerate(zip(known, instrument.spread, strict=True))
    )  # fmt: skip
    return Plan(limits, found, zigzag, expected, sailor.outside(found.sailed), water)


def _zigzag(search: Search) -> tuple[str, Sailed]:
    """The standard zigzag that is worth more, with no more rudder than the limits have, for the
    same time. Whether its water suffices is not asked: it is what the plan is compared with."""
    sailor, limits = search.sailor, search.limits
    steers = np.array([a.kind in ("rudder", "azimuth") for a in sailor.profile.actuators])
    hardest = float(np.abs(limits.high[steers]).min(initial=math.inf))
    best: tuple[float, str, Sailed] | None = None
    for degrees in ZIGZAGS:
        of = Zigzag(min(math.radians(degrees), hardest), math.radians(degrees), MANY)
        sailed, _ = sailor.sail(of, members=1, seconds=limits.seconds, water=search.water)
        worth = search.worth(sailed, 0)
        if best is None or worth > best[0]:
            best = (worth, of.name, sailed)
    assert best is not None
    return best[1], best[2]
