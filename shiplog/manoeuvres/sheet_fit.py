"""Coefficients from the numbers of a trial sheet alone.

The model sails every manoeuvre of the sheet, the same quantities are measured of it by the same
rules as of a log, and the coefficients are moved until both agree. A sheet has a dozen numbers and
a model fifty coefficients: what is plausible before holds the rest where it was, and says how sure
that is. With m(θ) the quantities of the model, y and σ those of the sheet, and x = (θ - θ₀)/s,

    x̂ = argmin Σ_q ((m_q(θ) - y_q)/σ_q)² + |x|²,   low ≤ θ ≤ high
    cov θ̂ = s (H + I)⁻¹ s,   H = Jᵀ J,   J = s ∂(m/σ)/∂θ

by Gauss-Newton in a trust region; ∂m/∂θ are differences of members that sail together. In addition
the approach is steady: where revolutions are stated, the speed at which the model keeps them is the
sheet's, to STEADY of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import polars as pl
from scipy.optimize import least_squares

from shiplog.exceptions import listed
from shiplog.manoeuvres.simulated import measure
from shiplog.manoeuvres.trial_sheet import SheetError, SheetManoeuvre, TrialSheet
from shiplog.models.coefficients import Parameters
from shiplog.nomenclature.channels import STATE, WIND
from shiplog.ship_profile.profile import Profile
from shiplog.simulation.controls import Controls, controls
from shiplog.simulation.helm import helm
from shiplog.simulation.members import of_physics
from shiplog.simulation.sailing import Sailed, Steps, Water, sail
from shiplog.simulation.window_series import apparent_wind
from shiplog.training.physics.output_error import Identified
from shiplog.training.physics.trust import AT_LIMIT

STEADY = 0.02  # of the approach speed: a trial's approach is steady to about this (ITTC)
PROBE = 0.02  # of a coefficient's plausible spread, by which it is moved for its derivative
ROW = 1.0  # s between the rows that a run keeps
FINE = 0.025  # of L/V: the longest Euler step
MOST_SUBSTEPS = 50
TOLERANCE = 1e-3  # relative fall of the sum of squares, and step, at which it has converged
MOST_EVALUATIONS = 30
MISSED = 1e3  # residual of a number that the model does not even reach
FASTEST = 5.0  # times the approach speed: a member that is faster has diverged


@dataclass(frozen=True)
class Reached:
    """A number of the sheet beside the model's, before and after the fit."""

    manoeuvre: str
    name: str
    value: float
    spread: float
    start: float
    fitted: float

    @property
    def off(self) -> float:
        """(m - y)/σ after the fit."""
        return (self.fitted - self.value) / self.spread


@dataclass(frozen=True)
class SheetFit:
    """information   H in the coefficients' own units [P, P]: of the sheet alone
    rows          of the fitted model's manoeuvres, as 1 Hz rows of a run
    """

    found: Identified
    reached: tuple[Reached, ...]
    information: np.ndarray
    rows: pl.DataFrame


def askable(start: Parameters) -> np.ndarray:
    """Which coefficients a sheet is asked for [P]: not those of terms that are left out until a log
    shows them, as the low-speed damping is. A dozen numbers cannot tell them from the others."""
    return np.array(
        [e.neutral is None or v != e.neutral
         for e, v in zip(start.entries, start.values, strict=True)]
    )  # fmt: skip


class SheetProblem:
    """The sheet's residuals as a function of x [F], the free coefficients in their spreads."""

    def __init__(
        self, model: Any, start: Parameters, free: np.ndarray, profile: Profile, sheet: TrialSheet
    ) -> None:
        self.model, self.start, self.profile, self.sheet = model, start, profile, sheet
        self.free = free & (start.spread > 0.0)
        self.scale = start.spread[self.free]
        self.sticks = [_sticks(model, start.values, profile, one) for one in sheet.manoeuvres]
        self.evaluations = 0

    def whole(self, x: np.ndarray) -> np.ndarray:
        """θ [N, P] of x [N, F]."""
        theta = np.tile(self.start.values, (len(x), 1))
        theta[:, self.free] += x * self.scale
        return theta

    def sailed(self, i: int, theta: np.ndarray) -> Sailed:
        """Manoeuvre i by members of coefficients θ [N, P]."""
        return _sail(self.model, theta, self.profile, self.sheet.manoeuvres[i], self.sticks[i])

    def quantities(self, theta: np.ndarray) -> np.ndarray:
        """[N, Q] in the order of the sheet; not a number where the model does not reach one."""
        columns = []
        for i, one in enumerate(self.sheet.manoeuvres):
            sailed = self.sailed(i, theta)
            each = [measure(sailed, k, one.manoeuvre, self.profile) for k in range(len(theta))]
            columns += [[m.get(s.name, math.nan) for m in each] for s in one.stated]
        return np.array(columns).T

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """(m - y)/σ and the approach's [N, Q + A], of x [N, F]."""
        theta = self.whole(x)
        stated = [s for one in self.sheet.manoeuvres for s in one.stated]
        y, sigma = np.array([s.value for s in stated]), np.array([s.spread for s in stated])
        off = (self.quantities(theta) - y) / sigma
        return np.concatenate((off, self._approach(theta)), axis=1)

    def _approach(self, theta: np.ndarray) -> np.ndarray:
        """u̇(U)/(|∂u̇/∂U| STEADY U) [N, A]: how far off the speed is that stated revolutions keep."""
        columns = []
        for one, sticks in zip(self.sheet.manoeuvres, self.sticks, strict=True):
            if one.revolutions is None:
                continue
            speeds = one.speed * np.array([1.0, 1.0 + STEADY, 1.0 - STEADY])
            surge = []
            for speed in speeds:
                state = np.zeros((len(theta), 6))
                state[:, 1] = speed
                acts = np.tile(sticks.approach, (len(theta), 1))
                wind = np.tile(np.array(one.wind), (len(theta), 1))
                surge.append(of_physics(self.model, theta)(state, acts, wind)[:, 0])
            slope = np.abs(surge[1] - surge[2]) / 2.0  # over STEADY U
            columns.append(surge[0] / np.maximum(slope, 1e-12))
        return np.array(columns).T.reshape(len(theta), len(columns))

    def evaluate(self, x: np.ndarray, low: np.ndarray, high: np.ndarray) -> Any:
        """Residuals [Q + A] and their derivatives [Q + A, F] at x [F]."""
        self.evaluations += 1
        sides = np.where(x + PROBE > high, -PROBE, PROBE)
        found = self.residuals(np.vstack((x, x + np.diag(sides))))
        slopes = (found[1:] - found[0]) / sides[:, None]
        slopes = np.where(np.isfinite(slopes), slopes, 0.0)
        return np.where(np.isfinite(found[0]), found[0], MISSED), slopes.T


