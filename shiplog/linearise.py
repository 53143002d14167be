"""Short rollouts along the measured path, and how everything that could be wrong bends them.

A free rollout of a minute loses the path of a ship that turns easily, and its derivatives are
then of another voyage. So each segment of 30 s is first pulled onto what was measured, by its
initial state and a slowly varying acceleration; around that path the simulation is linear in all
that follows: y ≈ y* + Z (z - z*) + J d.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from shiplog import variational
from shiplog.segments import BIN, KNOT, NODE_ROWS, Cut, Grid
from shiplog.sensitivity import Physical, rate
from shiplog.traced import traced

jax.config.update("jax_enable_x64", True)

CHUNK = 64  # segments at a time


class Smooth(Physical, Protocol):
    """Equations that are linearised along a path."""

    @property
    def smooth(self) -> float:
        """s within which their derivatives may be taken to go straight; 0 where none do."""
        ...


# --- integration: two-step Adams-Bashforth, one evaluation a step ---------------------------------


def _ab2(values: Array, before: Array, first) -> Array:
    return jnp.where(first, values, 1.5 * values - 0.5 * before)


@traced
def _path(model, theta, start, push, driven, step):
    """States [S, K, 6] at the nodes, accelerations `push` [S, K, 3] added."""

    def advance(carry, along):
        state, before, first = carry
        now, extra = along
        slope = rate(model, theta, state, now[..., :-2], now[..., -2:])
        slope = slope.at[..., jnp.array([1, 3, 5])].add(extra)
        state_next = state + step * _ab2(slope, before, first)
        return (state_next, slope, False), state

    along = (jnp.moveaxis(driven, 1, 0), jnp.moveaxis(push, 1, 0))
    _, states = jax.lax.scan(advance, (start, jnp.zeros_like(start), True), along)
    return jnp.moveaxis(states, 0, 1)


@traced
def _slopes(model, theta, states, driven, *, coefficients):
    """∂ν̇ by state [3, 6, S K], by what drives [3, D, S K] and by θ [3, P or 0, S K].

    In single precision, in half the time: six digits of a slope are more than a linearisation has,
    and what it is about is simulated in double. Sample by sample last, each with a θ of its own,
    and one row of ν̇ after another: that is what a compiler makes straight loops of.
    """
    model, theta, states, driven = jax.tree.map(
        lambda values: jnp.asarray(values, jnp.float32), (model, theta, states, driven)
    )
    states, driven = (values.reshape(-1, values.shape[-1]).T for values in (states, driven))
    count = states.shape[1]
    by = (states, driven)
    if coefficients:
        by = (*by, jnp.broadcast_to(theta[:, None], (len(theta), count)))

    def one(state, now, values=theta):
        return model.acceleration(values, state, now[:-2], now[-2:])

    _, back = jax.vjp(jax.vmap(one, in_axes=1, out_axes=1), *by)
    rows = jnp.broadcast_to(jnp.eye(3, dtype=jnp.float32)[..., None], (3, 3, count))
    found = jax.lax.map(back, rows)
    return found if coefficients else (*found, jnp.zeros((3, 0, count), jnp.float32))


# --- in numpy: one record, in flat memory ---------------------------------------------------------


@dataclass(frozen=True)
class Path:
    """Where each segment was linearised: start [S, 6] and knots [S, 3, J] of acceleration."""

    start: np.ndarray
    push: np.ndarray

    def at_nodes(self, g: Grid) -> np.ndarray:
        return np.einsum("scj,kj->skc", self.push, g.weights)

    @property
    def known(self) -> np.ndarray:
        """[S, 6 + 3J] what a linearisation puts back: the start is free, and its own value its
        mean."""
        return np.concatenate((np.zeros_like(self.start), self.push.reshape(len(self.push), -1)), 1)


@dataclass(frozen=True)
class Linear:
    """Segments linearised: residual = Z z + J d + noise.

    e   [S, B, 6]       measured less simulated, with the path's own z put back
    z   [S, B, 6, Z]    by initial state (6) and knots (3J)
    j   [S, B, 6, C]    by θ
    """

    cut: Cut
    path: Path
    e: np.ndarray
    z: np.ndarray
    j: np.ndarray

    def pick(self, keep: np.ndarray) -> Linear:
        """Some of the segments."""
        path = Path(self.path.start[keep], self.path.push[keep])
        return Linear(self.cut.pick(keep), path, self.e[keep], self.z[keep], self.j[keep])

    def less(self, pushed: np.ndarray) -> Linear:
        """Without what an acceleration `pushed` [S, 3J] at the knots does to the observations."""
        return replace(self, e=self.e - np.einsum("sbcz,sz->sbc", self.z[..., 6:], pushed))

    def beside(self, other: Linear) -> Linear:
        """These segments and others of the same record."""
        path = Path(*(_both(self.path, other.path, name) for name in ("start", "push")))
        return Linear(self.cut.beside(other.cut), path, *(_both(self, other, n) for n in "ezj"))


def _both(one: object, other: object, name: str) -> np.ndarray:
    return np.concatenate((getattr(one, name), getattr(other, name)))


@dataclass(frozen=True)
class Wide:
    """How freely a path may be pulled: noise of one observation [6], of the start [6], and of
    the acceleration's knots [3]."""

    noise: np.ndarray
    start: np.ndarray
    push: np.ndarray


