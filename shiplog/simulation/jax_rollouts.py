"""Rollouts of physical models by JAX, and their exact derivatives: the reference, and the last
resort for a model that no kernel can be made of.

A rollout runs step by step; its derivatives need no second one. Along the path that it took,
ν̇ is differentiated at all samples at once (reverse mode: three outputs, any number of
parameters), and what a parameter does to the path is then a linear recursion.
"""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from shiplog.machine.jit_cache import traced
from shiplog.nomenclature.channels import VELOCITY_WEIGHTS
from shiplog.nomenclature.frames import in_earth_axes
from shiplog.simulation.window_series import VELOCITY_COLUMNS, Normal, Physical, WindowSeries

WINDOWS_AT_A_TIME = 128  # their sensitivities to 60 parameters are 45 MB


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


@traced
def _values(model, theta, state, actuator, wind):
    """ν̇ [n, 3], sample by sample."""

    def one(state, actuator, wind):
        return model.acceleration(theta, state, actuator, wind)

    return jax.vmap(one)(state, actuator, wind)


def values(model: Physical, theta: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """ν̇ [n, 3] of rows (state, what drives) [n, 6 + D]; filled up as `padded` does."""
    count = len(inputs)
    size = max(8, 1 << (count - 1).bit_length())
    rows = np.concatenate((inputs, np.repeat(inputs[-1:], size - count, axis=0)))
    return np.asarray(_values(model, theta, rows[:, :6], rows[:, 6:-2], rows[:, -2:]))[:count]


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