def fit(
    model: Any, start: Parameters, free: np.ndarray, profile: Profile, sheet: TrialSheet
) -> SheetFit:
    """Raises SheetError where the starting values do not sail a manoeuvre to its numbers, and where
    the fit takes coefficients to the limits of their physical ranges."""
    problem = SheetProblem(model, start, free, profile, sheet)
    count = len(problem.scale)
    first = problem.quantities(start.values[None])[0]
    _refuse_unreached(sheet, first)
    low = (start.low[problem.free] - start.values[problem.free]) / problem.scale
    high = (start.high[problem.free] - start.values[problem.free]) / problem.scale
    kept: dict[bytes, Any] = {}

    def at(x: np.ndarray) -> Any:
        key = x.tobytes()
        if key not in kept:
            kept.clear()
            kept[key] = problem.evaluate(x, low, high)
        return kept[key]

    done = least_squares(
        lambda x: np.concatenate((at(x)[0], x)),
        np.clip(np.zeros(count), low + 1e-9, high - 1e-9),
        lambda x: np.vstack((at(x)[1], np.eye(count))),  # type: ignore[arg-type]
        bounds=(low, high), method="trf", xtol=TOLERANCE, ftol=TOLERANCE, gtol=1e-10,
        max_nfev=MOST_EVALUATIONS,
    )  # fmt: skip
    theta = problem.whole(done.x[None])[0]
    _refuse_limits(sheet, start, problem.free, theta)
    residual, J = at(done.x)
    H = J.T @ J
    covariance, information = np.zeros((2, len(theta), len(theta)))
    inside = np.ix_(problem.free, problem.free)
    units = np.outer(problem.scale, problem.scale)
    covariance[inside] = np.linalg.inv(H + np.eye(count)) * units
    information[inside] = H / units
    before = problem.residuals(np.zeros((1, count)))[0]
    found = Identified(
        theta, covariance, problem.free, 1.0,
        (float(before @ before), float(residual @ residual)), problem.evaluations,
        done.status > 0, "converged" if done.status > 0 else "the evaluations ran out",
    )  # fmt: skip
    last = problem.quantities(theta[None])[0]
    stated = [(one.name, s) for one in sheet.manoeuvres for s in one.stated]
    reached = tuple(
        Reached(name, s.name, s.value, s.spread, float(a), float(b))
        for (name, s), a, b in zip(stated, first, last, strict=True)
    )
    return SheetFit(found, reached, information, _rows(problem, theta))


def _sticks(model: Any, theta: np.ndarray, profile: Profile, one: SheetManoeuvre) -> Controls:
    """The actuators of a manoeuvre: propellers at the stated revolutions, or at those at which the
    starting values keep the speed."""
    most = {a.name: _most(a.kind, a.si_limits, one.revolutions) for a in profile.actuators}
    # two rows, of which controls reads how far the actuators go: full astern and full ahead
    reach: dict[str, list[float]] = {
        a.name: [max((a.si_limits or (-math.inf, 0.0))[0], -most[a.name]), most[a.name]]
        for a in profile.actuators
    }
    begin = pl.datetime_range(
        pl.datetime(2000, 1, 1), pl.datetime(2000, 1, 1, 0, 0, 1), "1s", time_unit="ns", eager=True
    )
    rows = pl.DataFrame({"voyage": ["", ""], "segment": [0, 1], "time": begin} | reach)
    if one.revolutions is None and not any(v > 0.0 for v in most.values()):
        raise SheetError(
            f"Neither the sheet nor the profile says how fast the propellers of "
            f"{profile.ship.name} turn.",
            hint="add revolutions (rev/s) to [conditions].",
        )
    found = controls(profile, rows, of_physics(model, theta), one.speed, one.rudder_rate)
    if one.revolutions is None:
        return found
    turning = [a.kind == "propeller" for a in profile.actuators]
    return replace(found, approach=np.where(turning, one.revolutions, found.approach))


