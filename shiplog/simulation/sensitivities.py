"""Rollouts of physical models, compiled, and their exact derivatives.

A rollout runs step by step; its derivatives need no second one. Along the path that it took,
ν̇ is differentiated at all samples at once (reverse mode: three outputs, any number of
parameters), and what a parameter does to the path is then a linear recursion.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from shiplog.machine.jit_cache import traced
from shiplog.nomenclature.channels import VELOCITY_IN_STATE, VELOCITY_WEIGHTS
from shiplog.nomenclature.frames import in_body_axes, in_earth_axes
from shiplog.simulation.scoring import trapezoid, window_loss
from shiplog.voyages.windows.windows import Windows

VELOCITY_COLUMNS = np.array(VELOCITY_IN_STATE)
WINDOWS_AT_A_TIME = 128  # their sensitivities to 60 parameters are 45 MB


class Physical(Protocol):
    """Equations of motion that can be compiled, their numbers in a vector of their own. Those that
    a run is made of also have `fixed`, arrays to keep with the numbers, and `forces` by part.

    A JAX pytree: `jax.tree_util.register_static` for what is hashable and is compiled anew for
    every ship.
    """

    @property
    def names(self) -> tuple[str, ...]: ...

    @property
    def substeps(self) -> int:
        """Euler steps within each measured one."""
        ...

    @property
    def smooth(self) -> float:
        """s between which its derivatives change little."""
        ...

    def acceleration(
        self, theta: Array, state: Array, actuator: Array, true_wind: Array
    ) -> Array: ...


class WindowSeries(NamedTuple):
    """What drives N rollouts, and what was measured. The wind is the true one.

    A simulation of a ship that moves otherwise than the measured one feels another apparent
    wind, so the measured apparent wind and motion are turned into the wind over ground first.

    measured   [N, I, 6]  channels.STATE; its first row is where a rollout begins
    actuator   [N, I, A]  held over each step
    wind       [N, I, 2]  where it comes from, along x₀ and y₀ [m/s]; zero without a sensor
    dt         [N, I - 1]
    weight     [N]        of each window in sums; 0 leaves it out
    """

    measured: np.ndarray
    actuator: np.ndarray
    wind: np.ndarray
    dt: np.ndarray
    weight: np.ndarray

    @property
    def steps(self) -> np.ndarray:
        """Trapezoidal weights of the samples [N, I] in s, as in Eq. 8."""
        return trapezoid(self.dt)


def series(windows: Windows) -> WindowSeries:
    """Windows as physical models take them."""
    measured, wind = windows.state, windows.wind
    return WindowSeries(
        measured,
        windows.actuator,
        true_wind(measured, wind) if wind.shape[-1] else np.zeros((*measured.shape[:2], 2)),
        windows.dt,
        np.ones(len(measured)),
    )


def true_wind(state: np.ndarray, wind: np.ndarray) -> np.ndarray:
    """The wind over ground [..., 2], where it comes FROM along x₀ and y₀, of the apparent one.

    state   [..., 6]  channels.STATE
    wind    [..., 2]  apparent wind speed [m/s] and angle [rad]
    """
    ahead = wind[..., 0] * np.cos(wind[..., 1]) - state[..., 1]
    starboard = wind[..., 0] * np.sin(wind[..., 1]) - state[..., 3]
    c, s = np.cos(state[..., 4]), np.sin(state[..., 4])
    return np.stack(in_earth_axes(ahead, starboard, c, s), -1)


def apparent_wind(state: np.ndarray, true: np.ndarray) -> np.ndarray:
    """The inverse of `true_wind`: speed and angle in (-π, π] [..., 2]."""
    c, s = np.cos(state[..., 4]), np.sin(state[..., 4])
    ahead, starboard = in_body_axes(true[..., 0], true[..., 1], c, s)
    ahead, starboard = ahead + state[..., 1], starboard + state[..., 3]
    return np.stack((np.hypot(ahead, starboard), np.arctan2(starboard, ahead)), -1)


def rate(model: Physical, theta: Array, state: Array, actuator: Array, wind: Array) -> Array:
    """ẋ [..., 6] of Eq. 2."""
    acceleration = model.acceleration(theta, state, actuator, wind)
    c, s = jnp.cos(state[..., 4]), jnp.sin(state[..., 4])
    north, east = in_earth_axes(state[..., 1], state[..., 3], c, s)
    return jnp.stack(
        (
            north,
            acceleration[..., 0],
            east,
            acceleration[..., 1],
            state[..., 5],
            acceleration[..., 2],
        ),
        axis=-1,
    )


@traced
def _rollout(model, theta, start, actuator, wind, dt):
    """[N, I, 6] of inputs [N, I - 1, ...], a step each."""

    def step(state, driven):
        at, blowing, length = driven
        state = state + length[:, None] * rate(model, theta, state, at, blowing)
        return state, state

    driven = (jnp.moveaxis(actuator, 1, 0), jnp.moveaxis(wind, 1, 0), dt.T)
    _, states = jax.lax.scan(step, start, driven)
    return jnp.concatenate((start[:, None], jnp.moveaxis(states, 0, 1)), axis=1)


def _fine(actuator, wind, dt, substeps: int):
    """Inputs held over each step, the step cut into `substeps`."""
    held = (actuator[:, :-1], wind[:, :-1], dt / substeps)
    if substeps == 1:
        return held
    return tuple(jnp.repeat(values, substeps, axis=1) for values in held)


def rollout(model: Physical, theta: np.ndarray, data: WindowSeries) -> np.ndarray:
    """Explicit Euler (Eq. 9) from the first measured state: states [N, I, 6].

    The paper's step is the sampling interval; a model with `substeps` cuts it, inputs held.
    """
    whole = padded(data)
    driven = _fine(whole.actuator, whole.wind, whole.dt, model.substeps)
    states = _rollout(model, theta, whole.measured[:, 0], *driven)
    return np.asarray(states)[: len(data.measured), :: model.substeps]


def padded(data: WindowSeries) -> WindowSeries:
    """Filled up with windows of weight 0 to the next power of two, and above WINDOWS_AT_A_TIME to
    a multiple of that: a shape that has been compiled once serves every selection of voyages."""
    count = len(data.measured)
    size = (
        -(-count // WINDOWS_AT_A_TIME) * WINDOWS_AT_A_TIME
        if count > WINDOWS_AT_A_TIME
        else max(8, 1 << (count - 1).bit_length())
    )
    if size == count:
        return data
    last = data._replace(weight=np.zeros(count))
    return WindowSeries(
        *(
            np.concatenate((values, np.repeat(filler[-1:], size - count, axis=0)))
            for values, filler in zip(data, last, strict=True)
        )
    )


@traced
def _linearised(model, theta, start, actuator, wind, dt, *, free=None):
    """`free`: indices of the parameters to differentiate by; all of them if None."""
    actuator, wind, dt = _fine(actuator, wind, dt, model.substeps)
    states = _rollout(model, theta, start, actuator, wind, dt)
    moving = tuple(range(len(theta))) if free is None else free
    parts = jax.lax.split(theta, [1] * len(theta))
    count = len(moving)

    def slopes(state, at, blowing):
        def acceleration(state, values):
            put = dict(zip(moving, jax.lax.split(values, [1] * count), strict=True))
            whole = jnp.concatenate([put.get(i, part) for i, part in enumerate(parts)])
            return model.acceleration(whole, state, at, blowing)

        values = jnp.concatenate([parts[i] for i in moving])
        return jax.jacrev(acceleration, argnums=(0, 1))(state, values)

    by_state, by_theta = jax.vmap(jax.vmap(slopes))(states[:, :-1], actuator, wind)

    def step(sensitivity, along):
        state, a, b, length = along
        c, s = jnp.cos(state[:, 4, None]), jnp.sin(state[:, 4, None])
        north, east = in_earth_axes(state[:, 1, None], state[:, 3, None], c, s)
        du, dv, dpsi, dr = (sensitivity[:, i] for i in (1, 3, 4, 5))
        of_north, of_east = in_earth_axes(du, dv, c, s)
        motion = a @ sensitivity + b
        change = jnp.stack(
            (
                of_north - east * dpsi,
                motion[:, 0],
                of_east + north * dpsi,
                motion[:, 1],
                dr,
                motion[:, 2],
            ),
            axis=1,
        )
        sensitivity = sensitivity + length[:, None, None] * change
        return sensitivity, sensitivity

    first = jnp.zeros((start.shape[0], 6, count))
    along = (
        jnp.moveaxis(states[:, :-1], 1, 0),
        jnp.moveaxis(by_state, 1, 0),
        jnp.moveaxis(by_theta, 1, 0),
        dt.T,
    )
    _, path = jax.lax.scan(step, first, along)
    path = jnp.concatenate((first[:, None], jnp.moveaxis(path, 0, 1)), axis=1)
    return states[:, :: model.substeps], path[:, :: model.substeps]


def linearised(
    model: Physical, theta: np.ndarray, data: WindowSeries
) -> tuple[np.ndarray, np.ndarray]:
    """States [N, I, 6] and their derivatives by θ [N, I, 6, P], exact for the Euler rollout."""
    whole = padded(data)
    states, slopes = _linearised(
        model, theta, whole.measured[:, 0], whole.actuator, whole.wind, whole.dt
    )
    count = len(data.measured)
    return np.asarray(states)[:count], np.asarray(slopes)[:count]


@traced
def _normal(model, theta, measured, actuator, wind, dt, steps, weight, *, free=None):
    states, slopes = _linearised(model, theta, measured[:, 0], actuator, wind, dt, free=free)
    scale = jnp.sqrt(steps)[..., None] * jnp.array(VELOCITY_WEIGHTS)
    error = (states[..., VELOCITY_COLUMNS] - measured[..., VELOCITY_COLUMNS]) * scale
    slope = slopes[:, :, VELOCITY_COLUMNS] * scale[..., None]
    pull = jnp.einsum("nki,nkip->np", error, slope)
    loss = (error**2).sum((1, 2))
    # A window of weight 0 may have diverged, and 0 · inf is not 0.
    used = (weight > 0.0)[:, None, None, None]
    slope = jnp.where(used, slope * jnp.sqrt(weight)[:, None, None, None], 0.0)
    flat = slope.reshape(-1, slope.shape[-1])
    return loss, pull, flat.T @ flat


@dataclass(frozen=True)
class Normal:
    """Least squares of the rollout error around one θ, summed over windows.

    loss   [N]     L of each window (Eq. 8)
    pull   [N, P]  half its gradient
    gram   [P, P]  weighted sum of JᵀJ
    """

    loss: np.ndarray
    pull: np.ndarray
    gram: np.ndarray


def normal(
    model: Physical, theta: np.ndarray, data: WindowSeries, free: tuple[int, ...] | None = None
) -> Normal:
    """Loss, gradient and Gauss-Newton matrix in flat memory: WINDOWS_AT_A_TIME windows at once.

    free   indices of the parameters wanted; then P is their number
    """
    whole = padded(data)
    parts = [
        _normal(
            model,
            theta,
            *(
                values[at : at + WINDOWS_AT_A_TIME]
                for values in (*whole[:4], whole.steps, whole.weight)
            ),
            free=free,
        )
        for at in range(0, len(whole.measured), WINDOWS_AT_A_TIME)
    ]
    count = len(data.measured)
    loss, pull = (np.concatenate([p[i] for p in parts])[:count] for i in (0, 1))
    return Normal(loss, pull, np.sum([p[2] for p in parts], axis=0))


def losses(model: Physical, theta: np.ndarray, data: WindowSeries) -> np.ndarray:
    """L of each window [N], infinite where the rollout diverges."""
    return window_loss(rollout(model, theta, data) - data.measured, data.dt)


def pick(data: WindowSeries, rows: Sequence[int] | np.ndarray | slice) -> WindowSeries:
    """Some of the windows."""
    return WindowSeries(*(values[rows] for values in data))


def spread(
    model: Physical, theta: np.ndarray, covariance: np.ndarray, data: WindowSeries
) -> np.ndarray:
    """Standard deviation of the states [N, I, 6] that the parameters' uncertainty alone makes."""
    parts = []
    for at in range(0, len(data.measured), WINDOWS_AT_A_TIME):
        part = pick(data, slice(at, at + WINDOWS_AT_A_TIME))
        slopes = linearised(model, theta, part)[1]
        with np.errstate(over="ignore", invalid="ignore"):
            variance = np.einsum("nkip,pq,nkiq->nki", slopes, covariance, slopes, optimize=True)
        known = np.isfinite(variance)
        parts.append(np.sqrt(np.where(known, np.maximum(variance, 0.0), np.inf)))
    return np.concatenate(parts)


@dataclass(frozen=True)
class Simulator:
    """Equations, their numbers, and how sure those are: what a run of a physical model holds."""

    model: Physical
    theta: np.ndarray  # [P]
    covariance: np.ndarray  # [P, P]

    def simulate(self, windows: Windows) -> np.ndarray:
        """States [N, I, 6], as shiplog.simulation.rollout gives them."""
        return rollout(self.model, self.theta, series(windows))

    def spread(self, windows: Windows) -> np.ndarray:
        """[N, I, 6]"""
        return spread(self.model, self.theta, self.covariance, series(windows))