def first_path(model: Smooth, theta: np.ndarray, segments: Cut, g: Grid) -> Path:
    """From the measured path itself: its acceleration less the model's."""
    y = segments.y
    centre = (np.arange(g.bins) + 0.5) * BIN
    knots = np.arange(g.knots) * KNOT
    velocity = y[..., [1, 3, 5]]
    change = np.diff(velocity, axis=1) / BIN
    at = 0.5 * (centre[1:] + centre[:-1])
    accelerated = resampled(at, change, knots)
    states = resampled(centre, y, knots)
    per = round(KNOT / (g.step * NODE_ROWS))
    said = accelerations(model, theta, states, segments.driven[:, ::per])
    start = y[:, 0] - 0.5 * BIN * (y[:, 1] - y[:, 0]) / BIN
    return Path(start, np.moveaxis(accelerated - said, -1, 1))


def accelerations(
    model: Smooth, theta: np.ndarray, states: np.ndarray, driven: np.ndarray
) -> np.ndarray:
    """ν̇ [S, n, 3] at states [S, n, 6]."""
    said = np.empty((*states.shape[:2], 3))
    for part, filled in _chunks(len(states)):
        found = _accelerations(model, theta, filled(states), filled(driven))
        said[part] = np.asarray(found)[: len(said[part])]
    return said


@traced
def _accelerations(model, theta, states, driven):
    return model.acceleration(theta, states, driven[..., :-2], driven[..., -2:])