def _most(kind: str, limits: tuple[float, float] | None, revolutions: float | None) -> float:
    if kind == "propeller" and revolutions is not None:
        return revolutions
    return 0.0 if limits is None or kind not in ("propeller", "thruster") else limits[1]


def _substeps(length_time: float) -> int:
    return min(max(1, math.ceil(ROW / (FINE * length_time))), MOST_SUBSTEPS)


def _sail(
    model: Any, theta: np.ndarray, profile: Profile, one: SheetManoeuvre, sticks: Controls
) -> Sailed:
    length = profile.ship.length_m
    length_time = length / one.speed
    start = np.zeros((len(theta), 6))
    start[:, 1] = one.speed
    limits = FASTEST * one.speed * np.array([1.0, 1.0, 1.0 / length])
    steps = Steps(one.manoeuvre.duration(length_time), ROW, model.substeps, limits)
    return sail(
        of_physics(model, theta), helm(one.manoeuvre, sticks, start, length_time), sticks, start,
        steps, water=Water(wind=one.wind),
    )  # fmt: skip


def substeps(profile: Profile, sheet: TrialSheet) -> int:
    """Euler steps within each second, as the quickest manoeuvre of the sheet asks for."""
    return max(_substeps(profile.ship.length_m / one.speed) for one in sheet.manoeuvres)


def _rows(problem: SheetProblem, theta: np.ndarray) -> pl.DataFrame:
    """The fitted model's own manoeuvres as the 1 Hz rows of a run: a voyage each."""
    tables = []
    wanted = problem.profile
    for i in range(len(problem.sheet.manoeuvres)):
        sailed = problem.sailed(i, theta[None])
        keep = np.isfinite(sailed.state[0]).all(-1)
        state, actuator = sailed.state[0][keep], sailed.actuator[0][keep]
        columns: dict[str, Any] = {c.name: state[:, j] for j, c in enumerate(STATE)}
        columns["heading"] = np.angle(np.exp(1j * state[:, 4]))
        columns |= {name: actuator[:, j] for j, name in enumerate(sailed.names)}
        if wanted.has_wind:
            felt = apparent_wind(state, np.tile(np.array(sailed.water.wind), (len(state), 1)))
            columns |= {c.name: felt[:, j] for j, c in enumerate(WIND)}
        elapsed = np.arange(len(state)) * ROW
        tables.append(
            pl.DataFrame(columns).with_columns(
                voyage=pl.lit(f"trial_sheet_{i + 1}"),
                time=(pl.lit(0, pl.Int64) + pl.Series((elapsed * 1e9).astype(np.int64))).cast(
                    pl.Datetime("ns", "UTC")
                ),
                samples=pl.lit(1, pl.UInt32),
                elapsed=pl.Series(elapsed),
                segment=pl.lit(0, pl.UInt32),
            )
        )
    order = ["voyage", "time", *(c.name for c in STATE), *wanted.actuator_names,
             *wanted.wind_names, "samples", "elapsed", "segment"]  # fmt: skip
    return pl.concat(tables).select(order)


def _refuse_unreached(sheet: TrialSheet, first: np.ndarray) -> None:
    names = [f"{s.name} of {one.name}" for one in sheet.manoeuvres for s in one.stated]
    missed = [name for name, value in zip(names, first, strict=True) if not np.isfinite(value)]
    if missed:
        raise SheetError(
            f"The model of the starting values does not come to {listed(missed, most=4)}.",
            hint="check speed, revolutions, length and mass; give better --parameters, or leave "
            "that number out.",
        )


def _refuse_limits(
    sheet: TrialSheet, start: Parameters, free: np.ndarray, theta: np.ndarray
) -> None:
    room = AT_LIMIT * start.spread
    low, high = theta < start.low + room, theta > start.high - room
    stuck = np.flatnonzero(free & (low | high))
    if len(stuck):
        each = listed([f"{start.names[i]} at {theta[i]:.3g}" for i in stuck], most=6)
        raise SheetError(
            f"The numbers of {sheet.path} take coefficients to the limits of their physical "
            f"ranges: {each}. A ship of these particulars does not sail like that.",
            hint="check units, signs, speed and revolutions of the sheet, and length, mass and "
            "rudder area of the profile; give a number its real spread, or hold the coefficient "
            "with --free.",
        )


def described(reached: Sequence[Reached]) -> list[Mapping[str, object]]:
    """For JSON: each number of the sheet beside the model's."""
    return [
        {"manoeuvre": r.manoeuvre, "name": r.name, "value": r.value, "spread": r.spread,
         "start": r.start, "fitted": r.fitted, "off": r.off}
        for r in reached
    ]  # fmt: skip
