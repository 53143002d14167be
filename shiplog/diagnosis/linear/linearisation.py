"""Short rollouts along the measured path, and their derivatives by everything that may be wrong.

A free rollout of a minute soon leaves the path of a ship that turns easily, and its derivatives are
then those of another voyage. Each segment is therefore first fitted to the measurement, by its
initial state and a slowly varying acceleration, z = (δξ, a). About this smoothed path the
simulation is linear:

    y ≈ y* + Z (z - z*) + H d,   d = θ - θ*

Where training divided a second into several steps, the time between two instants is divided too. A
segment in which the model still diverges is left out and counted (`Linear.lost`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from shiplog.diagnosis.linear import variational_equations
from shiplog.diagnosis.linear.linear_segments import Linear, Path, Wide
from shiplog.diagnosis.linear.measurement_correction import Moved
from shiplog.diagnosis.linear.segments import Cut, SegmentGrid
from shiplog.machine.jit_cache import traced
from shiplog.simulation.jax_rollouts import rate
from shiplog.simulation.window_series import Physical

SEGMENTS_AT_A_TIME = 64
STILLEST = 1e-3  # m, m/s, rad or rad/s: no ship is measured as still as that
KIND = np.array(((0, 2), (1, 3), (0, 2), (1, 3), (4, 4), (5, 5)))  # channels of one width
RUN_AWAY = 10.0  # expected distances from its measurement, beyond which a path has diverged
MOST_PULLS = 20  # steps of a path towards its measurement, at most
PULLED_NATS = 0.5  # gain of a step in any segment: with less, the path has converged


class Smooth(Physical, Protocol):
    """Equations that are linearised along a path."""

    @property
    def smooth(self) -> float:
        """s within which their derivatives may be taken to go straight; 0 where none do."""
        ...


# --- integration: two-step Adams-Bashforth, one evaluation a step ---------------------------------


def stable_steps(model: Smooth, step: float) -> int:
    """Steps between two instants with which the integration is as stable as in training.

    On the negative real axis the explicit Euler method is stable for |λ| h up to 2, two-step
    Adams-Bashforth up to 1 (Hairer, Nørsett & Wanner 1993, Sec. III.1 and V.1): of a model that
    training cut into n steps a second, |λ| may reach 2n, and a step must not exceed 1/(2n).
    """
    return max(1, math.ceil(2.0 * model.substeps * step - 1e-9))


def _interpolate(values: np.ndarray, many: int) -> np.ndarray:
    """v(k + i/m) = vₖ + i/m (vₖ₊₁ - vₖ), i < m: of values [S, K, ...] those at m = `many` instants
    for one, [S, (K - 1) m + 1, ...]."""
    if many == 1:
        return values
    part = np.arange(many).reshape(1, 1, many, *[1] * (values.ndim - 2)) / many
    left, right = values[:, :-1, None], values[:, 1:, None]
    fine = (len(values), (values.shape[1] - 1) * many, *values.shape[2:])
    inside = (left + part * (right - left)).reshape(fine)
    return np.concatenate((inside, values[:, -1:]), axis=1)


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


# --- in numpy: one record, in flat memory ---------------------------------------------------------


def first_path(model: Smooth, theta: np.ndarray, segments: Cut, g: SegmentGrid) -> Path:
    """ξ* = y₀ - (y₁ - y₀)/2 and aⱼ* = Δν/Δt - f(x, u; θ) at the nodes: the measured acceleration,
    by differences of the means of bins, less the model's at the measured state."""
    y = segments.y
    centre = (np.arange(g.bins) + 0.5) * g.bin
    nodes = np.arange(g.nodes) * g.node_step
    velocity = y[..., [1, 3, 5]]
    change = np.diff(velocity, axis=1) / g.bin
    at = 0.5 * (centre[1:] + centre[:-1])
    accelerated = resampled(at, change, nodes)
    states = resampled(centre, y, nodes)
    per = round(g.node_step / (g.step * g.every))
    modelled = accelerations(model, theta, states, segments.driven[:, ::per])
    start = y[:, 0] - 0.5 * (y[:, 1] - y[:, 0])
    return Path(start, np.moveaxis(accelerated - modelled, -1, 1))


def accelerations(
    model: Smooth, theta: np.ndarray, states: np.ndarray, driven: np.ndarray
) -> np.ndarray:
    """f(x, u; θ) [S, n, 3], the model's (u̇, v̇, ṙ) in m/s² and rad/s², at states x [S, n, 6] and
    what drives u [S, n, A + 3]."""
    modelled = np.empty((*states.shape[:2], 3))
    for part, filled in chunks(len(states)):
        found = _accelerations(model, theta, filled(states), filled(driven))
        modelled[part] = np.asarray(found)[: len(modelled[part])]
    return modelled