def resampled(at: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Linear in between, constant beyond; values [S, n, c] at times [n]."""
    right = np.clip(np.searchsorted(at, wanted), 1, len(at) - 1)
    part = np.clip((wanted - at[right - 1]) / (at[right] - at[right - 1]), 0.0, 1.0)
    left = values[:, right - 1]
    return left + part[:, None] * (values[:, right] - left)


def pulled(
    model: Smooth,
    theta: np.ndarray,
    segments: Cut,
    g: Grid,
    wide: Wide,
    path: Path | None = None,
    rounds: int = 2,
) -> Path:
    """Each segment's path onto what was measured: Gauss-Newton in start and knots."""
    path = path or first_path(model, theta, segments, g)
    for _ in range(rounds):
        y, z = _run(model, theta, segments, path, g)
        path = _closer(path, segments.y - y, z, segments.used, wide)
    return path


def ahead(linear: Linear, d: np.ndarray, wide: Wide) -> Path:
    """Where a linearisation expects a path to be pulled once θ has moved by d [C], by one step of
    Gauss-Newton: nothing is simulated, and what is not linear shows when it is linearised there."""
    gap = linear.e - linear.j @ d - np.einsum("sbcz,sz->sbc", linear.z, linear.path.known)
    return _closer(linear.path, gap, linear.z, linear.cut.used, wide)


def _closer(path: Path, gap: np.ndarray, z: np.ndarray, used: np.ndarray, wide: Wide) -> Path:
    """One step of Gauss-Newton: gap [S, B, 6] is what was measured less what was simulated."""
    count, _, _, size = z.shape
    prior = np.concatenate((wide.start, np.repeat(wide.push, path.push.shape[-1])))
    weight = np.where(used, 1.0 / wide.noise, 0.0)
    scaled = (z * weight[..., None]).reshape(count, -1, size)
    # the start is free about where it stands, the knots about zero
    turned = np.swapaxes(scaled, 1, 2)
    normal = turned @ scaled + np.diag(prior**-2.0)
    pull = (turned @ (gap * weight).reshape(count, -1, 1))[..., 0] - path.known * prior**-2.0
    step = np.linalg.solve(normal, pull[..., None])[..., 0]
    return Path(path.start + step[:, :6], path.push + step[:, 6:].reshape(path.push.shape))


def linear(
    model: Smooth,
    theta: np.ndarray,
    segments: Cut,
    g: Grid,
    path: Path,
    moved: np.ndarray,
    shown: np.ndarray,
) -> Linear:
    """Around a path, by all of θ, of which the last Q are causes' numbers.

    moved   [S, K, D, Q]  how those change what drives, where a cause reads otherwise
    shown   [S, B, 6, Q]  how they change what was measured
    """
    y, columns = _run(model, theta, segments, path, g, moved)
    size = 6 + 3 * g.knots
    read = moved.shape[-1]
    z, j = columns[..., :size].copy(), columns[..., size:].copy()
    j[..., len(theta) - read :] -= shown
    e = segments.y - y + np.einsum("sbcz,sz->sbc", z, path.known)
    return Linear(segments, path, e, z, j)


def _chunks(count: int) -> Iterator[tuple[slice, Callable[[np.ndarray], np.ndarray]]]:
    """CHUNK of so many segments after the other, and how each chunk's values are picked and filled
    up: one compilation serves all."""
    for at in range(0, count, CHUNK):
        part = slice(at, min(at + CHUNK, count))

        def filled(values: np.ndarray, part: slice = part) -> np.ndarray:
            own = values[part]
            lack = CHUNK - len(own)
            return np.concatenate((own, np.repeat(own[-1:], lack, axis=0))) if lack else own

        yield part, filled


def _along(model, theta, states, driven, step, *, coefficients) -> list[np.ndarray]:
    """`_slopes` at every node, by segments: [S, K, 3, 6 or D or P]. Those of a model that is smooth
    and takes long (a network) are worked out as often as they change, and go straight between."""
    nodes = states.shape[1]
    stride = max(round(model.smooth / step), 1)
    at = np.unique(np.append(np.arange(0, nodes, stride), nodes - 1))
    found = _slopes(model, theta, states[:, at], driven[:, at], coefficients=coefficients)
    right = np.clip(np.searchsorted(at, np.arange(nodes)), 1, len(at) - 1)
    part = ((np.arange(nodes) - at[right - 1]) / (at[right] - at[right - 1])).astype(np.float32)
    every = []
    for values in found:
        values = np.asarray(values).reshape(*values.shape[:2], len(states), len(at))
        if stride > 1:
            left = values[..., right - 1]
            values = left + part * (values[..., right] - left)
        every.append(np.moveaxis(values, (2, 3), (0, 1)))
    return every


def _run(model, theta, segments, path, g, moved=None):
    """y [S, B, 6] and its columns [S, B, 6, 6 + 3J (+ P)]: start, knots, θ."""
    push = path.at_nodes(g)
    per = (g.nodes - 1) // g.bins
    ys, columns = [], []
    for part, filled in _chunks(len(segments)):
        driven = filled(segments.driven)
        states = np.asarray(
            _path(model, theta, filled(path.start), filled(push), driven, segments.step)
        )
        keep = slice(part.stop - part.start)
        by_state, by_driven, by_theta = _along(
            model, theta, states, driven, segments.step, coefficients=moved is not None
        )
        states = states[keep]
        how = moved[part] if moved is not None else np.zeros((*driven[keep].shape, 0))
        pairs = 0.5 * (states[:, 1:] + states[:, :-1])
        ys.append(pairs.reshape(len(states), g.bins, per, 6).mean(2))
        columns.append(
            variational.columns(
                states, by_state, by_driven, by_theta, how, g.weights, segments.step, g.bins
            )
        )
    return np.concatenate(ys), np.concatenate(columns)
