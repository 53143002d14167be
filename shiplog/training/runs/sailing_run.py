"""A run's model sailed on orders: as it stands, and as an ensemble of what it may be as well.

The first member is the model as it stands (of a network its first seed). The others are its seeds,
or draws of its coefficients, each with a draw of the discrepancy that held-out voyages have shown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
import polars as pl

from shiplog.exceptions import ModelError, listed
from shiplog.nomenclature.channels import STATE, VELOCITY, WIND
from shiplog.nomenclature.frames import in_body_axes
from shiplog.ship_profile.profile import Profile
from shiplog.simulation import (
    coverage,
    discrepancy,
    foreign_model,
    prediction_interval,
    rollout,
)
from shiplog.simulation.controls import (
    STEERING_CAUSES,
    Controls,
    Gear,
    controls,
    untouched,
)
from shiplog.simulation.discrepancy import Discrepancy
from shiplog.simulation.helm import Helm, OfTables, helm
from shiplog.simulation.members import Rates, of_networks, of_physics
from shiplog.simulation.prediction_interval import Band
from shiplog.simulation.sailing import DIVERGED, STILL, Sailed, Steps, Water, sail
from shiplog.simulation.schedules import Manoeuvre, Schedule
from shiplog.simulation.window_series import apparent_wind, true_wind
from shiplog.training.runs.outside import Outside
from shiplog.training.runs.sailing_inputs import STATES, refuse_unknown, starts
from shiplog.training.runs.sailing_inputs import tables as tables_of
from shiplog.voyages.windows import windows
from shiplog.voyages.windows.split import plan

MEMBERS = 200  # of an ensemble: the ends of a 90 % interval are known to a tenth of its width
APPROACH = 0.9  # quantile of the training data's speed, where none is given
LEAST_SPEED = 1e-3  # m/s, of a ship that never went ahead
FARTHEST = 10.0  # times that the discrepancy is widened outside the training data, at most


class Sails(Protocol):
    """What is asked of a run: `load_model.Run`, which imports this module."""

    @property
    def path(self) -> Any: ...
    @property
    def config(self) -> Any: ...
    @property
    def profile(self) -> Profile: ...
    @property
    def extension(self) -> Any: ...
    @property
    def name(self) -> str: ...
    @property
    def given(self) -> bool: ...
    @property
    def judges_itself(self) -> bool: ...
    def training(self) -> pl.DataFrame: ...
    def validation(self) -> pl.DataFrame: ...
    def models(self) -> dict[int, Any]: ...
    def band(self) -> Any: ...
    def simulator(self, seed: int) -> Any: ...
    def extended(self, seed: int) -> Any: ...


class Sailor:
    """What is worked out once of a run, and serves all its manoeuvres."""

    def __init__(self, run: Sails) -> None:
        self.run, self.profile = run, run.profile
        self.training = run.training()
        self.length = run.profile.ship.length_m
        if self.training.is_empty():
            raise ModelError(
                f"{run.path} has no training rows, which show how far its actuators go.",
                hint="train the run again.",
            )
        time = self.training["time"].to_physical().to_numpy() * 1e-9
        gaps = np.diff(time)
        self.row = float(np.median(gaps[gaps > 0.0])) if (gaps > 0.0).any() else 1.0
        self.speed = float(self.training["surge"].quantile(APPROACH) or 0.0)
        seen = self.training.select(c.name for c in VELOCITY).to_numpy()
        most = np.abs(seen).max(0)
        # a small sway or yaw rate in the training data is no limit of the ship
        scale = np.array([most[0], most[0], most[0] / self.length])
        self.limits = DIVERGED * np.maximum(most, scale)
        self._seeds = tuple(run.config.seeds)
        self._physics = [_physics(run, seed) for seed in self._seeds]
        self.substeps = self._physics[0].substeps if self._physics[0] else 1
        # published or estimated coefficients are those of the equations, not of Euler's steps
        # a simulator's are, too
        first = self._physics[0]
        self.heun = run.given or (
            first is not None and foreign_model.simulator_of(first.model) is not None
        )
        self._controls: dict[tuple[float, float], Controls] = {}
        self.fitted_band = False  # whether its discrepancy is of voyages that it was fitted to
        self._roots: list[np.ndarray] | None = None
        self._discrepancy: Discrepancy | None = None
        self._coverage: coverage.Coverage | None = None

    # --- parts ---

    def rates(self, count: int, rng: np.random.Generator | None = None) -> Rates:
        """ν̇ of so many members: the model as it stands, or, with `rng`, all but the first drawn."""
        first = self._physics[0]
        if first is None:
            networks = self._networks()
            member = np.arange(count) % len(networks) if rng is not None else np.zeros(count, int)
            return of_networks(networks, member, self.profile.has_wind)
        if rng is None:
            return of_physics(first.model, first.theta, first.more)
        return of_physics(first.model, self._drawn(count, rng), first.more)

    def _drawn(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """θ [N, P] of seeds in turn, from N(θ, Σ) but for the first."""
        seeds = [one for one in self._physics if one is not None]
        found = np.empty((count, len(seeds[0].theta)))
        if self._roots is None:
            self._roots = [_root(one.covariance) for one in seeds]
        for i, (one, root) in enumerate(zip(seeds, self._roots, strict=True)):
            rows = np.arange(i, count, len(seeds))
            found[rows] = one.theta + rng.standard_normal((len(rows), len(one.theta))) @ root.T
        found[:1] = seeds[0].theta
        return found

    def _networks(self) -> list[Any]:
        if not hasattr(self, "_opened"):
            self._opened = [self.run.simulator(seed) for seed in self._seeds]
        return self._opened

    @property
    def spreads(self) -> bool:
        """Whether its members differ: seeds, uncertain coefficients, or a known discrepancy."""
        own = self._physics[0]
        known = len(self._seeds) > 1 or (own is not None and bool(np.any(own.covariance)))
        return known or bool(self.discrepancy.size.any())

    @property
    def causes(self) -> tuple[Any, ...]:
        held = self.run.extension
        return () if held is None else held.causes

    @property
    def ignored(self) -> tuple[str, ...]:
        """Causes of an extended run that are about what is recorded, not about how it sails."""
        return tuple(c.label for c in self.causes if c.reads and c.name not in STEERING_CAUSES)

    def gear(self) -> Gear | None:
        held = self.run.extension
        if held is None:
            return None
        return Gear(held.causes, held.numbers, self.profile)

    def controls(self, speed: float, rudder_rate: float = 0.0) -> Controls:
        key = (speed, rudder_rate)
        if key not in self._controls:
            self._controls[key] = controls(
                self.profile, self.training, self.rates(1), speed, rudder_rate
            )
        return self._controls[key]

    @property
    def discrepancy(self) -> Discrepancy:
        if self._discrepancy is None:
            band = self.run.band() or self._own_band()
            slip = _slip(self.profile)
            none = Discrepancy(np.zeros(3), 1.0, 1.0, slip)
            if band is None:
                self._discrepancy = none
            else:
                state = self.training.select(STATES).to_numpy()
                actuator = self.training.select(self.profile.actuator_names).to_numpy()
                wind = np.zeros((len(state), 2))
                if self.profile.has_wind:
                    wind = true_wind(state, self.training.select(c.name for c in WIND).to_numpy())
                self._discrepancy = discrepancy.calibrated(
                    self.rates(4 * min(discrepancy.STARTS, len(state))), band, state, actuator,
                    wind, self.row, self.substeps, self.length, slip,
                )  # fmt: skip
        return self._discrepancy

    def _own_band(self) -> Band | None:
        """Of a run that has none, as one that a diagnosis extended: from its validation voyages,
        else from those of its training."""
        size, names = self.run.config.window, (self.profile.actuator_names, self.profile.wind_names)
        for rows in (self.run.validation(), self.training):
            if rows.is_empty() or (planned := plan(rows, "ref", size)).is_empty():
                continue
            cut = windows.cut(rows, planned, size, *names)
            first = next(iter(self.run.models().values()))
            with np.errstate(all="ignore"):
                error = rollout.simulate(first, cut) - cut.state
            groups = cut.plan["voyage"].n_unique()
            self.fitted_band = rows is self.training and not self.run.given
            return prediction_interval.calibrate(error, np.zeros_like(error), groups)
        return None

    def outside(self, sailed: Sailed, member: int = 0) -> Outside:
        """Where a member left the training data."""
        keep = np.isfinite(sailed.state[member]).all(-1)
        state, actuator = sailed.state[member][keep], sailed.actuator[member][keep]
        columns = {c.name: state[:, i] for i, c in enumerate(STATE)}
        columns |= {n: actuator[:, i] for i, n in enumerate(sailed.names)}
        if self.profile.has_wind:
            blowing = apparent_wind(state, np.tile(sailed.water.wind, (len(state), 1)))
            columns |= {c.name: blowing[:, i] for i, c in enumerate(WIND)}
        return self.outside_rows(pl.DataFrame(columns))

    def outside_rows(self, rows: pl.DataFrame) -> Outside:
        """The same of rows with the ship's columns."""
        if self._coverage is None:
            self._coverage = coverage.learn(
                self.training, self.profile.actuator_names, self.profile.has_wind
            )
        if rows.is_empty():
            return Outside(1.0, FARTHEST, {})
        distance = self._coverage.distance(rows)
        marked = self._coverage.mark_outside(rows)
        return Outside(
            share=float((distance > 1.0).mean()),
            distance=float(np.maximum(distance, 1.0).mean()),
            channels={name: float(mask.mean()) for name, mask in marked.items()},
        )

    def notes(self, manoeuvre: Manoeuvre, speed: float | None = None) -> tuple[str, ...]:
        """What is to be known of a simulation, in sentences."""
        own = self.speed if speed is None else speed
        found = []
        if speed is None:
            found.append(
                f"The approach is at {own:.3g} m/s, the nominal speed of its training data."
            )
        sticks = self.controls(own)
        if not sticks.balanced and not isinstance(manoeuvre, Schedule):
            found.append(
                f"No revolutions of its training data keep {own:.3g} m/s: it begins with the "
                "nearest, and its speed changes."
            )
        if manoeuvre.kind == "stop" and not sticks.astern.any():
            found.append("Nothing turns astern in its training data and limits: the ship coasts.")
        if self.ignored:
            found.append(
                f"It was extended by {listed(self.ignored)}, which is about what is recorded: "
                "it does not change how the ship sails."
            )
        if self.fitted_band:
            found.append(
                "Its discrepancy is that of the voyages that it was fitted to: on others it is "
                "larger, and so is the interval."
            )
        if not self.spreads:
            found.append(
                "It has neither an uncertainty of its numbers nor held-out voyages: no interval."
            )
        return tuple(found)

    # --- sailing ---

    def sail(
        self,
        manoeuvre: Manoeuvre,
        *,
        speed: float | None = None,
        water: Water = STILL,
        members: int = MEMBERS,
        seed: int = 0,
        rudder_rate: float = 0.0,
        seconds: float | None = None,
        approach: np.ndarray | None = None,
        motion: tuple[float, float, float] = (0.0, 0.0, 0.0),
        positions: tuple[np.ndarray, np.ndarray] | None = None,
    ) -> tuple[Sailed, Outside]:
        """A manoeuvre from a straight approach, and where the model as it stands left the training
        data in it. The first of the members is the model as it stands. Raises ModelError.

        approach   [A] of the actuators, SI, instead of those at which the model keeps the speed
        motion     heading, sway and yaw rate at the order, SI
        positions  times [K] and actuators [K, A] that were recorded in it
        """
        own = self.speed if speed is None else speed
        if not own > 0.0:
            raise ModelError(
                f"A manoeuvre begins ahead, and {own:g} m/s is not.",
                hint="give --speed the approach speed in m/s.",
            )
        # a speed to the hundredth: revolutions that a record has replace what it would take
        at = own if approach is None else round(own, 2) or own
        sticks = self.controls(at, rudder_rate)
        if approach is not None:
            sticks = replace(sticks, approach=np.where(sticks.steering != 0.0, 0.0, approach))
        if not isinstance(manoeuvre, Schedule) and not sticks.steers and manoeuvre.kind != "stop":
            raise ModelError(
                f"{self.profile.ship.name} has neither a rudder nor an azimuth astern, and "
                f"a {manoeuvre.kind.replace('_', '-')} is sailed with one.",
                hint="give --schedule a file with the orders of its actuators.",
            )
        refuse_unknown(manoeuvre, self.profile.actuator_names)
        start = np.zeros((1, 6))
        start[:, 1] = own
        start[:, [4, 3, 5]] = motion
        start = _over_ground(start, water)
        steps = self._steps(manoeuvre.duration(self.length / own) if seconds is None else seconds)

        def sailed(first: np.ndarray, rates: Rates, more: Any) -> Sailed:
            given = (sticks, first, self.length / own)
            made = helm(manoeuvre, *given)
            if positions is not None:
                made = OfTables(positions[0], positions[1][None], *given)
            return sail(
                rates, made, sticks, first, steps, water=water, gear=self.gear(), disturbance=more,
                measured=positions is not None,
            )  # fmt: skip

        alone = sailed(start, self.rates(1), None)
        left = self.outside(alone)
        if members < 2 or not self.spreads:
            return alone, left
        rng = np.random.default_rng(seed)
        wider = min(left.distance, FARTHEST) if left.anywhere else 1.0
        many = np.repeat(start, members, axis=0)
        process = self.discrepancy.process(members, rng, wider)
        return sailed(many, self.rates(members, rng), process), left

    def _steps(self, seconds: float) -> Steps:
        return Steps(seconds, self.row, self.substeps, self.limits, heun=self.heun)

    def frame(
        self,
        inputs: pl.DataFrame | Manoeuvre,
        start: pl.DataFrame | Mapping[str, float] | None,
        *,
        water: Water = STILL,
        spread: bool = False,
        seed: int = 0,
        seconds: float | None = None,
    ) -> Sailed:
        """As many members as `start` has rows or `inputs` has members; see `Run.simulate`."""
        first = starts(start, self.speed)
        speed = float(np.median(first[:, 1]))
        own = speed if speed > 0.0 else max(self.speed, LEAST_SPEED)
        recorded = isinstance(inputs, pl.DataFrame)
        made: Helm
        if isinstance(inputs, pl.DataFrame):
            time, values = tables_of(inputs, self.profile.actuator_names)
            if len(values) != len(first) and 1 not in (len(values), len(first)):
                raise ModelError(
                    f"`inputs` has {len(values)} members and `start` {len(first)} rows.",
                    hint="give one of them, or as many of both.",
                )
            first = np.repeat(first, len(values), axis=0) if len(first) == 1 else first
            length = float(time[-1])
            sticks = untouched(self.profile.actuator_names)
            made = OfTables(time, values, sticks, first, self.length / own)
        else:
            refuse_unknown(inputs, self.profile.actuator_names)
            sticks = self.controls(own)
            length = inputs.duration(self.length / own)
            made = helm(inputs, sticks, first, self.length / own)
        rng = np.random.default_rng(seed) if spread else None
        process = None if rng is None else self.discrepancy.process(len(first), rng)
        steps = self._steps(length if seconds is None else seconds)
        return sail(
            self.rates(len(first), rng), made, sticks, first, steps, water=water,
            gear=self.gear(), disturbance=process, measured=recorded,
        )  # fmt: skip


