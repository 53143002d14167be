"""A model sailed on orders: members of it, each with its own state, coefficients and disturbance.

    ν̇ = f(x, u, ω; θ) + d,   η̇ = R(ψ) ν + c,   x₀ … in the water, which moves with c over ground

ν by explicit Euler at the step that the model was identified with, as its rollouts are (Eq. 9);
place and heading by the trapezoidal rule of it, since no fit makes up for what Euler's loses. The
current is even and steady, and so is the wind over ground where none was recorded. d is each
member's draw of what the model is known to get wrong (`discrepancy`), zero for the model as it
stands.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import polars as pl

from shiplog.nomenclature.channels import STATE
from shiplog.nomenclature.frames import in_body_axes, in_earth_axes
from shiplog.simulation.controls import Controls, Gear
from shiplog.simulation.helm import Helm
from shiplog.simulation.members import Rates

# Times the largest speed and yaw rate of the training data beyond which a model has diverged: no
# ship goes there, and a network that does never comes back.
DIVERGED = 5.0

# (states [N, 6], actuators [N, A], s until the next call) -> [N, 3] m/s² and rad/s²
Disturbance = Callable[[np.ndarray, np.ndarray, float], np.ndarray]


@dataclass(frozen=True)
class Water:
    """wind      [2] where it comes from over ground, along x₀ and y₀, m/s
    current   [2] where it sets, along x₀ and y₀, m/s
    recorded  [K, 2] the wind in each row from the start on; after them it is `wind`"""

    wind: tuple[float, float] = (0.0, 0.0)
    current: tuple[float, float] = (0.0, 0.0)
    recorded: np.ndarray | None = field(default=None, compare=False)

    def blowing(self, rows: int) -> np.ndarray:
        """[rows, 2] over ground."""
        found = np.tile(np.array(self.wind, dtype=float), (rows, 1))
        if self.recorded is not None:
            known = self.recorded[:rows]
            found[: len(known)] = known
        return found


STILL = Water()


def from_direction(speed: float, degrees: float) -> tuple[float, float]:
    """(north, east) of a speed and a direction, clockwise from x₀."""
    angle = math.radians(degrees)
    return speed * math.cos(angle), speed * math.sin(angle)


@dataclass(frozen=True)
class Sailed:
    """N members over K instants.

    time       [K]        s
    state      [N, K, 6]  channels.STATE over ground; not a number after a member's end
    actuator   [N, K, A]  as recorded, SI
    ended      [N]        s at which the manoeuvre was complete; infinite where it was not
    diverged   [N]        s at which the member left what any ship does; infinite where it did not
    water                 wind and current
    names                 of the actuators
    """

    time: np.ndarray
    state: np.ndarray
    actuator: np.ndarray
    ended: np.ndarray
    diverged: np.ndarray
    water: Water
    names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.state)

    @cached_property
    def frame(self) -> pl.DataFrame:
        """member, time, the state's channels and the actuators, SI, a row an instant at which the
        member still sailed."""
        count, instants, _ = self.state.shape
        there = np.isfinite(self.state).all(-1).ravel()
        columns = {
            "member": np.repeat(np.arange(count, dtype=np.int32), instants),
            "time": np.tile(self.time, count),
        }
        columns |= {c.name: self.state[..., i].ravel() for i, c in enumerate(STATE)}
        columns |= {n: self.actuator[..., i].ravel() for i, n in enumerate(self.names)}
        return pl.DataFrame(columns).filter(pl.Series(there))

    def band(self, low: float = 0.05, high: float = 0.95) -> tuple[np.ndarray, np.ndarray]:
        """[K, 6] between which the middle of the members is while nine in ten of them sail."""
        there = np.isfinite(self.state).all(-1).mean(0) >= high - low
        edges = np.full((2, *self.state.shape[1:]), np.nan)
        if there.any():
            edges[:, there] = np.nanquantile(self.state[:, there], (low, high), axis=0)
        return edges[0], edges[1]


@dataclass(frozen=True)
class Steps:
    """seconds   of the whole, at most
    row       between two instants that are kept, s
    substeps  of Euler in each
    limits    [3] |u|, |v|, |r| at which a member has diverged
    heun      two evaluations a step, ½ (f₀ + f₁) (Heun 1900): of coefficients that were not fitted
              to Euler's steps, and do not make up for them
    """

    seconds: float
    row: float
    substeps: int
    limits: np.ndarray
    heun: bool = False


def sail(
    rates: Rates,
    helm: Helm,
    controls: Controls,
    start: np.ndarray,
    steps: Steps,
    *,
    water: Water = STILL,
    gear: Gear | None = None,
    disturbance: Disturbance | None = None,
    measured: bool = False,
) -> Sailed:
    """Members from states [N, 6] over ground.

    measured   orders are positions that were recorded: no rate of the actuators limits them
    """
    count, rows = len(start), max(1, math.ceil(steps.seconds / steps.row))
    step = steps.row / steps.substeps
    current = np.array(water.current)
    winds = water.blowing(rows) + current  # over the water
    state = np.array(start, dtype=float)
    state[:, [1, 3]] -= _across(state[:, 4], current)
    ends, diverged = np.full(count, math.inf), np.full(count, math.inf)
    order = helm.order(0.0, step, state)
    acts = order.actuators if measured else np.tile(controls.approach, (count, 1))
    states = [_over_ground(state, current)]
    actuators = [acts]
    with np.errstate(all="ignore"):  # a member may diverge
        for k in range(rows * steps.substeps):
            time = k * step
            blowing = np.tile(winds[k // steps.substeps], (count, 1))
            if measured:
                acts = acting = order.actuators
            else:
                acts, acting = controls.moved(acts, order.actuators, order.after, step)
            if gear is not None:
                acting = gear.acting(acting, step)
            rate = rates(state, acting, blowing)
            if steps.heun:
                ahead = _advanced(state, rate, step, current)
                rate = 0.5 * (rate + rates(ahead, acting, blowing))
            if disturbance is not None:
                rate = rate + disturbance(state, acting, step)
            state = _advanced(state, rate, step, current)
            lost = ~(np.abs(state[:, [1, 3, 5]]) < steps.limits).all(1)
            diverged[lost & np.isinf(diverged)] = time + step
            order = helm.order(time + step, step, state)
            ends[order.done & np.isinf(ends) & ~lost] = time + step
            if (k + 1) % steps.substeps == 0:
                states.append(_over_ground(state, current))
                actuators.append(acts)
                if (np.isfinite(ends) | np.isfinite(diverged)).all():
                    break
    found = np.stack(states, axis=1)
    instants = np.arange(found.shape[1]) * steps.row
    last = np.minimum(ends + steps.row, diverged - step)
    found[instants[None, :] > last[:, None] + 1e-9] = np.nan
    return Sailed(
        instants, found, np.stack(actuators, axis=1), ends, diverged, water, controls.names
    )


def _advanced(state: np.ndarray, rate: np.ndarray, step: float, current: np.ndarray) -> np.ndarray:
    """The states [N, 6] through the water a step on: ν by Euler, η by the trapezoidal rule."""
    found = np.empty_like(state)
    found[:, [1, 3, 5]] = state[:, [1, 3, 5]] + step * rate
    found[:, 4] = state[:, 4] + 0.5 * step * (state[:, 5] + found[:, 5])
    before, after = (
        in_earth_axes(one[:, 1], one[:, 3], np.cos(one[:, 4]), np.sin(one[:, 4]))
        for one in (state, found)
    )
    for i, place in enumerate((0, 2)):
        found[:, place] = state[:, place] + step * (0.5 * (before[i] + after[i]) + current[i])
    return found


def _across(heading: np.ndarray, current: np.ndarray) -> np.ndarray:
    """The current [N, 2] ahead and to starboard of each heading."""
    return np.stack(in_body_axes(current[0], current[1], np.cos(heading), np.sin(heading)), -1)


def _over_ground(state: np.ndarray, current: np.ndarray) -> np.ndarray:
    if not current.any():
        return state
    found = state.copy()
    found[:, [1, 3]] += _across(state[:, 4], current)
    return found