@traced
def _accelerations(model, theta, states, driven):
    return model.acceleration(theta, states, driven[..., :-2], driven[..., -2:])


def resampled(at: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """v(t) = vᵢ + (t - tᵢ)/(tᵢ₊₁ - tᵢ) (vᵢ₊₁ - vᵢ) at the times `wanted` [m], constant beyond; of
    values [S, n, c] at times `at` [n]."""
    right = np.clip(np.searchsorted(at, wanted), 1, len(at) - 1)
    part = np.clip((wanted - at[right - 1]) / (at[right] - at[right - 1]), 0.0, 1.0)
    left = values[:, right - 1]
    return left + part[:, None] * (values[:, right] - left)


def fit_path(
    model: Smooth,
    theta: np.ndarray,
    segments: Cut,
    g: SegmentGrid,
    wide: Wide,
    path: Path | None = None,
    rounds: int = MOST_PULLS,
    about: np.ndarray | None = None,
) -> Path:
    """The path of each segment that is most probable given its measurement: Gauss-Newton in
    z = (δξ, a), until it converges or for so many rounds. It minimises

        Σ_b ((y_b - y_b(z))/σ)² + Σ (δξ/σ₀)² + Σⱼ ((aⱼ - āⱼ)/σₐ)²,   σ, σ₀, σₐ of `wide`,

    where each step's δξ counts from the start before it: a start far away is not held back.

    theta   θ* [C]
    about   ā [S, 3J] acceleration at the nodes that is expected of it; zero unless given
    """
    path = path or first_path(model, theta, segments, g)
    for _ in range(rounds):
        y, z = simulated(model, theta, segments, path, g)
        path, gained = _closer(path, segments.y - y, z, segments.used, wide, about)
        if gained < PULLED_NATS:
            break
    return path


def predict_path(
    linear: Linear, d: np.ndarray, wide: Wide, about: np.ndarray | None = None
) -> Path:
    """Where a linearisation expects `fit_path` to end once θ has moved by d [C]: one step of
    Gauss-Newton from the gap y - y* - J d = e - J d - Z z*. Nothing is simulated; what is not
    linear shows when the model is linearised there. `about` as in `fit_path`."""
    gap = linear.e - linear.j @ d - np.einsum("sbcz,sz->sbc", linear.z, linear.path.coordinates)
    return _closer(linear.path, gap, linear.z, linear.cut.used, wide, about)[0]


def _closer(
    path: Path, gap: np.ndarray, z: np.ndarray, used: np.ndarray, wide: Wide,
    about: np.ndarray | None,
) -> tuple[Path, float]:  # fmt: skip
    """One step of Gauss-Newton, and the most nats that it is expected to gain in a segment.

        N = Zᵀ R⁻¹ Z + P⁻¹,   q = Zᵀ R⁻¹ (y - y*) - P⁻¹ (z* - (0, ā)),   δz = N⁻¹ q,
        gain = ½ δzᵀ q

    with R = diag(σ²) and P = diag(σ₀², σₐ²) of `wide`.

    gap   y - y* [S, B, 6], measured less simulated
    z     Z [S, B, 6, 6 + 3J]

    A path that diverged stays where it was.
    """
    count, _, _, size = z.shape
    away = np.logical_not(np.isfinite(gap).all((1, 2)) & np.isfinite(z).all((1, 2, 3)))
    if away.any():
        gap, z, used = gap.copy(), z.copy(), used & ~away[:, None, None]
        gap[away], z[away] = 0.0, 0.0
    prior = np.concatenate((wide.start, np.repeat(wide.acceleration, path.acceleration.shape[-1])))
    weight = np.where(used, 1.0 / wide.noise, 0.0)
    Z = (z * weight[..., None]).reshape(count, -1, size)  # R^-½ Z
    # the start is free about where it stands, the nodes about what is expected of them
    off = path.coordinates
    if about is not None:
        off[:, 6:] -= about
    Zt = np.swapaxes(Z, 1, 2)
    N = Zt @ Z + np.diag(prior**-2.0)
    q = (Zt @ (gap * weight).reshape(count, -1, 1))[..., 0] - off * prior**-2.0
    q[away] = 0.0  # else an acceleration that is not finite would be the gain of all
    step = np.linalg.solve(N, q[..., None])[..., 0]
    closer = Path(
        path.start + step[:, :6], path.acceleration + step[:, 6:].reshape(path.acceleration.shape)
    )
    return closer, 0.5 * float((step * q).sum(1).max(initial=0.0))


def linear(
    model: Smooth,
    theta: np.ndarray,
    segments: Cut,
    g: SegmentGrid,
    path: Path,
    moved: Moved,
    observed: np.ndarray,
    wide: Wide | None = None,
) -> Linear:
    """e = y - y* + Z z*,  J = H - O: the segments about a path, by all of θ [C], of which the last
    Q are causes' numbers.

    moved     [S, K, D, Q]  ∂u/∂θ: derivatives of actuators and wind by the causes' numbers
    observed  [S, B, 6, Q]  O = ∂y/∂θ: derivatives of the measurements by them
    wide      standard deviation of the path about its measurement: a path RUN_AWAY times that
              away has diverged; where it is not given, the span of the segments
    """
    y, columns = simulated(model, theta, segments, path, g, moved)
    lost = _lost(segments, y, columns, wide)
    if lost.any():
        used = segments.used & ~lost[:, None, None]
        segments = replace(segments, used=used)
        y, columns = np.where(lost[:, None, None], segments.y, y), columns.copy()
        columns[lost], observed = 0.0, np.where(lost[:, None, None, None], 0.0, observed)
    size = 6 + 3 * g.nodes
    *_, read = moved.shape
    z, j = columns[..., :size].copy(), columns[..., size:].copy()
    j[..., len(theta) - read :] -= observed
    e = segments.y - y + np.einsum("sbcz,sz->sbc", z, path.coordinates)
    e[lost] = 0.0  # columns of zeros times a path that is not finite are not zero
    return Linear(segments, path, e, z, j, lost)


def _lost(segments: Cut, y: np.ndarray, columns: np.ndarray, wide: Wide | None) -> np.ndarray:
    """[S] bool: where path or columns are not finite, or |y - y*| > RUN_AWAY √(σ₀² + σ²).

    Only measured bins count, and channels of one kind (both of position, both of velocity)
    have one width: that of `wide`, or the root mean square of what all segments span.
    """
    if wide is None:
        span = np.ptp(segments.y, axis=1)[:, KIND].max(-1)
        width = np.sqrt((span**2).mean(0))
    else:
        width = np.hypot(wide.start, wide.noise)[KIND].max(-1)
    with np.errstate(invalid="ignore", over="ignore"):
        off = np.where(segments.used, np.abs(segments.y - y), 0.0).max(1)
        near = (off <= RUN_AWAY * np.maximum(width, STILLEST)).all(-1)
    return ~(near & np.isfinite(y).all((1, 2)) & np.isfinite(columns).all((1, 2, 3)))


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


def simulated(model, theta, segments, path, g, moved=None):
    """y* [S, B, 6] and its columns (Z | H) [S, B, 6, 6 + 3J (+ C)]: by start, accelerations at the
    nodes, and θ where `moved` is given. Not finite where the model diverges."""
    with np.errstate(all="ignore"):
        return _every(model, theta, segments, path, g, moved)


def _every(model, theta, segments, path, g, moved):
    """`simulated`, chunk by chunk: y_b = (1/T) ∫ x dt over each bin of T s, by the trapezium."""
    many = stable_steps(model, segments.step)
    step = segments.step / many
    acceleration, hats = path.interpolate(g), _interpolate(g.weights[None], many)[0]
    per = many * (g.instants - 1) // g.bins
    ys, columns = [], []
    for part, filled in chunks(len(segments)):
        driven = _interpolate(filled(segments.driven), many)
        states = np.asarray(
            states_along(
                model,
                theta,
                filled(path.start),
                _interpolate(filled(acceleration), many),
                driven,
                step,
            )
        )
        keep = slice(part.stop - part.start)
        by_state, by_driven, by_theta = _instant_slopes(
            model, theta, states, driven, step, coefficients=moved is not None
        )
        states = states[keep]
        how = (
            np.zeros((*driven[keep].shape, 0))
            if moved is None
            else _interpolate(moved.dense(part), many)
        )
        pairs = 0.5 * (states[:, 1:] + states[:, :-1])
        ys.append(pairs.reshape(len(states), g.bins, per, 6).mean(2))
        columns.append(
            variational_equations.columns(
                states, by_state, by_driven, by_theta, how, hats, step, g.bins
            )
        )
    return np.concatenate(ys), np.concatenate(columns)
