"""Segments by JAX: of a model that no kernel can be made of, and the reference of the others.

The path is JAX's, and so are its slopes ∂f/∂x, ∂f/∂u and ∂f/∂θ at the instants of the steps; the
columns that follow of them are a kernel's, which is the same for all models.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from shiplog.machine.jit_cache import traced
from shiplog.simulation.jax_rollouts import rate
from shiplog.simulation.kernel import given_slopes

SEGMENTS_AT_A_TIME = 64


def _ab2(values: Array, before: Array, first) -> Array:
    """(3/2) fₖ - (1/2) fₖ₋₁, the slope of a step of Adams-Bashforth; f₀ (Euler) of the first."""
    return jnp.where(first, values, 1.5 * values - 0.5 * before)


@traced
def states_along(model, theta, start, acceleration, driven, step):
    """xₖ₊₁ = xₖ + h ((3/2) fₖ - (1/2) fₖ₋₁), fₖ = ẋ(xₖ, uₖ; θ) + (0, a_u, 0, a_v, 0, a_r)ₖ: states
    [S, K, 6] from `start` [S, 6] on, `step` h [s], with an `acceleration` a [S, K, 3] added.

    driven   [S, K, A + 3]  uₖ: actuators, share of the campaign, true wind
    """

    def advance(carry, along):
        state, before, first = carry
        now, extra = along
        slope = rate(model, theta, state, now[..., :-2], now[..., -2:])
        slope = slope.at[..., jnp.array([1, 3, 5])].add(extra)
        state_next = state + step * _ab2(slope, before, first)
        return (state_next, slope, False), state

    along = (jnp.moveaxis(driven, 1, 0), jnp.moveaxis(acceleration, 1, 0))
    _, states = jax.lax.scan(advance, (start, jnp.zeros_like(start), True), along)
    return jnp.moveaxis(states, 0, 1)


@traced
def _slopes(model, theta, states, driven):
    """∂f/∂x [3, 6, S K], ∂f/∂u [3, D, S K] and ∂f/∂θ [3, P, S K], f = (u̇, v̇, ṙ) of the model.

    In single precision, in half the time: six digits of a slope are more than a linearisation has,
    and what it is about is simulated in double. Sample by sample last, each with a θ of its own,
    and one row of ν̇ after another: that is what a compiler makes straight loops of.
    """
    model, theta, states, driven = jax.tree.map(
        lambda values: jnp.asarray(values, jnp.float32), (model, theta, states, driven)
    )
    states, driven = (values.reshape(-1, values.shape[-1]).T for values in (states, driven))
    count = states.shape[1]
    by = (states, driven, jnp.broadcast_to(theta[:, None], (len(theta), count)))

    def one(state, now, values):
        return model.acceleration(values, state, now[:-2], now[-2:])

    _, back = jax.vjp(jax.vmap(one, in_axes=1, out_axes=1), *by)
    rows = jnp.broadcast_to(jnp.eye(3, dtype=jnp.float32)[..., None], (3, 3, count))
    return jax.lax.map(back, rows)


def accelerations(
    model: Any, theta: np.ndarray, states: np.ndarray, driven: np.ndarray
) -> np.ndarray:
    """f(x, u; θ) [S, n, 3] at states x [S, n, 6] and what drives u [S, n, A + 3]."""
    modelled = np.empty((*states.shape[:2], 3))
    for part, filled in chunks(len(states)):
        found = _accelerations(model, theta, filled(states), filled(driven))
        modelled[part] = np.asarray(found)[: len(modelled[part])]
    return modelled


@traced
def _accelerations(model, theta, states, driven):
    return model.acceleration(theta, states, driven[..., :-2], driven[..., -2:])


def chunks(count: int) -> Iterator[tuple[slice, Callable[[np.ndarray], np.ndarray]]]:
    """SEGMENTS_AT_A_TIME of so many segments after the other, and how each chunk's values are
    picked and filled up: one compilation serves all."""
    for at in range(0, count, SEGMENTS_AT_A_TIME):
        part = slice(at, min(at + SEGMENTS_AT_A_TIME, count))

        def filled(values: np.ndarray, part: slice = part) -> np.ndarray:
            own = values[part]
            lack = SEGMENTS_AT_A_TIME - len(own)
            return np.concatenate((own, np.repeat(own[-1:], lack, axis=0))) if lack else own

        yield part, filled


def _instant_slopes(model, theta, states, driven, step, *, coefficients) -> list[np.ndarray]:
    """∂f/∂x, ∂f/∂u, ∂f/∂θ (`_slopes`) at every instant of a step, by segments [S, K, 3, 6 or D or
    P; P only where `coefficients` are asked for]. Those of a model that is smooth and takes long (a
    network) are worked out as often as they change, and go straight between:
    A(tₖ) = A_left + (tₖ - t_left)/(t_right - t_left) (A_right - A_left)."""
    instants = states.shape[1]
    stride = max(round(model.smooth / step), 1)
    at = np.unique(np.append(np.arange(0, instants, stride), instants - 1))
    # one compilation serves both: it takes longer than all that it saves to leave θ out
    *found, by_theta = _slopes(model, theta, states[:, at], driven[:, at])
    found.append(by_theta if coefficients else np.zeros((3, 0, by_theta.shape[-1]), np.float32))
    right = np.clip(np.searchsorted(at, np.arange(instants)), 1, len(at) - 1)
    part = ((np.arange(instants) - at[right - 1]) / (at[right] - at[right - 1])).astype(np.float32)
    every = []
    for values in found:
        values = np.asarray(values).reshape(*values.shape[:2], len(states), len(at))
        if stride > 1:
            left = values[..., right - 1]
            values = left + part * (values[..., right] - left)
        every.append(np.moveaxis(values, (2, 3), (0, 1)))
    return every


def columns(
    model: Any,
    theta: np.ndarray,
    start: np.ndarray,
    acceleration: np.ndarray,
    driven: np.ndarray,
    hats: np.ndarray,
    step: float,
    bins: int,
    moved: tuple[np.ndarray, np.ndarray, int] | None = None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """As `kernel.paths.columns`, chunk by chunk."""
    ys, zs, js = [], [], []
    for part, filled in chunks(len(start)):
        inputs = filled(driven)
        states = np.asarray(
            states_along(model, theta, filled(start), filled(acceleration), inputs, step)
        )
        slopes = _instant_slopes(model, theta, states, inputs, step, coefficients=moved is not None)
        keep = slice(part.stop - part.start)
        states = states[keep]
        pairs = 0.5 * (states[:, 1:] + states[:, :-1])
        ys.append(pairs.reshape(len(states), bins, -1, 6).mean(2))
        some = None if moved is None else (moved[0], moved[1][part], moved[2])
        z, j = given_slopes.columns(states, [of[keep] for of in slopes], hats, step, bins, some)
        zs.append(z)
        js.append(j)
    y, z = np.concatenate(ys), np.concatenate(zs)
    return y, z, np.concatenate(js) if moved is not None else None