def _root(covariance: np.ndarray) -> np.ndarray:
    """R of R Rᵀ = Σ, also of a singular one."""
    values, vectors = np.linalg.eigh(covariance)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def _slip(profile: Profile) -> np.ndarray:
    """[A] for `Discrepancy.slip`."""
    found = np.array([
        a.diameter_m or 0.0 if a.kind == "propeller" else 0.0 for a in profile.actuators
    ])  # fmt: skip
    return found / max(int((found > 0.0).sum()), 1)


@dataclass(frozen=True)
class _Physics:
    model: Any
    theta: np.ndarray
    covariance: np.ndarray
    more: int

    @property
    def substeps(self) -> int:
        return self.model.substeps


def _physics(run: Sails, seed: int) -> _Physics | None:
    """Equations of a seed; None of a plain network, which is asked as it is."""
    if run.extension is not None:
        found = run.extended(seed)
        return _Physics(found.model, found.theta, found.covariance, 1)
    if run.judges_itself:
        own = run.simulator(seed)
        if not hasattr(own, "model"):
            raise ModelError(
                f"{run.name} is of states that were logged, and cannot be sailed on other orders.",
                hint="give the simulator itself: shiplog train --model FILE.py or FILE.fmu.",
            )
        return _Physics(own.model, own.theta, own.covariance, 0)
    return None


def _over_ground(start: np.ndarray, water: Water) -> np.ndarray:
    """An approach through the water as it is over ground."""
    found = start.copy()
    c, s = np.cos(start[:, 4]), np.sin(start[:, 4])
    found[:, [1, 3]] += np.stack(in_body_axes(*water.current, c, s), -1)
    return found


def of_run(run: Sails) -> Sailor:
    """Raises RunError or ModelError where the run cannot be sailed."""
    return Sailor(run)


def without_water(sailor: Sailor) -> Sailor:
    """The same without a current that an extension has: a standard manoeuvre is in still water."""
    held = sailor.run.extension
    if held is None or "current" not in {c.name for c in held.causes}:
        return sailor
    numbers = {
        c.label: np.zeros_like(held.numbers[c.label]) if c.name == "current"
        else held.numbers[c.label]
        for c in held.causes
    }  # fmt: skip
    covariance = {
        c.label: np.zeros_like(held.covariance[c.label]) if c.name == "current"
        else held.covariance[c.label]
        for c in held.causes
    }  # fmt: skip
    calm = replace(held, numbers=numbers, covariance=covariance)
    return Sailor(replace(sailor.run, extension=calm))  # type: ignore[type-var]  # a dataclass
